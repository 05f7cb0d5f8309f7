"""The colours of pictures, as OpenCV has them: blue, green, red.

Sides differ in hue, lightness and rim, so that colour blind people can distinguish them: own units have light rims,
enemies dark ones. The ground is grey and dull; units, effects and marks are bright.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

Colour: TypeAlias = tuple[int, int, int]
Side: TypeAlias = Literal["team", "own", "ally", "enemy", "neutral"]
"""Owner of a unit: the team or agent that looks, the same player, an ally, an enemy, or nobody."""


@dataclass(frozen=True, slots=True)
class AllianceColors:
    """The colours of one side: of bodies, of their rims, of letters on them, and of marks and dots."""

    name: str
    """Name of the colour in a picture's title."""
    body: Colour
    rim: Colour
    ink: Colour
    mark: Colour


LIVERIES: dict[Side, AllianceColors] = {
    "team": AllianceColors("blue", (248, 128, 40), (255, 240, 222), (255, 255, 255), (255, 216, 160)),
    "own": AllianceColors("green", (84, 150, 34), (214, 250, 206), (255, 255, 255), (160, 244, 160)),
    "ally": AllianceColors("yellow", (40, 176, 214), (190, 244, 252), (20, 40, 46), (110, 232, 250)),
    "enemy": AllianceColors("red", (38, 52, 212), (8, 6, 52), (232, 244, 255), (150, 170, 255)),
    "neutral": AllianceColors("grey", (146, 156, 160), (60, 64, 68), (34, 38, 40), (200, 206, 208)),
}

MINERALS: Colour = (232, 200, 84)
RICH_MINERALS: Colour = (72, 196, 236)
VESPENE: Colour = (92, 196, 92)

VOID: Colour = (14, 12, 11)
"""Outside of the map, and the margins with the labels of the axes."""
LOW: Colour = (74, 68, 62)
HIGH: Colour = (126, 142, 150)
"""Ground at the lowest and at the highest level of the map."""
RAMP: Colour = (120, 168, 184)
"""Tint of ground that is walkable but not buildable."""
ROCK: Colour = (36, 34, 36)
"""Tint of ground that is not walkable."""
CREEP: Colour = (104, 34, 88)
POWER: Colour = (255, 170, 90)
LINE: Colour = (255, 255, 255)
LABEL: Colour = (222, 226, 228)
INK: Colour = (12, 10, 8)
"""Around letters and behind bars."""

HEALTHY: Colour = (88, 214, 84)
HURT: Colour = (48, 200, 240)
DYING: Colour = (56, 60, 240)
SHIELD: Colour = (255, 204, 120)
ENERGY: Colour = (255, 118, 206)
PROGRESS: Colour = (120, 228, 250)
ATTACKING: Colour = (70, 80, 255)
MOVING: Colour = (120, 232, 150)


def health_colour(share: float) -> Colour:
    """Return the colour of a health bar: green above two thirds, yellow above one third, red below."""
    return HEALTHY if share > 2 / 3 else HURT if share > 1 / 3 else DYING


def mix(start: Colour, end: Colour, part: float) -> Colour:
    """Return a mix of two colours; at 0 the first one."""
    first, second, third = (round(a + (b - a) * part) for a, b in zip(start, end, strict=True))
    return first, second, third
