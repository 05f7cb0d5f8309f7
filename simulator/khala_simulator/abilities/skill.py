"""What a skill is: the rule that carries out an ability, as a few functions of the world and the cast.

Costs, cooldowns, requirements, target filters and the way there are the same for all abilities and stand in
``casting``; a skill says only what is its own. This module holds the type and the few things that many skills do.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from khala_simulator.tables.action_result import ActionResult
from khala_simulator.tables.stats import AIR_PLANE, GROUND_PLANE
from khala_simulator.world.area_effects import AreaEffect
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from khala_simulator.tables.abilities import Ability
    from khala_simulator.world.casts import Cast, Point
    from khala_simulator.world.world import World

Effect: TypeAlias = Callable[["World", "Cast"], None]
AreaEffectRule: TypeAlias = Callable[["World", "AreaEffect"], None]
BuffRule: TypeAlias = Callable[["World", int, "np.void"], None]
Give: TypeAlias = Callable[["World", "list[int]", "Ability", int, "Point | None", bool], "list[int]"]
SmartRule: TypeAlias = Callable[["World", "list[int]", int, "Point | None", bool], "list[int]"]
UnitRule: TypeAlias = Callable[["World", "list[int]"], None]


def no_effect(_: World, __: Cast) -> None:
    """Do nothing: the ability is carried out in its own way."""


def nothing_against_it(_: World, __: Cast) -> ActionResult:
    """Return success: the ability has no reason of its own to refuse."""
    return ActionResult.SUCCESS


@dataclass(frozen=True, slots=True)
class Skill:
    """What an ability does.

    Args:
        effect: Called when it takes effect; cost and cooldown are taken by then.
        give: Carries the order out in its own way instead of as a cast, such as by a structure's queue: called with the
            units that may, the ability, the target (tag), the point and whether to queue it; returns those that took
            it. It charges what it costs.
        refuse: Reasons of its own against the cast, ``ActionResult.SUCCESS`` for none.
        ready: Reasons of its own against using it now, whatever it is aimed at.
        anytime: A unit that can't act may use it too, such as a structure that is to be cancelled.
        hold: Makes it a channel: called in every later loop, False when it is over.
        end: Called when a channel ends, in time or not; the unit may be dead by then (``cast.slot`` is unused).
        pick: The target (slot) that a unit with autocast chooses, NOBODY for none; the nearest allowed one without.
        prepare: Called when the caster begins to prepare (``prep_loops``).
        binds: Once it has begun, other orders wait until it is over.
        estimates: Which parts of it no source confirms, a sentence each.
    """

    effect: Effect = no_effect
    give: Give | None = None
    refuse: Callable[[World, Cast], ActionResult] = nothing_against_it
    ready: Callable[[World, int, Ability], ActionResult] | None = None
    anytime: bool = False
    hold: Callable[[World, Cast], bool] | None = None
    end: Effect | None = None
    pick: Callable[[World, int, Ability], int] | None = None
    prepare: Effect | None = None
    binds: bool = False
    estimates: tuple[str, ...] = ()


# what many skills do --------------------------------------------------------------------------------------------------


def number(cast_or_ability: Cast | Ability, name: str, default: float | None = None) -> float:
    """Return one of the ability's own numbers; raise ``KeyError`` when the tables lack it and there is no default."""
    ability: Any = getattr(cast_or_ability, "ability", cast_or_ability)
    value = ability.numbers.get(name, default)
    if value is None:
        raise KeyError(f"ability {ability.id} ({ability.name}) has no number {name!r}")
    return float(value)


def around(
    world: World, point: Point, radius: float, *, plane: str = "any", edge: bool = True, structures: bool = True
) -> list[int]:
    """Return the slots of living, touchable units within ``radius`` of a point, ascending.

    Measured to their edge, or to their centre with ``edge`` off.
    """
    slots = world.live
    offset = world.pos[slots] - np.array(point)
    reach = radius + world.radius[slots] if edge else np.full(len(slots), radius)
    near = (offset[:, 0] ** 2 + offset[:, 1] ** 2 <= reach**2) & world.targetable[slots] & (world.life[slots] > 0.0)
    if plane != "any":
        bit = GROUND_PLANE if plane == "ground" else AIR_PLANE
        near &= (world.plane_bits[slots] & bit) != 0
    found: list[int] = slots[near].tolist()
    if not structures:
        found = [slot for slot in found if not world.unit_type(slot).structure]
    return found


def foes(world: World, slots: list[int], owner: int) -> list[int]:
    """Return those of ``slots`` that are enemies of ``owner``."""
    return [slot for slot in slots if int(world.owner[slot]) not in (owner, 0)]


def friends(world: World, slots: list[int], owner: int) -> list[int]:
    """Return those of ``slots`` that are the owner's."""
    return [slot for slot in slots if int(world.owner[slot]) == owner]


def place_of(world: World, cast: Cast) -> Point:
    """Return where a cast is aimed: the target's place, else its point, else the caster's place."""
    slot = cast.target if cast.target != NOBODY else cast.slot
    if cast.target == NOBODY and cast.point is not None:
        return cast.point
    x, y = world.pos[slot].tolist()
    return x, y


def lay(
    world: World, cast: Cast, rule: str, *, end: float, due: float, effect: int = 0, period: float = 1.0
) -> AreaEffect:
    """Begin an area effect where a cast is aimed, as wide as the ability says; the caller may change it further.

    Its ``rule`` runs from the loop ``due`` on, every ``period`` loops, until the loop ``end``.
    """
    laid = AreaEffect(
        rule,
        owner=int(world.owner[cast.slot]),
        points=[place_of(world, cast)],
        radius=number(cast, "radius", 0.0),
        begun=world.loop,
        end=end,
        effect=effect,
        due=due,
        period=period,
        ability=cast.ability.id,
        source=world.tag_of(cast.slot),
    )
    world.area_effects.append(laid)
    return laid


def distance(world: World, slot: int, point: Point) -> float:
    """Return the distance from a unit's centre to a point."""
    x, y = world.pos[slot].tolist()
    return math.hypot(point[0] - x, point[1] - y)


def nearest_hurt(world: World, slot: int, reach: float, attribute: int) -> list[int]:
    """Return the owner's other damaged units with an attribute (bit), within reach of a unit, the nearest first."""
    life = world.life[world.live]
    hurt = world.live[(life > 0.0) & (life < world.life_max[world.live])]
    friends = hurt[world.owner[hurt] == world.owner[slot]]
    if not friends.size:
        return []
    fits = (friends != slot) & (world.build_progress[friends] >= 1.0)
    fits &= (world.stats.attribute_bits[world.type[friends]] & attribute) != 0
    friends = friends[fits]
    offset = world.pos[friends] - world.pos[slot]
    away = np.sqrt(offset[:, 0] ** 2 + offset[:, 1] ** 2) - world.radius[friends] - world.radius[slot]
    near = away <= reach
    found: list[int] = friends[near][np.argsort(away[near], kind="stable")].tolist()
    return found


def touching(world: World, slot: int, other: int) -> float:
    """Return the distance of two touching bodies, centre to centre."""
    bodies = float(world.radius[slot] + world.radius[other])
    return max(bodies, float(world.separation[slot] + world.separation[other]))


def gap(world: World, slot: int, other: int) -> float:
    """Return the distance of two units, edge to edge."""
    (x, y), (a, b) = world.pos[slot].tolist(), world.pos[other].tolist()
    return math.hypot(a - x, b - y) - float(world.radius[slot] + world.radius[other])
