"""Warp Gates: where units can be warped in, how long it takes, and when the gate is ready again."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from khala_simulator.abilities import casting
from khala_simulator.combat.buffs import apply
from khala_simulator.economy import supply
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.tables.catalog import load_catalog
from khala_simulator.world.casts import Cast

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.simulator.engine.conftest import Field

CATALOG = load_catalog()
STALKER, ZEALOT, CANCEL = 1414, 1413, 1412


class Gate:
    """A gate in a slow power field, and another, far field."""

    def __init__(self, field: Field) -> None:
        self.field, self.world = field, field.world
        field.put("Pylon", 1, 20.0, 30.0)
        self.slot = field.put("WarpGate", 1, 16.5, 30.5)
        field.put("CyberneticsCore", 1, 20.5, 25.5)
        field.put("Pylon", 1, 50.0, 50.0)
        for _ in range(3):
            field.put("Pylon", 1, 5.0, 5.0)
        self.player = field.world.players[1]
        self.player.minerals = self.player.vespene = 1000.0
        field.play(1)

    def warp(self, number: int, point: tuple[float, float]) -> list[int]:
        return casting.use(self.world, [self.slot], CATALOG.ability(number), point=point)

    def newest(self) -> int:
        slots: list[int] = self.world.live.tolist()
        return max(slots, key=lambda s: int(self.world.born_loop[s]))


@pytest.fixture
def gate(make_field: Callable[..., Field]) -> Gate:
    return Gate(make_field("{flat: [64, 64]}"))


@pytest.mark.parametrize(("point", "loops"), [((50.0, 47.0), 256), ((20.0, 33.0), 81)])
def test_a_unit_is_there_at_once_and_finished_later(gate: Gate, point: tuple[float, float], loops: int) -> None:
    assert gate.warp(STALKER, point) == [gate.slot]
    stalker = gate.newest()
    assert gate.world.unit_type(stalker).name == "Stalker"
    assert gate.world.pos[stalker].tolist() == list(point)
    assert (gate.player.minerals, gate.player.vespene) == (875.0, 950.0)
    assert supply.in_use(gate.world, 1) == 2.0
    gate.field.play(1)  # clients see it from now on; recorded games show 256 and 81 loops
    gate.field.play(loops - 1)
    assert gate.world.build_progress[stalker] < 1.0
    assert not gate.world.can_act[stalker]
    gate.field.play(1)
    assert gate.world.build_progress[stalker] == 1.0
    assert gate.world.can_act[stalker]
    assert gate.world.alerts[-1].name == "WarpInComplete"


@pytest.mark.parametrize(("number", "loops"), [(STALKER, 512), (ZEALOT, 448)])
def test_the_gate_is_ready_again_after_the_time_of_the_unit(gate: Gate, number: int, loops: int) -> None:
    gate.warp(number, (50.0, 47.0))
    ability = CATALOG.ability(number)
    assert casting.refusal(gate.world, gate.slot, ability) is ActionResult.COOLDOWN
    gate.field.play(loops - 1)
    assert casting.refusal(gate.world, gate.slot, ability) is ActionResult.COOLDOWN
    gate.field.play(1)
    assert casting.refusal(gate.world, gate.slot, ability) is ActionResult.SUCCESS


def test_chrono_boost_makes_the_gate_ready_sooner(gate: Gate) -> None:
    gate.warp(ZEALOT, (50.0, 47.0))
    apply(gate.world, gate.slot, "ChronoBoostEnergyCost")
    ready = CATALOG.ability(ZEALOT)
    loops = gate.field.loops(448)
    done = next(loop for loop in loops if casting.refusal(gate.world, gate.slot, ready) is ActionResult.SUCCESS)
    assert done - 1 == pytest.approx(448 / 1.5, abs=1.5)


@pytest.mark.parametrize(
    ("point", "refusal"),
    [
        ((50.0, 47.0), ActionResult.SUCCESS),
        ((35.0, 40.0), ActionResult.CANT_BUILD_TOO_FAR_FROM_POWER),
        ((50.0, 50.0), ActionResult.CANT_WARP_IN_UNITS_THERE),  # the Pylon itself
        ((48.0, 52.0), ActionResult.CANT_WARP_IN_UNITS_THERE),  # a unit stands there
    ],
)
def test_where_units_can_be_warped_in(gate: Gate, point: tuple[float, float], refusal: ActionResult) -> None:
    gate.field.put("Zealot", 1, 48.0, 52.0)
    cast = Cast(gate.slot, CATALOG.ability(STALKER), point=point)
    assert casting.aim_refusal(gate.world, cast) is refusal


def test_of_two_gates_one_warps_in(gate: Gate) -> None:
    other = gate.field.put("WarpGate", 1, 16.5, 34.5)
    gate.field.play(1)
    both = [gate.slot, other]
    assert casting.use(gate.world, both, CATALOG.ability(ZEALOT), point=(50.0, 47.0)) == [gate.slot]
    assert casting.use(gate.world, both, CATALOG.ability(ZEALOT), point=(53.0, 47.0)) == [other]


def test_a_unit_that_is_being_warped_in_can_die_and_can_be_called_off(gate: Gate) -> None:
    gate.warp(ZEALOT, (50.0, 47.0))
    zealot = gate.newest()
    casting.use(gate.world, [zealot], CATALOG.ability(CANCEL))
    assert gate.player.minerals == 1000.0 - 100.0 + 75.0
    assert supply.in_use(gate.world, 1) == 0.0
