"""The pictures of an agent's observation, as its configuration asks for them.

    album = Album(snapshot, world)      once a step
    album.pictures(seen)                for each agent

A specification may yield no picture (it wants the game's own pixels and the camera is elsewhere), one, or one for each
of the first teams. Pictures are functions of moment, frames and observation alone.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import cv2

from khala_bridge.observe.image import features, minimap, own, screen, titles
from khala_bridge.observe.image.canvas import Canvas, inner_px
from khala_bridge.observe.image.encoding import encode
from khala_bridge.observe.image.layers import LAYERS, colour, explain
from khala_bridge.observe.image.minimap import TeamMark
from khala_bridge.observe.image.moment import Moment

if TYPE_CHECKING:
    from collections.abc import Iterator

    from khala_bridge.frames import Camera, MapFrame
    from khala_bridge.observe.image.layers import Cells, FeatureLayer
    from khala_bridge.observe.image.lettering import Image
    from khala_bridge.observe.observation import AgentObservation
    from khala_bridge.observe.picture import Picture
    from khala_bridge.state import Snapshot
    from khala_bridge.task.images import ImageSpec

cv2.setNumThreads(1)  # a picture is too small to share, and agents of other processes need the other cores


class Drawing(NamedTuple):
    """A picture before it is encoded."""

    image: Image
    name: str
    title: str


class _Looker(NamedTuple):
    """A team with a screen."""

    name: str
    camera: Camera
    tags: frozenset[int]


class Album:
    """The pictures of one step; the parts that all agents share are made once."""

    def __init__(self, snapshot: Snapshot, world: MapFrame) -> None:
        """Take a snapshot, and the frame of its map."""
        self._moment = Moment(snapshot)
        self._world = world

    def pictures(self, seen: AgentObservation) -> tuple[Picture, ...]:
        """Return all pictures of an agent, in the order of its configuration."""
        return tuple(
            encode(drawing.image, drawing.name, drawing.title, spec.format, spec.quality)
            for spec in seen.agent.images
            for drawing in draw(spec, self._moment, self._world, seen)
        )


def draw(spec: ImageSpec, moment: Moment, world: MapFrame, seen: AgentObservation) -> Iterator[Drawing]:
    """Yield the drawings of one specification."""
    teams = [_Looker(t.view.name, t.camera, frozenset(t.team.tags)) for t in seen.teams if t.camera is not None]
    if spec.what == "minimap":
        yield from _minimap(spec, moment, world, teams, seen)
    elif not spec.of_teams:
        yield from _minimap_layer(spec, moment, world)
    else:
        draw = {"screen": _screen, "features": _features}.get(spec.what, _layer)
        for team in teams[: spec.max_teams]:
            yield from draw(spec, moment, team)


def _screen(spec: ImageSpec, moment: Moment, team: _Looker) -> Iterator[Drawing]:
    camera, size_px = team.camera, spec.size_px
    pixels = None
    if spec.is_taken:
        pixels = own.screen(moment.snapshot, camera, inner_px(size_px, camera.size))
    if pixels is not None:
        image, legend = screen.draw_over(pixels, moment, camera, team.tags, size_px, marks=spec.marks, grid=spec.grid)
    elif not spec.is_drawn:
        return
    else:
        image, legend = screen.draw(moment, camera, team.tags, size_px, marks=spec.marks, grid=spec.grid)
    yield Drawing(image, f"screen-{team.name}", titles.of_screen(team.name, camera.size, legend))


def _minimap(
    spec: ImageSpec, moment: Moment, world: MapFrame, teams: list[_Looker], seen: AgentObservation
) -> Iterator[Drawing]:
    pixels = None
    if spec.is_taken:
        pixels = own.minimap(moment.snapshot, inner_px(spec.size_px, world.minimap_size))
    if pixels is None and not spec.is_drawn:
        return
    sites = [TeamMark(team.name, team.camera) for team in teams]
    tags = _own_tags(moment, teams, seen)
    alerts = [alert.minimap for alert in seen.view.alerts]
    others = [(other.name, other.minimap) for other in seen.view.others]
    image, legend = minimap.draw(
        moment, world, sites, tags, alerts, spec.size_px, others=others, grid=spec.grid, pixels=pixels
    )
    yield Drawing(image, "minimap", titles.of_minimap(world.minimap_size, legend))


def _own_tags(moment: Moment, teams: list[_Looker], seen: AgentObservation) -> frozenset[int]:
    """Return the agent's own units: those of its teams, or all, if it orders the whole side."""
    if any(team.kind == "side" for team in seen.teams):
        return frozenset(subject.tag for subject in moment.subjects if subject.side == "own")
    return frozenset(tag for team in teams for tag in team.tags)


def _layer(spec: ImageSpec, moment: Moment, team: _Looker) -> Iterator[Drawing]:
    layer = LAYERS[spec.layer]
    extent = team.camera.size
    values = _values(spec, moment, team.camera, layer, inner_px(spec.size_px, extent))
    if values is not None:
        image = _on_canvas(spec, layer, extent, values)
        yield Drawing(image, f"{layer.name}-{team.name}", titles.of_layer(team.name, extent, layer))


def _minimap_layer(spec: ImageSpec, moment: Moment, world: MapFrame) -> Iterator[Drawing]:
    layer = LAYERS[spec.layer]
    extent = world.minimap_size
    values = own.minimap_layer(moment.snapshot, layer.name, inner_px(spec.size_px, extent))
    if values is not None:
        image = _on_canvas(spec, layer, extent, values)
        yield Drawing(image, f"minimap-{layer.name}", titles.of_minimap_layer(extent, layer))


def _features(spec: ImageSpec, moment: Moment, team: _Looker) -> Iterator[Drawing]:
    tile = features.tile_px(spec.size_px)
    found = {name: _values(spec, moment, team.camera, LAYERS[name], tile) for name in features.SHOWN}
    values = {name: cells for name, cells in found.items() if cells is not None}
    if len(values) == len(found):
        yield Drawing(features.draw(values, spec.size_px), f"features-{team.name}", titles.of_features(team.name))


def _on_canvas(spec: ImageSpec, layer: FeatureLayer, extent: float, values: Cells) -> Image:
    canvas = Canvas.on(colour(layer, values), spec.size_px, extent)
    if spec.grid:
        canvas.rule()
    explain(canvas.inner, layer)
    return canvas.image


def _values(spec: ImageSpec, moment: Moment, camera: Camera, layer: FeatureLayer, size_px: int) -> Cells | None:
    """Return the values of a layer, from the game or drawn; None if there are none."""
    if spec.is_taken:
        values = own.layer(moment.snapshot, layer.name, camera, size_px)
        if values is not None or not spec.is_drawn:
            return values
    assert layer.values is not None, "what cannot be drawn is taken"
    return layer.values(moment, camera, size_px)
