"""Turning, as `numeric.geometry.turn_towards` has it."""
from khala_simulator.compiled.columns cimport Point
from khala_simulator.compiled.numbers cimport length

cdef inline Point turned(Point now, Point wanted, double cosine, double sine) noexcept nogil:
    """Return a direction after a turn towards another one by at most the angle of this cosine and sine."""
    cdef Point to
    cdef double size
    if wanted.x == 0.0 and wanted.y == 0.0:
        return now
    if now.x * wanted.x + now.y * wanted.y >= cosine:
        return wanted
    if not now.x * wanted.y - now.y * wanted.x >= 0.0:
        sine = -sine
    to.x = now.x * cosine - now.y * sine
    to.y = now.x * sine + now.y * cosine
    size = length(to.x, to.y)
    to.x, to.y = to.x / size, to.y / size
    return to
