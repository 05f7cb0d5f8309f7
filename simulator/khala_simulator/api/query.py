"""The answer to `query`: ways, places to build, and the abilities that units can use.

Above: `play.py`. Below: `abilities.py`, the world's ground.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from s2clientprotocol import error_pb2, query_pb2

from khala_simulator.abilities.protoss import warpgate
from khala_simulator.api.abilities import result_of, usable
from khala_simulator.combat import fog
from khala_simulator.economy import building_sites
from khala_simulator.movement import pathfinding, ways
from khala_simulator.tables.layers import Layer
from khala_simulator.world.world import NOBODY

if TYPE_CHECKING:
    from khala_simulator.api.seat import PlayerSeat
    from khala_simulator.world.world import World


def answer(seat: PlayerSeat, request: query_pb2.RequestQuery) -> query_pb2.ResponseQuery:
    """Answer each question, in their order."""
    return query_pb2.ResponseQuery(
        pathing=[query_pb2.ResponseQueryPathing(distance=_distance(seat, question)) for question in request.pathing],
        abilities=[
            _abilities(seat, question.unit_tag, ignore_cost=request.ignore_resource_requirements)
            for question in request.abilities
        ],
        placements=[query_pb2.ResponseQueryBuildingPlacement(result=_place(seat, q)) for q in request.placements],
    )


def _abilities(seat: PlayerSeat, tag: int, *, ignore_cost: bool) -> query_pb2.ResponseQueryAvailableAbilities:
    answer = query_pb2.ResponseQueryAvailableAbilities(unit_tag=tag)
    slot = _known(seat, tag)
    if slot != NOBODY:
        unit = seat.world.unit_type(slot)
        answer.unit_type_id = unit.id
        if seat.world.owner[slot] == seat.player:
            for ability in usable(seat.world, slot, free=ignore_cost):
                answer.abilities.add(ability_id=ability.id, requires_point=ability.requires_point)
    return answer


def _known(seat: PlayerSeat, tag: int) -> int:
    """Return the slot of a unit of which the player knows, or NOBODY."""
    slot = seat.world.slot_of(tag)
    hidden = slot != NOBODY and len(fog.unknown_to(seat.world, seat.player, np.array([slot])))
    return NOBODY if hidden else slot


# ways -----------------------------------------------------------------------------------------------------------------


def _distance(seat: PlayerSeat, question: query_pb2.RequestQueryPathing) -> float:
    """Return the length of the way on the ground, 0 where there is none; a flying unit's is the straight line.

    A way that starts inside a structure, as from the start location, counts from the nearest free place beside it.
    Structures that the player does not know of are no obstacle.
    """
    world, (ox, oy) = seat.world, seat.origin
    end = (question.end_pos.x + ox, question.end_pos.y + oy)
    start = (question.start_pos.x + ox, question.start_pos.y + oy)
    flying = False
    if question.WhichOneof("start") == "unit_tag":
        slot = _known(seat, question.unit_tag)
        if slot == NOBODY:
            return 0.0
        start = (float(world.pos[slot, 0]), float(world.pos[slot, 1]))
        flying = world.unit_type(slot).flying
    if not (_on_map(world, *start) and _on_map(world, *end)):
        return 0.0
    if flying:
        return math.dist(start, end)
    unknown = fog.unknown_to(world, seat.player, np.array(list(world.ground.blocked), dtype=np.int64))
    surface = pathfinding.surface(world.ground, Layer.WALK, tuple(unknown.tolist()))
    here, there = np.array(start), np.array(end)
    inside = world.map.terrain.walk[int(start[1]), int(start[0])] and not surface.flat[surface.cell(here)]
    beside = surface.nearest_free(here) if inside else None
    return ways.distance(surface, here if beside is None else surface.centre(np.array(beside)), there)


def _on_map(world: World, x: float, y: float) -> bool:
    width, height = world.map.terrain.size
    return 0 <= x < width and 0 <= y < height


# places ---------------------------------------------------------------------------------------------------------------


def _place(seat: PlayerSeat, question: query_pb2.RequestQueryBuildingPlacement) -> error_pb2.ActionResult.ValueType:
    """Return why the product of an ability can't be built, landed or warped in at a point, or success."""
    world = seat.world
    ability = world.catalog.ability_of_id.get(question.ability_id)
    unit = None if ability is None else building_sites.product(world, ability)
    if unit is None or ability is None:
        return error_pb2.NotSupported
    point = (question.target_pos.x + seat.origin[0], question.target_pos.y + seat.origin[1])
    if not (all(map(math.isfinite, point)) and _on_map(world, *point)):
        return error_pb2.CantBuildLocationInvalid
    rule = warpgate.refusal if ability.effect == "warp_in" else building_sites.refusal
    return result_of(rule(world, seat.player, unit, point))
