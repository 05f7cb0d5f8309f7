"""Creep: how it spreads, recedes and matters, by the masks and periods of each version."""

from __future__ import annotations

import json
import math
from importlib import resources
from typing import TYPE_CHECKING, Any

import pytest

from khala_simulator.abilities import casting, commands
from khala_simulator.combat import lifecycle
from khala_simulator.systems.creep import makers, needy
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.tables.catalog import load_catalog
from khala_simulator.tables.mechanics import MECHANICS

if TYPE_CHECKING:
    from collections.abc import Callable

VERSIONS = ("4.10", "5.0.13")
GENERATE, STOP = 1692, 1693
FLAT = "{flat: [64, 64]}"


def table(version: str) -> Any:
    path = resources.files("khala_simulator.data") / "tables" / version / "creep.json"
    return json.loads(path.read_text(encoding="utf-8"))


def mask(version: str, unit: str, stage: str) -> int:
    """Return how many cells a stage of a unit's creep has."""
    row = next(row for row in table(version)["rows"] if row["unit"] == unit)
    rows = next(m["rows"] for m in table(version)["masks"] if m["id"] == row[stage])
    return sum(text.count("o") for text in rows)


@pytest.fixture(params=[VERSIONS[0], pytest.param(VERSIONS[1], marks=pytest.mark.slow)])
def ground(request: pytest.FixtureRequest, make_field: Callable[..., Any]) -> Any:
    """Return level ground of each version, wide enough for all of a town hall's creep."""
    return make_field(FLAT, version=request.param)


def covered(field: Any) -> int:
    return int(field.world.creep.sum())


def test_a_hall_of_the_start_has_all_its_creep(ground: Any) -> None:
    ground.put("Hatchery", 2, 32.5, 32.5)
    ground.play(1)
    assert covered(ground) == mask(ground.world.catalog.version, "Hatchery", "grown")
    assert ground.world.creep[32, 32]
    assert not ground.world.creep[32, 50]


@pytest.mark.parametrize("unit", ["Hatchery", "CreepTumorBurrowed", "NydusCanal"])
def test_creep_spreads_from_a_new_source_step_by_step(ground: Any, unit: str) -> None:
    version = ground.world.catalog.version
    birth, grown = mask(version, unit, "birth"), mask(version, unit, "grown")
    period = next(row["period_loops"] for row in table(version)["rows"] if row["unit"] == unit)
    ground.play(3)
    ground.put(unit, 2, 32.5, 32.5)
    ground.play(1)
    born = ground.world.loop
    assert covered(ground) == birth
    for steps in (1, 3, 10):
        ground.play(math.ceil(born + steps * period) - ground.world.loop)
        assert covered(ground) == min(birth + steps * MECHANICS.creep_cells_per_step, grown)
    ground.play(math.ceil((grown - birth) / MECHANICS.creep_cells_per_step * period) + 10)
    assert covered(ground) == grown


def test_creep_recedes_from_outside_when_its_source_is_gone(ground: Any) -> None:
    hall = ground.put("Hatchery", 2, 32.5, 32.5)
    ground.play(1)
    whole = covered(ground)
    commands.debug_kill(ground.world, [ground.world.tag_of(hall)])
    ground.play(int(MECHANICS.creep_decay_loops) - 1)
    assert covered(ground) == whole
    ground.play(40)
    assert 0 < covered(ground) < whole
    assert ground.world.creep[32, 32]
    ground.play(800)
    assert covered(ground) == 0
    assert not ground.world.growth.sources


def test_cells_with_two_sources_keep_their_creep(ground: Any) -> None:
    hall = ground.put("Hatchery", 2, 32.5, 32.5)
    ground.put("CreepTumorBurrowed", 2, 38.5, 32.5)
    ground.play(1)
    commands.debug_kill(ground.world, [ground.world.tag_of(hall)])
    ground.play(900)
    assert covered(ground) == mask(ground.world.catalog.version, "CreepTumorBurrowed", "grown")


def test_an_unfinished_structure_has_no_creep(ground: Any) -> None:
    hall = ground.put("Hatchery", 2, 32.5, 32.5)
    ground.world.build_progress[hall] = 0.5
    ground.play(10)
    assert covered(ground) == 0


def test_creep_stays_off_ground_that_nobody_can_walk_on(make_field: Callable[..., Any]) -> None:
    field = make_field()
    field.put("Hatchery", 2, 6.5, 6.5)
    field.play(1)
    terrain = field.world.map.terrain
    assert not (field.world.creep & ~(terrain.walk | terrain.build)).any()


def test_a_hall_keeps_its_creep_when_it_becomes_a_lair(ground: Any) -> None:
    hall = ground.put("Hatchery", 2, 32.5, 32.5)
    ground.play(1)
    before = ground.world.creep.copy()
    lifecycle.become(ground.world, hall, ground.world.catalog.unit("Lair"))
    ground.play(100)
    assert (ground.world.creep == before).all()


@pytest.mark.parametrize("unit", ["Zergling", "Queen", "SpineCrawlerUprooted", "Marine"])
def test_creep_quickens_zerg_on_the_ground(ground: Any, unit: str) -> None:
    world = ground.world
    ground.put("Hatchery", 2, 32.5, 40.5)
    on, off = ground.put(unit, 1, 26, 33), ground.put(unit, 1, 26, 10)
    ground.play(1)
    commands.move(world, [on], (38.0, 33.0))
    commands.move(world, [off], (38.0, 10.0))
    ground.play(24)
    start = {slot: world.pos[slot].copy() for slot in (on, off)}
    ground.play(8)
    far_on, far_off = (math.dist(world.pos[slot], start[slot]) for slot in (on, off))
    assert far_on == pytest.approx(far_off * world.catalog.unit(unit).creep_factor, rel=1e-6)


@pytest.mark.parametrize(("unit", "upgrade"), [("Hydralisk", "EvolveMuscularAugments"),
                                               ("Ultralisk", "AnabolicSynthesis")])  # fmt: skip
def test_an_upgrade_can_change_what_creep_does(make_field: Callable[..., Any], unit: str, upgrade: str) -> None:
    field = make_field(FLAT, version="5.0.13")
    slot = field.put(unit, 1, 32, 32)
    change = next(
        c for c in field.world.catalog.upgrade(upgrade).changes if (c.entry, c.field) == (unit, "SpeedMultiplierCreep")
    )
    plain = field.world.catalog.unit(unit).creep_factor
    assert field.world.creep_factor[slot] == plain
    field.research(1, upgrade)
    expected = {"set": change.value, "add": plain + change.value, "subtract": plain - change.value}[change.op]
    assert field.world.creep_factor[slot] == pytest.approx(expected)
    assert expected != plain


# structures that need it ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("version", VERSIONS)
def test_the_structures_that_wither_are_those_that_need_creep_and_make_none(version: str) -> None:
    catalog = load_catalog(version)
    names = {unit.name for unit in catalog.units if needy(catalog)[unit.row]}
    assert names == {
        "SpawningPool", "EvolutionChamber", "HydraliskDen", "Spire", "UltraliskCavern", "InfestationPit",
        "NydusNetwork", "BanelingNest", "RoachWarren", "SpineCrawler", "SporeCrawler", "GreaterSpire", "LurkerDenMP",
    }  # fmt: skip


@pytest.mark.parametrize("version", VERSIONS)
def test_creep_comes_from_what_makes_it_and_from_overlords(version: str) -> None:
    catalog = load_catalog(version)
    names = {unit.name for unit in catalog.units if makers(catalog)[unit.row]}
    assert names == {unit.name for unit in catalog.units if unit.makes_creep} | {"Overlord", "OverlordTransport"}


def test_a_structure_off_creep_withers(ground: Any) -> None:
    world = ground.world
    pool = lifecycle.spawn(world, world.catalog.unit("SpawningPool"), 2, (20.5, 20.5))
    ground.play(1)
    before, regained = float(world.life[pool]), float(world.life_regen[pool])
    ground.play(160)
    periods = 160 / world.catalog.buff("ZergBuildingNotOnCreep").period_loops
    expected = periods * MECHANICS.off_creep_damage - 160 * regained
    assert before - world.life[pool] == pytest.approx(expected, abs=MECHANICS.off_creep_damage + 0.1)


def test_a_structure_on_creep_does_not_wither(ground: Any) -> None:
    ground.put("Hatchery", 2, 32.5, 32.5)
    pool = lifecycle.spawn(ground.world, ground.world.catalog.unit("SpawningPool"), 2, (38.5, 32.5))
    ground.play(100)
    assert ground.world.life[pool] == ground.world.life_max[pool]


# Overlords ------------------------------------------------------------------------------------------------------------


@pytest.fixture
def overlord(ground: Any) -> int:
    ground.put("Lair", 1, 12.5, 12.5)
    slot: int = ground.put("Overlord", 1, 45.5, 45.5)
    ground.play(1)
    return slot


def test_an_overlord_lets_creep_fall_after_it_has_stood_a_while(ground: Any, overlord: int) -> None:
    world = ground.world
    delay = next(row["delay_loops"] for row in table(world.catalog.version)["rows"] if row["unit"] == "Overlord")
    assert ground.order(overlord, GENERATE)
    ground.play(1)
    ground.play(int(delay) - 2)
    assert not world.creep[45, 45]
    ground.play(12)
    assert world.creep[45, 45]
    ground.play(400)
    assert world.creep[45, 48]
    assert not world.creep[45, 52]


def test_an_overlord_lets_creep_fall_where_nothing_else_makes_any(ground: Any) -> None:
    slot = ground.put("Overlord", 1, 45.5, 45.5)
    ground.world.players[1].cheats.append("tech_tree")
    ground.play(1)
    assert ground.order(slot, GENERATE)
    ground.play(200)
    assert ground.world.creep[45, 45]


@pytest.mark.parametrize("how", ["it is told to stop", "it flies away"])
def test_an_overlords_creep_recedes(ground: Any, overlord: int, how: str) -> None:
    world = ground.world
    assert ground.order(overlord, GENERATE)
    ground.play(200)
    if how == "it flies away":
        commands.move(world, [overlord], (55.0, 55.0))
    else:
        assert ground.order(overlord, STOP)
    ground.play(400)
    assert not world.creep[45, 45]


def test_creep_from_overlords_needs_a_lair(ground: Any) -> None:
    slot = ground.put("Overlord", 1, 45.5, 45.5)
    ability = ground.world.catalog.ability(GENERATE)
    assert casting.refusal(ground.world, slot, ability) is ActionResult.TECH_REQUIREMENTS_NOT_MET


def test_creep_is_part_of_what_decides_the_future(ground: Any) -> None:
    ground.play(2)
    before = ground.world.digest()
    ground.world.growth.add(0, "Hatchery", (32, 32), 2, grown=False)
    assert ground.world.digest() != before
