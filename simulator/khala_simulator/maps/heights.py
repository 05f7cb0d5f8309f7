"""The height of the ground under any point, between those at the corners of its cell."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from khala_simulator.numeric.geometry import Floats


class Heights:
    """The heights of one map."""

    def __init__(self, vertices: NDArray[np.float32], size: tuple[int, int]) -> None:
        """Take the z at all corners of cells, (h + 1, w + 1), of a map of this width and height."""
        self.vertices = vertices
        self.size = size
        self.corners = vertices.data
        self.right = size[0] - 1e-6
        self.top = size[1] - 1e-6

    def __reduce__(self) -> tuple[type[Heights], tuple[NDArray[np.float32], tuple[int, int]]]:
        """Return what makes a copy."""
        return Heights, (self.vertices, self.size)

    def at(self, x: float, y: float) -> float:
        """Return the height under a world point; beyond the map that of its edge goes on."""
        x = min(max(0.0, x), self.right)
        y = min(max(0.0, y), self.top)
        column = int(x)
        row = int(y)
        across = x - column
        up = y - row
        low = self.corners[row, column] * (1.0 - across) + self.corners[row, column + 1] * across
        high = self.corners[row + 1, column] * (1.0 - across) + self.corners[row + 1, column + 1] * across
        return low * (1.0 - up) + high * up

    def under(self, points: Floats) -> Floats:
        """Return the heights under world points (..., 2)."""
        found = [self.at(x, y) for x, y in points.reshape(-1, 2).tolist()]
        return np.array(found, dtype=np.float64).reshape(points.shape[:-1])
