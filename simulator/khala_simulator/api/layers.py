"""Feature layers of the screen and of the minimap.

This module decides what is drawn where, from what a player perceives; `discs.py` draws discs, `raster.py` makes bytes
of images. Terrain that does not change is drawn once per camera position. Heights have the scale of `terrain_height`:
z = -16 + 32 v / 255. That is a choice: the API's own text and a recorded frame contradict each other.

Above: `observation.py`.
"""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

import numpy as np
from s2clientprotocol import spatial_pb2

from khala_simulator.api import wire
from khala_simulator.api.discs import DiscLayers
from khala_simulator.api.effects import BLIP_RADIUS, Spots, blips, power, seen_area_effects, seen_buffs
from khala_simulator.api.layer_values import VALUES, write_values
from khala_simulator.api.raster import RasterLayer, Sampler
from khala_simulator.api.sight import Display

if TYPE_CHECKING:
    from collections.abc import Callable

    from google.protobuf.message import Message
    from numpy.typing import NDArray
    from s2clientprotocol import sc2api_pb2

    from khala_simulator.api.projection import ImagePair
    from khala_simulator.api.sight import Sight
    from khala_simulator.api.types import Types
    from khala_simulator.api.wire import Part
    from khala_simulator.world.world import World

    Bools = NDArray[np.bool_]
    Floats = NDArray[np.float64]
    Ints = NDArray[np.int32]

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
    types: Types
    player: int
    sight: Sight
    selected: Bools  # [n] rows of the sight
    camera: tuple[float, float]
    attacked: Floats  # [k, 2] places of alerts since the last observation
    fogged: bool  # dark where the player does not see


@dataclasses.dataclass(frozen=True)
class _Bodies:
    """The units of a frame in drawing order: flying ones over those on the ground."""

    pos: Floats  # [n, 2] world
    radius: Floats
    known: Bools  # not hidden by the fog
    values: NDArray[np.int32]  # [layers, n]

    def take(self, rows: NDArray[np.intp]) -> _Bodies:
        """Return some of them, in another order."""
        return _Bodies(self.pos[rows], self.radius[rows], self.known[rows], self.values.take(rows, axis=1))


def _bodies(frame: Frame) -> _Bodies:
    sight = frame.sight
    bodies = _Bodies(sight.pos, sight.radius, sight.display != Display.HIDDEN.value, unit_values(frame))
    return bodies.take(np.argsort(sight.flying, kind="stable")) if sight.flying.any() else bodies


class FeatureLayers:
    """The feature layers that one client asked for; keeps the parts that stay the same from frame to frame."""

    def __init__(self, setup: sc2api_pb2.SpatialCameraSetup, view: ImagePair) -> None:
        self.screen, self.minimap = screen, minimap = view.screen, view.minimap
        hidden = frozenset() if setup.allow_cheating_layers else CHEATING
        shown = {name: bits for name, bits in MINIMAP_BITS.items() if name not in hidden}
        self._screen = _Image(spatial_pb2.FeatureLayers, SCREEN_BITS, screen.columns, screen.rows)
        self._minimap = _Image(spatial_pb2.FeatureLayersMinimap, shown, minimap.columns, minimap.rows)
        self._outlined: tuple[float, float] | None = None  # the camera whose view the minimap shows
        self._outline: list[Part] = []

    def encode(self, frame: Frame) -> list[Part]:
        """Return the parts of an `ObservationFeatureLayer`."""
        bodies = _bodies(frame)
        return wire.embed(1, self._encode_screen(frame, bodies)) + wire.embed(2, self._encode_minimap(frame, bodies))

    def _encode_screen(self, frame: Frame, bodies: _Bodies) -> list[Part]:
        screen = self.screen

        def axes() -> tuple[Floats, Floats]:
            corner = np.zeros(1)
            pixels = np.arange(max(screen.columns, screen.rows), dtype=np.float64)
            columns, _ = screen.to_world(pixels[: screen.columns], corner, frame.camera)
            _, lines = screen.to_world(corner, pixels[: screen.rows], frame.camera)
            return columns, lines

        image = self._screen
        x, y = screen.to_pixels(bodies.pos[:, 0], bodies.pos[:, 1], frame.camera)
        units = image.units.encode(x, y, bodies.radius / screen.scale, bodies.values)
        return (
            image.encode_terrain(frame, axes) + units + self._effects(frame) + self._power(frame) + self._blips(frame)
        )

    def _effects(self, frame: Frame) -> list[Part]:
        """Return the pixels of effect ids; the younger of two at one pixel wins."""
        layer = self._screen.layers["effects"]
        if not frame.world.area_effects:
            return layer.blank
        areas = seen_area_effects(frame.world, frame.player, through_fog=not frame.fogged)
        spots = [(x, y, area.radius, area.effect) for area in areas for x, y in area.points]
        table = np.array(spots, np.float64).reshape(-1, 4)
        return self._spots("effects", Spots(table[:, :2], table[:, 2]), table[:, 3].astype(np.int32), frame)

    def _power(self, frame: Frame) -> list[Part]:
        layer = self._screen.layers["power"]
        sources = power(frame.sight, frame.types)
        if sources is None:
            return layer.blank
        spots = Spots(frame.sight.pos[sources.row], sources.radius)
        return self._spots("power", spots, np.ones(len(sources.row), np.int32), frame)

    def _blips(self, frame: Frame) -> list[Part]:
        layer = self._screen.layers["blip"]
        places = blips(frame.world, frame.types, frame.player)
        if not len(places):
            return layer.blank
        spots = Spots(places, np.full(len(places), BLIP_RADIUS))
        return self._spots("blip", spots, np.ones(len(places), np.int32), frame)

    def _spots(self, layer: str, spots: Spots, values: Ints, frame: Frame) -> list[Part]:
        """Return discs of the world with a value each."""
        screen = self.screen
        x, y = screen.to_pixels(spots.pos[:, 0], spots.pos[:, 1], frame.camera)
        return self._screen.spots(layer).encode(x, y, spots.radius / screen.scale, values[None])

    def _encode_minimap(self, frame: Frame, bodies: _Bodies) -> list[Part]:
        minimap = self.minimap

        def axes() -> tuple[Floats, Floats]:
            corner = np.zeros(1)
            pixels = np.arange(max(minimap.columns, minimap.rows), dtype=np.float64)
            columns, _ = minimap.to_world(pixels[: minimap.columns], corner)
            _, lines = minimap.to_world(corner, pixels[: minimap.rows])
            return columns, lines

        image = self._minimap
        bodies = bodies if bodies.known.all() else bodies.take(np.flatnonzero(bodies.known))
        x, y = minimap.to_pixels(bodies.pos[:, 0], bodies.pos[:, 1])
        units = image.units.encode(x, y, bodies.radius / minimap.scale, bodies.values)
        return image.encode_terrain(frame, axes) + units + self._camera(frame) + self._alerts(frame)

    def _camera(self, frame: Frame) -> list[Part]:
        if self._outlined != frame.camera:
            view = self.screen.view(frame.camera)
            x0, y0 = self.minimap.to_pixels(view.x0, view.y1)
            x1, y1 = self.minimap.to_pixels(view.x1, view.y0)
            image = np.zeros((self.minimap.rows, self.minimap.columns), np.bool_)
            image[max(0, round(y0)) : max(0, round(y1)), max(0, round(x0)) : max(0, round(x1))] = True
            self._outlined = frame.camera
            self._outline = self._minimap.layers["camera"].encode(image)
        return self._outline

    def _alerts(self, frame: Frame) -> list[Part]:
        layer = self._minimap.layers["alerts"]
        if not len(frame.attacked):
            return layer.blank
        x, y = self.minimap.to_pixels(frame.attacked[:, 0], frame.attacked[:, 1])
        return self._minimap.spots("alerts").encode(x, y, np.zeros(len(x)), np.ones((1, len(x)), np.int32))


class _Image:
    """The layers of the screen or of the minimap, which are drawn in the same way."""

    def __init__(self, message: type[Message], bits: dict[str, int], columns: int, rows: int) -> None:
        fields = message.DESCRIPTOR.fields_by_name
        self._shape = columns, rows
        self.layers = {name: RasterLayer(fields[name].number, depth, columns, rows) for name, depth in bits.items()}
        shown = [(k, self.layers[name]) for k, name in enumerate(VALUES) if name in self.layers]
        dense = "unit_density" in self.layers
        density = (self.layers["unit_density"], self.layers["unit_density_aa"]) if dense else None
        self.units = DiscLayers(shown, density, columns, rows)
        self._spots: dict[str, DiscLayers] = {}
        self._camera: tuple[float, float] | None = None
        self._walk: Bools | None = None
        self._creep: Bools | None = None
        self._sampler: Sampler | None = None
        self._terrain: list[Part] = []
        self._visibility: list[Part] = []

    def spots(self, name: str) -> DiscLayers:
        """Return a layer that shows discs other than units."""
        if name not in self._spots:
            self._spots[name] = DiscLayers([(0, self.layers[name])], None, *self._shape)
        return self._spots[name]

    def encode_terrain(self, frame: Frame, axes: Callable[[], tuple[Floats, Floats]]) -> list[Part]:
        """Return terrain and visibility; drawn again only if the camera moved, the ground changed, or fog may have."""
        world, layers, terrain = frame.world, self.layers, frame.world.map.terrain
        if self._sampler is None or self._camera != frame.camera:
            self._sampler = Sampler(terrain.size, *axes())
            self._camera = frame.camera
            self._walk = None
        take = self._sampler.take
        changed = self._walk is not world.ground.walk or self._creep is not world.creep
        if changed:
            self._walk, self._creep = world.ground.walk, world.creep
            grids = {"height_map": terrain.height, "pathable": self._walk, "buildable": terrain.build,
                     "creep": self._creep}  # fmt: skip
            self._terrain = [part for name, grid in grids.items() for part in layers[name].encode(take(grid))]
        if changed or world.fog:
            self._visibility = layers["visibility_map"].encode(take(world.visibility[frame.player]))
        return self._terrain + self._visibility


def unit_values(frame: Frame) -> Ints:
    """Return [len(VALUES), n] the value of each unit in each layer that shows units.

    The last of several buffs on a unit is shown; its duration is the part that remains, 0 to 255, and stays at 255
    without an end.
    """
    sight = frame.sight
    values = np.zeros((len(VALUES), len(sight)), np.int32)
    write_values(sight, frame.selected, values)
    worn = seen_buffs(frame.world, sight)
    if worn is not None:
        part = np.minimum(worn.remain / np.maximum(worn.total, 1e-9), 1.0) * 255
        values[VALUES.index("buffs"), worn.row] = worn.id
        values[VALUES.index("buff_duration"), worn.row] = np.where(worn.total > 0, part, 255)
    return values
