"""Orders of units: their kinds, and one order as a value.

The current order of every unit is in the world's arrays, waiting ones are ``Order`` values in its queue. ``commands``
creates them from a player's commands, ``systems.orders`` carries them out.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Final, NamedTuple


class OrderKind(IntEnum):
    """How an order is carried out; the API's ability id stands beside it and may be more specific."""

    IDLE = 0
    MOVE = 1
    FOLLOW = 2
    ATTACK_MOVE = 3
    ATTACK_UNIT = 4
    HOLD = 5
    PATROL = 6
    SCAN_MOVE = 7
    CAST = 8
    GATHER = 9
    RETURN = 10


def bits(*kinds: OrderKind) -> int:
    """Return some kinds as a number, in which the bit of each is set: compiled rules ask it quickly."""
    return sum(1 << kind for kind in kinds)


WALKS: Final = bits(OrderKind.MOVE, OrderKind.ATTACK_MOVE, OrderKind.SCAN_MOVE, OrderKind.PATROL)
SEEKS_FIGHTS: Final = bits(OrderKind.ATTACK_MOVE, OrderKind.HOLD, OrderKind.PATROL)
LOOKS_AROUND: Final = SEEKS_FIGHTS | bits(OrderKind.IDLE)
NEEDS_TARGET: Final = bits(OrderKind.ATTACK_UNIT, OrderKind.FOLLOW)

SMART: Final = 1
STOP: Final = 4
MOVE: Final = 16
PATROL: Final = 17
HOLD_POSITION: Final = 18
SCAN_MOVE: Final = 19
ATTACK: Final = 23


class Order(NamedTuple):
    """One order: its kind, the specific ability id the API reports, and its target.

    ``target`` is a unit tag or 0, ``point`` world coordinates or None. ``origin`` is the other end of a patrol,
    ``progress`` how far the work on it is, 0..1.
    """

    kind: OrderKind
    ability: int
    target: int = 0
    point: tuple[float, float] | None = None
    origin: tuple[float, float] | None = None
    progress: float = 0.0
