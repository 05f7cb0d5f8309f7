from khala_simulator.native cimport memory
from khala_simulator.native.memory cimport Point

cdef Point turned(Point now, Point wanted, double cosine, double sine) noexcept
