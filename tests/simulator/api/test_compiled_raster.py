"""The compiled layers of discs are those in numpy, to the byte, one frame after the other."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from khala_simulator import compiled
from khala_simulator.api.raster import DiscLayers, RasterLayer

COLUMNS, ROWS = 21, 13
BITS = (1, 8, 32)
Circle = tuple[float, float, float, int]

centres = st.one_of(st.floats(-15, 40), st.integers(-60, 160).map(lambda quarter: quarter / 4))
circles = st.tuples(centres, centres, st.floats(0, 12), st.integers(-(1 << 31), (1 << 31) - 1) | st.integers(0, 3))
frames = st.lists(st.lists(circles, max_size=9), min_size=1, max_size=4)

built = pytest.mark.skipif(compiled.engine() == "python", reason="the kernels were not built, or not wanted")


@built
@given(frames, st.booleans())
def test_any_discs_are_drawn_the_same_after_any_others(frames: list[list[Circle]], dense: bool) -> None:
    shown = [(row, RasterLayer(row + 1, bits, COLUMNS, ROWS)) for row, bits in enumerate(BITS)]
    density = (RasterLayer(8, 8, COLUMNS, ROWS), RasterLayer(9, 8, COLUMNS, ROWS)) if dense else None
    kernel = compiled.part("raster")
    assert kernel is not None
    layers = [make(shown, density, COLUMNS, ROWS) for make in (DiscLayers, kernel.DiscLayers)]
    for frame in frames:
        table = np.array([circle[:3] for circle in frame], np.float64).reshape(-1, 3)
        x, y, radius = (np.ascontiguousarray(column) for column in table.T)
        value = np.array([circle[3] for circle in frame], np.int32)
        values = np.stack([value, value, np.where(radius > 6, value, 0)]).astype(np.int32)
        one, other = (b"".join(layer.encode(x, y, radius, values)) for layer in layers)
        assert one == other


@built
def test_what_is_no_array_of_discs_is_refused() -> None:
    kernel = compiled.part("raster")
    assert kernel is not None
    layers = kernel.DiscLayers([(0, RasterLayer(1, 8, COLUMNS, ROWS))], None, COLUMNS, ROWS)
    none = np.zeros(2)
    with pytest.raises(ValueError, match="int32"):
        layers.encode(none, none, none, np.zeros((1, 2)))
    with pytest.raises(ValueError, match="float64, one for each value"):
        layers.encode(none, none[:1], none, np.zeros((1, 2), np.int32))
