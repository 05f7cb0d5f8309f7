"""Acquiring: which targets a unit chooses by itself, and when it gives up.

Units that idle, hold, patrol or attack-move look around every few loops; those on a plain walk do not. The best target
is the one with the highest attack priority, then one that threatens the unit before one that is harmless to it, then
the nearest. A unit that fires at something of a lower rank checks now and then for something better. An idle unit
remembers where it stood and goes back there; at the end of its leash it gives up and ignores enemies until it is nearly
back. One that is attacked from farther than it looks turns on the attacker, and so do its idle friends; a type that
does not fight back runs.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from khala_simulator.combat.targets import disengage, engage
from khala_simulator.numeric.arrays import some, which
from khala_simulator.systems.engagement import inside_zone
from khala_simulator.tables.mechanics import MECHANICS
from khala_simulator.tables.stats import AIR_PLANE, GROUND_PLANE
from khala_simulator.world.census import census
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.orders import OrderKind

if TYPE_CHECKING:
    from khala_simulator.numeric.geometry import Floats
    from khala_simulator.world.columns import Bools, Ints
    from khala_simulator.world.world import World

IDLE, ATTACK_MOVE, PATROL = int(OrderKind.IDLE), int(OrderKind.ATTACK_MOVE), int(OrderKind.PATROL)
PRIORITY_WEIGHT = 1000.0
THREAT_WEIGHT = 500.0
TOP_RANK = 20 * PRIORITY_WEIGHT + THREAT_WEIGHT  # an army unit that threatens: nothing is better
RANK_STEP = 250.0  # less than any difference in rank, more than any distance
OUT_OF_SIGHT = -1e9


def choose_targets(world: World) -> None:
    """Answer attacks, give up lost targets, and look for targets with the units that are due."""
    if world.hurt:
        _answer(world)
    period = MECHANICS.scan_period
    if not world.scan_now and world.loop % period:
        return
    world.scan_now = False
    n = world.top
    due = world.looks_around[:n] | (world.guns_walking[:n] & world.walks[:n])
    due &= world.acquires[:n]
    due &= world.scan_loop[:n] <= world.loop
    due &= world.windup[:n] < 0.0
    if some(workers := due & world.defensive[:n]):
        due &= ~(workers & ~_seeks_fights(world.order_kind[:n]))
    content = world.in_reach[:n] & (world.target[:n] != NOBODY)
    if world.loop % MECHANICS.look_up_period == 0:
        content &= world.rank[:n] >= TOP_RANK
    due &= ~content
    if some(world.leashed[:n]):
        _slip_leash(world)
        due &= ~world.leashed[:n]
    seekers = which(due)
    if not seekers.size:
        return
    _give_up(world, seekers)
    world.scan_loop[seekers] = world.loop + period - world.loop % period
    owner = world.owner.take(seekers)
    for player in range(1, len(world.players)):
        mine = seekers[owner == player]
        if mine.size:
            _seek(world, player, mine)


def _seeks_fights(order: Ints) -> Bools:
    """Return whether workers with these orders pick fights by themselves."""
    seeks: Bools = (order == ATTACK_MOVE) | (order == PATROL)
    return seeks


def _give_up(world: World, seekers: Ints) -> None:
    """Drop targets that went out of sight, that a holding unit can't reach, or that led too far away."""
    chasing = seekers[world.target.take(seekers) != NOBODY]
    if not chasing.size:
        return
    offset = world.pos[chasing] - world.guard[chasing]
    idle = world.order_kind[chasing] == IDLE
    too_far = idle & (offset[:, 0] ** 2 + offset[:, 1] ** 2 > MECHANICS.leash_radius**2)
    world.leashed[chasing] = too_far
    lost = too_far | (_stays(world, chasing) & ~world.in_reach.take(chasing)) | ~_seen(world, chasing)
    for slot in chasing[lost].tolist():
        disengage(world, slot)


def _slip_leash(world: World) -> None:
    """End the leash of units that gave up a chase when they are nearly back, or have another order."""
    slots = which(world.leashed[: world.top])
    offset = world.guard.take(slots, 0) - world.pos.take(slots, 0)
    away = offset[:, 0] ** 2 + offset[:, 1] ** 2 > MECHANICS.leash_reset**2
    world.leashed[slots] = away & (world.order_kind.take(slots) == IDLE) & world.returning.take(slots)


def _stays(world: World, slots: Ints) -> Bools:
    """Return whether each unit chases no target: it holds its place, or fires only at what it passes."""
    stays: Bools = world.holds.take(slots) | ~world.looks_around.take(slots)
    return stays


def _seen(world: World, slots: Ints) -> Bools:
    """Return whether each unit's owner sees its target."""
    target = world.target[slots]
    seen: Bools = world.visible[world.owner[slots], target]
    return seen


def _seek(world: World, player: int, seekers: Ints) -> None:
    """Give each seeker of a player the best target it can see, if that is better than what it has."""
    foes = foes_of(world, player)
    if not foes.size:
        return
    gap, worth = _worth(world, seekers, foes)
    best = np.argmax(worth, axis=1)
    rows = np.arange(len(seekers))
    worth, gap, best = worth[rows, best], gap[rows, best], foes[best]
    now = world.target.take(seekers)
    world.rank[seekers] = rank_now = np.where(now == NOBODY, OUT_OF_SIGHT, rank_of(world, seekers, now))
    rise = worth + gap - rank_now
    handy = _reaches(world, seekers, best, gap) | (world.gap.take(seekers) - gap > MECHANICS.switch_gain)
    handy &= ~world.in_reach.take(seekers)
    better = (rise > RANK_STEP) | (handy & (rise > -RANK_STEP))
    better &= (worth > OUT_OF_SIGHT) & (best != now)
    for i in which(better).tolist():
        _take(world, int(seekers[i]), int(best[i]))
        world.rank[seekers[i]] = worth[i] + gap[i]


def foes_of(world: World, player: int) -> Ints:
    """Return the enemies of a player that it sees and can aim at."""
    foes = world.live
    foes = foes[(world.owner[foes] != player) & (world.owner[foes] != 0)]
    seen: Ints = foes[world.targetable[foes] & world.visible[player, foes]]
    return seen


def rank_of(world: World, seekers: Ints, foes: Ints) -> Floats:
    """Return the ranks that come before distance: each foe's priority, and whether it threatens its seeker."""
    rank: Floats = world.priority.take(foes) * PRIORITY_WEIGHT
    rank += THREAT_WEIGHT * ((_threatened_planes(world, foes) & world.plane_bits.take(seekers)) != 0)
    return rank


def _threatened_planes(world: World, foes: Ints) -> Ints:
    """Return the planes that each foe threatens; workers are no threat as long as they do not fight."""
    calm = world.defensive.take(foes) & (world.target.take(foes) == NOBODY)
    planes: Ints = np.where(calm, 0, world.threat_bits.take(foes))
    return planes


def _worth(world: World, seekers: Ints, foes: Ints) -> tuple[Floats, Floats]:
    """Return (k, m) edge distances, and the worth of every foe to every seeker."""
    at, there = world.pos.take(seekers, 0), world.pos.take(foes, 0)
    gap = at[:, 0, None] - there[:, 0]
    gap *= gap
    dy = at[:, 1, None] - there[:, 1]
    dy *= dy
    gap += dy
    np.sqrt(gap, out=gap)
    gap -= world.radius.take(seekers)[:, None]
    gap -= world.radius.take(foes)
    sight = _sight(world, seekers, world.plane_bits.take(foes))
    holding = _stays(world, seekers)
    if some(holding):
        sight = np.where(holding[:, None], np.minimum(sight, _longest_reach(world, seekers)[:, None]), sight)
    wanted = gap <= sight
    if census(world).weapons_with_filters:
        wanted &= (gap >= world.least_range[seekers, None]) | (world.least_range[seekers, None] <= 0.0)
        wanted &= ~(world.spares_structures[seekers, None] & world.walled.take(foes))
    if world.area_effects and some(world.zone_radius.take(seekers) > 0.0):
        k, m = wanted.shape
        wanted &= inside_zone(world, np.repeat(seekers, m), np.tile(foes, k)).reshape(k, m)
    rank = world.priority.take(foes) * PRIORITY_WEIGHT
    threat = (_threatened_planes(world, foes) & world.plane_bits.take(seekers)[:, None]) != 0
    worth = THREAT_WEIGHT * threat
    worth += rank
    worth -= gap
    np.copyto(worth, OUT_OF_SIGHT, where=~wanted)
    return gap, worth


def _sight(world: World, seekers: Ints, planes: Ints) -> Floats:
    """Return (k, m) how far each seeker looks for foes on some planes (m,); (k, 1) if all are on the ground alone."""
    on_ground = world.ground_scan.take(seekers)[:, None]
    if np.count_nonzero(planes == GROUND_PLANE) == len(planes):
        return on_ground
    in_air = world.air_scan.take(seekers)[:, None]
    sight: Floats = np.maximum(
        np.where(planes & GROUND_PLANE, on_ground, -1.0), np.where(planes & AIR_PLANE, in_air, -1.0)
    )
    return sight


def _longest_reach(world: World, slots: Ints) -> Floats:
    owner = world.owner[slots]
    ground, air = world.ground_weapon[slots], world.air_weapon[slots]
    reach: Floats = np.maximum(
        np.where(ground >= 0, world.stats.range[owner, ground], 0.0),
        np.where(air >= 0, world.stats.range[owner, air], 0.0),
    )
    reach += world.range_add.take(slots)
    return reach


def _reaches(world: World, seekers: Ints, foes: Ints, gap: Floats) -> Bools:
    """Return whether each seeker could fire at its foe from where it stands."""
    owner = world.owner[seekers]
    on_ground = (world.plane_bits[foes] & GROUND_PLANE != 0) & (world.ground_weapon[seekers] >= 0)
    weapon = np.where(on_ground, world.ground_weapon[seekers], world.air_weapon[seekers])
    touch = world.separation.take(seekers) + world.separation[foes] - world.radius.take(seekers) - world.radius[foes]
    reaches: Bools = gap <= np.maximum(world.stats.range[owner, weapon] + world.range_add.take(seekers), touch)
    return reaches


def _take(world: World, slot: int, target: int) -> None:
    """Start a fight by the unit's own choice; an idle one remembers where it stood."""
    if world.order_kind[slot] == IDLE and world.target[slot] == NOBODY and not world.returning[slot]:
        world.guard[slot] = world.pos[slot]
        world.returning[slot] = True
    world.rank[slot] = OUT_OF_SIGHT  # a scan that found it knows better
    engage(world, slot, target)


def _answer(world: World) -> None:
    """Turn attacked units on their attackers, and call their idle friends."""
    hurt, world.hurt = world.hurt, []
    for victim, attacker in hurt:
        if not (world.alive[victim] and world.alive[attacker]) or world.owner[victim] == world.owner[attacker]:
            continue
        helpers = [victim]
        if world.loop - world.help_loop[victim] >= MECHANICS.help_period:
            world.help_loop[victim] = world.loop
            helpers += _friends_near(world, victim)
        for slot in helpers:
            if _free_to_answer(world, slot) and world.visible[world.owner[slot], attacker]:
                _take(world, slot, attacker)
        if world.flees[victim] and world.order_kind[victim] == IDLE and not world.returning[victim]:
            flee(world, victim, attacker)


def flee(world: World, victim: int, attacker: int) -> None:
    """Make an idle unit that does not fight back run away from its attacker; where it ends is its new place."""
    x0, y0, x1, y1 = world.map.terrain.playable
    offset = world.pos[victim] - world.pos[attacker]
    away = offset / max(float(np.sqrt(offset[0] ** 2 + offset[1] ** 2)), 1e-9)
    world.guard[victim] = np.clip(world.pos[victim] + away * MECHANICS.flee_distance, (x0, y0), (x1, y1))
    world.returning[victim] = True
    world.nav_loop[victim] = 0


def _friends_near(world: World, victim: int) -> list[int]:
    friends = world.units_of(int(world.owner[victim]))
    offset = world.pos[friends] - world.pos[victim]
    near = offset[:, 0] ** 2 + offset[:, 1] ** 2 <= MECHANICS.help_radius**2
    found: list[int] = friends[near & (friends != victim)].tolist()
    return found


def _free_to_answer(world: World, slot: int) -> bool:
    roams = world.looks_around[slot] and not (world.holds[slot] or world.leashed[slot]) and world.step_max[slot] > 0.0
    free = world.acquires[slot] and world.target[slot] == NOBODY
    return bool(roams and free and (not world.defensive[slot] or _seeks_fights(world.order_kind[slot])))
