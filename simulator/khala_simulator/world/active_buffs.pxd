cdef class ActiveBuffs:
    cdef object _rows
    cdef dict _first
    cdef double _quiet_until

    cpdef bint any_due(self, double loop)
