"""Bodies as a user would pose them, and rows of what is found and expected."""

from typing import NamedTuple

import numpy as np
import pytest

from polycorner import simulate
from polycorner.bodies import HalfSpace, polygon, polytope

G = 9.81
FLOOR = {"floor": HalfSpace([0, 1], [0, 0])}
TABLE = {"floor": HalfSpace([0, 0, 1], [0, 0, 0])}


class Row(NamedTuple):
    """What was asked, found and expected."""

    asked: str
    found: object
    expected: object
    tolerance: float = 0.0


def brick(a, b, r=0.02):
    return polygon([[-a, -b], [a, -b], [a, b], [-a, b]], r)


def cube(a=0.5, r=0.02):
    return polytope([[x, y, z] for x in (-a, a) for y in (-a, a) for z in (-a, a)], r)


def moved(arrangement, q, seconds, *, moving=None, dt=1e-3, **laws):
    """Return the motion from a placement."""
    system = arrangement.system(**laws)
    v = None if moving is None else arrangement.velocity(q, moving)
    return simulate(system, system.state(q, v), seconds, dt)


def stays(arrangement, q, **laws):
    """Return whether nothing moves in three tenths of a second."""
    path = moved(arrangement, q, 0.3, **laws)
    return bool(np.abs(path.q[-1] - q).max() < 1e-8)


def check(problem, subtests):
    """Assert every row of a problem."""
    for row in problem():
        with subtests.test(row.asked):
            if row.tolerance:
                assert row.found == pytest.approx(row.expected, abs=row.tolerance)
            else:
                assert row.found == row.expected
