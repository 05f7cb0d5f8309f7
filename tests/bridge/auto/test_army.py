"""Orders to the whole army and scouts: which units go, and where to."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import pytest
from s2clientprotocol import debug_pb2

from khala_bridge.frames import WorldPoint
from khala_bridge.names import unit_name
from khala_bridge.state.ground import land_of
from khala_bridge.state.side import army

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_bridge.auto import RuleOrder
    from tests.bridge.auto.conftest import Game


@pytest.fixture
def game(make_game: Callable[..., Game]) -> Game:
    """Return a small army in the middle of the map, which has a hall in one corner."""
    game = make_game("Flat64")
    game.put("Zealot", 32, 32, count=2)
    game.put("HighTemplar", 33, 33)
    return game


def goal(orders: list[RuleOrder]) -> WorldPoint:
    (order,) = orders
    assert isinstance(order.target, WorldPoint)
    return order.target


def test_the_army_is_who_fights_or_helps_and_can_move(make_game: Callable[..., Game]) -> None:
    game = make_game("Flat64", "zerg")
    for name in ("Zergling", "Queen", "Overlord", "Overseer", "Infestor", "LurkerBurrowed", "Mutalisk", "SpineCrawler"):
        game.put(name, 40, 20)
    assert {unit_name(unit.unit_type) for unit in army(game.snapshot)} == {"Zergling", "Infestor", "Mutalisk"}
    assert "Queen" in {unit_name(unit.unit_type) for unit in army(game.snapshot, home=True)}


def test_it_attacks_where_the_enemy_began_when_nothing_is_known(game: Game) -> None:
    orders = game.say("All_Units_Attack")
    assert goal(orders) == land_of(game.snapshot).ground.starts[0]
    assert orders[0].function.name == "Attack_minimap"
    assert set(orders[0].units) == {unit.tag for unit in army(game.snapshot)}
    assert game.do(orders) == ["Success"]
    game.play(10)
    assert all(unit.orders for unit in army(game.snapshot))


def test_enemies_near_it_come_first_and_known_structures_next(game: Game) -> None:
    game.put("Bunker", 14.5, 30.5, owner=2)
    game.put("Zealot", 15, 25)  # sees the Bunker, and keeps it in memory
    game.play(2)
    assert goal(game.say("All_Units_Attack")) == pytest.approx((14.5, 30.5), abs=0.5)
    game.see()
    game.put("Marine", 36, 30, owner=2)
    assert goal(game.say("All_Units_Attack")) == pytest.approx((36, 30), abs=2)


def test_it_does_not_run_after_what_it_cannot_hit(game: Game) -> None:
    for unit in ("Overlord", "Larva"):
        game.put(unit, 34, 34, owner=2)
    game.put("Hatchery", 28.5, 37.5, owner=2)
    assert goal(game.say("All_Units_Attack")) == pytest.approx((28.5, 37.5), abs=0.5)
    game.put("Drone", 31, 33, owner=2)
    game.put("Zergling", 26, 33, owner=2)
    assert goal(game.say("All_Units_Attack")) == pytest.approx((26, 33), abs=3)


def test_who_was_ordered_in_this_turn_is_left_to_it(game: Game) -> None:
    zealot = game.own("Zealot")[0].tag
    game.ledger.take(zealot)
    assert zealot not in game.say("All_Units_Attack")[0].units
    assert game.refusal("All_Units_Attack").message == (
        "All_Units_Attack is not possible now: every unit of the army has an order already in this turn."
    )


def test_it_defends_against_intruders(game: Game) -> None:
    game.put("Marine", 44, 20, owner=2)
    orders = game.say("All_Units_Defend")
    assert goal(orders) == pytest.approx((44, 20), abs=2)
    assert orders[0].function.name == "Attack_minimap"


def test_queens_fight_intruders_and_stay_at_their_work_otherwise(make_game: Callable[..., Game]) -> None:
    game = make_game("Flat64", "zerg")
    queen, zergling = game.put("Queen", 46, 18), game.put("Zergling", 40, 20)
    assert zergling in game.say("All_Units_Defend")[0].units
    game.see()
    assert queen not in game.say("All_Units_Defend")[0].units
    game.put("Marine", 44, 20, owner=2)
    assert queen in game.say("All_Units_Defend")[0].units


def test_without_intruders_it_waits_in_front_of_the_base(game: Game) -> None:
    land = land_of(game.snapshot)
    hall, enemy = land.own_halls[0], land.ground.starts[0]
    place = goal(game.say("All_Units_Defend"))
    assert math.dist(place, (hall.pos.x, hall.pos.y)) <= 8
    assert math.dist(place, enemy) < math.dist((hall.pos.x, hall.pos.y), enemy)
    assert land.open[int(place.x), int(place.y)]


def test_it_retreats_without_fighting(game: Game) -> None:
    orders = game.say("All_Units_Retreat")
    hall = land_of(game.snapshot).own_halls[0]
    assert math.dist(goal(orders), (hall.pos.x, hall.pos.y)) <= 8
    assert orders[0].function.name == "Move_minimap"
    assert game.do(orders) == ["Success"]


def test_no_army_is_said(make_game: Callable[..., Game]) -> None:
    assert make_game("Flat64").refusal("All_Units_Attack").message == (
        "All_Units_Attack is not possible now: you have no army; train units first."
    )


# scouts ---------------------------------------------------------------------------------------------------------------


def test_a_worker_looks_at_the_enemys_start_and_goes_on_with_it(make_game: Callable[..., Game]) -> None:
    game = make_game("Flat64")
    orders = game.say("Worker_Scan")
    assert goal(orders) == land_of(game.snapshot).ground.starts[0]
    game.do(orders)
    game.play(40)
    assert game.say("Worker_Scan") == orders


def test_two_scouts_of_a_turn_look_at_two_places(make_game: Callable[..., Game]) -> None:
    game = make_game("Flat64")
    first, second = game.say("Worker_Scan"), game.say("Worker_Scan")
    assert first[0].units != second[0].units
    assert goal(first) != goal(second)
    assert goal(second) in {base.place for base in land_of(game.snapshot).bases}


def test_a_builder_on_its_way_is_no_scout(make_game: Callable[..., Game]) -> None:
    game = make_game()
    game.cheat(debug_pb2.all_resources)
    orders = game.say("Build_Nexus")
    game.do(orders)
    game.play(10)
    assert game.say("Worker_Scan")[0].units != orders[0].units


def test_what_was_seen_is_not_looked_at_again_before_the_rest(make_game: Callable[..., Game]) -> None:
    game = make_game("Flat64")
    start = land_of(game.snapshot).ground.starts[0]
    game.put("Observer", *start)
    game.play(2)
    place = goal(game.say("Worker_Scan"))
    assert place != start
    assert not land_of(game.snapshot).sight[int(place.x), int(place.y)]


def test_when_all_was_seen_places_out_of_sight_take_turns(make_game: Callable[..., Game]) -> None:
    game = make_game("Flat64")
    game.client.debug(debug_pb2.DebugCommand(game_state=debug_pb2.show_map))
    game.play(2)
    game.client.debug(debug_pb2.DebugCommand(game_state=debug_pb2.show_map))
    game.play(2)
    assert land_of(game.snapshot).sight.all()
    first = goal(game.say("Worker_Scan"))
    game.play(1400)
    assert goal(game.say("Worker_Scan")) != first


def test_only_units_of_the_named_kind_scout(game: Game) -> None:
    assert game.say("Zealot_Scan")[0].units[0] in {unit.tag for unit in game.own("Zealot")}
    assert game.refusal("Adept_Scan").message == (
        "Adept_Scan is not possible now: you have no Adept without an order in this turn."
    )
