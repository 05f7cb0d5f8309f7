"""Snipe, EMP, cloaks, held fire and nukes, worked out from the tables of both versions."""

from __future__ import annotations

import math
from typing import Any

import pytest

from khala_simulator.abilities import commands
from khala_simulator.combat import buffs, lifecycle
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.tables.mechanics import MECHANICS

VERSIONS = ("4.10", "5.0.13")
SNIPE, EMP, CLOAK, UNCLOAK, HOLD_FIRE, FREE, NUKE, CANCEL_NUKE = 2714, 1628, 382, 383, 36, 38, 1622, 1623
ARM = 710
BANSHEE_CLOAK = 392


@pytest.fixture(params=VERSIONS)
def field(request: pytest.FixtureRequest, make_field: Any) -> Any:
    return make_field(version=request.param)


# snipe ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["Marine", "Ultralisk", "HighTemplar", "Ghost"])
def test_a_snipe_hits_after_its_channel_and_ignores_armor(field: Any, name: str) -> None:
    world, ability = field.world, field.world.catalog.ability(SNIPE)
    ghost, victim = field.still("Ghost", 1, 6, 10, energy=100), field.still(name, 2, 12, 10)
    psionic = "psionic" in world.unit_type(victim).attributes
    damage = ability.numbers["damage"] + (ability.numbers.get("bonus_psionic", 0) if psionic else 0)
    before = field.vitals(victim)
    assert field.order(ghost, SNIPE, victim)
    field.play(1)
    assert world.energy[ghost] == pytest.approx(100 - ability.energy, abs=0.1)
    field.play(int(ability.numbers["channel_loops"]) - 1)
    assert field.vitals(victim) == pytest.approx(before, abs=0.5)
    field.play(1)
    left = before - damage
    assert field.vitals(victim) == (pytest.approx(left, abs=1.5) if left > 0 else 0)
    assert not buffs.has(world, ghost, "ChannelSnipeCombat")
    assert world.energy[ghost] == pytest.approx(100 - ability.energy + 33 * 0.5625 / 16, abs=0.1)


def test_a_ghost_that_is_hurt_loses_the_shot_and_gets_its_energy_back(field: Any) -> None:
    world = field.world
    ghost, victim = field.still("Ghost", 1, 6, 10, energy=60), field.still("Ultralisk", 2, 14, 10)
    marine = field.still("Marine", 2, 6, 14)
    field.order(ghost, SNIPE, victim)
    field.play(10)
    assert buffs.has(world, ghost, "ChannelSnipeCombat")
    commands.attack_unit(world, [marine], world.tag_of(ghost))
    field.play(40)
    assert world.life[victim] == 500
    assert world.energy[ghost] == pytest.approx(60 + 50 * 0.5625 / 16, abs=0.5)


def test_a_new_order_drops_the_shot_and_gives_the_energy_back(field: Any) -> None:
    world = field.world
    ghost, victim = field.still("Ghost", 1, 6, 10, energy=60), field.still("Ultralisk", 2, 14, 10)
    field.order(ghost, SNIPE, victim)
    field.play(10)
    commands.move(world, [ghost], (6, 12))
    field.play(30)
    assert world.life[victim] == 500
    assert world.energy[ghost] > 60


@pytest.mark.parametrize(
    ("name", "owner", "why"),
    [
        ("SiegeTank", 2, ActionResult.MUST_TARGET_BIOLOGICAL_UNITS),
        ("Hatchery", 2, ActionResult.CANT_TARGET_STRUCTURES),
        ("Marine", 1, ActionResult.CANT_TARGET_YOUR_OWN_UNITS),
        ("Marine", 2, ActionResult.SUCCESS),
    ],
)
def test_whom_a_snipe_may_be_aimed_at(field: Any, name: str, owner: int, why: ActionResult) -> None:
    ghost, victim = field.still("Ghost", 1, 6, 10, energy=60), field.still(name, owner, 12.5, 10.5)
    assert field.why_not(ghost, SNIPE, victim) is why


def test_a_snipe_needs_energy(field: Any) -> None:
    ghost, victim = field.still("Ghost", 1, 6, 10, energy=49), field.still("Marine", 2, 12, 10)
    assert field.why_not(ghost, SNIPE, victim) is ActionResult.NOT_ENOUGH_ENERGY


def test_a_snipe_is_lost_on_a_target_beyond_the_leash_where_there_is_one(field: Any) -> None:
    world, leash = field.world, field.world.catalog.ability(SNIPE).numbers.get("leash_range")
    ghost, victim = field.still("Ghost", 1, 2, 10, energy=60), field.still("Ultralisk", 2, 11, 10)
    field.order(ghost, SNIPE, victim)
    field.play(5)
    world.pos[victim] = (17.5, 10)
    field.play(40)
    assert bool(world.life[victim] == 500) is (leash is not None)
    assert leash in (None, 14)


# EMP ------------------------------------------------------------------------------------------------------------------


def test_an_emp_takes_shields_and_energy_up_to_a_hundred_from_friend_and_foe_around(field: Any) -> None:
    world, ability = field.world, field.world.catalog.ability(EMP)
    ghost = field.still("Ghost", 1, 4, 10, energy=100)
    archon, templar = field.still("Archon", 2, 12, 10), field.still("HighTemplar", 2, 12, 11.2, energy=160)
    friend, far = field.still("Ghost", 1, 11, 10, energy=80), field.still("Zealot", 2, 12, 14)
    assert field.order(ghost, EMP, point=(12, 10))
    field.play(2)
    assert world.energy[ghost] == pytest.approx(100 - ability.energy, abs=0.1)
    field.play(math.ceil(9 / (MECHANICS.emp_speed_n / 16)) + 2)
    numbers = ability.numbers
    assert world.shields[archon] == pytest.approx(350 - numbers["shields_removed"])
    assert world.shields[templar] == 0
    assert world.energy[templar] == pytest.approx(160 - numbers["energy_removed"], abs=1.5)
    assert world.energy[friend] == pytest.approx(0, abs=1)
    assert world.shields[far] == 50
    assert world.life[archon] == 10
    assert numbers["energy_removed"] == numbers["shields_removed"] == 100


def test_an_emp_uncovers_who_is_cloaked_for_its_time(field: Any) -> None:
    world, numbers = field.world, field.world.catalog.ability(EMP).numbers
    ghost, templar = field.still("Ghost", 1, 8, 10, energy=100), field.still("DarkTemplar", 2, 12, 10)
    field.play(4)
    assert not world.visible[1, templar]
    field.order(ghost, EMP, point=(12, 10))
    for _ in field.loops(30):
        if buffs.has(world, templar, "EMPDecloak"):
            break
    field.play(4)
    assert world.visible[1, templar]
    field.play(int(numbers["decloak_loops"]))
    assert not world.visible[1, templar]


@pytest.mark.parametrize(("away", "hurt"), [(1.5 + 0.5 - 0.01, True), (1.5 + 0.5 + 0.01, False)])
def test_an_emp_reaches_its_radius_to_the_edge(field: Any, away: float, *, hurt: bool) -> None:
    ghost, zealot = field.still("Ghost", 1, 8, 10, energy=100), field.still("Zealot", 2, 12, 10 + away)
    field.order(ghost, EMP, point=(12, 10))
    field.play(20)
    assert bool(field.world.shields[zealot] < 50) is hurt


# cloaks ---------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "number", "research", "buff"),
    [("Ghost", CLOAK, "PersonalCloaking", "GhostCloak"), ("Banshee", BANSHEE_CLOAK, "BansheeCloak", "BansheeCloak")],
)
def test_a_cloak_hides_its_bearer_until_the_energy_is_used_up(
    field: Any, name: str, number: int, research: str, buff: str
) -> None:
    world, ability = field.world, field.world.catalog.ability(number)
    slot: int = field.still(name, 1, 10, 10, energy=40)
    assert field.why_not(slot, number) is ActionResult.TECH_REQUIREMENTS_NOT_MET
    field.research(1, research)
    assert field.order(slot, number)
    assert world.energy[slot] == 40 - ability.energy == 15
    field.play(4)
    assert not world.visible[2, slot]
    assert world.visible[1, slot]
    drain = (-world.catalog.buff(buff).energy_regen_n - world.unit_type(slot).energy_regen_n) / 16
    lasts = math.ceil(15 / drain)
    field.play(lasts - 5)
    assert buffs.has(world, slot, buff)
    field.play(6)
    assert not buffs.has(world, slot, buff)
    field.play(4)
    assert world.visible[2, slot]


def test_a_cloak_is_put_on_once_and_taken_off_at_once(field: Any) -> None:
    field.research(1, "PersonalCloaking")
    slot: int = field.still("Ghost", 1, 10, 10, energy=100)
    assert field.why_not(slot, UNCLOAK) is ActionResult.TECH_REQUIREMENTS_NOT_MET
    field.order(slot, CLOAK)
    assert field.why_not(slot, CLOAK) is ActionResult.TECH_REQUIREMENTS_NOT_MET
    assert field.order(slot, UNCLOAK)
    assert not field.world.cloaked[slot]


def test_a_detector_sees_a_cloaked_ghost(field: Any) -> None:
    field.research(1, "PersonalCloaking")
    slot: int = field.still("Ghost", 1, 10, 10, energy=100)
    field.order(slot, CLOAK)
    field.put("Observer", 2, 16, 10)
    field.play(5)
    assert field.world.visible[2, slot]


# holding fire ---------------------------------------------------------------------------------------------------------


def test_a_ghost_that_holds_its_fire_fights_only_when_told(field: Any) -> None:
    world = field.world
    ghost, victim = field.put("Ghost", 1, 10, 10), field.still("Hatchery", 2, 16, 10)
    assert field.why_not(ghost, FREE) is ActionResult.TECH_REQUIREMENTS_NOT_MET
    field.order(ghost, HOLD_FIRE)
    field.play(60)
    assert world.life[victim] == 1500
    commands.attack_unit(world, [ghost], world.tag_of(victim))
    field.play(40)
    assert world.life[victim] < 1500


def test_weapons_free_ends_holding_fire(field: Any) -> None:
    ghost, victim = field.put("Ghost", 1, 10, 10), field.still("Roach", 2, 15, 10)
    field.order(ghost, HOLD_FIRE)
    field.play(20)
    field.order(ghost, FREE)
    field.play(40)
    assert field.world.life[victim] < 145


# nukes ----------------------------------------------------------------------------------------------------------------


def armed(field: Any) -> int:
    """Return a Ghost whose owner has a Nuke ready."""
    slot: int = field.still("Ghost", 1, 6, 16)
    academy = field.still("GhostAcademy", 1, 4.5, 28.5)
    nuke = field.put("Nuke", 1, 4.5, 28.5)
    lifecycle.stow(field.world, nuke, academy)
    return slot


def test_a_nuke_comes_down_after_its_time_in_rings_of_damage(field: Any) -> None:
    world, numbers = field.world, field.world.catalog.ability(NUKE).numbers
    ghost = armed(field)
    point = (18.0, 16.0)
    victims = {}
    for ring, away in zip(numbers["area"], (2.0, 5.5, 7.5), strict=True):
        slot = field.still("Ultralisk", 2, point[0], point[1] + away + world.catalog.unit("Ultralisk").radius)
        victims[slot] = ring["fraction"]
    friend = field.still("Thor", 1, 18, 14)
    assert field.order(ghost, NUKE, point=point)
    field.play(1)
    begun = world.loop
    assert [(f.effect, f.at) for f in world.area_effects] == [(7, point)]
    falls = int(numbers["delay_loops"] + numbers["post_detonate_damage_delay_loops"])
    field.play(falls - 1)
    assert all(world.life[slot] > 499 for slot in victims)
    field.play(1)
    assert world.loop == begun + falls
    for slot, fraction in victims.items():
        assert 500 - world.life[slot] == pytest.approx(numbers["damage"] * fraction, abs=1.5)
    assert world.life[friend] == pytest.approx(400 - numbers["damage"])


def test_the_enemy_is_warned_of_a_strike(field: Any) -> None:
    ghost = armed(field)
    field.order(ghost, NUKE, point=(17, 16))
    field.play(2)
    assert [(a.player, a.name) for a in field.world.alerts] == [(2, "NuclearLaunchDetected")]


def test_structures_take_more_of_a_nuke(field: Any) -> None:
    world, numbers = field.world, field.world.catalog.ability(NUKE).numbers
    ghost, hall = armed(field), field.still("CommandCenter", 2, 18.5, 16.5)
    field.order(ghost, NUKE, point=(18.5, 16.5))
    field.play(322)
    assert world.life[hall] == 1500 - numbers["damage"] - numbers["bonus_structure"]


def test_a_strike_uses_up_one_nuke_and_needs_one(field: Any) -> None:
    ghost = armed(field)
    assert field.why_not(ghost, NUKE, point=(17, 16)) is ActionResult.SUCCESS
    field.order(ghost, NUKE, point=(17, 16))
    field.play(2)
    assert field.why_not(ghost, NUKE, point=(17, 16)) is ActionResult.TECH_REQUIREMENTS_NOT_MET
    assert not any(field.world.unit_type(s).name == "Nuke" for s in range(field.world.top) if field.world.alive[s])


def test_an_academy_arms_a_nuke_that_a_ghost_then_calls(field: Any) -> None:
    world = field.world
    ghost, academy = field.still("Ghost", 1, 6, 16), field.put("GhostAcademy", 1, 4.5, 28.5)
    field.put("Factory", 1, 10.5, 28.5)
    world.players[1].minerals = world.players[1].vespene = 100.0
    assert field.why_not(ghost, NUKE, point=(17, 16)) is ActionResult.TECH_REQUIREMENTS_NOT_MET
    assert field.order(academy, ARM)
    field.play(int(world.catalog.ability(ARM).loops) + 2)
    assert field.order(ghost, NUKE, point=(17, 16))


@pytest.mark.parametrize("how", ["cancel", "order", "death"])
def test_a_strike_is_lost_when_the_ghost_stops_painting(field: Any, how: str) -> None:
    world = field.world
    ghost, victim = armed(field), field.still("Ultralisk", 2, 17, 16)
    field.order(ghost, NUKE, point=(17, 16))
    field.play(290)
    if how == "cancel":
        assert field.order(ghost, CANCEL_NUKE)
    elif how == "order":
        commands.stop(world, [ghost])
    else:
        world.life[ghost] = 0.0
    field.play(2)
    assert not world.area_effects
    field.play(30)
    assert world.life[victim] == 500


def test_a_strike_that_is_down_needs_no_painter_any_more(field: Any) -> None:
    ghost, victim = armed(field), field.still("Ultralisk", 2, 17, 16)
    field.order(ghost, NUKE, point=(17, 16))
    field.play(302)
    field.world.life[ghost] = 0.0
    field.play(22)
    assert field.world.life[victim] < 500


def test_there_is_nothing_to_cancel_without_a_strike(field: Any) -> None:
    assert field.why_not(armed(field), CANCEL_NUKE) is ActionResult.CANT_FIND_CANCEL_ORDER
