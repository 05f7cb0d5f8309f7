"""Rules are functions of the snapshot and the ledger: not of the order of units, of earlier calls, or of chance."""

from __future__ import annotations

import dataclasses
import random
from typing import TYPE_CHECKING

import pytest
from s2clientprotocol import debug_pb2
from s2clientprotocol import sc2api_pb2 as sc

from khala_bridge.auto import RULES, NotAvailable, RuleRequest
from khala_bridge.catalogue.catalogue import catalogue
from khala_bridge.state import Snapshot, read_snapshot
from khala_bridge.state.means import ledger_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.bridge.auto.conftest import Game

SIDES = {
    race: [
        action
        for action in catalogue().values()
        if action.subject == "side" and action.rule and not action.args and action.race in (race, None)
    ]
    for race in ("protoss", "terran", "zerg")
}
GIVEN = {
    "protoss": (
        ("Pylon", 44, 20),
        ("Gateway", 41.5, 20.5),
        ("WarpGate", 47.5, 21.5),
        ("Forge", 44.5, 24.5),
        ("Zealot", 40, 25),
    ),
    "terran": (("SupplyDepot", 44, 20), ("Barracks", 41.5, 24.5), ("OrbitalCommand", 40.5, 30.5), ("Marine", 40, 20)),
    "zerg": (("SpawningPool", 44.5, 15.5), ("Queen", 46, 20), ("Zergling", 40, 20), ("RoachWarren", 50.5, 20.5)),
}


def shuffled(game: Game, seed: int) -> Snapshot:
    """Return the same moment, with its units in another order."""
    response = sc.ResponseObservation()
    response.CopyFrom(game.response)
    units = list(response.observation.raw_data.units)
    random.Random(seed).shuffle(units)
    del response.observation.raw_data.units[:]
    response.observation.raw_data.units.extend(units)
    return read_snapshot(response, game.info, abilities=game.snapshot.abilities)


def answers(snapshot: Snapshot, race: str) -> list[str]:
    """Return the rules' answers to every action of a side that leaves all open, each in a turn of its own."""
    said = []
    for action in SIDES[race]:
        assert action.rule is not None
        try:
            said.append(repr(RULES[action.rule](RuleRequest(action, snapshot, ledger_of(snapshot)))))
        except NotAvailable as impossible:
            said.append(impossible.message)
    return said


@pytest.fixture(scope="module")
def scenes(make_game: Callable[..., Game]) -> dict[str, Game]:
    games = {}
    for race, units in GIVEN.items():
        games[race] = game = make_game("Simple64" if race == "terran" else "Flat64", race)
        game.cheat(debug_pb2.all_resources)
        for name, x, y in units:
            game.put(name, x, y)
        game.put("Marine", 30, 30, owner=2)
        game.play(30)
    return games


@pytest.mark.parametrize("race", GIVEN)
def test_the_order_in_which_units_are_told_changes_nothing(scenes: dict[str, Game], race: str) -> None:
    expected = answers(scenes[race].snapshot, race)
    assert any("Order(" in answer for answer in expected)
    assert all(answers(shuffled(scenes[race], seed), race) == expected for seed in range(3))


@pytest.mark.parametrize("race", GIVEN)
def test_asking_changes_neither_the_snapshot_nor_the_next_answer(scenes: dict[str, Game], race: str) -> None:
    snapshot = scenes[race].snapshot
    before = [dict(units) for units in (snapshot.known, snapshot.units, snapshot.abilities or {})]
    assert answers(snapshot, race) == answers(snapshot, race)
    assert [snapshot.known, snapshot.units, snapshot.abilities] == before


@pytest.mark.parametrize("race", GIVEN)
def test_rules_work_when_the_game_was_not_asked(scenes: dict[str, Game], race: str) -> None:
    snapshot = scenes[race].snapshot
    unasked = dataclasses.replace(snapshot, abilities=None)
    asked, blind = answers(snapshot, race), answers(unasked, race)
    same = sum(one == other for one, other in zip(asked, blind, strict=True))
    assert same >= 0.9 * len(asked)  # what only the game knows, as cooldowns, is not refused


def test_every_rule_is_used_by_the_catalogue_and_every_rule_it_names_is_there() -> None:
    assert {action.rule for action in catalogue().values() if action.rule} == set(RULES)
