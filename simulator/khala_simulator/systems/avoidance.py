"""Avoidance: how a walker that bodies block finds a heading around them.

Melee units go where ``flanking`` leads them. Any other blocked walker goes round those who stand ahead of it, on the
side where fewer of them are: so a crowd parts in two, and ranged units spread into an arc. It looks in a fan of
headings around its way, on that side first, takes the free one that turns it least, and keeps the side until it has
made progress for a while. Bodies that stand or come towards it and the terrain count as obstacles, ``collision``
handles those that go the same way. The game's own local avoidance is not known; all of this is an estimate.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from khala_simulator.movement import grids
from khala_simulator.native import columns, memory
from khala_simulator.systems import flanking
from khala_simulator.tables.layers import Layer
from khala_simulator.tables.mechanics import MECHANICS
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from khala_simulator.movement.grids import Grid
    from khala_simulator.native.columns import Columns
    from khala_simulator.numeric.geometry import Floats
    from khala_simulator.world.columns import Ints
    from khala_simulator.world.world import World

FAN_DEG: Final = (0.0, 25.0, 50.0, 75.0, 100.0, 130.0)
_FAN_COS: Final = np.array([math.cos(math.radians(a)) for a in FAN_DEG] * 2)  # to one side, then to the other
_FAN_SIN: Final = np.array([sign * math.sin(math.radians(a)) for sign in (1.0, -1.0) for a in FAN_DEG])
FAN_COS: Final = memory.floats(_FAN_COS)
FAN_SIN: Final = memory.floats(_FAN_SIN)
SIDE: Final = len(FAN_DEG)  # headings to one side
FAN: Final = 2 * SIDE
SEEN_AHEAD: Final = 0.7
TOLERANCE: Final = 0.02
STRIPES: Final = 256
AIR: Final = int(Layer.AIR)
LED: Final = flanking.LED
DETOUR_LOOK: Final = MECHANICS.detour_look
DETOUR_PERIOD: Final = MECHANICS.detour_period
DETOUR_LOOPS: Final = MECHANICS.detour_loops
FLANK_PERIOD: Final = MECHANICS.flank_period


def find_headings(world: World) -> None:
    """Write ``aside`` of walkers that have to go around others; it is checked every few loops."""
    loop = world.loop
    if loop % DETOUR_PERIOD:
        return
    c = columns.columns_of(world)
    turning = []
    for slot in range(world.top):
        if c.detour[slot] == 0:
            continue
        if c.detour_end[slot] <= loop or not c.wants[slot]:
            c.detour[slot] = 0
            c.aside[slot] = memory.point(0.0, 0.0)
        else:
            turning.append(slot)
    if not turning:
        return
    # in the middle of the usual step of 8 loops: who gets a new order at every step is led for the rest of it
    if (loop - DETOUR_PERIOD) % FLANK_PERIOD == 0:
        for slot in turning:
            if _flows(c, slot):
                c.detour[slot] = 1 if c.detour[slot] > 0 else -1
        flanking.lead(world)
    _look(world, c, turning)


def _flows(c: Columns, slot: int) -> bool:
    """Return whether a walker follows a flow."""
    return c.detour[slot] == LED or c.detour[slot] == -LED


# the side -------------------------------------------------------------------------------------------------------------


def begin(world: World, slots: Ints, shift: Floats) -> None:
    """Make blocked walkers look for a way around, first on the side where fewer stand or to which ``shift`` pushed.

    Args:
        world: The game.
        slots: Slots of the walkers (k,).
        shift: How far bodies pushed each of them off its step (k, 2).
    """
    c = columns.columns_of(world)
    walkers = memory.ints(slots)
    shifts = memory.points(shift)
    end = world.loop + DETOUR_LOOPS
    places = None
    for i in range(len(slots)):
        slot = walkers[i]
        c.detour_end[slot] = end
        if c.detour[slot] != 0:
            continue
        if places is None:
            places = _standing(world, c)
        way = c.intended[slot]
        beside = _to_the_left(c.pos[slot], way, places)
        turn = way.x * shifts[i].y - way.y * shifts[i].x if beside == 0.0 else -beside
        c.detour[slot] = 1 if turn >= 0.0 else -1


def _standing(world: World, c: Columns) -> Floats:
    """Return (k, 2) where the bodies are that do not walk."""
    live = world.live
    slots = memory.ints(live)
    room = memory.new_points(len(live))
    places = memory.points(room)
    bodies = 0
    for i in range(len(live)):
        slot = slots[i]
        if not c.wants[slot] and c.layer[slot] != AIR:
            places[bodies] = c.pos[slot]
            bodies += 1
    return room[:bodies]


def _to_the_left(at: memory.Point, way: memory.Point, standing: Floats) -> float:
    """Return how far to the left of a way the bodies stand that are near and ahead, summed up in pairs."""
    places = memory.points(standing)
    terms = memory.new_floats(len(standing))
    beside = memory.floats(terms)
    for i in range(len(standing)):
        x = places[i].x - at.x
        y = places[i].y - at.y
        is_ahead = x * x + y * y < DETOUR_LOOK * DETOUR_LOOK and x * way.x + y * way.y > 0.0
        beside[i] = y * way.x - x * way.y if is_ahead else 0.0
    return float(terms.sum())


# the heading ----------------------------------------------------------------------------------------------------------


def _look(world: World, c: Columns, turning: list[int]) -> None:
    """Choose the heading of every walker that follows no flow: the free one that turns it least."""
    crowd = _Crowd(world)
    ground = world.ground
    for slot in turning:
        if _flows(c, slot):
            continue
        x = c.nav_point[slot].x - c.pos[slot].x
        y = c.nav_point[slot].y - c.pos[slot].y
        size = max(memory.length(x, y), 1e-12)
        way = memory.point(x / size, y / size)
        grid = None if c.layer[slot] == AIR else grids.grid_of(ground, c.layer[slot])
        crowd.look_around(c, slot, way)
        turn = _first_free(c, crowd, grid, slot, way)
        heading = _heading(way, turn, c.detour[slot]) if 0 < turn < FAN else memory.point(0.0, 0.0)
        # an army on its way to a fight keeps to its sides: who turned back would meet those that follow
        if SIDE < turn < FAN and c.target[slot] != NOBODY:
            c.detour[slot] = -c.detour[slot]
        c.aside[slot] = heading


def _first_free(c: Columns, crowd: _Crowd, grid: Grid | None, slot: int, way: memory.Point) -> int:
    """Return the number of the first heading of the fan that is free, ``FAN`` if none is."""
    for turn in range(FAN):
        heading = _heading(way, turn, c.detour[slot])
        if (grid is None or _is_ground(grid, c.pos[slot], heading)) and crowd.lets_pass(heading):
            return turn
    return FAN


def _heading(way: memory.Point, turn: int, side: float) -> memory.Point:
    """Return one of the headings that turn further and further to a side (1 is left), then to the other side."""
    sine = FAN_SIN[turn] * side
    return memory.point(way.x * FAN_COS[turn] - way.y * sine, way.y * FAN_COS[turn] + way.x * sine)


def _is_ground(grid: Grid, start: memory.Point, heading: memory.Point) -> bool:
    """Return whether a heading leads to a free cell."""
    return grid.flat[grids.cell_at(grid, start.x + heading.x * SEEN_AHEAD, start.y + heading.y * SEEN_AHEAD)]


def _stripe(x: float) -> int:
    """Return the number of the stripe of the map, one cell wide, in which a point is counted."""
    return 0 if x < 0.0 else STRIPES - 1 if x >= STRIPES else int(x)


class _Crowd:
    """The bodies that may be in somebody's way, sorted by stripes of the map; then those near one walker."""

    def __init__(self, world: World) -> None:
        c = columns.columns_of(world)
        live = world.live
        slots = memory.ints(live)
        self._arrays = (
            memory.new_ints(len(live)),
            np.zeros(STRIPES + 1, dtype=np.int64),
            memory.new_floats(len(live)),
            memory.new_floats(len(live)),
            memory.new_floats(len(live)),
        )
        self._slot = memory.ints(self._arrays[0])
        self._begin = memory.ints(self._arrays[1])  # of each stripe
        self._x = memory.floats(self._arrays[2])  # from the walker
        self._y = memory.floats(self._arrays[3])
        self._apart = memory.floats(self._arrays[4])  # distance to keep
        self._many = 0  # near the walker
        self._widest = 0.0
        for i in range(len(live)):
            if _is_body(c, slots[i]):
                self._begin[_stripe(c.pos[slots[i]].x)] += 1
        for i in range(1, STRIPES + 1):
            self._begin[i] += self._begin[i - 1]
        for i in range(len(live)):
            slot = slots[i]
            if _is_body(c, slot):
                stripe = _stripe(c.pos[slot].x)
                self._begin[stripe] -= 1
                self._slot[self._begin[stripe]] = slot
                self._widest = max(self._widest, c.separation[slot])

    def look_around(self, c: Columns, slot: int, way: memory.Point) -> None:
        """Find the bodies that stand near a walker or come towards it."""
        separation = c.separation[slot]
        farthest = separation + self._widest + SEEN_AHEAD
        start = c.pos[slot]
        self._many = 0
        first = self._begin[_stripe(start.x - farthest)]
        end = self._begin[_stripe(start.x + farthest) + 1]
        for i in range(first, end):
            body = self._slot[i]
            x = c.pos[body].x - start.x
            y = c.pos[body].y - start.y
            apart = separation + c.separation[body] - TOLERANCE
            seen = apart + SEEN_AHEAD
            if (
                x * x + y * y < seen * seen
                and c.layer_bits[slot] & c.layer_bits[body] != 0
                and body != slot
                and body != c.target[slot]
                and way.x * c.intended[body].x + way.y * c.intended[body].y <= 0.0
            ):
                self._x[self._many] = x
                self._y[self._many] = y
                self._apart[self._many] = apart
                self._many += 1

    def lets_pass(self, heading: memory.Point) -> bool:
        """Return whether a heading leads into none of these within ``SEEN_AHEAD``."""
        for i in range(self._many):
            along = heading.x * self._x[i] + heading.y * self._y[i]
            across = heading.x * self._y[i] - heading.y * self._x[i]
            reach = max(along - SEEN_AHEAD, 0.0)
            if along > 0.0 and across * across + reach * reach < self._apart[i] * self._apart[i]:
                return False
        return True


def _is_body(c: Columns, slot: int) -> bool:
    """Return whether a unit is a body to go round; what stands on a footprint is a wall."""
    return c.layer_bits[slot] != 0 and not c.walled[slot]
