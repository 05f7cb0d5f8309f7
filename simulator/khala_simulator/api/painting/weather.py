"""Effects on the screen: storms, scans, force, biles on their way; each in the look of its kind, at its true radius.

Effects on the ground are painted before the units, those that hang over them after. Above: `scene.py`. Below:
`effects.py`, which says what the player perceives.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from typing import TYPE_CHECKING

import cv2
import numpy as np

from khala_simulator.api.effects import seen_area_effects
from khala_simulator.api.painting import marks, palette
from khala_simulator.api.sight import API_NEUTRAL, alliance_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from khala_simulator.api.layers import Frame
    from khala_simulator.api.painting.palette import Colour
    from khala_simulator.api.projection import ScreenView
    from khala_simulator.world.area_effects import AreaEffect

    Image = NDArray[np.uint8]
    Point = tuple[float, float]


BOLTS = 7
GOLDEN = 0.618034
EDGE_SIDE = 0.65
"""How much of its edge's colour an effect takes from the side that made it."""


@dataclasses.dataclass(frozen=True)
class Manner:
    """How one kind of effect is painted."""

    colour: Colour
    fill: float  # opacity of the disc
    above: bool  # over the units
    figure: Callable[[Image, Point, float, Colour, int], None] | None = None
    """A function that draws into the disc: image, centre, radius in pixels, colour, age in loops."""


def _bolts(image: Image, centre: Point, radius: float, colour: Colour, age: int) -> None:
    """Draw lightning from the middle outward, new bolts in every loop."""
    glare = palette.mix(colour, (255, 255, 255), 0.75)
    for k in range(BOLTS):
        start = 2 * math.pi * (k + age * GOLDEN % 1) / BOLTS
        points = [
            (centre[0] + radius * far * math.cos(start + turn), centre[1] + radius * far * math.sin(start + turn))
            for far, turn in ((far, 0.5 * math.sin(7.0 * k + 3.0 * age + 11.0 * far)) for far in (0.12, 0.36, 0.6, 0.9))
        ]
        for before, after in itertools.pairwise(points):
            marks.line(image, before, after, glare, 1 + (radius > 60))


def _rings(image: Image, centre: Point, radius: float, colour: Colour, age: int) -> None:
    """Draw rings that run outward."""
    for k in range(3):
        marks.ring(image, centre, radius * ((k + age % 16 / 16) / 3), colour)


def _cross(image: Image, centre: Point, radius: float, colour: Colour, age: int) -> None:
    """Draw cross-hairs where it will hit."""
    far = radius * 1.7
    for dx, dy in ((far, 0.0), (0.0, far)):
        marks.line(image, (centre[0] - dx, centre[1] - dy), (centre[0] + dx, centre[1] + dy), colour)
    marks.ring(image, centre, max(2.0, radius * (1.6 - min(age, 40) / 40)), colour)


def _teeth(image: Image, centre: Point, radius: float, colour: Colour, age: int) -> None:
    """Draw teeth around the edge, pointing inward."""
    for k in range(12):
        cos = math.cos(k * math.pi / 6 + age * 0.01)
        sin = math.sin(k * math.pi / 6 + age * 0.01)
        start = (centre[0] + radius * cos, centre[1] + radius * sin)
        marks.line(image, start, (centre[0] + radius * 0.88 * cos, centre[1] + radius * 0.88 * sin), colour)


MANNERS: dict[int, Manner] = {
    1: Manner((110, 160, 255), 0.38, above=True, figure=_bolts),  # psionic storm
    2: Manner((130, 200, 255), 0.12, above=True, figure=_teeth),  # guardian shield
    3: Manner((150, 110, 255), 0.22, above=False, figure=_rings),  # time warp, growing
    4: Manner((150, 110, 255), 0.30, above=False, figure=_rings),  # time warp
    5: Manner((255, 150, 60), 0.55, above=True),  # thermal lances
    6: Manner((255, 238, 120), 0.14, above=False, figure=_rings),  # scanner sweep
    7: Manner((255, 40, 40), 0.60, above=True, figure=_cross),  # nuke
    8: Manner((255, 190, 90), 0.10, above=False),  # liberator zone, being set up
    9: Manner((255, 150, 60), 0.20, above=False, figure=_teeth),  # liberator zone
    10: Manner((84, 104, 60), 0.62, above=True),  # blinding cloud
    11: Manner((150, 255, 70), 0.40, above=True, figure=_cross),  # corrosive bile
    12: Manner((226, 150, 90), 0.65, above=False),  # lurker spines
}
"""By the API's effect id."""
OTHER = Manner((240, 240, 240), 0.2, above=False)
"""How an effect is painted that has no manner of its own."""


def paint_below(image: Image, frame: Frame, screen: ScreenView) -> list[AreaEffect]:
    """Paint the effects on the ground, and return those that hang above."""
    if not frame.world.area_effects:
        return []
    areas = seen_area_effects(frame.world, frame.player, through_fog=not frame.fogged)
    above = [area for area in areas if MANNERS.get(area.effect, OTHER).above]
    _paint(image, frame, screen, [area for area in areas if area not in above])
    return above


def paint_above(image: Image, frame: Frame, screen: ScreenView, areas: list[AreaEffect]) -> None:
    """Paint the effects that hang over the units."""
    if areas:
        _paint(image, frame, screen, areas)


def _paint(image: Image, frame: Frame, screen: ScreenView, areas: list[AreaEffect]) -> None:
    for area in areas:
        manner = MANNERS.get(area.effect, OTHER)
        age = frame.world.loop - area.begun
        edge = palette.mix(manner.colour, palette.LIVERIES[_side(area, frame)].dot, EDGE_SIDE)
        radius = max(area.radius / screen.scale, 2.0)
        for point in area.points:
            centre = screen.to_pixels(point[0], point[1], frame.camera)
            if _in_view(centre, 2 * radius, screen):
                _disc(image, centre, radius, manner, edge)
                if manner.figure is not None:
                    manner.figure(image, centre, radius, manner.colour, age)


def _in_view(centre: Point, reach: float, screen: ScreenView) -> bool:
    x, y = centre
    return -reach < x < screen.columns + reach and -reach < y < screen.rows + reach


def _side(area: AreaEffect, frame: Frame) -> int:
    owner = np.array([area.owner or API_NEUTRAL])
    alliance = alliance_of(np.array([area.owner]), frame.player)
    return int(palette.sides(owner, alliance, frame.player)[0])


def _disc(image: Image, centre: Point, radius: float, manner: Manner, edge: Colour) -> None:
    """Paint a translucent disc with an edge, on the square around it."""
    (rows, columns), reach = image.shape[:2], math.ceil(radius) + 2
    x0, y0 = max(0, int(centre[0]) - reach), max(0, int(centre[1]) - reach)
    region = image[y0 : min(rows, int(centre[1]) + reach + 1), x0 : min(columns, int(centre[0]) + reach + 1)]
    if not region.size:
        return
    over = region.copy()
    at = marks.fixed_point((centre[0] - x0, centre[1] - y0))
    cv2.circle(over, at, round(radius * (1 << marks.SHIFT)), manner.colour, -1, cv2.LINE_AA, marks.SHIFT)
    region[...] = cv2.addWeighted(over, manner.fill, region, 1 - manner.fill, 0)
    marks.ring(image, centre, radius, edge, 1 + (radius > 30))
