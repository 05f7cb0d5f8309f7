"""Turning of one direction towards another; `geometry` says why directions are vectors."""

from __future__ import annotations

from khala_simulator.native import memory


def turn(now: memory.Point, wanted: memory.Point, cosine: float, sine: float) -> memory.Point:
    """Return a direction after a turn towards another one by at most the angle of this cosine and sine.

    What is within the angle is reached exactly; straight backwards turns left. A wanted vector of length zero turns
    nothing.
    """
    if wanted.x == 0.0 and wanted.y == 0.0:
        return now
    if now.x * wanted.x + now.y * wanted.y >= cosine:
        return wanted
    if not now.x * wanted.y - now.y * wanted.x >= 0.0:
        sine = -sine
    x = now.x * cosine - now.y * sine
    y = now.x * sine + now.y * cosine
    size = memory.length(x, y)
    return memory.point(x / size, y / size)
