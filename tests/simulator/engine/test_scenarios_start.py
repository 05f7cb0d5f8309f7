"""The units on the shipped maps at the start of a game, against numbers that were written down independently."""

from __future__ import annotations

from collections import Counter
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
import pytest

from khala_simulator.maps.game_map import load_map, map_names
from khala_simulator.tables.layers import Layer
from khala_simulator.tick import advance, new_game
from khala_simulator.world.players import NEUTRAL

if TYPE_CHECKING:
    from khala_simulator.world.world import World

MELEE_1 = {"Nexus": 1, "Probe": 12}
MELEE_2 = {"Hatchery": 1, "Drone": 12, "Overlord": 1, "Larva": 3}
STALKERS = {"Stalker": 12}

# (map, of the agent, of the opponent), beside what a melee start gives
ARMIES = [
    ("duel_2s3z", {"Stalker": 2, "Zealot": 3}, {"Stalker": 2, "Zealot": 3}),
    ("pvz_task1_level1", {"Adept": 2}, {"Queen": 2}),
    ("pvz_task1_level3", {"Adept": 2}, {"Queen": 2, "Zergling": 4}),
    ("pvz_task2_level2", {"Phoenix": 3}, {"Queen": 2, "SporeCrawler": 1}),
    (
        "pvz_task3_level2",
        {"Stalker": 6, "Pylon": 3, "PhotonCannon": 1},
        {"Queen": 2, "SpineCrawler": 5, "OverlordTransport": 2},
    ),
    ("pvz_task3_level3", {"Stalker": 6, "Pylon": 3}, {"Queen": 2, "SpineCrawler": 5, "OverlordTransport": 2}),
    ("pvz_task4_level1", STALKERS, {"Roach": 15, "Ravager": 1}),
    ("pvz_task4_level2", STALKERS, {"Roach": 15, "Ravager": 2, "Queen": 1, "Overseer": 1}),
    ("pvz_task4_level2_paper", STALKERS, {"Roach": 15, "Ravager": 2, "Queen": 1}),
    ("pvz_task4_level3", STALKERS, {"Roach": 15, "Ravager": 3, "Queen": 2, "Overseer": 1}),
    (
        "pvz_task5_level3",
        {"Stalker": 12, "Colossus": 2, "Disruptor": 3, "Sentry": 4},
        {"Roach": 24, "Ravager": 9, "Queen": 2, "Ultralisk": 1, "SwarmHostMP": 2},
    ),
    (
        "pvz_task6_level3",
        {"Stalker": 12, "HighTemplar": 6, "Archon": 1, "Sentry": 4},
        {"Zergling": 64, "Baneling": 32, "Ultralisk": 3, "Queen": 4},
    ),
    (
        "pvz_task7_level2",
        {"Stalker": 12, "VoidRay": 6, "Tempest": 3, "Carrier": 3, "Mothership": 1},
        {"Viper": 3, "Hydralisk": 18, "Corruptor": 7, "BroodLord": 4, "Queen": 4, "Infestor": 2},
    ),
    (
        "pvz_task8_level2",
        {"Pylon": 7, "WarpGate": 8, "Stalker": 12, "WarpPrism": 2},
        {"Ravager": 3, "SporeCrawler": 3, "Queen": 4, "Roach": 15},
    ),
    ("SMAC_Maps/27m_vs_30m", {"Marine_RL": 27}, {"Marine": 30}),
    ("SMAC_Maps/MMM2", {"Marine_RL": 7, "Marauder_RL": 2, "Medivac_RL": 1}, {"Marine": 8, "Marauder": 3, "Medivac": 1}),
    (
        "SMAC_Maps/1c3s5z",
        {"Colossus_RL": 1, "Stalker_RL": 3, "Zealot_RL": 5},
        {"Colossus": 1, "Stalker": 3, "Zealot": 5},
    ),
    ("SMAC_Maps/2c_vs_64zg", {"Colossus_RL": 2}, {"Zergling": 64}),
    ("SMAC_Maps/2m_vs_1z", {"Marine_RL": 2}, {"Zealot": 1}),
    ("SMAC_Maps/bane_vs_bane", {"Zergling_RL": 20, "Baneling_RL": 4}, {"Zergling": 20, "Baneling": 4}),
    ("SMAC_Maps/6h_vs_8z", {"Hydralisk_RL": 6}, {"Zealot": 8}),
    ("SMAC_Maps/so_many_baneling", {"Zealot_RL": 7}, {"Baneling": 32}),
    ("BuildMarines", {"CommandCenter": 1, "SCV": 12}, {}),
    ("CollectMineralShards", {"Marine": 2}, {}),
    ("DefeatRoaches", {"Marine": 9}, {"Roach": 4}),
    ("DefeatZerglingsAndBanelings", {"Marine": 9}, {"Zergling": 6, "Baneling": 4}),
    ("FindAndDefeatZerglings", {"Marine": 3}, {"Zergling": 25}),
    ("MoveToBeacon", {"Marine": 1}, {}),
]

# number of neutral units of each type
NEUTRALS = [
    ("pvz_task4_level1", {"MineralField750": 16, "VespeneGeyser": 4}),
    ("debug_map", {"LabMineralField": 32, "VespeneGeyser": 7}),
    (
        "Simple64",
        {"MineralField": 16, "MineralField750": 16, "VespeneGeyser": 8, "UnbuildableRocksDestructible": 2},
    ),
    ("CollectMineralsAndGas", {"MineralField": 16, "VespeneGeyser": 4}),
    ("BuildMarines", {"MineralField": 8}),
    ("CollectMineralShards", {"NaturalMinerals": 20}),
    ("MoveToBeacon", {"Beacon_Terran": 1}),
]

# (map, minerals and vespene of the agent, ids of the agent's and of the opponent's upgrades)
PURSES = [
    ("pvz_task1_level1", (1000, 0), [130], []),
    ("pvz_task1_level3", (1000, 0), [], []),
    ("pvz_task2_level1", (1000, 0), [99], []),
    ("pvz_task3_level2", (1000, 0), [39, 42, 87], [62, 63]),
    ("pvz_task5_level1", (1000, 0), [50, 87], []),
    ("pvz_task6_level1", (1000, 0), [52, 87], [66]),
    ("pvz_task8_level1", (1600, 0), [49, 86, 87], []),
    ("debug_map", (50000, 20000), [84, 87], []),
    ("Simple64", (50, 0), [], []),
    ("2s3z", (0, 0), [], []),
    ("BuildMarines", (50, 0), [], []),
]

FAMILIES = {"llm_pysc2": 38, "SMAC_Maps": 24, "llm_smac": 9, "mini_games": 7, "Melee": 9, "duels": 3}


def army(world: World, player: int) -> dict[str, int]:
    """Return the units in the world and how many, without passengers."""
    return dict(Counter(world.unit_type(slot).name for slot in world.units_of(player).tolist()))


@cache
def begun(name: str) -> World:
    """Return a game at its start; not to be played."""
    return new_game(load_map(name))


def test_every_family_has_its_maps() -> None:
    assert Counter(name.partition("/")[0] for name in map_names()) == FAMILIES
    assert {name.partition("/")[0] for name in ONE_OF_A_FAMILY & {*map_names()}} == FAMILIES.keys()
    levels = {f"llm_pysc2/pvz_task{task}_level{level}" for task in range(1, 9) for level in (1, 2, 3)}
    assert levels < set(map_names())


@pytest.mark.parametrize(("name", "mine", "theirs"), ARMIES)
def test_a_map_begins_with_its_armies(name: str, mine: dict[str, int], theirs: dict[str, int]) -> None:
    world = begun(name)
    is_melee = world.map.scenario.melee
    assert army(world, 1) == {**(MELEE_1 if is_melee else {}), **mine}
    if theirs or is_melee:
        assert army(world, 2) == {**(MELEE_2 if is_melee else {}), **theirs}


@pytest.mark.parametrize(("name", "units"), NEUTRALS)
def test_a_map_has_its_neutral_units(name: str, units: dict[str, int]) -> None:
    assert army(begun(name), NEUTRAL) == units


@pytest.mark.parametrize(("name", "purse", "mine", "theirs"), PURSES)
def test_players_begin_with_what_the_map_gives(
    name: str, purse: tuple[float, float], mine: list[int], theirs: list[int]
) -> None:
    one, *others = begun(name).players[1:]
    assert (one.minerals, one.vespene) == purse
    assert one.upgrades == mine
    assert [player.upgrades for player in others[:1]] in ([theirs], [])


@pytest.mark.parametrize("name", ["duel_3m", "duel_8m", "duel_2s3z"])
def test_the_sides_of_a_duel_are_mirrored_unit_by_unit(name: str) -> None:
    world = begun(name)
    first, second = (world.units_of(player) for player in (1, 2))
    width = world.map.terrain.size[0]
    assert [world.unit_type(slot).name for slot in first] == [world.unit_type(slot).name for slot in second]
    assert world.pos[first].tolist() == [[width - x, y] for x, y in world.pos[second].tolist()]


ONE_OF_A_FAMILY = {
    "llm_smac/2s3z",
    "llm_pysc2/pvz_task8_level1",
    "SMAC_Maps/MMM2",
    "mini_games/DefeatZerglingsAndBanelings",
    "Melee/Simple64",
    "duels/duel_2s3z",
}


EVERY_MAP = pytest.mark.parametrize(
    "name", [pytest.param(n, marks=[] if n in ONE_OF_A_FAMILY else [pytest.mark.slow]) for n in map_names()]
)


@EVERY_MAP
def test_every_map_plays_300_loops_without_orders(name: str) -> None:
    world = new_game(load_map(name), seed=3)
    advance(world, 300)
    assert world.loop == 300 or world.ended
    x0, y0, x1, y1 = world.map.terrain.playable
    pos = world.pos[world.live]
    assert np.isfinite(pos).all()
    assert ((pos >= (x0, y0)) & (pos <= (x1, y1))).all()
    assert np.isfinite(world.life[world.live]).all()


@EVERY_MAP
def test_nobody_begins_inside_a_wall(name: str) -> None:
    world = begun(name)
    ground = [s for s in world.live.tolist() if not world.walled[s] and world.layer[s] == Layer.WALK]
    cells = world.pos[ground].astype(np.int64)
    assert world.map.terrain.walk[cells[:, 1], cells[:, 0]].all()


def test_energies_and_facings_are_those_of_the_map() -> None:
    world = begun("pvz_task5_level3")
    queens = [s for s in world.units_of(2).tolist() if world.unit_type(s).name == "Queen"]
    assert world.energy[queens].tolist() == [200, 200]
    facing = {tuple(world.pos[s].tolist()): world.facing()[s] for s in world.units_of(2).tolist()}
    assert facing[53.7426, 42.518] == pytest.approx(3.4934, abs=1e-4)
    assert facing[55.7426, 53.5988] == pytest.approx(4.0253, abs=1e-4)
    world = begun("pvz_task6_level1")
    templars = [s for s in world.units_of(1).tolist() if world.unit_type(s).name == "HighTemplar"]
    assert world.energy[templars].tolist() == [150] * 6


def test_the_types_of_smac_are_numbered_as_smac_derives_them() -> None:
    catalog = begun("SMAC_Maps/MMM").catalog
    names = ["Colossus", "Stalker", "Zealot", "Marauder", "Marine", "Medivac", "Baneling", "Zergling", "Hydralisk"]
    ids = {name: catalog.unit(f"{name}_RL").id for name in names}
    assert ids["Stalker"] == ids["Colossus"] + 1
    assert ids["Zealot"] == ids["Stalker"] + 1
    assert ids["Marine"] == ids["Marauder"] + 1
    assert ids["Medivac"] == ids["Marine"] + 1
    assert ids["Zergling"] == ids["Baneling"] + 1
    assert len(set(ids.values()) | {73, 74, 4, 9, 48, 51, 54, 105, 107}) == 18
    for name in ids:
        copy, base = catalog.unit(f"{name}_RL"), catalog.unit(name)
        assert copy.passive
        assert (copy.life, copy.shields, copy.speed_n, copy.sight) == (
            base.life,
            base.shields,
            base.speed_n,
            base.sight,
        )
        assert [w.id for w in copy.weapons] == [w.id for w in base.weapons]
        card = {ability.id for ability in catalog.abilities_of(copy.row)}
        assert card == {ability.id for ability in catalog.abilities_of(base.row)}


def test_the_learners_units_never_fight_by_themselves_and_standard_ones_do() -> None:
    for name, fights in (("SMAC_Maps/2s3z", False), ("llm_smac/2s3z", True)):
        world = new_game(load_map(name))
        advance(world, 160)
        mine = world.units_of(1)
        assert bool((world.target[mine] >= 0).any()) == fights
        assert world.players[1].score.damage_taken.shields > 0


def test_the_same_seed_draws_the_same_map_and_another_one_another() -> None:
    for name in ("MoveToBeacon", "FindAndDefeatZerglings", "Simple64", "DefeatRoaches"):
        places = [new_game(load_map(name), seed=seed).pos.tobytes() for seed in (1, 1, 2, 3, 4, 5)]
        assert places[0] == places[1]
        assert len(set(places)) > 1
