"""Feature layers of the screen and of the minimap.

What is drawn where is decided here, from what a player perceives; how a disc becomes pixels and pixels become bytes
is `raster.py`. Terrain that does not change is drawn once per camera position. Heights have the scale of
`terrain_height`: z = -16 + 32 v / 255 (the API's own text and a recorded frame disagree on it, see docs).

Above: `observation.py`.
"""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

import numpy as np
from s2clientprotocol import spatial_pb2

from simulator.api import wire
from simulator.api.projection import Minimap, Rect, Screen
from simulator.api.raster import Layer, draw_discs, sample
from simulator.api.sight import Cloak, Display

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray
    from s2clientprotocol import sc2api_pb2

    from simulator.api.sight import Sight
    from simulator.world import World

    Bools = NDArray[np.bool_]
    Floats = NDArray[np.float64]
    Grid = NDArray[np.bool_]

SCREEN_BITS = {
    "height_map": 8, "visibility_map": 8, "creep": 1, "power": 1, "player_id": 8, "unit_type": 32, "selected": 1,
    "unit_hit_points": 32, "unit_hit_points_ratio": 8, "unit_energy": 32, "unit_energy_ratio": 8,
    "unit_shields": 32, "unit_shields_ratio": 8, "player_relative": 8, "unit_density_aa": 8, "unit_density": 8,
    "effects": 8, "hallucinations": 1, "cloaked": 1, "blip": 1, "buffs": 32, "buff_duration": 8, "active": 1,
    "build_progress": 8, "buildable": 1, "pathable": 1, "placeholder": 1,
}  # fmt: skip
MINIMAP_BITS = {
    "height_map": 8, "visibility_map": 8, "creep": 1, "camera": 1, "player_id": 8, "player_relative": 8,
    "selected": 1, "alerts": 1, "buildable": 1, "pathable": 1, "unit_type": 32,
}  # fmt: skip
CHEATING = frozenset({"unit_type"})
"""Minimap layers that are sent only when the client asks for cheating ones."""


@dataclasses.dataclass(frozen=True)
class Frame:
    """What the feature layers of one observation show."""

    world: World
    player: int
    sight: Sight
    selected: Bools  # [n] rows of the sight
    camera: tuple[float, float]
    attacked: Floats  # [k, 2] places of alerts since the last observation


class FeatureLayers:
    """The feature layers that one client asked for; keeps what stays the same from frame to frame."""

    def __init__(self, setup: sc2api_pb2.SpatialCameraSetup, screen: Screen, minimap: Minimap) -> None:
        self.screen, self.minimap = screen, minimap
        hidden = set() if setup.allow_cheating_layers else CHEATING
        self._screen = _layers(spatial_pb2.FeatureLayers, SCREEN_BITS, screen.columns, screen.rows)
        self._minimap = {
            name: layer
            for name, layer in _layers(
                spatial_pb2.FeatureLayersMinimap, MINIMAP_BITS, minimap.columns, minimap.rows
            ).items()
            if name not in hidden
        }
        self._terrain: dict[str, tuple[tuple[float, float], Grid, list[bytes]]] = {}

    def encode(self, frame: Frame) -> list[bytes]:
        """The parts of an `ObservationFeatureLayer`."""
        return wire.embed(1, self._encode_screen(frame)) + wire.embed(2, self._encode_minimap(frame))

    # screen -------------------------------------------------------------------------------------------------------

    def _encode_screen(self, frame: Frame) -> Iterable[bytes]:
        screen, layers = self.screen, self._screen
        x, y = screen.to_pixels(frame.sight.pos[:, 0], frame.sight.pos[:, 1], frame.camera)
        near = _near(x, y, frame.sight.radius / screen.scale, screen.columns, screen.rows)
        centres = np.stack([x[near], y[near]], axis=1)
        discs = draw_discs(centres, frame.sight.radius[near] / screen.scale, screen.columns, screen.rows)
        columns, _ = screen.to_world(np.arange(screen.columns, dtype=np.float64), np.zeros(1), frame.camera)
        _, lines = screen.to_world(np.zeros(1), np.arange(screen.rows, dtype=np.float64), frame.camera)
        drawn = self._sample("screen", frame, layers, columns, lines)
        values = unit_values(frame.sight, frame.selected, near)
        drawn += [layers[name].encode_discs(discs, column) for name, column in values.items()]
        drawn += [layers["unit_density"].encode(discs.density), layers["unit_density_aa"].encode(discs.smooth)]
        blank = ("power", "effects", "blip", "buffs", "buff_duration", "placeholder")
        return drawn + [layers[name].blank for name in blank]

    # minimap ------------------------------------------------------------------------------------------------------

    def _encode_minimap(self, frame: Frame) -> Iterable[bytes]:
        minimap, layers = self.minimap, self._minimap
        x, y = minimap.to_pixels(frame.sight.pos[:, 0], frame.sight.pos[:, 1])
        near = np.flatnonzero(frame.sight.display != Display.HIDDEN)
        centres = np.stack([x[near], y[near]], axis=1)
        discs = draw_discs(centres, frame.sight.radius[near] / minimap.scale, minimap.columns, minimap.rows)
        columns, _ = minimap.to_world(np.arange(minimap.columns, dtype=np.float64), np.zeros(1))
        _, lines = minimap.to_world(np.zeros(1), np.arange(minimap.rows, dtype=np.float64))
        drawn = self._sample("minimap", frame, layers, columns, lines)
        values = unit_values(frame.sight, frame.selected, near)
        drawn += [layers[name].encode_discs(discs, values[name]) for name in values if name in layers]
        return [*drawn, self._camera(frame), self._alerts(frame)]

    def _camera(self, frame: Frame) -> bytes:
        view = self.screen.view(frame.camera)
        x0, y0 = self.minimap.to_pixels(view.x0, view.y1)
        x1, y1 = self.minimap.to_pixels(view.x1, view.y0)
        image = np.zeros((self.minimap.rows, self.minimap.columns), np.bool_)
        image[max(0, round(y0)) : max(0, round(y1)), max(0, round(x0)) : max(0, round(x1))] = True
        return self._minimap["camera"].encode(image)

    def _alerts(self, frame: Frame) -> bytes:
        layer = self._minimap["alerts"]
        if not len(frame.attacked):
            return layer.blank
        x, y = self.minimap.to_pixels(frame.attacked[:, 0], frame.attacked[:, 1])
        spots = draw_discs(np.stack([x, y], axis=1), np.zeros(len(x)), self.minimap.columns, self.minimap.rows)
        return layer.encode_discs(spots, np.ones(len(x), np.bool_))

    # terrain ------------------------------------------------------------------------------------------------------

    def _sample(
        self, image: str, frame: Frame, layers: dict[str, Layer], columns: Floats, lines: Floats
    ) -> list[bytes]:
        """Terrain and visibility; drawn again only when the camera moved, the ground changed, or fog may have."""
        world = frame.world
        terrain, visibility = world.map.terrain, world.visibility[frame.player]
        camera, walk, drawn = self._terrain.get(image, (None, None, []))
        if camera != frame.camera or walk is not world.ground.walk:
            drawn = [
                layers["height_map"].encode(sample(terrain.height, columns, lines)),
                layers["pathable"].encode(sample(world.ground.walk, columns, lines)),
                layers["buildable"].encode(sample(terrain.build, columns, lines)),
                layers["creep"].encode(sample(terrain.creep, columns, lines)),
                layers["visibility_map"].encode(sample(visibility, columns, lines)),
            ]
            self._terrain[image] = (frame.camera, world.ground.walk, drawn)
        elif world.fog:
            drawn[-1] = layers["visibility_map"].encode(sample(visibility, columns, lines))
        return list(drawn)


def unit_values(sight: Sight, selected: Bools, rows: NDArray[np.intp]) -> dict[str, NDArray[np.generic]]:
    """The value of each drawn unit in each layer that shows units.

    Hit points, shields and energy are whole points, their ratios 0 to 255; the progress of a structure is 0 to 255
    while it is being built and 0 afterwards.
    """
    life, shields, energy = sight.life[rows], sight.shields[rows], sight.energy[rows]
    progress = sight.build_progress[rows]
    cloak = sight.cloak[rows]
    return {
        "player_id": sight.owner[rows],
        "player_relative": sight.alliance[rows],
        "unit_type": sight.type_id[rows],
        "selected": selected[rows],
        "unit_hit_points": life.astype(np.int32),
        "unit_hit_points_ratio": _ratio(life, sight.life_max[rows]),
        "unit_shields": shields.astype(np.int32),
        "unit_shields_ratio": _ratio(shields, sight.shields_max[rows]),
        "unit_energy": energy.astype(np.int32),
        "unit_energy_ratio": _ratio(energy, sight.energy_max[rows]),
        "hallucinations": sight.hallucination[rows],
        "cloaked": (cloak != Cloak.NOT_CLOAKED) & (cloak != Cloak.UNKNOWN),
        "active": sight.active[rows],
        "build_progress": np.where(progress < 1, progress * 255, 0).astype(np.uint8),
    }


def _ratio(part: Floats, whole: Floats) -> NDArray[np.uint8]:
    ratio: NDArray[np.uint8] = np.divide(part * 255, whole, out=np.zeros_like(part), where=whole > 0).astype(np.uint8)
    return ratio


def _near(x: Floats, y: Floats, radius: Floats, columns: int, rows: int) -> NDArray[np.intp]:
    margin = radius + 1
    inside = (x > -margin) & (x < columns + margin) & (y > -margin) & (y < rows + margin)
    return np.flatnonzero(inside)


def _layers(message: type, bits: dict[str, int], columns: int, rows: int) -> dict[str, Layer]:
    fields = message.DESCRIPTOR.fields_by_name  # type: ignore[attr-defined]  # of every message class
    return {name: Layer(fields[name].number, depth, columns, rows) for name, depth in bits.items()}


def screen_of(setup: sc2api_pb2.SpatialCameraSetup) -> Screen:
    """The screen that a client asked for; 24 world units wide unless it says so."""
    return Screen(setup.resolution.x, setup.resolution.y, setup.width or 24.0)


def minimap_of(setup: sc2api_pb2.SpatialCameraSetup, area: Rect) -> Minimap:
    """The minimap that a client asked for, of this part of the map."""
    return Minimap(setup.minimap_resolution.x, setup.minimap_resolution.y, area)
