"""What is special about single weapons: bounces, lines, cones, beams, turrets, bites, suicides."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from khala_simulator.abilities import commands
from khala_simulator.combat import lifecycle
from khala_simulator.combat.launchers import LAUNCHERS
from khala_simulator.combat.traits import set_weapon


def dummy(field: Any, name: str, x: float, y: float, owner: int = 2) -> int:
    """Return a unit that stands there and does nothing."""
    world = field.world
    slot: int = field.put(name, owner, x, y)
    world.acquires[slot] = False
    world.step_max[slot] = world.life_regen[slot] = world.shield_regen[slot] = 0.0
    return slot


def shot_at(field: Any, attacker: str, x: float, target: int, y: float = 16.0, facing: float = 0.0) -> int:
    """Return an attacker at (x, y) with an attack order."""
    world = field.world
    slot: int = field.put(attacker, 1, x, y, facing)
    world.acquires[slot] = False
    commands.attack_unit(world, [slot], world.tag_of(target))
    return slot


def one_shot(field: Any, attacker: int, loops: int = 60) -> None:
    """Play until the first attack has started, then until it takes effect without a second one."""
    world = field.world
    while world.cooldown[attacker] <= 0.0:
        field.play(1)
        assert world.loop < 200, "it never fired"
    world.cooldown[attacker] = 1e6
    field.play(loops)


def lost(field: Any, slots: list[int], full: float) -> list[float]:
    return [round(full - float(field.world.life[s]), 6) for s in slots]


def test_a_glaive_bounces_twice_to_the_nearest_it_has_not_hit(field: Any) -> None:
    first, second, third, fourth = (dummy(field, "Zergling", 10 + 2 * i, 16) for i in range(4))
    mutalisk = shot_at(field, "Mutalisk", 8, first)
    one_shot(field, mutalisk)
    assert lost(field, [first, second, third, fourth], 35) == [9, 3, 1, 0]


def test_a_glaive_does_not_go_back_when_nobody_else_is_near(field: Any) -> None:
    first, second = dummy(field, "Zergling", 10, 16), dummy(field, "Zergling", 12, 16)
    friend = dummy(field, "Zergling", 11, 17, owner=1)
    mutalisk = shot_at(field, "Mutalisk", 8, first)
    one_shot(field, mutalisk)
    assert lost(field, [first, second, friend], 35) == [9, 3, 0]


def test_a_hellion_burns_the_line_behind_its_target(field: Any) -> None:
    target, behind, far = (dummy(field, "Zergling", x, 16) for x in (12, 14.5, 20))
    beside = dummy(field, "Zergling", 12, 17)
    hellion = shot_at(field, "Hellion", 9, target)
    one_shot(field, hellion)
    # 8 + 6 against light; the flame reaches 6.5 from the Hellion's centre
    assert lost(field, [target, behind, beside, far], 35) == [14, 14, 0, 0]


def test_a_hellbat_burns_a_cone_in_front_of_it(field: Any) -> None:
    target, inside = dummy(field, "Zergling", 11.5, 16), dummy(field, "Zergling", 11.8, 16.5)
    beside, behind = dummy(field, "Zergling", 10, 18), dummy(field, "Zergling", 8, 16)
    hellbat = shot_at(field, "HellionTank", 10, target)
    one_shot(field, hellbat)
    assert lost(field, [target, inside, beside, behind], 35) == [18, 18, 0, 0]


def test_an_ultralisk_cleaves_a_third_into_those_around_its_target(field: Any) -> None:
    target, beside, far = (dummy(field, "Roach", 12, y) for y in (16, 17.5, 20))
    ultralisk = shot_at(field, "Ultralisk", 10.3, target)
    one_shot(field, ultralisk)
    assert lost(field, [target, beside, far], 145) == pytest.approx([35 - 1, 35 * 0.33 - 1, 0])


def test_an_archon_shocks_in_rings_of_falling_damage(field: Any) -> None:
    radius = field.world.catalog.unit("Roach").radius
    slots = [dummy(field, "Roach", 12 + x, 16) for x in (0.0, radius + 0.2, radius + 0.4, radius + 0.9, radius + 1.1)]
    archon = shot_at(field, "Archon", 9, slots[0])
    field.world.separation[slots] = 0.0
    one_shot(field, archon)
    full = 25 + 10  # bonus against biological
    assert lost(field, slots, 145) == pytest.approx([full - 1, full - 1, full / 2 - 1, full / 4 - 1, 0])


@pytest.mark.parametrize(("attacker", "radius", "per_shot"), [("Thor", 0.5, 4 * (6 + 6)), ("Liberator", 1.5, 2 * 5)])
def test_missiles_at_flyers_burst_among_flyers(field: Any, attacker: str, radius: float, per_shot: float) -> None:
    """Flyers within the radius take as much as the target; walkers below take nothing."""
    world = field.world
    body = world.catalog.unit("Mutalisk").radius
    target = dummy(field, "Mutalisk", 14, 16)
    near = dummy(field, "Mutalisk", 14, 16 + radius + body - 0.05)
    far = dummy(field, "Mutalisk", 14, 16 - radius - body - 0.1)
    below = dummy(field, "Zergling", 14, 16)
    for slot in (target, near, far):
        commands.hold(world, [slot])  # so that they do not drift apart
        world.acquires[slot] = False
    slot = shot_at(field, attacker, 9, target)
    one_shot(field, slot)
    assert lost(field, [target, near, far], 120) == pytest.approx([per_shot, per_shot, 0])
    assert world.life[below] == 35


def test_spines_travel_and_one_can_walk_out_of_their_way(field: Any) -> None:
    world = field.world
    near, middle, far = (dummy(field, "Zealot", x, 16) for x in (12, 15, 18))
    runner = field.put("Zergling", 2, 16.5, 16)
    world.acquires[runner] = False
    lurker = shot_at(field, "LurkerMPBurrowed", 10, near)
    hit_at: dict[int, int] = {}
    for loop in field.loops(24):
        if world.cooldown[lurker] > 0.0 and loop == 1:
            commands.move(world, [runner], (16.5, 24))
        world.cooldown[lurker] = 1e6
        for slot in (near, middle, far):
            if world.shields[slot] < 50:
                hit_at.setdefault(slot, loop)
    # a point every 1 of distance and 2 loops; it touches when it is within 0.5 of the edge
    radius = world.catalog.unit("Zealot").radius
    expected = [1 + 2 * (math.ceil(d - 0.5 - radius) - 1) for d in (2, 5, 8)]
    assert [hit_at[s] for s in (near, middle, far)] == expected
    assert world.life[runner] == 35


def test_a_fortress_turns_its_gun_before_it_fires(field: Any) -> None:
    world = field.world
    target = dummy(field, "Marauder", 6, 16)
    near = dummy(field, "Marauder", 6, 17.6)
    fortress = shot_at(field, "PlanetaryFortress", 14, target, facing=0.0)
    world.acquires[fortress] = False
    waited = 0
    while world.cooldown[fortress] <= 0:
        field.play(1)
        waited += 1
    # it looks the other way: 180 degrees less half its arc of 90 and its slop, at 90 degrees per normal second
    assert waited == math.ceil((180 - 45 - 11.25) / (90 / 16))
    one_shot(field, fortress)
    assert world.life[target] < 125
    assert world.life[near] == 125 - (40 * 0.375 - 1)


def test_a_tank_fires_at_what_is_behind_it_without_turning_its_body(field: Any) -> None:
    world = field.world
    target = dummy(field, "Marauder", 6, 16)
    tank = shot_at(field, "SiegeTank", 12, target, facing=0.0)
    one_shot(field, tank)
    assert world.heading[tank].tolist() == pytest.approx([1, 0])
    assert world.life[target] < 125


def test_a_beam_ticks_exactly_once_per_period(field: Any) -> None:
    world = field.world
    target = dummy(field, "Ultralisk", 14, 16)
    world.life[target] = 1e5
    shot_at(field, "VoidRay", 11, target)
    lost_at, before = [], float(world.life[target])
    for loop in field.loops(400):
        if world.life[target] < before:
            lost_at.append(loop)
            before = float(world.life[target])
    assert set(np.diff(lost_at)) == {8}


def test_a_beam_holds_on_within_its_slop(field: Any) -> None:
    world = field.world
    target = dummy(field, "Ultralisk", 15, 16)
    ray = shot_at(field, "VoidRay", 8, target)
    while world.life[target] == 500:
        field.play(1)
    world.step_max[ray] = 0.0
    bodies = world.radius[ray] + world.radius[target]
    for gap, holds in ((7.9, True), (8.1, False), (7.9, False)):  # range 6, slop 2
        world.pos[target, 0] = world.pos[ray, 0] + bodies + gap
        field.play(1)
        before = float(world.life[target])
        field.play(12)
        assert (world.life[target] < before) == holds


def test_a_weapon_that_is_off_can_be_switched_on(field: Any) -> None:
    world = field.world
    target = dummy(field, "Zergling", 12, 16)
    oracle = field.put("Oracle", 1, 10, 16)
    field.play(40)
    assert world.life[target] == 35
    set_weapon(world, oracle, "Oracle", on=True)
    while world.life[target] == 35:
        field.play(1)
    assert world.life[target] == 35 - (15 + 7)
    set_weapon(world, oracle, "Oracle", on=False)
    before = float(world.life[target])
    field.play(30)
    assert world.life[target] == before
    assert world.target[oracle] == -1


def test_a_unit_that_changes_its_form_in_a_fight_goes_on_with_its_new_weapon(field: Any) -> None:
    world = field.world
    target = dummy(field, "Marauder", 16, 16)
    tank = shot_at(field, "SiegeTank", 8, target)
    one_shot(field, tank)
    lifecycle.become(world, tank, world.catalog.unit("SiegeTankSieged"))
    assert world.catalog.weapons[int(world.weapon[tank])].id == "CrucioShockCannon"
    assert world.reach[tank] == 13


def test_a_phoenix_fires_at_what_it_passes_and_flies_on(field: Any) -> None:
    world = field.world
    target = dummy(field, "Overlord", 16, 18)
    phoenix, alone = field.put("Phoenix", 1, 6, 16), field.put("Phoenix", 1, 6, 6)
    world.step_max[alone] = world.step_max[phoenix]
    commands.move(world, [phoenix], (28, 16))
    commands.move(world, [alone], (28, 6))
    for _ in field.loops(70):
        assert world.pos[phoenix, 0] == pytest.approx(float(world.pos[alone, 0]))
    assert world.life[target] < 200


def test_a_roach_spits_from_afar_and_bites_what_stands_beside_it(field: Any) -> None:
    world = field.world
    target = dummy(field, "Ultralisk", 12, 16)
    world.life[target] = 1e5
    roach = shot_at(field, "Roach", 12 - 1.0 - 0.625 - 0.3, target)
    one_shot(field, roach, loops=4)
    assert world.catalog.weapons[int(world.weapon[roach])].id == "RoachMelee"
    world.pos[roach, 0] -= 2.0
    world.cooldown[roach] = 0.0
    field.play(3)
    assert world.catalog.weapons[int(world.weapon[roach])].id == "AcidSaliva"


def test_a_sieged_tank_leaves_alone_what_is_too_near(field: Any) -> None:
    world = field.world
    near, far = dummy(field, "Ultralisk", 13, 16), dummy(field, "Marauder", 20, 16)
    tank = field.put("SiegeTankSieged", 1, 10, 16)
    field.play(30)
    assert world.target[tank] == far
    assert world.life[near] == 500


def test_a_sieged_tank_hits_friends_beside_its_target(field: Any) -> None:
    target, friend = dummy(field, "Marauder", 20, 16), dummy(field, "Marauder", 20, 17.2, owner=1)
    tank = shot_at(field, "SiegeTankSieged", 10, target)
    one_shot(field, tank)
    assert lost(field, [target, friend], 125) == pytest.approx([70 - 1, 70 * 0.5 - 1])


def test_a_liberator_on_guard_can_not_be_aimed_at_a_structure(field: Any) -> None:
    world = field.world
    spine = dummy(field, "SpineCrawler", 14, 16)
    liberator = field.put("LiberatorAG", 1, 10, 16)
    commands.attack_unit(world, [liberator], world.tag_of(spine))
    field.play(60)
    assert world.life[spine] == 300


def test_a_baneling_bursts_over_enemies_and_spares_friends(field: Any) -> None:
    world = field.world
    marine, beside, far = (dummy(field, "Marine", 12, y) for y in (16, 18, 20))
    marauder, depot = dummy(field, "Marauder", 13.5, 16), dummy(field, "SupplyDepot", 12, 13)
    friend = dummy(field, "Zergling", 12, 15, owner=1)
    baneling = shot_at(field, "Baneling", 10, marine)
    field.play(20)
    assert not world.alive[baneling]
    assert lost(field, [marine, beside, far], 45) == [35, 35, 0]
    assert lost(field, [marauder], 125) == [20 - 1]
    assert lost(field, [depot], 400) == [80]  # structures: no armor counts
    assert lost(field, [friend], 35) == [0]
    assert world.deaths[0].killer == -1


def test_a_baneling_runs_past_structures_unless_it_is_told(field: Any) -> None:
    world = field.world
    spine = dummy(field, "SpineCrawler", 14, 16)
    baneling = field.put("Baneling", 1, 10, 16)
    field.play(30)
    assert world.target[baneling] == -1
    set_weapon(world, baneling, "VolatileBurstBuilding", on=True)
    field.play(40)
    assert not world.alive[baneling]
    assert world.life[spine] == 300 - 80


@pytest.mark.parametrize(("rate", "period"), [(1.0, 29.92), (1.5, 29.92 / 1.5), (0.5, 29.92 * 2)])
def test_the_attack_rate_divides_the_period(field: Any, rate: float, period: float) -> None:
    world = field.world
    target = dummy(field, "SpineCrawler", 15, 16)
    world.life[target] = 1e6
    stalker = shot_at(field, "Stalker", 10, target)
    world.attack_rate[stalker] = rate
    starts, before = [], 0.0
    for loop in field.loops(3000):
        if world.cooldown[stalker] > before:
            starts.append(loop)
        before = float(world.cooldown[stalker])
    assert np.diff(starts).mean() == pytest.approx(period + 0.5, rel=0.02)


def test_a_range_bonus_counts_for_reach(field: Any) -> None:
    world = field.world
    target = dummy(field, "SpineCrawler", 20, 16)
    stalker = field.put("Stalker", 1, 4, 16)
    world.range_add[stalker] = 2.0
    commands.attack_unit(world, [stalker], world.tag_of(target))
    field.play(120)
    gap = world.pos[target, 0] - world.pos[stalker, 0] - world.radius[target] - world.radius[stalker]
    assert gap == pytest.approx(8.0, abs=0.03)


def test_a_unit_that_may_not_attack_does_not(field: Any) -> None:
    world = field.world
    target = dummy(field, "SpineCrawler", 15, 16)
    stalker = shot_at(field, "Stalker", 10, target)
    world.can_attack[stalker] = False
    field.play(60)
    assert world.life[target] == 300


def test_a_weapon_that_launches_units_calls_its_launcher(field: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    target = dummy(field, "SpineCrawler", 15, 16)
    launched: list[tuple[int, int]] = []
    monkeypatch.setitem(LAUNCHERS, "BroodlingStrike", lambda _, source, aim: launched.append((source, aim)))
    lord = shot_at(field, "BroodLord", 8, target)
    one_shot(field, lord)
    assert launched == [(lord, target)]
