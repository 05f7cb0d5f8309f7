"""Engagement: the distance of every fight, and where every unit wants to be this loop.

Between choosing targets (``acquire``, orders) and acting on them (``weapons``, ``movement``). Writes the columns
``gap``, ``toward``, ``in_reach``, ``wants``, ``goal`` and ``stop_at``, which later systems of the same loop read.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_simulator.abilities import casting
from khala_simulator.combat import census, targets
from khala_simulator.economy import touching
from khala_simulator.economy.harvesting import Phase
from khala_simulator.native import columns, memory
from khala_simulator.tables.mechanics import MECHANICS
from khala_simulator.world.casts import Cast
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.orders import OrderKind

if TYPE_CHECKING:
    from khala_simulator.combat.census import Census
    from khala_simulator.native.columns import Columns
    from khala_simulator.native.memory import Cells
    from khala_simulator.world.world import World

EDGE_TOLERANCE: Final = 1e-9
ON_TARGET: Final = 1e-9
ARMS_LENGTH: Final = 0.5
"""Weapons that reach no farther hit structures at their walls."""
BESIDE_WALLS: Final = 0.5
"""Distance at which the ways of small units pass a wall."""
FOLLOW_GAP: Final = 0.5
HARVEST_OVERLAP: Final = 0.01
"""How far inside its reach a worker brakes to a stop. The last stretch is slow: 0.05 would save four loops a trip."""
CHASE_SLACK: Final = MECHANICS.chase_slack
GUARD_SLACK_SQUARED: Final = MECHANICS.guard_slack**2
FOLLOW: Final = int(OrderKind.FOLLOW)
TO_RESOURCE: Final = int(Phase.TO_RESOURCE)
TO_HALL: Final = int(Phase.TO_HALL)


def measure(world: World) -> None:
    """Measure the distance of every fight and write which units want to walk where."""
    c = columns.columns_of(world)
    n = world.top
    fighting = 0
    follows = False
    approaches = False
    goes_back = False
    for slot in range(n):
        fighting += c.target[slot] >= 0
        c.wants[slot] = c.walks[slot]
        c.goal[slot] = c.order_point[slot]
        c.stop_at[slot] = 0.0
        follows |= c.needs_target[slot]
        approaches |= c.casts[slot]
        goes_back |= c.returning[slot]
    if len(world.fighters) != fighting:
        world.fighters = memory.new_ints(fighting)
    fighters = world.fighters
    _note_fighters(c, n, memory.ints(fighters))
    if follows:
        _follow(c, n)
    if approaches:
        _approach(world, c, n)
    if world.harvesting:
        _haul(world, c, n)
    if goes_back:
        _go_back(c, n)
    kinds = census.census(world)
    if fighting:
        _close_in(world, c, kinds, memory.ints(fighters), fighting)
    rolls = kinds.rolling_guns
    for slot in range(n):
        if c.wants[slot]:
            is_free = (c.windup[slot] < 0.0 and c.backswing[slot] <= 0.0) or (rolls and c.rolling[slot])
            c.wants[slot] = is_free and c.step_max[slot] > 0.0


def _note_fighters(c: Columns, n: int, fighters: Cells) -> None:
    """Write the slots with a target."""
    count = 0
    for slot in range(n):
        if c.target[slot] >= 0:
            fighters[count] = slot
            count += 1


def _close_in(world: World, c: Columns, kinds: Census, slots: Cells, fighting: int) -> None:
    """Write the distances, goals and reach of the units that fight."""
    beams = kinds.beams
    rolling_guns = kinds.rolling_guns
    guns_walking = kinds.guns_walking
    hides = world.fog or world.hiding
    zones = bool(world.area_effects)
    for i in range(fighting):
        slot = slots[i]
        target = c.target[slot]
        reach = c.reach[slot]
        gap = _measure_gap(c, slot, target)
        is_beyond = gap > reach + EDGE_TOLERANCE
        is_near = (
            (not is_beyond or (c.in_reach[slot] and gap <= reach + c.slop[slot]))
            and gap >= c.reach_min[slot]
            and c.can_attack[slot]
            and (not hides or c.visible[c.owner[slot] * c.capacity + target])
            and (not zones or targets.inside_zone(c, slot, target))
        )
        if beams:
            c.beaming[slot] = c.beaming[slot] and is_near
        c.gap[slot] = gap
        c.in_reach[slot] = is_near
        c.reached[slot] = c.reached[slot] or is_near
        if guns_walking and c.walks[slot] and not c.looks_around[slot]:
            continue  # a unit that fires while it walks stays on its way
        c.goal[slot] = c.pos[target]
        c.stop_at[slot] = c.radius[slot] + c.radius[target] + max(reach - CHASE_SLACK, 0.0)
        c.wants[slot] = is_beyond and (not is_near or (rolling_guns and c.rolling[slot])) and not c.holds[slot]


def _measure_gap(c: Columns, slot: int, target: int) -> float:
    """Return the distance to a unit's target, edge to edge, and write the direction; on the target it is ahead."""
    x = c.pos[target].x - c.pos[slot].x
    y = c.pos[target].y - c.pos[slot].y
    distance = memory.length(x, y)
    bodies = c.radius[slot] + c.radius[target]
    gap: float = distance - bodies
    if distance < ON_TARGET:
        c.toward[slot] = c.heading[slot]
        gap = 0.0 - bodies
    else:
        c.toward[slot] = memory.point(x / distance, y / distance)
    if c.walled[target] and c.reach[slot] <= ARMS_LENGTH:
        gap = min(gap, _distance_to_walls(c, slot, target))
    return gap


def _distance_to_walls(c: Columns, slot: int, target: int) -> float:
    """Return the distance from a unit's edge to a structure's walls, which may keep the middle out of reach."""
    x = max(abs(c.pos[slot].x - c.pos[target].x) - c.walls[target].x, 0.0)
    y = max(abs(c.pos[slot].y - c.pos[target].y) - c.walls[target].y, 0.0)
    inside: float = max(c.radius[slot], BESIDE_WALLS)
    return memory.length(x, y) - inside


def _follow(c: Columns, n: int) -> None:
    """Make units that follow another one walk until they are beside it."""
    for slot in range(n):
        leader = c.order_target[slot]
        if c.order_kind[slot] == FOLLOW and leader >= 0:
            x = c.pos[leader].x - c.pos[slot].x
            y = c.pos[leader].y - c.pos[slot].y
            stop_at = c.separation[slot] + c.separation[leader] + FOLLOW_GAP
            c.goal[slot] = c.pos[leader]
            c.stop_at[slot] = stop_at
            c.wants[slot] = memory.length(x, y) > stop_at + FOLLOW_GAP


def _haul(world: World, c: Columns, n: int) -> None:
    """Make workers walk until they are at their resource or town hall."""
    table = touching.outlines(world.catalog)
    outlines = memory.floats(table)
    for slot in range(n):
        place = c.order_target[slot]
        if place < 0 or (c.harvest[slot] != TO_RESOURCE and c.harvest[slot] != TO_HALL):
            continue
        x = c.pos[place].x - c.pos[slot].x
        y = c.pos[place].y - c.pos[slot].y
        stop_at = touching.distance(c, outlines, slot, place)
        c.goal[slot] = c.pos[place]
        c.stop_at[slot] = stop_at - HARVEST_OVERLAP
        c.wants[slot] = x * x + y * y > stop_at * stop_at


def _approach(world: World, c: Columns, n: int) -> None:
    """Make casters walk until their ability reaches, and stand from then on unless they have to follow."""
    for slot in range(n):
        if not c.casts[slot]:
            continue
        target = c.order_target[slot]
        ability = casting.as_is(world, slot, world.catalog.ability(c.order_ability[slot]))
        aimed = target != NOBODY or c.order_aimed[slot]
        waits = c.cast_at[slot] < 0.0 and not c.channels[slot]
        follows = c.channels[slot] and ability.follow_range > 0.0
        if not (aimed and (waits or follows)) or ability.range >= casting.ANYWHERE:
            continue
        if follows:
            stop_at = ability.follow_range + c.radius[slot] + (c.radius[target] if target != NOBODY else 0.0)
        else:
            stop_at = casting.reach(world, Cast(slot, ability, target))
        c.goal[slot] = c.pos[target] if target != NOBODY else c.order_point[slot]
        x = c.goal[slot].x - c.pos[slot].x
        y = c.goal[slot].y - c.pos[slot].y
        c.stop_at[slot] = max(stop_at - CHASE_SLACK, 0.0)
        c.wants[slot] = x * x + y * y > stop_at * stop_at


def _go_back(c: Columns, n: int) -> None:
    """Send idle units back to where they stood before a fight; once there, they forget that place."""
    for slot in range(n):
        if c.returning[slot] and c.target[slot] == NOBODY:
            x = c.guard[slot].x - c.pos[slot].x
            y = c.guard[slot].y - c.pos[slot].y
            is_away = x * x + y * y > GUARD_SLACK_SQUARED
            c.returning[slot] = is_away
            c.wants[slot] = is_away
            c.goal[slot] = c.guard[slot]
