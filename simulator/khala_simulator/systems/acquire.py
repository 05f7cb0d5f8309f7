"""Acquiring: which targets a unit chooses by itself, and when it gives up.

Units that idle, hold, patrol or attack-move look around every few loops; those on a plain walk do not. The best target
is the one with the highest attack priority, then one that threatens the unit before one that is harmless to it, then
the nearest. A type that does not fight of its own accord threatens only its target, from when it first has it in reach;
if it has a turret, that fires at what comes into its range while the unit stands without an order.

A unit keeps its target until that dies, hides or leaves the reach in which it was; until its next look it fires on
within the weapon's slop. Before, the unit changes only for a higher rank: at once on its way, between two shots when it
fires. A unit that bodies keep from its target takes an equal one that it reaches. One that fought its way to a point
looks farther there.

An idle unit remembers where it stood and goes back there; at the end of its leash it gives up and ignores enemies until
it is nearly back. One that is attacked from farther than it looks turns on the attacker, and so do its idle friends; a
type that does not fight back runs. ``docs/design/battles.md`` has the sources of these rules.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from khala_simulator.combat import census, targets
from khala_simulator.native import columns, memory
from khala_simulator.tables.mechanics import MECHANICS
from khala_simulator.tables.stats import AIR_PLANE, GROUND_PLANE
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.orders import OrderKind

if TYPE_CHECKING:
    from khala_simulator.native.columns import Columns
    from khala_simulator.world.world import World

IDLE: Final = int(OrderKind.IDLE)
ATTACK_MOVE: Final = int(OrderKind.ATTACK_MOVE)
PATROL: Final = int(OrderKind.PATROL)
PRIORITY_WEIGHT: Final = 1000.0
THREAT_WEIGHT: Final = 500.0
TOP_RANK: Final = 20 * PRIORITY_WEIGHT + THREAT_WEIGHT  # an army unit that threatens: nothing is better
OUT_OF_SIGHT: Final = -1e9
ROUNDING: Final = 1e-6  # more than roundings make of a distance on any map
ANYBODY: Final = -2
SCAN_PERIOD: Final = MECHANICS.scan_period
GUARD_MARGIN: Final = MECHANICS.guard_margin
HELP_PERIOD: Final = MECHANICS.help_period
HELP_RADIUS: Final = MECHANICS.help_radius
LEASH_RADIUS: Final = MECHANICS.leash_radius
LEASH_RESET: Final = MECHANICS.leash_reset
BLOCKED_LOOPS: Final = MECHANICS.switch_blocked


def choose_targets(world: World) -> None:
    """Answer attacks, give up lost targets, and look for targets with the units that are due."""
    c = columns.columns_of(world)
    if world.hurt:
        _answer(world, c)
    loop = world.loop
    if not world.scan_now and loop % SCAN_PERIOD:
        return
    world.scan_now = False
    seekers = []
    for slot in range(world.top):
        if c.leashed[slot]:
            _slip_leash(c, slot)
        if _is_due(c, slot, loop):
            seekers.append(slot)
    if not seekers:
        return
    for slot in seekers:
        if c.target[slot] != NOBODY and _gives_up(c, slot):
            targets.disengage(world, slot)
        c.scan_loop[slot] = loop + SCAN_PERIOD - loop % SCAN_PERIOD
    for player in range(1, len(world.players)):
        _seek(world, c, player, seekers)


def _is_due(c: Columns, slot: int, loop: int) -> bool:
    """Return whether a unit looks for a target now."""
    if not (c.looks_around[slot] or (c.guns_walking[slot] and c.walks[slot])):
        return False
    if not c.acquires[slot] or c.scan_loop[slot] > loop or not c.windup[slot] < 0.0 or c.leashed[slot]:
        return False
    if not (_seeks_fights(c, slot) or _has_turret(c, slot)):
        return False
    target = c.target[slot]
    if target == NOBODY or not c.in_reach[slot]:
        return True
    return c.cooldown[slot] > 0.0 and rank_of(c, slot, target) < TOP_RANK


def _loses(c: Columns, slot: int) -> bool:
    """Return whether a unit's target has left the reach in which it was."""
    return c.reached[slot] and c.gap[slot] > c.reach[slot]


def _seeks_fights(c: Columns, slot: int) -> bool:
    """Return whether a unit picks fights by itself; a worker and its like do so on an attack-move or a patrol."""
    return not c.defensive[slot] or c.order_kind[slot] == ATTACK_MOVE or c.order_kind[slot] == PATROL


def _stays(c: Columns, slot: int) -> bool:
    """Return whether a unit chases no target: it holds its place, or fires only at what comes into its range."""
    return c.holds[slot] or not c.looks_around[slot] or not _seeks_fights(c, slot)


def _has_turret(c: Columns, slot: int) -> bool:
    """Return whether a unit fires from a turret."""
    return c.turret_cos[slot] < 1.0


def _squared_distance_from_guard(c: Columns, slot: int) -> float:
    """Return the square of a unit's distance from where it stood before a fight."""
    x = c.pos[slot].x - c.guard[slot].x
    y = c.pos[slot].y - c.guard[slot].y
    return x * x + y * y


def _gives_up(c: Columns, slot: int) -> bool:
    """Return whether a unit drops its target, which led it too far, that it stays away from, or that it can't see."""
    too_far = c.order_kind[slot] == IDLE and _squared_distance_from_guard(c, slot) > LEASH_RADIUS * LEASH_RADIUS
    c.leashed[slot] = too_far
    return (
        too_far
        or (_stays(c, slot) and not c.in_reach[slot])
        or not c.visible[c.owner[slot] * c.capacity + c.target[slot]]
    )


def _slip_leash(c: Columns, slot: int) -> None:
    """End the leash of a unit that gave up a chase when it is nearly back, or has another order."""
    away = _squared_distance_from_guard(c, slot) > LEASH_RESET * LEASH_RESET
    c.leashed[slot] = away and c.order_kind[slot] == IDLE and c.returning[slot]


class _Foes:
    """The enemies that a player sees and can aim at."""

    def __init__(self, room: int) -> None:
        self.room = room
        self.arrays = (
            memory.new_ints(room),
            memory.new_points(room),
            memory.new_floats(room),
            memory.new_ints(room),
            memory.new_floats(room),
            memory.new_ints(room),
            memory.new_ints(room),
        )
        self.slot = memory.ints(self.arrays[0])
        self.place = memory.points(self.arrays[1])
        self.radius = memory.floats(self.arrays[2])
        self.planes = memory.ints(self.arrays[3])
        self.rank = memory.floats(self.arrays[4])
        self.threatens = memory.ints(self.arrays[5])  # planes
        self.only = memory.ints(self.arrays[6])  # the slot of the only unit that it threatens, or ANYBODY

    def __reduce__(self) -> tuple[type[None], tuple[()]]:
        """Return what makes None: a copy of a world takes its own."""
        return type(None), ()

    def look(self, world: World, player: int) -> None:
        """Find the enemies of a player."""
        c = columns.columns_of(world)
        live = world.live
        slots = memory.ints(live)
        self.count = 0
        self.widest = 0.0
        for i in range(len(live)):
            slot = slots[i]
            if is_foe(c, player, slot):
                self.slot[self.count] = slot
                self.place[self.count] = c.pos[slot]
                self.radius[self.count] = c.radius[slot]
                self.planes[self.count] = c.plane_bits[slot]
                self.rank[self.count] = c.priority[slot] * PRIORITY_WEIGHT
                self.threatens[self.count] = c.threat_bits[slot]
                self.only[self.count] = _foe_of(c, slot) if c.defensive[slot] else ANYBODY
                self.widest = max(self.widest, c.radius[slot])
                self.count += 1
        self.ranges = memory.floats(world.stats.range)
        self.first = player * world.stats.weapons
        self.filters = census.census(world).weapons_with_filters
        self.zones = bool(world.area_effects)


def _foes_of(world: World, player: int) -> _Foes:
    """Return the enemies that a player sees and can aim at, in room that all players use in turn."""
    foes: _Foes | None = world.foes  # type: ignore[assignment]  # its fields say less
    if foes is None or foes.room < len(world.live):
        foes = world.foes = _Foes(2 * len(world.live))
    foes.look(world, player)
    return foes


def is_foe(c: Columns, player: int, slot: int) -> bool:
    """Return whether a unit is an enemy of a player that it sees and can aim at."""
    return (
        c.owner[slot] != player and c.owner[slot] != 0 and c.targetable[slot] and c.visible[player * c.capacity + slot]
    )


def _foe_of(c: Columns, slot: int) -> int:
    """Return the target of a unit that has had it in reach, NOBODY if there is none."""
    return c.target[slot] if c.reached[slot] else NOBODY


def rank_of(c: Columns, seeker: int, foe: int) -> float:
    """Return the rank that comes before distance: the foe's priority, and whether it threatens its seeker."""
    threatens = c.threat_bits[foe] & c.plane_bits[seeker] != 0 and (not c.defensive[foe] or _foe_of(c, foe) == seeker)
    return c.priority[foe] * PRIORITY_WEIGHT + (THREAT_WEIGHT if threatens else 0.0)


def _seek(world: World, c: Columns, player: int, seekers: list[int]) -> None:
    """Give each seeker of a player the best target it can see, if it takes it for what it has."""
    mine = [slot for slot in seekers if c.owner[slot] == player]
    if not mine:
        return
    foes = _foes_of(world, player)
    if not foes.count:
        return
    chosen = []
    for slot in mine:
        foe = _choose(c, foes, slot)
        if foe not in (NOBODY, c.target[slot]):
            chosen.append((slot, foe))
    for slot, foe in chosen:
        _take(world, c, slot, foe)


def _choose(c: Columns, foes: _Foes, slot: int) -> int:
    """Return the foe that a seeker turns on now, NOBODY if it goes on as it does."""
    now = c.target[slot]
    is_free = now == NOBODY or _loses(c, slot)
    rank_now = OUT_OF_SIGHT if is_free else rank_of(c, slot, now)
    if rank_now < TOP_RANK:
        best, rank = _find_best(c, foes, slot, _stays(c, slot))
        if is_free or rank > rank_now:
            return best
    if not c.in_reach[slot] and c.blocked[slot] >= BLOCKED_LOOPS:
        best, rank = _find_best(c, foes, slot, True)
        if rank >= rank_now:
            return best
    return NOBODY


def _find_best(c: Columns, foes: _Foes, slot: int, in_reach: bool) -> tuple[int, float]:
    """Return the best foe that a seeker sees, or reaches from where it stands, and its rank.

    NOBODY if there is none.
    """
    planes = c.plane_bits[slot]
    margin = GUARD_MARGIN if c.on_guard[slot] else 0.0
    on_ground = c.ground_scan[slot]
    in_air = c.air_scan[slot]
    best = NOBODY
    best_gap = 0.0
    best_rank = OUT_OF_SIGHT
    place = c.pos[slot]
    radius = c.radius[slot]
    farthest = max(on_ground, in_air) + margin + radius + foes.widest + ROUNDING
    if max(on_ground, in_air) < 0.0:
        return best, best_rank
    for i in range(foes.count):
        x = place.x - foes.place[i].x
        y = place.y - foes.place[i].y
        if x * x + y * y > farthest * farthest:
            continue
        only = foes.only[i]
        threat = THREAT_WEIGHT if foes.threatens[i] & planes and only in (ANYBODY, slot) else 0.0
        rank = foes.rank[i] + threat
        gap = memory.length(x, y) - radius - foes.radius[i]
        if rank < best_rank or (rank == best_rank and gap >= best_gap):
            continue
        sight = max(
            on_ground if foes.planes[i] & GROUND_PLANE else -1.0, in_air if foes.planes[i] & AIR_PLANE else -1.0
        )
        foe = foes.slot[i]
        if sight < 0.0 or (not _reaches(c, foes, slot, foe, gap) if in_reach else gap > sight + margin):
            continue
        if foes.filters and not _may_aim(c, slot, foe, gap):
            continue
        if foes.zones and not targets.inside_zone(c, slot, foe):
            continue
        best = foe
        best_gap = gap
        best_rank = rank
    return best, best_rank


def _may_aim(c: Columns, slot: int, foe: int, gap: float) -> bool:
    """Return whether a unit picks a foe that stands so near, or is a structure."""
    return not (c.least_range[slot] > 0.0 and gap < c.least_range[slot]) and not (
        c.spares_structures[slot] and c.walled[foe]
    )


def _reaches(c: Columns, foes: _Foes, slot: int, foe: int, gap: float) -> bool:
    """Return whether a unit could fire from where it stands at a foe that one of its weapons fits."""
    on_ground = c.plane_bits[foe] & GROUND_PLANE != 0 and c.ground_weapon[slot] >= 0
    row = c.ground_weapon[slot] if on_ground else c.air_weapon[slot]
    touch = c.separation[slot] + c.separation[foe] - c.radius[slot] - c.radius[foe]
    return gap <= max(foes.ranges[foes.first + row] + c.range_add[slot], touch)


def _take(world: World, c: Columns, slot: int, target: int) -> None:
    """Start a fight by the unit's own choice; an idle one remembers where it stood."""
    if c.order_kind[slot] == IDLE and c.target[slot] == NOBODY and not c.returning[slot]:
        c.guard[slot] = c.pos[slot]
        c.returning[slot] = True
    targets.engage(world, slot, target)


def _answer(world: World, c: Columns) -> None:
    """Turn attacked units on their attackers, and call their idle friends."""
    hurt = world.hurt
    world.hurt = []
    loop = world.loop
    live = world.live
    slots = memory.ints(live)
    for victim, attacker in hurt:
        if not (c.alive[victim] and c.alive[attacker]) or c.owner[victim] == c.owner[attacker]:
            continue
        _turn_on(world, c, victim, attacker)
        if loop - c.help_loop[victim] >= HELP_PERIOD:
            c.help_loop[victim] = loop
            for i in range(len(live)):
                friend = slots[i]
                if friend != victim and c.owner[friend] == c.owner[victim] and _hears(c, friend, victim):
                    _turn_on(world, c, friend, attacker)
        if c.flees[victim] and c.order_kind[victim] == IDLE and not c.returning[victim]:
            _flee(world, victim, attacker)


def _hears(c: Columns, friend: int, victim: int) -> bool:
    """Return whether a friend is near enough to answer a call for help."""
    x = c.pos[friend].x - c.pos[victim].x
    y = c.pos[friend].y - c.pos[victim].y
    return x * x + y * y <= HELP_RADIUS * HELP_RADIUS


def _turn_on(world: World, c: Columns, slot: int, attacker: int) -> None:
    """Make a unit that is free to do so fight an attacker that it sees."""
    roams = c.looks_around[slot] and not (c.holds[slot] or c.leashed[slot]) and c.step_max[slot] > 0.0
    is_free = c.acquires[slot] and c.target[slot] == NOBODY and _seeks_fights(c, slot)
    if roams and is_free and c.visible[c.owner[slot] * c.capacity + attacker]:
        _take(world, c, slot, attacker)


def _flee(world: World, victim: int, attacker: int) -> None:
    """Make an idle unit that does not fight back run away from its attacker; where it ends is its new place."""
    x0, y0, x1, y1 = world.west, world.south, world.east, world.north
    offset = world.pos[victim] - world.pos[attacker]
    away = offset / max(float(np.sqrt(offset[0] ** 2 + offset[1] ** 2)), 1e-9)
    world.guard[victim] = np.clip(world.pos[victim] + away * MECHANICS.flee_distance, (x0, y0), (x1, y1))
    world.returning[victim] = True
    world.nav_loop[victim] = 0
