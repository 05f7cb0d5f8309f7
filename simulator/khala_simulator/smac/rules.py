"""The numbers of SMAC's rules: actions, ranges, and the points of an observation."""

from __future__ import annotations

from typing import Final

SHOOT_RANGE: Final = 6
SIGHT_RANGE: Final = 9
NO_OP: Final = 0
STOP: Final = 1
FIRST_MOVE: Final = 2
FIRST_TARGET: Final = 6
MOVES: Final = ((0, 1), (0, -1), (1, 0), (-1, 0))
"""North, south, east and west: the actions from `FIRST_MOVE` on."""
PATHING_POINTS: Final = ((0, 2), (0, -2), (2, 0), (-2, 0), (1, 1), (-1, -1), (1, -1), (-1, 1))
"""Points of an observation around a unit, in lengths of a move."""
HEIGHT_POINTS: Final = (*PATHING_POINTS, (0, 0))
NOTHING: Final = -1
"""The last action of an agent before its first."""

GOES_ON: Final = 0
"""What becomes of a battle: so far, and at its end."""
WON: Final = 1
LOST: Final = 2
DRAW: Final = 3
