"""Recalls, Time Warp, cloaking fields, Chrono Boost and Shield Batteries, against both versions' numbers."""

from __future__ import annotations

import math
from typing import Any

import pytest

from khala_simulator.abilities import casting, commands
from khala_simulator.combat import buffs
from khala_simulator.tables.action_result import ActionResult

VERSIONS = ("4.10", "5.0.13")
RECALL, NEXUS_RECALL, TIME_WARP, CLOAK, CHRONO, OVERCHARGE = 142, 3757, 2244, 4122, 3755, 4107
TRAIN_PROBE = 1006
RECHARGE = {"4.10": 3765, "5.0.13": 4111}


def put(field: Any, name: str, owner: int, x: float, y: float, energy: float = 200.0) -> int:
    slot: int = field.put(name, owner, x, y)
    if field.world.energy_max[slot]:
        field.world.energy[slot] = min(energy, float(field.world.energy_max[slot]))
    field.world.looks_around[slot] = False
    return slot


def has(field: Any, slot: int, name: str) -> bool:
    return buffs.has(field.world, slot, name)


# recalls --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("version", "radius"), [("4.10", 6.5), ("5.0.13", 5.0)])
def test_a_mothership_brings_what_is_in_the_circle_to_itself_after_80_loops(
    make_field: Any, version: str, radius: float
) -> None:
    field = make_field(version=version)
    ship = put(field, "Mothership", 1, 26.0, 26.0)
    inside = put(field, "Zealot", 1, 10.0 + radius + 0.4, 10.0)
    outside = put(field, "Zealot", 1, 10.0, 10.0 + radius + 0.6)
    enemy, tower = put(field, "Zergling", 2, 10.0, 8.0), put(field, "Pylon", 1, 9.0, 9.0)
    commands.move(field.world, [inside], (30.0, 5.0))
    assert field.order(ship, RECALL, point=(10.0, 10.0))
    field.play(1)
    assert not field.world.can_attack[inside]
    assert field.world.step_max[inside] == 0.0
    field.play(79)
    assert field.world.pos[inside, 1] < 11.0
    field.play(1)
    x, y = field.world.pos[inside].tolist()
    assert (x, y) == pytest.approx((26.0 + min(radius + 0.4, 6.0), 26.0), abs=2.0)
    assert [has(field, s, "NexusRecalled") for s in (inside, outside, enemy, tower)] == [True, False, False, False]
    assert not field.world.orders_of(inside)
    field.play(15)
    assert field.world.step_max[inside] == 0.0
    field.play(1)
    assert field.world.step_max[inside] > 0.0


@pytest.mark.parametrize(("version", "cooldown"), [("4.10", 1904), ("5.0.13", 2912)])
def test_a_nexus_recalls_what_is_within_2_5_and_no_nexus_does_for_a_while(
    make_field: Any, version: str, cooldown: int
) -> None:
    field = make_field(version=version)
    nexus, second = put(field, "Nexus", 1, 24.5, 24.5), put(field, "Nexus", 1, 6.5, 24.5)
    near, far = put(field, "Stalker", 1, 8.0 + 2.5 + 0.6, 8.0), put(field, "Stalker", 1, 8.0, 8.0 + 2.5 + 0.7)
    assert field.order(nexus, NEXUS_RECALL, point=(8.0, 8.0))
    field.play(1)
    assert field.world.energy[nexus] == pytest.approx(150.0, abs=0.1)
    assert field.why_not(second, NEXUS_RECALL, point=(8.0, 8.0)) is ActionResult.COOLDOWN
    field.play(81)
    assert math.dist(field.world.pos[near], (24.5, 24.5)) < 6.0
    assert math.dist(field.world.pos[far], (8.0, 11.2)) < 0.1
    field.play(cooldown - 82)
    assert field.why_not(second, NEXUS_RECALL, point=(8.0, 11.0)) is ActionResult.COOLDOWN
    field.play(1)
    assert field.why_not(second, NEXUS_RECALL, point=(8.0, 11.0)) is ActionResult.SUCCESS


def test_without_its_caster_a_recall_takes_nobody_along(field: Any) -> None:
    ship, zealot = put(field, "Mothership", 1, 26.0, 26.0), put(field, "Zealot", 1, 10.0, 10.0)
    field.order(ship, RECALL, point=(10.0, 10.0))
    field.play(20)
    field.world.life[ship] = 0.0
    field.play(3)
    assert not has(field, zealot, "MothershipStrategicWarpOut")
    assert field.world.can_attack[zealot]
    field.play(80)
    assert field.world.pos[zealot].tolist() == [10.0, 10.0]


def test_there_must_be_somebody_to_recall(field: Any) -> None:
    ship = put(field, "Mothership", 1, 26.0, 26.0)
    assert field.why_not(ship, RECALL, point=(10.0, 10.0)) is ActionResult.CANT_TARGET_THAT_UNIT


# Time Warp ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("version", "radius", "grows", "factor", "air"), [("4.10", 4.0, 80, 0.5, False),
                                                                          ("5.0.13", 3.75, 16, 0.6, True)])  # fmt: skip
def test_a_time_warp_grows_and_then_slows_enemies_for_160_loops(
    make_field: Any, version: str, radius: float, grows: int, factor: float, *, air: bool
) -> None:
    field = make_field(version=version)
    ship = put(field, "Mothership", 1, 8.0, 8.0)
    roach = put(field, "Roach", 2, 16.0, 8.0 + radius + 0.45)
    beyond = put(field, "Roach", 2, 16.0, 8.0 - radius - 0.7)
    flyer, friend = put(field, "Mutalisk", 2, 16.0, 8.0), put(field, "Zealot", 1, 17.5, 8.0)
    usual = {s: float(field.world.step_max[s]) for s in (roach, beyond, flyer, friend)}
    assert field.order(ship, TIME_WARP, point=(16.0, 8.0))
    field.play(1)
    (warp,) = field.world.area_effects
    assert (warp.effect, warp.radius) == (3, radius)
    field.play(grows - 1)
    assert field.world.step_max[roach] == usual[roach]
    field.play(1)
    assert warp.effect == 4
    slowed = {s: field.world.step_max[s] / usual[s] for s in usual}
    assert slowed == pytest.approx({roach: factor, beyond: 1.0, flyer: factor if air else 1.0, friend: 1.0})
    assert field.world.attack_rate[roach] == pytest.approx(factor)
    field.play(158)
    assert field.world.step_max[roach] < usual[roach]
    field.play(5)
    assert field.world.step_max[roach] == usual[roach]
    assert not field.world.area_effects


# the cloaking field ---------------------------------------------------------------------------------------------------


def test_in_4_10_a_mothership_cloaks_its_friends_within_5_all_the_time(make_field: Any) -> None:
    field = make_field(version="4.10")
    ship = put(field, "Mothership", 1, 16.0, 16.0)
    reach = 5.0 + 1.375 + 0.5
    near, far = put(field, "Zealot", 1, 16.0 + reach - 0.1, 16.0), put(field, "Zealot", 1, 16.0, 16.0 + reach + 0.1)
    tower, enemy = put(field, "Pylon", 1, 14.0, 14.0), put(field, "Zergling", 2, 17.0, 17.0)
    field.play(10)
    assert [bool(field.world.cloaked[s]) for s in (near, far, tower, enemy, ship)] == [True, False, True, False, False]
    field.play(300)
    assert field.world.cloaked[near]
    field.world.life[ship] = 0.0
    field.play(12)
    assert not field.world.cloaked[near]


def test_in_5_0_13_the_cloaking_field_is_an_ability_of_448_loops(make_field: Any) -> None:
    field = make_field(version="5.0.13")
    ship, zealot = put(field, "Mothership", 1, 16.0, 16.0), put(field, "Zealot", 1, 18.0, 16.0)
    field.play(10)
    assert not field.world.cloaked[zealot]
    assert field.order(ship, CLOAK)
    field.play(447)
    assert field.world.cloaked[zealot]
    field.play(5)
    assert not field.world.cloaked[zealot]
    assert field.why_not(ship, CLOAK) is ActionResult.COOLDOWN
    field.play(1120 - 452)
    assert field.why_not(ship, CLOAK) is ActionResult.SUCCESS


# Chrono Boost and batteries -------------------------------------------------------------------------------------------


def test_a_nexus_that_boosts_itself_trains_all_the_same(field: Any) -> None:
    nexus = put(field, "Nexus", 1, 16.5, 16.5)
    field.world.players[1].minerals = 100.0
    assert field.order(nexus, CHRONO, target=nexus)
    assert field.order(nexus, TRAIN_PROBE)
    field.play(1)
    assert [job.ability for job in field.world.jobs[nexus]] == [TRAIN_PROBE]
    assert has(field, nexus, "ChronoBoostEnergyCost")


@pytest.mark.parametrize("version", VERSIONS)
def test_a_chrono_boost_lets_a_structure_work_half_again_as_fast_for_448_loops(make_field: Any, version: str) -> None:
    field = make_field(version=version)
    nexus, gateway = put(field, "Nexus", 1, 8.5, 8.5), put(field, "Gateway", 1, 20.5, 8.5)
    assert field.order(nexus, CHRONO, gateway)
    field.play(1)
    assert field.world.energy[nexus] == pytest.approx(150.0, abs=0.1)
    assert field.world.work_rate[gateway] == 1.5
    field.play(447)
    assert field.world.work_rate[gateway] == 1.5
    field.play(1)
    assert field.world.work_rate[gateway] == 1.0


@pytest.mark.parametrize(("name", "owner", "why"), [
    ("Nexus", 1, ActionResult.SUCCESS),
    ("Forge", 1, ActionResult.SUCCESS),
    ("Pylon", 1, ActionResult.CANT_TARGET_THAT_UNIT),
    ("Gateway", 2, ActionResult.CANT_TARGET_ENEMY_UNITS),
    ("Zealot", 1, ActionResult.MUST_TARGET_STRUCTURES),
])  # fmt: skip
def test_what_can_be_boosted(field: Any, name: str, owner: int, why: ActionResult) -> None:
    nexus = put(field, "Nexus", 1, 8.5, 8.5)
    assert field.why_not(nexus, CHRONO, put(field, name, owner, 20.5, 8.5)) is why


@pytest.mark.parametrize("version", VERSIONS)
def test_a_battery_fills_shields_by_itself_at_36_a_second_for_a_third_of_its_energy(
    make_field: Any, version: str
) -> None:
    field = make_field(version=version)
    put(field, "Pylon", 1, 8.0, 14.0)
    battery, stalker = put(field, "ShieldBattery", 1, 8.0, 8.0, 90.0), put(field, "Stalker", 1, 12.0, 8.0)
    field.world.shields[stalker] = 10.0
    field.world.damaged_loop[stalker] = 1000
    for _ in field.loops(20):
        if field.world.shields[stalker] > 10.0:
            break
    energy, shields = float(field.world.energy[battery]), float(field.world.shields[stalker])
    assert 10.0 < shields < 14.0
    field.play(10)
    given = field.world.shields[stalker] - shields
    assert given == pytest.approx(10 * 36 / 16)
    assert energy - field.world.energy[battery] == pytest.approx(given * 0.33 - 10 * 0.5625 / 16)
    field.play(60)
    assert field.world.shields[stalker] == 80.0
    assert not field.world.orders_of(battery)


@pytest.mark.parametrize("version", VERSIONS)
def test_what_a_battery_refuses(make_field: Any, version: str) -> None:
    field = make_field(version=version)
    put(field, "Pylon", 1, 8.0, 14.0)
    battery, stalker = put(field, "ShieldBattery", 1, 8.0, 8.0, 90.0), put(field, "Stalker", 1, 12.0, 8.0)
    number = RECHARGE[version]
    assert field.why_not(battery, number, stalker) is ActionResult.CANT_TARGET_THAT_UNIT
    field.world.shields[stalker] = 10.0
    assert field.why_not(battery, number, stalker) is ActionResult.SUCCESS
    far = put(field, "Stalker", 1, 20.0, 8.0)
    field.world.shields[far] = 1.0
    assert field.why_not(battery, number, far) is ActionResult.TARGET_IS_OUT_OF_RANGE
    enemy = put(field, "Stalker", 2, 10.0, 10.0)
    field.world.shields[enemy] = 1.0
    assert field.why_not(battery, number, enemy) is ActionResult.CANT_TARGET_ENEMY_UNITS
    field.world.energy[battery] = 9.0 if version == "5.0.13" else 0.0
    assert field.why_not(battery, number, stalker) is ActionResult.NOT_ENOUGH_ENERGY


@pytest.mark.parametrize("version", VERSIONS)
def test_a_battery_is_sent_to_a_unit_with_the_right_click(make_field: Any, version: str) -> None:
    field = make_field(version=version)
    put(field, "Pylon", 1, 8.0, 14.0)
    battery = put(field, "ShieldBattery", 1, 8.0, 8.0, 90.0)
    hurt, whole = put(field, "Stalker", 1, 12.0, 8.0), put(field, "Stalker", 1, 8.0, 12.0)
    field.world.shields[hurt] = 10.0
    assert casting.smart(field.world, [battery], target=field.world.tag_of(hurt)) == [battery]
    assert field.world.orders_of(battery)[0].ability == RECHARGE[version]
    commands.stop(field.world, [battery])
    casting.smart(field.world, [battery], target=field.world.tag_of(whole))
    assert not field.world.orders_of(battery)


def test_an_overcharged_battery_works_half_again_as_fast_and_for_nothing(make_field: Any) -> None:
    field = make_field(version="5.0.13")
    put(field, "Pylon", 1, 6.0, 2.0)
    nexus, battery = put(field, "Nexus", 1, 8.5, 12.5), put(field, "ShieldBattery", 1, 8.0, 6.0, 0.0)
    archon = put(field, "Archon", 1, 12.0, 6.0)
    field.world.shields[archon] = 10.0
    field.world.damaged_loop[archon] = 1000
    assert field.order(nexus, OVERCHARGE, battery)
    field.play(20)
    before = float(field.world.shields[archon])
    field.play(10)
    assert field.world.shields[archon] - before == pytest.approx(10 * 1.5 * 36 / 16)
    assert field.world.energy[battery] > 0.0
    field.play(320)
    assert not has(field, battery, "BatteryOvercharge")


@pytest.mark.parametrize(("name", "x", "why"), [
    ("ShieldBattery", 26.0, ActionResult.TARGET_IS_OUT_OF_RANGE),
    ("PhotonCannon", 14.0, ActionResult.CANT_TARGET_THAT_UNIT),
    ("ShieldBattery", 14.0, ActionResult.SUCCESS),
])  # fmt: skip
def test_only_a_battery_within_10_of_a_nexus_can_be_overcharged(
    make_field: Any, name: str, x: float, why: ActionResult
) -> None:
    field = make_field(version="5.0.13")
    nexus = put(field, "Nexus", 1, 8.5, 8.5)
    assert field.why_not(nexus, OVERCHARGE, put(field, name, 1, x, 8.0)) is why
