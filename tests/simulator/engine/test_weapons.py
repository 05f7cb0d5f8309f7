from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from khala_simulator.abilities import commands

if TYPE_CHECKING:
    from collections.abc import Callable

PERIODS = [  # attacker, target, distance between centres, period in loops as 16 x the catalog's normal seconds
    ("Zealot", "SpineCrawler", 1.4, 1.2 * 16),
    ("Stalker", "SpineCrawler", 5.0, 1.87 * 16),
    ("Zergling", "SpineCrawler", 1.3, 0.696 * 16),
    ("Colossus", "Zealot", 6.0, 1.5 * 16),
    ("Marine", "Zealot", 4.0, 0.8608 * 16),
]


def duel(field: Any, attacker: str, target: str, distance: float) -> tuple[int, int]:
    """Return an attacker with an attack order, and a target that can take anything and does nothing."""
    world = field.world
    a, t = field.put(attacker, 1, 10, 16, facing=0.0), field.put(target, 2, 10 + distance, 16)
    world.life[t] = 1e6
    world.acquires[t] = False
    world.step_max[t] = 0.0
    commands.attack_unit(world, [a], world.tag_of(t))
    return a, t


def starts_of(field: Any, attacker: int, loops: int) -> list[int]:
    """Return the loops at which the attacker began an attack, which is when its cooldown goes up."""
    starts, before = [], 0.0
    for loop in field.loops(loops):
        now = float(field.world.cooldown[attacker])
        if now > before:
            starts.append(loop)
        before = now
    return starts


@pytest.mark.parametrize(("data", "period"), [("liberty", 1.6 * 16), ("multi", 1.85 * 16)])
def test_a_tentacle_has_its_cooldown_from_the_hit(make_field: Callable[..., Any], data: str, period: float) -> None:
    """From hit to hit: the period and 0.5 loops of delay in the mean, the damage point, a flight of 5.5 units."""
    field = make_field(data=data)
    _, target = duel(field, "SpineCrawler", "Stalker", 6.125)
    hits, before = [], field.vitals(target)
    for loop in field.loops(4000):
        now = field.vitals(target)
        if now < before:
            hits.append(loop)
        before = now
    flight = (math.sqrt(12**2 + 2 * 140 * 5.5) - 12) / 140 * 16
    assert len(hits) > 90
    assert np.diff(hits).mean() == pytest.approx(period + 0.5 + 0.3332 * 16 + flight, abs=1.0)


@pytest.mark.parametrize(
    ("attacker", "target", "distance", "period"),
    [*PERIODS[:2], *(pytest.param(*row, marks=pytest.mark.slow) for row in PERIODS[2:])],  # a melee unit and a missile
)
def test_attacks_follow_each_other_after_a_period_with_its_random_delay(
    field: Any, attacker: str, target: str, distance: float, period: float
) -> None:
    a, _ = duel(field, attacker, target, distance)
    gaps = np.diff(starts_of(field, a, 6000))
    assert len(gaps) > 150
    # the delay is -1 to +2 loops, 0.5 in the mean; a start falls on a whole loop
    assert gaps.mean() == pytest.approx(period + 0.5, abs=0.25)
    assert gaps.min() >= math.floor(period - 1)
    assert gaps.max() <= math.ceil(period + 2)


@pytest.mark.parametrize(
    ("attacker", "target", "distance", "damage_point"),
    [
        ("Zergling", "Zealot", 1.0, 0.167 * 16),
        ("Zealot", "Zealot", 1.0, 0.0),
        ("Marine", "Zealot", 4.0, 0.8),
        ("Ultralisk", "Zealot", 2.0, 0.3332 * 16),
    ],
)
def test_an_instant_hit_lands_at_the_damage_point(
    field: Any, attacker: str, target: str, distance: float, damage_point: float
) -> None:
    a, t = duel(field, attacker, target, distance)
    before = field.vitals(t)
    started = None
    for loop in field.loops(40):
        if started is None and field.world.cooldown[a] > 0:
            started = loop
        if field.vitals(t) < before:
            assert started is not None
            assert loop - started == math.ceil(damage_point)
            return
    pytest.fail("no hit")


def test_a_zealot_strikes_twice_in_one_attack(field: Any) -> None:
    a, t = duel(field, "Zealot", "SpineCrawler", 1.3)
    lost, before = [], field.vitals(t)
    for loop in field.loops(18):
        now = field.vitals(t)
        if now < before:
            lost.append((loop, before - now))
        before = min(before, now)
    first = lost[0][0]
    # 0.28 normal seconds are 4.48 loops; 8 damage less 2 armor each, and the target's own regeneration
    assert [loop - first for loop, _ in lost] == [0, math.ceil(0.28 * 16)]
    assert [amount for _, amount in lost] == pytest.approx([6, 6], abs=0.1)
    assert field.world.target[a] == t


@pytest.mark.parametrize("distance", [2.0, 4.0, 6.5])
def test_a_missile_needs_its_time_to_the_edge_of_its_target(field: Any, distance: float) -> None:
    _, t = duel(field, "Stalker", "SpineCrawler", distance)
    world = field.world
    launched = None
    before = field.vitals(t)
    for loop in field.loops(60):
        if launched is None and len(world.missiles):
            launched = loop
        if field.vitals(t) < before - 1:
            flight = (distance - world.catalog.unit("SpineCrawler").radius) / (18.75 / 16)
            assert launched is not None
            assert loop - launched == math.ceil(flight)
            return
    pytest.fail("no hit")


def test_a_missile_follows_a_target_that_walks_away(field: Any) -> None:
    world = field.world
    stalker, runner = field.put("Stalker", 1, 4, 16), field.put("Zergling", 2, 10, 16)
    world.acquires[runner] = False
    commands.attack_unit(world, [stalker], world.tag_of(runner))
    while not len(world.missiles):
        field.play(1)
    commands.move(world, [runner], (30, 16))
    field.play(20)
    assert len(world.missiles) == 0
    assert world.life[runner] < 35 - 10


def test_a_missile_whose_target_dies_hits_nobody(field: Any) -> None:
    world = field.world
    stalker, first = field.put("Stalker", 1, 4, 16), field.put("Zergling", 2, 10, 16)
    near = field.put("Zergling", 2, 10, 17)
    world.acquires[first] = world.acquires[near] = False
    commands.attack_unit(world, [stalker], world.tag_of(first))
    while not len(world.missiles):
        field.play(1)
    commands.stop(world, [stalker])
    world.acquires[stalker] = False
    commands.debug_kill(world, [world.tag_of(first)])
    field.play(20)
    assert len(world.missiles) == 0
    assert world.life[near] == 35


def test_a_missile_arrives_though_its_shooter_is_dead(field: Any) -> None:
    world = field.world
    stalker, target = field.put("Stalker", 1, 4, 16), field.put("SpineCrawler", 2, 10, 16)
    world.acquires[target] = False
    commands.attack_unit(world, [stalker], world.tag_of(target))
    while not len(world.missiles):
        field.play(1)
    commands.debug_kill(world, [world.tag_of(stalker)])
    field.play(10)
    assert world.life[target] == pytest.approx(300 - (13 + 5 - 2), abs=0.3)


def test_dropping_an_attack_before_its_damage_point_costs_no_cooldown(field: Any) -> None:
    a, t = duel(field, "Ultralisk", "Zealot", 2.0)
    world = field.world
    while world.windup[a] < 0:
        field.play(1)
    commands.move(world, [a], (4, 16))
    assert world.cooldown[a] == 0
    field.play(20)
    assert field.vitals(t) == 1e6 + 50


def test_a_unit_turns_to_its_target_before_it_fires(field: Any) -> None:
    world = field.world
    a, t = field.put("Stalker", 1, 10, 16, facing=math.pi), field.put("SpineCrawler", 2, 15, 16)
    world.acquires[t] = False
    commands.attack_unit(world, [a], world.tag_of(t))
    field.play(1)
    assert world.cooldown[a] == 0
    field.play(4)  # 180 degrees at 62.5 a loop
    assert world.cooldown[a] > 0
    assert world.facing()[a] == pytest.approx(0.0, abs=1e-6)


def test_range_is_measured_from_edge_to_edge(field: Any) -> None:
    world = field.world
    stalker, target = field.put("Stalker", 1, 4, 16), field.put("SpineCrawler", 2, 20, 16)
    world.acquires[target] = False
    commands.attack_unit(world, [stalker], world.tag_of(target))
    field.play(120)
    gap = world.pos[target, 0] - world.pos[stalker, 0] - 0.625 - 0.875
    assert gap == pytest.approx(6.0, abs=0.03)
    assert gap <= 6.0


def test_a_melee_unit_keeps_its_target_within_the_slop_of_its_range(field: Any) -> None:
    """An attack that has begun takes effect though the target has moved up to 1 away."""
    a, t = duel(field, "Zergling", "Zealot", 0.375 + 0.5)
    world = field.world
    while world.windup[a] < 0:
        field.play(1)
    world.pos[t, 0] += 0.6
    before = field.vitals(t)
    field.play(3)
    assert field.vitals(t) < before


def test_a_unit_whose_only_enemy_died_while_it_aimed_fights_the_next_one(field: Any) -> None:
    world = field.world
    a, t = duel(field, "Ultralisk", "Zealot", 2.0)
    while world.windup[a] < 0:
        field.play(1)
    commands.debug_kill(world, [world.tag_of(t)])
    field.play(2)
    after = field.put("Zealot", 2, 12, 16)
    world.acquires[after] = False
    field.play(20)
    assert world.target[a] == after


@pytest.mark.parametrize(("gap", "fires"), [(1.8, False), (2.2, True)])
def test_a_sieged_tank_does_not_fire_at_what_is_nearer_than_its_least_range(
    field: Any, gap: float, fires: bool
) -> None:
    bodies = sum(float(field.world.catalog.unit(name).radius) for name in ("SiegeTankSieged", "SpineCrawler"))
    tank, _ = duel(field, "SiegeTankSieged", "SpineCrawler", bodies + gap)
    assert bool(starts_of(field, tank, 100)) == fires


@pytest.mark.parametrize(("name", "damage"), [("Tempest", 52.0), ("Queen", 9.0)])
def test_the_better_of_two_weapons_hits_a_colossus(make_field: Callable[..., Any], name: str, damage: float) -> None:
    field = make_field()
    attacker, colossus = field.put(name, 1, 16.0, 16.0), field.still("Colossus", 2, 20.0, 16.0)
    commands.attack_unit(field.world, [attacker], field.world.tag_of(colossus))
    whole = field.world.shields[colossus]
    for _ in field.loops(100):
        if field.world.shields[colossus] < whole:
            break
    assert whole - field.world.shields[colossus] == damage
