"""Flanking, compiled; `systems.flanking` has the rules."""
from khala_simulator.native.columns cimport Columns

cdef lead(object world, Columns c)
