"""What holds for bodies on the ground under any orders."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from khala_simulator.abilities import commands
from khala_simulator.combat import lifecycle
from khala_simulator.maps.game_map import load_map
from khala_simulator.movement import pathfinding
from khala_simulator.movement.placement import free_places
from khala_simulator.tables.layers import Layer
from khala_simulator.tick import advance, new_game

if TYPE_CHECKING:
    from khala_simulator.world.world import World


def deepest_overlap(world: World) -> float:
    slots = world.live[~world.walled[world.live]]
    offset = world.pos[slots][:, None] - world.pos[slots]
    distance = np.sqrt((offset**2).sum(axis=-1)) + np.eye(len(slots)) * 99
    apart = world.separation[slots][:, None] + world.separation[slots]
    meet = world.layer_bits[slots][:, None] & world.layer_bits[slots] != 0
    return float(np.where(meet, apart - distance, -9).max(initial=-9.0))


def all_on_their_surface(world: World) -> bool:
    for slot in world.live.tolist():
        if world.walled[slot]:
            continue
        surface = pathfinding.surface(world.ground, Layer(int(world.layer[slot])))
        if not surface.flat[surface.cell(world.pos[slot])]:
            return False
    return bool(np.isfinite(world.pos[world.live]).all())


command = st.tuples(
    st.sampled_from(["move", "attack_move", "hold", "stop", "patrol", "attack_unit"]),
    st.tuples(st.floats(-5, 37), st.floats(-5, 37)),
    st.integers(0, 30),
    st.booleans(),
)


@settings(max_examples=12)
@given(
    terrain=st.sampled_from(["braxis_ledge", "char_pit", "braxis_strip"]),
    names=st.lists(
        st.sampled_from(["Zealot", "Stalker", "Zergling", "Colossus", "Ultralisk", "Mutalisk"]), max_size=12
    ),
    told=st.lists(command, max_size=6),
)
def test_no_unit_ever_stands_where_it_can_not(make_field: Any, terrain: str, names: list[str], told: Any) -> None:
    world = make_field(terrain).world
    for i, name in enumerate(names):
        unit = world.catalog.unit(name)
        (place,) = free_places(world, unit, (14.0, 14.0), 1)
        lifecycle.spawn(world, unit, 1 + i % 2, place)
    for kind, point, other, queue in told:
        slots = world.units_of(1).tolist()
        if kind in ("hold", "stop"):
            getattr(commands, kind)(world, slots, queue=queue)
        elif kind == "attack_unit":
            commands.attack_unit(world, slots, world.tag_of(other % world.top), queue=queue)
        else:
            getattr(commands, kind)(world, slots, point, queue=queue)
        for _ in range(12):
            advance(world)
            assert all_on_their_surface(world)
        assert (world.life[world.live] > 0).all()


@pytest.mark.parametrize("give", [commands.move, commands.attack_move], ids=["move", "attack-move"])
def test_a_crowd_told_to_one_point_settles_without_overlap(field: Any, give: Any) -> None:
    world = field.world
    for name, count in (("Zealot", 8), ("Stalker", 6), ("Zergling", 10)):
        unit = world.catalog.unit(name)
        for place in free_places(world, unit, (8.0, 16.0), count):
            lifecycle.spawn(world, unit, 1, place)
    slots = world.units_of(1).tolist()
    give(world, slots, (24, 16))
    field.play(400)
    assert all(world.orders_of(s) == [] for s in slots)
    assert deepest_overlap(world) < 0.01
    assert np.sqrt(((world.pos[slots] - (24, 16)) ** 2).sum(axis=1)).max() < 5


def test_a_heap_of_created_units_falls_apart(field: Any) -> None:
    world = field.world
    commands.debug_create(world, 73, 1, (16.0, 16.0), 30)
    field.play(200)
    assert deepest_overlap(world) < 0.01
    field.play(10)
    before = world.pos[world.live].copy()
    field.play(10)
    assert (world.pos[world.live] == before).all()


@pytest.mark.parametrize("count", [2, 3, 5, 9])
def test_units_on_one_point_that_walk_apart_are_parted(field: Any, count: int) -> None:
    world = field.world
    slots = commands.debug_create(world, 73, 1, (16.0, 16.0), count)
    for i, slot in enumerate(slots):
        commands.move(world, [slot], (16 + 3 * math.cos(i), 16 + 3 * math.sin(i)))
    field.play(80)
    assert np.isfinite(world.pos[slots]).all()
    assert deepest_overlap(world) < 0.01


def test_bodies_of_different_layers_pass_through_each_other(field: Any) -> None:
    world = field.world
    colossus, zealot = field.put("Colossus", 1, 10, 16), field.put("Zealot", 1, 22, 16)
    commands.move(world, [colossus], (22, 16))
    commands.move(world, [zealot], (10, 16))
    nearest = min(math.dist(world.pos[colossus], world.pos[zealot]) for _ in field.loops(90))
    assert nearest < 0.2
    assert math.dist(world.pos[zealot], (10, 16)) < 0.1


def test_two_that_meet_head_on_walk_around_each_other(field: Any) -> None:
    world = field.world
    a, b = field.put("Zealot", 1, 10, 16), field.put("Zealot", 1, 22, 16)
    commands.move(world, [a], (22, 16))
    commands.move(world, [b], (10, 16))
    field.play(130)
    assert math.dist(world.pos[a], (22, 16)) < 0.1
    assert math.dist(world.pos[b], (10, 16)) < 0.1


def test_a_unit_walks_around_a_line_of_holding_enemies(field: Any) -> None:
    world = field.world
    wall = [field.put("Stalker", 2, 16, 12 + 1.2 * i) for i in range(7)]
    commands.hold(world, wall)
    for slot in wall:
        world.acquires[slot] = False
    walker = field.put("Zealot", 1, 10, 16)
    world.acquires[walker] = False
    commands.move(world, [walker], (22, 16))
    field.play(200)
    assert math.dist(world.pos[walker], (22, 16)) < 0.1


def test_an_idle_friend_steps_aside(field: Any) -> None:
    world = field.world
    idle, walker = field.put("Zealot", 1, 16, 16.05), field.put("Zealot", 1, 10, 16)
    commands.move(world, [walker], (22, 16))
    field.play(110)
    assert math.dist(world.pos[walker], (22, 16)) < 0.1
    assert world.pos[idle, 1] > 16.1


def test_the_way_up_the_ledge_leads_over_a_ramp(make_field: Any) -> None:
    field = make_field("braxis_ledge")
    world = field.world
    zergling = field.put("Zergling", 2, 16, 9)
    commands.move(world, [zergling], (16, 16))
    xs = [float(world.pos[zergling, 0]) for _ in field.loops(200)]
    assert math.dist(world.pos[zergling], (16, 16)) < 0.1
    assert min(xs) < 7 or max(xs) > 25


def test_a_colossus_walks_straight_up_the_ledge(make_field: Any) -> None:
    field = make_field("braxis_ledge")
    world = field.world
    colossus = field.put("Colossus", 1, 16, 9)
    commands.move(world, [colossus], (16, 16))
    field.play(math.ceil(7 / (2.25 / 16)) + 1)
    assert math.dist(world.pos[colossus], (16, 16)) < 0.06


def test_64_zerglings_pass_the_ramps_without_getting_stuck(make_field: Any) -> None:
    field = make_field("braxis_ledge")
    world = field.world
    unit = world.catalog.unit("Zergling")
    for place in free_places(world, unit, (16.0, 9.0), 64):
        lifecycle.spawn(world, unit, 2, place)
    commands.move(world, world.units_of(2).tolist(), (16, 16))
    field.play(450)
    assert (world.pos[world.live, 1] > 12.9).all()
    assert deepest_overlap(world) < 0.05


def test_a_walk_to_a_place_that_can_not_be_reached_ends_as_near_as_it_gets(make_field: Any) -> None:
    field = make_field("braxis_ledge")
    world = field.world
    zergling = field.put("Zergling", 2, 16, 9)
    commands.move(world, [zergling], (16, 2))
    field.play(200)
    assert world.orders_of(zergling) == []
    assert world.pos[zergling, 1] < 6


def test_melee_units_spread_around_their_target(field: Any) -> None:
    world = field.world
    target = field.put("Ultralisk", 2, 20, 16)
    world.acquires[target] = False
    world.life[target] = 1e6
    commands.hold(world, [target])
    unit = world.catalog.unit("Zergling")
    for place in free_places(world, unit, (10.0, 16.0), 12):
        lifecycle.spawn(world, unit, 1, place)
    commands.attack_unit(world, world.units_of(1).tolist(), world.tag_of(target))
    field.play(200)
    assert int(world.in_reach[world.units_of(1)].sum()) >= 9


@pytest.mark.parametrize("name", ["2s3z", "3s5z", "1c3s5z", "3s_vs_5z"])
def test_bodies_hardly_overlap_even_in_battle(name: str) -> None:
    world = new_game(load_map(name), seed=3)
    commands.attack_move(world, world.units_of(1).tolist(), (23, 16))
    deepest = 0.0
    while not world.ended:
        advance(world)
        deepest = max(deepest, deepest_overlap(world))
    assert deepest < 0.15


def test_a_unit_of_less_push_priority_gives_way_further(field: Any) -> None:
    """Of two bodies that stand in each other the wild animal, of priority 5, goes twice as far."""
    world = field.world
    dog, zealot = field.put("Dog", 1, 16, 16), field.put("Zealot", 1, 16.4, 16)
    world.separation[[dog, zealot]] = 0.3
    world.bodies = None
    field.play(30)
    went = 16 - float(world.pos[dog, 0]), float(world.pos[zealot, 0]) - 16.4
    assert sum(went) == pytest.approx(0.2, abs=0.01)
    assert went[0] == pytest.approx(2 * went[1], rel=0.05)
