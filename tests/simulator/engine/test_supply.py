"""Supply: what uses it, what provides it, and the debug states that lift rules."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from khala_simulator.abilities import casting
from khala_simulator.combat import lifecycle
from khala_simulator.economy import supply
from khala_simulator.tables.catalog import load_catalog

if TYPE_CHECKING:
    from tests.simulator.engine.conftest import Field

CATALOG = load_catalog()


def test_units_use_and_structures_provide_what_the_tables_say(field: Field) -> None:
    for name in ("Zealot", "Colossus", "Zergling", "Probe"):
        field.put(name, 1, 10.0, 10.0)
    for name in ("Nexus", "Pylon", "Overlord", "Gateway"):
        field.put(name, 1, 20.0, 20.0)
    assert supply.in_use(field.world, 1) == 2 + 6 + 0.5 + 1
    assert supply.cap(field.world, 1) == 15 + 8 + 8


def test_two_hundred_is_the_most(field: Field) -> None:
    for _ in range(14):
        field.put("Nexus", 1, 20.0, 20.0)
    assert supply.cap(field.world, 1) == 200.0


def test_units_inside_others_count_and_hallucinations_do_not(field: Field) -> None:
    prism, zealot = field.put("WarpPrism", 1, 10.0, 10.0), field.put("Zealot", 1, 10.0, 10.0)
    lifecycle.stow(field.world, zealot, prism)
    field.world.hallucination[field.put("Archon", 1, 12.0, 10.0)] = True
    assert supply.in_use(field.world, 1) == 4.0


@pytest.mark.parametrize(
    ("cheat", "minerals", "full"),
    [("food", 50.0, True), ("free", 0.0, False)],
)
def test_debug_states_lift_the_rules(field: Field, cheat: str, minerals: float, full: bool) -> None:
    nexus = field.put("Nexus", 1, 16.0, 16.0)
    player = field.world.players[1]
    player.minerals = minerals
    for i in range(15 if full else 0):
        field.put("Probe", 1, 4.0 + i, 4.0)
    assert not casting.use(field.world, [nexus], CATALOG.ability(1006))
    player.cheats.append(cheat)
    assert casting.use(field.world, [nexus], CATALOG.ability(1006)) == [nexus]
    assert player.minerals == (0.0 if full else minerals)


def test_fast_build_makes_everything_at_once(field: Field) -> None:
    nexus = field.put("Nexus", 1, 16.0, 16.0)
    player = field.world.players[1]
    player.minerals = 50.0
    player.cheats.append("fast_build")
    casting.use(field.world, [nexus], CATALOG.ability(1006))
    field.play(1)
    assert supply.in_use(field.world, 1) == 1.0
    assert field.world.jobs == {}
