"""Which bodies are near each other, and how they react."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from khala_simulator.abilities import commands
from khala_simulator.systems import collision

NAMES = ("Zergling", "Ultralisk", "Mutalisk", "Colossus", "Marine", "SpineCrawler")
MANY = 81  # among fewer units every pair is measured


def stand(world: Any) -> None:
    """Have bodies react to each other once, none of which walks."""
    world.anyone_moved = False
    world.resting_version = -1
    collision.separate(world)


def test_many_units_of_which_none_has_a_body_do_not_touch(field: Any) -> None:
    world = field.world
    for i in range(MANY):
        field.put("SupplyDepot", 1, 4 + i % 10 * 2, 4 + i // 10 * 2)
    before = world.pos.copy()
    stand(world)
    assert world.pos.tobytes() == before.tobytes()
    assert world.resting_version == world.population


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 1 << 30))
def test_few_bodies_react_as_they_do_among_many(make_field: Any, seed: int) -> None:
    rng = np.random.default_rng(seed)
    places = rng.uniform(3, 12, (40, 2)).tolist()
    found = []
    for others in (0, MANY):
        field = make_field()
        slots = [field.put(NAMES[i % 6], 1 + i % 2, x, y) for i, (x, y) in enumerate(places)]
        for i in range(others):
            field.put("Marine", 1, 18 + i % 9, 18 + i // 9)
        before = field.world.pos[slots]
        stand(field.world)
        found.append(field.world.pos[slots])
        assert np.abs(found[-1] - before).max() > 0.0
    assert found[0].tolist() == [pytest.approx(place, abs=1e-12) for place in found[1].tolist()]


@pytest.mark.parametrize("count", [40, 2 * MANY])
def test_a_heap_of_bodies_comes_apart(field: Any, count: int) -> None:
    world = field.world
    rng = np.random.default_rng(1)
    for _ in range(count):
        field.put("Marine", 1, *rng.normal(16, 1, 2).tolist())
    for _ in range(300):
        stand(world)
    at = world.pos[world.live]
    away = np.linalg.norm(at[:, None] - at, axis=2)
    np.fill_diagonal(away, np.inf)
    assert away.min() > 2 * world.separation[world.live[0]] - 0.1


def test_bodies_on_the_very_same_point_come_apart(field: Any) -> None:
    world = field.world
    pile = [field.put("Marine", 1, 16, 16) for _ in range(8)]
    world.pos[pile] = (16.0, 16.0)
    for _ in range(100):
        stand(world)
    assert len({tuple(place) for place in world.pos[pile].round(1).tolist()}) == len(pile)


def test_flyers_pass_through_each_other_and_drift_apart_where_they_stop(field: Any) -> None:
    world = field.world
    one, other = field.put("VoidRay", 1, 6, 16), field.put("VoidRay", 1, 26, 16)
    commands.move(world, [one, other], (16, 16))
    while world.order_kind[one] or world.order_kind[other]:
        field.play(1)
        assert world.loop < 400
    assert math.dist(world.pos[one], world.pos[other]) < 0.5
    field.play(1)
    for _ in field.loops(120):
        assert math.dist(world.pos[one], (16, 16)) < 1
    apart = world.separation[one] + world.separation[other]
    assert math.dist(world.pos[one], world.pos[other]) == pytest.approx(apart, abs=0.05)


def test_a_unit_that_holds_its_place_is_not_pushed(field: Any) -> None:
    world = field.world
    holder = field.put("Zealot", 1, 16, 16)
    commands.hold(world, [holder])
    walkers = [field.put("Zealot", 1, 10 + 1.1 * (i % 3), 14 + 1.1 * (i // 3)) for i in range(12)]
    commands.move(world, walkers, (24, 16))
    for _ in field.loops(120):
        assert world.pos[holder].tolist() == pytest.approx([16, 16], abs=1e-3)
    assert all(world.pos[s, 0] > 20 for s in walkers)
