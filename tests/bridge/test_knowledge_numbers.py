"""What a text says of a unit is what the engine does: its numbers are parsed from the lines and played."""

from __future__ import annotations

import pytest

from bench.language.numbers import arms_of, measure
from khala_bridge.calibrate.cast import melee_types
from khala_bridge.knowledge import advice, short

FEW = ("Queen", "Stalker")
"""A least range that another weapon fills, creep, energy; a bonus, shields, a cooldown."""

FALSE_WITH_UPGRADES = {("Medivac", "cooldown of 2116")}
"""To be mended: facts of upgrades have no cooldowns yet, and High-Capacity Fuel Tanks shorten this one to 9.3 s."""


def test_the_numbers_of_some_types_are_the_engines() -> None:
    found = measure(FEW, better=False)
    assert {"speed on creep", "period", "range", "least range", "armor"} <= {number.what for number in found}
    assert [number for number in found if number.differs] == []


@pytest.mark.slow
@pytest.mark.parametrize("better", [False, True], ids=["plain", "improved"])
def test_the_numbers_of_every_type_are_the_engines(*, better: bool) -> None:
    differ = {(number.kind, number.what) for number in measure(melee_types(), better=better) if number.differs}
    assert differ == (FALSE_WITH_UPGRADES if better else set())


def test_a_false_number_is_found() -> None:
    (true,) = (number for number in measure(("Zealot",), better=False) if number.what == "speed")
    assert not true.differs
    assert true._replace(said=true.said + 0.1).differs
    assert true._replace(found=float("nan")).differs


def test_weapons_of_upgraded_types_are_said() -> None:
    (plain,) = arms_of(short("Adept", frozenset()))
    (quick,) = arms_of(short("Adept", frozenset(), frozenset({"ResonatingGlaives"})))
    assert (plain.period, quick.period) == (1.61, 1.11)


def test_no_ability_needs_what_is_researched() -> None:
    assert advice("Stalker")[1].endswith("; needs Blink.")
    assert "needs" not in advice("Stalker", frozenset({"Blink"}))[1]
