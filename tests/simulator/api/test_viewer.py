"""Observers of games and viewers of replays: what they see, where they look, and that they change nothing."""

from typing import Any

import pytest
from s2clientprotocol import common_pb2, debug_pb2, error_pb2, raw_pb2
from s2clientprotocol import sc2api_pb2 as sc

from khala_simulator.process.client import Client, command, interface

FOGGY = b"""# A map of Khala's simulator
name: foggy
family: test
title: Two sides that do not see each other, and a cloaked unit
terrain: agria_open
players: {1: {race: protoss, control: computer}, 2: {race: terran, control: computer}}
triggers:
  - name: spawn
    when: [start]
    do:
      - create: {player: 1, unit: Zealot, at: [5, 5]}
      - create: {player: 1, unit: DarkTemplar, at: [3, 5]}
      - create: {player: 2, unit: Marine, at: [28, 28]}
  - name: end
    when: [{at_loop: 64}]
    do:
      - result: {1: victory, 2: defeat}
"""
COMPUTER, PARTICIPANT, OBSERVER = (sc.PlayerSetup(type=kind) for kind in (sc.Computer, sc.Participant, sc.Observer))
ZEALOT, DARK_TEMPLAR, MARINE = 73, 76, 48


def create(client: Client, *players: sc.PlayerSetup) -> None:
    request = sc.RequestCreateGame(local_map=sc.LocalMap(map_data=FOGGY), random_seed=1, player_setup=players)
    assert not client.ask(create_game=request).create_game.HasField("error")


def watch(observed: int, *players: sc.PlayerSetup, **options: Any) -> Client:
    """Return a client that observes a game of computers."""
    client = Client()
    create(client, *(players or (COMPUTER, COMPUTER, OBSERVER)))
    join = sc.RequestJoinGame(observed_player_id=observed, options=interface(screen=32, minimap=32, **options))
    joined = client.ask(join_game=join).join_game
    assert joined.player_id == 3
    return client


def turn(client: Client, **action: Any) -> sc.ResponseObservation:
    """Return the view after an action of an observer."""
    request = sc.RequestObserverAction(actions=[sc.ObserverAction(**action)])
    assert client.ask(obs_action=request).HasField("obs_action")
    return client.observe()


def types(seen: sc.ResponseObservation) -> set[int]:
    return {unit.unit_type for unit in seen.observation.raw_data.units}


def camera(seen: sc.ResponseObservation) -> tuple[float, float]:
    point = seen.observation.raw_data.player.camera
    return point.x, point.y


@pytest.mark.parametrize(
    ("observed", "expected"), [(0, {ZEALOT, DARK_TEMPLAR, MARINE}), (1, {ZEALOT, DARK_TEMPLAR}), (2, {MARINE})]
)
def test_an_observer_sees_everything_or_what_one_player_sees(observed: int, expected: set[int]) -> None:
    seen = watch(observed).step(8)
    assert types(seen) == expected
    assert {unit.display_type for unit in seen.observation.raw_data.units} == {raw_pb2.Visible}
    assert all(unit.health > 0 for unit in seen.observation.raw_data.units)


def test_who_watches_everything_sees_no_fog_on_the_map() -> None:
    state = watch(0).step(8).observation.raw_data.map_state
    assert set(state.visibility.data) == {2}


def test_an_observer_is_told_the_race_of_everybody_and_is_listed_itself() -> None:
    info = watch(0).ask(game_info=sc.RequestGameInfo()).game_info
    assert [(p.player_id, p.type) for p in info.player_info] == [(1, sc.Computer), (2, sc.Computer), (3, sc.Observer)]
    assert [p.race_actual for p in info.player_info[:2]] == [common_pb2.Protoss, common_pb2.Terran]


def test_a_participant_is_told_his_own_race_only() -> None:
    client = Client()
    create(client, PARTICIPANT, COMPUTER)
    client.ask(join_game=sc.RequestJoinGame(race=common_pb2.Protoss, options=interface(screen=0)))
    info = client.ask(game_info=sc.RequestGameInfo()).game_info
    assert [player.HasField("race_actual") for player in info.player_info] == [True, False]


def test_an_observer_is_told_the_results_of_all() -> None:
    client = watch(0)
    assert client.ask(step=sc.RequestStep(count=100)).status == sc.ended
    results = [(result.player_id, result.result) for result in client.observe().player_result]
    assert results == [(1, sc.Victory), (2, sc.Defeat)]


def test_a_game_of_computers_is_watched_again_after_a_restart() -> None:
    client = watch(2)
    client.step(100)
    assert client.ask(restart_game=sc.RequestRestartGame()).status == sc.in_game
    assert types(client.step(8)) == {MARINE}


@pytest.mark.parametrize("observed", [0, 1])
def test_an_observer_changes_nothing(observed: int) -> None:
    client, twin = watch(observed), watch(observed)
    tags = [unit.tag for unit in client.observe().observation.raw_data.units]
    assert client.act(command(23, tags, point=(16, 16)), sc.Action()) == [error_pb2.NotSupported] * 2
    client.debug(debug_pb2.DebugCommand(kill_unit=debug_pb2.DebugKillUnit(tag=tags)))
    worlds = [c.session._process.table.game.world for c in (client, twin)]
    client.step(8)
    twin.step(8)
    assert worlds[0].digest() == worlds[1].digest()


# where to look --------------------------------------------------------------------------------------------------------


def test_the_camera_goes_where_it_is_told() -> None:
    seen = turn(watch(0), camera_move=sc.ActionObserverCameraMove(world_pos=common_pb2.Point2D(x=7, y=9)))
    assert camera(seen) == (7, 9)
    assert seen.observation.raw_data.player.camera.z > 0


def test_the_camera_stays_on_the_map() -> None:
    client = watch(0)
    seen = turn(client, camera_move=sc.ActionObserverCameraMove(world_pos=common_pb2.Point2D(x=-50, y=900)))
    x0, _, _, y1 = client.session._process.table.game.world.map.terrain.playable
    assert camera(seen) == (x0, y1)
    nowhere = common_pb2.Point2D(x=float("nan"), y=0)
    assert camera(turn(client, camera_move=sc.ActionObserverCameraMove(world_pos=nowhere))) == (x0, y1)


def test_the_camera_follows_units_until_they_are_gone() -> None:
    client = watch(0)
    units = {unit.unit_type: unit for unit in client.observe().observation.raw_data.units}
    tags = [units[ZEALOT].tag, units[DARK_TEMPLAR].tag]
    seen = turn(client, camera_follow_units=sc.ActionObserverCameraFollowUnits(unit_tags=tags))
    assert camera(seen) == pytest.approx((4, 5), abs=0.6)
    world = client.session._process.table.game.world
    world.life[[world.slot_of(tag) for tag in tags]] = 0
    assert camera(client.step(2)) == camera(seen)


def test_the_view_changes_to_another_player() -> None:
    client = watch(0)
    client.step(8)
    assert types(turn(client, player_perspective=sc.ActionObserverPlayerPerspective(player_id=2))) == {MARINE}
    seen = turn(client, player_perspective=sc.ActionObserverPlayerPerspective(player_id=1))
    assert {unit.alliance for unit in seen.observation.raw_data.units} == {raw_pb2.Self}
    assert types(turn(client, player_perspective=sc.ActionObserverPlayerPerspective(player_id=0))) > {MARINE, ZEALOT}
    assert types(turn(client, player_perspective=sc.ActionObserverPlayerPerspective(player_id=99))) > {MARINE, ZEALOT}


# replays --------------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def replay() -> bytes:
    """Return a game in which the player moved the camera at the first loop, and selected the army."""
    client = Client()
    create(client, PARTICIPANT, COMPUTER)
    client.ask(join_game=sc.RequestJoinGame(race=common_pb2.Protoss, options=interface(screen=32, minimap=32)))
    move, army = sc.Action(), sc.Action()
    move.action_raw.camera_move.center_world_space.x, move.action_raw.camera_move.center_world_space.y = 6, 7
    army.action_ui.select_army.selection_add = False
    client.act(move, army)
    client.step(20)
    return client.ask(save_replay=sc.RequestSaveReplay()).save_replay.data


def view(replay: bytes, player: int) -> Client:
    client = Client()
    request = sc.RequestStartReplay(replay_data=replay, observed_player_id=player, options=interface(screen=0))
    assert not client.ask(start_replay=request).start_replay.HasField("error")
    return client


@pytest.mark.parametrize(
    ("player", "expected", "reported"),
    [(0, {ZEALOT, DARK_TEMPLAR, MARINE}, 0), (1, {ZEALOT, DARK_TEMPLAR}, 2), (2, {MARINE}, 0)],
)
def test_a_replay_is_watched_with_the_eyes_of_anybody(
    replay: bytes, player: int, expected: set[int], reported: int
) -> None:
    seen = view(replay, player).step(8)
    assert types(seen) == expected
    assert len(seen.actions) == reported


def test_a_viewer_may_look_elsewhere_and_come_back(replay: bytes) -> None:
    client = view(replay, 1)
    assert camera(client.step(4)) == (6, 7)
    elsewhere = common_pb2.Point2D(x=20, y=20)
    assert camera(turn(client, camera_move=sc.ActionObserverCameraMove(world_pos=elsewhere))) == (20, 20)
    assert camera(client.step(4)) == (20, 20)
    back = turn(client, camera_follow_player=sc.ActionObserverCameraFollowPlayer(player_id=1))
    assert camera(back) == (6, 7)


def test_who_takes_over_the_eyes_of_a_player_is_told_what_he_does_from_then_on(replay: bytes) -> None:
    client = view(replay, 0)
    turn(client, player_perspective=sc.ActionObserverPlayerPerspective(player_id=1))
    seen = client.step(8)
    assert len(seen.actions) == 2
    assert sum(unit.is_selected for unit in seen.observation.raw_data.units) == 2
