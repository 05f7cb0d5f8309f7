"""Production: prices, times, queues, rally points, changing kind, and calling off."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from khala_simulator.abilities import casting
from khala_simulator.abilities.shared import production as skills
from khala_simulator.combat.buffs import apply
from khala_simulator.economy import supply
from khala_simulator.economy.production import QUEUE, REACTOR_QUEUE
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.tables.catalog import load_catalog
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from tests.simulator.engine.conftest import Field

CATALOG = load_catalog()
TRAIN = {"Probe": 1006, "SCV": 524, "Marine": 560, "Zealot": 916, "Zergling": 1343, "Drone": 1342, "Queen": 1632}
CANCEL = {"Nexus": 1831, "Barracks": 306, "Egg": 304}


@pytest.fixture
def rich(field: Field) -> Field:
    """Return a field with plenty of everything for player 1."""
    player = field.world.players[1]
    player.minerals = player.vespene = 1000.0
    player.cheats.append("food")
    return field


def order(field: Field, slots: list[int], number: int, **aim: object) -> list[int]:
    return casting.use(field.world, slots, field.world.catalog.ability(number), **aim)  # type: ignore[arg-type]  # a short name for tests


def born(field: Field, name: str, limit: int = 3000) -> list[int]:
    """Return the loops in which units of a type come, until none is in a queue."""
    row = field.world.catalog.unit(name).row
    seen, loops = 0, []
    for loop in field.loops(limit):
        now = int((field.world.alive & (field.world.type == row)).sum())
        loops += [loop] * (now - seen)
        seen = now
        if not field.world.jobs:
            return loops
    raise AssertionError("it is still going on")


@pytest.mark.parametrize(
    ("parent", "name"), [("Nexus", "Probe"), ("CommandCenter", "SCV"), ("Barracks", "Marine"), ("Gateway", "Zealot")]
)
def test_training_costs_and_lasts_what_the_tables_say(rich: Field, parent: str, name: str) -> None:
    way = next(way for way in CATALOG.unit(name).made_by if way.producer == parent)
    rich.put("Pylon", 1, 20.0, 16.0)
    slot = rich.put(parent, 1, 16.0, 16.0)
    rich.world.players[1].minerals = 1000.0
    assert order(rich, [slot], TRAIN[name]) == [slot]
    assert 1000.0 - rich.world.players[1].minerals == way.cost[0]
    assert born(rich, name) == [way.loops]


def test_births_follow_each_other_a_loop_sooner_than_the_time_of_one(rich: Field) -> None:
    nexus = rich.put("Nexus", 1, 16.0, 16.0)
    for _ in range(3):
        order(rich, [nexus], TRAIN["Probe"])
    assert born(rich, "Probe") == [272, 272 + 271, 272 + 271 * 2]


def test_a_reactor_makes_two_at_a_time_and_room_for_eight(rich: Field) -> None:
    barracks, reactor = rich.put("Barracks", 1, 14.5, 16.5), rich.put("BarracksReactor", 1, 17.0, 16.0)
    rich.world.addon[barracks] = reactor
    for _ in range(REACTOR_QUEUE + 1):
        order(rich, [barracks], TRAIN["Marine"])
    assert len(rich.world.jobs[barracks]) == REACTOR_QUEUE
    assert born(rich, "Marine")[:4] == [400, 400, 799, 799]


def test_a_queue_has_room_for_five(rich: Field) -> None:
    barracks = rich.put("Barracks", 1, 16.0, 16.0)
    for _ in range(QUEUE):
        assert order(rich, [barracks], TRAIN["Marine"])
    assert casting.refusal(rich.world, barracks, CATALOG.ability(560)) is ActionResult.QUEUE_IS_FULL
    assert not order(rich, [barracks], TRAIN["Marine"])
    assert rich.world.players[1].minerals == 1000.0 - QUEUE * 50


def test_of_several_structures_the_one_with_the_shortest_queue_trains(rich: Field) -> None:
    first, second = rich.put("Barracks", 1, 10.0, 16.0), rich.put("Barracks", 1, 20.0, 16.0)
    taken = [order(rich, [first, second], TRAIN["Marine"]) for _ in range(4)]
    assert taken == [[first], [second], [first], [second]]


@pytest.mark.parametrize(
    ("minerals", "room", "refusal"),
    [
        (49.0, True, ActionResult.NOT_ENOUGH_MINERALS),
        (50.0, False, ActionResult.NOT_ENOUGH_FOOD),
        (50.0, True, ActionResult.SUCCESS),
    ],
)
def test_what_can_be_trained(field: Field, minerals: float, room: bool, refusal: ActionResult) -> None:
    nexus = field.put("Nexus", 1, 16.0, 16.0)
    field.world.players[1].minerals = minerals
    for i in range(14 + (not room)):
        field.put("Probe", 1, 4.0 + i, 4.0)
    assert casting.refusal(field.world, nexus, CATALOG.ability(1006)) is refusal


def test_a_job_without_supply_waits_until_there_is_some(field: Field) -> None:
    nexus = field.put("Nexus", 1, 16.0, 16.0)
    field.world.players[1].minerals = 200.0
    for i in range(14):
        field.put("Probe", 1, 4.0 + i, 4.0)
    order(field, [nexus], TRAIN["Probe"])
    order(field, [nexus], TRAIN["Probe"])
    field.play(400)
    assert [job.begun for job in field.world.jobs[nexus]] == [False]
    assert (supply.in_use(field.world, 1), supply.cap(field.world, 1)) == (15.0, 15.0)
    field.put("Pylon", 1, 24.0, 24.0)
    field.play(272)
    assert nexus not in field.world.jobs


def test_the_orders_of_a_structure_are_its_queue(rich: Field) -> None:
    nexus = rich.put("Nexus", 1, 16.0, 16.0)
    order(rich, [nexus], TRAIN["Probe"])
    order(rich, [nexus], TRAIN["Probe"])
    rich.play(136)
    first, second = rich.world.orders_of(nexus)
    assert (first.ability, first.progress, second.progress) == (1006, 0.5, 0.0)


def test_chrono_boost_makes_work_pass_faster(rich: Field) -> None:
    nexus = rich.put("Nexus", 1, 16.0, 16.0)
    apply(rich.world, nexus, "ChronoBoostEnergyCost")
    order(rich, [nexus], TRAIN["Probe"])
    assert born(rich, "Probe") == [round(272 / 1.5 + 0.5)]


def test_calling_off_gives_everything_back(rich: Field) -> None:
    nexus = rich.put("Nexus", 1, 16.0, 16.0)
    order(rich, [nexus], TRAIN["Probe"])
    order(rich, [nexus], TRAIN["Probe"])
    rich.play(100)
    order(rich, [nexus], CANCEL["Nexus"])
    assert (rich.world.players[1].minerals, len(rich.world.jobs[nexus])) == (950.0, 1)
    order(rich, [nexus], CANCEL["Nexus"])
    assert (rich.world.players[1].minerals, rich.world.jobs) == (1000.0, {})
    assert casting.refusal(rich.world, nexus, CATALOG.ability(1831)) is ActionResult.CANT_FIND_CANCEL_ORDER


def test_a_click_calls_off_the_job_at_its_place(rich: Field) -> None:
    hatchery = rich.put("Hatchery", 1, 16.0, 16.0)
    rich.put("SpawningPool", 1, 24.5, 24.5)
    for _ in range(3):
        order(rich, [hatchery], TRAIN["Queen"])
    rich.play(10)
    assert skills.cancel_at(rich.world, hatchery, 0)
    assert [job.done for job in rich.world.jobs[hatchery]] == [0.0, 0.0]
    assert not skills.cancel_at(rich.world, hatchery, 7)


def test_a_larva_becomes_an_egg_and_two_zerglings(rich: Field) -> None:
    rich.put("SpawningPool", 1, 24.5, 24.5)
    larva = rich.put("Larva", 1, 16.0, 16.0)
    tag = rich.world.tag_of(larva)
    order(rich, [larva], TRAIN["Zergling"])
    assert rich.world.unit_type(larva).name == "Egg"
    assert rich.world.players[1].minerals == 950.0
    assert born(rich, "Zergling") == [1 + 384, 1 + 384]  # clients see the egg a loop after the order
    assert rich.world.tag_of(larva) == tag
    assert supply.in_use(rich.world, 1) == 1.0


def test_an_egg_that_is_called_off_is_a_larva_again(rich: Field) -> None:
    larva = rich.put("Larva", 1, 16.0, 16.0)
    order(rich, [larva], TRAIN["Drone"])
    order(rich, [larva], CANCEL["Egg"])
    assert rich.world.unit_type(larva).name == "Larva"
    assert rich.world.players[1].minerals == 1000.0


def test_new_units_go_to_the_rally_point_and_workers_to_their_own(rich: Field) -> None:
    nexus = rich.put("Nexus", 1, 12.5, 16.5)
    field = rich.put("MineralField", 0, 20.0, 16.5)
    order(rich, [nexus], 207, target=rich.world.tag_of(field))
    order(rich, [nexus], TRAIN["Probe"])
    rich.play(273)
    probe = next(s for s in rich.world.units_of(1).tolist() if rich.world.unit_type(s).worker)
    assert rich.world.patch[probe] == field
    barracks = rich.put("Barracks", 1, 12.5, 8.5)
    order(rich, [barracks], 195, point=(25.0, 8.0))
    order(rich, [barracks], TRAIN["Marine"])
    rich.play(400)
    marine = next(s for s in rich.world.units_of(1).tolist() if rich.world.unit_type(s).name == "Marine")
    assert rich.world.orders_of(marine)[0].point == (25.0, 8.0)
    assert rich.world.pos[marine, 0] > 12.5


def test_a_command_center_becomes_an_orbital_command(rich: Field) -> None:
    centre = rich.put("CommandCenter", 1, 16.5, 16.5)
    assert casting.refusal(rich.world, centre, CATALOG.ability(1516)) is ActionResult.TECH_REQUIREMENTS_NOT_MET
    rich.put("Barracks", 1, 24.5, 24.5)
    order(rich, [centre], 1516)
    assert rich.world.players[1].minerals == 850.0
    assert casting.refusal(rich.world, centre, CATALOG.ability(524)) is ActionResult.CANT_QUEUE_THAT_ORDER
    rich.play(int(CATALOG.ability(1516).loops))
    assert rich.world.unit_type(centre).name == "OrbitalCommand"
    assert rich.world.energy[centre] == pytest.approx(50.0, abs=0.1)


def test_a_gateway_becomes_a_warp_gate_by_itself(rich: Field) -> None:
    gateway = rich.put("Gateway", 1, 16.5, 16.5)
    rich.put("Pylon", 1, 20.0, 16.0)
    rich.world.players[1].upgrades.append(CATALOG.upgrade("WarpGateResearch").id)
    rich.play(170)
    assert rich.world.unit_type(gateway).name == "WarpGate"


def test_a_contaminated_structure_makes_nothing(rich: Field) -> None:
    nexus = rich.put("Nexus", 1, 16.0, 16.0)
    order(rich, [nexus], TRAIN["Probe"])
    rich.play(10)
    apply(rich.world, nexus, "Contaminated")
    rich.play(100)
    assert rich.world.jobs[nexus][0].done == 10


def test_idle_workers_and_structures_are_counted(rich: Field) -> None:
    nexus = rich.put("Nexus", 1, 16.0, 16.0)
    rich.put("Probe", 1, 8.0, 8.0)
    rich.play(160)
    score = rich.world.players[1].score
    assert (score.idle_worker_s, score.idle_production_s) == (10.0, 10.0)
    order(rich, [nexus], TRAIN["Probe"])
    rich.play(160)
    assert (score.idle_worker_s, score.idle_production_s) == (20.0, 10.0)


def test_the_dead_make_nothing(rich: Field) -> None:
    nexus = rich.put("Nexus", 1, 16.0, 16.0)
    order(rich, [nexus], TRAIN["Probe"])
    rich.world.life[nexus] = 0.0
    rich.play(300)
    assert rich.world.jobs == {}
    assert rich.world.players[1].underway == []
    assert rich.world.slot_of(rich.world.tag_of(nexus)) == NOBODY


def test_births_are_told(rich: Field) -> None:
    nexus = rich.put("Nexus", 1, 16.0, 16.0)
    order(rich, [nexus], TRAIN["Probe"])
    rich.play(272)
    (alert,) = rich.world.alerts
    assert (alert.loop, alert.player, alert.name) == (272, 1, "TrainWorkerComplete")
