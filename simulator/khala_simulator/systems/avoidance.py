"""Avoidance: how a walker that bodies block finds a heading around them.

Melee units go where ``flanking`` leads them. Any other blocked walker goes round those who stand ahead of it, on the
side where fewer of them are: so a crowd parts in two, and ranged units spread into an arc. It looks in a fan of
headings around its way, on that side first, and takes the free one that turns it least. It keeps the side until it has
made progress for a while; one without a target that comes no nearer tries the other side. Bodies that stand or come
towards it and the terrain count as obstacles, ``collision`` handles those that go the same way. The game's own local
avoidance is not known; all of this is an estimate.
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
    from khala_simulator.movement.grids import SurfaceGrid
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
CROWD_STALL: Final = MECHANICS.crowd_stall
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
    # in the middle of the usual step of 8 loops: a unit with a new order at every step is led for the rest of it
    if (loop - DETOUR_PERIOD) % FLANK_PERIOD == 0:
        for slot in turning:
            if _flows(c, slot):
                c.detour[slot] = 1 if c.detour[slot] > 0 else -1
        flanking.lead(world, turning)
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
    standing = None
    for i in range(len(slots)):
        slot = walkers[i]
        c.detour_end[slot] = end
        if c.detour[slot] != 0:
            continue
        if standing is None:
            standing = _Standing(world)
        way = c.intended[slot]
        beside = standing.to_the_left(c.pos[slot], way)
        turn = way.x * shifts[i].y - way.y * shifts[i].x if beside == 0.0 else -beside
        c.detour[slot] = 1 if turn >= 0.0 else -1


class _Standing:
    """Where the bodies are that do not walk."""

    def __init__(self, world: World) -> None:
        c = columns.columns_of(world)
        live = world.live
        slots = memory.ints(live)
        self._arrays = (memory.new_points(len(live)), memory.new_floats(len(live)))
        self._places = memory.points(self._arrays[0])
        self._terms = memory.floats(self._arrays[1])  # what each adds to a sum
        self._many = 0
        for i in range(len(live)):
            slot = slots[i]
            if not c.wants[slot] and c.layer[slot] != AIR:
                self._places[self._many] = c.pos[slot]
                self._many += 1

    def to_the_left(self, at: memory.Point, way: memory.Point) -> float:
        """Return how far to the left of a way those stand that are near and ahead, summed up in pairs."""
        for i in range(self._many):
            x = self._places[i].x - at.x
            y = self._places[i].y - at.y
            is_ahead = x * x + y * y < DETOUR_LOOK * DETOUR_LOOK and x * way.x + y * way.y > 0.0
            self._terms[i] = y * way.x - x * way.y if is_ahead else 0.0
        return memory.pairwise_sum(self._terms, self._many)


# the heading ----------------------------------------------------------------------------------------------------------


def _look(world: World, c: Columns, turning: list[int]) -> None:
    """Choose the heading of every walker that follows no flow: the free one that turns it least."""
    crowd = _crowd_of(world)
    ground = world.ground
    loop = world.loop
    for slot in turning:
        if _flows(c, slot):
            continue
        stalled = loop - c.nav_best_loop[slot]
        if c.target[slot] == NOBODY and stalled >= CROWD_STALL and stalled % CROWD_STALL < DETOUR_PERIOD:
            c.detour[slot] = -c.detour[slot]  # that side leads nowhere
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


def _first_free(c: Columns, crowd: _Crowd, grid: SurfaceGrid | None, slot: int, way: memory.Point) -> int:
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


def _is_ground(grid: SurfaceGrid, start: memory.Point, heading: memory.Point) -> bool:
    """Return whether a heading leads to a free cell."""
    return grid.flat[grids.cell_at(grid, start.x + heading.x * SEEN_AHEAD, start.y + heading.y * SEEN_AHEAD)]


def _stripe(x: float) -> int:
    """Return the number of the stripe of the map, one cell wide, in which a point is counted."""
    return 0 if x < 0.0 else STRIPES - 1 if x >= STRIPES else int(x)


class _Crowd:
    """The bodies that may be in somebody's way, sorted by stripes of the map; then those near one walker."""

    def __init__(self, room: int) -> None:
        self.room = room
        self._arrays = (
            memory.new_ints(STRIPES + 1),
            memory.new_ints(room),
            memory.new_ints(room),
            memory.new_points(room),
            memory.new_points(room),
            memory.new_floats(room),
            memory.new_points(room),
            memory.new_floats(room),
        )
        self._begin = memory.ints(self._arrays[0])  # of each stripe
        self._slot = memory.ints(self._arrays[1])
        self._bits = memory.ints(self._arrays[2])
        self._place = memory.points(self._arrays[3])
        self._step = memory.points(self._arrays[4])
        self._separation = memory.floats(self._arrays[5])
        self._offset = memory.points(self._arrays[6])  # from the walker
        self._apart = memory.floats(self._arrays[7])  # distance to keep

    def __reduce__(self) -> tuple[type[None], tuple[()]]:
        """Return what makes None: a copy of a world takes its own."""
        return type(None), ()

    def look(self, world: World) -> None:
        """List the bodies as they stand now."""
        c = columns.columns_of(world)
        live = world.live
        slots = memory.ints(live)
        self._many = 0  # near the walker
        self._widest = 0.0
        for i in range(STRIPES + 1):
            self._begin[i] = 0
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
                place = self._begin[stripe]
                self._slot[place] = slot
                self._bits[place] = c.layer_bits[slot]
                self._place[place] = c.pos[slot]
                self._step[place] = c.intended[slot]
                self._separation[place] = c.separation[slot]
                self._widest = max(self._widest, c.separation[slot])

    def look_around(self, c: Columns, slot: int, way: memory.Point) -> None:
        """Find the bodies that stand near a walker or come towards it."""
        separation = c.separation[slot]
        bits = c.layer_bits[slot]
        farthest = separation + self._widest + SEEN_AHEAD
        start = c.pos[slot]
        many = 0
        for i in range(self._begin[_stripe(start.x - farthest)], self._begin[_stripe(start.x + farthest) + 1]):
            x = self._place[i].x - start.x
            y = self._place[i].y - start.y
            apart = separation + self._separation[i] - TOLERANCE
            seen = apart + SEEN_AHEAD
            if (
                x * x + y * y < seen * seen
                and bits & self._bits[i] != 0
                and self._slot[i] != slot
                and self._slot[i] != c.target[slot]
                and way.x * self._step[i].x + way.y * self._step[i].y <= 0.0
            ):
                self._offset[many] = memory.point(x, y)
                self._apart[many] = apart
                many += 1
        self._many = many

    def lets_pass(self, heading: memory.Point) -> bool:
        """Return whether a heading leads into none of these within ``SEEN_AHEAD``."""
        for i in range(self._many):
            along = heading.x * self._offset[i].x + heading.y * self._offset[i].y
            across = heading.x * self._offset[i].y - heading.y * self._offset[i].x
            reach = max(along - SEEN_AHEAD, 0.0)
            if along > 0.0 and across * across + reach * reach < self._apart[i] * self._apart[i]:
                return False
        return True


def _crowd_of(world: World) -> _Crowd:
    """Return the bodies as they stand now, in room that is kept."""
    crowd: _Crowd | None = world.crowd  # type: ignore[assignment]  # its fields say less
    if crowd is None or crowd.room < len(world.live):
        crowd = world.crowd = _Crowd(2 * len(world.live))
    crowd.look(world)
    return crowd


def _is_body(c: Columns, slot: int) -> bool:
    """Return whether a unit is a body to go round; a structure on its footprint is a wall."""
    return c.layer_bits[slot] != 0 and not c.walled[slot]
