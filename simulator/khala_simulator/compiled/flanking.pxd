"""Flanking, compiled; `systems.flanking` has the rules."""
from khala_simulator.compiled.columns cimport Columns

cdef lead(object world, Columns c)
