"""Scouting: one unit at a time looks at the enemy's bases, one after the other, and then comes home."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from khala_simulator.opponent import hands, products
from khala_simulator.opponent.levels import FASTER_LOOPS
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.orders import OrderKind

if TYPE_CHECKING:
    from khala_simulator.opponent.side import OwnSide
    from khala_simulator.world.casts import Point

FIRST_S: Final = 40.0
BETWEEN_S: Final = 75.0
WORKERS_UNTIL_S: Final = 150.0
"""Later a unit of the army looks, not a worker."""
SEEN: Final = 5.0
"""A place is seen from so far."""
PLACES: Final = 4
"""How many places one scout looks at."""


def look(side: OwnSide) -> None:
    """Send a scout, or send the one that is under way on."""
    mind, world = side.mind, side.world
    if "scout" not in side.level.skills or side.level.vision:
        return
    scout = world.slot_of(mind.scout)
    if scout == NOBODY:
        if mind.scout:
            _end(side)
        elif world.loop >= mind.next_scout and side.clock_s >= FIRST_S:
            mind.scout = world.tag_of(_chosen(side))
        return
    place = _place(side)
    if math.dist(side.place(scout), place) <= SEEN:
        mind.scouted += 1
        if mind.scouted % PLACES == 0:
            _end(side)
            return
        place = _place(side)
    if int(world.order_kind[scout]) != OrderKind.MOVE or math.dist(world.order_point[scout].tolist(), place) > 1.0:
        hands.move(side, [scout], place)


def _place(side: OwnSide) -> Point:
    """Return the place that is looked at next: the enemy's start, then the bases nearest to it."""
    enemy = side.mind.enemy_start
    places = sorted(side.mind.bases, key=lambda p: (math.dist(p, enemy), p))
    return places[side.mind.scouted % PLACES % len(places)]


def _chosen(side: OwnSide) -> int:
    """Return the unit that scouts: early an Overlord or a worker, later the cheapest of the army."""
    if side.clock_s < WORKERS_UNTIL_S:
        overlords = side.of_type("Overlord")
        return overlords[0] if overlords else products.free_worker(side, side.mind.enemy_start)
    world = side.world
    idle = [s for s in side.army if int(world.order_kind[s]) == OrderKind.IDLE and world.target[s] == NOBODY]
    return min(idle, key=lambda s: (sum(world.unit_type(s).cost), s), default=NOBODY)


def _end(side: OwnSide) -> None:
    """Forget the scout; the next one leaves after a while."""
    side.mind.scout = 0
    side.mind.scouted = -(-side.mind.scouted // PLACES) * PLACES
    side.mind.next_scout = side.world.loop + round(BETWEEN_S * FASTER_LOOPS * side.level.tempo)
