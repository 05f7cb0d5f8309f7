"""Crowds: who comes into reach of a target, ways round those who fight, and gaps that are too small for a body."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from bench.simulator.crowds import BATTLES, binomial, mirror
from khala_simulator.abilities import commands

if TYPE_CHECKING:
    from collections.abc import Callable

WALLS = 9999  # a slot that no unit has
PARKED = 0.7476  # part of a line that bodies cover which come one by one to any free place, and stay (Rényi 1958)
SLOW = pytest.mark.slow


def places_around(world: Any, attacker: str, target: str) -> float:
    """Return how many bodies of one type fit on the circle from which they reach another."""
    one, other = world.catalog.unit(attacker), world.catalog.unit(target)
    reach = max(one.radius + other.radius + one.weapons[0].range, one.separation + other.separation)
    return math.pi / math.asin(one.separation / reach)


def rows(count: int, columns: int, x: float, y: float, gap: float) -> list[tuple[float, float]]:
    return [(x + i % columns * gap, y + i // columns * gap) for i in range(count)]


@pytest.mark.parametrize(
    ("attacker", "target"),
    [
        ("Zergling", "Zealot"),
        pytest.param("Zergling", "Marine", marks=SLOW),
        pytest.param("Zergling", "Ultralisk", marks=SLOW),
        pytest.param("Zealot", "Ultralisk", marks=SLOW),
    ],
)
def test_as_many_reach_one_target_as_fit_round_it(field: Any, attacker: str, target: str) -> None:
    world = field.world
    foe = field.still(target, 2, 20, 16)
    commands.hold(world, [foe])
    slots = [field.put(attacker, 1, *place) for place in rows(20, 4, 8, 13, 0.8)]
    commands.attack_unit(world, slots, world.tag_of(foe))
    world.life[foe] = world.life_max[foe] = 1e6
    field.play(160)
    most = places_around(world, attacker, target)
    assert PARKED * most < world.in_reach[slots].sum() <= most + 0.15  # the second row presses a little


def test_a_second_row_goes_round_the_first_to_the_other_side(field: Any) -> None:
    """Six Zealots in a line have room for 18 Zerglings: the hull of their centres and a circle's perimeter."""
    world = field.world
    line = [field.still("Zealot", 2, 20, 14 + 0.75 * i) for i in range(6)]
    commands.hold(world, line)
    world.life[line] = world.life_max[line] = 1e6
    slots = [field.put("Zergling", 1, *place) for place in rows(24, 4, 12, 14, 0.8)]
    commands.attack_move(world, slots, (26, 16))
    field.until(lambda: world.in_reach[slots].sum() >= 13, most=110)
    behind = world.pos[slots, 0] > 20.4
    assert (world.in_reach[slots] & behind).sum() >= 3


def test_who_comes_through_a_gap_behind_others_goes_on_to_either_side(field: Any) -> None:
    """In single file the last of 12 Marines comes 2.6 seconds after the first; 200 loops are 8.9 seconds."""
    world = field.world
    world.ground.block(WALLS, np.array([(x, y) for x in (12, 13) for y in range(32) if y != 16]))
    foe = field.still("Ultralisk", 2, 24, 16.5)
    commands.hold(world, [foe])
    world.life[foe] = world.life_max[foe] = 1e6
    slots = [field.put("Marine", 1, *place) for place in rows(12, 3, 5, 15.3, 0.8)]
    commands.attack_move(world, slots, (24, 16.5))
    field.until(lambda: world.in_reach[slots].sum() >= 1, most=100)
    field.until(lambda: world.in_reach[slots].sum() == len(slots), most=200)


def test_a_column_of_marines_spreads_until_most_of_them_fire(field: Any) -> None:
    world = field.world
    foe = field.still("Ultralisk", 2, 24, 16)
    commands.hold(world, [foe])
    world.life[foe] = world.life_max[foe] = 1e6
    slots = [field.put("Marine", 1, *place) for place in rows(16, 8, 8, 15.2, 0.8)]
    commands.attack_move(world, slots, (24, 16))
    field.until(lambda: world.in_reach[slots].sum() >= 15, most=300)


@pytest.mark.parametrize(
    ("name", "gap", "passes"),
    [
        ("Stalker", 1, True),
        ("Ultralisk", 1, False),
        ("Ultralisk", 2, True),
        *(pytest.param(name, 1, True, marks=SLOW) for name in ("Zergling", "Roach", "Immortal", "Marauder")),
        *(pytest.param(name, 1, False, marks=SLOW) for name in ("Thor", "SiegeTank", "Archon")),
        *(pytest.param(name, 2, True, marks=SLOW) for name in ("Thor", "SiegeTank", "Archon")),
    ],
)
def test_a_body_passes_a_gap_that_its_inner_radius_fits(field: Any, name: str, gap: int, passes: bool) -> None:
    world = field.world
    world.ground.block(WALLS, np.array([(16, y) for y in range(32) if not 16 <= y < 16 + gap]))
    slot = field.put(name, 1, 10, 14)
    commands.move(world, [slot], (24, 18))
    field.play(180)
    assert (world.pos[slot, 0] > 17) == passes


def test_a_large_unit_too_near_to_a_wall_leaves_it_without_a_jump(field: Any) -> None:
    world = field.world
    slot = field.put("Thor", 1, 14.4, 16)
    world.ground.block(WALLS, np.array([(15, y) for y in range(14, 19)]))
    commands.move(world, [slot], (8, 20))
    for _ in field.loops(120):
        assert world.speed[slot] < 0.3
    assert world.pos[slot].tolist() == pytest.approx([8, 20], abs=0.01)


def test_nobody_hits_what_is_no_longer_detected(field: Any) -> None:
    """Ten Marines fire at a Dark Templar as long as a Raven is there, and not a loop longer."""
    world = field.world
    templar = field.still("DarkTemplar", 2, 20, 16)
    marines = [field.put("Marine", 1, *place) for place in rows(10, 2, 15, 14, 0.8)]
    raven = field.put("Raven", 1, 14, 16)
    field.until(lambda: world.in_reach[marines].all() and world.life[templar] + world.shields[templar] < 120)
    world.life[raven] = 0
    field.until(lambda: not world.visible[1, templar], most=8)
    field.play(2)
    left = field.vitals(templar)
    for _ in field.loops(100):
        assert not world.in_reach[marines].any()
        assert field.vitals(templar) >= left


def test_an_order_to_attack_ends_when_its_target_hides(field: Any) -> None:
    world = field.world
    templar = field.still("DarkTemplar", 2, 28, 16)
    marine, raven = field.put("Marine", 1, 6, 16), field.put("Raven", 1, 20, 16)
    field.play(8)
    commands.attack_unit(world, [marine], world.tag_of(templar))
    field.play(8)
    assert world.needs_target[marine]
    commands.move(world, [raven], (4, 28))
    field.until(lambda: not world.needs_target[marine], most=200)


@pytest.mark.parametrize(("beside", "burns"), [(1.0, True), (1.5, False)])
def test_a_hellbat_burns_whom_its_cone_touches(field: Any, beside: float, burns: bool) -> None:
    """At 2 from the Hellbat's middle the cone is 0.83 wide to each side; a Zergling's edge is 0.375 from its middle."""
    world = field.world
    hellbat = field.put("HellionTank", 1, 14, 16)
    target = field.still("Zergling", 2, 16, 16)
    other = field.still("Zergling", 2, 16, 16 + beside)
    whole = field.vitals(other)
    commands.attack_unit(world, [hellbat], world.tag_of(target))
    field.until(lambda: field.vitals(target) < 35)
    assert (field.vitals(other) < whole) == burns


def test_neither_side_of_a_crowd_is_favoured(make_field: Callable[..., Any]) -> None:
    """Zerglings against Zerglings, turned by half a circle, with the owners and the order of creation swapped."""
    wins = {1: 0, 2: 0}
    for seed in range(12):
        field = make_field(seed=seed)
        places = np.random.default_rng(seed).uniform((7.5, 12.5), (11.5, 19.5), (8, 2)).tolist()
        for player in (1, 2) if seed % 2 else (2, 1):
            for x, y in places:
                field.put("Zergling", player, *((x, y) if (player == 1) == (seed % 4 < 2) else (32 - x, 32 - y)))
        for player in (1, 2):
            slots = field.world.units_of(player).tolist()
            commands.attack_move(field.world, slots, (32.0 - float(field.world.pos[slots[0], 0]), 16.0))
        field.until(lambda world=field.world: not (len(world.units_of(1)) and len(world.units_of(2))), most=900)
        wins[1 if len(field.world.units_of(1)) else 2] += 1
    assert min(wins.values()) >= 2  # a fair coin: 1 in 157


@SLOW
@pytest.mark.timeout(1800)
def test_a_hundred_mirrors_favour_no_side_owner_or_order() -> None:
    """Five kinds of armies; the chance of a fair coin is below 0.001 for none of the factors."""
    decided = [won for army in BATTLES.values() for seed in range(20) if (won := mirror(seed, army)) is not None]
    assert len(decided) > 90
    odds = {factor: binomial(sum(won[factor] for won in decided), len(decided)) for factor in decided[0]}
    assert min(odds.values()) > 0.001, odds


def test_a_walker_that_comes_no_nearer_tries_the_other_side(field: Any) -> None:
    """Bodies that stay, such as eggs beside a Hatchery, leave open the half of a gap that is not straight ahead."""
    world = field.world
    world.ground.block(WALLS, np.array([(12, y) for y in range(32) if y not in (14, 15, 16)]))
    for y in (15.9, 16.6):
        egg = field.still("Zealot", 2, 12.5, y)
        world.life[egg] = world.life_max[egg] = 1e6
    pair = [field.put("Adept", 1, 6, 16.4), field.put("Adept", 1, 5, 16.6)]
    commands.move(world, pair, (20, 16.5))
    field.until(lambda: bool((world.pos[pair, 0] > 14).all()), most=300)
