"""What the API says of a computer player is what it plays."""

from __future__ import annotations

from s2clientprotocol import common_pb2
from s2clientprotocol import sc2api_pb2 as sc

from khala_simulator.api.game import HostedGame, Setup
from khala_simulator.maps.game_map import load_map
from khala_simulator.opponent import player
from khala_simulator.opponent.levels import level_of
from khala_simulator.tables.versions import DEFAULT_VERSION


def test_difficulty_and_build_are_those_of_the_request() -> None:
    asked = sc.PlayerSetup(type=sc.Computer, race=common_pb2.Zerg, difficulty=sc.CheatMoney, ai_build=sc.Air)
    setup = Setup(
        game_map=load_map("Melee/Simple64"), map_data=b"", path="Simple64", seed=1, disable_fog=False, realtime=False,
        players=(sc.PlayerSetup(type=sc.Participant, race=common_pb2.Terran), asked),
    )  # fmt: skip
    world = HostedGame(setup, DEFAULT_VERSION).world
    computer = world.players[2]
    assert level_of(computer.difficulty).name == "cheat_money"
    assert player.begin(world, 2).build == "air"
