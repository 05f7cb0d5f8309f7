"""Missiles, for the hits that send them."""
from khala_simulator.compiled.shots cimport Shot
from khala_simulator.compiled.tables cimport Hit

cdef launch(object world, Shot* shot, Hit* hit)
