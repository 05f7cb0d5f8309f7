"""The orders of SMAC's agents, one for each in a step, given as the API gives them.

A unit whose type has the order itself on its card, as almost all have, gets it here without a message; every other
order goes through `khala_simulator.api.abilities`. Both make the same world. Above: `khala_sc2.env.numeric`. Below:
`khala_simulator.api`, `khala_simulator.abilities`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_simulator.abilities import commands
from khala_simulator.api.abilities import UnitCommand, judge
from khala_simulator.api.giving import carry_out
from khala_simulator.battle import PLAYER
from khala_simulator.combat import tags
from khala_simulator.native import columns, memory
from khala_simulator.smac.rules import FIRST_MOVE, FIRST_TARGET, MOVES, NO_OP
from khala_simulator.smac.rules import STOP as STOP_ACTION
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.orders import ATTACK, KINDS, MOVE, STOP, OrderKind
from khala_simulator.world.world import NO_TAG

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from khala_simulator.native.columns import Columns
    from khala_simulator.smac.fighters import Fighters
    from khala_simulator.world.world import World

    Point = tuple[float, float]

HEAL: Final = 386
IDLE: Final = int(OrderKind.IDLE)
WALK: Final = int(OrderKind.MOVE)
ATTACK_UNIT: Final = int(OrderKind.ATTACK_UNIT)


def give_orders(world: World, fighters: Fighters, actions: NDArray[np.int64], move_amount: float) -> None:
    """Give each agent the order of its action, in their order; what a unit cannot do it does not do.

    Args:
        world: of the battle.
        fighters: both sides as they were seen last.
        actions: (agents,) an action for each.
        move_amount: how far a move goes, in world units.
    """
    chosen = memory.ints(actions)
    for agent in range(fighters.agents):
        action = chosen[agent]
        if action == NO_OP:
            continue
        tag = fighters.tags[agent]
        if action == STOP_ACTION:
            _order(world, tag, STOP, NO_TAG, None)
        elif action < FIRST_TARGET:
            _order(world, tag, MOVE, NO_TAG, _goal(fighters, agent, action - FIRST_MOVE, move_amount))
        elif fighters.heals[agent]:
            _order(world, tag, HEAL, fighters.tags[action - FIRST_TARGET], None)
        else:
            _order(world, tag, ATTACK, fighters.tags[fighters.agents + action - FIRST_TARGET], None)


def _goal(fighters: Fighters, agent: int, way: int, far: float) -> Point:
    """Return where a move goes, rounded to the 32 bits of a message."""
    dx, dy = MOVES[way]
    x = fighters.cells[agent] + dx * far
    y = fighters.cells[fighters.count + agent] + dy * far
    return memory.single(x), memory.single(y)


def _order(world: World, tag: int, ability: int, target: int, point: Point | None) -> None:
    """Give a unit one order."""
    c = columns.columns_of(world)
    slot = tags.slot_of(c, tag)
    if slot == NOBODY or not _has(world, c.type[slot], ability):
        carry_out(world, judge(world, PLAYER, UnitCommand(ability, (tag,), target, point)))
    elif c.build_progress[slot] < 1.0:
        return
    elif ability == STOP:
        commands.halt(world, slot)
    elif point is not None:
        commands.send(world, slot, point)
    elif _may_attack(c, target):
        commands.set_on(world, slot, target)


def _has(world: World, row: int, ability: int) -> bool:
    """Return whether a type has an ordinary order itself on its card."""
    kind = IDLE if ability == STOP else WALK if ability == MOVE else ATTACK_UNIT
    usual: int = memory.ints(world.usual)[row * KINDS + kind]
    return usual == ability


def _may_attack(c: Columns, tag: int) -> bool:
    """Return whether the player may aim at a unit: whether it is there and in sight."""
    victim = tags.slot_of(c, tag)
    return victim != NOBODY and bool(c.visible[PLAYER * c.capacity + victim])
