from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from khala_simulator.abilities import commands

# speed per normal second of 16 loops, as the tables say
SPEEDS = {
    "Stalker": 2.9531,
    "Zealot": 2.25,
    "Colossus": 2.25,
    "Zergling": 2.9531,
    "Marine": 2.25,
    "Immortal": 2.25,
    "Ultralisk": 2.9531,
    "Archon": 2.8125,
}


@pytest.mark.parametrize(("name", "speed_n"), SPEEDS.items())
def test_every_loop_of_a_straight_walk_is_one_exact_step(field: Any, name: str, speed_n: float) -> None:
    world = field.world
    slot = field.put(name, 1, 2, 16)
    commands.move(world, [slot], (30, 16))
    x = [2.0, *(float(world.pos[slot, 0]) for _ in field.loops(60))]
    assert np.diff(x) == pytest.approx(speed_n / 16, abs=1e-12)
    assert world.pos[slot, 1] == 16


def test_a_walk_ends_on_its_point(field: Any) -> None:
    world = field.world
    slot = field.put("Stalker", 1, 5, 5)
    commands.move(world, [slot], (9.3, 12.7))
    loops = math.ceil(math.dist((5, 5), (9.3, 12.7)) / (2.9531 / 16))
    field.play(loops)
    assert world.pos[slot] == pytest.approx((9.3, 12.7), abs=0.05)
    field.play(2)
    assert world.orders_of(slot) == []


def test_workers_and_flyers_speed_up_step_by_step(field: Any) -> None:
    world = field.world
    ray = field.put("VoidRay", 1, 2, 16)
    unit = world.catalog.unit("VoidRay")
    commands.move(world, [ray], (30, 16))
    field.play(1)
    assert world.pos[ray, 0] - 2 == pytest.approx(unit.acceleration_n / 256)
    field.play(1)
    assert world.pos[ray, 0] - 2 == pytest.approx(3 * unit.acceleration_n / 256)
    x = [float(world.pos[ray, 0]) for _ in field.loops(60)]
    assert x[-1] - x[-2] == pytest.approx(unit.speed_n / 16)


def test_a_speed_upgrade_counts_at_once(field: Any) -> None:
    world = field.world
    zealot = field.put("Zealot", 1, 2, 16)
    commands.move(world, [zealot], (30, 16))
    field.play(4)
    commands.grant_upgrade(world, 1, world.catalog.upgrade("Charge").id)
    before = float(world.pos[zealot, 0])
    field.play(1)
    assert world.pos[zealot, 0] - before == pytest.approx((2.25 + 0.7031) / 16)


def test_zerg_is_faster_on_creep(make_field: Any) -> None:
    field = make_field("char_pit")
    world = field.world
    zergling = field.put("Zergling", 2, 10.5, 18.5)
    assert world.map.terrain.creep[18, 10]
    commands.move(world, [zergling], (16, 18.5))
    field.play(5)
    assert world.pos[zergling, 0] - 10.5 == pytest.approx(5 * 2.9531 * 1.3 / 16)


def test_a_body_turns_by_no_more_than_its_rate(field: Any) -> None:
    world = field.world
    colossus = field.put("Archon", 1, 16, 16, facing=0.0)
    rate = world.catalog.unit("Archon").turn_deg_n / 16
    commands.move(world, [colossus], (2, 16))
    before = 0.0
    for _ in field.loops(3):
        now = float(np.degrees(world.facing()[colossus]))
        assert abs(now - before) <= rate + 1e-6
        before = now


def test_queued_walks_are_walked_in_order(field: Any) -> None:
    world = field.world
    slot = field.put("Stalker", 1, 5, 5)
    corners = [(8.0, 5.0), (8.0, 8.0), (5.0, 8.0)]
    for i, corner in enumerate(corners):
        commands.move(world, [slot], corner, queue=i > 0)
    assert [o.point for o in world.orders_of(slot)] == corners
    reached = []
    for _ in field.loops(80):
        for corner in corners:
            if corner not in reached and math.dist(world.pos[slot], corner) < 0.06:
                reached.append(corner)
    assert reached == corners


def test_following_ends_beside_the_leader_and_goes_on_with_it(field: Any) -> None:
    world = field.world
    leader, follower = field.put("Stalker", 1, 16, 16), field.put("Zealot", 1, 5, 16)
    commands.follow(world, [follower], world.tag_of(leader))
    field.play(150)
    assert math.dist(world.pos[leader], world.pos[follower]) < 2.5
    commands.move(world, [leader], (28, 16))
    field.play(120)
    assert math.dist(world.pos[leader], world.pos[follower]) < 2.5


def test_a_patrol_goes_back_and_forth(field: Any) -> None:
    world = field.world
    slot = field.put("Stalker", 1, 10, 16)
    commands.patrol(world, [slot], (13, 16))
    x = [float(world.pos[slot, 0]) for _ in field.loops(100)]
    assert max(x) == pytest.approx(13, abs=0.06)
    assert min(x[20:]) == pytest.approx(10, abs=0.06)
    assert int((np.diff(np.sign(np.diff(x))) != 0).sum()) >= 4


def test_structures_do_not_walk(field: Any) -> None:
    world = field.world
    spine = field.put("SpineCrawler", 2, 16, 16)
    assert commands.move(world, [spine], (20, 16)) == []
    field.play(10)
    assert world.pos[spine].tolist() == [16, 16]
