"""Write how compiled code reaches the world's columns: ``python -m khala_simulator.compiled.declare``.

``columns.pxd`` and ``columns.pyx`` follow from ``world.columns``. A test fails while they do not.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np

from khala_simulator.world.columns import COLUMNS, Column

HERE: Final = Path(__file__).parent
C_TYPES: Final = {np.bool_: "boolean", np.int64: "int64_t", np.float64: "double"}
DECLARATION: Final = '''\
# Written by khala_simulator.compiled.declare from world.columns.
"""The world's columns as pointers, for compiled systems."""
from libc.stdint cimport int64_t, uint8_t

ctypedef uint8_t boolean

cdef struct Point:
    double x
    double y

cdef class Columns:
    """One world's columns; they hold until it grows."""

    cdef tuple arrays  # keeps the memory alive
    cdef Py_ssize_t capacity
    cdef boolean* visible  # (players, capacity)
{pointers}

cdef Columns bound(object world)

cdef inline Columns columns_of(object world):
    """Return the columns of a world, bound now if its arrays are new."""
    native = world.native
    return bound(world) if native is None else <Columns>native
'''
DEFINITION: Final = '''\
# Written by khala_simulator.compiled.declare from world.columns.
"""The world's columns as pointers, for compiled systems."""
cimport numpy as cnp
from libc.string cimport memcpy

from khala_simulator.world.columns import COLUMNS

cnp.import_array()


cdef class Columns:
    def __reduce__(self):
        """Return what makes None: a copy of a world binds its own arrays."""
        return type(None), ()

    def clear(self, Py_ssize_t slot):
        """Make a slot unused."""
        cdef Py_ssize_t i, size
        cdef cnp.ndarray column, empty
        for i in range(len(NAMES)):
            column, empty = self.arrays[i + 1], EMPTY[i]
            size = cnp.PyArray_STRIDE(column, 0)
            memcpy(<char*>cnp.PyArray_DATA(column) + slot * size, cnp.PyArray_DATA(empty), size)


cdef tuple NAMES = (
{names}
)
cdef tuple EMPTY = tuple(COLUMNS[name].make(1) for name in NAMES)


cdef Columns bound(object world):
    cdef Columns c = Columns.__new__(Columns)
    cdef tuple arrays = (world.visible, *[getattr(world, name) for name in NAMES])
    for array in arrays:
        if not cnp.PyArray_ISCARRAY(<cnp.ndarray>array):
            raise ValueError("a column must be contiguous and writable")
    c.capacity = world.capacity
    c.visible = <boolean*>cnp.PyArray_DATA(<cnp.ndarray>arrays[0])
{bindings}
    c.arrays = arrays
    world.native = c
    return c
'''


def c_type(column: Column) -> str:
    """Return the type of a column's rows in C."""
    return "Point" if column.width else C_TYPES[column.dtype]


def declared() -> dict[str, str]:
    """Return the text of every file that follows from the columns."""
    types = {name: c_type(column) for name, column in COLUMNS.items()}
    pointers = "\n".join(f"    cdef {kind}* {name}" for name, kind in types.items())
    bindings = "\n".join(
        f"    c.{name} = <{kind}*>cnp.PyArray_DATA(<cnp.ndarray>arrays[{index}])"
        for index, (name, kind) in enumerate(types.items(), start=1)
    )
    names = "\n".join(f'    "{name}",' for name in types)
    return {
        "columns.pxd": DECLARATION.format(pointers=pointers),
        "columns.pyx": DEFINITION.format(names=names, bindings=bindings),
    }


if __name__ == "__main__":
    for file, text in declared().items():
        (HERE / file).write_text(text, encoding="utf-8")
