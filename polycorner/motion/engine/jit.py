"""Compilation options, and integers of NumPy's type, for all stages of the engine."""

import numpy as np

from polycorner.formulas.linking import linked

# Without reference counts, which would cost more than the arithmetic: all arrays are allocated by
# the caller.
compiled = linked(error_model="numpy", _nrt=False)

# For integers of Python's own type, Numba compiles a version of a function for each value.
NONE, ZERO, ONE, TWO = np.int64(-1), np.int64(0), np.int64(1), np.int64(2)
