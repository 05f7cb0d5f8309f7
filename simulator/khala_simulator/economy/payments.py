"""Payments: a player is charged a price, and gets a share of it back.

Above: ``casting``, ``production``, ``construction``. Below: ``prices``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from khala_simulator.tables.prices import Cost
    from khala_simulator.world.world import World

ALL: Final = 1.0
"""Share of the price that comes back for a job that was only queued."""
CANCELLED: Final = 0.75
"""Share that comes back for a structure whose construction is called off, and for a morph (mechanics: refunds)."""


def charge(world: World, player: int, cost: Cost) -> Cost:
    """Charge a player a price; return the price taken, nothing from a player that plays for free."""
    purse = world.players[player]
    if "free" in purse.cheats:
        return 0.0, 0.0
    purse.minerals -= cost[0]
    purse.vespene -= cost[1]
    purse.score.spent[0] += cost[0]
    purse.score.spent[1] += cost[1]
    return cost


def refund(world: World, player: int, paid: Cost, share: float = ALL) -> None:
    """Refund a share of a payment, in whole points (rounding down is an estimate)."""
    purse = world.players[player]
    for index, amount in enumerate(paid):
        back = float(int(amount * share))
        purse.score.spent[index] -= back
        if index:
            purse.vespene += back
        else:
            purse.minerals += back
