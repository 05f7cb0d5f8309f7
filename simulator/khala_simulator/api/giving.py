"""Give a command that was judged to the units that can take it.

Above: `actions.py`. Below: `abilities.py` (which judges), `commands.py` (moves and fights), `casting.py` (the rest).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

from s2clientprotocol import error_pb2

from khala_simulator.abilities import casting, commands
from khala_simulator.api.abilities import result_of
from khala_simulator.tables.action_result import ActionResult

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_simulator.api.abilities import OrderPlan, Result
    from khala_simulator.world.world import World


SUCCESS: Final = error_pb2.Success


class CommandOutcome(NamedTuple):
    """The outcome of a command: its result, the specific ability, and the units that took it."""

    result: Result
    ability: int = 0
    slots: tuple[int, ...] = ()


def carry_out(world: World, plan: OrderPlan) -> CommandOutcome:
    """Give a command to the units that can take it, as judged in the present world."""
    if plan.result != SUCCESS:
        return CommandOutcome(plan.result)
    taken: list[int] = []
    queue = plan.asked.queue
    for ability, casts in plan.parts:
        slots = [cast.slot for cast in casts]
        if ability.effect in GIVE:
            taken += GIVE[ability.effect](world, slots, plan)
        elif taken:  # an earlier part may have used up what this one costs
            taken += casting.use(world, slots, ability, target=plan.target, point=plan.point, queue=queue)
        else:
            taken += casting.order(world, casts, ability, queue=queue)
    if not taken:
        return CommandOutcome(result_of(ActionResult.ORDER_QUEUE_IS_FULL if queue else ActionResult.ERROR))
    return CommandOutcome(SUCCESS, plan.ability, tuple(taken))


def _move(world: World, slots: list[int], plan: OrderPlan) -> list[int]:
    if plan.point is not None:
        return commands.move(world, slots, plan.point, queue=plan.asked.queue)
    return commands.follow(world, slots, plan.target, queue=plan.asked.queue)


def _patrol(world: World, slots: list[int], plan: OrderPlan) -> list[int]:
    x, y = plan.point or world.pos[world.slot_of(plan.target)].tolist()
    return commands.patrol(world, slots, (x, y), queue=plan.asked.queue)


def _attack(world: World, slots: list[int], plan: OrderPlan) -> list[int]:
    if plan.point is not None:
        return commands.attack_move(world, slots, plan.point, queue=plan.asked.queue)
    return commands.attack_unit(world, slots, plan.target, queue=plan.asked.queue)


def _scan_move(world: World, slots: list[int], plan: OrderPlan) -> list[int]:
    if plan.point is not None:
        return commands.attack_move(world, slots, plan.point, queue=plan.asked.queue)
    return commands.follow(world, slots, plan.target, queue=plan.asked.queue)


def _stop(world: World, slots: list[int], plan: OrderPlan) -> list[int]:
    return commands.stop(world, slots, queue=plan.asked.queue)


def _hold(world: World, slots: list[int], plan: OrderPlan) -> list[int]:
    return commands.hold(world, slots, queue=plan.asked.queue)


def _smart(world: World, slots: list[int], plan: OrderPlan) -> list[int]:
    return casting.smart(world, slots, point=plan.point, target=plan.target, queue=plan.asked.queue)


GIVE: dict[str, Callable[[World, list[int], OrderPlan], list[int]]] = {
    "smart": _smart,
    "stop": _stop,
    "move": _move,
    "patrol": _patrol,
    "hold_position": _hold,
    "attack": _attack,
    "scan_move": _scan_move,
}
"""Commands that are no skills; all others go through ``casting.order``."""
