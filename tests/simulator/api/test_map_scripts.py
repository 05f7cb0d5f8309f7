"""What clients see of the maps' own scripts: scores, selections, start locations, new episodes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from s2clientprotocol import common_pb2, debug_pb2, score_pb2
from s2clientprotocol import sc2api_pb2 as sc

from khala_simulator.process.client import Client, interface

if TYPE_CHECKING:
    from collections.abc import Callable


@pytest.fixture
def play() -> Callable[..., Client]:
    def begin(path: str, *, opponent: bool = False, seed: int = 1) -> Client:
        client = Client()
        players = [sc.PlayerSetup(type=sc.Participant)]
        if opponent:
            players.append(sc.PlayerSetup(type=sc.Computer, race=common_pb2.Random, difficulty=sc.VeryHard))
        request = sc.RequestCreateGame(local_map=sc.LocalMap(map_path=path), player_setup=players, random_seed=seed)
        assert not client.ask(create_game=request).create_game.HasField("error")
        join = sc.RequestJoinGame(race=common_pb2.Protoss, options=interface(screen=0))
        assert not client.ask(join_game=join).join_game.HasField("error")
        return client

    return begin


@pytest.mark.parametrize(
    ("path", "kind"),
    [("mini_games/MoveToBeacon.SC2Map", score_pb2.Score.Curriculum), ("llm_smac/2s3z.SC2Map", score_pb2.Score.Melee)],
)
def test_the_score_is_the_maps_own_where_it_has_one(
    play: Callable[..., Client], path: str, kind: score_pb2.Score.ScoreType.ValueType
) -> None:
    score = play(path).observe().observation.score
    assert score.score_type == kind
    assert (score.score == 0) == (kind == score_pb2.Score.Curriculum)


def test_a_reached_beacon_is_one_point(play: Callable[..., Client]) -> None:
    client = play("mini_games/MoveToBeacon.SC2Map")
    units = client.observe().observation.raw_data.units
    (beacon,) = (unit for unit in units if unit.unit_type == 317)
    (marine,) = (unit for unit in units if unit.unit_type == 48)
    assert (beacon.owner, marine.owner) == (16, 1)
    move = sc.Action()
    order = move.action_raw.unit_command
    order.ability_id = 16
    order.unit_tags.append(marine.tag)
    order.target_world_space_pos.x, order.target_world_space_pos.y = beacon.pos.x, beacon.pos.y
    client.act(move)
    assert client.step(160).observation.score.score == 1


def test_marines_of_a_round_are_selected_at_its_start(play: Callable[..., Client]) -> None:
    units = play("mini_games/DefeatRoaches.SC2Map").observe().observation.raw_data.units
    assert [unit.is_selected for unit in units if unit.unit_type == 48] == [True] * 9


def test_smacs_reset_brings_both_sides_back(play: Callable[..., Client]) -> None:
    client = play("SMAC_Maps/MMM.SC2Map", opponent=True)
    before = client.step(40).observation.raw_data.units
    kill = debug_pb2.DebugCommand(kill_unit=debug_pb2.DebugKillUnit(tag=[unit.tag for unit in before]))
    client.debug(kill)
    after = client.step(2).observation.raw_data.units
    assert sorted(u.unit_type for u in after) == sorted(u.unit_type for u in before)
    assert not {u.tag for u in after} & {u.tag for u in before}
    mine = sorted({u.unit_type for u in after if u.owner == 1})
    assert mine == [mine[0], mine[0] + 1, mine[0] + 2]  # Marauder, Marine, Medivac: as SMAC derives them
    told = client.ask(data=sc.RequestData(unit_type_id=True)).data.units
    assert [told[number].name for number in mine] == ["Marauder_RL", "Marine_RL", "Medivac_RL"]


def test_start_locations_are_all_but_the_own_one_and_the_camera_is_at_the_workers(play: Callable[..., Client]) -> None:
    for seed in range(4):
        client = play("Melee/Simple64.SC2Map", opponent=True, seed=seed)
        start = client.ask(game_info=sc.RequestGameInfo()).game_info.start_raw
        (other,) = start.start_locations
        raw = client.observe().observation.raw_data
        (hall,) = (unit for unit in raw.units if unit.unit_type == 59)
        assert {(other.x, other.y), (hall.pos.x, hall.pos.y)} == {(28.5, 60.5), (59.5, 27.5)}
        away = (raw.player.camera.x - hall.pos.x, raw.player.camera.y - hall.pos.y)
        assert 1.5 < abs(away[0]) + abs(away[1]) < 3.5


def test_nobody_sits_in_an_open_slot(play: Callable[..., Client]) -> None:
    client = play("Melee/Flat32.SC2Map")
    everything = client.ask(observation=sc.RequestObservation(disable_fog=True)).observation
    assert {unit.owner for unit in everything.observation.raw_data.units} == {1, 16}
