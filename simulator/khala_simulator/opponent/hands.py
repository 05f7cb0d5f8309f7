"""Hands: the only way in which a computer player gives orders, as many as its level has attention for.

An order to a group counts once, as a client's does. Every function returns whether the order was given and taken; with
no attention left none is. The orders go the same way as a client's, through ``casting`` and ``commands``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_simulator.abilities import casting, commands
from khala_simulator.opponent.levels import FASTER_LOOPS
from khala_simulator.world.world import NO_TAG

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from khala_simulator.opponent.side import OwnSide
    from khala_simulator.tables.abilities import Ability
    from khala_simulator.world.casts import Point

SAVED_S: Final = 6.0
"""For how many seconds attention that is not needed can be saved up."""


def rest(side: OwnSide) -> None:
    """Give a player the attention for the loops since its last thought."""
    mind = side.mind
    a_loop = side.level.actions / 60.0 / FASTER_LOOPS
    most = max(2.0, SAVED_S * FASTER_LOOPS * a_loop)
    mind.actions = min(most, mind.actions + (side.world.loop - mind.thought) * a_loop)
    mind.thought = side.world.loop


def free(side: OwnSide) -> bool:
    """Return whether one more order can be given."""
    return side.mind.actions >= 1.0


def use(
    side: OwnSide, slots: Iterable[int], ability: Ability, *, target: int = NO_TAG, point: Point | None = None
) -> bool:
    """Make units use an ability on a unit (tag), at a point, or on nothing."""
    return _give(side, lambda: casting.use(side.world, slots, ability, target=target, point=point))


def smart(side: OwnSide, slots: Iterable[int], target: int) -> bool:
    """Right-click a unit (tag)."""
    return _give(side, lambda: casting.smart(side.world, slots, target=target))


def gather(side: OwnSide, slots: Iterable[int], target: int, *, queue: bool = False) -> bool:
    """Make workers harvest a resource (tag)."""
    return _give(side, lambda: commands.gather(side.world, slots, target, queue=queue))


def move(side: OwnSide, slots: Iterable[int], point: Point) -> bool:
    """Make units walk to a point."""
    return _give(side, lambda: commands.move(side.world, slots, point))


def attack(side: OwnSide, slots: Iterable[int], point: Point) -> bool:
    """Make units walk to a point and fight what they meet."""
    return _give(side, lambda: commands.attack_move(side.world, slots, point))


def attack_unit(side: OwnSide, slots: Iterable[int], target: int) -> bool:
    """Make units attack a unit (tag)."""
    return _give(side, lambda: commands.attack_unit(side.world, slots, target))


def _give(side: OwnSide, order: Callable[[], list[int]]) -> bool:
    if not free(side) or not order():
        return False
    side.mind.actions -= 1.0
    return True
