"""Numbers in arrays, and points, for interpreted rules; `memory.pxd` has the same for compiled ones.

Views give and take Python's own numbers, which are as exact as C's.
"""

from __future__ import annotations

import math
import struct
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Cells = memoryview[Any]
    """The numbers of an array, one after the other: in C a pointer to the first."""


class Point(NamedTuple):
    """A point or a vector, a value: a new one is assigned, never a part of one."""

    x: float
    y: float


class Points:
    """The points of an array (n, 2): one for every slot."""

    __slots__ = ("_cells",)

    def __init__(self, array: NDArray[np.float64]) -> None:
        cells: Any = array.reshape(-1)
        self._cells: Any = memoryview(cells)

    def __getitem__(self, slot: int) -> Point:
        """Return a point."""
        return Point(self._cells[2 * slot], self._cells[2 * slot + 1])

    def __setitem__(self, slot: int, point: Point) -> None:
        """Write a point."""
        self._cells[2 * slot], self._cells[2 * slot + 1] = point.x, point.y


def point(x: float, y: float) -> Point:
    """Return a point."""
    return Point(x, y)


def bools(array: NDArray[np.bool_]) -> Cells:
    """Return the numbers of an array whose memory is contiguous, row by row."""
    return array.reshape(-1).data


def ints(array: NDArray[np.int64]) -> Cells:
    """Return the numbers of an array whose memory is contiguous, row by row."""
    return array.reshape(-1).data


def floats(array: NDArray[np.float64]) -> Cells:
    """Return the numbers of an array whose memory is contiguous, row by row."""
    return array.reshape(-1).data


def uint8s(array: NDArray[np.uint8]) -> Cells:
    """Return the numbers of an array whose memory is contiguous, row by row."""
    return array.reshape(-1).data


def uint16s(array: NDArray[np.uint16]) -> Cells:
    """Return the numbers of an array whose memory is contiguous, row by row."""
    return array.reshape(-1).data


def int16s(array: NDArray[np.int16]) -> Cells:
    """Return the numbers of an array whose memory is contiguous, row by row."""
    return array.reshape(-1).data


def int32s(array: NDArray[np.int32]) -> Cells:
    """Return the numbers of an array whose memory is contiguous, row by row."""
    return array.reshape(-1).data


def float32s(array: NDArray[np.float32]) -> Cells:
    """Return the numbers of an array whose memory is contiguous, row by row; what is written is rounded to 32 bits."""
    return array.reshape(-1).data


def points(array: NDArray[np.float64]) -> Points:
    """Return the points of an array (n, 2) whose memory is contiguous."""
    return Points(array)


def new_bools(n: int) -> NDArray[np.bool_]:
    """Return an array (n,) of False."""
    return np.zeros(n, dtype=np.bool_)


def new_ints(n: int) -> NDArray[np.int64]:
    """Return an array (n,) that is not filled."""
    return np.empty(n, dtype=np.int64)


def new_floats(n: int) -> NDArray[np.float64]:
    """Return an array (n,) that is not filled."""
    return np.empty(n, dtype=np.float64)


def new_uint8s(n: int) -> NDArray[np.uint8]:
    """Return an array (n,) of zeros."""
    return np.zeros(n, dtype=np.uint8)


def new_int32s(n: int) -> NDArray[np.int32]:
    """Return an array (n,) of zeros."""
    return np.zeros(n, dtype=np.int32)


def new_points(n: int) -> NDArray[np.float64]:
    """Return an array (n, 2) that is not filled."""
    return np.empty((n, 2), dtype=np.float64)


def length(x: float, y: float) -> float:
    """Return the length of a vector, rounded as everywhere."""
    return math.sqrt(x * x + y * y)


def distance(x: float, y: float) -> float:
    """Return the length of a vector as numpy's and C's `hypot` round it."""
    return float(np.hypot(x, y))


def single(number: float) -> float:
    """Return a number rounded to 32 bits."""
    return float(np.float32(number))


def pairwise_sum(numbers: Cells, n: int) -> float:
    """Return the sum of the first numbers, added in pairs and rounded as numpy does."""
    return float(np.asarray(numbers[:n]).sum())


def put_float32(to: Cells, at: int, number: float) -> None:
    """Write a number into the four bytes from an index on, as a float of 32 bits."""
    struct.pack_into("<f", to, at, number)


def fill(cells: Cells, start: int, n: int, value: int) -> None:
    """Write a value to some bytes."""
    cells[start : start + n] = bytes([value]) * n


def repeat(cells: Cells, start: int, n: int, at: int) -> None:
    """Write some bytes again from another index on."""
    cells[at : at + n] = cells[start : start + n]


def put_bytes(to: Cells, at: int, cells: Cells, n: int) -> None:
    """Write the first bytes of others into those from an index on."""
    to[at : at + n] = cells[:n]
