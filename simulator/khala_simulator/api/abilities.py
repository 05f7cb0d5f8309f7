"""Commands: which ability a requested id means to each unit, and whether the units can do it.

Clients name an ability by its general or by its specific id. A general id stands for the specific one of each unit:
Attack (3674) is an attack (23) to a Stalker and a scan-move (19) to an Observer. The report on a command has the
specific id.

Above: `giving.py`, `actions.py`, `query.py`, `observation.py`. Below: `commands.py` (moves and fights), `casting.py`
(the rest).
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, Final, NamedTuple, TypeAlias

from s2clientprotocol import error_pb2

from khala_simulator.abilities import casting, commands
from khala_simulator.economy import requirements
from khala_simulator.native import columns
from khala_simulator.tables.abilities import AbilityAim
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.world.casts import Cast
from khala_simulator.world.world import NO_TAG, NOBODY

if TYPE_CHECKING:
    from collections.abc import Iterable

    from khala_simulator.tables.catalog import Ability, Catalog
    from khala_simulator.world.world import World

    Point = tuple[float, float]
    Result: TypeAlias = error_pb2.ActionResult.ValueType

SUCCESS: Final = error_pb2.Success
UNIT: Final = int(AbilityAim.UNIT)


class UnitCommand(NamedTuple):
    """What a player asked for: an ability id of either kind, for units by tag, at a unit, a point or nothing."""

    ability: int
    tags: tuple[int, ...]
    target: int = NO_TAG
    point: Point | None = None
    queue: bool = False
    clicked: Point | None = None  # where on the screen the target was clicked, world units

    @property
    def aim(self) -> AbilityAim:
        """The kind of its target."""
        if self.target != NO_TAG:
            return AbilityAim.UNIT
        return AbilityAim.NONE if self.point is None else AbilityAim.POINT


class OrderPlan(NamedTuple):
    """A judged command: its result, and what to do if that is a success.

    Args:
        asked: The command.
        result: The result.
        ability: The specific id in the report.
        target: The unit (tag) that it is aimed at; for a snapshot the unit that it shows.
        point: Where it is aimed.
        parts: The specific abilities, by ascending id, each with its units and its target.
    """

    asked: UnitCommand
    result: Result
    ability: int = 0
    target: int = NO_TAG
    point: Point | None = None
    parts: tuple[tuple[Ability, tuple[Cast, ...]], ...] = ()


def result_of(why: ActionResult) -> Result:
    """Return the API's value for a refusal."""
    result: Result = error_pb2.ActionResult.Value(error_pb2.ActionResult.Name(int(why)))  # type: ignore[arg-type]  # same numbers
    return result


def meant(world: World, slot: int, requested: int) -> Ability | None:
    """Return the ability that a requested id, general or specific, means to a unit, or None.

    If a general id stands for several, such as the ways to cancel, this is the first that the unit can use now.
    """
    return _meant(world, slot, requested)[0]


def _meant(world: World, slot: int, requested: int) -> tuple[Ability | None, ActionResult | None]:
    """Return the result of ``meant``, and whether the unit can use it now; None where that was not checked."""
    exact, kinds = forms(world.catalog, columns.columns_of(world).type[slot], requested)
    if exact is not None:
        return exact, None
    first: tuple[Ability | None, ActionResult | None] = None, None
    for ability in kinds:
        why = casting.refusal(world, slot, ability)
        if why is ActionResult.SUCCESS:
            return ability, why
        first = first if first[0] is not None else (ability, why)
    return first


@lru_cache(maxsize=4096)
def forms(catalog: Catalog, row: int, requested: int) -> tuple[Ability | None, tuple[Ability, ...]]:
    """Return the ability on a type's card with this id, or else those that a general id may mean."""
    card = catalog.abilities_of(row) if requested > 0 else ()
    exact = next((a for a in card if a.id == requested), None)
    return exact, tuple(a for a in card if a.general == requested and casting.is_modelled(a))


@lru_cache(maxsize=1024)
def _card(catalog: Catalog, row: int) -> tuple[Ability, ...]:
    """Return the abilities on the buttons of a type's command card."""
    return tuple(ability for ability in catalog.abilities_of(row) if not ability.unlisted)


def usable(world: World, slot: int, *, free: bool = False) -> list[Ability]:
    """Return the abilities that a unit can use now, by ascending id; ``free`` ignores cost and cooldown."""
    card = _card(world.catalog, int(world.type[slot]))
    return [a for a in card if casting.refusal(world, slot, a, free=free) is ActionResult.SUCCESS]


def usable_by_any(world: World, slots: Iterable[int]) -> list[Ability]:
    """Return the abilities that at least one of a player's units can use now, by ascending id.

    Each is asked until one unit can, or until what is missing is missing to all: thirty selected units of five types
    have 500 abilities on their cards, of which 60 differ.
    """
    found: dict[int, Ability] = {}
    left: dict[int, list[Ability]] = {}  # by type: what is neither found nor missing to all
    for slot in slots:
        row = int(world.type[slot])
        asked = left[row] if row in left else _card(world.catalog, row)
        left[row] = []
        for ability in asked:
            if ability.id in found:
                continue
            why = casting.refusal(world, slot, ability)
            if why is ActionResult.SUCCESS:
                found[ability.id] = ability
            elif not _hopeless(world, slot, ability, why):
                left[row].append(ability)
    return [ability for _, ability in sorted(found.items())]


def _hopeless(world: World, slot: int, ability: Ability, why: ActionResult) -> bool:
    """Return whether an ability that a unit can't use is out of reach for all units of its owner."""
    if why is ActionResult.TECH_REQUIREMENTS_NOT_MET:
        return requirements.missing_to_all(world, slot, ability)
    return why is ActionResult.NOT_SUPPORTED


def judge(world: World, player: int, command: UnitCommand) -> OrderPlan:
    """Judge how a command would go now and what it would do; nothing is done yet."""
    slots = [slot for slot in dict.fromkeys(map(world.slot_of, command.tags)) if slot != NOBODY]
    all_obey = "control_enemy" in world.players[player].cheats
    own = [slot for slot in slots if _obeys(world, slot, player, all_obey)]
    if not own:
        return _refuse(command, ActionResult.YOU_CANT_CONTROL_THAT_UNIT if slots else ActionResult.ERROR)
    aimed = _without_snapshot(world, player, command)
    if aimed.point is not None and not all(map(math.isfinite, aimed.point)):
        return _refuse(command, ActionResult.MUST_TARGET_VISIBLE_LOCATION)
    aimed = _on_the_map(world, aimed)
    groups = _groups(world, own, command.ability)
    if not groups:
        return _refuse(command, ActionResult.NOT_SUPPORTED)
    parts: list[tuple[Ability, tuple[Cast, ...]]] = []
    why = ActionResult.ERROR
    target = NOBODY if aimed.target == NO_TAG else world.slot_of(aimed.target)
    for ability, some in groups:
        result = _aim_result(world, player, ability, aimed, target)
        casts: list[Cast] = []
        if result is ActionResult.SUCCESS:
            results = [_judge_cast(world, slot, ability, aimed, target, known) for slot, known in some]
            casts = [judged for judged in results if isinstance(judged, Cast)]
            result = results[0] if isinstance(results[0], ActionResult) else result
        if casts:
            parts.append((ability, tuple(casts)))
        elif not parts:
            why = result
    if not parts:
        return _refuse(command, why)
    return OrderPlan(command, SUCCESS, _reported_id(parts), aimed.target, aimed.point, tuple(parts))


def _obeys(world: World, slot: int, player: int, all_obey: bool) -> bool:
    owner = columns.columns_of(world).owner[slot]
    return owner == player or (all_obey and owner > 0)


def _refuse(command: UnitCommand, why: ActionResult) -> OrderPlan:
    return OrderPlan(command, result_of(why))


def _without_snapshot(world: World, player: int, command: UnitCommand) -> UnitCommand:
    """Return a command at a snapshot as one at its unit, if that is a resource still in place, or else at its point."""
    snapshot = world.memories[player].find(command.target) if command.target != NO_TAG else None
    if snapshot is None:
        return command
    if world.catalog.units[snapshot.row].resource and world.slot_of(snapshot.unit) != NOBODY:
        return command._replace(target=snapshot.unit)
    return command._replace(target=NO_TAG, point=snapshot.pos)


def _on_the_map(world: World, command: UnitCommand) -> UnitCommand:
    """Return a command at a point beyond the map as one at the nearest point of its edge."""
    if command.point is None:
        return command
    (x, y), (width, height) = command.point, world.map.terrain.size
    point = min(max(x, 0.0), float(width)), min(max(y, 0.0), float(height))
    return command if point == command.point else command._replace(point=point)


def _reported_id(parts: list[tuple[Ability, tuple[Cast, ...]]]) -> int:
    """Return the id that reports a command of several kinds: a fight's before a walk's."""
    if len(parts) == 1:
        return parts[0][0].id
    return max(parts, key=lambda part: (part[0].effect == "attack", -part[0].id))[0].id


def _groups(
    world: World, slots: list[int], requested: int
) -> list[tuple[Ability, list[tuple[int, ActionResult | None]]]]:
    """Return the specific abilities that a requested id stands for, by ascending id.

    Each comes with the units that have it, and whether they can use it now, where that is already known.
    """
    groups: dict[int, tuple[Ability, list[tuple[int, ActionResult | None]]]] = {}
    for slot in slots:
        ability, known = _meant(world, slot, requested)
        if ability is not None and casting.is_modelled(ability):
            groups.setdefault(ability.id, (ability, []))[1].append((slot, known))
    return [groups[number] for number in sorted(groups)]


def _aim_result(world: World, player: int, ability: Ability, command: UnitCommand, target: int) -> ActionResult:
    """Return why an ability can't be aimed like this by any unit, or success; ``target`` is the slot of the target."""
    aim = command.aim
    allowed = ability.aim
    if not aim & allowed:
        return casting.wrong_aim(ability)
    if aim == UNIT:
        remembered = target != NOBODY and command.target in world.memories[player].of_unit
        c = columns.columns_of(world)
        if target == NOBODY or not (remembered or c.visible[player * c.capacity + target]):
            return ActionResult.MUST_TARGET_VISIBLE_UNIT
    return ActionResult.SUCCESS


def _judge_cast(
    world: World, slot: int, ability: Ability, command: UnitCommand, target: int, known: ActionResult | None
) -> Cast | ActionResult:
    """Return what a unit is to do with its ability, or why it can't; ``known`` is the reason if already known."""
    why = casting.refusal(world, slot, ability) if known is None else known
    if why is not ActionResult.SUCCESS:
        return why
    cast = Cast(slot, casting.as_is(world, slot, ability), target, command.point)
    if ability.effect == "attack" and target != NOBODY:
        why = _cant_attack(world, slot, target)
    elif ability.effect not in casting.ORDINARY:
        why = casting.aim_refusal(world, cast)
    return cast if why is ActionResult.SUCCESS else why


def _cant_attack(world: World, slot: int, target: int) -> ActionResult:
    if slot != target and commands.can_reach(world, slot, target):
        return ActionResult.SUCCESS
    flies = world.unit_type(target).flying
    return ActionResult.CANT_TARGET_AIR_UNITS if flies else ActionResult.CANT_TARGET_THAT_UNIT
