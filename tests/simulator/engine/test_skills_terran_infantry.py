"""Stimpacks, concussive shells, combat shields and the Reaper, worked out from the tables of both versions."""

from __future__ import annotations

import math
from typing import Any

import pytest

from khala_simulator.abilities import commands
from khala_simulator.combat import buffs
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.tables.catalog import load_catalog
from khala_simulator.tables.mechanics import MECHANICS

VERSIONS = ("4.10", "5.0.13")
STIM, STIM_MARAUDER, KD8 = 380, 253, 2588
STIMMED = [("Marine", STIM, "Stimpack"), ("Marauder", STIM_MARAUDER, "StimpackMarauder")]


@pytest.fixture(params=VERSIONS)
def field(request: pytest.FixtureRequest, make_field: Any) -> Any:
    return make_field(version=request.param)


# stimpack -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("name", "number", "buff"), STIMMED)
def test_a_stimpack_costs_life_and_speeds_up_walking_and_firing_for_its_time(
    field: Any, name: str, number: int, buff: str
) -> None:
    field.research(1, "Stimpack")
    world, ability, kind = field.world, field.world.catalog.ability(number), field.world.catalog.buff(buff)
    slot = field.put(name, 1, 10, 10)
    life, step = world.life[slot], world.step_max[slot]
    assert field.order(slot, number)
    assert life - world.life[slot] == ability.life == (10 if name == "Marine" else 20)
    assert world.step_max[slot] == pytest.approx(step * ability.numbers["move_speed_multiplier"])
    assert world.attack_rate[slot] == ability.numbers["attack_speed_multiplier"]
    field.play(int(kind.loops) - 1)
    assert buffs.has(world, slot, buff)
    field.play(1)
    assert not buffs.has(world, slot, buff)
    assert world.step_max[slot] == pytest.approx(step)


def test_a_stimpack_leaves_orders_alone(field: Any) -> None:
    field.research(1, "Stimpack")
    slot = field.put("Marine", 1, 4, 10)
    commands.move(field.world, [slot], (28, 10))
    field.order(slot, STIM)
    assert [o.ability for o in field.world.orders_of(slot)] == [16]


def test_a_second_stimpack_begins_the_time_anew_and_does_not_add_up(field: Any) -> None:
    field.research(1, "Stimpack")
    slot = field.put("Marine", 1, 10, 10)
    field.order(slot, STIM)
    field.play(100)
    field.order(slot, STIM)
    assert field.world.attack_rate[slot] == 1.5
    field.play(239)
    assert buffs.has(field.world, slot, "Stimpack")
    field.play(1)
    assert not buffs.has(field.world, slot, "Stimpack")


def test_stimpacks_need_their_research_and_more_life_than_they_cost(field: Any) -> None:
    slot = field.put("Marine", 1, 10, 10)
    assert field.why_not(slot, STIM) is ActionResult.TECH_REQUIREMENTS_NOT_MET
    field.research(1, "Stimpack")
    field.world.life[slot] = 10.0
    assert field.why_not(slot, STIM) is ActionResult.NOT_ENOUGH_LIFE
    assert not field.order(slot, STIM)
    field.world.life[slot] = 10.5
    assert field.why_not(slot, STIM) is ActionResult.SUCCESS


def test_a_stimmed_marine_fires_more_often_by_the_factor(field: Any) -> None:
    field.research(1, "Stimpack")
    taken = []
    for stimmed in (False, True):
        world = type(field)(version=field.world.catalog.version)
        world.research(1, "Stimpack")
        slot = world.put("Marine", 1, 10, 10)
        victim = world.still("Hatchery", 2, 16, 10)
        if stimmed:
            world.order(slot, STIM)
        life = world.world.life[victim]
        world.play(200)
        taken.append(life - world.world.life[victim])
    assert taken[1] / taken[0] == pytest.approx(1.5, rel=0.1)


# concussive shells ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "researched", "slowed"),
    [("Zealot", True, True), ("Zealot", False, False), ("Ultralisk", True, False), ("Bunker", True, False)],
)
def test_concussive_shells_slow_whom_they_hit_but_nothing_massive_and_no_structure(
    field: Any, name: str, *, researched: bool, slowed: bool
) -> None:
    world = field.world
    if researched:
        field.research(1, "PunisherGrenades")
    slot, victim = field.put("Marauder", 1, 10, 10), field.still(name, 2, 15, 10)
    step = world.step_max[victim]
    commands.attack_unit(world, [slot], world.tag_of(victim))
    before = field.vitals(victim)
    for _ in field.loops(60):
        if field.vitals(victim) < before:
            break
    assert field.vitals(victim) < before
    assert buffs.has(world, victim, "Slow") is slowed
    assert world.step_max[victim] == pytest.approx(step * (0.5 if slowed else 1.0))


def test_the_slowing_lasts_its_time_after_the_last_hit(field: Any) -> None:
    world = field.world
    field.research(1, "PunisherGrenades")
    slot, victim = field.put("Marauder", 1, 10, 10), field.still("Zealot", 2, 15, 10)
    commands.attack_unit(world, [slot], world.tag_of(victim))
    for _ in field.loops(60):
        if buffs.has(world, victim, "Slow"):
            break
    world.life[slot] = 0.0
    field.play(int(world.catalog.buff("Slow").loops) - 1)
    assert buffs.has(world, victim, "Slow")
    field.play(1)
    assert not buffs.has(world, victim, "Slow")


def test_combat_shields_give_life_to_those_who_are_there_and_those_who_come(field: Any) -> None:
    slot = field.put("Marine", 1, 10, 10)
    field.world.life[slot] = 30.0
    field.research(1, "ShieldWall")
    unit = field.world.catalog.unit("Marine")
    assert field.world.life[slot] == 40.0
    assert field.world.life_max[slot] == unit.life + 10
    assert field.world.life[field.put("Marine", 1, 12, 10)] == unit.life + 10


# Reaper ---------------------------------------------------------------------------------------------------------------


def test_a_reaper_heals_after_a_time_without_damage(field: Any) -> None:
    world, unit = field.world, field.world.catalog.unit("Reaper")
    slot = field.put("Reaper", 1, 10, 10)
    field.play(2)
    world.life[slot], world.damaged_loop[slot] = 20.0, world.loop
    delay = int(unit.life_regen_delay_n * 16)
    field.play(delay)
    assert world.life[slot] == 20.0
    field.play(17)
    assert world.life[slot] == pytest.approx(20.0 + 17 * unit.life_regen_n / 16)


def test_a_charge_goes_off_after_its_fuse_and_hurts_friend_and_foe_on_the_ground(field: Any) -> None:
    world, numbers = field.world, field.world.catalog.ability(KD8).numbers
    reaper = field.still("Reaper", 1, 10, 10)
    foe, friend = field.still("Zealot", 2, 14, 10.5), field.still("Marine", 1, 14, 9.0)
    flyer, far = field.still("Mutalisk", 2, 14, 10), field.still("Marine", 2, 14 + numbers["radius"] + 0.4, 10)
    lives = {slot: field.vitals(slot) for slot in (foe, friend, flyer, far)}
    assert field.order(reaper, KD8, point=(14, 10))
    field.play(1)
    assert world.loop == 1
    field.play(int(numbers["fuse_loops"]) - 1)
    assert {slot: field.vitals(slot) for slot in lives} == lives
    field.play(1)
    assert lives[foe] - field.vitals(foe) == numbers["damage"]
    assert lives[friend] - field.vitals(friend) == numbers["damage"]
    assert field.vitals(flyer) == lives[flyer]
    assert field.vitals(far) == lives[far]


def test_a_charge_throws_units_away_from_it_by_its_distance(field: Any) -> None:
    world, numbers = field.world, field.world.catalog.ability(KD8).numbers
    reaper, victim = field.still("Reaper", 1, 10, 10), field.still("Marine", 2, 15, 10)
    field.order(reaper, KD8, point=(14, 10))
    field.play(int(numbers["fuse_loops"]) + 1)
    assert world.can_attack[victim] == 0
    field.play(MECHANICS.knockback_loops)
    assert world.pos[victim].tolist() == pytest.approx([15 + numbers["knockback_distance"], 10])
    assert world.can_attack[victim]


@pytest.mark.parametrize("name", ["Ultralisk", "Bunker", "Larva"])
def test_a_charge_does_not_throw_what_is_massive_built_or_a_larva(field: Any, name: str) -> None:
    world = field.world
    world.growth.paint(0, 0, 32, 32)
    reaper, victim = field.still("Reaper", 1, 10, 10), field.still(name, 2, 15.5, 10.5)
    before = world.life[victim]
    field.order(reaper, KD8, point=(14, 10))
    for _ in field.loops(40):
        if world.life[victim] < before:
            break
    assert world.life[victim] < before
    assert not buffs.has(world, victim, "ReaperKD8Knockback")
    assert not [item for item in world.area_effects if item.rule == "knockback"]


def test_a_charge_is_a_body_that_nobody_can_touch_and_is_gone_with_its_explosion(field: Any) -> None:
    world = field.world
    reaper = field.still("Reaper", 1, 10, 10)
    field.order(reaper, KD8, point=(14, 10))
    field.play(1)
    charge = next(s for s in world.live.tolist() if world.unit_type(s).name == "KD8Charge")
    assert not world.targetable[charge]
    field.play(33)
    assert not any(world.unit_type(s).name == "KD8Charge" for s in world.live.tolist())


def test_a_reaper_walks_into_range_and_has_to_wait_for_the_next_charge(field: Any) -> None:
    world, ability = field.world, field.world.catalog.ability(KD8)
    reaper = field.still("Reaper", 1, 4, 10)
    assert field.order(reaper, KD8, point=(16, 10))
    for _ in field.loops(100):
        if world.area_effects:
            break
    radius = world.radius[reaper]
    assert math.dist(world.pos[reaper].tolist(), (16, 10)) == pytest.approx(ability.range + radius, abs=0.3)
    assert field.why_not(reaper, KD8, point=(16, 10)) is ActionResult.COOLDOWN
    field.play(int(ability.cooldown_loops) - 1)
    assert field.why_not(reaper, KD8, point=(16, 10)) is ActionResult.COOLDOWN
    field.play(1)
    assert field.why_not(reaper, KD8, point=(16, 10)) is ActionResult.SUCCESS


def test_a_charge_is_not_thrown_at_flyers(field: Any) -> None:
    reaper, flyer = field.still("Reaper", 1, 10, 10), field.still("Mutalisk", 2, 13, 10)
    assert field.why_not(reaper, KD8, flyer) is ActionResult.MUST_TARGET_GROUND_UNITS


def test_both_versions_have_the_same_stimpack() -> None:
    old, new = (load_catalog(v).ability(STIM) for v in VERSIONS)
    assert (old.life, old.numbers) == (new.life, new.numbers)
