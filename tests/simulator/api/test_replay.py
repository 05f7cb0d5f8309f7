"""A replay is the game again: the same units, camera, selection, actions and pixels, at the same loops."""

import json
from typing import Any

import pytest
from s2clientprotocol import common_pb2, debug_pb2, raw_pb2, ui_pb2
from s2clientprotocol import sc2api_pb2 as sc

from khala_simulator.process import mpq
from khala_simulator.process.client import Client, ResponseError, command, interface
from khala_simulator.process.status import Status

LOOPS = 120


def play(client: Client) -> list[sc.ResponseObservation]:
    """Return a short game with actions of every kind and a debug command."""
    seen = [client.play(seed=3)]
    own = [unit.tag for unit in seen[0].observation.raw_data.units if unit.alliance == raw_pb2.Self]
    camera = sc.Action()
    camera.action_raw.camera_move.center_world_space.x, camera.action_raw.camera_move.center_world_space.y = 12, 14
    army = sc.Action(action_ui=ui_pb2.ActionUI(select_army=ui_pb2.ActionSelectArmy()))
    click = sc.Action()
    click.action_feature_layer.unit_command.ability_id = 3674
    click.action_feature_layer.unit_command.target_screen_coord.x = 120
    click.action_feature_layer.unit_command.target_screen_coord.y = 60
    script: dict[int, list[sc.Action]] = {1: [camera], 5: [army], 9: [click], 60: [command(18, own[:2])]}
    for loop in range(LOOPS):
        client.act(*script.get(loop, []))
        if loop == 30:
            unit = debug_pb2.DebugCreateUnit(unit_type=74, owner=2, pos=common_pb2.Point2D(x=20, y=16), quantity=1)
            client.debug(debug_pb2.DebugCommand(create_unit=unit))
        seen.append(client.step())
    return seen


def save(client: Client) -> bytes:
    return client.ask(save_replay=sc.RequestSaveReplay()).save_replay.data


def start(client: Client, data: bytes, **request: Any) -> sc.ResponseStartReplay:
    request = {"observed_player_id": 1, "options": interface(), **request}
    return client.ask(start_replay=sc.RequestStartReplay(replay_data=data, **request)).start_replay


@pytest.fixture(scope="module")
def played() -> tuple[list[sc.ResponseObservation], bytes]:
    client = Client()
    return play(client), save(client)


def test_a_replay_shows_what_the_player_saw(played: tuple[list[sc.ResponseObservation], bytes]) -> None:
    seen, data = played
    client = Client()
    start(client, data)
    assert client.session.status is Status.in_replay
    again = [client.observe(), *(client.step() for _ in range(LOOPS))]
    assert [o.observation for o in again] == [o.observation for o in seen]
    assert [list(o.actions) for o in again] == [list(o.actions) for o in seen]
    assert any(o.actions for o in again)


def test_a_replay_ends_where_it_was_saved(played: tuple[list[sc.ResponseObservation], bytes]) -> None:
    client = Client()
    start(client, played[1])
    response = client.ask(step=sc.RequestStep(count=1000))
    assert (response.status, response.step.simulation_loop) == (sc.ended, LOOPS)
    assert [result.result for result in client.observe().player_result] == [sc.Undecided, sc.Undecided]
    with pytest.raises(ResponseError, match="A replay of a replay cannot be saved"):
        save(client)


def test_a_replay_is_started_from_the_game_it_is_of() -> None:
    client = Client()
    client.play(options=interface(screen=0))
    client.step(20)
    data = save(client)
    start(client, data, options=sc.InterfaceOptions(raw=True))
    with pytest.raises(ResponseError, match="save_replay is not possible in state in_replay"):
        save(client)
    assert client.step(50).observation.game_loop == 20


def test_a_finished_game_has_its_results_in_the_replay() -> None:
    client = Client()
    client.play(options=interface(screen=0))
    client.step(10_000)
    results = client.observe().player_result
    loops = client.observe().observation.game_loop
    data = save(client)
    info = client_info(data)
    assert [player.player_result for player in info.player_info] == list(results)
    assert (info.game_duration_loops, info.map_name, info.base_build) == (loops, "2s3z", 75689)
    assert info.game_duration_seconds == pytest.approx(loops / 22.4)
    assert [p.player_info.type for p in info.player_info] == [sc.Participant, sc.Computer]
    start(client, data)
    client.step(10_000)
    assert client.observe().player_result == results


def test_a_replay_tells_who_played_and_how_busily(played: tuple[list[sc.ResponseObservation], bytes]) -> None:
    own, other = client_info(played[1]).player_info
    assert own.player_info.race_actual == common_pb2.Protoss
    assert own.player_apm == round(4 * 60 * 22.4 / LOOPS)  # the script of `play` has four actions
    assert other.player_apm == 0


def test_other_tools_find_the_version_in_a_replay(played: tuple[list[sc.ResponseObservation], bytes]) -> None:
    about = json.loads(mpq.member(played[1], "replay.gamemetadata.json") or b"")
    assert (about["Title"], about["BaseBuild"], about["GameVersion"]) == ("2s3z", "Base75689", "4.10.0.75689")
    assert about["DataVersion"] == "B89B5D6FA7CBF6452E721311BFBC6CB2"


def client_info(data: bytes) -> sc.ResponseReplayInfo:
    return Client().ask(replay_info=sc.RequestReplayInfo(replay_data=data)).replay_info


def test_a_viewer_may_have_a_larger_screen(played: tuple[list[sc.ResponseObservation], bytes]) -> None:
    client = Client()
    start(client, played[1], options=interface(screen=256))
    seen = client.step(12)
    recorded = played[0][12].observation
    assert seen.observation.feature_layer_data.renders.unit_type.size.x == 256
    assert seen.observation.raw_data.player.camera == recorded.raw_data.player.camera
    assert seen.observation.ui_data == recorded.ui_data
    assert [u.is_selected for u in seen.observation.raw_data.units] == [u.is_selected for u in recorded.raw_data.units]


@pytest.mark.parametrize(
    ("request_", "error", "details"),
    [
        ({}, "MissingReplay", "Name a replay by its path or send its data"),
        ({"replay_path": "none.SC2Replay"}, "InvalidReplayPath", "No replay none.SC2Replay"),
        ({"replay_data": b"MPQ"}, "InvalidReplayData", "The data is not a replay of this simulator"),
        ({"replay_data": b"Khala replay 3\nzz"}, "InvalidReplayData", "The replay is damaged: "),
    ],
)
def test_what_is_no_replay_says_so(request_: dict[str, Any], error: str, details: str) -> None:
    client = Client()
    options = interface(screen=0)
    started = client.ask(start_replay=sc.RequestStartReplay(**request_, options=options)).start_replay
    assert sc.ResponseStartReplay.Error.Name(started.error) == error
    assert started.error_details.startswith(details)
    looked = client.ask(replay_info=sc.RequestReplayInfo(**request_)).replay_info
    assert sc.ResponseReplayInfo.Error.Name(looked.error) == error
    assert client.session.status is Status.launched


@pytest.mark.parametrize("cut", [20, 60, 200, -3])
def test_a_damaged_replay_is_no_fault(played: tuple[list[sc.ResponseObservation], bytes], cut: int) -> None:
    error = start(Client(), played[1][:cut])
    assert error.error_details.startswith("The replay is damaged: ")


def test_only_somebody_who_was_there_can_be_watched(played: tuple[list[sc.ResponseObservation], bytes]) -> None:
    started = start(Client(), played[1], observed_player_id=3)
    assert sc.ResponseStartReplay.Error.Name(started.error) == "InvalidObservedPlayerId"
    assert started.error_details == "There is no player 3 in the replay"
