"""Battlecruisers: the Yamato cannon and the tactical jump; other ships have modules of their own."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_simulator.abilities.shared import projectiles, teleport
from khala_simulator.abilities.skill import Skill, gap, number
from khala_simulator.combat import buffs
from khala_simulator.combat.damage import apply_damage
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.tables.mechanics import MECHANICS
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from khala_simulator.world.area_effects import AreaEffect
    from khala_simulator.world.casts import Cast
    from khala_simulator.world.world import World

# Yamato cannon --------------------------------------------------------------------------------------------------------


def _charge(world: World, cast: Cast) -> None:
    """Begin to charge; the cooldown that ``casting`` has begun is that of an interrupted charge."""
    world.timers.get(cast.slot, {}).pop(cast.ability.timer, None)
    loops = number(cast, "interrupt_cooldown_loops", 0.0)
    if loops:
        _cool_down(world, cast, loops)


def _hold_charge(world: World, cast: Cast) -> bool:
    """Fire when the cannon is charged; a target that got too far away, or a helpless ship, spoils it."""
    slot, target = cast.slot, cast.target
    if target == NOBODY or not world.can_cast[slot] or not world.targetable[target]:
        return False
    if gap(world, slot, target) > cast.ability.range + cast.ability.slop:
        return False
    if world.loop < cast.begun + number(cast, "cast_time_loops"):
        return True
    _cool_down(world, cast, cast.ability.cooldown_loops)
    projectiles.launch(world, cast, MECHANICS.yamato_speed_n)
    return False


def _cool_down(world: World, cast: Cast, loops: float) -> None:
    world.timers.setdefault(cast.slot, {})[cast.ability.timer] = world.loop + loops


def _impact(world: World, missile: AreaEffect, target: int) -> None:
    amount = number(world.catalog.ability(missile.ability), "damage")
    apply_damage(world, world.slot_of(missile.source), missile.owner, target, amount)


# tactical jump --------------------------------------------------------------------------------------------------------

HELD: Final = ("FungalGrowth",)
SPOOLING: Final = "HyperjumpInitialDelaySuppressWeapon"
LEAVING: Final = "HyperjumpTeleportOut"
AWAY: Final = "HyperjumpTeleport"
COMING: Final = "HyperjumpTeleportIn"


def _may_jump(world: World, cast: Cast) -> ActionResult:
    held = any(buffs.has(world, cast.slot, name) for name in HELD)
    return ActionResult.ERROR if held else ActionResult.SUCCESS


def _begin_jump(world: World, cast: Cast) -> None:
    """Jump to any place of the map; the ship can't be touched on its way and takes no orders."""
    world.bound[cast.slot] = True
    delay = number(cast, "pre_delay_vulnerable_loops", 0.0)
    if delay:
        buffs.apply(world, cast.slot, SPOOLING, loops=delay)
    _jump(world, cast)


def _jump(world: World, cast: Cast) -> bool:
    """Begin the stage that is due: out, on the way (already at the goal, untouchable), in; return False at the end."""
    over = cast.begun + number(cast, "pre_delay_vulnerable_loops", 0.0)
    for name, figure in ((LEAVING, "out_loops"), (AWAY, "transit_loops"), (COMING, "in_loops")):
        begin, over = over, over + number(cast, figure)
        if begin <= world.loop < begin + 1.0:
            buffs.apply(world, cast.slot, name, loops=over - world.loop)
            if name == AWAY:
                _appear(world, cast)
    return world.loop < over


def _appear(world: World, cast: Cast) -> None:
    x0, y0, x1, y1 = world.map.terrain.playable
    x, y = cast.point or world.pos[cast.slot].tolist()
    teleport.to(world, cast.slot, (min(max(x, x0), x1), min(max(y, y0), y1)))


SKILLS: Final = {
    "yamato": Skill(_charge, hold=_hold_charge, estimates=("The speed of the Yamato cannon's missile.",)),
    "hyperjump": Skill(
        _begin_jump,
        refuse=_may_jump,
        hold=_jump,
        estimates=("A ship on its jump is at its goal, untouchable and in sight, from the moment it leaves.",),
    ),
}

projectiles.ARRIVALS["yamato"] = _impact
