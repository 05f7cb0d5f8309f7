"""Starting, stopping and turning: exact arrival, braking, coasting, turning before walking."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import pytest

from khala_simulator.abilities import commands


@pytest.mark.parametrize("name", ["Marine", "Zergling", "Thor", "SCV", "VoidRay", "Mutalisk", "Tempest", "Colossus"])
@pytest.mark.parametrize("goal", [(21.0, 18.0), (10.3, 16.1), (4.123456789, 9.87654321)])
def test_a_walk_ends_exactly_at_its_point(field: Any, name: str, goal: tuple[float, float]) -> None:
    world = field.world
    slot = field.put(name, 1, 10, 16, facing=2.0)
    commands.move(world, [slot], goal)
    while world.order_kind[slot]:
        field.play(1)
        assert world.loop < 900
    field.play(30)
    assert world.pos[slot].tolist() == pytest.approx(list(goal), abs=1e-6)


@pytest.mark.parametrize(
    ("name", "rate_n"), [("SCV", 2.5), ("VoidRay", 2.0), ("Tempest", 3.0), ("Mothership", 1.0), ("Mutalisk", 3.5)]
)
def test_a_unit_brakes_no_harder_than_it_can(field: Any, name: str, rate_n: float) -> None:
    """The rate is the type's deceleration, or its acceleration where the tables have none."""
    world = field.world
    slot = field.put(name, 1, 6, 16)
    commands.move(world, [slot], (26, 16))
    steps, before = [], 6.0
    for _ in field.loops(420):
        now = float(world.pos[slot, 0])
        steps.append(now - before)
        before = now
    top = world.catalog.unit(name).speed_n / 16
    assert max(steps) == pytest.approx(top)
    losses = [a - b for a, b in pairwise(steps)]
    assert sorted(losses)[-3] <= rate_n / 256 + 1e-9
    assert max(losses) <= 1.5 * rate_n / 256  # the last bit, less than a step, is cut to arrive exactly
    assert before == pytest.approx(26, abs=1e-9)


def test_a_flyer_that_is_stopped_coasts_and_a_walker_stands(field: Any) -> None:
    world = field.world
    ray, marine = field.put("VoidRay", 1, 6, 16), field.put("Marine", 1, 6, 10)
    commands.move(world, [ray, marine], (26, 16))
    field.play(60)
    commands.stop(world, [ray, marine])
    at, stood = float(world.pos[ray, 0]), world.pos[marine].tolist()
    speed = world.catalog.unit("VoidRay").speed_n / 16
    field.play(60)
    assert world.pos[ray, 0] - at == pytest.approx(speed**2 / (2 * 2.0 / 256), abs=speed)
    assert world.pos[marine].tolist() == stood
    assert world.speed[ray] == 0


def test_a_unit_with_more_to_do_does_not_brake_at_a_corner(field: Any) -> None:
    world = field.world
    slot = field.put("VoidRay", 1, 4, 16)
    commands.move(world, [slot], (14, 16))
    commands.move(world, [slot], (28, 16), queue=True)
    top = world.catalog.unit("VoidRay").speed_n / 16
    while world.pos[slot, 0] < 13.9:
        field.play(1)
    assert world.speed[slot] == pytest.approx(top)


@pytest.mark.parametrize(("name", "still_deg_n"), [("Thor", 720), ("Hellion", 1499.9414), ("Marine", 999.8437)])
def test_a_unit_that_faces_away_turns_before_it_makes_headway(field: Any, name: str, still_deg_n: float) -> None:
    world = field.world
    slot = field.put(name, 1, 16, 16, facing=math.pi)
    commands.move(world, [slot], (26, 16))
    loops = math.ceil(90 / (still_deg_n / 16))  # until it faces its way by less than a right angle
    field.play(loops - 1)
    assert world.pos[slot, 0] <= 16 + 1e-9
    field.play(3)
    assert world.pos[slot, 0] > 16


def test_a_flyer_swings_around_in_a_circle(field: Any) -> None:
    world = field.world
    slot = field.put("Battlecruiser", 1, 8, 16)
    commands.move(world, [slot], (24, 16))
    field.play(80)
    commands.move(world, [slot], (4, 16))
    aside = 0.0
    for _ in field.loops(12):
        aside = max(aside, abs(float(world.pos[slot, 1]) - 16))
    turn = math.radians(720 / 16)
    radius = world.catalog.unit("Battlecruiser").speed_n / 16 / turn
    assert radius < aside < 3 * radius
