"""The compiled systems play as those in numpy do, to the last bit."""

from __future__ import annotations

import copy
import pickle
from functools import partial
from typing import TYPE_CHECKING

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.simulator_engine import battle
from khala_simulator import compiled, tick
from khala_simulator.compiled import declare
from khala_simulator.maps.game_map import load_map
from tests.simulator.engine import random_orders
from tests.simulator.engine.side_by_side import differences, first_difference

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_simulator.world.world import World

TASKS = tuple(f"llm_pysc2/pvz_task{number}_level1" for number in range(1, 9))
BATTLES = (
    "llm_smac/2s3z", "llm_smac/2c_vs_64zg", "llm_smac/MMM2", "llm_smac/bane_vs_bane", "llm_smac/so_many_baneling",
    "llm_smac/1c3s5z", "llm_smac/corridor", "llm_smac/25m", "mini_games/DefeatRoaches",
    "mini_games/DefeatZerglingsAndBanelings", *TASKS,
)  # fmt: skip
GAMES = ("melee/Simple64", "mini_games/CollectMineralsAndGas")

built = pytest.mark.skipif(compiled.engine() == "python", reason="the compiled systems were not built, or not wanted")


def test_the_declaration_of_the_columns_is_fresh() -> None:
    for name, text in declare.declared().items():
        assert (declare.HERE / name).read_text(encoding="utf-8") == text, f"python -m {declare.__name__} writes {name}"


@built
def test_every_system_that_is_said_to_be_compiled_is() -> None:
    changed = {
        rule.__module__.rpartition(".")[2]
        for rule, played in zip(tick.RULES, tick.SYSTEMS, strict=True)
        if rule is not played
    }
    assert changed == set(compiled.SYSTEMS)


@built
@pytest.mark.parametrize("name", ["llm_smac/2s3z", "llm_pysc2/pvz_task6_level1"])
def test_a_battle_is_the_same(name: str) -> None:
    assert first_difference(partial(battle, name, 1), 300, every=8) is None


def by_pickle(world: World) -> World:
    """Return a copy that went through bytes."""
    copied: World = pickle.loads(pickle.dumps(world))
    return copied


@built
@pytest.mark.parametrize("copied", [copy.deepcopy, by_pickle])
def test_a_copy_of_a_world_in_battle_plays_on_as_it_does(copied: Callable[[World], World]) -> None:
    world = battle("llm_smac/2s3z", 1)
    tick.advance(world, 60)
    other = copied(world)
    tick.advance(world, 60)
    tick.advance(other, 60)
    assert other.digest() == world.digest()


@built
@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.parametrize("name", BATTLES)
def test_battles_are_the_same(name: str) -> None:
    loops = seed = 0
    while loops < 2000:
        ended = battle(name, seed)
        assert first_difference(partial(battle, name, seed), 2000, every=8) is None
        loops += tick.advance(ended, 2000)
        seed += 1


@built
@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.parametrize("name", GAMES)
def test_games_are_the_same(name: str) -> None:
    assert first_difference(partial(tick.new_game, load_map(name), seed=1), 2000, every=8) is None


@built
@settings(max_examples=5, deadline=None)
@given(units=st.integers(1, 12), seed=st.integers(0, 1 << 30))
def test_a_random_world_is_the_same(units: int, seed: int) -> None:
    assert _differences(units, seed) == []


@built
@pytest.mark.slow
@pytest.mark.timeout(1200)
@settings(max_examples=1000, deadline=None)
@given(units=st.integers(1, 12), seed=st.integers(0, 1 << 30))
def test_a_thousand_random_worlds_are_the_same(units: int, seed: int) -> None:
    assert _differences(units, seed) == []


def _differences(units: int, seed: int) -> list[str]:
    """Return in what two worlds of random units with random orders differ after 120 loops."""
    worlds = [
        random_orders.play(random_orders.crowd(units, seed), seed, 120, each) for each in (tick.RULES, tick.SYSTEMS)
    ]
    return differences(*worlds)
