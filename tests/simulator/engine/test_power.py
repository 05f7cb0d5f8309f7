"""Power: what supplies it, what lacks it, and the effects."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from khala_simulator.abilities import casting
from khala_simulator.economy import power
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.tables.catalog import load_catalog

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.simulator.engine.conftest import Field

CATALOG = load_catalog()


@pytest.fixture
def field(make_field: Callable[..., Field]) -> Field:
    return make_field("{flat: [64, 64]}")


@pytest.mark.parametrize(
    ("source", "away", "powered"),
    [
        ("Pylon", 6.4, True),
        ("Pylon", 6.6, False),
        ("WarpPrismPhasing", 3.7, True),
        ("WarpPrismPhasing", 3.8, False),
        ("WarpPrism", 1.0, False),
        ("Nexus", 6.0, False),  # it only hastens warping in
    ],
)
def test_what_supplies_power_how_far(field: Field, source: str, away: float, powered: bool) -> None:
    cannon = field.put("PhotonCannon", 1, 30.0, 30.0)
    field.put(source, 1, 30.0 + away, 30.0)
    field.play(1)
    assert field.world.powered[cannon] == powered


def test_power_is_for_its_owner_only(field: Field) -> None:
    cannon = field.put("PhotonCannon", 1, 30.0, 30.0)
    field.put("Pylon", 2, 33.0, 30.0)
    field.play(1)
    assert not field.world.powered[cannon]


def test_a_structure_without_power_neither_fights_nor_works(field: Field) -> None:
    pylon = field.put("Pylon", 1, 30.0, 34.0)
    field.put("PhotonCannon", 1, 30.0, 30.0)
    gateway = field.put("Gateway", 1, 33.5, 33.5)
    field.world.players[1].minerals = 1000.0
    field.play(1)
    casting.use(field.world, [gateway], CATALOG.ability(916))
    assert casting.refusal(field.world, gateway, CATALOG.ability(917)) is ActionResult.TECH_REQUIREMENTS_NOT_MET
    field.play(10)
    field.world.life[pylon] = 0.0
    field.play(2)
    done = field.world.jobs[gateway][0].done
    foe = field.put("Marine", 2, 33.0, 28.0)
    field.play(40)
    assert field.world.jobs[gateway][0].done == done
    assert field.world.life[foe] == 45.0
    assert casting.refusal(field.world, gateway, CATALOG.ability(916)) is ActionResult.CANT_TRAIN_TOO_FAR_FROM_POWER
    field.put("Pylon", 1, 30.0, 34.0)
    field.play(40)
    assert field.world.jobs[gateway][0].done > done
    assert field.world.life[foe] < 45.0


def test_an_unfinished_pylon_supplies_nothing(field: Field) -> None:
    probe = field.put("Probe", 1, 28.0, 30.0)
    gateway = field.put("Gateway", 1, 34.5, 30.5)
    field.world.players[1].minerals = 100.0
    casting.use(field.world, [probe], CATALOG.ability(881), point=(31.0, 30.0))
    field.play(200)
    assert not field.world.powered[gateway]
    field.play(250)
    assert field.world.powered[gateway]


@pytest.mark.parametrize(
    ("near", "away", "fast"),
    [("Nexus", 6.5, True), ("Nexus", 7.5, False), ("Gateway", 6.4, True), ("Stargate", 3.0, False)],
)
def test_units_warp_in_fast_in_the_field_of_a_pylon_near_a_nexus_or_gateway(
    field: Field, near: str, away: float, fast: bool
) -> None:
    field.put("Pylon", 1, 30.0, 30.0)
    field.put(near, 1, 30.0 + away, 30.0)
    found = power.best(field.world, 1, (28.0, 30.0))
    assert found is not None
    assert found.fast == fast
