"""Many units through narrow places: how long they take, that they come to rest, and that the ground may change."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from khala_simulator.abilities import commands
from khala_simulator.combat import lifecycle
from khala_simulator.movement import pathfinding, ways
from khala_simulator.movement.placement import free_places
from khala_simulator.tables.layers import Layer

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_simulator.world.world import World

WALL_X, WALL_Y = 48, 24
NOBODY_S_SLOT = 9999
BASE, OUTSIDE = (25.5, 57.5), (52.5, 56.5)  # on Simple64, with a cliff between them and a ramp to the north


def wall(world: World, gap: int) -> None:
    """Close the plain from north to south but for ``gap`` cells."""
    cells = [
        (x, y)
        for y in range(world.map.terrain.size[1])
        for x in (WALL_X, WALL_X + 1)
        if not WALL_Y - gap / 2 <= y < WALL_Y + gap / 2
    ]
    world.ground.block(NOBODY_S_SLOT, np.array(cells))


def crowd(world: World, name: str, count: int, at: tuple[float, float]) -> np.ndarray[Any, np.dtype[np.int64]]:
    kind = world.catalog.unit(name)
    return np.array([lifecycle.spawn(world, kind, 1, place) for place in free_places(world, kind, at, count)])


def loops_until(field: Any, done: Callable[[], Any], limit: int) -> int:
    began = field.world.loop
    while not done():
        field.play(1)
        assert field.world.loop - began < limit, "they are stuck"
    return int(field.world.loop - began)


@pytest.mark.parametrize(
    ("name", "count", "gap"),
    [
        ("Zergling", 100, 2),
        pytest.param("Marine", 100, 2, marks=pytest.mark.slow),
        pytest.param("Stalker", 100, 2, marks=pytest.mark.slow),
        ("Immortal", 40, 2),
        pytest.param("Zergling", 100, 4, marks=pytest.mark.slow),
    ],
)
def test_a_crowd_passes_a_choke_nearly_as_fast_as_it_fits(
    make_field: Callable[..., Any], name: str, count: int, gap: int
) -> None:
    """The least time is that of the last one of a column that fills the gap in as many files as fit side by side."""
    field = make_field("debug_plain")
    world = field.world
    wall(world, gap)
    kind = world.catalog.unit(name)
    slots = crowd(world, name, count, (WALL_X - 12.0, WALL_Y))
    commands.move(world, slots.tolist(), (WALL_X + 30.0, WALL_Y))
    speed, width = kind.speed_n / 16, 2 * kind.separation
    files = max(int(gap / width), 1)
    least = 12 / speed + count / files * width / speed
    assert loops_until(field, lambda: world.pos[slots, 0].min() > WALL_X + 2, 3000) < 1.35 * least
    loops_until(field, lambda: world.order_kind[slots].max() == 0, 3000)
    before = world.pos[slots].copy()
    field.play(60)
    assert np.abs(world.pos[slots] - before).max() < 0.1, "they are at rest"


def test_100_units_pass_the_ramp_of_a_base(make_field: Callable[..., Any]) -> None:
    field = make_field("simple64")
    world = field.world
    slots = crowd(world, "Zergling", 100, BASE)
    way = ways.distance(pathfinding.surface(world.ground, Layer.WALK), np.array(BASE), np.array(OUTSIDE))
    commands.move(world, slots.tolist(), OUTSIDE)
    alone = way / (world.catalog.unit("Zergling").speed_n / 16)
    near = loops_until(field, lambda: np.hypot(*(world.pos[slots] - OUTSIDE).T).max() < 9, 2000)
    kind = world.catalog.unit("Zergling")
    in_file = 100 * 2 * kind.separation / (kind.speed_n / 16)
    assert near < alone + 0.7 * in_file, "they do not queue one behind the other"


def test_a_walk_is_as_long_as_the_distance_that_is_told(make_field: Callable[..., Any]) -> None:
    field = make_field("simple64")
    world = field.world
    marine = field.put("Marine", 1, *BASE)
    told = ways.distance(pathfinding.surface(world.ground, Layer.WALK), np.array(BASE), np.array(OUTSIDE))
    assert told > 1.2 * math.dist(BASE, OUTSIDE), "there is something to walk around"
    commands.move(world, [marine], OUTSIDE)
    walked = 0.0
    while world.order_kind[marine]:
        before = world.pos[marine].copy()
        field.play(1)
        walked += math.dist(before, world.pos[marine])
    # the distance goes from cell to cell in eight directions, which is up to 8 % more than the way cut short
    assert 0.9 * told < walked < 1.02 * told


def test_walkers_go_another_way_when_theirs_is_closed_and_straight_when_it_opens(
    make_field: Callable[..., Any],
) -> None:
    field = make_field("debug_plain")
    world = field.world
    slots = crowd(world, "Marine", 20, (WALL_X - 15.0, 40.0))
    commands.move(world, slots.tolist(), (WALL_X + 15.0, 40.0))
    field.play(20)
    cells = np.array([(x, y) for x in (WALL_X, WALL_X + 1) for y in range(38, 59)])
    world.ground.block(NOBODY_S_SLOT, cells)
    aside = 0.0
    for _ in field.loops(150):
        aside = max(aside, float(np.abs(world.pos[slots, 1] - 48).max()))
        inside = (np.floor(world.pos[slots, 0]) // 2 == WALL_X // 2) & (np.abs(world.pos[slots, 1] - 48.5) < 10.5)
        assert not inside.any()
    assert aside > 10
    world.ground.unblock(NOBODY_S_SLOT)
    loops_until(field, lambda: world.order_kind[slots].max() == 0, 600)
    assert np.hypot(*(world.pos[slots] - (WALL_X + 15.0, 40.0)).T).max() < 4
