"""The surfaces of `movement.pathfinding` as compiled systems read them."""
cimport numpy as cnp
from libc.stdint cimport int64_t

from khala_simulator.native.memory cimport Point, boolean

import numpy as np

from khala_simulator.movement import pathfinding
from khala_simulator.tables.layers import Layer

cnp.import_array()


cdef class Grid:
    def __init__(self, surface):
        """Read a surface, which does not change."""
        self.surface = surface
        self.height, self.width = surface.free.shape
        self.shift = surface.shift
        bools = [surface.flat, surface.open, surface.spiked, *(cells for _, cells in surface.spikes)]
        self.arrays = (
            *(np.ascontiguousarray(cells, dtype=np.bool_) for cells in bools),
            np.ascontiguousarray(surface.walls_low),
            np.ascontiguousarray(surface.walls_high),
            np.ascontiguousarray(surface.sums),
            np.ascontiguousarray(surface.part),
            np.array(surface.steps, dtype=np.uint8),
        )
        self.flat, self.open, self.spiked = (
            <boolean*>start(self.arrays[0]), <boolean*>start(self.arrays[1]), <boolean*>start(self.arrays[2])
        )
        cdef int i
        for i in range(4):
            self.spikes[i] = <boolean*>start(self.arrays[3 + i])
            self.corners[i].x, self.corners[i].y = surface.spikes[i][0]
        self.walls_low, self.walls_high = <Point*>start(self.arrays[7]), <Point*>start(self.arrays[8])
        self.sums, self.part = <int64_t*>start(self.arrays[9]), <int64_t*>start(self.arrays[10])
        self.steps = <boolean*>start(self.arrays[11])
        self.fields, self.fields_kept = {}, surface.fields_kept

    def __reduce__(self):
        """Return what makes None: a copy of a surface is read anew."""
        return type(None), ()


cdef void* start(object array):
    """Return where an array begins."""
    return cnp.PyArray_DATA(<cnp.ndarray>array)


cdef Grid read(object surface):
    """Return a surface as it is read here."""
    if surface.native is None:
        surface.native = Grid(surface)
    return <Grid>surface.native


cdef Grid bound(object ground, int64_t layer):
    cdef Grid grid = read(pathfinding.surface(ground, Layer(layer)))
    (<list>ground.native)[layer] = grid
    return grid
