"""The computer player of melee games: it mines, builds, trains, attacks, and plays the same game every time."""

from __future__ import annotations

import itertools
from collections import Counter
from typing import TYPE_CHECKING

import pytest

from khala_simulator.combat import lifecycle
from khala_simulator.economy import supply
from khala_simulator.maps.game_map import load_map
from khala_simulator.opponent.levels import LEVELS, level_of
from khala_simulator.tick import advance, new_game
from khala_simulator.world.players import GameResult, PlayerSetup

if TYPE_CHECKING:
    from khala_simulator.world.world import World


def game(
    races: tuple[str, str], difficulties: tuple[int, int], *, seats: tuple[str, str] = ("computer", "computer")
) -> World:
    players = [
        PlayerSetup(i + 1, race, seat, difficulty=level)
        for i, (race, seat, level) in enumerate(zip(races, seats, difficulties, strict=True))
    ]
    return new_game(load_map("Melee/Flat48"), players, seed=2)


def having(world: World, player: int) -> Counter[str]:
    return Counter(world.unit_type(slot).name for slot in world.units_of(player).tolist())


@pytest.mark.parametrize(
    ("race", "supplies", "makes"), [("protoss", "Pylon", "Gateway"), ("terran", "SupplyDepot", "Barracks")]
)
def test_it_mines_keeps_supply_ahead_and_builds(race: str, supplies: str, makes: str) -> None:
    world = game((race, race), (7, 1))
    advance(world, 1500)
    hard, _easy = having(world, 1), having(world, 2)
    assert hard[supplies] >= 1
    assert hard[makes] >= 1
    assert supply.used(world, 1) > supply.used(world, 2) >= 12.0
    assert world.players[1].score.collected[0] > 500


def test_the_same_game_is_played_every_time() -> None:
    first, second = (game(("protoss", "zerg"), (6, 6)) for _ in range(2))
    advance(first, 400)
    advance(second, 400)
    assert first.digest() == second.digest()


def test_it_attacks_with_a_wave_and_wins_when_no_structure_is_left() -> None:
    world = game(("protoss", "terran"), (0, 7), seats=("agent", "computer"))
    world.loop = level_of(7).peace_loops
    home = world.players[2].start
    assert home is not None
    for i in range(40):
        lifecycle.spawn(world, world.catalog.unit("Marine"), 2, (home[0] - 4.0 + i % 8, home[1] + 4.0 + i // 8))
    advance(world, 2500)
    assert world.ended
    assert [player.result for player in world.players[1:]] == [GameResult.DEFEAT, GameResult.VICTORY]


def test_a_scenarios_own_computer_player_is_left_alone() -> None:
    world = new_game(load_map("llm_smac/2s3z"), seed=1)
    advance(world, 2)
    assert world.opponents == ()


def test_harder_ones_want_more_and_wait_less() -> None:
    levels = [LEVELS[number] for number in sorted(LEVELS)]
    for easier, harder in itertools.pairwise(levels):
        assert easier.workers <= harder.workers
        assert easier.period_loops >= harder.period_loops
        assert easier.peace_loops >= harder.peace_loops
