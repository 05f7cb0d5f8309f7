"""The colours of rendered images.

Sides differ by hue (blue against vermilion, which every common kind of colour blindness leaves distinct), by lightness,
and by their rim: light around own units, dark around the enemy's. The ground stays grey and dull, so that colour always
means a unit or an effect.
"""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

import numpy as np

from khala_simulator.api.sight import API_NEUTRAL, OBSERVER, Alliance

if TYPE_CHECKING:
    from typing import TypeAlias

    from numpy.typing import NDArray

    from khala_simulator.tables.records import UnitType

Colour: TypeAlias = "tuple[int, int, int]"


@dataclasses.dataclass(frozen=True)
class PlayerColors:
    """The colours of one side's units."""

    body: Colour
    rim: Colour
    dark: Colour  # inner parts of structures, cut-outs of a body
    ink: Colour  # letters
    beam: Colour  # its shots
    dot: Colour  # on the minimap


LIVERIES: dict[int, PlayerColors] = {
    Alliance.SELF: PlayerColors(
        body=(58, 140, 255), rim=(214, 236, 255), dark=(16, 54, 122), ink=(255, 255, 255),
        beam=(150, 220, 255), dot=(70, 165, 255),
    ),
    Alliance.ALLY: PlayerColors(
        body=(40, 178, 120), rim=(206, 255, 228), dark=(8, 78, 52), ink=(255, 255, 255),
        beam=(160, 255, 200), dot=(60, 220, 150),
    ),
    Alliance.NEUTRAL: PlayerColors(
        body=(168, 162, 146), rim=(96, 92, 84), dark=(104, 98, 88), ink=(40, 38, 34),
        beam=(220, 220, 200), dot=(170, 166, 150),
    ),
    Alliance.ENEMY: PlayerColors(
        body=(226, 66, 34), rim=(44, 4, 2), dark=(110, 22, 8), ink=(255, 240, 214),
        beam=(255, 176, 96), dot=(255, 84, 44),
    ),
}  # fmt: skip

_OF_PLAYER = np.array([Alliance.NEUTRAL, Alliance.SELF, Alliance.ENEMY, Alliance.ALLY])
"""The side whose colours an observer sees on the units of a player; it has no side itself."""

VOID: Colour = (12, 13, 18)
LOW: Colour = (62, 68, 74)
"""Ground at the height of the lowest cliff level, and at the highest."""
HIGH: Colour = (142, 134, 118)
ROCK: Colour = (46, 44, 46)
"""Unwalkable ground shifts towards this colour."""
EDGE: Colour = (20, 19, 22)
CREST: Colour = (196, 188, 168)
"""The line along a cliff, on its lower and on its upper side."""
RAMP: Colour = (176, 160, 112)
CREEP: Colour = (92, 40, 110)
GRID: Colour = (255, 255, 255)

HEALTH: tuple[Colour, Colour, Colour] = ((232, 58, 48), (240, 196, 48), (84, 214, 88))
"""A third or less, up to two thirds, more."""
SHIELD: Colour = (120, 200, 255)
ENERGY: Colour = (206, 118, 255)
PROGRESS: Colour = (250, 226, 120)
BLIP: Colour = (150, 30, 40)
BOON: Colour = (255, 214, 92)
"""A buff from the unit's own side, and one from another side."""
BANE: Colour = (232, 92, 255)
BAR: Colour = (10, 10, 12)
SELECTED: Colour = (130, 255, 120)
CAMERA: Colour = (255, 255, 255)
ALERT: Colour = (255, 240, 60)
MINERALS: Colour = (96, 214, 236)
RICH_MINERALS: Colour = (240, 200, 80)
VESPENE: Colour = (88, 200, 96)


def mix(one: Colour, other: Colour, part: float) -> Colour:
    """Return a colour between two, at 0 the first."""
    return (
        round(one[0] + (other[0] - one[0]) * part),
        round(one[1] + (other[1] - one[1]) * part),
        round(one[2] + (other[2] - one[2]) * part),
    )


def sides(owner: NDArray[np.int64], alliance: NDArray[np.int64], player: int) -> NDArray[np.int64]:
    """Return (n,) keys of LIVERIES for units of these owners: the alliance, or for an observer the player's colours."""
    if player != OBSERVER:
        return alliance
    number = np.where(owner == API_NEUTRAL, 0, owner)
    row = np.where(number == 0, 0, 1 + (number - 1) % (len(_OF_PLAYER) - 1))
    return _OF_PLAYER.take(row)


def livery_of(unit: UnitType, side: int) -> PlayerColors:
    """Return the colours of a unit of a side; resources have colours of their own."""
    livery = LIVERIES[side]
    if unit.resource:
        stuff = VESPENE if unit.resource == "vespene" else RICH_MINERALS if "Rich" in unit.name else MINERALS
        return dataclasses.replace(livery, body=stuff, rim=mix(stuff, (0, 0, 0), 0.75))
    if unit.name == "ForceField":
        return dataclasses.replace(livery, body=(96, 176, 255), rim=(220, 244, 255))
    return livery
