"""A unit reaches what it touches: melee also hits bodies and walls that keep others off."""

from __future__ import annotations

from typing import Any

import pytest

from khala_simulator.abilities import commands
from khala_simulator.tables.catalog import load_catalog

CATALOG = load_catalog()
MELEE = [u.name for u in CATALOG.units if any(w.range <= 0.1 and w.hits for w in u.weapons) and u.speed_n and u.army]
HALLS = ["Nexus", "Hatchery", "Hive", "CommandCenter", "PlanetaryFortress"]
WIDE = [
    unit.name for unit in CATALOG.units
    if unit.separation > unit.radius and not (unit.passive or unit.uncommandable or unit.structure) and unit.army
]  # fmt: skip


def test_there_are_such_units() -> None:
    assert {"Zergling", "Zealot", "DarkTemplar"} <= set(MELEE)
    assert {"SiegeTank", "SiegeTankSieged", "Sentry", "Hellion"} <= set(WIDE)


@pytest.mark.parametrize("victim", WIDE)
@pytest.mark.parametrize("attacker", MELEE)
def test_a_melee_unit_hits_a_wide_body(field: Any, attacker: str, victim: str) -> None:
    world = field.world
    target = field.still(victim, 2, 20.0, 16.0)
    slot = field.put(attacker, 1, 14.0, 16.0)
    world.life[slot] = world.life_max[slot] = 10_000.0
    whole = field.vitals(target)
    commands.attack_unit(world, [slot], world.tag_of(target))
    field.until(lambda: field.vitals(target) < whole, most=200)


@pytest.mark.parametrize("start", [(10.0, 16.5), (16.5, 24.0), (10.0, 10.0), (24.0, 23.5)])
@pytest.mark.parametrize("victim", HALLS)
@pytest.mark.parametrize("attacker", ["Zergling", "Zealot", "DarkTemplar", "Ultralisk"])
def test_a_melee_unit_hits_a_town_hall_from_every_side(
    field: Any, attacker: str, victim: str, start: tuple[float, float]
) -> None:
    world = field.world
    target = field.still(victim, 2, 17.5, 16.5)
    slot = field.put(attacker, 1, *start)
    world.life[slot] = world.life_max[slot] = 10_000.0
    whole = field.vitals(target)
    commands.attack_unit(world, [slot], world.tag_of(target))
    field.until(lambda: field.vitals(target) < whole, most=200)
