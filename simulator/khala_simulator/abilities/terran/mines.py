"""Widow mines: burrowed they fire Sentinel missiles by themselves, and show themselves while they reload.

Burrowing itself is a morph; the missile is an ability with autocast, armed as long as the mine is in the ground.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_simulator.abilities import commands
from khala_simulator.abilities.shared import projectiles
from khala_simulator.abilities.skill import Skill, around, number
from khala_simulator.combat import buffs
from khala_simulator.combat.damage import apply_damage
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.tables.mechanics import MECHANICS
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.orders import Order, OrderKind

if TYPE_CHECKING:
    from khala_simulator.abilities.skill import SmartRule, UnitRule
    from khala_simulator.world.area_effects import AreaEffect
    from khala_simulator.world.casts import Cast, Point
    from khala_simulator.world.world import World

BURROWED: Final = "WidowMineBurrowed"
MINES: Final = frozenset({"WidowMine", BURROWED})
LOOKED_AFTER: Final = 4
MISSILE: Final = 2099  # the ability's id
SHOWN: Final = "WidowMineBurrowedCloakingBehavior"
TIMER: Final = "WidowMineAttack"
CLAWS: Final = "DrillClaws"


def _no_larva(world: World, cast: Cast) -> ActionResult:
    if world.unit_type(cast.slot).name != BURROWED:
        return ActionResult.TECH_REQUIREMENTS_NOT_MET
    larva = cast.target != NOBODY and world.unit_type(cast.target).name == "Larva"
    return ActionResult.CANT_TARGET_THAT_UNIT if larva else ActionResult.SUCCESS


def _fire(world: World, cast: Cast) -> None:
    """Send a missile that hurts its target much and all around it, friends as well, a little."""
    projectiles.launch(world, cast, MECHANICS.mine_missile_speed_n)


def _explode(world: World, missile: AreaEffect, target: int) -> None:
    """Hurt the target, and every unit around it, friends as well, but no structure and no mine of the owner's."""
    ability = world.catalog.ability(missile.ability)
    source = world.slot_of(missile.source)
    owner = missile.owner
    apply_damage(
        world, source, owner, target, number(ability, "damage"), shield_bonus=number(ability, "bonus_vs_shields")
    )
    amount, more = number(ability, "splash_damage"), number(ability, "splash_bonus_vs_shields")
    for slot in around(world, missile.at, number(ability, "splash_radius"), structures=False):
        own_mine = world.owner[slot] == owner and world.unit_type(slot).name in MINES
        if slot != target and not own_mine:
            apply_damage(world, source, owner, slot, amount, kind="splash", shield_bonus=more)


def _keep_watch(world: World, slots: list[int]) -> None:
    """Uncover mines that reload, every few loops; drilling claws keep them hidden."""
    if world.loop % LOOKED_AFTER:
        return
    for slot in slots:
        if slot in world.timers:
            reloads = world.timers[slot].get(TIMER, 0.0) > world.loop and not _claws_hide(world, slot)
            if reloads != buffs.has(world, slot, SHOWN):
                (buffs.apply if reloads else buffs.remove)(world, slot, SHOWN)


def _claws_hide(world: World, slot: int) -> bool:
    """Return whether the owner has the claws; in both versions they hide the reloading mine."""
    return world.catalog.upgrade(CLAWS).id in world.players[int(world.owner[slot])].upgrades


def _climb_out(world: World, slots: list[int]) -> None:
    """Clear the uncovered mark of a mine that has come out of the ground."""
    if len(world.buffs) and not world.loop % LOOKED_AFTER:
        for slot in slots:
            buffs.remove(world, slot, SHOWN)


def _fire_by_click(world: World, slots: list[int], target: int, _: Point | None, queue: bool) -> list[int]:
    """Fire the missiles of burrowed mines that right-click on a foe."""
    if target == NOBODY or world.unit_type(target).structure:
        return []
    taken: list[int] = []
    for slot in slots:
        foe = commands.is_enemy(world, int(world.owner[slot]), int(world.owner[target]))
        if foe and world.unit_type(slot).name == BURROWED:
            order = Order(OrderKind.CAST, MISSILE, target=world.tag_of(target))
            taken += commands.give(world, [slot], order, queue=queue)
    return taken


SMARTS: Final[tuple[SmartRule, ...]] = (_fire_by_click,)
SKILLS: Final = {
    "widow_mine_attack": Skill(_fire, refuse=_no_larva, estimates=("The speed of the Widow Mine's missile.",)),
}
PASSIVES: Final[dict[str, UnitRule]] = {BURROWED: _keep_watch, "WidowMine": _climb_out}

projectiles.ARRIVALS["widow_mine_attack"] = _explode
