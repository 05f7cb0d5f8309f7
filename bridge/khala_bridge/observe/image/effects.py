"""Effects on the ground, sources of power and orders: drawn under units, at their true places and sizes."""

from __future__ import annotations

import functools
import math
from typing import TYPE_CHECKING, NamedTuple

import cv2
import numpy as np

from khala_bridge.observe.image import palette
from khala_bridge.observe.image.lettering import Stamp, stamp_of, written
from khala_bridge.observe.image.palette import LIVERIES

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from khala_bridge.observe.image.lettering import Image
    from khala_bridge.observe.image.moment import Patch, Subject
    from khala_bridge.observe.image.palette import Colour, Side

    Place = Callable[[float, float], tuple[int, int]]
    """A point of the world → column and row."""


class _Style(NamedTuple):
    """The look of a kind of effect: its colour (None: that of its side), opacity, and the figure in it."""

    colour: Colour | None = None
    fill: float = 0.3
    figure: str = ""
    label: str = ""


_STYLES = {
    "PsiStorm": _Style((255, 150, 190), 0.45, "bolts", "PsiStorm"),
    "CorrosiveBile": _Style((60, 230, 170), 0.3, "cross", "Bile"),
    "NukeDot": _Style((60, 60, 255), 0.2, "cross", "Nuke"),
    "GuardianShield": _Style(None, 0.14, "", "GuardianShield"),
    "BlindingCloud": _Style((150, 60, 110), 0.5, "", "BlindingCloud"),
    "TemporalFieldGrowing": _Style((220, 190, 90), 0.2, "", "TimeWarp"),
    "TemporalField": _Style((220, 190, 90), 0.35, "", "TimeWarp"),
    "ScannerSweep": _Style((220, 220, 120), 0.08, "", "Scan"),
    "LiberatorDefenderZone": _Style(None, 0.2, "cross", "LiberatorZone"),
    "LiberatorDefenderZoneSetup": _Style(None, 0.1, "cross", "LiberatorZone"),
    "LurkerSpines": _Style(None, 0.5, "bolts", ""),
    "ThermalLance": _Style(None, 0.4, "", ""),
    "Power": _Style(palette.POWER, 0.07, "", ""),
}
_FINER = 3
_ATTACKS = frozenset({"Attack", "Attack_Attack", "Attack_Battlecruiser", "Attack_Redirect", "Scan_Move"})


def draw_patches(image: Image, patches: Iterable[Patch], place: Place, scale: float, *, names: bool) -> None:
    """Draw effects at their places.

    Args:
        image: the image to draw on.
        patches: the effects.
        place: returns the place of a world point in the image.
        scale: pixels of a world unit.
        names: whether to write their names on them.
    """
    for patch in patches:
        stamp = _disc(patch.name, patch.side, max(2, round(patch.radius * scale)))
        for x, y in patch.places:
            column, row = place(x, y)
            stamp.press(image, column - stamp.size[0] // 2, row - stamp.size[1] // 2)
        label = _style(patch.name).label
        if names and label and patch.places:
            _name(image, label, place(*patch.places[0]), round(patch.radius * scale))


def draw_orders(image: Image, subjects: Iterable[Subject], place: Place) -> None:
    """Draw the goals and targets of units: a line with a dot at its end, red for attacks, green for the rest."""
    for subject in subjects:
        if subject.target is None:
            continue
        colour = palette.ATTACKING if subject.order in _ATTACKS else palette.MOVING
        start, end = place(subject.x, subject.y), place(*subject.target)
        cv2.line(image, start, end, colour, 1, cv2.LINE_AA)
        cv2.circle(image, end, 2, colour, -1, cv2.LINE_AA)


def _style(name: str) -> _Style:
    return _STYLES.get(name) or _Style(None, 0.3, "", name)


@functools.lru_cache(512)
def _disc(name: str, side: Side, radius_px: int) -> Stamp:
    style = _style(name)
    colour = style.colour or LIVERIES[side].body
    size = 2 * radius_px + 5
    large = np.zeros((size * _FINER, size * _FINER), np.uint8)
    middle = (size * _FINER // 2, size * _FINER // 2)
    radius = radius_px * _FINER
    cv2.circle(large, middle, radius, round(255 * style.fill), -1)
    cv2.circle(large, middle, radius, 215 if name != "Power" else 90, 2 * _FINER)
    if style.figure == "bolts":
        _bolts(large, middle, radius)
    elif style.figure == "cross":
        _cross(large, middle, radius)
    opacity = np.asarray(cv2.resize(large, (size, size), interpolation=cv2.INTER_AREA), np.uint8)
    return stamp_of(np.full((size, size, 3), colour, np.uint8), opacity)


def _bolts(mask: Image, middle: tuple[int, int], radius: int) -> None:
    """Draw five zigzags from the middle outwards."""
    for k in range(5):
        points = []
        for step in range(5):
            angle = 2 * math.pi * k / 5 + (0.34 if step % 2 else -0.12)
            reach = radius * (0.12 + 0.2 * step)
            points.append((middle[0] + reach * math.cos(angle), middle[1] + reach * math.sin(angle)))
        cv2.polylines(mask, [np.rint(points).astype(np.int32)], False, 255, 2 * _FINER)


def _cross(mask: Image, middle: tuple[int, int], radius: int) -> None:
    """Draw a crosshair: something will come down here."""
    x, y = middle
    for right, down in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        inner, outer = 0.45 * radius, 1.0 * radius
        start = round(x + right * inner), round(y + down * inner)
        end = round(x + right * outer), round(y + down * outer)
        cv2.line(mask, start, end, 255, 2 * _FINER)


def _name(image: Image, label: str, at: tuple[int, int], radius_px: int) -> None:
    """Write the name of an effect inside its upper edge, or above it if it is narrow."""
    stamp = written(label, 7, palette.LABEL, palette.INK)
    width, height = stamp.size
    top = at[1] - radius_px + 3 if 2 * radius_px > 2 * width else at[1] - radius_px - height
    stamp.press(image, at[0] - width // 2, max(top, 0))
