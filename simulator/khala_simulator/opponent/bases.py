"""Bases: where town halls can stand on a map, and which one a side takes next.

A base is a group of mineral fields and geysers; its town hall stands as near to all of them as the rules allow. Where
there is a start location, or a town hall from the beginning, it is there.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from khala_simulator.economy import building_sites, harvesting
from khala_simulator.movement import pathfinding, ways
from khala_simulator.movement.placement import snap
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.tables.layers import Layer
from khala_simulator.tables.mechanics import MECHANICS

if TYPE_CHECKING:
    from khala_simulator.opponent.enemy import Enemy
    from khala_simulator.opponent.side import OwnSide
    from khala_simulator.tables.records import UnitType
    from khala_simulator.world.casts import Point
    from khala_simulator.world.columns import Floats
    from khala_simulator.world.world import World

SAME_GROUP: Final = 8.5
"""Resources nearer to each other than this belong to one base."""
FEWEST_RESOURCES: Final = 5
"""Fewer resources in one place are no base, such as the fields that block a way."""
REACH: Final = 10
"""How far from the middle of its resources a town hall is looked for."""
APART: Final = 5.5
"""No town hall may stand nearer to a resource; the rules judge the rest."""
TAKEN: Final = 6.0
DANGER: Final = 14.0


def find(world: World, player: int, hall: UnitType) -> tuple[Point, ...]:
    """Return where town halls can stand, the nearest to a player's start by the way on the ground first."""
    start = world.players[player].start or (0.0, 0.0)
    live = world.live
    halls = live[harvesting.kinds(world.catalog)[2][world.type[live]]]
    starts = [*world.map.scenario.start_locations, *((x, y) for x, y in world.pos[halls].tolist())]
    found = [_site(world, player, hall, group, starts) for group in _groups(world)]
    places = [place for place in found if place is not None]
    return tuple(sorted(places, key=lambda place: (way(world, start, place), place)))


def way(world: World, start: Point, goal: Point) -> float:
    """Return the length of the way on the ground between two places, structures on them ignored."""
    surface = pathfinding.surface(world.ground, Layer.WALK)
    ends = [surface.nearest_free(np.array(place)) for place in (start, goal)]
    if ends[0] is None or ends[1] is None:
        return math.dist(start, goal)
    if ends[0] == ends[1]:
        return 0.0
    a, b = surface.centre(np.array(ends))
    return ways.distance(surface, a, b) or 1000.0 + math.dist(start, goal)


def resources(world: World) -> tuple[Point, ...]:
    """Return where mineral fields and geysers are."""
    slots = [slot for slot in world.live.tolist() if world.unit_type(slot).resource and not world.owner[slot]]
    return tuple((x, y) for x, y in world.pos[slots].tolist())


def _groups(world: World) -> list[Floats]:
    """Return the places of the resources of each base."""
    places = np.array(resources(world)).reshape(-1, 2)
    groups: list[Floats] = []
    rest = list(range(len(places)))
    while rest:
        group = [rest.pop(0)]
        for at in group:
            near = [o for o in rest if math.dist(places[at], places[o]) < SAME_GROUP]
            group += near
            rest = [o for o in rest if o not in near]
        if len(group) >= FEWEST_RESOURCES:
            groups.append(places[sorted(group)])
    return groups


def _site(world: World, player: int, hall: UnitType, group: Floats, starts: list[Point]) -> Point | None:
    """Return where the town hall of a group of resources stands."""
    middle = group.mean(axis=0)
    start = next((place for place in starts if math.dist(place, middle) < REACH), None)
    if start is not None:
        return start
    steps = range(-REACH, REACH + 1)
    at = np.array([snap((float(middle[0]) + dx, float(middle[1]) + dy), (5, 5)) for dx in steps for dy in steps])
    away = np.hypot(at[:, None, 0] - group[:, 0], at[:, None, 1] - group[:, 1])
    at, away = at[away.min(axis=1) >= APART], away[away.min(axis=1) >= APART].sum(axis=1)
    order = np.lexsort((at[:, 0], at[:, 1], np.round(away, 6)))
    places = ((float(x), float(y)) for x, y in at[order].tolist())
    return next((p for p in places if building_sites.refusal(world, player, hall, p) is ActionResult.SUCCESS), None)


# the next one ---------------------------------------------------------------------------------------------------------


def next_place(side: OwnSide, enemy: Enemy) -> Point | None:
    """Return the nearest free base that still has minerals; on the enemy's half as a last resort."""
    world = side.world
    halls = [s for s in side.slots.tolist() if harvesting.kinds(world.catalog)[2][world.type[s]]]
    foes = enemy.places()
    places = [place for place in side.mind.bases if fields_near(world, place)]
    if any(map(side.is_ours, places)):
        places = [place for place in places if side.is_ours(place)]
    for place in places:
        free = all(math.dist(side.place(hall), place) > TAKEN for hall in halls)
        safe = not len(foes) or float(np.hypot(foes[:, 0] - place[0], foes[:, 1] - place[1]).min()) > DANGER
        if free and safe:
            return place
    return None


def fields_near(world: World, place: Point) -> list[int]:
    """Return the mineral fields around a place."""
    live = world.live
    fields = live[harvesting.kinds(world.catalog)[1][world.type[live]]]
    offset = world.pos[fields] - np.array(place)
    near: list[int] = fields[offset[:, 0] ** 2 + offset[:, 1] ** 2 <= MECHANICS.harvest_search**2].tolist()
    return near


def front(side: OwnSide) -> Point:
    """Return the own town hall that is nearest to the enemy's start, or the own start without any."""
    halls = [side.place(hall) for hall in side.halls]
    return min(halls, key=lambda p: (math.dist(p, side.mind.enemy_start), p), default=side.mind.bases[0])
