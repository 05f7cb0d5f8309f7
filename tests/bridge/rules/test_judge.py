"""Each reason at its edge: one step before it counts, and one step after."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from khala_bridge.catalogue.catalogue import catalogue
from khala_bridge.knowledge import facts_of, knowledge
from khala_bridge.rules import Ledger, SideState, UnitState, use_of, why_not

if TYPE_CHECKING:
    from collections.abc import Iterable

TAG, OTHER = 0x100040001, 0x100080001
RICH: dict[str, Any] = {"minerals": 1000.0, "vespene": 1000.0, "supply": 50.0}


def reason(
    action: str,
    unit_type: str,
    *,
    allowed: bool = True,
    others: Iterable[str] = (),
    upgrades: Iterable[str] = (),
    ledger: Ledger | None = None,
    **state: Any,
) -> str | None:
    """The kind of reason why a unit cannot do an action; None if it can."""
    function = catalogue()[action].pysc2
    assert function is not None
    able = frozenset({function.ability_id}) if allowed else frozenset[int]()
    unit = UnitState(TAG, unit_type, able, **state)
    units = {TAG: unit} | {OTHER + n: UnitState(OTHER + n, name, frozenset()) for n, name in enumerate(others)}
    side = SideState(facts_of("multi"), units, frozenset(upgrades), frozenset())
    why = why_not(use_of(function, by_host=True), unit, side, ledger or Ledger(**RICH))
    return None if why is None else why.kind


@pytest.mark.parametrize(
    ("holds", "state", "ledger", "kind"),
    [
        ("five orders fill a queue", {"orders": 5}, {}, "queue"),
        ("four do not", {"orders": 4}, {}, None),
        ("with a Reactor five do not", {"orders": 5, "addon": "Reactor"}, {}, None),
        ("with a Reactor seven do not", {"orders": 7, "addon": "Reactor"}, {}, None),
        ("with a Reactor eight do", {"orders": 8, "addon": "Reactor"}, {}, "queue"),
        ("what this turn has queued counts", {"orders": 4}, {"queued": {TAG: 1}}, "queue"),
        ("what is finished trains", {"progress": 1.0}, {}, None),
        ("what is not finished does not", {"progress": 0.99}, {}, "unfinished"),
        ("the price is there to the last mineral", {}, {"minerals": 50.0}, None),
        ("one mineral is missing", {}, {"minerals": 49.0}, "price"),
        ("the supply is there", {}, {"supply": 1.0}, None),
        ("half of the supply is missing", {}, {"supply": 0.5}, "price"),
    ],
)
def test_a_barracks_trains_a_marine(
    holds: str, state: dict[str, Any], ledger: dict[str, Any], kind: str | None
) -> None:
    accounts = Ledger(**(RICH | {key: value for key, value in ledger.items() if key != "queued"}))
    accounts.queued.update(ledger.get("queued", {}))
    assert reason("Train_Marine", "Barracks", ledger=accounts, **state) == kind, holds


@pytest.mark.parametrize(
    ("holds", "action", "unit_type", "others", "state", "kind"),
    [
        ("a powered Gateway", "Train_Zealot", "Gateway", (), {"powered": True}, None),
        ("one without power", "Train_Zealot", "Gateway", (), {"powered": False}, "power"),
        ("a structure is there", "Train_Stalker", "Gateway", ("CyberneticsCore",), {"allowed": False}, "game"),
        ("a structure is missing", "Train_Stalker", "Gateway", (), {"allowed": False}, "requirement"),
        ("an add-on is there", "Train_Marauder", "Barracks", (), {"addon": "TechLab"}, None),
        ("an add-on is missing", "Train_Marauder", "Barracks", (), {"addon": ""}, "addon"),
        ("another add-on is there", "Train_Marauder", "Barracks", (), {"addon": "Reactor"}, "addon"),
        ("an idle Hatchery", "Morph_Lair", "Hatchery", ("SpawningPool",), {"orders": 0}, None),
        ("one that is at work", "Morph_Lair", "Hatchery", ("SpawningPool",), {"orders": 1}, "at_work"),
    ],
)
def test_what_the_host_would_choose(
    holds: str, action: str, unit_type: str, others: tuple[str, ...], state: dict[str, Any], kind: str | None
) -> None:
    assert {unit_type, *others} <= knowledge().keys()
    assert reason(action, unit_type, others=others, **state) == kind, holds


def test_energy_is_judged_to_the_point_and_spent_once_a_turn() -> None:
    action = next(name for name in catalogue() if "InjectLarva" in name)
    assert reason(action, "Queen", energy=25.0) is None
    assert reason(action, "Queen", energy=24.9) == "energy"
    spent = Ledger(**RICH)
    spent.energy[TAG] = 25
    assert reason(action, "Queen", energy=49.0, ledger=spent) == "energy"
    assert reason(action, "Queen", energy=50.0, ledger=spent) is None
