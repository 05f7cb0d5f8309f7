"""Draws from a world's random generator, for compiled rules."""

cdef double draw(object rng) except? -1.0
