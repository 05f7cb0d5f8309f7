"""Single feature layers as pictures: `height_map`, `creep`, `power`, `buildable`, … with a legend.

PySC2 calls them feature layers. They are drawn for the virtual camera of a team from raw data, or are the game's own,
as `own` finds them. `LAYERS` lists them with their looks.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import cv2
import numpy as np

from khala_bridge.frames import CAMERA_WIDTH
from khala_bridge.observe.image import palette
from khala_bridge.observe.image.lettering import written
from khala_bridge.observe.image.moment import Moment
from khala_bridge.observe.image.painting import upright
from khala_bridge.observe.image.palette import LIVERIES

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from khala_bridge.frames import Camera
    from khala_bridge.observe.image.lettering import Image, Mask
    from khala_bridge.observe.image.moment import Subject
    from khala_bridge.observe.image.palette import Colour

Cells: TypeAlias = "NDArray[np.integer[Any]]"
"""(height, width): the values of a layer."""
Values: TypeAlias = Callable[[Moment, "Camera", int], Cells]
"""A moment, a camera and a size in pixels → (size, size), 0 to 255."""
_SIDE_NUMBERS = {"own": 1, "ally": 2, "neutral": 3, "enemy": 4}
_CLIFF = 16
"""Height of a cliff level in the game's numbers."""
_GREY, _DARK, _WHITE = (150, 150, 150), (28, 26, 24), (235, 235, 235)


@dataclass(frozen=True)
class FeatureLayer:
    """One layer: its values and their look."""

    name: str
    values: Values | None
    """Draws them; None for a layer that only the game draws."""
    kind: Literal["scalar", "categorical", "types"]
    """`scalar` from dark to light; `categorical` a colour a value; `types` a colour a unit type."""
    about: str
    """Its meaning, for the picture's title."""
    colours: tuple[tuple[int, str, Colour], ...] = ()
    """Of a categorical layer: value, meaning, colour."""


# --- values -------------------------------------------------------------------------------------------------


def _heights(moment: Moment, camera: Camera, size_px: int) -> Mask:
    heights = upright(moment.land.ground.height)
    scaled = np.clip((heights + 16) * (255 / 32), 0, 255).astype(np.uint8)
    return moment.painting.cells(scaled, camera, size_px)


def _of_land(get: Callable[[Moment], NDArray[np.bool_]]) -> Values:
    def values(moment: Moment, camera: Camera, size_px: int) -> Mask:
        return moment.painting.cells(upright(get(moment)).astype(np.uint8), camera, size_px)

    return values


def _sight(moment: Moment, camera: Camera, size_px: int) -> Mask:
    sight = moment.veil.sight
    if sight is None:
        return np.full((size_px, size_px), 2, np.uint8)
    return moment.painting.cells(sight, camera, size_px)


def _of_units(value: Callable[[Subject], int]) -> Values:
    """Return the bodies of units filled with their values; 0 elsewhere and for units without a value."""

    def values(moment: Moment, camera: Camera, size_px: int) -> Mask:
        image = np.zeros((size_px, size_px), np.uint8)
        scale = size_px / CAMERA_WIDTH
        for subject in moment.around(camera.x, camera.y, CAMERA_WIDTH / 2):
            _body(image, subject, camera, scale, value(subject))
        return image

    return values


def _density(moment: Moment, camera: Camera, size_px: int) -> Mask:
    image = np.zeros((size_px, size_px), np.uint8)
    scale = size_px / CAMERA_WIDTH
    for subject in moment.around(camera.x, camera.y, CAMERA_WIDTH / 2):
        alone = np.zeros_like(image)
        _body(alone, subject, camera, scale, 1)
        cv2.add(image, alone, dst=image)
    return image


def _body(image: Mask, subject: Subject, camera: Camera, scale: float, value: int) -> None:
    x, y = camera.screen(subject.x, subject.y)
    unit = CAMERA_WIDTH / camera.size
    at = round(x * unit * scale - 0.5), round(y * unit * scale - 0.5)
    cv2.circle(image, at, max(2, round(subject.radius * scale)), value, -1)


def _effects(moment: Moment, camera: Camera, size_px: int) -> Mask:
    image = np.zeros((size_px, size_px), np.uint8)
    scale = size_px / CAMERA_WIDTH
    unit = CAMERA_WIDTH / camera.size
    for number, patch in enumerate(moment.effects, 1):
        for x, y in patch.places:
            column, row = camera.screen(x, y)
            at = round(column * unit * scale), round(row * unit * scale)
            cv2.circle(image, at, max(2, round(patch.radius * scale)), min(number, 255), -1)
    return image


def _percent(share: float) -> int:
    return max(1, round(255 * share)) if share >= 0 else 0


# --- the table ----------------------------------------------------------------------------------------------


def _switch(name: str, values: Values | None, about: str, off: str, on: str) -> FeatureLayer:
    return FeatureLayer(name, values, "categorical", about, ((0, off, _DARK), (1, on, _WHITE)))


_SIGHT = ((0, "never seen", (20, 18, 16)), (1, "not seen now", (110, 104, 96)), (2, "seen now", (235, 235, 235)))
_SIDES = (
    (1, "own", LIVERIES["team"].body),
    (2, "ally", LIVERIES["ally"].body),
    (3, "neutral", _GREY),
    (4, "enemy", LIVERIES["enemy"].body),
)

LAYERS: dict[str, FeatureLayer] = {
    layer.name: layer
    for layer in (
        FeatureLayer("height_map", _heights, "scalar", "height of the ground, light is high"),
        FeatureLayer("visibility_map", _sight, "categorical", "what is seen", _SIGHT),
        _switch("creep", _of_land(lambda m: m.land.creep), "creep", "no creep", "creep"),
        _switch("power", _of_land(lambda m: m.land.power_cells(corner=False)), "power fields", "no power", "power"),
        _switch("pathable", _of_land(lambda m: m.land.open), "where one can walk", "blocked", "walkable"),
        _switch("buildable", _of_land(lambda m: m.land.free), "where one can build", "not free", "buildable"),
        FeatureLayer(
            "player_relative",
            _of_units(lambda unit: _SIDE_NUMBERS.get(unit.side, 0)),
            "categorical",
            "whose units are where",
            _SIDES,
        ),
        FeatureLayer(
            "unit_type", _of_units(lambda unit: unit.type_id % 254 + 1), "types", "a colour for each type of unit"
        ),
        FeatureLayer(
            "unit_hit_points_ratio", _of_units(lambda unit: _percent(unit.health)), "scalar", "health, light is full"
        ),
        FeatureLayer(
            "unit_shields_ratio", _of_units(lambda unit: _percent(unit.shield)), "scalar", "shields, light is full"
        ),
        FeatureLayer(
            "unit_energy_ratio", _of_units(lambda unit: _percent(unit.energy)), "scalar", "energy, light is full"
        ),
        FeatureLayer(
            "build_progress", _of_units(lambda unit: _percent(unit.built)), "scalar", "how far built, light is done"
        ),
        FeatureLayer("unit_density", _density, "scalar", "how many units are on a point, light is many"),
        FeatureLayer("effects", _effects, "types", "a colour for each effect on the ground"),
        FeatureLayer("player_id", None, "types", "a colour for each player's units"),
        _switch("selected", None, "selected units", "other", "selected"),
        FeatureLayer("unit_hit_points", None, "scalar", "health points, light is most"),
        FeatureLayer("unit_energy", None, "scalar", "energy points, light is most"),
        FeatureLayer("unit_shields", None, "scalar", "shield points, light is most"),
        FeatureLayer("unit_density_aa", None, "scalar", "how many units are on a point, light is many"),
        _switch("hallucinations", None, "hallucinations", "real", "not real"),
        _switch("cloaked", None, "cloaked units", "not cloaked", "cloaked"),
        _switch("blip", None, "units known by a sensor tower", "none", "blip"),
        FeatureLayer("buffs", None, "types", "a colour for each buff"),
        FeatureLayer("buff_duration", None, "scalar", "how long buffs last, light is long"),
        _switch("active", None, "structures at work", "idle", "active"),
        _switch("placeholder", None, "structures that are planned", "none", "planned"),
        _switch("camera", None, "what the game's camera shows", "outside", "camera"),
        _switch("alerts", None, "where the player is attacked", "none", "alert"),
    )
}
"""All layers by name; `camera` and `alerts` are of the minimap only."""
_MOST = frozenset(
    {"unit_density", "unit_density_aa", "unit_hit_points", "unit_energy", "unit_shields", "buff_duration"}
)
"""Layers whose lightest colour is the largest value in the picture."""


# --- colours ------------------------------------------------------------------------------------------------


def colour(layer: FeatureLayer, values: Cells) -> Image:
    """Return the picture of a layer's values."""
    table = np.zeros((256, 3), np.uint8)
    if layer.kind == "scalar":
        return _shade(layer, values)
    if layer.kind == "types":
        return _apply_table(np.where(values, values % 254 + 1, 0), _hues())
    table[:] = _DARK
    for value, _, colour in layer.colours:
        table[value] = colour
    return _apply_table(np.clip(values, 0, 255), table)


def _apply_table(values: Cells, table: Image) -> Image:
    """Return an image with the numbers replaced by the colours of a table, (256, 3)."""
    return np.asarray(cv2.applyColorMap(values.astype(np.uint8), table[:, None]), np.uint8)


def _shade(layer: FeatureLayer, values: Cells) -> Image:
    """Return values as shades from dark to light, over their range in the picture or in the layer."""
    low, high = 0, 255
    if layer.name in _MOST:
        high = max(int(values.max()), 1)
    elif layer.name == "height_map" and int(values.max()) - int(values.min()) >= _CLIFF // 2:
        low, high = int(values.min()), int(values.max())
    image = _apply_table(np.clip((values - float(low)) * (255 / (high - low)), 0, 255), _viridis())
    if layer.name != "height_map":
        image[values == 0] = _DARK  # 0 stands for nothing
    return image


@functools.cache
def _hues() -> Image:
    """Return colours (256, 3), different for neighbouring numbers; 0 is dark."""
    hue = (np.arange(256) * 67 % 180).astype(np.uint8)
    shades = np.stack([hue, np.full(256, 150, np.uint8), np.full(256, 235, np.uint8)], axis=1)[:, None]
    table = np.asarray(cv2.cvtColor(shades, cv2.COLOR_HSV2BGR), np.uint8)[:, 0]
    table[0] = _DARK
    return table


def explain(image: Image, layer: FeatureLayer) -> None:
    """Write a legend into the lower left corner of a layer's picture."""
    entries = [(colour, name) for _, name, colour in layer.colours]
    if layer.kind == "scalar":
        ramp = _viridis()
        entries = [
            ((int(b), int(g), int(r)), name) for (b, g, r), name in zip(ramp[[0, 255]], _ends(layer), strict=True)
        ]
    if not entries:
        return
    stamps = [written(name, 7, palette.LABEL) for _, name in entries]
    width = 22 + max(stamp.size[0] for stamp in stamps)
    row = 14
    top = image.shape[0] - row * len(entries) - 8
    box = image[top - 4 : image.shape[0] - 4, 4 : 4 + width]
    cv2.multiply(box, np.full_like(box, 50), dst=box, scale=1 / 255)
    for number, ((colour, _), stamp) in enumerate(zip(entries, stamps, strict=True)):
        y = top + number * row
        cv2.rectangle(image, (8, y), (17, y + 8), colour, -1)
        cv2.rectangle(image, (8, y), (17, y + 8), palette.LABEL, 1)
        stamp.press(image, 22, y + 4 - stamp.size[1] // 2)


def _ends(layer: FeatureLayer) -> tuple[str, str]:
    if layer.name in _MOST:
        return "none", "most"
    return ("low", "high") if layer.name == "height_map" else ("0 %", "100 %")


@functools.cache
def _viridis() -> Mask:
    """Return colours (256, 3) from dark violet over green to yellow: even in lightness, also for the colour blind."""
    ramp = cv2.applyColorMap(np.arange(256, dtype=np.uint8)[:, None], cv2.COLORMAP_VIRIDIS)
    return np.asarray(ramp[:, 0], np.uint8)
