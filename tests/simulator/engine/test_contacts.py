"""Which bodies are near each other, and how they react."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from khala_simulator.abilities import commands
from khala_simulator.movement import contacts
from khala_simulator.movement.contacts import Bodies, within

SIXTEENTHS = st.integers(0, 480).map(lambda n: n / 16)  # so that differences are exact
POINTS = st.lists(st.tuples(SIXTEENTHS, SIXTEENTHS), min_size=1, max_size=60)


@given(points=POINTS, reach=st.integers(1, 80).map(lambda n: n / 16))
def test_all_pairs_within_reach_are_found_once(points: list[tuple[float, float]], reach: float) -> None:
    at = np.array(points, dtype=np.float64)
    (one, other), squared = within(at, reach)
    found = {frozenset(pair) for pair in zip(one.tolist(), other.tolist(), strict=True)}
    assert len(found) == len(one)
    away = np.abs(at[:, None, :] - at)
    expected = {frozenset((i, j)) for i, j in zip(*np.nonzero((away < reach).all(axis=2)), strict=True) if i < j}
    assert found == expected
    assert squared.tolist() == pytest.approx([math.dist(at[i], at[j]) ** 2 for i, j in zip(one, other, strict=True)])


def test_many_units_of_which_none_has_a_body_do_not_touch(field: Any) -> None:
    for i in range(contacts.TABLE_LIMIT + 1):
        field.put("SupplyDepot", 1, 4 + i % 10 * 2, 4 + i // 10 * 2)
    assert Bodies.of(field.world).near(field.world.pos.take(field.world.live, 0)) is None


def test_neighbours_are_the_same_with_and_without_a_table(field: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(1)
    world = field.world
    names = ("Zergling", "Ultralisk", "Mutalisk", "Colossus", "Marine", "SpineCrawler")
    for i in range(70):
        field.put(names[i % 6], 1 + i % 2, *rng.uniform(6, 26, 2).tolist())
    at = world.pos.take(world.live, 0)
    found = []
    for limit in (0, 1000):
        monkeypatch.setattr(contacts, "TABLE_LIMIT", limit)
        pairs = Bodies.of(world).near(at)
        assert pairs is not None
        found.append(sorted(zip(pairs.one.tolist(), pairs.other.tolist(), pairs.apart.tolist(), strict=True)))
    assert found[0] == found[1]
    assert found[0]


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
