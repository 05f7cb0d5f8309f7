"""How the shipped maps end: at which loop, by which of their conditions, with which result."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from khala_simulator.abilities import commands
from khala_simulator.combat import lifecycle
from khala_simulator.combat.traits import refresh
from khala_simulator.maps.game_map import load_map
from khala_simulator.tick import advance, new_game
from khala_simulator.world.players import NEUTRAL, GameResult

if TYPE_CHECKING:
    from khala_simulator.world.world import World

VICTORY, DEFEAT, TIE, UNDECIDED = GameResult.VICTORY, GameResult.DEFEAT, GameResult.TIE, GameResult.UNDECIDED


def of_type(world: World, player: int, *names: str) -> list[int]:
    return [s for s in world.units_of(player).tolist() if not names or world.unit_type(s).name in names]


def kill(world: World, player: int, *names: str, leave: int = 0) -> None:
    slots = of_type(world, player, *names)
    commands.debug_kill(world, [world.tag_of(slot) for slot in slots[leave:]])


def calm(name: str) -> World:
    """Return a game in which no unit uses a weapon, and no computer player makes anything new."""
    world = new_game(load_map(name))
    world.opponents = ()
    world.stats.range[:] = -100.0
    world.stats.scan[:] = -100.0
    for slot in world.live.tolist():
        refresh(world, slot)
    return world


def results(world: World) -> list[GameResult]:
    return [player.result for player in world.players[1:]]


# (map, whose units are killed at loop 100, down to how many; the loop of the end, the agent's result)
ENDS = [
    ("pvz_task1_level1", [(2, "Drone", 5)], 160, VICTORY),
    ("pvz_task1_level1", [(2, "Queen", 0)], 160, VICTORY),
    ("pvz_task1_level1", [(1, "Probe", 5)], 160, DEFEAT),
    ("pvz_task1_level1", [(1, "Adept", 0)], 160, DEFEAT),
    ("pvz_task1_level1", [(1, "Adept", 0), (2, "Drone", 6)], 1440, TIE),
    pytest.param("pvz_task1_level2", [(2, "Queen", 0)], 1440, TIE, marks=pytest.mark.slow),
    ("pvz_task2_level1", [(1, "Phoenix", 1)], 160, DEFEAT),
    pytest.param("pvz_task2_level1", [(1, "Phoenix", 0)], 1440, TIE, marks=pytest.mark.slow),
    ("pvz_task2_level1", [(2, "Queen", 0)], 160, VICTORY),
    ("duel_3m", [(2, "Marine", 0)], 101, VICTORY),
    ("duel_3m", [(1, "Marine", 0)], 101, DEFEAT),
    ("duel_3m", [(1, "Marine", 0), (2, "Marine", 0)], 101, TIE),
    pytest.param("duel_3m", [(1, "Marine", 1)], 1440, TIE, marks=pytest.mark.slow),
    ("pvz_task3_level1", [(1, "Probe", 5)], 160, DEFEAT),
    pytest.param("pvz_task4_level1", [(2, "Roach", 0)], 1440, TIE, marks=pytest.mark.slow),
    ("pvz_task4_level1", [(2, "Roach", 0), (2, "Ravager", 0)], 160, VICTORY),
    ("pvz_task4_level1", [(1, "Stalker", 0)], 160, DEFEAT),
    pytest.param(
        "pvz_task6_level1",
        [(1, "HighTemplar", 0), (1, "Stalker", 0), (1, "Sentry", 0)],
        1440,
        TIE,
        marks=pytest.mark.slow,
    ),
    ("pvz_task6_level1", [(1, "HighTemplar", 0), (1, "Stalker", 0), (1, "Sentry", 0), (1, "Archon", 0)], 160, DEFEAT),
    ("pvz_task8_level1", [(2, "Drone", 6), (2, "Roach", 0), (2, "Ravager", 0), (2, "Queen", 0)], 160, VICTORY),
    pytest.param(
        "pvz_task8_level1",
        [(2, "Drone", 7), (2, "Roach", 0), (2, "Ravager", 0), (2, "Queen", 0)],
        1920,
        TIE,
        marks=pytest.mark.slow,
    ),
    ("pvz_task8_level1", [(2, "Hatchery", 0)], 101, VICTORY),  # it is the last structure
    ("pvz_task1_level1_paper", [(2, "Drone", 5)], 160, VICTORY),
    ("pvz_task1_level3_paper", [(2, "Queen", 0), (2, "Zergling", 0), (2, "Hatchery", 0), (2, "Drone", 6)], 1440, TIE),
    ("pvz_task2_level2_paper", [(2, "Queen", 0), (2, "Drone", 6)], 1440, TIE),
    pytest.param("pvz_task2_level3_paper", [(2, "Drone", 5)], 160, VICTORY, marks=pytest.mark.slow),
    ("pvz_task3_level1", [(1, "Probe", 6)], 960, VICTORY),
    ("pvz_task3_level1_paper", [(1, "Probe", 6)], 160, DEFEAT),
    ("pvz_task4_level2_paper", [(2, "Roach", 0), (2, "Ravager", 0), (2, "Queen", 0)], 160, VICTORY),
    ("pvz_task8_level3_paper", [(2, "Drone", 5), (2, "Roach", 0), (2, "Ravager", 0), (2, "Queen", 0)], 160, VICTORY),
    ("pvz_task8_level1_paper", [(2, "Hatchery", 0), (2, "Drone", 5)], 1920, TIE),
    pytest.param(
        "pvz_task8_level2_paper",
        [(2, "Drone", 6), (2, "Roach", 0), (2, "Ravager", 0), (2, "Queen", 0)],
        1920,
        TIE,
        marks=pytest.mark.slow,
    ),
]


@pytest.mark.parametrize(("name", "killed", "loop", "mine"), ENDS)
def test_a_task_ends_at_its_loop_with_its_result(
    name: str, killed: list[tuple[int, str, int]], loop: int, mine: GameResult
) -> None:
    world = calm(name)
    advance(world, 100)
    for player, unit, left in killed:
        kill(world, player, unit, leave=left)
    advance(world, 5000)
    assert (world.loop, world.players[1].result) == (loop, mine)


def test_the_drop_is_won_by_living_for_960_loops() -> None:
    world = new_game(load_map("pvz_task3_level3"))
    world.stats.range[:] = -100.0
    kill(world, 2, "OverlordTransport")
    for at in (239, 479):
        advance(world, at - world.loop)
        kill(world, 2, "OverlordTransport")
        advance(world, 2)
        kill(world, 2, "OverlordTransport")
    advance(world, 5000)
    assert world.loop == 960
    assert results(world) == [VICTORY, DEFEAT]


@pytest.mark.parametrize(("name", "structure"), [("pvz_task4_level1", "Nexus"), ("Simple64", "")])
def test_who_has_no_structure_left_has_lost_at_once(name: str, structure: str) -> None:
    world = calm(name)
    advance(world, 30)
    halls = [s for s in of_type(world, 2) if world.unit_type(s).structure]
    commands.debug_kill(world, [world.tag_of(slot) for slot in halls])
    advance(world, 200)
    assert world.loop == 31
    assert results(world) == [VICTORY, DEFEAT]
    assert not structure or of_type(world, 1, structure)


@pytest.mark.parametrize(
    ("name", "loop"),
    [
        ("MoveToBeacon", 1920),
        ("CollectMineralShards", 1920),
        ("CollectMineralsAndGas", 6720),
        ("BuildMarines", 14400),
    ],
)
def test_a_mini_game_ends_when_its_time_is_up(name: str, loop: int) -> None:
    world = new_game(load_map(name))
    world.loop = loop - 10
    advance(world, 100)
    assert (world.loop, world.players[1].result) == (loop, TIE)


# what a mini-game counts ---------------------------------------------------------------------------------------------


def test_a_beacon_that_is_reached_counts_and_moves() -> None:
    world = new_game(load_map("MoveToBeacon"), seed=5)
    for score in range(1, 6):
        (beacon,) = of_type(world, NEUTRAL)
        (marine,) = of_type(world, 1)
        x, y = world.pos[beacon].tolist()
        assert np.hypot(x - 33, y - 28) > 4
        assert np.hypot(*(world.pos[marine] - (x, y))) >= 5
        commands.move(world, [marine], (x, y))
        while world.players[1].score.curriculum < score and not world.ended:
            advance(world, 1)
        assert not world.ended
        assert np.hypot(*(world.pos[marine] - (x, y))) == pytest.approx(1.25, abs=0.2)


def test_shards_are_minerals_and_points_and_come_again() -> None:
    world = new_game(load_map("CollectMineralShards"), seed=1)
    marines = of_type(world, 1)
    for round_ in (1, 2):
        for _ in range(20):
            shards = of_type(world, NEUTRAL)
            world.pos[marines[0]] = world.pos[shards[0]]
            before = world.players[1].score.curriculum
            advance(world, 1)
            assert world.players[1].score.curriculum > before
            if world.players[1].score.curriculum == 20 * round_:
                break
        assert world.players[1].score.curriculum == 20 * round_
        assert world.players[1].minerals == 2000 * round_
        assert len(of_type(world, NEUTRAL)) == 20


def test_a_killed_roach_counts_ten_a_lost_marine_minus_one_and_a_new_round_brings_five_more() -> None:
    world = new_game(load_map("DefeatRoaches"), seed=2)
    marines = of_type(world, 1)
    world.life[marines[0]] = 20.0
    commands.debug_kill(world, [world.tag_of(s) for s in (*marines[1:4], *of_type(world, 2)[:1])])
    advance(world, 1)
    assert world.players[1].score.curriculum == 10 - 3
    tags = {world.tag_of(slot) for slot in of_type(world, 1)}
    for slot in of_type(world, 1):
        world.life[slot] = 20.0
    kill(world, 2)
    advance(world, 1)
    assert world.players[1].score.curriculum == 40 - 3
    assert len(of_type(world, 1, "Marine")) == 6 + 5
    assert len(of_type(world, 2, "Roach")) == 4
    assert not tags & {world.tag_of(slot) for slot in of_type(world, 1)}
    assert sorted(world.life[of_type(world, 1)].tolist()) == [20.0] * 6 + [45.0] * 5
    column = world.pos[of_type(world, 1)]
    assert np.ptp(column[:, 0]) == pytest.approx(0, abs=1.0)
    assert world.script.selections[-1][0] == 1
    assert len(world.script.selections[-1][1]) == 11


@pytest.mark.parametrize("name", ["DefeatRoaches", "DefeatZerglingsAndBanelings", "FindAndDefeatZerglings"])
def test_a_mini_game_is_over_when_all_marines_are_dead(name: str) -> None:
    world = new_game(load_map(name))
    kill(world, 1)
    advance(world, 5)
    assert world.ended
    assert world.loop == 1
    assert world.players[1].result is DEFEAT


def test_zerglings_that_are_found_come_back_far_away() -> None:
    world = new_game(load_map("FindAndDefeatZerglings"), seed=4)
    kill(world, 2)
    advance(world, 1)
    found = of_type(world, 2, "Zergling")
    assert len(found) == 25
    assert world.players[1].score.curriculum == 25
    apart = world.pos[found][:, None] - world.pos[of_type(world, 1)]
    assert np.sqrt((apart**2).sum(axis=2)).min() > 8.0


def test_a_marine_counts_once_when_it_is_made() -> None:
    world = new_game(load_map("BuildMarines"))
    marine = world.catalog.unit("Marine")
    advance(world, 2)
    slot = lifecycle.spawn(world, marine, 1, (33, 25))
    world.build_progress[slot] = 0.5
    lifecycle.spawn(world, marine, 1, (34, 25))
    advance(world, 3)
    assert world.players[1].score.curriculum == 1
    world.build_progress[slot] = 1.0
    advance(world, 3)
    assert world.players[1].score.curriculum == 2


def test_a_wave_brings_two_transports_with_four_banelings_each() -> None:
    world = new_game(load_map("pvz_task3_level1"))
    for wave, at in enumerate((0, 240, 480), start=1):
        advance(world, at - world.loop)
        everything = np.flatnonzero(world.alive & (world.owner == 2))
        names = [world.unit_type(slot).name for slot in everything.tolist()]
        new = [s for s in of_type(world, 2, "OverlordTransport") if world.born_loop[s] == at]
        assert len(new) == 2
        assert [len(world.passengers(slot)) for slot in new] == [4, 4]
        assert names.count("Baneling") <= 8 * wave


def test_in_the_paper_four_waves_bring_zerglings_too_and_seven_probes_must_live_for_a_minute() -> None:
    world = calm("pvz_task3_level3_paper")
    for at in (0, 240, 480, 720):
        advance(world, at - world.loop)
        new = [s for s in of_type(world, 2, "OverlordTransport") if world.born_loop[s] == at]
        loads = [sorted(world.unit_type(slot).name for slot in world.passengers(transport)) for transport in new]
        assert loads == [["Baneling"] * 2 + ["Zergling"] * 4] * 2
        kill(world, 2, "OverlordTransport")
        advance(world, 1)
    kill(world, 1, "Probe", leave=7)
    advance(world, 5000)
    assert (world.loop, results(world)) == (1344, [VICTORY, DEFEAT])


def test_a_transport_that_comes_into_the_base_unloads_at_the_minerals() -> None:
    world = new_game(load_map("pvz_task3_level2"), seed=1)
    (first, *_) = [s for s in of_type(world, 2, "OverlordTransport") if world.pos[s][1] == 72]
    while not world.ended and len(world.passengers(first)) == 4:
        advance(world, 1)
    x, y = world.pos[first].tolist()
    assert np.hypot(x - 21.5, y - 48.5) < 3
    advance(world, 80)
    assert len(world.passengers(first)) == 0 or not world.alive[first]
    assert len(of_type(world, 1, "Probe")) < 12
