"""Models for other finite-element programs."""
