"""Chrono Boost, recall, MULEs, larvae, creep: which unit uses it, on what target, and that the game then does it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import pytest
from s2clientprotocol import debug_pb2

from khala_bridge.auto import RULES, NotAvailable, RuleRequest
from khala_bridge.auto.openings import tumor_places
from khala_bridge.auto.spread import TUMOR_REACH
from khala_bridge.catalogue.action import Action
from khala_bridge.frames import Camera, MapFrame, WorldPoint
from khala_bridge.state.ground import land_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.bridge.auto.conftest import Game

RICH = (debug_pb2.all_resources, debug_pb2.food)
BOOSTED = 281


@pytest.fixture
def protoss(make_game: Callable[..., Game]) -> Game:
    game = make_game("Flat64")
    game.cheat(*RICH)
    game.put("Pylon", 44, 20)
    game.put("Gateway", 41.5, 20.5)
    game.put("Forge", 44.5, 24.5)
    game.energize("Nexus")
    return game


@pytest.mark.parametrize(
    ("work", "action", "boosted"),
    [
        ("Train_Probe", "ChronoBoost_Economy", "Nexus"),
        ("Train_Zealot", "ChronoBoost_Military", "Gateway"),
        ("Research_ProtossGroundWeapons", "ChronoBoost_Research", "Forge"),
    ],
)
def test_what_works_is_boosted_once(protoss: Game, work: str, action: str, boosted: str) -> None:
    assert "is not possible now" in protoss.refusal(action).message
    protoss.do(protoss.say(work))
    protoss.play(2)
    orders = protoss.say(action)
    assert orders[0].target == protoss.own(boosted)[0].tag
    assert protoss.do(orders) == ["Success"]
    protoss.play(5)
    assert BOOSTED in protoss.own(boosted)[0].buff_ids
    assert "not boosted yet" in protoss.refusal(action).message


def test_a_nexus_goes_on_training_while_it_boosts(protoss: Game) -> None:
    protoss.do(protoss.say("Train_Zealot"))
    protoss.play(2)
    protoss.say("ChronoBoost_Military")
    assert protoss.say("Train_Probe")[0].units == (protoss.own("Nexus")[0].tag,)


def test_energy_is_spent_once_in_a_turn(protoss: Game) -> None:
    gateway, nexus = protoss.own("Gateway")[0].tag, protoss.own("Nexus")[0]
    for _ in range(int(nexus.energy // 50)):
        protoss.say("Ability_ChronoBoost_Unit", tag=gateway)
    assert protoss.refusal("Ability_ChronoBoost_Unit", tag=gateway).message == (
        "Ability_ChronoBoost_Unit is not possible now: it needs 50 energy, and your Nexus "
        f"{hex(nexus.tag)} has {int(nexus.energy) % 50}."
    )


def test_units_near_the_named_one_are_recalled(protoss: Game) -> None:
    zealot = protoss.put("Zealot", 20, 40)
    (order,) = protoss.say("Ability_NexusMassRecall_Near", tag=zealot)
    assert order.target == pytest.approx((20, 40), abs=0.1)
    assert protoss.do([order]) == ["Success"]
    protoss.play(200)
    nexus = protoss.own("Nexus")[0]
    unit = protoss.snapshot.units[zealot]
    assert math.dist((unit.pos.x, unit.pos.y), (nexus.pos.x, nexus.pos.y)) < 8


def test_a_mule_is_dropped_on_minerals_of_the_own_base(make_game: Callable[..., Game]) -> None:
    game = make_game("Flat64", "terran")
    assert game.refusal("Calldown_MULE").message == (
        "Calldown_MULE is not possible now: you have no OrbitalCommand; build one first."
    )
    game.put("OrbitalCommand", 40.5, 30.5)
    game.energize("OrbitalCommand")
    (order,) = game.say("Calldown_MULE")
    assert isinstance(order.target, int)
    field = game.snapshot.units[order.target]
    halls = [(hall.pos.x, hall.pos.y) for hall in land_of(game.snapshot).own_halls]
    assert min(math.dist((field.pos.x, field.pos.y), hall) for hall in halls) < 10
    assert game.do([order]) == ["Success"]
    game.play(100)
    assert len(game.own("MULE")) == 1


def test_a_scan_shows_a_point(make_game: Callable[..., Game]) -> None:
    game = make_game("Flat64", "terran")
    game.put("OrbitalCommand", 40.5, 30.5)
    game.energize("OrbitalCommand")
    assert game.do(game.say("Scan_Minimap", point=WorldPoint(20, 50))) == ["Success"]
    game.play(10)
    assert land_of(game.snapshot).sight[20, 50] == 2


def test_each_hatchery_is_injected_by_the_nearest_queen(make_game: Callable[..., Game]) -> None:
    game = make_game("Flat64", "zerg")
    game.put("Hatchery", 30.5, 30.5)
    game.put("Queen", 30, 26)
    game.put("Queen", 45, 17)
    game.energize("Queen")
    orders = game.say("Inject_Larva")
    halls = {u.tag: (u.pos.x, u.pos.y) for u in game.own("Hatchery")}
    assert {order.target for order in orders} == set(halls)
    for order in orders:
        queen = game.snapshot.units[order.units[0]]
        assert isinstance(order.target, int)
        assert math.dist((queen.pos.x, queen.pos.y), halls[order.target]) < 12
    assert game.do(orders) == ["Success", "Success"]
    game.play(150)
    assert all(11 in unit.buff_ids for unit in game.own("Hatchery"))
    game.energize("Queen")
    assert "has it already" in game.refusal("Inject_Larva").message


def test_a_queen_plants_a_tumor_on_creep_away_from_what_makes_it(make_game: Callable[..., Game]) -> None:
    game = make_game("Flat64", "zerg")
    game.put("Queen", 46, 20)
    game.energize("Queen")
    game.play(20)
    (order,) = game.say("Spread_Creep")
    assert isinstance(order.target, WorldPoint)
    assert land_of(game.snapshot).creep[int(order.target.x), int(order.target.y)]
    hall = game.own("Hatchery")[0]
    assert math.dist(order.target, (hall.pos.x, hall.pos.y)) > 6
    assert game.do([order]) == ["Success"]
    game.play(160)
    assert len(game.own("CreepTumorQueen")) + len(game.own("CreepTumorBurrowed")) == 1


def test_places_for_a_tumor_are_those_that_the_game_takes(make_game: Callable[..., Game]) -> None:
    game = make_game("Flat64", "zerg")
    game.put("Queen", 46, 20)
    game.play(20)
    view = game.snapshot, Camera(46, 20), MapFrame(64, 64, (0, 0, 64, 64)), 5
    spots = tumor_places([], *view)
    assert [game.may_stand("Build_CreepTumor_Queen_screen", spot) for spot in spots] == ["Success"] * 5
    tumor = spots[0]
    assert all(math.dist(spot, tumor) <= TUMOR_REACH for spot in tumor_places([tumor], *view))
    assert tumor_places([WorldPoint(20, 50)], *view) == []


def test_what_is_trained_is_called_off(protoss: Game) -> None:
    protoss.do(protoss.say("Train_Zealot"))
    protoss.play(2)
    gateway = protoss.own("Gateway")[0].tag
    assert protoss.do(protoss.say("Stop_Building_Unit", tag=gateway)) == ["Success"]
    protoss.play(2)
    assert not protoss.own("Gateway")[0].orders
    assert protoss.refusal("Stop_Building_Unit", tag=gateway).message == (
        f"Stop_Building_Unit is not possible now: the Gateway {hex(gateway)} trains and researches nothing "
        "that could be called off."
    )


def test_a_structure_in_the_making_is_called_off(protoss: Game) -> None:
    call_off = Action(name="Call_Off", about="", function="Cancel_BuildInProgress_quick", rule="cancel_building")
    rule = RULES["cancel_building"]
    protoss.do(protoss.say("Build_Pylon"))
    while len(protoss.own("Pylon")) < 2:
        protoss.play(8)
    pylon = min(protoss.own("Pylon"), key=lambda unit: unit.build_progress).tag
    orders = rule(RuleRequest(call_off, protoss.snapshot, protoss.ledger, tag=pylon))
    assert protoss.do(orders) == ["Success"]
    protoss.play(2)
    assert len(protoss.own("Pylon")) == 1
    forge, probe = protoss.own("Forge")[0].tag, protoss.own("Probe")[0].tag
    with pytest.raises(NotAvailable) as finished:
        rule(RuleRequest(call_off, protoss.snapshot, protoss.ledger, tag=forge))
    assert finished.value.message == (
        f"Call_Off is not possible now: the Forge {hex(forge)} is finished; only what is being built can be called off."
    )
    with pytest.raises(NotAvailable) as none:
        rule(RuleRequest(call_off, protoss.snapshot, protoss.ledger, tag=probe))
    assert none.value.message == f"{hex(probe)} is no structure of yours; name one that is being built."
