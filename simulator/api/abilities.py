"""Abilities: which unit has which, what a requested id means to it, and how the world is told.

Clients name an ability by its general or by its specific id. A general one stands for whichever specific one each
unit has: Attack (3674) is an attack (23) to a Stalker and a scan-move (19) to an Observer. What a command was in the
end is reported back with the specific id. The table holds what the world can do, and no more.

Above: `actions.py`, `query.py`, `observation.py`. Below: `commands.py`.
"""

from __future__ import annotations

import dataclasses
import enum
import functools
import math
from typing import TYPE_CHECKING, TypeAlias

from s2clientprotocol import error_pb2

from simulator import commands, orders
from simulator.world import NO_TAG, NOBODY

if TYPE_CHECKING:
    from collections.abc import Callable

    from simulator.records import UnitType
    from simulator.world import World

    Point = tuple[float, float]
    Result: TypeAlias = error_pb2.ActionResult.ValueType


class Target(enum.Flag):
    """What an ability can be aimed at."""

    NONE = enum.auto()
    POINT = enum.auto()
    UNIT = enum.auto()


@dataclasses.dataclass(frozen=True, slots=True)
class Command:
    """What a player asked for: an ability id of either kind, for units by tag, at a unit, a point or nothing."""

    ability: int
    tags: tuple[int, ...]
    target: int = NO_TAG
    point: Point | None = None
    queue: bool = False

    @property
    def aim(self) -> Target:
        """The kind of its target."""
        if self.target != NO_TAG:
            return Target.UNIT
        return Target.NONE if self.point is None else Target.POINT


@dataclasses.dataclass(frozen=True, slots=True)
class Outcome:
    """What became of a command: how it went, as which specific ability, and which units took it."""

    result: Result
    ability: int = 0
    slots: tuple[int, ...] = ()


@dataclasses.dataclass(frozen=True, slots=True)
class Ability:
    """A specific ability; `give` tells the world, and returns the slots that took the order."""

    id: int
    general: int
    targets: Target
    usable: Callable[[UnitType], bool]
    give: Callable[[World, list[int], Command], list[int]]

    @property
    def requires_point(self) -> bool:
        """Whether it must be aimed, as the API's list of available abilities says it."""
        return Target.NONE not in self.targets


def _move(world: World, slots: list[int], command: Command) -> list[int]:
    if command.point is not None:
        return commands.move(world, slots, command.point, queue=command.queue)
    return commands.follow(world, slots, command.target, queue=command.queue)


def _patrol(world: World, slots: list[int], command: Command) -> list[int]:
    x, y = command.point or world.pos[world.slot_of(command.target)]
    return commands.patrol(world, slots, (float(x), float(y)), queue=command.queue)


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
    return commands.smart(world, slots, point=command.point, target=command.target, queue=command.queue)


def _can_act(unit: UnitType) -> bool:
    return commands.can_move(unit) or commands.can_attack(unit)


def _can_only_look(unit: UnitType) -> bool:
    return commands.can_move(unit) and not commands.can_attack(unit)


_AIMED = Target.POINT | Target.UNIT
ABILITIES = (
    Ability(orders.SMART, orders.SMART, _AIMED, _can_act, _smart),
    Ability(orders.STOP, 3665, Target.NONE, _can_act, _stop),
    Ability(orders.MOVE, 3794, _AIMED, commands.can_move, _move),
    Ability(orders.PATROL, 3795, _AIMED, commands.can_move, _patrol),
    Ability(orders.HOLD_POSITION, 3793, Target.NONE, commands.can_move, _hold),
    Ability(orders.ATTACK, 3674, _AIMED, commands.can_attack, _attack),
    Ability(orders.SCAN_MOVE, 3674, _AIMED, _can_only_look, _scan_move),
)
"""Of several that one general id stands for, the first that a unit of the group can use names the command."""


@functools.lru_cache(maxsize=1024)
def abilities_of(unit: UnitType) -> tuple[Ability, ...]:
    """What units of a type can be told to do, by ascending id."""
    return tuple(sorted((a for a in ABILITIES if a.usable(unit)), key=lambda ability: ability.id))


@functools.lru_cache(maxsize=1024)
def aims_of(requested: int) -> Target:
    """What an ability, by its general or specific id, can be aimed at; nothing for one that is not known."""
    aims = Target(0)
    for ability in ABILITIES:
        if requested in (ability.id, ability.general):
            aims |= ability.targets
    return aims


def judge(world: World, player: int, command: Command) -> Outcome:
    """How a command would go now, without giving it."""
    slots = [slot for slot in dict.fromkeys(map(world.slot_of, command.tags)) if slot != NOBODY]
    own = [slot for slot in slots if world.owner[slot] == player]
    able = _able(world, own, command.ability)
    if not own:
        return Outcome(error_pb2.YouCantControlThatUnit if slots else error_pb2.Error)
    if not able:
        return Outcome(error_pb2.NotSupported)
    if problem := _wrong_aim(world, player, command, *able[0]):
        return Outcome(problem)
    return Outcome(error_pb2.Success, able[0][0].id, tuple(slot for _, some in able for slot in some))


def carry_out(world: World, player: int, command: Command) -> Outcome:
    """Gives a command to the units that can take it; the others are left alone."""
    outcome = judge(world, player, command)
    if outcome.result != error_pb2.Success:
        return outcome
    taken: list[int] = []
    for ability, slots in _able(world, list(outcome.slots), command.ability):
        taken += ability.give(world, slots, command)
    if not taken:
        return Outcome(error_pb2.OrderQueueIsFull if command.queue else error_pb2.Error)
    return Outcome(error_pb2.Success, outcome.ability, tuple(taken))


def _able(world: World, slots: list[int], requested: int) -> list[tuple[Ability, list[int]]]:
    """The specific abilities that a requested id stands for, with the units that have each."""
    meant = [ability for ability in ABILITIES if requested in (ability.id, ability.general)]
    groups = ((a, [slot for slot in slots if a.usable(world.unit_type(slot))]) for a in meant)
    return [(ability, some) for ability, some in groups if some]


def _wrong_aim(world: World, player: int, command: Command, ability: Ability, takers: list[int]) -> Result | None:
    if not command.aim & ability.targets:
        return error_pb2.MustTargetVisibleLocation if Target.POINT in ability.targets else error_pb2.Error
    if command.point is not None and not all(map(math.isfinite, command.point)):
        return error_pb2.MustTargetVisibleLocation
    if command.aim is Target.UNIT:
        return _wrong_unit(world, player, ability, takers, command.target)
    return None


def _wrong_unit(world: World, player: int, ability: Ability, takers: list[int], tag: int) -> Result | None:
    target = world.slot_of(tag)
    if target == NOBODY or not world.visible[player, target]:
        return error_pb2.MustTargetVisibleUnit
    if ability.id != orders.ATTACK or any(s != target and commands.can_reach(world, s, target) for s in takers):
        return None
    return error_pb2.CantTargetAirUnits if world.unit_type(target).flying else error_pb2.CantTargetThatUnit
