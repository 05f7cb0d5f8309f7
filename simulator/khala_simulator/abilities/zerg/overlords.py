"""Overlords that generate creep, and the Overseer's changelings and contamination.

A changeling that comes near an enemy unit takes the look of the enemy's basic fighter; it never fights.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_simulator.abilities.commands import is_enemy
from khala_simulator.abilities.shared import teleport
from khala_simulator.abilities.skill import Skill, number
from khala_simulator.combat import buffs, lifecycle
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.tables.mechanics import MECHANICS
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.creep import GENERATING

if TYPE_CHECKING:
    from khala_simulator.tables.abilities import Ability
    from khala_simulator.world.casts import Cast
    from khala_simulator.world.world import World

CHANGELING = "Changeling"
SEARCH = "ChangelingDisguiseEx3"
WINGS, SHIELDS = "zerglingmovementspeed", "ShieldWall"
SEARCH_RADIUS: Final = 12.0  # the catalog's ChangelingDisguiseEx3Search


# creep ----------------------------------------------------------------------------------------------------------------


def _let_creep_fall(world: World, cast: Cast) -> None:
    """Generate creep below while it stands still."""
    buffs.apply(world, cast.slot, GENERATING, source=cast.slot)
    world.growth.looked_at = -1


def _stop_creep(world: World, cast: Cast) -> None:
    """Stop generating creep."""
    buffs.remove(world, cast.slot, GENERATING)
    world.growth.looked_at = -1


def _dry(world: World, slot: int, _: Ability) -> ActionResult:
    return ActionResult.ERROR if buffs.has(world, slot, GENERATING) else ActionResult.SUCCESS


def _generating(world: World, slot: int, _: Ability) -> ActionResult:
    return ActionResult.SUCCESS if buffs.has(world, slot, GENERATING) else ActionResult.ERROR


# changelings ----------------------------------------------------------------------------------------------------------


def _spawn_changeling(world: World, cast: Cast) -> None:
    """Spawn a changeling with a timed life."""
    (slot,) = teleport.beside(world, cast.slot, world.catalog.unit(str(cast.ability.numbers["unit"])))
    chance = MECHANICS.broodling_random_loops * world.rng.random()
    teleport.live_until(world, slot, world.loop + number(cast, "duration_loops") + chance)


def _disguise(world: World, slots: list[int]) -> None:
    """Take the look of the first enemy unit that comes near."""
    period = world.catalog.buff(SEARCH).period_loops
    for slot in slots:
        if (world.loop - int(world.born_loop[slot])) % period == 0:
            enemy = _enemy_near(world, slot)
            if enemy != NOBODY:
                lifecycle.become(world, slot, world.catalog.unit(_looks(world, enemy)))
                world.life[slot], world.shields[slot] = world.life_max[slot], world.shields_max[slot]


def _enemy_near(world: World, slot: int) -> int:
    """Return the slot of an enemy unit within sight that a changeling could look like, or NOBODY."""
    slots = world.live
    owner = int(world.owner[slot])
    offset = world.pos[slots] - world.pos[slot]
    near = offset[:, 0] ** 2 + offset[:, 1] ** 2 <= (SEARCH_RADIUS + world.radius[slots]) ** 2
    near &= world.visible[owner, slots]
    found = (s for s in slots[near].tolist() if is_enemy(world, owner, int(world.owner[s])) and _looks(world, s))
    return next(found, NOBODY)


def _looks(world: World, enemy: int) -> str:
    """Return the type that a changeling imitates near an enemy unit, by its race and its owner's upgrades."""
    player = world.players[int(world.owner[enemy])]
    has = {world.catalog.upgrade(number).name for number in player.upgrades}
    match world.unit_type(enemy).race:
        case "protoss":
            return "ChangelingZealot"
        case "terran":
            return "ChangelingMarineShield" if SHIELDS in has else "ChangelingMarine"
        case "zerg":
            return "ChangelingZerglingWings" if WINGS in has else "ChangelingZergling"
    return ""


# contamination --------------------------------------------------------------------------------------------------------


def _contaminate(world: World, cast: Cast) -> None:
    """Stop what a structure trains, researches or hatches for a while."""
    buffs.apply(world, cast.target, "Contaminated", source=cast.slot, loops=number(cast, "duration_loops"))


SKILLS: Final = {
    "generate_creep_on": Skill(_let_creep_fall, ready=_dry, estimates=("Which cells the creep covers.",)),
    "generate_creep_off": Skill(_stop_creep, ready=_generating),
    "spawn_changeling": Skill(_spawn_changeling, estimates=("Enemies see a changeling as what it is.",)),
    "contaminate": Skill(_contaminate),
}
PASSIVES: Final = {CHANGELING: _disguise}
