"""Write how compiled rules reach the columns of a world: ``columns.pxd`` and ``columns.pyx``, from ``world.columns``.

The build calls it; the two files are not kept.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np

from khala_simulator.world.columns import COLUMNS, ColumnSpec

HERE: Final = Path(__file__).parent
C_TYPES: Final = {np.bool_: "boolean", np.int64: "int64_t", np.float64: "double"}
DECLARATION: Final = '''\
# Written by khala_simulator.native.declare from world.columns.
"""The columns of a world as pointers, for compiled rules; `columns.py` has them for interpreted ones."""
from libc.stdint cimport int64_t

from khala_simulator.native.memory cimport Point, boolean
from khala_simulator.world.fields cimport WorldFields

cdef class Columns:
    """One world's columns; they hold until it grows."""

    cdef tuple arrays  # keeps the memory alive
    cdef Py_ssize_t capacity
    cdef boolean* visible  # (players, capacity)
{pointers}

cdef Columns bind(WorldFields world)

cdef inline Columns columns_of(WorldFields world):
    return bind(world) if world.native is None else <Columns>world.native
'''
DEFINITION: Final = '''\
# Written by khala_simulator.native.declare from world.columns.
"""The columns of a world as pointers, for compiled rules."""
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


cdef Columns bind(WorldFields world):
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


def c_type(column: ColumnSpec) -> str:
    """Return the type of a column's rows in C."""
    return "Point" if column.width else C_TYPES[column.dtype]


def declarations() -> dict[str, str]:
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


def write() -> None:
    """Write the files that are missing or stale."""
    for name, text in declarations().items():
        file = HERE / name
        if not file.exists() or file.read_text(encoding="utf-8") != text:
            file.write_text(text, encoding="utf-8")
