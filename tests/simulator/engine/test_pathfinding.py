from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from khala_simulator.maps.game_map import load_map
from khala_simulator.movement import pathfinding, ways
from khala_simulator.movement.pathfinding import NEIGHBOURS, Surface
from khala_simulator.tables.layers import Layer
from khala_simulator.world.ground import BuiltGround

ROOM = """
..........
.########.
.#......#.
.#.####.#.
.#.#..#.#.
.#.#....#.
.#.######.
.#........
.########.
..........
"""


def surface(drawing: str) -> Surface:
    lines = drawing.strip().splitlines()[::-1]
    return Surface(np.array([[c == "." for c in line] for line in lines]))


def at(x: float, y: float) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    return np.array([x, y], dtype=np.float64)


def test_the_way_through_a_spiral_is_found() -> None:
    room = surface(ROOM)
    assert 20 < ways.distance(room, at(5.0, 5.5), at(9.5, 2.5)) < 26


def test_a_straight_way_is_as_long_as_the_line_and_a_crooked_one_longer() -> None:
    room = surface(ROOM)
    assert ways.distance(room, at(0.5, 0.5), at(9.5, 0.5)) == pytest.approx(9.0)
    assert ways.distance(room, at(4.5, 5.5), at(4.5, 0.5)) > 12


def test_what_is_cut_off_has_no_way() -> None:
    divided = surface("...#...\n...#...\n...#...")
    assert ways.distance(divided, at(0.5, 0.5), at(6.5, 0.5)) == 0
    assert ways.distance(divided, at(0.5, 0.5), at(3.5, 0.5)) == 0
    assert set(divided.part.tolist()) == {-1, 0, 1}


def test_a_line_does_not_pass_between_two_cells_that_touch_at_a_corner() -> None:
    pinched = surface("..#\n.#.\n#..")
    assert ways.distance(pinched, at(0.5, 1.5), at(2.5, 1.5)) == 0
    assert pinched.part.reshape(3, 3)[2, 0] != pinched.part.reshape(3, 3)[0, 2]


def test_structures_close_the_ground_and_open_it_again() -> None:
    terrain = load_map("llm_smac/3s_vs_3z").terrain
    ground = BuiltGround(terrain)
    bare = pathfinding.surface(ground, Layer.WALK)
    wall = np.array([(16, y) for y in range(-2, 40)])
    ground.block(7, wall)
    assert ways.distance(pathfinding.surface(ground, Layer.WALK), at(5, 5), at(25, 5)) == 0
    assert ways.distance(pathfinding.surface(ground, Layer.GLIDE), at(5, 5), at(25, 5)) == 0
    assert ways.distance(pathfinding.surface(ground, Layer.AIR), at(5, 5), at(25, 5)) == 20
    assert not ground.walk[5, 16]
    ground.unblock(7)
    assert pathfinding.surface(ground, Layer.WALK) is bare
    assert terrain.walk.all()


def test_games_on_one_terrain_share_what_was_found() -> None:
    terrain = load_map("llm_smac/2c_vs_64zg").terrain
    assert pathfinding.surface(BuiltGround(terrain), Layer.WALK) is pathfinding.surface(
        BuiltGround(terrain), Layer.WALK
    )


@settings(max_examples=60)
@given(x=st.floats(0.5, 31.5), y=st.floats(0.5, 31.5), to_x=st.floats(0.5, 31.5), to_y=st.floats(0.5, 31.5))
def test_distances_on_the_ledge_are_symmetric_and_no_shorter_than_the_line(
    x: float, y: float, to_x: float, to_y: float
) -> None:
    ledge = pathfinding.surface(BuiltGround(load_map("llm_smac/2c_vs_64zg").terrain), Layer.WALK)
    a, b = at(x, y), at(to_x, to_y)
    there = ways.distance(ledge, a, b)
    back = ways.distance(ledge, b, a)
    if there == 0 or back == 0:
        assert there == back or math.dist(a, b) == 0
        return
    assert there == pytest.approx(back, abs=1.5)  # ways count from cell to cell
    assert there >= math.dist(a, b) - 1.5


def shortest(grid: np.ndarray[tuple[int, int], np.dtype[np.bool_]], goal: int) -> list[float]:
    """Return the distance of every cell from a goal, by relaxing all steps until nothing changes."""
    height, width = grid.shape
    far = [math.inf] * grid.size
    far[goal], changed = 0.0, True
    while changed:
        changed = False
        for y, x in np.argwhere(grid).tolist():
            for dx, dy in NEIGHBOURS:
                px, py = x + dx, y + dy
                if 0 <= px < width and 0 <= py < height and grid[py, px] and grid[py, x] and grid[y, px]:
                    over = far[py * width + px] + math.hypot(dx, dy)
                    if over < far[y * width + x] - 1e-9:
                        far[y * width + x], changed = over, True
    return far


@settings(max_examples=40)
@given(seed=st.integers(0, 10_000), width=st.integers(2, 9), height=st.integers(2, 9))
def test_ways_that_are_found_are_the_shortest_ones(seed: int, width: int, height: int) -> None:
    rng = np.random.default_rng(seed)
    grid = rng.random((height, width)) > 0.3
    found = Surface(grid)
    cells = rng.permutation(np.flatnonzero(grid))
    if not len(cells):
        return
    goal = int(cells[0])
    far = shortest(grid, goal)
    for cell in cells.tolist():
        assert (found.part[cell] == found.part[goal]) == math.isfinite(far[cell])
        if not math.isfinite(far[cell]):
            continue
        start = found.centre(np.array(cell))
        end = found.centre(np.array(goal))
        straight = math.dist(start, end)
        walked = ways.distance(found, start, end)
        assert straight <= far[cell] + 1e-9
        assert walked == pytest.approx(far[cell]) or walked == pytest.approx(straight)


def test_parts_are_numbered_from_the_lower_left_row_by_row() -> None:
    islands = surface("..#..\n#####\n..#..\n#.#.#")
    assert [int(islands.part[islands.cell(at(x, y))]) for x, y in ((1, 0), (3, 0), (0, 3), (4, 3))] == [0, 1, 2, 3]
    assert int(surface("###\n###").part.max()) == -1
