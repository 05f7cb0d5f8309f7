"""Psi Storm, Feedback and Archons, against the numbers of both game versions."""

from __future__ import annotations

import math
from typing import Any

import pytest

from khala_simulator.abilities import casting, commands
from khala_simulator.combat import buffs
from khala_simulator.tables.action_result import ActionResult

VERSIONS = ("4.10", "5.0.13")
PSI_STORM, FEEDBACK, MERGE, MERGE_WITH = 1036, 140, 1766, 1767
STORM_TICK = 10.0


def templar(field: Any, x: float = 8.0, y: float = 8.0) -> int:
    slot: int = field.put("HighTemplar", 1, x, y)
    field.world.energy[slot] = 200.0
    field.research(1, "PsiStormTech")
    return slot


def still(field: Any, name: str, owner: int, x: float, y: float) -> int:
    """Return a unit that stays where it is and does not fight."""
    slot: int = field.put(name, owner, x, y)
    field.world.looks_around[slot] = False
    return slot


# Psi Storm ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("version", VERSIONS)
def test_a_storm_deals_80_over_4_seconds_to_who_stays(make_field: Any, version: str) -> None:
    field = make_field(version=version)
    slot = templar(field)
    victim = still(field, "Marauder", 2, 16.0, 8.0)
    field.order(slot, PSI_STORM, point=(16.0, 8.0))
    hits = []
    before = field.world.life[victim]
    for loop in field.loops(80):
        if field.world.life[victim] < before:
            hits.append((loop, before - field.world.life[victim]))
            before = field.world.life[victim]
    assert [amount for _, amount in hits] == [STORM_TICK] * 8
    ticks = [loop - hits[0][0] for loop, _ in hits]
    assert ticks == [math.ceil(round(i * 0.571 * 16, 6)) for i in range(8)]


def test_two_storms_on_one_unit_do_not_add_up(field: Any) -> None:
    one, other = templar(field, 8.0, 8.0), templar(field, 8.0, 10.0)
    victim = still(field, "Marauder", 2, 17.3, 9.0)
    field.order(one, PSI_STORM, point=(17.3, 9.0))
    field.order(other, PSI_STORM, point=(17.3, 9.0))
    field.play(80)
    assert field.world.life[victim] == 125.0 - 80.0


@pytest.mark.parametrize(("name", "owner", "hurt"), [("Stalker", 1, True), ("Mutalisk", 2, True), ("Pylon", 2, False),
                                                     ("Observer", 1, True), ("Hydralisk", 2, True)])  # fmt: skip
def test_a_storm_hurts_friend_and_foe_on_the_ground_and_in_the_air_but_no_structures(
    field: Any, name: str, owner: int, *, hurt: bool
) -> None:
    slot = templar(field)
    other = still(field, name, owner, 16.0, 8.0)
    before = field.vitals(other)
    field.order(slot, PSI_STORM, point=(16.0, 8.0))
    field.play(3)
    assert bool(field.vitals(other) < before) is hurt


@pytest.mark.parametrize(("away", "hurt"), [(1.5 + 0.375 - 0.01, True), (1.5 + 0.375 + 0.01, False)])
def test_a_storm_reaches_1_5_to_the_edge(field: Any, away: float, *, hurt: bool) -> None:
    slot = templar(field)
    marine = still(field, "Marine", 2, 16.0, 8.0 + away)
    field.order(slot, PSI_STORM, point=(16.0, 8.0))
    field.play(3)
    assert bool(field.world.life[marine] < 45.0) is hurt


def test_who_leaves_a_storm_takes_one_tick_more_at_most(field: Any) -> None:
    slot = templar(field)
    victim = still(field, "Roach", 2, 16.0, 8.0)
    field.order(slot, PSI_STORM, point=(16.0, 8.0))
    field.play(2)
    assert field.world.life[victim] == pytest.approx(135.0, abs=0.1)
    field.world.pos[victim] = (16.0, 14.0)
    field.play(30)
    assert field.world.life[victim] == pytest.approx(125.0, abs=1.0)
    assert not buffs.has(field.world, victim, "PsiStorm")


def test_clients_see_a_storm_as_effect_1_and_buff_28(field: Any) -> None:
    slot = templar(field)
    victim = still(field, "Roach", 2, 16.0, 8.0)
    field.order(slot, PSI_STORM, point=(16.0, 8.0))
    field.play(1)
    (storm,) = field.world.area_effects
    assert (storm.effect, storm.at, storm.radius) == (1, (16.0, 8.0), 1.5)
    assert [field.world.catalog.buffs[r].id for r in field.world.buffs.of(victim)["buff"]] == [28]
    for _ in field.loops(80):
        if not field.world.area_effects:
            break
    assert field.world.loop - 1 == math.ceil(6 * 0.5712 * 16)


def test_a_storm_needs_its_research_energy_and_two_seconds_between_two(field: Any) -> None:
    slot = field.put("HighTemplar", 1, 8.0, 8.0)
    field.world.energy[slot] = 200.0
    assert field.why_not(slot, PSI_STORM, point=(12.0, 8.0)) is ActionResult.TECH_REQUIREMENTS_NOT_MET
    field.research(1, "PsiStormTech")
    field.order(slot, PSI_STORM, point=(12.0, 8.0))
    field.play(1)
    assert field.world.energy[slot] == pytest.approx(125.0, abs=0.1)
    assert field.why_not(slot, PSI_STORM, point=(12.0, 8.0)) is ActionResult.COOLDOWN
    field.play(32)
    assert field.why_not(slot, PSI_STORM, point=(12.0, 8.0)) is ActionResult.SUCCESS
    field.world.energy[slot] = 74.0
    assert field.why_not(slot, PSI_STORM, point=(12.0, 8.0)) is ActionResult.NOT_ENOUGH_ENERGY


def test_of_many_templars_told_to_storm_one_does(field: Any) -> None:
    slots = [templar(field, 8.0, 6.0 + i) for i in range(3)]
    storm = field.world.catalog.ability(PSI_STORM)
    assert len(casting.use(field.world, slots, storm, point=(15.0, 8.0))) == 1


# Feedback -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("version", "reach"), [("4.10", 9.0), ("5.0.13", 10.0)])
def test_feedback_takes_all_energy_and_half_of_it_as_damage_from_its_range(
    make_field: Any, version: str, reach: float
) -> None:
    field = make_field(version=version)
    slot = templar(field)
    victim = still(field, "Infestor", 2, 8.0 + reach + 0.375 + 0.625 - 0.01, 8.0)
    field.world.energy[victim] = 120.0
    field.order(slot, FEEDBACK, victim)
    field.play(1)
    assert field.world.pos[slot].tolist() == [8.0, 8.0]
    assert field.world.energy[victim] == pytest.approx(0.5625 / 16)
    assert field.world.life[victim] == pytest.approx(90.0 - 60.0, abs=0.1)
    assert field.world.energy[slot] == pytest.approx(150.0, abs=0.1)


@pytest.mark.parametrize(("name", "why"), [
    ("Nexus", ActionResult.CANT_TARGET_THAT_UNIT),
    ("OrbitalCommand", ActionResult.CANT_TARGET_THAT_UNIT),
    ("ShieldBattery", ActionResult.CANT_TARGET_THAT_UNIT),
    ("Marine", ActionResult.MUST_TARGET_ENERGY_CAPABLE_UNITS),
    ("Medivac", ActionResult.SUCCESS),
])  # fmt: skip
def test_feedback_is_for_enemies_with_energy_but_not_for_these_structures(
    field: Any, name: str, why: ActionResult
) -> None:
    slot = templar(field)
    assert field.why_not(slot, FEEDBACK, still(field, name, 2, 12.0, 8.0)) is why


def test_feedback_is_not_for_friends_nor_for_who_has_no_energy_left(field: Any) -> None:
    slot = templar(field)
    empty = still(field, "Medivac", 2, 12.0, 8.0)
    field.world.energy[empty] = 0.0
    assert field.why_not(slot, FEEDBACK, empty) is ActionResult.MUST_TARGET_ENERGY_CAPABLE_UNITS
    assert field.why_not(slot, FEEDBACK, templar(field, 12.0, 12.0)) is ActionResult.CANT_TARGET_YOUR_OWN_UNITS


# Archons --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("pair", [("HighTemplar", "HighTemplar"), ("HighTemplar", "DarkTemplar"),
                                  ("DarkTemplar", "DarkTemplar")])  # fmt: skip
def test_two_templars_walk_to_each_other_and_are_an_archon_192_loops_after_they_met(
    make_field: Any, version: str, pair: tuple[str, str]
) -> None:
    field = make_field(version=version)
    slots = [field.put(name, 1, 8.0 + 4 * i, 8.0) for i, name in enumerate(pair)]
    assert casting.use(field.world, slots, field.world.catalog.ability(MERGE)) == slots
    met = 0
    for loop in field.loops(80):
        if len(field.world.live) == 1:
            met = loop
            break
    (archon,) = field.world.live.tolist()
    assert met > 5
    assert field.world.unit_type(archon).name == "Archon"
    assert field.world.pos[archon] == pytest.approx((10.0, 8.0), abs=0.5)
    field.play(191)
    assert field.world.build_progress[archon] == pytest.approx(191 / 192)
    assert not field.world.can_attack[archon]
    field.play(1)
    assert field.world.build_progress[archon] == 1.0
    assert field.world.can_attack[archon]
    assert (field.world.life[archon], field.world.shields[archon]) == (10.0, 350.0)
    assert field.world.players[1].score.lost_units == 0


def test_four_templars_make_two_archons_and_a_fifth_is_left(field: Any) -> None:
    slots = [field.put("HighTemplar", 1, 6.0 + 3 * i, 8.0) for i in range(5)]
    casting.use(field.world, slots, field.world.catalog.ability(MERGE))
    field.play(60)
    names = sorted(field.world.unit_type(s).name for s in field.world.live.tolist())
    assert names == ["Archon", "Archon", "HighTemplar"]


def test_a_templar_alone_stays_a_templar_and_is_idle_again(field: Any) -> None:
    slot = templar(field)
    field.order(slot, MERGE)
    field.play(3)
    assert not field.world.orders_of(slot)


def test_a_templar_may_be_told_whom_to_merge_with(field: Any) -> None:
    slot, near, far = templar(field), templar(field, 9.0, 11.0), templar(field, 13.0, 8.0)
    assert field.order(slot, MERGE_WITH, far)
    field.play(60)
    assert field.world.alive[near]
    assert sorted(field.world.unit_type(s).name for s in field.world.live.tolist()) == ["Archon", "HighTemplar"]


@pytest.mark.parametrize(("name", "owner", "why"), [
    ("Zealot", 1, ActionResult.CANT_TARGET_THAT_UNIT),
    ("HighTemplar", 2, ActionResult.MUST_TARGET_YOUR_OWN_UNITS),
])  # fmt: skip
def test_only_an_own_templar_is_a_partner(field: Any, name: str, owner: int, why: ActionResult) -> None:
    slot = templar(field)
    assert field.why_not(slot, MERGE_WITH, field.put(name, owner, 12.0, 8.0)) is why
    assert field.why_not(slot, MERGE_WITH, slot) is ActionResult.CANT_TARGET_THAT_UNIT


def test_a_templar_that_dies_on_the_way_leaves_the_other_one_idle(field: Any) -> None:
    one, other = templar(field, 6.0, 8.0), templar(field, 20.0, 8.0)
    casting.use(field.world, [one, other], field.world.catalog.ability(MERGE))
    field.play(5)
    field.world.life[other] = 0.0
    field.play(3)
    assert not field.world.orders_of(one)
    assert commands.move(field.world, [one], (3.0, 3.0)) == [one]
