"""Bunkers pass orders on to their passengers: which target to shoot at, and to use stimpacks.

``transports`` has getting in and out, ``traits`` how passengers see and reach.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_simulator.abilities.skill import Skill, number
from khala_simulator.combat import buffs, targets
from khala_simulator.economy.requirements import met
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.world.casts import Cast
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from khala_simulator.tables.abilities import Ability
    from khala_simulator.world.casts import Point
    from khala_simulator.world.world import World


def _armed_passengers(world: World, slot: int) -> list[int]:
    return [s for s in world.passengers(slot) if world.ground_weapon[s] >= 0 or world.air_weapon[s] >= 0]


def _anybody_armed(world: World, slot: int, _: Ability) -> ActionResult:
    return ActionResult.SUCCESS if _armed_passengers(world, slot) else ActionResult.CANT_ATTACK_WEAPONS_DISABLED


# targets --------------------------------------------------------------------------------------------------------------


def _shoot(world: World, cast: Cast) -> None:
    """Make the passengers shoot at a unit in reach; at a point they choose for themselves."""
    for slot in _armed_passengers(world, cast.slot):
        if cast.target != NOBODY and _reaches(world, slot, cast.target):
            targets.engage(world, slot, cast.target)


def _reaches(world: World, slot: int, target: int) -> bool:
    row = targets.weapon_for(world, slot, target)
    if row < 0:
        return False
    offset = world.pos[target] - world.pos[slot]
    reach = float(world.stats.range[world.owner[slot], row] + world.range_add[slot])
    bodies = float(world.radius[slot] + world.radius[target])
    return float((offset**2).sum()) <= (reach + bodies) ** 2


def _nobody_reaches(world: World, cast: Cast) -> ActionResult:
    aimed = cast.target != NOBODY
    reached = any(_reaches(world, slot, cast.target) for slot in _armed_passengers(world, cast.slot)) if aimed else True
    return ActionResult.SUCCESS if reached else ActionResult.TARGET_IS_OUT_OF_RANGE


def _order_shot(
    world: World, slots: list[int], ability: Ability, target: int, point: Point | None, queue: bool
) -> list[int]:
    del queue
    for slot in slots:
        _shoot(world, Cast(slot, ability, world.slot_of(target), point))
    return slots


def _cease(world: World, cast: Cast) -> None:
    """Make the passengers drop their target."""
    for slot in _armed_passengers(world, cast.slot):
        targets.disengage(world, slot)


# stimpacks ------------------------------------------------------------------------------------------------------------


def _users(world: World, slot: int, ability: Ability) -> list[int]:
    """Return the passengers that can use the ability that is passed on."""
    inner = world.catalog.ability(int(number(ability, "ability")))
    return [
        s
        for s in world.passengers(slot)
        if world.unit_type(s).name in inner.users
        and met(world, s, inner.requires)
        and world.life[s] > inner.life
        and not buffs.has(world, s, str(ability.numbers["buff"]))
    ]


def _stim(world: World, cast: Cast) -> None:
    """Make the passengers use their stimpacks."""
    inner = world.catalog.ability(int(number(cast, "ability")))
    for slot in _users(world, cast.slot, cast.ability):
        world.life[slot] -= inner.life
        buffs.apply(world, slot, str(cast.ability.numbers["buff"]), source=slot, loops=number(inner, "duration_loops"))


def _anybody_fit(world: World, slot: int, ability: Ability) -> ActionResult:
    return ActionResult.SUCCESS if _users(world, slot, ability) else ActionResult.TECH_REQUIREMENTS_NOT_MET


SKILLS: Final = {
    "redirect_attack": Skill(
        _shoot,
        give=_order_shot,
        refuse=_nobody_reaches,
        ready=_anybody_armed,
        estimates=("A Bunker refuses a target that no unit in it reaches.",),
    ),
    "redirect_stop": Skill(_cease, ready=_anybody_armed),
    "redirect_stim": Skill(_stim, ready=_anybody_fit),
}
