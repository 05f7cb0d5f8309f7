cimport cython


@cython.final
cdef class Heights:
    cdef object vertices
    cdef tuple size
    cdef const float[:, ::1] corners
    cdef double right
    cdef double top
    @cython.locals(column=Py_ssize_t, row=Py_ssize_t, across=double, up=double, low=double, high=double)
    cpdef double at(self, double x, double y) noexcept
