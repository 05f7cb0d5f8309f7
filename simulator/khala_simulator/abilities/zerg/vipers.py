"""The Viper's skills: Blinding Cloud, Abduct, Parasitic Bomb, Consume."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from khala_simulator.abilities import commands
from khala_simulator.abilities.shared import teleport
from khala_simulator.abilities.shared.projectiles import SPEED_UNKNOWN, flight_loops, throw
from khala_simulator.abilities.skill import Skill, around, foes, lay, number
from khala_simulator.combat import buffs, lifecycle
from khala_simulator.combat.damage import apply_damage
from khala_simulator.movement.placement import free_places
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.tables.catalog import LOOPS_PER_NORMAL_SECOND
from khala_simulator.world.area_effects import AreaEffect
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    import numpy as np

    from khala_simulator.world.casts import Cast
    from khala_simulator.world.world import World

CLOUD_EFFECT = 10
PARASITIC_BOMB = 2542
PULLED = "Yoink"
BOMB, AFTER_BOMB, INFECTED, BOMB_UNIT = (
    "ParasiticBomb", "ParasiticBombSecondaryUnitSearch", "ParasiticBombSecondaryBuff", "ParasiticBombDummy",
)  # fmt: skip
DELAY = "ParasiticBombInitialDelay"
DRAINED = "ViperConsumeStructure"


# Blinding Cloud -------------------------------------------------------------------------------------------------------


def _cloud(world: World, cast: Cast) -> None:
    """Place a cloud in which ground units shoot no farther than melee range, and structures detect nothing."""
    end = world.loop + number(cast, "duration_loops")
    period = number(cast, "period_loops")
    lay(world, cast, "blinding_cloud", end=end, due=world.loop, effect=CLOUD_EFFECT, period=period)


def _blinds(world: World, item: AreaEffect) -> None:
    source = world.slot_of(item.source)
    for slot in around(world, item.at, item.radius, plane="ground"):
        if world.owner[slot]:
            name = "BlindingCloudStructure" if world.unit_type(slot).structure else "BlindingCloud"
            buffs.apply(world, slot, name, source=source, owner=item.owner)


# Abduct ---------------------------------------------------------------------------------------------------------------


def _reach_out(world: World, cast: Cast) -> None:
    """Pull a unit to the Viper."""
    throw(world, cast, "abduct")


def _can_pull(world: World, cast: Cast) -> ActionResult:
    held = buffs.is_frenzied(world, cast.target) or buffs.has(world, cast.target, PULLED)
    return ActionResult.CANT_TARGET_THAT_UNIT if held else ActionResult.SUCCESS


def _caught(world: World, item: AreaEffect) -> None:
    """Catch the victim: it drops its orders, unburrows and starts to move."""
    viper, slot = world.slot_of(item.source), world.slot_of(item.target)
    if NOBODY in (viper, slot):
        return
    unit = world.unit_type(slot)
    standing = world.catalog.row_of_id.get(unit.unit_alias)
    if standing is not None and (unit.burrowed or unit.speed_n <= 0.0):
        lifecycle.become(world, slot, world.catalog.units[standing])
    world.queue[slot] = []
    commands.begin(world, slot, None)
    x, y = world.pos[viper].tolist()
    (place,) = free_places(world, world.unit_type(slot), (x, y), 1)
    ability = world.catalog.ability(item.ability)
    loops = number(ability, "max_disable_loops")
    buffs.apply(world, slot, PULLED, source=viper, owner=item.owner, loops=loops)
    step = number(ability, "pull_speed_n") / LOOPS_PER_NORMAL_SECOND
    world.area_effects.append(
        AreaEffect("pull", item.owner, [place], step, world.loop, world.loop + loops, due=world.loop + 1,
              ability=item.ability, target=item.target)
    )  # fmt: skip


def _pulls(world: World, item: AreaEffect) -> None:
    """Bring the victim one step nearer; its ``radius`` is the step."""
    slot = world.slot_of(item.target)
    if slot == NOBODY or not buffs.has(world, slot, PULLED):
        item.end = world.loop
        return
    x, y = world.pos[slot].tolist()
    away = math.hypot(item.at[0] - x, item.at[1] - y)
    teleport.to(world, slot, teleport.within(world, slot, item.at, item.radius))
    if away <= item.radius:
        buffs.remove(world, slot, PULLED)
        item.end = world.loop


# Parasitic Bomb -------------------------------------------------------------------------------------------------------


def _bomb(world: World, cast: Cast) -> None:
    """Throw a parasite at a flyer; it harms enemy flyers around the host, and goes on where the host dies."""
    throw(world, cast, "parasitic_bomb")


def _infects(world: World, item: AreaEffect) -> None:
    slot = world.slot_of(item.target)
    if slot != NOBODY and not buffs.has(world, slot, BOMB):
        lasts = world.catalog.buff(BOMB).loops + world.catalog.buff(DELAY).loops
        buffs.apply(world, slot, BOMB, source=world.slot_of(item.source), owner=item.owner, loops=lasts)


def _spreads(world: World, slot: int, row: np.void) -> None:
    """Infect the owner's enemies in the air around the host, or around the place where it died."""
    delay = world.catalog.buff(DELAY).loops if world.catalog.buffs[int(row["buff"])].name == BOMB else 0.0
    if world.loop - int(row["begun"]) <= delay:
        return
    x, y = world.pos[slot].tolist()
    radius = number(world.catalog.ability(PARASITIC_BOMB), "radius")
    owner = int(row["owner"])
    for other in foes(world, around(world, (x, y), radius, plane="air", structures=False), owner):
        buffs.apply(world, other, INFECTED, source=int(row["source"]), owner=owner)


def _harms(world: World, slot: int, row: np.void) -> None:
    damage = number(world.catalog.ability(PARASITIC_BOMB), "damage_per_tick")
    apply_damage(world, int(row["source"]), int(row["owner"]), slot, damage)


def _lingers(world: World, slot: int, row: np.void) -> None:
    """Go on at the place for the rest of the time when the host is dead."""
    left = float(row["end"]) - world.loop
    if left <= 0.0:
        return
    x, y = world.pos[slot].tolist()
    cloud = lifecycle.spawn(world, world.catalog.unit(BOMB_UNIT), int(row["owner"]), (x, y))
    buffs.apply(world, cloud, AFTER_BOMB, source=int(row["source"]), owner=int(row["owner"]), loops=left)
    teleport.live_until(world, cloud, world.loop + left + 1)


# Consume --------------------------------------------------------------------------------------------------------------


def _consume(world: World, cast: Cast) -> None:
    """Drain life from one of its owner's structures for energy."""
    buffs.apply(world, cast.target, DRAINED, source=cast.slot)


def _can_consume(world: World, cast: Cast) -> ActionResult:
    full = world.energy[cast.slot] >= world.energy_max[cast.slot]
    unfit = world.unit_type(cast.target).name == "CreepTumorBurrowed"
    return ActionResult.CANT_TARGET_THAT_UNIT if full or unfit else ActionResult.SUCCESS


def _drains(world: World, cast: Cast) -> bool:
    slot, target = cast.slot, cast.target
    if world.order_target[slot] != target or world.energy[slot] >= world.energy_max[slot]:
        return False
    ticks, rest = divmod(world.loop - cast.begun - flight_loops(world, cast), int(number(cast, "period_loops")))
    if ticks < 1 or rest:
        return True
    world.life[target] += number(cast, "life_per_tick")
    world.attacker[target] = NOBODY
    gained = float(world.energy[slot]) + number(cast, "energy_per_tick")
    world.energy[slot] = min(gained, float(world.energy_max[slot]))
    return ticks < number(cast, "ticks")


def _ends_draining(world: World, cast: Cast) -> None:
    at = world.buffs.find(cast.target, world.catalog.buff(DRAINED).row)
    if at >= 0 and int(world.buffs.rows[at]["source"]) in (cast.slot, NOBODY):
        buffs.remove(world, cast.target, DRAINED)


SKILLS: Final = {
    "blinding_cloud": Skill(_cloud),
    "yoink": Skill(
        _reach_out, refuse=_can_pull, estimates=(SPEED_UNKNOWN, "The victim is pulled by 20 per normal second.")
    ),
    "parasitic_bomb": Skill(_bomb, estimates=(SPEED_UNKNOWN, "Its time begins after a delay of one second.")),
    "viper_consume_structure": Skill(
        _consume, refuse=_can_consume, hold=_drains, end=_ends_draining, estimates=(SPEED_UNKNOWN,)
    ),
}
AREA_EFFECTS: Final = {"blinding_cloud": _blinds, "abduct": _caught, "pull": _pulls, "parasitic_bomb": _infects}
TICKS: Final = {BOMB: _spreads, AFTER_BOMB: _spreads, INFECTED: _harms}
FINALS: Final = {BOMB: _lingers}
