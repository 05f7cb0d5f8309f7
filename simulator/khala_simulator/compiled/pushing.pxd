"""How bodies push each other apart, compiled; `systems.collision` has the rules."""
from libc.stdint cimport int64_t

from khala_simulator.native.columns cimport Columns
from khala_simulator.compiled.contacts cimport Crowd

cdef bint push_apart(Crowd crowd, Columns c, int64_t* slots) except -1
