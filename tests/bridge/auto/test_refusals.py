"""What rules say when there is nothing to find: every sentence tells a model what to do instead."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
from s2clientprotocol import debug_pb2

from khala_bridge.auto import NotAvailable
from khala_bridge.frames import WorldPoint

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.bridge.auto.conftest import Game

RICH = (debug_pb2.all_resources, debug_pb2.food)


def nothing(_: Game) -> None:
    """Play nothing: the game is at its beginning."""


def no_minerals(game: Game) -> None:
    game.ledger.minerals = 20


def no_supply(game: Game) -> None:
    game.ledger.supply = 0


def rich(game: Game) -> None:
    game.cheat(*RICH)


def gateway_without_power(game: Game) -> None:
    rich(game)
    game.put("Gateway", 41.5, 20.5)


def gateway_in_the_making(game: Game) -> None:
    rich(game)
    game.put("Pylon", 44, 20)
    game.do(game.say("Build_Gateway"))
    while not game.own("Gateway"):
        game.play(8)


def powered(game: Game) -> None:
    rich(game)
    game.put("Pylon", 44, 20)
    game.put("Gateway", 41.5, 20.5)


def all_promised(game: Game) -> None:
    powered(game)
    game.ledger.promise(WorldPoint(32, 32), 64, 64)


def all_workers_taken(game: Game) -> None:
    rich(game)
    game.ledger.take(*(unit.tag for unit in game.own("Probe")))


SIDE = [
    (nothing, "Train_Zealot", "you have no Gateway; build one first."),
    (nothing, "Warp_Zealot", "you have no WarpGate; research WarpGate and turn a Gateway into one."),
    (nothing, "Research_Blink", "you have no TwilightCouncil; build one first."),
    (nothing, "Build_Gateway", "it costs 150 minerals and 50 are left."),
    (nothing, "Build_CyberneticsCore", "it needs a finished Gateway first."),
    (nothing, "ChronoBoost_Economy", "no Nexus trains Probes that is not boosted yet; train Probes first."),
    (nothing, "ChronoBoost_Military", "no structure trains an army unit that is not boosted yet; train one first."),
    (
        nothing,
        "ChronoBoost_Research",
        "no structure researches anything that is not boosted yet; research something first.",
    ),
    (nothing, "All_Units_Defend", "you have no army; train units first."),
    (nothing, "All_Units_Retreat", "you have no army; train units first."),
    (nothing, "Zealot_Scan", "you have no Zealot without an order in this turn."),
    (nothing, "Auto_Morph_Warpgate", "you have no Gateway; build one first."),
    (no_minerals, "Train_Probe", "it costs 50 minerals and 20 are left."),
    (no_supply, "Train_Probe", "it needs 1 supply and 0 is free; get a Pylon first."),
    (rich, "Build_Gateway", "there is no room for it at your bases in the field of a Pylon; build a Pylon first."),
    (gateway_without_power, "Train_Zealot", "your Gateway has no power; build a Pylon near it."),
    (gateway_in_the_making, "Train_Zealot", "your Gateway is not finished yet, it is at 1%."),
    (powered, "Train_Stalker", "it needs a finished CyberneticsCore first."),
    (powered, "Auto_Morph_Warpgate", "it needs the upgrade WarpGateResearch first."),
    (all_promised, "Build_Pylon", "there is no room for it at your bases."),
    (all_promised, "Build_Nexus", "every place for a town hall that can be walked to is taken."),
    (all_workers_taken, "Build_Pylon", "you have no Probe that is free to build."),
]


@pytest.mark.parametrize(("state", "action", "why"), SIDE)
def test_what_is_not_possible_now_is_said_with_what_is_missing(
    make_game: Callable[..., Game], state: Callable[[Game], None], action: str, why: str
) -> None:
    game = make_game("Flat64")
    state(game)
    said = game.refusal(action)
    assert (said.reason, said.message) == ("not_available", f"{action} is not possible now: {why}")


AT = [
    ("Build_Pylon_Screen", (50.5, 13.5), "Pylon cannot stand there: a Nexus is in its way."),
    (
        "Build_Pylon_Screen",
        (0.5, 0.5),
        "Pylon cannot stand there: a cliff, a ramp or the edge of the map is in its way.",
    ),
    (
        "Build_Pylon_Screen",
        (-40.0, 900.0),
        "Pylon cannot stand there: a cliff, a ramp or the edge of the map is in its way.",
    ),
    (
        "Build_Gateway_Screen",
        (30.5, 40.5),
        (
            "Gateway cannot stand there: no Pylon or phasing WarpPrism powers that place; "
            "build a Pylon within 6 of it first."
        ),
    ),
    ("Build_Pylon_Screen", (44.0, 20.0), "Pylon cannot stand there: a Pylon is in its way."),
    (
        "Build_Nexus_Screen",
        (51.5, 48.5),
        "Nexus cannot stand there: it is too near to minerals or gas; 3 cells between have to be free.",
    ),
    ("Build_Assimilator_Screen", (40.0, 20.0), "There is no free geyser there; Assimilator stands on one."),
]


@pytest.mark.parametrize(("action", "point", "message"), AT)
def test_what_stands_in_the_way_is_said_with_the_nearest_place(
    make_game: Callable[..., Game], action: str, point: tuple[float, float], message: str
) -> None:
    game = make_game("Flat64")
    powered(game)
    said = game.refusal(action, units=(game.own("Probe")[0].tag,), point=WorldPoint(*point))
    assert (said.reason, said.message) == ("invalid_target", message)
    if said.place is not None:
        assert game.say(action, units=(game.own("Probe")[0].tag,), point=said.place)
    else:
        assert "Assimilator" in action


def test_a_second_structure_of_a_turn_does_not_stand_on_the_first(make_game: Callable[..., Game]) -> None:
    game = make_game("Flat64")
    rich(game)
    probe = (game.own("Probe")[0].tag,)
    game.say("Build_Pylon_Screen", units=probe, point=WorldPoint(44, 20))
    said = game.refusal("Build_Pylon_Screen", units=probe, point=WorldPoint(45, 20))
    assert said.message == "Pylon cannot stand there: something else is going to be built there."
    assert said.place == (46, 20)


def test_the_same_structure_once_more_is_said_to_be_under_way(make_game: Callable[..., Game]) -> None:
    game = make_game("Flat64")
    rich(game)
    probe, point = (game.own("Probe")[0].tag,), WorldPoint(44, 20)
    game.do(game.say("Build_Pylon_Screen", units=probe, point=point))
    game.play(1)
    said = game.refusal("Build_Pylon_Screen", units=probe, point=point)
    assert said.message == "Pylon cannot stand there: a Pylon is going to be built there already."


@pytest.mark.parametrize(
    ("structure", "point", "message"),
    [
        ("SpawningPool", (30.5, 40.5), "SpawningPool cannot stand there: it needs creep under all of it."),
        ("EvolutionChamber", (50.5, 13.5), "EvolutionChamber cannot stand there: a Hatchery is in its way."),
    ],
)
def test_creep_is_asked_for(
    make_game: Callable[..., Game], structure: str, point: tuple[float, float], message: str
) -> None:
    game = make_game("Flat64", "zerg")
    rich(game)
    drone = (game.own("Drone")[0].tag,)
    assert game.refusal(f"Build_{structure}_Screen", units=drone, point=WorldPoint(*point)).message == message


def test_terran_builds_nothing_on_creep(make_game: Callable[..., Game]) -> None:
    game = make_game("Flat64", "terran", enemy="zerg")
    rich(game)
    land_on_creep = WorldPoint(13.5, 44.5)
    game.put("Raven", *land_on_creep)  # creep that nobody has seen is no reason
    said = game.refusal(
        "Build_SupplyDepot_Screen",
        units=(game.own("SCV")[0].tag,),
        point=land_on_creep,
    )
    assert said.message == "SupplyDepot cannot stand there: there is creep, on which only Zerg build."


NEAR: list[tuple[str, str, str]] = [
    ("Build_Assimilator_Near", "Pylon", "There is no free geyser near the Pylon {tag}."),
    (
        "Build_Nexus_Near",
        "Pylon",
        "The Pylon {tag} is at no place for a town hall; name a mineral field or geyser there.",
    ),
    (
        "Lock_Nexus_Near",
        "Pylon",
        "The Pylon {tag} is at no place for a town hall; name a mineral field or geyser there.",
    ),
    (
        "Build_Gateway_Near",
        "Nexus",
        "There is no room for a Gateway within 10 of the Nexus {tag} in the field of a Pylon; build a Pylon first.",
    ),
]


@pytest.mark.parametrize(("action", "near", "message"), NEAR)
def test_what_has_no_room_near_a_unit_is_said(
    make_game: Callable[..., Game], action: str, near: str, message: str
) -> None:
    game = make_game("Flat64")
    rich(game)
    game.put("Pylon", 32, 32)
    unit = game.own(near)[0]
    said = game.refusal(action, units=(game.own("Probe")[0].tag,), tag=unit.tag)
    assert (said.reason, said.message) == ("invalid_target", message.format(tag=hex(unit.tag)))


def test_a_tag_that_nobody_has_is_said(make_game: Callable[..., Game]) -> None:
    game = make_game("Flat64")
    rich(game)
    said = game.refusal("Build_Pylon_Near", units=(game.own("Probe")[0].tag,), tag=0x123)
    assert (said.reason, said.message) == (
        "unknown_target",
        "No unit 0x123 is known; use a tag that stands in your lists.",
    )


def test_a_refused_call_takes_nothing_from_the_turn(make_game: Callable[..., Game]) -> None:
    game = make_game("Flat64")
    rich(game)
    before = repr(game.ledger)
    tries: list[tuple[str, dict[str, Any]]] = [
        ("Build_Gateway", {}),
        ("Train_Zealot", {}),
        ("Build_Gateway_Screen", {"units": (game.own("Probe")[0].tag,), "point": WorldPoint(40, 40)}),
        ("All_Units_Attack", {}),
        ("Warp_Zealot", {}),
    ]
    for action, given in tries:
        assert isinstance(game.refusal(action, **given), NotAvailable)
    assert repr(game.ledger) == before


def test_what_workers_are_on_their_way_to_build_is_set_aside(make_game: Callable[..., Game]) -> None:
    game = make_game("Flat64")
    while game.ledger.minerals < 110:
        game.play(20)
    left = game.ledger.minerals
    game.do(game.say("Build_Pylon"))
    game.play(1)
    assert (game.ledger.minerals, game.ledger.aside) == (left - 100, (100, 0))
    assert game.refusal("Train_Probe").message == (
        f"Train_Probe is not possible now: it costs 50 minerals and {left - 100:g} are left, "
        "100 more are for what workers are on their way to build."
    )
    while not game.own("Pylon"):
        game.play(8)
    assert game.ledger.aside == (0, 0)
