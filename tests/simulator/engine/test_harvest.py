"""Harvesting: rounds, loads, room at a field, exhaustion, and the resulting income."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import pytest

from khala_simulator.abilities import casting, commands
from khala_simulator.combat import buffs, lifecycle
from khala_simulator.economy import harvesting, melee_start
from khala_simulator.maps.game_map import load_map
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.tick import advance, new_game
from khala_simulator.world.casts import Cast
from khala_simulator.world.players import PlayerSetup

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_simulator.world.world import World
    from tests.simulator.engine.conftest import Field

WORKERS = {"Probe": "Nexus", "SCV": "CommandCenter", "Drone": "Hatchery"}
TERRANS = (PlayerSetup(1, "terran", "agent"), PlayerSetup(2, "terran", "agent"))
MINUTE = 1344


class Base:
    """A town hall with what a test puts around it."""

    def __init__(self, field: Field, worker: str = "Probe", resource: str = "MineralField") -> None:
        self.world = field.world
        self.field = field
        self.hall = field.put(WORKERS.get(worker, "CommandCenter"), 1, 50.5, 50.5)
        gas = resource not in ("MineralField", "RichMineralField")
        self.resource = field.put(resource, 1 if gas else 0, 57.5 if gas else 57.0, 50.5)
        self.worker = field.put(worker, 1, 54.5, 50.5)

    def gather(self) -> None:
        commands.gather(self.world, [self.worker], self.world.tag_of(self.resource))

    def first(self, condition: Callable[[], bool], limit: int = 600) -> int:
        for loop in self.field.loops(limit):
            if condition():
                return loop
        raise AssertionError("it never came")

    @property
    def minerals(self) -> float:
        return self.world.players[1].minerals


@pytest.fixture
def field(make_field: Callable[..., Field]) -> Field:
    return make_field("{flat: [72, 72]}")


@pytest.fixture
def base(field: Field) -> Base:
    field.world.players[1].minerals = 0.0
    return Base(field)


@pytest.mark.parametrize(
    ("worker", "resource", "amount", "buff"),
    [
        ("Probe", "MineralField", 5, "CarryMineralFieldMinerals"),
        ("SCV", "RichMineralField", 7, "CarryHighYieldMineralFieldMinerals"),
        ("Drone", "Extractor", 4, "CarryHarvestableVespeneGeyserGasZerg"),
        ("Probe", "AssimilatorRich", 8, "CarryHarvestableVespeneGeyserGasProtoss"),
        ("MULE", "MineralField", 25, "CarryMineralFieldMinerals"),
    ],
)
def test_a_trip_brings_what_the_resource_gives(
    field: Field, worker: str, resource: str, amount: int, buff: str
) -> None:
    base = Base(field, worker, resource)
    player = field.world.players[1]
    before, contents = player.minerals + player.vespene, int(field.world.contents[base.resource])
    base.gather()
    base.first(lambda: bool(field.world.load[base.worker]))
    assert buffs.has(field.world, base.worker, buff)
    base.first(lambda: player.minerals + player.vespene > before)
    assert player.minerals + player.vespene - before == amount
    assert field.world.contents[base.resource] == contents - amount
    assert not buffs.has(field.world, base.worker, buff)


@pytest.mark.parametrize(("worker", "factor"), [("Probe", 1.0), ("MULE", 2.05)])
def test_a_worker_stays_at_its_field_as_long_as_the_tables_say(field: Field, worker: str, factor: float) -> None:
    base = Base(field, worker)
    base.gather()
    phase = field.world.harvest
    began = base.first(lambda: phase[base.worker] == harvesting.Phase.AT_RESOURCE)
    done = base.first(lambda: phase[base.worker] != harvesting.Phase.AT_RESOURCE)
    assert done - began == pytest.approx(2.786 * 16 * factor, abs=1.0)


def test_its_order_says_which_way_a_worker_goes(base: Base) -> None:
    base.gather()
    base.field.play(1)
    (order,) = base.world.orders_of(base.worker)
    assert (order.ability, order.target) == (298, base.world.tag_of(base.resource))
    base.first(lambda: base.world.harvest[base.worker] == harvesting.Phase.TO_HALL)
    (order,) = base.world.orders_of(base.worker)
    assert (order.ability, order.target) == (299, base.world.tag_of(base.hall))


def test_only_one_worker_at_a_time_is_at_a_field(base: Base) -> None:
    second = base.field.put("Probe", 1, 54.5, 51.5)
    commands.gather(base.world, [base.worker, second], base.world.tag_of(base.resource))
    both = [base.worker, second]
    for _ in base.field.loops(500):
        assert (base.world.harvest[both] == harvesting.Phase.AT_RESOURCE).sum() <= 1
    assert base.minerals >= 35.0


def test_a_worker_before_a_taken_field_goes_to_a_free_one(base: Base) -> None:
    other = base.field.put("MineralField", 0, 57.0, 53.5)
    second = base.field.put("Probe", 1, 54.5, 49.5)
    commands.gather(base.world, [base.worker, second], base.world.tag_of(base.resource))
    base.field.play(60)
    assert {int(base.world.patch[s]) for s in (base.worker, second)} == {base.resource, other}


def test_an_empty_field_vanishes_and_its_worker_finds_another(base: Base) -> None:
    other = base.field.put("MineralField", 0, 57.0, 54.5)
    base.world.contents[base.resource] = 7
    tag = base.world.tag_of(base.resource)
    base.gather()
    base.first(lambda: base.minerals >= 7.0)
    assert base.world.slot_of(tag) < 0
    assert base.world.deaths[-1].tag == tag
    assert [alert.name for alert in base.world.alerts] == ["MineralsExhausted"]
    base.first(lambda: base.minerals >= 12.0)
    assert base.world.patch[base.worker] == other


def test_a_worker_without_a_field_left_is_idle(base: Base) -> None:
    base.world.contents[base.resource] = 5
    base.gather()
    base.first(lambda: base.minerals >= 5.0)
    base.field.play(2)
    assert base.world.orders_of(base.worker) == []


def test_a_worker_in_a_gas_structure_is_out_of_sight(field: Field) -> None:
    base = Base(field, "SCV", "Refinery")
    base.gather()
    began = base.first(lambda: base.world.carrier[base.worker] == base.resource)
    assert base.worker not in base.world.live
    done = base.first(lambda: base.worker in base.world.live)
    assert done - began == pytest.approx(1.981 * 16, abs=1.0)


def test_who_is_in_a_gas_structure_survives_it_and_keeps_out_of_fights(field: Field) -> None:
    base = Base(field, "SCV", "Refinery")
    base.gather()
    base.first(lambda: base.world.carrier[base.worker] == base.resource)
    base.world.life[base.resource] = 0.0
    field.play(1)
    assert base.worker in base.world.live
    assert base.world.harvest[base.worker] == harvesting.Phase.NONE


def test_workers_on_their_round_pass_through_each_other_and_others_do_not(base: Base) -> None:
    assert base.world.layer_bits[base.worker]
    base.gather()
    assert not base.world.layer_bits[base.worker]
    commands.move(base.world, [base.worker], (50.0, 40.0))
    assert base.world.layer_bits[base.worker]


def test_a_right_click_gathers_and_brings_home(base: Base) -> None:
    commands.smart(base.world, [base.worker], target=base.world.tag_of(base.resource))
    base.first(lambda: bool(base.world.load[base.worker]))
    commands.move(base.world, [base.worker], (56.0, 44.0))
    base.field.play(40)
    commands.smart(base.world, [base.worker], target=base.world.tag_of(base.hall))
    base.first(lambda: base.minerals == 5.0)


def test_an_order_that_waits_begins_after_the_load_is_delivered(base: Base) -> None:
    base.gather()
    base.first(lambda: bool(base.world.load[base.worker]))
    commands.return_cargo(base.world, [base.worker])
    commands.move(base.world, [base.worker], (50.0, 40.0), queue=True)
    base.first(lambda: base.minerals == 5.0)
    assert base.world.orders_of(base.worker)[0].point == (50.0, 40.0)


@pytest.mark.parametrize(
    ("worker", "target", "owner", "refusal"),
    [
        ("Probe", "Nexus", 1, ActionResult.MUST_TARGET_RESOURCES),
        ("Probe", "VespeneGeyser", 0, ActionResult.MUST_BUILD_REFINERY_FIRST),
        ("Probe", "Assimilator", 2, ActionResult.CANT_HARVEST_THAT_RESOURCE),
        ("Probe", "MineralField", 0, ActionResult.SUCCESS),
    ],
)
def test_what_can_be_gathered(field: Field, worker: str, target: str, owner: int, refusal: ActionResult) -> None:
    slot, resource = field.put(worker, 1, 54.5, 50.5), field.put(target, owner, 60.5, 50.5)
    assert casting.aim_refusal(field.world, Cast(slot, field.world.catalog.ability(298), resource)) is refusal


@pytest.fixture(scope="module")
def opening() -> dict[int, float]:
    """Return what the twelve workers of a melee game have delivered at some loops, on average of both players."""
    world = new_game(load_map("Simple64"), (PlayerSetup(1, "protoss", "agent"), PlayerSetup(2, "terran", "agent")))
    collected = {0: 0.0}
    for loop in (160, 320, 480, 640, 1344):
        advance(world, loop - world.loop)
        collected[loop] = sum(player.score.collected[0] for player in world.players[1:]) / 2.0
    assert harvesting.workers_per_resource(world).max() == 2  # two to a field at most
    return collected


@pytest.mark.parametrize(("loop", "low", "high"), [(160, 25, 45), (320, 115, 120), (480, 190, 205), (640, 270, 295)])
def test_an_opening_earns_what_recorded_games_show(
    opening: dict[int, float], loop: int, low: float, high: float
) -> None:
    assert low <= opening[loop] <= high


def test_twelve_workers_earn_57_to_58_each_a_minute(opening: dict[int, float]) -> None:
    rate = (opening[1344] - opening[320]) / (1344 - 320) * MINUTE / 12
    assert 57.0 * 0.97 <= rate <= 58.0 * 1.03


def line(world: World, count: int, kind: str = "SCV") -> list[int]:
    """Put ``count`` workers before the fields of each player of a melee game, and no others; return all of them."""
    for slot in (s for s in world.live.tolist() if world.unit_type(s).worker):
        lifecycle.remove(world, slot)
    made = []
    for player in world.players[1:]:
        assert player.start is not None
        fields = melee_start.mineral_fields(world, player.start)
        for rank in range(count):
            field = int(fields[rank % len(fields)])
            x, y = ((world.pos[field] + player.start) / 2.0).tolist()
            made.append(lifecycle.spawn(world, world.catalog.unit(kind), player.id, (x, y)))
            commands.gather(world, made[-1:], world.tag_of(field))
    return made


def a_minute(world: World) -> float:
    advance(world, MINUTE // 2)
    before = sum(player.score.collected[0] for player in world.players[1:])
    advance(world, MINUTE)
    return (sum(player.score.collected[0] for player in world.players[1:]) - before) / 2.0


@pytest.mark.parametrize(
    ("count", "published", "within"),
    [(16, 944, 0.02), pytest.param(24, 1144, 0.03, marks=pytest.mark.slow)],
)
def test_a_line_earns_what_is_published(count: int, published: float, within: float) -> None:
    world = new_game(load_map("Simple64"), TERRANS)
    line(world, count)
    assert a_minute(world) == pytest.approx(published, rel=within)


@pytest.mark.slow
def test_a_trip_takes_two_walks_from_rest_to_rest_and_the_time_at_the_field() -> None:
    world = new_game(load_map("Simple64"), TERRANS)
    workers = line(world, 8)
    arrivals: dict[int, list[int]] = {slot: [] for slot in workers}
    before = world.harvest[workers]
    for _ in range(500):
        advance(world)
        for slot, phase, last in zip(workers, world.harvest[workers], before, strict=True):
            if phase == harvesting.Phase.AT_RESOURCE != last:
                arrivals[slot].append(world.loop)
        before = world.harvest[workers]
    for slot, loops in arrivals.items():
        start = world.players[int(world.owner[slot])].start
        assert start is not None
        way = math.dist(world.pos[world.patch[slot]].tolist(), start) - (2.75 + 1.125 + 2 * 0.375)
        expected = 45 + 8 + 4.0 * math.sqrt(way / (2.5 / 16**2))
        assert loops[-1] - loops[-2] == pytest.approx(expected, abs=5)


@pytest.mark.slow
def test_a_mule_brings_200_to_250_in_its_life() -> None:
    world = new_game(load_map("Simple64"), TERRANS)
    line(world, 8, "MULE")
    advance(world, 1440)
    brought = sum(player.score.collected[0] for player in world.players[1:]) / 16.0
    assert 200.0 <= brought <= 250.0


def test_a_geyser_gives_three_workers_at_most_160_a_minute(field: Field) -> None:
    base = Base(field, "Probe", "Assimilator")
    workers = [base.worker, *(field.put("Probe", 1, 54.5, 50.5 + side) for side in (-1.0, 1.0))]
    commands.gather(field.world, workers, field.world.tag_of(base.resource))
    field.play(MINUTE // 4)
    before = field.world.players[1].vespene
    field.play(MINUTE)
    assert field.world.players[1].vespene - before == pytest.approx(160, rel=0.03)


def test_a_field_is_free_two_loops_after_its_worker_is_done(base: Base) -> None:
    second = base.field.put("Probe", 1, 54.5, 50.0)
    commands.gather(base.world, [base.worker, second], base.world.tag_of(base.resource))
    at = int(harvesting.Phase.AT_RESOURCE)
    both = [base.worker, second]
    base.first(lambda: bool((base.world.harvest[both] == at).any()))
    done = base.first(lambda: not (base.world.harvest[both] == at).any())
    next_one = base.first(lambda: bool((base.world.harvest[both] == at).any()))
    assert next_one - done == 2
