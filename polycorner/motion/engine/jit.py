"""Compilation options, and integers of NumPy's type, for all stages of the engine."""

import numpy as np
from numba import njit

# Without reference counts, which would cost more than the arithmetic: all arrays are allocated by
# the caller.
compiled = njit(
    no_cpython_wrapper=True,
    no_cfunc_wrapper=True,
    error_model="numpy",
    _nrt=False,
    forceinline=False,
)

# Force-inlined into the caller: passing some 140 arrays costs more than a small routine.
inlined = njit(
    no_cpython_wrapper=True,
    no_cfunc_wrapper=True,
    error_model="numpy",
    _nrt=False,
    forceinline=True,
)

# For integers of Python's own type, Numba compiles a version of a function for each value.
NONE, ZERO, ONE, TWO = np.int64(-1), np.int64(0), np.int64(1), np.int64(2)
