"""Warping in: the place is accepted by the game, and the unit comes there."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import pytest
from s2clientprotocol import debug_pb2

from khala_bridge.auto.warp import fields
from khala_bridge.frames import WorldPoint

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.bridge.auto.conftest import Game

UNITS = ("Zealot", "Stalker", "Sentry", "Adept", "HighTemplar", "DarkTemplar")


@pytest.fixture
def game(make_game: Callable[..., Game]) -> Game:
    """Return four WarpGates near the Nexus, and a Pylon far away."""
    game = make_game("Flat64")
    game.cheat(debug_pb2.all_resources, debug_pb2.food, debug_pb2.tech_tree)
    game.put("Pylon", 44, 20)
    for x, y in ((41.5, 16.5), (41.5, 23.5), (45.5, 24.5), (48.5, 21.5)):
        game.put("WarpGate", x, y)
    game.put("Pylon", 20, 40)
    return game


def far(game: Game) -> int:
    return max(game.own("Pylon"), key=lambda unit: unit.pos.y).tag


@pytest.mark.parametrize("name", UNITS)
def test_every_unit_is_warped_in_near_the_named_pylon(game: Game, name: str) -> None:
    (order,) = game.say(f"Warp_{name}_Near", tag=far(game))
    assert isinstance(order.target, WorldPoint)
    assert math.dist(order.target, (20, 40)) < 3
    assert game.may_stand(f"TrainWarp_{name}_screen", order.target) == "Success"
    assert game.do([order]) == ["Success"]
    game.play(5)
    (unit,) = game.own(name)
    assert (unit.pos.x, unit.pos.y) == pytest.approx(order.target, abs=0.01)


def test_each_gate_warps_one_in_and_each_has_its_place(game: Game) -> None:
    game.put("CyberneticsCore", 38.5, 20.5)
    orders = [game.say("Warp_Stalker_Near", tag=far(game))[0] for _ in range(4)]
    assert len({order.units for order in orders}) == len({order.target for order in orders}) == 4
    assert game.do(orders) == ["Success"] * 4
    game.play(5)
    assert len(game.own("Stalker")) == 4
    assert game.refusal("Warp_Stalker_Near", tag=far(game)).message == (
        "Warp_Stalker_Near is not possible now: every WarpGate recharges; wait until one is ready."
    )


def test_without_a_tag_it_is_where_it_is_soonest_there(game: Game) -> None:
    (order,) = game.say("Warp_Zealot")
    assert isinstance(order.target, WorldPoint)
    assert math.dist(order.target, (44, 20)) < 6.5  # a Nexus and Gateways are near that Pylon
    assert game.do([order]) == ["Success"]


def test_nobody_is_warped_in_on_a_unit_that_stands_there(game: Game) -> None:
    (first,) = game.say("Warp_Stalker_Near", tag=far(game))
    assert isinstance(first.target, WorldPoint)
    game.put("Immortal", *first.target)
    (second,) = game.say("Warp_Stalker_Near", tag=far(game))
    assert second.target != first.target
    assert game.do([second]) == ["Success"]


def test_a_full_field_is_said(game: Game) -> None:
    for x in range(14, 27):
        for y in range(34, 47):
            game.ledger.promise(WorldPoint(x + 0.5, y + 0.5), 1, 1)
    said = game.refusal("Warp_Zealot_Near", tag=far(game))
    assert said.reason == "invalid_target"
    assert said.message == (
        f"There is no room in the power field of {hex(far(game))}; name another Pylon, or move the units away."
    )


def test_a_unit_without_a_field_is_no_place_to_warp_to(game: Game) -> None:
    nexus = game.own("Nexus")[0].tag
    assert game.refusal("Warp_Zealot_Near", tag=nexus).message == (
        f"The Nexus {hex(nexus)} has no power field; name a finished Pylon or phasing WarpPrism of yours."
    )


def test_a_phasing_prism_is_a_place_to_warp_to_and_the_soonest(game: Game) -> None:
    prism = game.put("WarpPrismPhasing", 30, 45)
    game.play(30)
    (order,) = game.say("Warp_Zealot_Near", tag=prism)
    assert isinstance(order.target, WorldPoint)
    assert math.dist(order.target, (30, 45)) <= 3.75
    assert game.do([order]) == ["Success"]


def test_fields_tell_whether_they_are_fast_and_have_room(game: Game) -> None:
    near, away = sorted((unit.tag for unit in game.own("Pylon")), key=lambda tag: game.snapshot.units[tag].pos.y)
    assert set(fields(game.snapshot)) == {(near, True, True), (away, False, True)}
    for x in range(14, 27, 2):
        for y in range(34, 47, 2):
            game.put("Immortal", x, y)
    assert {field.tag: field.room for field in fields(game.snapshot)}[away] is False
