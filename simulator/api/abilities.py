"""Commands: which ability a requested id means to each unit, how the world is told, and what came of it.

Clients name an ability by its general or by its specific id. A general one stands for whichever specific one each
unit has: Attack (3674) is an attack (23) to a Stalker and a scan-move (19) to an Observer. What a command was in the
end is reported back with the specific id.

Above: `actions.py`, `query.py`, `observation.py`. Below: `commands.py` (moves and fights), `casting.py` (the rest).
"""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING, TypeAlias

from s2clientprotocol import error_pb2

from simulator import casting, commands
from simulator.abilities import Aim
from simulator.casts import Cast
from simulator.refusal import Refusal
from simulator.world import NO_TAG, NOBODY

if TYPE_CHECKING:
    from collections.abc import Callable

    from simulator.catalog import Ability
    from simulator.world import World

    Point = tuple[float, float]
    Result: TypeAlias = error_pb2.ActionResult.ValueType


@dataclasses.dataclass(frozen=True, slots=True)
class Command:
    """What a player asked for: an ability id of either kind, for units by tag, at a unit, a point or nothing."""

    ability: int
    tags: tuple[int, ...]
    target: int = NO_TAG
    point: Point | None = None
    queue: bool = False
    clicked: Point | None = None  # where on the screen the target was clicked, world units

    @property
    def aim(self) -> Aim:
        """The kind of its target."""
        if self.target != NO_TAG:
            return Aim.UNIT
        return Aim.NONE if self.point is None else Aim.POINT


@dataclasses.dataclass(frozen=True, slots=True)
class Outcome:
    """What became of a command: how it went, as which specific ability, and which units took it."""

    result: Result
    ability: int = 0
    slots: tuple[int, ...] = ()


def result_of(why: Refusal) -> Result:
    """The API's word for a refusal."""
    result: Result = error_pb2.ActionResult.Value(error_pb2.ActionResult.Name(int(why)))  # type: ignore[arg-type]  # same numbers
    return result


def _refused(why: Refusal) -> Outcome:
    return Outcome(result_of(why))


def meant(world: World, slot: int, requested: int) -> Ability | None:
    """What a requested id, general or specific, means to a unit; None for nothing.

    Of several that one general id stands for, such as the ways to cancel, the first that the unit can use now.
    """
    card = world.catalog.abilities_of(int(world.type[slot])) if requested > 0 else ()
    exact = next((a for a in card if a.id == requested), None)
    if exact is not None:
        return exact
    fitting = [a for a in card if a.general == requested and casting.is_modelled(a)]
    now = (a for a in fitting if casting.refusal(world, slot, a) is Refusal.SUCCESS)
    return next(now, fitting[0] if fitting else None)


def usable(world: World, slot: int, *, free: bool = False) -> list[Ability]:
    """What a unit can be told to do now, by ascending id; ``free`` looks at no cost and no cooldown."""
    card = world.catalog.abilities_of(int(world.type[slot]))
    return [a for a in card if casting.refusal(world, slot, a, free=free) is Refusal.SUCCESS]


def judge(world: World, player: int, command: Command) -> Outcome:
    """How a command would go now, without giving it."""
    command = _without_snapshot(world, player, command)
    slots = [slot for slot in dict.fromkeys(map(world.slot_of, command.tags)) if slot != NOBODY]
    all_obey = "control_enemy" in world.players[player].cheats
    own = [slot for slot in slots if world.owner[slot] == player or (all_obey and world.owner[slot] > 0)]
    if not own:
        return _refused(Refusal.YOU_CANT_CONTROL_THAT_UNIT if slots else Refusal.ERROR)
    if command.point is not None and not all(map(math.isfinite, command.point)):
        return _refused(Refusal.MUST_TARGET_VISIBLE_LOCATION)
    groups = _groups(world, own, command.ability)
    if not groups:
        return _refused(Refusal.NOT_SUPPORTED)
    able: list[tuple[Ability, list[int]]] = []
    why = Refusal.ERROR
    for ability, some in groups:
        results = [(slot, _refusal(world, player, slot, ability, command)) for slot in some]
        takers = [slot for slot, result in results if result is Refusal.SUCCESS]
        if takers:
            able.append((ability, takers))
        elif not able:
            why = results[0][1]
    if not able:
        return _refused(why)
    return Outcome(error_pb2.Success, _name_of(able), tuple(slot for _, some in able for slot in some))


def carry_out(world: World, player: int, command: Command) -> Outcome:
    """Gives a command to the units that can take it; the others are left alone."""
    outcome = judge(world, player, command)
    command = _without_snapshot(world, player, command)
    if outcome.result != error_pb2.Success:
        return outcome
    taken: list[int] = []
    for ability, slots in _groups(world, list(outcome.slots), command.ability):
        taken += _give(world, ability, slots, command)
    if not taken:
        return _refused(Refusal.ORDER_QUEUE_IS_FULL if command.queue else Refusal.ERROR)
    return Outcome(error_pb2.Success, outcome.ability, tuple(taken))


def _without_snapshot(world: World, player: int, command: Command) -> Command:
    """A command at a snapshot as one at what it shows: a resource that still lies there, or else its place."""
    snapshot = world.memories[player].find(command.target) if command.target != NO_TAG else None
    if snapshot is None:
        return command
    if world.catalog.units[snapshot.row].resource and world.slot_of(snapshot.unit) != NOBODY:
        return dataclasses.replace(command, target=snapshot.unit)
    return dataclasses.replace(command, target=NO_TAG, point=snapshot.pos)


def _name_of(able: list[tuple[Ability, list[int]]]) -> int:
    """The id by which a command of several kinds is reported: that of a fight before that of a walk."""
    return max(able, key=lambda group: (group[0].does == "attack", -group[0].id))[0].id


def _groups(world: World, slots: list[int], requested: int) -> list[tuple[Ability, list[int]]]:
    """The specific abilities that a requested id stands for, with the units that have each, by ascending id."""
    groups: dict[int, tuple[Ability, list[int]]] = {}
    for slot in slots:
        ability = meant(world, slot, requested)
        if ability is not None and casting.is_modelled(ability):
            groups.setdefault(ability.id, (ability, []))[1].append(slot)
    return [groups[number] for number in sorted(groups)]


def _refusal(world: World, player: int, slot: int, ability: Ability, command: Command) -> Refusal:
    if not command.aim & ability.aim:
        aimless = Aim.POINT not in ability.aim
        return Refusal.MUST_TARGET_UNIT if aimless and Aim.UNIT in ability.aim else (
            Refusal.ERROR if aimless else Refusal.MUST_TARGET_VISIBLE_LOCATION
        )  # fmt: skip
    target = NOBODY
    if command.aim is Aim.UNIT:
        target = world.slot_of(command.target)
        known = target != NOBODY and command.target in world.memories[player].of_unit
        if target == NOBODY or not (known or world.visible[player, target]):
            return Refusal.MUST_TARGET_VISIBLE_UNIT
    why = casting.refusal(world, slot, ability)
    if why is not Refusal.SUCCESS:
        return why
    if ability.does == "attack" and target != NOBODY:
        return _cant_attack(world, slot, target)
    if ability.does in casting.ORDINARY:
        return Refusal.SUCCESS
    return casting.aim_refusal(world, Cast(slot, ability, target, command.point))


def _cant_attack(world: World, slot: int, target: int) -> Refusal:
    if slot != target and commands.can_reach(world, slot, target):
        return Refusal.SUCCESS
    flies = world.unit_type(target).flying
    return Refusal.CANT_TARGET_AIR_UNITS if flies else Refusal.CANT_TARGET_THAT_UNIT


# giving ---------------------------------------------------------------------------------------------------------------


def _give(world: World, ability: Ability, slots: list[int], command: Command) -> list[int]:
    give = GIVE.get(ability.does)
    if give is not None:
        return give(world, slots, command)
    return casting.use(world, slots, ability, target=command.target, point=command.point, queue=command.queue)


def _move(world: World, slots: list[int], command: Command) -> list[int]:
    if command.point is not None:
        return commands.move(world, slots, command.point, queue=command.queue)
    return commands.follow(world, slots, command.target, queue=command.queue)


def _patrol(world: World, slots: list[int], command: Command) -> list[int]:
    x, y = command.point or world.pos[world.slot_of(command.target)].tolist()
    return commands.patrol(world, slots, (x, y), queue=command.queue)


def _attack(world: World, slots: list[int], command: Command) -> list[int]:
    if command.point is not None:
        return commands.attack_move(world, slots, command.point, queue=command.queue)
    return commands.attack_unit(world, slots, command.target, queue=command.queue)


def _scan_move(world: World, slots: list[int], command: Command) -> list[int]:
    if command.point is not None:
        return commands.attack_move(world, slots, command.point, queue=command.queue)
    return commands.follow(world, slots, command.target, queue=command.queue)


def _stop(world: World, slots: list[int], command: Command) -> list[int]:
    return commands.stop(world, slots, queue=command.queue)


def _hold(world: World, slots: list[int], command: Command) -> list[int]:
    return commands.hold(world, slots, queue=command.queue)


def _smart(world: World, slots: list[int], command: Command) -> list[int]:
    return casting.smart(world, slots, point=command.point, target=command.target, queue=command.queue)


GIVE: dict[str, Callable[[World, list[int], Command], list[int]]] = {
    "smart": _smart,
    "stop": _stop,
    "move": _move,
    "patrol": _patrol,
    "hold_position": _hold,
    "attack": _attack,
    "scan_move": _scan_move,
}
"""What is no skill; everything else goes through ``casting.use``."""
