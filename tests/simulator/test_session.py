"""Bytes in, bytes out: the envelope, the walk through the states, and the sentences for what is wrong."""

from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from s2clientprotocol import common_pb2, debug_pb2, query_pb2
from s2clientprotocol import sc2api_pb2 as sc

from khala_simulator.process.client import Client, ResponseError, command, interface
from khala_simulator.process.install import install
from khala_simulator.process.session import Session
from khala_simulator.process.status import Status

PARTICIPANT = sc.PlayerSetup(type=sc.Participant)
COMPUTER = sc.PlayerSetup(type=sc.Computer, race=common_pb2.Zerg, difficulty=sc.VeryHard)


def answer(session: Session, request: sc.Request) -> sc.Response:
    return sc.Response.FromString(session.handle(request.SerializeToString()))


@pytest.fixture
def client() -> Client:
    return Client()


@pytest.fixture
def playing() -> Client:
    client = Client()
    client.play(options=interface(screen=0))
    return client


# the envelope ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("number", [1, 0, 999999999])
def test_a_response_has_the_id_of_its_request(client: Client, number: int) -> None:
    response = answer(client.session, sc.Request(ping=sc.RequestPing(), id=number))
    assert response.HasField("id")
    assert response.id == number


def test_a_request_without_an_id_gets_none_back(client: Client) -> None:
    assert not client.ask(ping=sc.RequestPing()).HasField("id")


def test_ping_tells_the_build(client: Client) -> None:
    ping = client.ask(ping=sc.RequestPing()).ping
    assert (ping.game_version, ping.data_build, ping.base_build) == ("4.10.0.75689", 75689, 75689)
    assert ping.data_version == "B89B5D6FA7CBF6452E721311BFBC6CB2"


def test_ping_echoes_the_data_version_of_the_command_line() -> None:
    client = Client(Session(".", 75689, "b89b"))
    assert client.ask(ping=sc.RequestPing()).ping.data_version == "b89b"


@pytest.mark.parametrize(
    ("data", "error"),
    [
        (b"\xff\xff\xff", "The request is not a protobuf message of the SC2 API"),
        (b"hello", "The request is not a protobuf message of the SC2 API"),
        (b"", "The request is empty or of an unknown kind"),
        (sc.Request(id=5).SerializeToString(), "The request is empty or of an unknown kind"),
    ],
)
def test_what_is_no_request_is_a_usage_error(client: Client, data: bytes, error: str) -> None:
    response = sc.Response.FromString(client.session.handle(data))
    assert list(response.error) == [error]
    assert response.status == sc.launched
    assert response.WhichOneof("response") is None


@given(st.binary(max_size=200))
def test_no_bytes_break_the_session(data: bytes) -> None:
    session = Session(".")
    response = sc.Response.FromString(session.handle(data))
    assert response.HasField("status")


def test_a_usage_error_changes_nothing(playing: Client) -> None:
    with pytest.raises(ResponseError):
        playing.ask(join_game=sc.RequestJoinGame())
    assert playing.session.status is Status.in_game
    assert playing.step().observation.game_loop == 1


@pytest.mark.parametrize(
    "request_",
    [
        {"query": query_pb2.RequestQuery()},
        {"debug": sc.RequestDebug()},
        {"action": sc.RequestAction()},
        {"map_command": sc.RequestMapCommand(trigger_cmd="x")},
        {"obs_action": sc.RequestObserverAction()},
        {"leave_game": sc.RequestLeaveGame()},
        {"restart_game": sc.RequestRestartGame()},
        {"quit": sc.RequestQuit()},
    ],
    ids=lambda r: next(iter(r)),
)
def test_the_typed_body_is_there_even_if_it_is_empty(playing: Client, request_: dict[str, Any]) -> None:
    (kind,) = request_
    assert playing.ask(**request_).HasField(kind)  # type: ignore[arg-type]  # kind is a field's name


# the walk -------------------------------------------------------------------------------------------------------------


def test_a_game_walks_through_its_states(client: Client) -> None:
    seen = []

    def then(**request: Any) -> None:
        seen.append(Status(client.ask(**request).status).name)

    then(ping=sc.RequestPing())
    client.create("2s3z")
    then(ping=sc.RequestPing())
    then(join_game=sc.RequestJoinGame(race=common_pb2.Protoss, options=interface(screen=0)))
    then(step=sc.RequestStep(count=8))
    then(restart_game=sc.RequestRestartGame())
    then(step=sc.RequestStep(count=1440))
    then(observation=sc.RequestObservation())
    then(restart_game=sc.RequestRestartGame())
    then(leave_game=sc.RequestLeaveGame())
    then(quit=sc.RequestQuit())
    assert seen == ["launched", "init_game", "in_game", "in_game", "in_game", "ended", "ended", "in_game", "launched",
                    "quit"]  # fmt: skip


@pytest.mark.parametrize("state", ["launched", "init_game", "in_game", "ended"])
def test_a_game_is_created_in_every_state_of_a_process(client: Client, state: str) -> None:
    if state != "launched":
        client.create("2s3z")
    if state in {"in_game", "ended"}:
        client.play(options=interface(screen=0))
    if state == "ended":
        client.step(1440)
    assert client.session.status.name == state
    client.create("3s5z")
    assert client.session.status is Status.init_game


def test_the_step_that_ends_the_game_says_so_and_the_result_stays(playing: Client) -> None:
    response = playing.ask(step=sc.RequestStep(count=10_000))
    assert response.status == sc.ended
    assert response.step.simulation_loop < 10_000
    results = [playing.observe().player_result for _ in range(2)]
    assert {r.player_id for r in results[0]} == {1, 2}
    assert results[0] == results[1]


@pytest.mark.parametrize("request_", [{"step": sc.RequestStep()}, {"action": sc.RequestAction()}])
def test_after_the_end_the_sentence_that_clients_know_is_said(playing: Client, request_: dict[str, Any]) -> None:
    playing.step(10_000)
    with pytest.raises(ResponseError) as caught:
        playing.ask(**request_)
    assert caught.value.args == ("Game has already ended",)


def test_a_step_without_a_count_is_one_loop(playing: Client) -> None:
    assert playing.ask(step=sc.RequestStep()).step.simulation_loop == 1
    assert playing.ask(step=sc.RequestStep(count=0)).step.simulation_loop == 2


def test_a_melee_game_begins_with_a_camera_move_of_its_own(client: Client) -> None:
    client.play("Melee/Flat64")
    first = client.observe()
    seen = [client.step() for _ in range(3)]
    assert [len(o.actions) for o in (first, *seen)] == [0, 0, 1, 0]
    (move,) = seen[1].actions
    assert move.game_loop == 1
    assert move.HasField("action_feature_layer")
    point, camera = move.action_raw.camera_move.center_world_space, first.observation.raw_data.player.camera
    assert (point.x, point.y) == (camera.x, camera.y)
    data = client.ask(save_replay=sc.RequestSaveReplay()).save_replay.data
    client.ask(start_replay=sc.RequestStartReplay(replay_data=data, observed_player_id=1, options=interface(screen=0)))
    assert [len(client.step().actions) for _ in range(3)] == [0, 1, 0]


# requests that fail ---------------------------------------------------------------------------------------------------

CreateError, JoinError = sc.ResponseCreateGame.Error, sc.ResponseJoinGame.Error


def at(path: str = "", data: bytes = b"") -> sc.LocalMap:
    return sc.LocalMap(map_path=path, map_data=data)


@pytest.mark.parametrize(
    ("request_", "error", "details"),
    [
        ({}, "MissingMap", "Name a map by its path or send its data"),
        ({"battlenet_map_name": "Ladder"}, "InvalidMapName", "Maps of battle.net are not available"),
        ({"local_map": at("nowhere.SC2Map")}, "InvalidMapPath", "No map nowhere.SC2Map; shipped are "),
        ({"local_map": at("x.SC2Map", b"zzz")}, "InvalidMapData",
         "x.SC2Map holds neither a map of the simulator nor a StarCraft II archive"),
        ({"local_map": at("x.SC2Map", b"MPQ\x1b")}, "InvalidMapData",
         "x.SC2Map is an archive that the simulator cannot read: the archive is damaged: "),
        ({"local_map": at("2s3z")}, "MissingPlayerSetup", "Name the players"),
        ({"local_map": at("2s3z"), "player_setup": [PARTICIPANT] * 3}, "InvalidPlayerSetup",
         "TooManyPlayers: 2s3z has 2 places, not 3"),
        ({"local_map": at("2s3z"), "player_setup": [sc.PlayerSetup()]}, "InvalidPlayerSetup",
         "Say of each player whether it is a Participant"),
    ],
)  # fmt: skip
def test_a_game_that_cannot_be_created(client: Client, request_: dict[str, Any], error: str, details: str) -> None:
    response = client.ask(create_game=sc.RequestCreateGame(**request_))
    assert CreateError.Name(response.create_game.error) == error
    assert response.create_game.error_details.startswith(details)
    assert response.status == sc.launched


def _wide(width: float) -> sc.InterfaceOptions:
    size = common_pb2.Size2DI(x=128, y=128)
    return sc.InterfaceOptions(render=sc.SpatialCameraSetup(resolution=size, minimap_resolution=size, width=width))


@pytest.mark.parametrize(
    ("request_", "error", "details"),
    [
        ({"options": interface()}, "MissingParticipation", "Name the race to play, or the player to observe"),
        ({"race": 1}, "MissingOptions", "Say what to observe"),
        ({"observed_player_id": 1, "options": interface()}, "GameFull", "No place for an observer is free"),
        ({"observed_player_id": 3, "options": interface()}, "InvalidObservedPlayerId", "There is no player 3"),
        ({"race": 1, "options": sc.InterfaceOptions(render=sc.SpatialCameraSetup())}, "OtherError",
         "Rendered images of 0 x 0 pixels; between 1 and 4096 are possible"),
        ({"race": 1, "options": sc.InterfaceOptions(feature_layer=sc.SpatialCameraSetup())}, "OtherError",
         "Feature layers of 0 x 0 pixels; between 1 and 4096 are possible"),
        ({"race": 1, "options": _wide(-3.0)}, "OtherError",
         "Rendered images of -3 world units; between 0.5 and 1000 are possible in this size"),
        ({"race": 1, "options": _wide(float("nan"))}, "OtherError",
         "Rendered images of nan world units; between 0.5 and 1000 are possible in this size"),
    ],
)  # fmt: skip
def test_a_game_that_cannot_be_joined(client: Client, request_: dict[str, Any], error: str, details: str) -> None:
    client.create("2s3z")
    response = client.ask(join_game=sc.RequestJoinGame(**request_))
    assert JoinError.Name(response.join_game.error) == error
    assert response.join_game.error_details == details
    assert response.status == sc.init_game


def test_two_participants_need_two_processes(client: Client) -> None:
    client.ask(create_game=sc.RequestCreateGame(local_map=at("2s3z"), player_setup=[PARTICIPANT] * 2))
    joined = client.ask(join_game=sc.RequestJoinGame(race=common_pb2.Protoss, options=interface())).join_game
    assert joined.error == JoinError.MissingPorts
    assert joined.error_details == "1 more have to join, each with its own process: name the ports on which they meet"


def test_joining_where_no_game_was_created_is_a_usage_error(client: Client) -> None:
    with pytest.raises(ResponseError, match="join_game is not possible in state launched, only in: init_game"):
        client.ask(join_game=sc.RequestJoinGame())


def test_a_failed_creation_leaves_the_game_alone(playing: Client) -> None:
    playing.step(5)
    playing.ask(create_game=sc.RequestCreateGame())
    assert playing.session.status is Status.in_game
    assert playing.observe().observation.game_loop == 5


@pytest.mark.parametrize(
    ("path", "damage", "period_s"),  # of a Stalker
    [("SMAC_Maps/2s3z", 10, 1.44), ("llm_smac/2s3z", 10, 1.44), ("pvz_task2_level1", 10, 1.44), ("Simple64", 13, 1.87)],
)
def test_the_tables_that_clients_read_are_those_of_the_map(
    client: Client, path: str, damage: float, period_s: float
) -> None:
    client.play(path, interface(screen=0))
    units = client.ask(data=sc.RequestData(unit_type_id=True)).data.units
    (weapon,) = next(unit for unit in units if unit.name == "Stalker").weapons
    assert (weapon.damage, weapon.speed) == pytest.approx((damage, period_s))


# joining --------------------------------------------------------------------------------------------------------------


def test_players_are_numbered_as_they_were_named(client: Client) -> None:
    client.ask(create_game=sc.RequestCreateGame(local_map=at("2s3z"), player_setup=[COMPUTER, PARTICIPANT]))
    joined = client.ask(join_game=sc.RequestJoinGame(race=common_pb2.Protoss, options=interface(screen=0)))
    assert joined.join_game.player_id == 2
    assert client.observe().observation.player_common.player_id == 2
    assert {u.owner for u in client.observe().observation.raw_data.units if u.alliance == 1} == {2}


def test_options_are_given_back_as_they_came(client: Client) -> None:
    options = interface(screen=84, minimap=64)
    options.show_cloaked = True
    options.feature_layer.allow_cheating_layers = True
    client.play(options=options)
    assert client.ask(game_info=sc.RequestGameInfo()).game_info.options == options


def test_game_info_tells_the_own_race_and_hides_the_other_one(playing: Client) -> None:
    info = playing.ask(game_info=sc.RequestGameInfo()).game_info
    own, other = info.player_info
    assert (own.type, own.race_requested, own.race_actual) == (sc.Participant, common_pb2.Protoss, common_pb2.Protoss)
    assert (other.type, other.difficulty, other.ai_build) == (sc.Computer, sc.VeryHard, sc.RandomBuild)
    assert not other.HasField("race_actual")
    assert (info.map_name, info.local_map_path) == ("2s3z", "2s3z.SC2Map")


@pytest.mark.parametrize(("grid", "bits"), [("pathing_grid", 1), ("placement_grid", 1), ("terrain_height", 8)])
def test_grids_of_the_map_are_exactly_as_long_as_they_say(playing: Client, grid: str, bits: int) -> None:
    start = playing.ask(game_info=sc.RequestGameInfo()).game_info.start_raw
    image = getattr(start, grid)
    assert (image.size.x, image.size.y) == (start.map_size.x, start.map_size.y) == (32, 32)
    assert image.bits_per_pixel == bits
    assert len(image.data) * 8 == 32 * 32 * bits


def test_a_map_that_the_client_saved_is_played_under_its_path(client: Client) -> None:
    shipped = b"# A map of Khala's simulator\nllm_smac/3s_vs_5z\n"
    client.ask(save_map=sc.RequestSaveMap(map_path="mine.SC2Map", map_data=shipped))
    client.play("mine.SC2Map", interface(screen=0))
    assert len(client.observe().observation.raw_data.units) == 8


def test_the_shipped_maps_are_listed(client: Client) -> None:
    maps = client.ask(available_maps=sc.RequestAvailableMaps()).available_maps.local_map_paths
    assert "llm_smac/2s3z.SC2Map" in maps


# seeds ----------------------------------------------------------------------------------------------------------------


def episode(client: Client) -> list[bytes]:
    return [client.step(16).SerializeToString() for _ in range(12)]


def test_the_same_seed_gives_the_same_observations() -> None:
    runs = []
    for _ in range(2):
        client = Client()
        client.play("3s5z", seed=7)
        runs.append(episode(client))
    assert runs[0] == runs[1]


def test_a_restart_draws_anew_and_the_same_way_in_every_process() -> None:
    runs = []
    for _ in range(2):
        client = Client()
        client.play("3s5z", seed=7)
        first = episode(client)
        client.ask(restart_game=sc.RequestRestartGame())
        assert client.observe().observation.game_loop == 0
        runs.append((first, episode(client)))
    assert runs[0] == runs[1]
    assert runs[0][0] != runs[0][1]


def test_without_a_seed_games_differ() -> None:
    runs = []
    for _ in range(2):
        client = Client()
        client.play("3s5z", seed=None)
        runs.append(episode(client))
    assert runs[0] != runs[1]


# bits and pieces ------------------------------------------------------------------------------------------------------


def quick(client: Client, kind: str) -> sc.Response:
    return client.ask(**{kind: getattr(sc, f"RequestQuick{kind.removeprefix('quick_').title()}")()})


def digest(client: Client) -> str:
    return client.session._process.table.game.world.digest()


def test_a_quick_load_goes_back_to_the_quick_save_any_number_of_times(playing: Client) -> None:
    def fight() -> list[sc.ResponseObservation]:
        units = playing.observe().observation.raw_data.units
        playing.act(command(23, [unit.tag for unit in units if unit.alliance == 1], point=(16, 16)))
        return [playing.step(16) for _ in range(10)]

    playing.step(40)
    saved = digest(playing)
    quick(playing, "quick_save")
    first = fight()
    assert digest(playing) != saved
    for _ in range(2):
        assert quick(playing, "quick_load").status == sc.in_game
        assert digest(playing) == saved
        assert fight() == first


def test_a_game_that_is_over_can_be_loaded_again_and_leaves_a_right_replay(playing: Client) -> None:
    playing.step(8)
    quick(playing, "quick_save")
    playing.step(10_000)
    assert quick(playing, "quick_load").status == sc.in_game
    playing.debug(debug_pb2.DebugCommand(end_game=debug_pb2.DebugEndGame(end_result=debug_pb2.DebugEndGame.Surrender)))
    results = playing.step(8).player_result
    assert [result.result for result in results] == [sc.Defeat, sc.Victory]
    data = playing.ask(save_replay=sc.RequestSaveReplay()).save_replay.data
    playing.ask(start_replay=sc.RequestStartReplay(replay_data=data, observed_player_id=1, options=interface(screen=0)))
    assert playing.step(100).player_result == results


def test_what_was_not_saved_is_not_loaded(playing: Client) -> None:
    with pytest.raises(ResponseError, match=r"^quick_load needs a quick_save of the same game$"):
        quick(playing, "quick_load")
    quick(playing, "quick_save")
    playing.play(options=interface(screen=0))
    with pytest.raises(ResponseError, match=r"^quick_load needs a quick_save of the same game$"):
        quick(playing, "quick_load")


def test_a_fault_of_ours_is_told_and_does_not_end_the_process(
    playing: Client, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fail(*_: object) -> None:
        raise ZeroDivisionError("oh")

    monkeypatch.setattr("khala_simulator.api.game.advance", fail)
    with pytest.raises(ResponseError, match=r"^The simulator failed in step: ZeroDivisionError: oh$"):
        playing.step()
    assert "Traceback" in capsys.readouterr().err
    assert playing.observe().observation.game_loop == 0


@pytest.mark.parametrize("path", ["x" * 300, "\0", "/", "..", "**", "Maps"])
def test_a_path_that_cannot_be_one_is_an_invalid_path(client: Client, path: str) -> None:
    create = client.ask(create_game=sc.RequestCreateGame(local_map=at(path), player_setup=[PARTICIPANT])).create_game
    assert create.error == CreateError.InvalidMapPath


def test_a_map_is_found_in_the_install_by_path_and_by_name(tmp_path: Path) -> None:
    root = install(tmp_path)
    (root / "Maps/Melee/Own.SC2Map").write_bytes(HEAD + DUEL + SPAWN % b"Zealot")
    for path in ("Melee/Own.SC2Map", "Own.SC2Map", str(root / "Maps/Melee/Own.SC2Map")):
        client = Client(Session(root))
        client.play(path, interface(screen=0))
        assert [unit.unit_type for unit in client.observe().observation.raw_data.units] == [73]


HEAD = b"# A map of Khala's simulator\n"
SPAWN = b"triggers: [{name: a, when: [start], do: [{create: {player: 1, unit: %s, at: [9, 9]}}]}]\n"
DUEL = b"""name: x
family: y
title: z
terrain: agria_open
players: {1: {race: protoss, control: agent}, 2: {race: protoss, control: computer}}
"""
WHOLE = b"name: x\nfamily: y\ntitle: z\nterrain: %s\nplayers: {1: {race: zerg, control: agent}}\n"


@pytest.mark.parametrize(
    ("text", "details"),
    [
        (b"name: x\nfamily: y\ntitle: z\nterrain: agria_open\nplayers: 5\n", "own.SC2Map:6: players: "),
        (b"\0\nx: 1\n", "own.SC2Map:2: the file: it has characters that no text has"),
        (b"\xff\nx: 1\n", "own.SC2Map:2: the file: it is no UTF-8 text"),
        (b"x: 2020-99-99\ny: 1\n", "own.SC2Map:2: x: 2020-99-99 is no timestamp; put it in quotes if it is a text"),
        (b"x: [\ny: 1\n", "own.SC2Map:"),
        (WHOLE % b"moon", "own.SC2Map: terrain: no terrain 'moon' is shipped"),
        (b"nothing\n", "no map 'nothing'; shipped are "),
    ],
)
def test_a_map_of_a_user_with_a_mistake_says_where(client: Client, text: bytes, details: str) -> None:
    request = sc.RequestCreateGame(local_map=at("own.SC2Map", HEAD + text), player_setup=[PARTICIPANT])
    create = client.ask(create_game=request).create_game
    assert create.error == CreateError.InvalidMapData
    assert create.error_details.startswith(details)


def test_a_map_with_a_unit_that_is_not_there_says_so(client: Client) -> None:
    game_map = at("own.SC2Map", HEAD + WHOLE % b"agria_open" + SPAWN % b"Foo")
    create = client.ask(create_game=sc.RequestCreateGame(local_map=game_map, player_setup=[PARTICIPANT])).create_game
    assert create.error == CreateError.InvalidMapData
    assert "Foo" in create.error_details


def test_an_archive_of_the_game_is_known_by_its_name(client: Client) -> None:
    archive = at("llm_smac/3s_vs_5z.SC2Map", b"MPQ\x1b")
    client.ask(create_game=sc.RequestCreateGame(local_map=archive, player_setup=[PARTICIPANT, COMPUTER]))
    client.ask(join_game=sc.RequestJoinGame(race=common_pb2.Protoss, options=interface(screen=0)))
    assert len(client.observe().observation.raw_data.units) == 8
