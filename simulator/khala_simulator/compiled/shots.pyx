"""The rows of the tables in `world.shots`."""
cimport numpy as cnp
from libc.string cimport memcpy

from khala_simulator.compiled.numbers cimport count

import numpy as np

from khala_simulator.world import shots as rows

cnp.import_array()

if (rows.Missiles.dtype.itemsize, rows.PendingHits.dtype.itemsize) != (sizeof(Missile), sizeof(PendingHit)):
    raise ImportError("compiled/shots.pxd does not fit world/shots.py: declare the same fields, and build again")

cdef object empty = np.empty
cdef object as_shot = rows.Shot._make


cdef object as_tuple(Shot* shot):
    """Return a shot as the Python rules have it."""
    return as_shot((
        shot.source, shot.owner, shot.target, shot.prior, shot.weapon, shot.hit,
        (shot.start.x, shot.start.y), (shot.goal.x, shot.goal.y),
    ))


cdef Shot from_tuple(object shot):
    """Return a shot of the Python rules as a row."""
    cdef Shot row
    row.source, row.owner, row.target, row.prior, row.weapon, row.hit, start, goal = shot
    row.start.x, row.start.y = start
    row.goal.x, row.goal.y = goal
    return row


cdef object emptied(object table, Py_ssize_t rows):
    """Give a table new rows to be filled, and return the old ones."""
    old = table.rows
    table.rows = empty(rows, old.dtype)
    return old


cdef append(object table, void* rows, Py_ssize_t more):
    """Add rows, which are as the table's own, to a table."""
    old = emptied(table, len(table) + more)
    new = table.rows
    cdef size_t size = (<cnp.ndarray>old).dtype.itemsize, before = size * count(old)
    memcpy(cnp.PyArray_DATA(<cnp.ndarray>new), cnp.PyArray_DATA(<cnp.ndarray>old), before)
    memcpy(<char*>cnp.PyArray_DATA(<cnp.ndarray>new) + before, rows, size * more)
