"""Guardian Shield, Force Field and Hallucination, against the numbers of both game versions."""

from __future__ import annotations

import math
from typing import Any

import pytest

from khala_simulator.abilities import commands
from khala_simulator.combat import buffs, lifecycle
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.world.columns import NOBODY

VERSIONS = ("4.10", "5.0.13")
GUARDIAN_SHIELD, FORCE_FIELD, ARCHON_IMAGE = 76, 1526, 146
IMAGES = {
    146: ("Archon", 1), 148: ("Colossus", 1), 150: ("HighTemplar", 2), 152: ("Immortal", 1), 154: ("Phoenix", 1),
    156: ("Probe", 4), 158: ("Stalker", 2), 160: ("VoidRay", 1), 162: ("WarpPrism", 1), 164: ("Zealot", 2),
    2114: ("Oracle", 1), 2389: ("Disruptor", 1), 2391: ("Adept", 2),
}  # fmt: skip


def sentry(field: Any, x: float = 10.0, y: float = 10.0, energy: float = 200.0) -> int:
    slot: int = field.put("Sentry", 1, x, y)
    field.world.energy[slot] = energy
    return slot


# Guardian Shield ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("version", "loops"), [("4.10", 240), ("5.0.13", 288)])
def test_a_guardian_shield_lasts_as_long_as_the_version_says_and_then_its_buff_runs_out(
    make_field: Any, version: str, loops: int
) -> None:
    field = make_field(version=version)
    slot = sentry(field)
    assert field.order(slot, GUARDIAN_SHIELD)
    last_seen = last_covered = 0
    for loop in field.loops(loops + 30):
        if field.world.area_effects:
            last_seen = loop
        if buffs.has(field.world, slot, "GuardianShield"):
            last_covered = loop
    assert last_seen == loops - 1
    assert last_covered == loops + math.ceil(0.6 * 16) - 1


@pytest.mark.parametrize("version", VERSIONS)
def test_a_guardian_shield_covers_friends_in_reach_and_nobody_else(make_field: Any, version: str) -> None:
    field = make_field(version=version)
    slot = sentry(field)
    reach = 4.5 + 0.5 + 0.625  # its radius, the Sentry's and the Stalker's
    near, far = field.put("Stalker", 1, 10.0 + reach - 0.1, 10.0), field.put("Stalker", 1, 10.0, 10.0 + reach + 0.1)
    flyer, enemy = field.put("Phoenix", 1, 8.0, 10.0), field.put("Observer", 2, 12.0, 12.0)
    tower = field.put("Pylon", 1, 8.0, 8.0)
    commands.hold(field.world, [near, far])
    field.order(slot, GUARDIAN_SHIELD)
    field.play(9)
    covered = [s for s in (slot, near, far, flyer, enemy, tower) if buffs.has(field.world, s, "GuardianShield")]
    assert covered == [slot, near, flyer]


def test_clients_are_told_of_the_shield_as_effect_2_with_its_radius_where_the_sentry_is(field: Any) -> None:
    slot = sentry(field)
    field.order(slot, GUARDIAN_SHIELD)
    commands.move(field.world, [slot], (14.0, 10.0))
    field.play(20)
    (shield,) = field.world.area_effects
    assert (shield.effect, shield.radius, shield.owner) == (2, 4.5, 1)
    assert shield.at == pytest.approx(tuple(field.world.pos[slot]), abs=2.25 / 16 + 1e-6)
    assert field.world.catalog.buff("GuardianShield").id == 18


@pytest.mark.parametrize(("attacker", "less"), [("Marine", 2.0), ("Zergling", 0.0)])
def test_the_shield_takes_2_from_ranged_hits_only(make_field: Any, attacker: str, less: float) -> None:
    taken = []
    for shielded in (False, True):
        field = make_field()
        victim = field.put("Zealot", 1, 10.0, 10.0)
        field.world.shields[victim] = 0.0
        if shielded:
            buffs.apply(field.world, victim, "GuardianShield", loops=0)
        commands.hold(field.world, [victim])
        enemy = field.put(attacker, 2, 11.2, 10.0)
        commands.attack_unit(field.world, [enemy], field.world.tag_of(victim))
        for _ in field.loops(60):
            if field.world.life[victim] < 100.0:
                break
        taken.append(100.0 - field.world.life[victim])
    assert taken[0] - taken[1] == pytest.approx(less)


@pytest.mark.parametrize(("version", "cooldown"), [("4.10", 243.2), ("5.0.13", 288)])
def test_a_guardian_shield_costs_75_energy_and_cools_down(make_field: Any, version: str, cooldown: float) -> None:
    field = make_field(version=version)
    slot = sentry(field)
    field.order(slot, GUARDIAN_SHIELD)
    assert field.world.energy[slot] == 125.0
    assert field.why_not(slot, GUARDIAN_SHIELD) is ActionResult.COOLDOWN
    field.play(math.ceil(cooldown) - 1)
    assert field.why_not(slot, GUARDIAN_SHIELD) is ActionResult.COOLDOWN
    field.play(1)
    assert field.why_not(slot, GUARDIAN_SHIELD) is ActionResult.SUCCESS
    field.world.energy[slot] = 74.9
    assert field.why_not(slot, GUARDIAN_SHIELD) is ActionResult.NOT_ENOUGH_ENERGY


@pytest.mark.parametrize("how", ["dead", "scrambled"])
def test_a_guardian_shield_ends_with_its_sentry(field: Any, how: str) -> None:
    slot = sentry(field)
    friend = field.put("Zealot", 1, 11.0, 11.0)
    field.order(slot, GUARDIAN_SHIELD)
    field.play(10)
    if how == "dead":
        field.world.life[slot] = 0.0
    else:
        buffs.apply(field.world, slot, "RavenScramblerMissile")
    field.play(12)
    assert not field.world.area_effects
    assert not buffs.has(field.world, friend, "GuardianShield")


# Force Field ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("version", VERSIONS)
def test_a_force_field_comes_at_its_point_for_15_to_15_3_seconds(make_field: Any, version: str) -> None:
    field = make_field(version=version)
    slot = sentry(field)
    assert field.order(slot, FORCE_FIELD, point=(16.3, 10.6))
    field.play(1)
    (wall,) = _fields(field)
    assert field.world.pos[wall].tolist() == [16.3, 10.6]
    assert field.world.owner[wall] == 0
    assert field.world.energy[slot] == pytest.approx(150.0, abs=0.1)
    field.play(239)
    assert _fields(field)
    field.play(6)
    assert not _fields(field)
    assert field.world.ground.walk.sum() == field.world.map.terrain.walk.sum()


def _fields(field: Any) -> list[int]:
    row = field.world.catalog.unit("ForceField").row
    return [s for s in field.world.live.tolist() if field.world.type[s] == row]


def test_a_sentry_walks_until_9_from_edge_to_point_for_a_force_field(field: Any) -> None:
    slot = sentry(field)
    field.order(slot, FORCE_FIELD, point=(25.0, 10.0))
    for _ in field.loops(150):
        if _fields(field):
            break
    away = 25.0 - field.world.pos[slot, 0]
    assert 9.0 + 0.5 - 2.25 / 16 - 0.05 <= away <= 9.0 + 0.5 + 1e-6


def test_nobody_on_the_ground_walks_through_a_force_field_but_round_it(field: Any) -> None:
    slot = sentry(field)
    walker = field.put("Zealot", 2, 20.0, 10.0)
    flyer = field.put("Observer", 2, 20.0, 10.5)
    field.order(slot, FORCE_FIELD, point=(16.5, 10.5))
    field.play(2)
    lifecycle.remove(field.world, slot)
    commands.move(field.world, [walker, flyer], (13.0, 10.5))
    nearest = math.inf
    passed_over = math.inf
    for _ in field.loops(80):
        nearest = min(nearest, math.dist(field.world.pos[walker], (16.5, 10.5)))
        passed_over = min(passed_over, math.dist(field.world.pos[flyer], (16.5, 10.5)))
    assert nearest > 1.5
    assert passed_over < 0.3
    assert math.dist(field.world.pos[walker], (13.0, 10.5)) < 0.5


def test_who_stands_where_a_force_field_appears_is_put_beside_it(field: Any) -> None:
    slot = sentry(field)
    ling = field.put("Zergling", 2, 16.4, 10.2)
    commands.hold(field.world, [ling])
    field.order(slot, FORCE_FIELD, point=(16.5, 10.5))
    field.play(2)
    assert math.dist(field.world.pos[ling], (16.5, 10.5)) > 1.5


@pytest.mark.parametrize(("name", "breaks"), [("Archon", True), ("Colossus", True), ("Ultralisk", True),
                                              ("Immortal", False), ("Carrier", False)])  # fmt: skip
def test_a_massive_unit_on_the_ground_breaks_a_force_field_that_it_comes_near(
    field: Any, name: str, breaks: bool
) -> None:
    slot = sentry(field)
    field.order(slot, FORCE_FIELD, point=(16.5, 10.5))
    field.play(2)
    walker = field.put(name, 1, 22.5, 10.5)
    commands.move(field.world, [walker], (13.0, 10.5))
    field.play(40)
    assert (not _fields(field)) is breaks


# Hallucination --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("number", IMAGES)
def test_every_hallucination_brings_its_units_for_60_seconds(make_field: Any, version: str, number: int) -> None:
    field = make_field(version=version)
    slot = sentry(field)
    name, count = IMAGES[number]
    assert field.order(slot, number)
    field.play(1)
    images = [s for s in field.world.live.tolist() if s != slot]
    assert [field.world.unit_type(s).name for s in images] == [name] * count
    assert all(field.world.hallucination[s] and field.world.owner[s] == 1 for s in images)
    assert all(field.world.expires[s] == 1 + 960 for s in images)
    assert field.world.energy[slot] == pytest.approx(125.0, abs=0.1)


def test_an_image_dies_when_its_time_is_over_and_nobody_s_score_knows(field: Any) -> None:
    slot = sentry(field)
    field.order(slot, ARCHON_IMAGE)
    field.play(960)
    assert len(field.world.live) == 2
    field.play(1)
    assert field.world.live.tolist() == [slot]
    assert field.world.players[1].score.lost_units == 0


def test_nobody_scores_by_killing_an_image(field: Any) -> None:
    slot = sentry(field, 4.0, 4.0)
    field.order(slot, 164)  # two Zealots
    field.play(1)
    image = next(s for s in field.world.live.tolist() if s != slot)
    field.world.life[image] = field.world.shields[image] = 1.0
    marine = field.put("Marine", 2, 5.0, 9.0)
    commands.attack_unit(field.world, [marine], field.world.tag_of(image))
    for _ in field.loops(60):
        if not field.world.alive[image]:
            break
    assert not field.world.alive[image]
    won, lost = field.world.players[2].score, field.world.players[1].score
    assert (won.killed_units, won.killed_value_units, lost.lost_units) == (0, 0.0, 0)


@pytest.mark.parametrize("version", VERSIONS)
def test_an_image_takes_double_without_armor_and_deals_none(make_field: Any, version: str) -> None:
    field = make_field(version=version)
    slot = sentry(field, 10.0, 10.0)
    field.order(slot, 164)  # two Zealots
    field.play(1)
    image, other = (s for s in field.world.live.tolist() if s != slot)
    for gone in (slot, other):
        lifecycle.remove(field.world, gone)
    marine = field.put("Marine", 2, 11.0, 11.0)
    commands.attack_unit(field.world, [image], field.world.tag_of(marine))
    before = field.vitals(image)
    for _ in field.loops(100):
        if field.vitals(image) < before:
            break
    assert before - field.vitals(image) == pytest.approx(2 * 6.0)
    field.play(40)
    assert field.world.life[marine] == 45.0


def test_an_image_has_no_abilities_but_walks_and_stops(field: Any) -> None:
    slot = sentry(field)
    field.order(slot, 150)  # two High Templar
    field.play(1)
    image = next(s for s in field.world.live.tolist() if s != slot)
    field.world.energy[image] = 200.0
    enemy = field.put("Sentry", 2, 13.0, 10.0)
    assert field.why_not(image, 140, enemy) is ActionResult.YOU_CANT_ISSUE_COMMANDS_TO_THAT_UNIT
    assert commands.move(field.world, [image], (15.0, 15.0)) == [image]


def test_a_sentry_needs_75_energy_for_an_image(field: Any) -> None:
    assert field.why_not(sentry(field, energy=74.0), ARCHON_IMAGE) is ActionResult.NOT_ENOUGH_ENERGY
    assert field.why_not(sentry(field, energy=75.0), ARCHON_IMAGE) is ActionResult.SUCCESS


def test_nobody_holds_on_to_an_image_that_is_gone(field: Any) -> None:
    slot = sentry(field)
    field.order(slot, ARCHON_IMAGE)
    field.play(1)
    image = next(s for s in field.world.live.tolist() if s != slot)
    marine = field.put("Marine", 2, 13.0, 10.0)
    commands.attack_unit(field.world, [marine], field.world.tag_of(image))
    field.world.expires[image] = field.world.loop + 3
    field.play(4)
    assert field.world.order_target[marine] == NOBODY
