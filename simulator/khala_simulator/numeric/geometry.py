"""Plane geometry of the rules: distances, directions and turning, on arrays.

Directions are unit vectors, not angles: square roots round the same way on every processor, sines need not, and a
world must be the same everywhere. Angles appear only where the API wants them.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def length(vector: Floats) -> Floats:
    """Return the Euclidean length of each row of ``vector`` (..., 2)."""
    squared = vector * vector
    result: Floats = np.sqrt(squared[..., 0] + squared[..., 1])
    return result


def heading(angle: float) -> tuple[float, float]:
    """Return the unit vector of an API facing (radians, 0 is east, counter-clockwise)."""
    return math.cos(angle), math.sin(angle)


def facing(vector: Floats) -> Floats:
    """Return the API facing of unit vectors (..., 2), in [0, 2 pi)."""
    result: Floats = np.arctan2(vector[..., 1], vector[..., 0]) % (2.0 * math.pi)
    return result


def turn_towards(current: Floats, wanted: Floats, cos_step: Floats, sin_step: Floats) -> Floats:
    """Turn unit vectors (n, 2) towards ``wanted`` by at most the angle whose cosine and sine are given (n,).

    Where the wanted direction is within the step it is reached exactly; straight backwards turns left. A wanted
    vector of length zero turns nothing.
    """
    cx, cy = current[:, 0], current[:, 1]
    wx, wy = wanted[:, 0], wanted[:, 1]
    cos_error = cx * wx + cy * wy
    reached = cos_error >= cos_step
    zero = wanted == 0.0
    if np.count_nonzero(zero) and np.count_nonzero(nowhere := zero[:, 0] & zero[:, 1]):
        wanted = np.where(nowhere[:, None], current, wanted)
        reached |= nowhere
    if np.count_nonzero(reached) == len(reached):
        return wanted
    sine = np.where(cx * wy - cy * wx >= 0.0, sin_step, -sin_step)
    turned = np.empty_like(current)
    turned[:, 0] = cx * cos_step - cy * sine
    turned[:, 1] = cx * sine + cy * cos_step
    turned /= length(turned)[:, None]
    turned[reached] = wanted[reached]
    return turned


def disc_cells(radius: float) -> NDArray[np.int64]:
    """Return the offsets ``(dx, dy)`` (k, 2) of the cells whose centre is within ``radius`` of a cell's centre."""
    reach = int(radius) + 1
    side = np.arange(-reach, reach + 1)
    dx, dy = np.meshgrid(side, side)
    inside = dx * dx + dy * dy <= radius * radius
    return np.stack([dx[inside], dy[inside]], axis=1)
