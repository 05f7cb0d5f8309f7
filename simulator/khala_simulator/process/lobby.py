"""Requests around a game: create, leave, maps, ping and quit.

Each function takes the process and a request and returns the body of the response, or raises `Failure` with it. Above:
`requests.py`. Below: `game.py`, `map_file.py`.
"""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

from s2clientprotocol import sc2api_pb2 as sc

from khala_simulator.api.game import Setup
from khala_simulator.maps.game_map import map_names
from khala_simulator.maps.map_file import SUFFIX, MapDataError, find_data, read_map
from khala_simulator.process.process import Failure, Process

if TYPE_CHECKING:
    from khala_simulator.maps.game_map import GameMap

_MAX_PLAYERS = 15


def ping(process: Process, _: sc.RequestPing) -> sc.ResponsePing:
    """Return which game this is."""
    return sc.ResponsePing(
        game_version=process.game_version,
        data_version=process.data_version,
        data_build=process.base_build,
        base_build=process.base_build,
    )


def end(process: Process, _: sc.RequestQuit) -> sc.ResponseQuit:
    """Leave the game; the server ends when it sees the state."""
    process.play(None)
    return sc.ResponseQuit()


def available_maps(_: Process, __: sc.RequestAvailableMaps) -> sc.ResponseAvailableMaps:
    """Return the shipped maps; there is no cache of battle.net."""
    return sc.ResponseAvailableMaps(local_map_paths=[name + SUFFIX for name in map_names()])


def save_map(process: Process, request: sc.RequestSaveMap) -> sc.ResponseSaveMap:
    """Keep a map's bytes under its path, for this process."""
    if not request.map_data:
        raise Failure(sc.ResponseSaveMap(error=sc.ResponseSaveMap.InvalidMapData))
    process.maps[request.map_path] = request.map_data
    return sc.ResponseSaveMap()


# create ---------------------------------------------------------------------------------------------------------------


def create_game(process: Process, request: sc.RequestCreateGame) -> sc.ResponseCreateGame:
    """Choose map and players; drop a game in progress."""
    game_map, map_data = _find_map(process, request)
    players = _check_players(request, game_map)
    process.setup = Setup(
        game_map=game_map,
        map_data=map_data,
        path=request.local_map.map_path,
        players=players,
        seed=request.random_seed if request.HasField("random_seed") else process.fresh_seed(),
        disable_fog=request.disable_fog,
        realtime=request.realtime,
        observers=tuple(setup for setup in request.player_setup if setup.type == sc.Observer),
    )
    process.play(None)
    return sc.ResponseCreateGame()


def _cannot_create(error: sc.ResponseCreateGame.Error.ValueType, details: str) -> Failure:
    return Failure(sc.ResponseCreateGame(error=error, error_details=details))


def _find_map(process: Process, request: sc.RequestCreateGame) -> tuple[GameMap, bytes]:
    if request.battlenet_map_name:
        raise _cannot_create(sc.ResponseCreateGame.InvalidMapName, "Maps of battle.net are not available")
    path, data = request.local_map.map_path, request.local_map.map_data
    if not path and not data:
        raise _cannot_create(sc.ResponseCreateGame.MissingMap, "Name a map by its path or send its data")
    found = data or find_data(path, process.maps, process.data_dir)
    if found is None:
        known = ", ".join(name + SUFFIX for name in map_names())
        raise _cannot_create(sc.ResponseCreateGame.InvalidMapPath, f"No map {path}; shipped are {known}")
    try:
        return read_map(found, path), found
    except MapDataError as error:
        raise _cannot_create(sc.ResponseCreateGame.InvalidMapData, str(error)) from error


def _check_players(request: sc.RequestCreateGame, game_map: GameMap) -> tuple[sc.PlayerSetup, ...]:
    players = [setup for setup in request.player_setup if setup.type != sc.Observer]
    places = len(game_map.scenario.players) or _MAX_PLAYERS
    if not request.player_setup:
        raise _cannot_create(sc.ResponseCreateGame.MissingPlayerSetup, "Name the players")
    if len(players) > places:
        text = f"TooManyPlayers: {game_map.name} has {places} places, not {len(players)}"
        raise _cannot_create(sc.ResponseCreateGame.InvalidPlayerSetup, text)
    if any(not setup.HasField("type") for setup in request.player_setup):
        raise _cannot_create(sc.ResponseCreateGame.InvalidPlayerSetup, "Say of each player whether it is a Participant")
    return tuple(players)


async def leave_game(process: Process, _: sc.RequestLeaveGame) -> sc.ResponseLeaveGame:
    """Leave the game; saved maps stay."""
    peers = process.playing.peers if process.playing is not None else None
    try:
        if peers is not None:
            await peers.farewell()
    except asyncio.CancelledError:  # the client is gone; leaving is not undone
        if (task := asyncio.current_task()) is not None:
            task.uncancel()
    process.play(None)
    process.setup = None
    return sc.ResponseLeaveGame()
