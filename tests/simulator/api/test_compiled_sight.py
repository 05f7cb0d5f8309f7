"""The compiled sight perceives what the rules do: the same rows, and values in the layers, to the last bit."""

from __future__ import annotations

import dataclasses
import random

import numpy as np
import pytest

from khala_simulator import compiled
from khala_simulator.api.layers import write_values
from khala_simulator.api.sight import Sight, units_seen
from khala_simulator.api.types import types_of
from khala_simulator.maps.game_map import load_map
from khala_simulator.tick import advance, new_game
from tests.simulator.engine.random_orders import give_orders

built = pytest.mark.skipif(compiled.engine() == "python", reason="the kernels were not built, or not wanted")


def bits(sight: Sight) -> dict[str, tuple[str, bytes]]:
    """Return the columns with their dtypes."""
    columns = {field.name: getattr(sight, field.name) for field in dataclasses.fields(sight)}
    return {name: (str(column.dtype), column.tobytes()) for name, column in columns.items()}


def differences_in_a_game(name: str, loops: int) -> int:
    """Compare what all players see, observers too, in a game with random orders; return how often they saw a unit."""
    kernel = compiled.part("sight")
    assert kernel is not None
    world, chance, seen = new_game(load_map(name), seed=5), random.Random(5), 0
    types = types_of(world.catalog.version)
    for player in world.players[1:]:
        player.cheats += ["tech_tree", "cooldown", "food"]
        player.minerals = player.vespene = 5000.0
    while world.loop < loops and not world.ended:
        give_orders(world, chance)
        advance(world, 8)
        for watcher in range(len(world.players)):
            for show_cloaked, through_fog in ((False, False), (True, False), (True, True)):
                rule = units_seen(world, types, watcher, show_cloaked, through_fog)
                assert bits(kernel.units_seen(world, types, watcher, show_cloaked, through_fog)) == bits(rule)
                half, blank = np.arange(len(rule)) % 2 == 0, np.zeros((15, len(rule)), np.int32)
                one, other = blank.copy(), blank.copy()
                write_values(rule, half, one)
                kernel.layer_values(rule, half, other)
                assert one.tobytes() == other.tobytes()
                seen += len(rule)
    return seen


@built
def test_the_same_units_are_seen() -> None:
    assert differences_in_a_game("llm_pysc2/pvz_task8_level1", 80) > 0


@built
@pytest.mark.slow
@pytest.mark.parametrize("name", ["melee/Simple64", "llm_smac/MMM2", "llm_pysc2/pvz_task6_level1"])
def test_the_same_units_are_seen_in_long_games(name: str) -> None:
    assert differences_in_a_game(name, 800) > 0
