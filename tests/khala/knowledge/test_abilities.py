"""The facts that agents read about abilities are those that the simulator plays by."""

from __future__ import annotations

import operator
from typing import TYPE_CHECKING, Any

import pytest

from khala_bridge.catalogue.functions import functions
from khala_bridge.knowledge import MapFacts, abilities
from khala_simulator.tables.abilities import AIMS

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_bridge.knowledge import AbilityFacts
    from khala_simulator.tables.abilities import Ability, Need
    from khala_simulator.tables.catalog import Catalog

COMPARE: dict[str, Callable[[float, float], bool]] = {"==": operator.eq, "<": operator.lt}
EVERYWHERE = 500  # of the tables: the whole map
LEAST = {"4.10": 480, "5.0.13": 490}


def special(version: str) -> dict[int, AbilityFacts]:
    """Return the facts of abilities that are not general ones."""
    return {number: known for number, known in abilities(version).items() if known.does != "general"}


@pytest.mark.parametrize(
    ("field", "expected"),
    [
        ("does", lambda row: row.effect),
        ("general", lambda row: row.general or None),
        ("target", lambda row: next(name for name, aim in AIMS.items() if aim == row.aim)),
        ("range", lambda row: None if row.range >= EVERYWHERE else row.range),
        ("energy", lambda row: row.energy),
        ("life", lambda row: row.life),
        ("minerals", lambda row: row.minerals),
        ("vespene", lambda row: row.vespene),
        ("supply", lambda row: row.supply),
        ("charges", lambda row: row.charges.max if row.charges else 0),
        ("autocast", lambda row: row.autocast or None),
        ("instant", lambda row: row.transient),
        ("must", lambda row: tuple(word.lower() for word in row.filters.required)),
        ("must_not", lambda row: tuple(word.lower() for word in row.filters.excluded)),
    ],
)
def test_a_fact_is_that_of_the_tables(
    field: str, expected: Callable[[Ability], Any], version: str, tables: Catalog
) -> None:
    told = {number: getattr(known, field) for number, known in special(version).items()}
    assert len(told) >= LEAST[version]
    assert told == {number: expected(tables.ability(number)) for number in told}


@pytest.mark.parametrize(
    ("field", "loops"),
    [
        ("cooldown_s", lambda row: row.cooldown_loops or (row.charges.loops if row.charges else 0)),
        ("time_s", lambda row: row.loops if row.unit or row.effect == "research" else 0),
    ],
)
def test_a_time_is_that_of_the_tables_in_seconds(
    field: str, loops: Callable[[Ability], float], version: str, tables: Catalog
) -> None:
    told = {number: getattr(known, field) for number, known in special(version).items()}
    expected = {number: loops(tables.ability(number)) / 22.4 for number in told}
    assert told == pytest.approx(expected, abs=0.006)


def test_products_and_upgrades_are_those_of_the_tables(version: str, tables: Catalog, names: dict[str, str]) -> None:
    told = {number: (known.produces, known.researches, known.count) for number, known in special(version).items()}
    rows = {number: tables.ability(number) for number in told}
    assert told == {
        number: (
            names.get(row.unit, row.unit) or None,
            names.get(row.upgrade, row.upgrade) or None,
            row.numbers.get("count", max(row.count, len(row.units))),
        )
        for number, row in rows.items()
    }


def test_users_are_the_types_whose_command_card_has_it(version: str, tables: Catalog, names: dict[str, str]) -> None:
    cards = {names[u.name]: tables.abilities_of(u.row) for u in tables.units if u.name in names and not u.like}
    for number, known in special(version).items():
        holders = {name for name, card in cards.items() if any(ability.id == number for ability in card)}
        assert set(known.users) == holders or not holders, known.name
        assert holders or not known.melee, known.name


def test_every_ability_of_a_command_card_that_does_something_is_known(version: str, tables: Catalog) -> None:
    in_play = [unit for unit in tables.units if not unit.like and not unit.not_in_melee and unit.race != "neutral"]
    cards = {ability.id for unit in in_play for ability in tables.abilities_of(unit.row)}
    legacy = {number for number in cards if number not in abilities(version)}
    named = {function.ability_id for function in functions().values()}
    assert legacy & named == set()
    assert {tables.ability(number).effect for number in legacy} <= {"research", "morph"}


def _count(need: Need, owned: set[str], names: dict[str, str], addon: str) -> float:
    """Return the value of a condition for a player who owns exactly these things, of a unit in the required state."""
    parts = [_count(part, owned, names, addon) for part in need.parts]
    rules: dict[str, Callable[[], float]] = {
        "const": lambda: need.value or 0,
        "op": lambda: 1,
        "behavior": lambda: 1,
        "not": lambda: 1,  # what is under way, or on the unit itself
        "and": lambda: all(parts),
        "or": lambda: any(parts),
        "cmp": lambda: COMPARE[need.name](*parts, *([0.0] if len(parts) == 1 else [])),
    }
    return float(rules[need.kind]()) if need.kind in rules else _have(need, owned, names, addon)


def _have(need: Need, owned: set[str], names: dict[str, str], addon: str) -> float:
    name = need.name.removeprefix("Alias_")
    if need.state.endswith("_here"):
        return float(bool(addon) and name.endswith(addon))
    return float(not need.state.startswith("queued") and names.get(name, name) in owned)


def test_with_all_that_is_required_the_condition_holds_and_without_any_of_it_it_does_not(
    version: str, tables: Catalog, names: dict[str, str]
) -> None:
    conditional = {n: known for n, known in special(version).items() if tables.ability(n).requires}
    assert len(conditional) >= 150
    for number, known in conditional.items():
        need = tables.ability(number).requires
        assert need is not None
        owned = set(known.requires)
        assert _count(need, owned, names, known.addon), known.name
        assert not any(_count(need, owned - {one}, names, known.addon) for one in owned), known.name
        assert not known.addon or not _count(need, owned, names, ""), known.name


def test_what_needs_nothing_in_the_tables_requires_nothing(version: str, tables: Catalog) -> None:
    free = [known for n, known in special(version).items() if not tables.ability(n).requires]
    assert {known.name for known in free if known.requires or known.addon} == set()


def test_figures_are_those_of_the_tables(version: str, tables: Catalog) -> None:
    compared = 0
    for number, known in special(version).items():
        raw = tables.ability(number).numbers
        for name, value in known.figures.items():
            own = f"{name.removesuffix('_s')}_loops"
            if name in raw:
                assert value == pytest.approx(raw[name], abs=1e-4), (known.name, name)
            elif name.endswith("_s") and own in raw:
                assert value == pytest.approx(raw[own] / 22.4, abs=0.006), (known.name, name)
            else:  # per "normal" second in the tables
                (rate,) = (raw[key] for key in (f"{name}_n", f"{name}_normal", f"{name[:-1]}n") if key in raw)
                assert value == pytest.approx(rate * 1.4, abs=0.006), (known.name, name)
            compared += 1
    assert compared > 150


def test_a_general_ability_has_the_users_of_its_special_ones_and_the_facts_in_which_they_agree(version: str) -> None:
    general = [known for known in abilities(version).values() if known.does == "general"]
    assert len(general) == 50
    for known in general:
        cases = [abilities(version)[number] for number in known.special]
        live = [case for case in cases if case.melee] or cases
        assert all(case.general == known.id for case in cases), known.name
        assert set(known.users) == {user for case in live for user in case.users}, known.name
        for field in ("energy", "life", "minerals", "vespene", "cooldown_s", "requires", "produces", "range"):
            values = {getattr(case, field) for case in live}
            plain = type(known).model_fields[field].default
            assert getattr(known, field) == (values.pop() if len(values) == 1 else plain), (known.name, field)


def test_for_each_of_its_users_a_general_ability_is_one_of_the_special_ones(version: str) -> None:
    facts = MapFacts(version)
    for known in abilities(version).values():
        for user in known.users if known.does == "general" else ():
            case = facts.ability_of(known.id, user)
            assert case is not None
            assert case.id in known.special
            assert user in case.users
