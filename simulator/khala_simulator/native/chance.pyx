"""Draws from a world's random generator, for compiled rules; a call of `random` takes as long as many a rule."""
from cpython.pycapsule cimport PyCapsule_GetPointer
from numpy.random cimport bitgen_t


cdef double draw(object rng) except? -1.0:
    cdef bitgen_t* bits = <bitgen_t*>PyCapsule_GetPointer(rng.bit_generator.capsule, "BitGenerator")
    return bits.next_double(bits.state)
