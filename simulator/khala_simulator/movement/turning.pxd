from khala_simulator.native cimport memory
from khala_simulator.native.memory cimport Point

cdef Point turn(Point now, Point wanted, double cosine, double sine) noexcept
