"""Worlds to try single laws in: flat ground without a script, and units put where a test wants them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from simulator.maps import GameMap, map_from
from simulator.players import PlayerSetup
from simulator.scenariofile import parse_scenario
from simulator.tick import advance
from simulator.world import World

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

BARE = """
name: bare
family: test
title: No script
terrain: {terrain}
visibility: {{fog: {fog}, black_mask: {fog}}}
players:
  1: {{race: protoss, control: agent}}
  2: {{race: zerg, control: computer}}
"""

PLAYERS = (PlayerSetup(1, "protoss", "agent"), PlayerSetup(2, "zerg", "computer"))


def bare_map(terrain: str = "agria_open", *, fog: bool = False) -> GameMap:
    text = BARE.format(terrain=terrain, fog=str(fog).lower())
    return map_from(parse_scenario(text, "bare.yaml"), text)


class Field:
    """A world with short names for what tests do to it."""

    def __init__(self, terrain: str = "agria_open", *, seed: int = 0, fog: bool = False) -> None:
        self.world = World(bare_map(terrain, fog=fog), PLAYERS, seed=seed)

    def put(self, name: str, owner: int, x: float, y: float, facing: float = 0.0) -> int:
        return self.world.spawn(self.world.catalog.unit(name), owner, (x, y), facing)

    def play(self, loops: int) -> World:
        advance(self.world, loops)
        return self.world

    def loops(self, count: int) -> Iterator[int]:
        """Play loop by loop, yielding the number of each after it was played."""
        for _ in range(count):
            advance(self.world)
            yield self.world.loop

    def vitals(self, slot: int) -> float:
        return float(self.world.life[slot] + self.world.shields[slot])


@pytest.fixture
def field() -> Field:
    return Field()


@pytest.fixture(scope="session")
def make_field() -> Callable[..., Field]:
    return Field
