cdef class BuiltGround:
    cdef readonly object terrain
    cdef readonly object walk
    cdef readonly dict blocked
    cdef readonly dict surfaces
    cdef readonly list grids

    cdef _forget_surfaces(self)
