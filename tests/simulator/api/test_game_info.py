"""The pathing grid of the game info: what a player sees and remembers is in the way, and nothing else."""

import numpy as np
import pytest
from s2clientprotocol import common_pb2, debug_pb2
from s2clientprotocol import sc2api_pb2 as sc

from khala_simulator.process.client import Client, interface

PYLON, PROBE = 60, 84
OPEN = b"""# A map of Khala's simulator
name: open
family: test
title: One who looks, and one who builds
terrain: agria_open
players: {1: {race: protoss, control: agent, start: [8, 8]}, 2: {race: zerg, control: computer, start: [24, 24]}}
triggers:
  - name: spawn
    when: [start]
    do:
      - create: {player: 1, unit: Zealot, at: [5, 5]}
      - create: {player: 2, unit: Zergling, at: [28, 28]}
"""


@pytest.fixture
def client() -> Client:
    client = Client()
    players = [sc.PlayerSetup(type=sc.Participant), sc.PlayerSetup(type=sc.Computer)]
    client.ask(create_game=sc.RequestCreateGame(local_map=sc.LocalMap(map_data=OPEN), player_setup=players))
    client.ask(join_game=sc.RequestJoinGame(race=common_pb2.Protoss, options=interface(screen=0)))
    return client


def put(client: Client, unit: int, owner: int, x: float, y: float) -> None:
    order = debug_pb2.DebugCreateUnit(unit_type=unit, owner=owner, pos=common_pb2.Point2D(x=x, y=y), quantity=1)
    client.debug(debug_pb2.DebugCommand(create_unit=order))
    client.step(8)


def kill(client: Client, unit: int) -> None:
    world = client.session._process.table.game.world
    rows = world.live[[world.unit_type(slot).id == unit for slot in world.live.tolist()]]
    client.debug(debug_pb2.DebugCommand(kill_unit=debug_pb2.DebugKillUnit(tag=[world.tag_of(s) for s in rows])))
    client.step(8)


def blocked(client: Client) -> set[tuple[int, int]]:
    """Return the cells of the bare ground that the game info says cannot be walked on."""
    grid = client.ask(game_info=sc.RequestGameInfo()).game_info.start_raw.pathing_grid
    bits = np.unpackbits(np.frombuffer(grid.data, np.uint8)).reshape(grid.size.y, grid.size.x).astype(bool)
    walk = client.session._process.table.game.world.map.terrain.walk
    ys, xs = np.nonzero(walk & ~bits)
    return set(zip(xs.tolist(), ys.tolist(), strict=True))


SQUARE = {(x, y) for x in (15, 16) for y in (15, 16)}
"""Cells under a Pylon at (16, 16)."""


def test_an_own_structure_is_in_the_way_at_once(client: Client) -> None:
    assert not blocked(client)
    put(client, PYLON, 1, 16, 16)
    assert blocked(client) == SQUARE


def test_a_structure_that_was_never_seen_is_not_in_the_way(client: Client) -> None:
    put(client, PYLON, 2, 25, 25)
    assert not blocked(client)


def test_a_structure_in_the_fog_is_remembered_until_its_place_is_seen_without_it(client: Client) -> None:
    put(client, PYLON, 2, 16, 16)
    put(client, PROBE, 1, 13, 16)
    assert blocked(client) == SQUARE
    kill(client, PROBE)
    assert blocked(client) == SQUARE
    kill(client, PYLON)
    assert blocked(client) == SQUARE
    put(client, PROBE, 1, 13, 16)
    assert not blocked(client)
