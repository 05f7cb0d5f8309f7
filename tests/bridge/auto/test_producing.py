"""Training, morphing and research: which unit does it, and that the game then does it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from s2clientprotocol import debug_pb2

from khala_bridge.catalogue.functions import functions

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.bridge.auto.conftest import Game

RICH = (debug_pb2.all_resources, debug_pb2.food)
FREE = (*RICH, debug_pb2.tech_tree)


@pytest.fixture
def protoss(make_game: Callable[..., Game]) -> Game:
    """Return two Gateways with power, and plenty of everything."""
    game = make_game("Flat64")
    game.cheat(*RICH)
    game.put("Pylon", 44, 20)
    game.put("Gateway", 41.5, 20.5)
    game.put("Gateway", 47.5, 21.5)
    return game


@pytest.fixture
def terran(make_game: Callable[..., Game]) -> Game:
    game = make_game("Flat64", "terran")
    game.cheat(*FREE, debug_pb2.fast_build)
    game.put("Hellion", 30, 30)
    for y in (20.5, 25.5):
        game.put("Barracks", 40.5, y)
    return game


@pytest.fixture
def zerg(make_game: Callable[..., Game]) -> Game:
    game = make_game("Flat64", "zerg")
    game.cheat(*FREE)
    return game


def test_the_idle_gateway_trains_and_then_the_one_with_the_shorter_queue(protoss: Game) -> None:
    gateways = sorted(unit.tag for unit in protoss.own("Gateway"))
    protoss.do(protoss.say("Train_Zealot"))
    protoss.play(1)
    busy = [unit.tag for unit in protoss.own("Gateway") if unit.orders]
    assert busy == gateways[:1]
    chosen = [protoss.say("Train_Zealot")[0].units[0] for _ in range(5)]
    assert chosen == [gateways[1], gateways[0], gateways[1], gateways[0], gateways[1]]


def test_a_full_queue_is_said(protoss: Game) -> None:
    for _ in range(10):
        protoss.say("Train_Zealot")
    assert protoss.refusal("Train_Zealot").message == (
        "Train_Zealot is not possible now: the queue of every Gateway is full; wait until one is done or build another."
    )


def test_what_is_trained_comes(protoss: Game) -> None:
    assert protoss.do(protoss.say("Train_Zealot")) == ["Success"]
    protoss.play(620)
    assert len(protoss.own("Zealot")) == 1


def test_only_the_named_producer_trains(protoss: Game) -> None:
    last = max(unit.tag for unit in protoss.own("Gateway"))
    (order,) = protoss.say("Train_Zealot", units=(last,))
    assert order.units == (last,)


def test_only_a_barracks_with_a_tech_lab_trains_marauders(terran: Game) -> None:
    assert terran.refusal("Train_Marauder").message == (
        "Train_Marauder is not possible now: no Barracks has a TechLab; Build_TechLab_Barracks makes one."
    )
    terran.do(terran.say("Build_TechLab_Barracks"))
    terran.play(40)
    with_lab = [unit.tag for unit in terran.own("Barracks") if unit.add_on_tag]
    assert len(with_lab) == 1
    (order,) = terran.say("Train_Marauder")
    assert list(order.units) == with_lab
    assert terran.do([order]) == ["Success"]


def test_a_reactor_makes_two_places_of_one(terran: Game) -> None:
    terran.do(terran.say("Build_Reactor_Barracks"))
    terran.play(40)
    plain, double = sorted(
        (unit.tag for unit in terran.own("Barracks")), key=lambda t: terran.snapshot.units[t].add_on_tag > 0
    )
    chosen = [terran.say("Train_Marine")[0].units[0] for _ in range(6)]
    assert chosen.count(double) == 4
    assert chosen.count(plain) == 2


def test_an_add_on_is_built_where_there_is_room(terran: Game) -> None:
    first, second = sorted(unit.tag for unit in terran.own("Barracks"))
    unit = terran.snapshot.units[first]
    terran.put("SupplyDepot", unit.pos.x + 2.5, unit.pos.y - 0.5)
    (order,) = terran.say("Build_TechLab_Barracks")
    assert order.units == (second,)
    assert terran.do([order]) == ["Success"]
    assert "at work" in terran.refusal("Build_Reactor_Barracks", units=(second,)).message
    assert "something stands where the add-on" in terran.refusal("Build_TechLab_Barracks", units=(first,)).message


def test_each_larva_hatches_once(zerg: Game) -> None:
    larvae = {unit.tag for unit in zerg.own("Larva")}
    orders = [zerg.say("Train_Drone"), zerg.say("Train_Overlord"), zerg.say("Train_Drone")]
    assert {order[0].units[0] for order in orders} == larvae
    assert zerg.refusal("Train_Drone").message == (
        "Train_Drone is not possible now: every Larva has an order already in this turn."
    )
    assert [zerg.do(order) for order in orders] == [["Success"]] * 3
    zerg.play(5)
    assert len(zerg.own("Cocoon")) == 3


def test_a_zergling_becomes_a_baneling(zerg: Game) -> None:
    zerg.put("Zergling", 45, 25, count=2)
    orders = [*zerg.say("Train_Baneling"), *zerg.say("Train_Baneling")]
    assert {order.units[0] for order in orders} == {unit.tag for unit in zerg.own("Zergling")}
    assert zerg.do(orders) == ["Success", "Success"]


def test_a_hatchery_grows_and_trains_no_queen_meanwhile(zerg: Game) -> None:
    zerg.put("SpawningPool", 44.5, 15.5)
    assert zerg.do(zerg.say("Morph_Lair")) == ["Success"]
    zerg.play(5)
    assert "Hatchery" in zerg.refusal("Train_Queen").message or zerg.own("Hatchery")[0].orders


def test_research_begins_once(protoss: Game) -> None:
    protoss.put("Forge", 44.5, 24.5)
    assert protoss.do(protoss.say("Research_ProtossGroundWeapons")) == ["Success"]
    again = "Research_ProtossGroundWeapons is not possible now: it is being researched already."
    assert protoss.refusal("Research_ProtossGroundWeapons").message == again
    protoss.play(2)
    assert protoss.refusal("Research_ProtossGroundWeapons").message == again
    assert protoss.own("Forge")[0].orders


def test_the_next_level_is_researched_until_all_are_known(make_game: Callable[..., Game]) -> None:
    game = make_game("Flat64")
    game.cheat(*RICH, debug_pb2.fast_build)
    game.put("Pylon", 44, 20)
    game.put("Forge", 41.5, 20.5)
    for _ in range(3):
        game.put("TwilightCouncil", 44.5, 24.5)
        assert game.do(game.say("Research_ProtossShields")) == ["Success"]
        game.play(40)
    assert game.refusal("Research_ProtossShields").message == (
        "Research_ProtossShields is not possible now: it is researched already."
    )


def test_gateways_that_are_free_become_warpgates(make_game: Callable[..., Game]) -> None:
    game = make_game("Flat64")
    game.cheat(*RICH)
    game.put("Pylon", 44, 20)
    game.put("Gateway", 41.5, 20.5)
    assert "needs" in game.refusal("Auto_Morph_Warpgate").message
    game.cheat(debug_pb2.tech_tree)
    game.client.act()
    ready = [unit for unit in game.own("Gateway") if not unit.orders]
    if ready:  # with its autocast on, the game itself may be sooner
        assert game.do(game.say("Auto_Morph_Warpgate")) == ["Success"]
    game.play(200)
    assert len(game.own("WarpGate")) == 1


def test_one_turn_spends_its_minerals_once(make_game: Callable[..., Game]) -> None:
    game = make_game("Flat64")
    game.ledger.minerals = 120.0
    for _ in range(2):
        game.say("Train_Probe")
    assert game.refusal("Train_Probe").message == (
        "Train_Probe is not possible now: it costs 50 minerals and 20 are left."
    )


def test_the_functions_are_those_of_the_actions(protoss: Game) -> None:
    (order,) = protoss.say("Train_Zealot")
    assert order.function is functions()["Train_Zealot_quick"]
