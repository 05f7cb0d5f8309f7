"""Sweeps: lines drawn point by point through the ranks, as the Colossus' beams, the Lurker's spines and flames are.

A unit is touched by the first point that reaches its edge when that point's time has come, so that a unit can walk out
of the way of spines; it is hit once per sweep, some loops later where the game waits. A sweep ends with its attacker.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_simulator.combat import damage
from khala_simulator.native import columns, memory
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.shots import PendingHit, Shot, Sweep

if TYPE_CHECKING:
    from khala_simulator.native.columns import Columns
    from khala_simulator.native.memory import Points
    from khala_simulator.tables.records import SweepRecord
    from khala_simulator.world.world import World

ON_TARGET: Final = 1e-9


def begin(world: World, shot: Shot, begun: float) -> None:
    """Start the sweep of a shot whose damage point was at the (fractional) loop ``begun``."""
    sweep = Sweep(shot, begun, 0, [])
    world.sweeps.append(sweep)
    _draw(world, sweep)
    _drop_ended(world)


def run(world: World) -> None:
    """Draw the points of all sweeps whose time has come."""
    if not world.sweeps:
        return
    for sweep in world.sweeps:
        _draw(world, sweep)
    _drop_ended(world)


def _drop_ended(world: World) -> None:
    """Forget the sweeps that are at their end, or whose attacker is gone."""
    world.sweeps = [s for s in world.sweeps if s.shot.source != NOBODY and s.ahead < len(_line(world, s.shot).points)]


def _line(world: World, shot: Shot) -> SweepRecord:
    line = world.catalog.weapons[shot.weapon].hits[shot.hit].sweep
    assert line is not None, "only hits with a sweep are begun"
    return line


def _draw(world: World, sweep: Sweep) -> None:
    """Touch the units at the points that are due."""
    shot = sweep.shot
    if shot.source == NOBODY:
        return
    line = _line(world, shot)
    points = line.points
    lag = line.lag_loops
    loop = world.loop
    first = sweep.ahead
    while sweep.ahead < len(points) and sweep.begun + (points[sweep.ahead][0] - lag) <= loop:
        sweep.ahead += 1
    if sweep.ahead == first:
        return
    c = columns.columns_of(world)
    if line.follows and shot.target != NOBODY:
        shot.goal_x = c.pos[shot.target].x
        shot.goal_y = c.pos[shot.target].y
    room = memory.new_points(sweep.ahead - first)
    places = memory.points(room)
    drawn = _place(world, shot, line, first, sweep.ahead, places)
    live = world.live
    slots = memory.ints(live)
    radius = line.radius
    affects = damage.bits_of(line.affects)
    for i in range(len(live)):
        slot = slots[i]
        if not damage.touches(c, affects, shot, slot):
            continue
        reached = _first_within(c, places, drawn, slot, radius + c.radius[slot])
        if reached < drawn and slot not in sweep.touched:
            sweep.touched.append(slot)
            _touch(world, sweep, slot, lag, sweep.begun + (points[first + reached][0] - lag))


def _place(world: World, shot: Shot, line: SweepRecord, first: int, end: int, places: Points) -> int:
    """Write where some points of a line are, without those past the weapon's reach; return how many are left."""
    from_source = line.origin == "source"
    x = shot.start_x if from_source else shot.goal_x
    y = shot.start_y if from_source else shot.goal_y
    forward_x = shot.goal_x - shot.start_x
    forward_y = shot.goal_y - shot.start_y
    distance = memory.length(forward_x, forward_y)
    if distance > ON_TARGET:
        forward_x = forward_x / distance
        forward_y = forward_y / distance
    else:
        forward_x = 0.0
        forward_y = -1.0
    reach = memory.floats(world.stats.range[shot.owner])[shot.weapon] + line.past_range
    points = line.points
    drawn = 0
    for i in range(first, end):
        _, across, along = points[i]
        if from_source and not -along <= reach:
            continue
        at_x = x + (across * forward_y - along * forward_x)
        at_y = y + (-across * forward_x - along * forward_y)
        places[drawn] = memory.point(at_x, at_y)
        drawn += 1
    return drawn


def _first_within(c: Columns, places: Points, drawn: int, slot: int, reach: float) -> int:
    """Return the first place within a distance from a unit's middle; behind the last one if there is none."""
    for i in range(drawn):
        if memory.length(c.pos[slot].x - places[i].x, c.pos[slot].y - places[i].y) <= reach:
            return i
    return drawn


def _touch(world: World, sweep: Sweep, slot: int, lag: float, moment: float) -> None:
    """Hit a unit now, or when the lag has passed."""
    shot = sweep.shot.at(slot)
    if lag <= 0.0:
        damage.hit_target(world, shot)
        return
    c = columns.columns_of(world)
    shot.goal_x = c.pos[slot].x
    shot.goal_y = c.pos[slot].y
    world.pending.append(PendingHit(shot, moment + lag, single=True))
