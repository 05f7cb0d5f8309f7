"""Requests around a game: create, join, restart, leave, maps, ping and quit.

Each function takes the process and a request and gives the body of the response, or raises `Failure` with it.
Above: `requests.py`. Below: `game.py`, `mapfile.py`.
"""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

import numpy as np
from s2clientprotocol import sc2api_pb2 as sc

from simulator.api.clock import Clock
from simulator.api.game import Game, Setup
from simulator.api.game_info import GameInfo
from simulator.api.process import Failure, Playing, Process
from simulator.api.projection import size_problem
from simulator.catalog import CatalogError
from simulator.mapfile import SUFFIX, MapDataError, find_data, read_map
from simulator.maps import map_names

if TYPE_CHECKING:
    from simulator.maps import GameMap

_MAX_PLAYERS = 15


def ping(process: Process, _: sc.RequestPing) -> sc.ResponsePing:
    """Which game this is."""
    return sc.ResponsePing(
        game_version=process.game_version,
        data_version=process.data_version,
        data_build=process.base_build,
        base_build=process.base_build,
    )


def end(_: Process, __: sc.RequestQuit) -> sc.ResponseQuit:
    """Nothing to do: the server ends when it sees the state."""
    return sc.ResponseQuit()


def available_maps(_: Process, __: sc.RequestAvailableMaps) -> sc.ResponseAvailableMaps:
    """The shipped maps; there is no cache of battle.net."""
    return sc.ResponseAvailableMaps(local_map_paths=[name + SUFFIX for name in map_names()])


def save_map(process: Process, request: sc.RequestSaveMap) -> sc.ResponseSaveMap:
    """Keeps a map's bytes under its path, for this process."""
    if not request.map_data:
        raise Failure(sc.ResponseSaveMap(error=sc.ResponseSaveMap.InvalidMapData))
    process.maps[request.map_path] = request.map_data
    return sc.ResponseSaveMap()


# create ---------------------------------------------------------------------------------------------------------------


def create_game(process: Process, request: sc.RequestCreateGame) -> sc.ResponseCreateGame:
    """Chooses map and players; a game that is being played is dropped."""
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
    )
    process.playing = None
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


# join -----------------------------------------------------------------------------------------------------------------


def join_game(process: Process, request: sc.RequestJoinGame) -> sc.ResponseJoinGame:
    """Takes the first place of a participant, and starts the game."""
    setup = process.setup
    _check_join(request)
    if setup is None:
        raise _cannot_join(sc.ResponseJoinGame.MapDoesNotExist, "No game was created here")
    places = [number for number, asked in enumerate(setup.players, start=1) if asked.type == sc.Participant]
    if len(places) > 1:
        raise _cannot_join(
            sc.ResponseJoinGame.FeatureUnsupported, "Games of several participants are not supported yet"
        )
    if not places:
        raise _cannot_join(sc.ResponseJoinGame.GameFull, "No place for a participant is free")
    joined = _with_participant(setup, places[0], request)
    try:
        process.playing = _start(process, joined, places[0], request.options)
    except CatalogError as error:
        raise _cannot_join(sc.ResponseJoinGame.CannotOpenMap, f"{setup.path}: {error}") from error
    process.setup = joined
    return sc.ResponseJoinGame(player_id=places[0])


def _cannot_join(error: sc.ResponseJoinGame.Error.ValueType, details: str) -> Failure:
    return Failure(sc.ResponseJoinGame(error=error, error_details=details))


def _check_join(request: sc.RequestJoinGame) -> None:
    if request.HasField("server_ports"):
        raise _cannot_join(sc.ResponseJoinGame.FeatureUnsupported, "Games over several processes are not supported yet")
    if request.WhichOneof("participation") is None:
        raise _cannot_join(sc.ResponseJoinGame.MissingParticipation, "Say with which race to play")
    if request.HasField("observed_player_id"):
        raise _cannot_join(sc.ResponseJoinGame.FeatureUnsupported, "Observers are not supported yet")
    if not request.HasField("options"):
        raise _cannot_join(sc.ResponseJoinGame.MissingOptions, "Say what to observe")
    _check_options(request.options)


def _check_options(options: sc.InterfaceOptions) -> None:
    if problem := size_problem(options):
        raise _cannot_join(sc.ResponseJoinGame.OtherError, problem)


def _with_participant(setup: Setup, place: int, request: sc.RequestJoinGame) -> Setup:
    player = sc.PlayerSetup()
    player.CopyFrom(setup.players[place - 1])
    player.race = request.race
    if request.player_name:
        player.player_name = request.player_name
    others = setup.players
    return dataclasses.replace(setup, players=(*others[: place - 1], player, *others[place:]))


def _start(process: Process, setup: Setup, place: int, options: sc.InterfaceOptions, episode: int = 0) -> Playing:
    game = Game(setup, process.tables)
    kept = sc.InterfaceOptions()
    kept.CopyFrom(options)
    seat = game.sit(place, kept)
    clock = Clock(game) if setup.realtime else None
    return Playing(game, seat, GameInfo(game, seat), clock=clock, episode=episode)


def restart_game(process: Process, _: sc.RequestRestartGame) -> sc.ResponseRestartGame:
    """The same game from its start, with other random draws."""
    before, setup = process.table, process.setup
    if before.replay or setup is None:
        raise Failure(sc.ResponseRestartGame(error=sc.ResponseRestartGame.LaunchError, error_details="Not a game"))
    episode = before.episode + 1
    seed = int(np.random.SeedSequence([setup.seed, episode]).generate_state(1)[0])
    fresh = dataclasses.replace(setup, seed=seed)
    process.playing = _start(process, fresh, before.seat.player, before.seat.options, episode)
    return sc.ResponseRestartGame(need_hard_reset=False)


def leave_game(process: Process, _: sc.RequestLeaveGame) -> sc.ResponseLeaveGame:
    """Leaves the game; what was saved stays."""
    process.playing = process.setup = None
    return sc.ResponseLeaveGame()
