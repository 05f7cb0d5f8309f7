from __future__ import annotations

import numpy as np

from khala_bridge.state.grid import NO_GRID, Grid


def test_a_bit_grid_is_read_from_the_bottom_left_with_the_highest_bit_first() -> None:
    found = Grid(4, 4, 1, bytes([0b10000100, 0b00010001])).cells()
    assert found is not None
    assert [tuple(cell) for cell in np.argwhere(found).tolist()] == [(0, 0), (1, 1), (3, 2), (3, 3)]


def test_a_byte_grid_is_indexed_by_x_and_then_y() -> None:
    found = Grid(3, 2, 8, bytes([0, 1, 2, 10, 11, 12])).cells()
    assert found is not None
    assert found.shape == (3, 2)
    assert found[2, 1] == 12


def test_a_grid_that_was_not_sent_has_no_cells() -> None:
    assert NO_GRID.cells() is None
