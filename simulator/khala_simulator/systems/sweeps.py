"""Sweeps: lines drawn point by point through the ranks, as the Colossus' beams, the Lurker's spines and flames are.

A unit is touched by the first point that reaches its edge when that point's time has come, so that a unit can walk out
of the way of spines; it is hit once per sweep, some loops later where the game waits. A sweep ends with its attacker.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from khala_simulator.combat import damage
from khala_simulator.numeric import geometry
from khala_simulator.numeric.arrays import which
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.shots import Sweep

if TYPE_CHECKING:
    from khala_simulator.numeric.geometry import Floats
    from khala_simulator.tables import records
    from khala_simulator.world.columns import Bools
    from khala_simulator.world.shots import Shot
    from khala_simulator.world.world import World

ON_TARGET = 1e-9


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
    world.sweeps = [s for s in world.sweeps if s.shot.source != NOBODY and s.ahead < len(_line(world, s.shot).points)]


def _line(world: World, shot: Shot) -> records.SweepRecord:
    line = world.catalog.weapons[shot.weapon].hits[shot.hit].sweep
    assert line is not None, "only hits with a sweep are begun"
    return line


def _draw(world: World, sweep: Sweep) -> None:
    """Touch the units at the points that are due."""
    shot = sweep.shot
    line = _line(world, shot)
    if shot.source == NOBODY:
        return
    first = sweep.ahead
    while sweep.ahead < len(line.points) and sweep.begun + _delay(line, sweep.ahead) <= world.loop:
        sweep.ahead += 1
    if sweep.ahead == first:
        return
    points = _places(world, shot, line, first, sweep.ahead)
    near = damage.affected(world, line.affects, shot)
    offset = world.pos[near][:, None, :] - points
    reached: Bools = geometry.length(offset) <= line.radius + world.radius[near][:, None]
    for i in which(np.logical_or.reduce(reached, axis=1)).tolist():
        slot = int(near[i])
        if slot not in sweep.touched:
            sweep.touched.append(slot)
            _touch(world, sweep, slot, line, sweep.begun + _delay(line, first + int(np.argmax(reached[i]))))


def _delay(line: records.SweepRecord, point: int) -> float:
    """Return the loops from the damage point until a point of the line touches."""
    return line.points[point][0] - line.lag_loops


def _places(world: World, shot: Shot, line: records.SweepRecord, first: int, end: int) -> Floats:
    """Return (k, 2) where the points from ``first`` up to ``end`` are, without those past the weapon's reach."""
    fx, fy = shot.goal[0] - shot.start[0], shot.goal[1] - shot.start[1]
    distance = math.sqrt(fx * fx + fy * fy)
    fx, fy = (fx / distance, fy / distance) if distance > ON_TARGET else (0.0, -1.0)
    drawn = np.array(line.points[first:end])
    across, along = drawn[:, 1], drawn[:, 2]
    origin = shot.goal
    if line.origin == "source":
        origin = shot.start
        reach = world.stats.range[shot.owner, shot.weapon] + line.past_range
        across, along = across[-along <= reach], along[-along <= reach]
    return np.array(origin) + np.stack([across * fy - along * fx, -across * fx - along * fy], axis=1)


def _touch(world: World, sweep: Sweep, slot: int, line: records.SweepRecord, moment: float) -> None:
    """Hit a unit now, or when the lag has passed."""
    shot = sweep.shot._replace(target=slot)
    if line.lag_loops <= 0.0:
        damage.hit_target(world, shot)
        return
    point = world.pos[slot]
    world.pending.append(
        1, **shot._replace(goal=(point[0], point[1]))._asdict(), due=moment + line.lag_loops, single=True
    )
