"""Requests about replays: start one, look into one.

Above: `requests.py`. Below: `replay.py`, `game.py`.
"""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import TYPE_CHECKING

from s2clientprotocol import sc2api_pb2 as sc

from khala_simulator.api.game_info import RACES, GameInfo
from khala_simulator.api.projection import size_problem
from khala_simulator.api.viewer import Viewer
from khala_simulator.maps.map_file import read_file
from khala_simulator.process.clock import LOOPS_PER_SECOND, RealtimeClock
from khala_simulator.process.process import Failure, Playing
from khala_simulator.process.replay import Replay, ReplayError, rerun

if TYPE_CHECKING:
    from khala_simulator.process.process import Process

StartError, InfoError = sc.ResponseStartReplay.Error, sc.ResponseReplayInfo.Error


class _Unreadable(Exception):
    """A request without a usable replay; `name` is that of an error in both enums."""

    def __init__(self, name: str, details: str) -> None:
        super().__init__(details)
        self.name = name


def start_replay(process: Process, request: sc.RequestStartReplay) -> sc.ResponseStartReplay:
    """Simulate a game again, as one of its players sees it (camera, selection, actions) or, with 0, all of it.

    The players have their own interfaces, because the meaning of a click depends on the size of the screen; the viewer
    gets reports of clicks in its own pixels.
    """
    try:
        replay = _read(process, request)
    except _Unreadable as error:
        raise _cannot_start(error.name, str(error)) from error
    if not request.HasField("options"):
        raise _cannot_start("MissingOptions", "Say what to observe")
    if problem := size_problem(request.options):
        raise _cannot_start("LaunchError", problem)
    player = request.observed_player_id
    if player > len(replay.setup.players):
        raise _cannot_start("InvalidObservedPlayerId", f"There is no player {player} in the replay")
    game = rerun(replay, process.tables)
    options = sc.InterfaceOptions()
    options.CopyFrom(request.options)
    seat = Viewer(game, player, options)
    seat.sees_all = request.disable_fog and not replay.setup.disable_fog
    process.setup = None
    clock = RealtimeClock(game) if request.realtime else None
    process.play(Playing(game, seat, GameInfo(game, seat), replay=True, clock=clock))
    return sc.ResponseStartReplay()


def _cannot_start(name: str, details: str) -> Failure:
    return Failure(sc.ResponseStartReplay(error=StartError.Value(name), error_details=details))


def replay_info(process: Process, request: sc.RequestReplayInfo) -> sc.ResponseReplayInfo:
    """Return the map, players and length of a replay."""
    try:
        replay = _read(process, request)
    except _Unreadable as error:
        body = sc.ResponseReplayInfo(error=InfoError.Value(error.name), error_details=str(error))
        raise Failure(body) from error
    info = sc.ResponseReplayInfo(
        map_name=replay.setup.game_map.name,
        local_map_path=replay.setup.path,
        game_duration_loops=replay.loops,
        game_duration_seconds=replay.loops / LOOPS_PER_SECOND,
        game_version=process.game_version,
        data_version=process.data_version,
        data_build=process.base_build,
        base_build=process.base_build,
    )
    for number, setup in enumerate(replay.setup.players, start=1):
        extra = info.player_info.add(player_mmr=0, player_apm=_actions_per_minute(replay, number))
        player = extra.player_info
        player.player_id = number
        player.type = setup.type
        player.race_requested = setup.race
        player.player_name = setup.player_name
        if (race := RACES.get(replay.races.get(number, ""))) is not None:
            player.race_actual = race  # type: ignore[assignment]  # numbers of the API's own enum
        if number not in replay.results:
            continue
        extra.player_result.player_id = number
        extra.player_result.result = sc.Result.Value(sc.Result.Name(replay.results[number]))  # type: ignore[arg-type]  # same numbers
    return info


def _actions_per_minute(replay: Replay, player: int) -> int:
    actions = sum(entry.player == player and isinstance(entry.act, sc.Action) for entry in replay.log)
    return round(actions * 60 * LOOPS_PER_SECOND / max(replay.loops, 1))


def _places(process: Process, path: str) -> list[Path]:
    """Return where a replay may be: in the install, or where the game itself looks on Linux."""
    return [process.data_dir / "Replays" / path, Path.home() / "Documents/StarCraft II/Replays" / path]


def _read(process: Process, request: sc.RequestStartReplay | sc.RequestReplayInfo) -> Replay:
    kind = request.WhichOneof("replay")
    if kind is None:
        raise _Unreadable("MissingReplay", "Name a replay by its path or send its data")
    data = request.replay_data
    if kind == "replay_path":
        for place in _places(process, request.replay_path):
            with contextlib.suppress(OSError, ValueError):  # not there, or no possible name at all
                data = read_file(place)
                break
        else:
            raise _Unreadable("InvalidReplayPath", f"No replay {request.replay_path}")
    try:
        return Replay.decode(data)
    except ReplayError as error:
        raise _Unreadable("InvalidReplayData", str(error)) from error
