"""Purification Nova, the Immortal's barrier, and the changes of mode, against the numbers of both game versions."""

from __future__ import annotations

import math
from typing import Any

import pytest

from khala_simulator.abilities import commands
from khala_simulator.combat import buffs, lifecycle
from khala_simulator.combat.damage import apply_damage
from khala_simulator.tables.action_result import ActionResult

VERSIONS = ("4.10", "5.0.13")
NOVA, SURVEY, OBSERVE, PHASE, TRANSPORT = 2346, 3741, 3739, 1528, 1530
RADIUS = {"4.10": 1.5, "5.0.13": 1.375}


def named(field: Any, name: str) -> list[int]:
    return [s for s in field.world.live.tolist() if field.world.unit_type(s).name == name]


def still(field: Any, name: str, owner: int, x: float, y: float) -> int:
    slot: int = field.put(name, owner, x, y)
    field.world.looks_around[slot] = False
    return slot


# Purification Nova ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("version", VERSIONS)
def test_a_nova_flies_for_48_loops_and_bursts_where_it_is(make_field: Any, version: str) -> None:
    field = make_field(version=version)
    slot = field.put("Disruptor", 1, 8.0, 8.0)
    edge = RADIUS[version] + field.world.catalog.unit("Ultralisk").radius
    inside = still(field, "Ultralisk", 2, 16.0, 8.0 + edge - 0.05)
    outside = still(field, "Roach", 2, 16.0, 8.0 - RADIUS[version] - 0.625 - 0.2)
    flyer = still(field, "Mutalisk", 2, 16.0, 8.0)
    before = {s: float(field.world.life[s]) for s in (inside, outside, flyer)}
    assert field.order(slot, NOVA, point=(16.0, 8.0))
    field.play(1)
    (nova,) = named(field, "DisruptorPhased")
    field.play(47)
    assert field.world.pos[nova].tolist() == pytest.approx([16.0, 8.0])
    assert before[inside] == field.world.life[inside]
    field.play(1)
    assert not named(field, "DisruptorPhased")
    assert before[inside] - field.world.life[inside] == pytest.approx(145.0, abs=0.1)
    assert [field.world.life[s] for s in (outside, flyer)] == [before[outside], before[flyer]]


def test_a_nova_goes_48_loops_at_its_speed_and_where_it_is_told(field: Any) -> None:
    slot = field.put("Disruptor", 1, 4.0, 8.0)
    field.order(slot, NOVA, point=(30.0, 8.0))
    field.play(1)
    (nova,) = named(field, "DisruptorPhased")
    field.play(24)
    way = field.world.pos[nova, 0] - 4.0
    assert way == pytest.approx(24 * 4.25 / 16, abs=0.6)
    assert commands.move(field.world, [nova], (field.world.pos[nova, 0], 30.0)) == [nova]
    field.play(23)
    assert field.world.pos[nova, 1] == pytest.approx(8.0 + 23 * 4.25 / 16, abs=0.6)


@pytest.mark.parametrize(("name", "owner", "shields", "life"), [
    ("Archon", 2, 200.0, 0.0),  # 145 and 55 more that only shields take
    ("Immortal", 1, 100.0, 45.0),  # friends too: 145 less the 100 that the shields held
    ("Disruptor", 1, 0.0, 0.0),  # but not the owner's Disruptors
    ("Disruptor", 2, 100.0, 45.0),
])  # fmt: skip
def test_a_nova_hurts_shields_more_and_spares_only_own_disruptors(
    field: Any, name: str, owner: int, shields: float, life: float
) -> None:
    slot = field.put("Disruptor", 1, 8.0, 8.0)
    victim = still(field, name, owner, 14.0, 8.0)
    field.world.timers.setdefault(victim, {})["ImmortalOverload"] = 1e9
    before = field.world.shields[victim], field.world.life[victim]
    field.order(slot, NOVA, point=(14.0, 8.0))
    field.play(49)
    assert before[0] - field.world.shields[victim] == pytest.approx(shields)
    assert before[1] - field.world.life[victim] == pytest.approx(life)


@pytest.mark.parametrize("how", ["dead", "lifted", "in stasis", "carried"])
def test_a_nova_goes_out_with_its_disruptor(field: Any, how: str) -> None:
    slot = field.put("Disruptor", 1, 8.0, 8.0)
    victim = still(field, "Ultralisk", 2, 14.0, 8.0)
    field.order(slot, NOVA, point=(14.0, 8.0))
    field.play(20)
    if how == "dead":
        field.world.life[slot] = 0.0
    elif how == "carried":
        lifecycle.stow(field.world, slot, field.put("WarpPrism", 1, 4.0, 4.0))
    else:
        buffs.apply(field.world, slot, "GravitonBeam" if how == "lifted" else "OracleStasisTrapTarget", loops=60)
    field.play(40)
    assert not named(field, "DisruptorPhased")
    assert field.world.life[victim] == 500.0


def test_a_disruptor_hardly_moves_while_its_nova_flies_and_cools_down_for_30_seconds(field: Any) -> None:
    slot = field.put("Disruptor", 1, 8.0, 8.0)
    field.order(slot, NOVA, point=(14.0, 8.0))
    field.play(1)
    assert field.world.step_max[slot] * 16 == pytest.approx(2.25 - 2.2382)
    assert field.why_not(slot, NOVA, point=(9.0, 9.0)) is ActionResult.COOLDOWN
    field.play(48)
    assert field.world.step_max[slot] * 16 == pytest.approx(2.25)
    field.play(480 - 49)
    assert field.why_not(slot, NOVA, point=(9.0, 9.0)) is ActionResult.COOLDOWN
    field.play(1)
    assert field.why_not(slot, NOVA, point=(9.0, 9.0)) is ActionResult.SUCCESS


# the barrier ----------------------------------------------------------------------------------------------------------


def hit(field: Any, victim: int, amount: float) -> None:
    apply_damage(field.world, -1, 2, victim, amount)


def test_in_4_10_the_first_damage_raises_a_barrier_of_100_for_3_seconds(make_field: Any) -> None:
    field = make_field(version="4.10")
    slot = field.put("Immortal", 1, 8.0, 8.0)
    field.play(5)
    hit(field, slot, 10.0)
    field.play(1)
    assert (field.world.shields[slot], field.world.barrier[slot]) == (90.0, 100.0)
    assert buffs.has(field.world, slot, "ImmortalOverload")
    hit(field, slot, 60.0)
    assert (field.world.shields[slot], field.world.barrier[slot]) == (90.0, 40.0)
    hit(field, slot, 60.0)
    assert (field.world.shields[slot], field.world.barrier[slot]) == (70.0, 0.0)
    field.play(2)
    assert not buffs.has(field.world, slot, "ImmortalOverload")


def test_in_4_10_a_barrier_ends_after_48_loops_and_comes_again_after_45_seconds(make_field: Any) -> None:
    field = make_field(version="4.10")
    slot = field.put("Immortal", 1, 8.0, 8.0)
    field.play(1)
    hit(field, slot, 1.0)
    field.play(1)
    began = field.world.loop
    field.play(47)
    assert field.world.barrier[slot] == 100.0
    field.play(1)
    assert field.world.barrier[slot] == 0.0
    field.play(began + 718 - field.world.loop)
    hit(field, slot, 1.0)
    field.play(1)
    assert field.world.barrier[slot] == 0.0
    field.play(2)
    hit(field, slot, 1.0)
    field.play(1)
    assert field.world.barrier[slot] == 100.0


def test_in_5_0_13_the_barrier_stands_before_the_first_damage_and_48_loops_from_there(make_field: Any) -> None:
    field = make_field(version="5.0.13")
    slot = field.put("Immortal", 1, 8.0, 8.0)
    field.play(200)
    assert field.world.barrier[slot] == 100.0
    hit(field, slot, 30.0)
    assert (field.world.shields[slot], field.world.barrier[slot]) == (100.0, 70.0)
    field.play(1)
    began = field.world.loop
    field.play(47)
    assert field.world.barrier[slot] == 70.0
    field.play(1)
    assert field.world.barrier[slot] == 0.0
    field.play(began + 719 - field.world.loop)
    assert field.world.barrier[slot] == 0.0
    field.play(2)
    assert field.world.barrier[slot] == 100.0


# modes ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize(("name", "to", "back", "there", "loops"), [
    ("Observer", SURVEY, OBSERVE, "ObserverSiegeMode", 12),
    ("WarpPrism", PHASE, TRANSPORT, "WarpPrismPhasing", 24),
])  # fmt: skip
def test_a_flyer_changes_mode_and_back_and_stands_still_meanwhile(
    make_field: Any, version: str, name: str, to: int, back: int, there: str, loops: int
) -> None:
    field = make_field(version=version)
    slot = field.put(name, 1, 8.0, 8.0)
    assert field.order(slot, to)
    field.play(1)
    field.play(loops - 1)
    assert field.world.unit_type(slot).name == name
    field.play(1)
    assert field.world.unit_type(slot).name == there
    assert not commands.move(field.world, [slot], (20.0, 20.0)) or math.isclose(field.world.step_max[slot], 0.0)
    field.order(slot, back)
    field.play(loops + 1)
    assert field.world.unit_type(slot).name == name
    commands.move(field.world, [slot], (20.0, 20.0))
    field.play(20)
    assert field.world.pos[slot].tolist() != [8.0, 8.0]


def test_a_surveying_observer_sees_and_detects_a_quarter_farther(field: Any) -> None:
    slot = field.put("Observer", 1, 8.0, 8.0)
    field.research(1, "ObserverGraviticBooster")
    field.order(slot, SURVEY)
    field.play(14)
    assert (field.world.sight[slot], field.world.detects[slot]) == (13.75, 13.75)
    assert field.world.cloaked[slot]
