"""Stages of compiled code, which are linked into entry points, as functions that Python calls."""

from numba import njit


def callable_stage(stage):
    """Return a compiled function that calls a stage and is callable from Python."""

    @njit
    def call(*arguments):
        return stage(*arguments)

    return call
