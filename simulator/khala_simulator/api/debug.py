"""Debug commands of clients: units made and killed, values set, a game ended.

Commands that the world does not support are accepted and do nothing, as in the game. Above: `game.py`. Below:
`commands.py`.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from s2clientprotocol import debug_pb2

from khala_simulator.abilities import commands
from khala_simulator.api.sight import API_NEUTRAL
from khala_simulator.world.players import GameResult

if TYPE_CHECKING:
    from khala_simulator.world.world import World

MAX_UNITS = 400
"""Units that one command makes at most: more would not fit on any map."""

_RESOURCES = 5000
_SWITCHES = {
    getattr(debug_pb2, name): name
    for name in ("show_map", "control_enemy", "food", "free", "god", "cooldown", "tech_tree", "fast_build")
}


def execute(world: World, player: int, command: debug_pb2.DebugCommand) -> None:
    """Carry out a debug command of a player."""
    match command.WhichOneof("command"):
        case "create_unit":
            _create(world, command.create_unit)
        case "kill_unit":
            commands.debug_kill(world, command.kill_unit.tag)
        case "unit_value":
            _set_value(world, command.unit_value)
        case "end_game":
            _end(world, player, command.end_game.end_result)
        case "game_state":
            _change_state(world, player, command.game_state)
        case "score":
            world.players[player].score.curriculum = command.score.score


def _create(world: World, order: debug_pb2.DebugCreateUnit) -> None:
    owner = 0 if order.owner == API_NEUTRAL else order.owner
    point = (order.pos.x, order.pos.y)
    known = order.unit_type in world.catalog.row_of_id
    if known and 0 <= owner < len(world.players) and all(map(math.isfinite, point)):
        x0, y0, x1, y1 = world.map.terrain.playable
        inside = (min(max(point[0], x0), x1), min(max(point[1], y0), y1))
        count = min(order.quantity or 1, MAX_UNITS, world.room)
        commands.debug_create(world, order.unit_type, owner, inside, count)


def _set_value(world: World, order: debug_pb2.DebugSetUnitValue) -> None:
    value = order.value
    if not math.isfinite(value):
        return
    match order.unit_value:
        case debug_pb2.DebugSetUnitValue.Life:
            commands.debug_set_value(world, order.unit_tag, life=value)
        case debug_pb2.DebugSetUnitValue.Shields:
            commands.debug_set_value(world, order.unit_tag, shields=max(0.0, value))
        case debug_pb2.DebugSetUnitValue.Energy:
            commands.debug_set_value(world, order.unit_tag, energy=max(0.0, value))


def _end(world: World, player: int, result: debug_pb2.DebugEndGame.EndResult.ValueType) -> None:
    if result == debug_pb2.DebugEndGame.Surrender:
        commands.surrender(world, player)
        return
    others = {p.id: GameResult.DEFEAT for p in world.players[1:]}
    world.end({**others, player: GameResult.VICTORY})


def _change_state(world: World, player: int, state: debug_pb2.DebugGameState.ValueType) -> None:
    purse = world.players[player]
    if state in {debug_pb2.all_resources, debug_pb2.minerals}:
        purse.minerals += _RESOURCES
    if state in {debug_pb2.all_resources, debug_pb2.gas}:
        purse.vespene += _RESOURCES
    if state in _SWITCHES:
        commands.debug_switch(world, player, _SWITCHES[state])
    if state == debug_pb2.upgrade:
        commands.debug_upgrade(world, player)
