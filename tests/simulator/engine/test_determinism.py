from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from khala_simulator.abilities import commands
from khala_simulator.maps.game_map import load_map
from khala_simulator.tick import advance, new_game
from khala_simulator.world.columns import COLUMNS

if TYPE_CHECKING:
    from khala_simulator.world.world import World

PLAYED = """
import sys
from khala_simulator.abilities import commands
from khala_simulator.maps.game_map import load_map
from khala_simulator.tick import advance, new_game
world = new_game(load_map(sys.argv[1]), seed=int(sys.argv[2]))
commands.attack_move(world, world.units_of(1).tolist(), (20.0, 14.0))
advance(world, 300)
print(world.digest())
"""


def played(name: str, seed: int, loops: int = 300) -> World:
    world = new_game(load_map(name), seed=seed)
    commands.attack_move(world, world.units_of(1).tolist(), (20.0, 14.0))
    advance(world, loops)
    return world


@pytest.mark.parametrize(
    "name", ["2s3z", *(pytest.param(n, marks=pytest.mark.slow) for n in ("1c3s5z", "2c_vs_64zg", "2s_vs_1sc"))]
)
def test_the_same_game_has_the_same_digest(name: str) -> None:
    assert played(name, 5).digest() == played(name, 5).digest()


def test_another_process_with_other_hashes_plays_the_same_game() -> None:
    digests = {
        subprocess.run(
            [sys.executable, "-c", PLAYED, "3s5z", "7"],
            env={**os.environ, "PYTHONHASHSEED": seed},
            check=True,
            capture_output=True,
            text=True,
        ).stdout
        for seed in ("1", "2")
    }
    assert digests == {played("3s5z", 7).digest() + "\n"}


RANDOM_ORDERS = Path(__file__).parent / "random_orders.py"
PLAYGROUNDS = ["pvz_task6_level1", "pvz_task8_level1", "MMM2", "2c_vs_64zg", "Simple64"]


def by_lot(name: str, loops: int, hash_seed: str) -> str:
    """Return loop and digest at the end of a game with random orders of every kind, in a process of its own."""
    environment = {**os.environ, "PYTHONHASHSEED": hash_seed, "PYTHONPATH": str(RANDOM_ORDERS.parents[3])}
    arguments = [sys.executable, str(RANDOM_ORDERS), name, "11", str(loops)]
    done = subprocess.run(arguments, env=environment, check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout


@pytest.mark.parametrize("name", ["MMM2", pytest.param("Simple64", marks=pytest.mark.slow)])
def test_random_orders_of_every_kind_break_nothing_and_end_the_same_in_two_processes(name: str) -> None:
    assert by_lot(name, 150, "1") == by_lot(name, 150, "2")


@pytest.mark.slow
@pytest.mark.parametrize("name", PLAYGROUNDS)
def test_two_thousand_loops_of_random_orders_end_the_same_in_two_processes(name: str) -> None:
    assert by_lot(name, 2000, "1") == by_lot(name, 2000, "2")


def test_the_game_is_the_same_on_every_python_and_numpy() -> None:
    """The digests are in a file; a change of the rules changes them, and then the file must be written again."""
    kept = json.loads((Path(__file__).parent / "golden_digests.json").read_text(encoding="utf-8"))
    now = {name: played(name, 3).digest() for name in kept}
    assert now == kept, json.dumps(now, indent=1)


def test_another_seed_plays_another_game() -> None:
    assert len({played("2s3z", seed).digest() for seed in range(4)}) == 4


def test_advancing_in_steps_of_any_size_is_the_same() -> None:
    by_ones = new_game(load_map("3s5z"), seed=1)
    for _ in range(200):
        advance(by_ones)
    by_eights = new_game(load_map("3s5z"), seed=1)
    for _ in range(25):
        advance(by_eights, 8)
    assert by_ones.digest() == by_eights.digest()


def test_looking_changes_nothing() -> None:
    watched, alone = new_game(load_map("2s3z"), seed=1), new_game(load_map("2s3z"), seed=1)
    for _ in range(100):
        advance(watched)
        watched.facing(), watched.heights(), watched.is_visible(1), watched.digest()
        for slot in watched.live.tolist():
            watched.orders_of(slot)
    advance(alone, 100)
    assert watched.digest() == alone.digest()


def test_every_column_counts_in_the_digest(subtests: pytest.Subtests) -> None:
    world = new_game(load_map("2s3z"), seed=1)
    before = world.digest()
    for column in (name for name, column in COLUMNS.items() if column.is_state):
        with subtests.test(column):
            array = getattr(world, column)
            kept = array.copy()
            if array.dtype == np.bool_:
                array[1] = ~array[1]
            else:
                array[1] += 1
            assert world.digest() != before
            array[:] = kept
            assert world.digest() == before


def test_queues_shots_scores_and_the_clock_count_in_the_digest() -> None:
    world = played("2s3z", 1, 30)
    seen = {world.digest()}
    commands.move(world, world.units_of(1)[:1].tolist(), (3, 3), queue=True)
    seen.add(world.digest())
    world.players[1].score.damage_dealt.life += 1
    seen.add(world.digest())
    world.loop += 1
    seen.add(world.digest())
    world.rng.random()
    seen.add(world.digest())
    assert len(seen) == 5
