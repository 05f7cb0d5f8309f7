"""Graviton Beam, Pulsar Beam, Revelation, Stasis Trap and Prismatic Alignment, against both versions' numbers."""

from __future__ import annotations

import math
from typing import Any

import pytest

from khala_simulator.abilities import commands
from khala_simulator.combat import buffs
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.tables.stats import AIR_PLANE, GROUND_PLANE
from khala_simulator.world.columns import NOBODY

VERSIONS = ("4.10", "5.0.13")
LIFT, LET_GO, PULSE, NO_PULSE, REVEAL, TRAP, ALIGN, UNALIGN = 173, 174, 2375, 2376, 2146, 2505, 2393, 3707


def put(field: Any, name: str, owner: int, x: float, y: float, energy: float = 200.0) -> int:
    slot: int = field.put(name, owner, x, y)
    if field.world.energy_max[slot]:
        field.world.energy[slot] = energy
    return slot


def still(field: Any, name: str, owner: int, x: float, y: float) -> int:
    slot = put(field, name, owner, x, y)
    field.world.looks_around[slot] = False
    return slot


def has(field: Any, slot: int, name: str) -> bool:
    return buffs.has(field.world, slot, name)


# Graviton Beam --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("version", VERSIONS)
def test_a_phoenix_lifts_for_160_loops_and_what_it_lifts_is_in_the_air_and_helpless(
    make_field: Any, version: str
) -> None:
    field = make_field(version=version)
    phoenix, stalker = put(field, "Phoenix", 1, 8.0, 8.0), still(field, "Stalker", 2, 12.0, 8.0)
    assert field.order(phoenix, LIFT, stalker)
    field.play(1)
    assert field.world.plane_bits[stalker] == AIR_PLANE
    assert not (field.world.can_act[stalker] or field.world.can_attack[stalker] or field.world.can_cast[stalker])
    assert field.world.step_max[stalker] == 0.0
    assert field.world.energy[phoenix] == pytest.approx(150.0)
    field.play(159)
    assert field.world.plane_bits[stalker] == AIR_PLANE
    field.play(9)
    assert field.world.plane_bits[stalker] == GROUND_PLANE
    assert not has(field, stalker, "GravitonBeam")
    assert field.world.can_attack[stalker]
    assert not field.world.orders_of(phoenix)


def test_a_phoenix_neither_fires_nor_regains_energy_while_it_lifts(field: Any) -> None:
    phoenix, stalker = put(field, "Phoenix", 1, 8.0, 8.0), still(field, "Stalker", 2, 12.0, 8.0)
    still(field, "Mutalisk", 2, 10.0, 10.0)
    field.order(phoenix, LIFT, stalker)
    field.play(1)
    energy = float(field.world.energy[phoenix])
    field.play(100)
    assert field.world.energy[phoenix] == energy
    assert field.world.target[phoenix] == NOBODY
    field.play(70)
    assert field.world.target[phoenix] != NOBODY
    assert field.world.energy[phoenix] > energy


@pytest.mark.parametrize("how", ["cancel", "order", "death", "target cloaked from sight"])
def test_a_beam_ends_early_and_half_a_second_later_the_unit_is_free(make_field: Any, how: str) -> None:
    field = make_field()
    phoenix, stalker = put(field, "Phoenix", 1, 8.0, 8.0), still(field, "Stalker", 2, 12.0, 8.0)
    field.order(phoenix, LIFT, stalker)
    field.play(20)
    if how == "cancel":
        assert field.order(phoenix, LET_GO)
    elif how == "order":
        commands.move(field.world, [phoenix], (2.0, 2.0))
    elif how == "death":
        field.world.life[phoenix] = 0.0
    else:
        buffs.apply(field.world, stalker, "OracleStasisTrapTarget")
    field.play(2)
    assert has(field, stalker, "GravitonBeam")
    field.play(8)
    assert not has(field, stalker, "GravitonBeam")
    assert field.world.plane_bits[stalker] == GROUND_PLANE
    if how != "death":
        assert not has(field, phoenix, "DisablePhoenixWeapons")
        assert not has(field, phoenix, "DisableEnergyRegen")


@pytest.mark.parametrize(("name", "owner", "why"), [
    ("Colossus", 2, ActionResult.CANT_TARGET_MASSIVE_UNITS),
    ("Mutalisk", 2, ActionResult.MUST_TARGET_GROUND_UNITS),
    ("PhotonCannon", 2, ActionResult.CANT_TARGET_STRUCTURES),
    ("Zealot", 1, ActionResult.SUCCESS),  # own units may be lifted
    ("SiegeTank", 2, ActionResult.SUCCESS),
])  # fmt: skip
def test_what_can_be_lifted(field: Any, name: str, owner: int, why: ActionResult) -> None:
    phoenix = put(field, "Phoenix", 1, 8.0, 8.0)
    assert field.why_not(phoenix, LIFT, still(field, name, owner, 12.0, 8.0)) is why


def test_what_is_burrowed_and_seen_comes_out_of_the_ground_when_lifted(field: Any) -> None:
    phoenix, roach = put(field, "Phoenix", 1, 8.0, 8.0), still(field, "RoachBurrowed", 2, 12.0, 8.0)
    put(field, "Observer", 1, 10.0, 8.0)
    field.play(4)
    assert field.order(phoenix, LIFT, roach)
    field.play(1)
    assert field.world.unit_type(roach).name == "Roach"
    assert not field.world.cloaked[roach]


def test_nobody_is_lifted_twice_and_nothing_is_let_go_that_is_not_held(field: Any) -> None:
    one, other = put(field, "Phoenix", 1, 8.0, 8.0), put(field, "Phoenix", 1, 8.0, 11.0)
    stalker = still(field, "Stalker", 2, 12.0, 9.0)
    field.order(one, LIFT, stalker)
    field.play(2)
    assert field.why_not(other, LIFT, stalker) is ActionResult.MUST_TARGET_GROUND_UNITS
    assert field.why_not(other, LET_GO) is ActionResult.CANT_FIND_CANCEL_ORDER


def test_a_phoenix_lifts_from_4_away_and_needs_50_energy(field: Any) -> None:
    phoenix, stalker = put(field, "Phoenix", 1, 8.0, 8.0), still(field, "Stalker", 2, 22.0, 8.0)
    field.order(phoenix, LIFT, stalker)
    for _ in field.loops(100):
        if has(field, stalker, "GravitonBeam"):
            break
    away = 22.0 - field.world.pos[phoenix, 0]
    assert 4.0 + 0.75 + 0.625 - 0.35 <= away <= 4.0 + 0.75 + 0.625 + 1e-6
    field.world.energy[phoenix] = 49.0
    assert field.why_not(phoenix, LIFT, still(field, "Marine", 2, 20.0, 12.0)) is ActionResult.NOT_ENOUGH_ENERGY


def test_who_can_only_shoot_down_lets_go_of_the_lifted_and_who_shoots_up_takes_over(field: Any) -> None:
    phoenix, stalker = put(field, "Phoenix", 1, 8.0, 8.0), still(field, "Stalker", 2, 12.0, 8.0)
    zealot, helper = field.put("Zealot", 1, 11.0, 8.0), field.put("Phoenix", 1, 12.0, 10.0)
    commands.attack_unit(field.world, [zealot], field.world.tag_of(stalker))
    field.play(2)
    field.order(phoenix, LIFT, stalker)
    field.play(12)
    assert field.world.target[zealot] == NOBODY
    assert field.world.target[helper] == stalker


# Oracle ---------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("version", VERSIONS)
def test_a_pulsar_beam_costs_25_and_then_energy_all_the_time_until_there_is_none(make_field: Any, version: str) -> None:
    field = make_field(version=version)
    oracle = put(field, "Oracle", 1, 8.0, 8.0, energy=60.0)
    enemy = still(field, "SiegeTank", 2, 12.0, 8.0)
    field.play(10)
    assert field.world.target[oracle] == NOBODY
    before = float(field.world.energy[oracle])
    assert field.order(oracle, PULSE)
    assert field.world.energy[oracle] == pytest.approx(before - 25.0)
    field.play(32)
    assert field.world.energy[oracle] == pytest.approx(before - 25.0 - 32 * (2.0 - 0.5625) / 16)
    assert field.world.life[enemy] < 175.0
    field.play(math.ceil((before - 25.0) / (2.0 - 0.5625) * 16) - 32 + 2)
    assert not has(field, oracle, "OracleWeapon")
    assert field.world.target[oracle] == NOBODY
    assert field.world.energy[oracle] < 1.0


def test_a_pulsar_beam_deals_15_and_22_to_light_past_armor(field: Any) -> None:
    oracle = put(field, "Oracle", 1, 8.0, 8.0)
    marine, tank = still(field, "Marine", 2, 11.0, 8.0), still(field, "SiegeTank", 2, 8.0, 11.0)
    field.order(oracle, PULSE)
    for victim, damage in ((marine, 22.0), (tank, 15.0)):
        before = float(field.world.life[victim])
        commands.attack_unit(field.world, [oracle], field.world.tag_of(victim))
        for _ in field.loops(60):
            if field.world.life[victim] < before:
                break
        assert before - field.world.life[victim] == pytest.approx(damage)


def test_a_pulsar_beam_is_switched_off_and_can_be_on_again_after_four_seconds(field: Any) -> None:
    oracle = put(field, "Oracle", 1, 8.0, 8.0)
    assert field.why_not(oracle, NO_PULSE) is ActionResult.ERROR
    field.order(oracle, PULSE)
    field.play(10)
    assert field.why_not(oracle, PULSE) is ActionResult.COOLDOWN
    assert field.order(oracle, NO_PULSE)
    assert not has(field, oracle, "OracleWeapon")
    field.play(53)
    assert field.why_not(oracle, PULSE) is ActionResult.COOLDOWN
    field.play(1)
    assert field.why_not(oracle, PULSE) is ActionResult.SUCCESS
    field.order(oracle, PULSE)
    field.play(70)
    assert field.why_not(oracle, PULSE) is ActionResult.ERROR


@pytest.mark.parametrize(("version", "energy", "cooldown", "loops"), [("4.10", 50, 40, 672), ("5.0.13", 25, 224, 448)])
def test_a_revelation_shows_enemies_around_a_point_cloaked_ones_too(
    make_field: Any, version: str, energy: float, cooldown: int, loops: int
) -> None:
    field = make_field(version=version, fog=True)
    oracle = put(field, "Oracle", 1, 8.0, 8.0)
    hidden = still(field, "DarkTemplar", 2, 20.0, 8.0 + 6.0 + 0.3)
    beyond = still(field, "DarkTemplar", 2, 20.0, 8.0 + 6.0 + 0.5)
    own = still(field, "Zealot", 1, 20.0, 8.0)
    field.play(1)
    assert not field.world.visible[1, hidden]
    assert field.order(oracle, REVEAL, point=(20.0, 8.0))
    field.play(1)
    assert field.world.energy[oracle] == pytest.approx(200.0 - energy, abs=0.1)
    assert [has(field, s, "OracleRevelation") for s in (hidden, beyond, own)] == [True, False, False]
    assert field.world.visible[1, hidden]
    assert not field.world.cloaked[hidden]
    field.play(cooldown - 1)
    assert field.why_not(oracle, REVEAL, point=(20.0, 8.0)) is ActionResult.COOLDOWN
    field.play(1)
    assert field.why_not(oracle, REVEAL, point=(20.0, 8.0)) is ActionResult.SUCCESS
    field.play(loops - cooldown - 1)
    assert field.world.visible[1, hidden]
    field.play(6)
    assert field.world.cloaked[hidden]
    assert not field.world.visible[1, hidden]


def test_who_revealed_a_unit_sees_the_ground_within_3_of_it_wherever_it_goes(make_field: Any) -> None:
    field = make_field(fog=True)
    oracle, marine = put(field, "Oracle", 1, 4.0, 8.0), still(field, "Marine", 2, 14.0, 8.0)
    field.order(oracle, REVEAL, point=(14.0, 8.0))
    field.play(2)
    field.world.pos[oracle] = (2.0, 30.0)
    field.world.pos[marine] = (26.5, 8.5)
    field.play(5)
    seen = field.world.visibility[1] == 2
    assert seen[8, 26]
    assert seen[8, 28]
    assert not seen[8, 22]


@pytest.mark.parametrize("version", VERSIONS)
def test_a_stasis_trap_forms_in_80_loops_then_hides_and_lasts_238_seconds(make_field: Any, version: str) -> None:
    field = make_field(version=version)
    oracle = put(field, "Oracle", 1, 8.0, 8.0)
    assert field.order(oracle, TRAP, point=(9.2, 8.1))
    for _ in field.loops(20):
        if len(field.world.live) > 1:
            break
    begun = field.world.loop
    (trap,) = [s for s in field.world.live.tolist() if s != oracle]
    assert field.world.pos[trap].tolist() == [9.5, 8.5]
    assert field.world.energy[oracle] == pytest.approx(150.0, abs=0.1)
    assert not field.world.cloaked[trap]
    built = field.world.loop
    for loop in field.loops(100):
        if field.world.build_progress[trap] == 1.0:
            built = loop
            break
    assert built - begun == 80
    assert field.world.cloaked[trap]
    assert not field.world.visible[2, trap]
    assert field.world.expires[trap] == built + 3808


def trap_at(field: Any, x: float, y: float) -> int:
    return put(field, "OracleStasisTrap", 1, x, y)


@pytest.mark.parametrize("version", VERSIONS)
def test_a_trap_catches_ground_enemies_within_5_once_one_comes_within_3(make_field: Any, version: str) -> None:
    field = make_field(version=version)
    trap = trap_at(field, 8.5, 8.5)
    near = still(field, "Marine", 2, 8.5 + 5.0 + 0.375 - 0.1, 8.5)
    far = still(field, "Marine", 2, 8.5, 8.5 + 5.0 + 0.375 + 0.1)
    flyer, friend = still(field, "Mutalisk", 2, 9.0, 9.0), still(field, "Zealot", 1, 7.0, 7.0)
    field.play(12)
    assert field.world.alive[trap]
    assert not has(field, near, "OracleStasisTrapTarget")
    first = still(field, "Marine", 2, 8.5, 8.5 - 3.0)
    for _ in field.loops(20):
        if has(field, first, "OracleStasisTrapTarget"):
            break
    caught = field.world.loop
    assert 8 <= caught - 12 <= 8 + 5
    assert [has(field, s, "OracleStasisTrapTarget") for s in (near, far, flyer, friend)] == [True] + [False] * 3
    assert not (field.world.targetable[first] or field.world.can_act[first] or field.world.can_attack[first])
    field.play(28)
    assert not field.world.alive[trap]
    field.play(caught + 479 - field.world.loop)
    assert has(field, first, "OracleStasisTrapTarget")
    field.play(1)
    assert not has(field, first, "OracleStasisTrapTarget")
    assert field.world.targetable[first]


def test_a_trap_can_t_be_set_where_nothing_can_stand(field: Any) -> None:
    oracle = put(field, "Oracle", 1, 8.0, 8.0)
    field.put("Pylon", 1, 12.0, 12.0)
    assert field.why_not(oracle, TRAP, point=(12.0, 12.0)) is ActionResult.CANT_BUILD_LOCATION_INVALID
    field.world.energy[oracle] = 49.0
    assert field.why_not(oracle, TRAP, point=(15.0, 15.0)) is ActionResult.NOT_ENOUGH_ENERGY


# Void Ray -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("version", VERSIONS)
def test_an_aligned_void_ray_deals_6_more_to_armored_and_is_slower(make_field: Any, version: str) -> None:
    taken = {}
    for aligned in (False, True):
        for victim in ("SiegeTank", "Marine"):
            field = make_field(version=version)
            ray = put(field, "VoidRay", 1, 8.0, 8.0)
            other = still(field, victim, 2, 11.0, 8.0)
            speed = float(field.world.step_max[ray])
            if aligned:
                assert field.order(ray, ALIGN)
                assert field.world.step_max[ray] == pytest.approx(0.75 * speed)
            before = float(field.world.life[other])
            commands.attack_unit(field.world, [ray], field.world.tag_of(other))
            for _ in field.loops(40):
                if field.world.life[other] < before:
                    break
            taken[aligned, victim] = before - float(field.world.life[other])
    assert taken[True, "SiegeTank"] - taken[False, "SiegeTank"] == pytest.approx(6.0)
    assert taken[True, "Marine"] == taken[False, "Marine"]


def test_an_alignment_lasts_20_seconds_cools_down_for_60_and_can_be_given_up(field: Any) -> None:
    ray = put(field, "VoidRay", 1, 8.0, 8.0)
    assert field.why_not(ray, UNALIGN) is ActionResult.TECH_REQUIREMENTS_NOT_MET
    field.order(ray, ALIGN)
    field.play(319)
    assert has(field, ray, "VoidRaySwarmDamageBoost")
    field.play(1)
    assert not has(field, ray, "VoidRaySwarmDamageBoost")
    field.play(960 - 321)
    assert field.why_not(ray, ALIGN) is ActionResult.COOLDOWN
    field.play(1)
    field.order(ray, ALIGN)
    assert field.order(ray, UNALIGN)
    assert not has(field, ray, "VoidRaySwarmDamageBoost")


def test_a_faster_void_ray_is_slowed_more_by_its_alignment(make_field: Any) -> None:
    field = make_field(version="5.0.13")
    ray = put(field, "VoidRay", 1, 8.0, 8.0)
    field.research(1, "VoidRaySpeedUpgrade")
    assert field.world.step_max[ray] * 16 == pytest.approx(3.3203)
    field.order(ray, ALIGN)
    assert field.world.step_max[ray] * 16 == pytest.approx(3.3203 * 0.621)
    assert field.world.step_gain[ray] * 256 == pytest.approx(2.6875 * 0.7441)


def test_a_tempest_with_its_upgrade_deals_40_more_to_structures(make_field: Any) -> None:
    taken = []
    for upgrades in ((), ("TempestGroundAttackUpgrade",)):
        field = make_field(version="5.0.13")
        field.research(1, *upgrades)
        tempest, target = put(field, "Tempest", 1, 8.0, 8.0), still(field, "Hatchery", 2, 18.5, 8.5)
        commands.attack_unit(field.world, [tempest], field.world.tag_of(target))
        before = float(field.world.life[target])
        for _ in field.loops(80):
            if field.world.life[target] < before - 5.0:
                break
        taken.append(before - float(field.world.life[target]))
    assert taken[1] - taken[0] == pytest.approx(40.0, abs=1.0)


def test_a_phoenix_with_its_upgrade_reaches_two_farther(field: Any) -> None:
    phoenix = put(field, "Phoenix", 1, 8.0, 8.0)
    row = int(field.world.air_weapon[phoenix])
    before = field.world.stats.range[1, row]
    field.research(1, "PhoenixRangeUpgrade")
    assert field.world.stats.range[1, row] - before == 2.0
