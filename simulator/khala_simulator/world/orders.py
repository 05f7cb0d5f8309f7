"""Orders of units: their kinds, and one order as a value.

The current order of every unit is in the world's arrays, waiting ones are ``Order`` values in its queue. ``commands``
creates them from a player's commands, ``systems.orders`` carries them out.
"""

from __future__ import annotations

from enum import IntEnum
from functools import lru_cache
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from khala_simulator.tables.catalog import Catalog
    from khala_simulator.world.columns import Ints


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


@lru_cache(maxsize=4)
def usual_abilities(catalog: Catalog) -> Ints:
    """Return (types, ``KINDS``) the ability with which a type of units has an order of a kind, -1 without one."""
    found = [[card.get(_USUAL.get(kind, ""), -1) for kind in OrderKind] for card in catalog.ordinary]
    return np.array(found, dtype=np.int64)


KINDS: Final = len(OrderKind)
_USUAL: Final[dict[OrderKind, str]] = {
    OrderKind.IDLE: "stop",
    OrderKind.MOVE: "move",
    OrderKind.FOLLOW: "move",
    OrderKind.ATTACK_MOVE: "attack",
    OrderKind.ATTACK_UNIT: "attack",
    OrderKind.HOLD: "hold_position",
    OrderKind.PATROL: "patrol",
    OrderKind.SCAN_MOVE: "scan_move",
}
"""What the tables call the abilities of orders; a Battlecruiser has its own move."""

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
