"""Sweeps, for the hits that begin them."""
from khala_simulator.compiled.shots cimport Shot

cdef begin(object world, Shot* shot, double begun)
