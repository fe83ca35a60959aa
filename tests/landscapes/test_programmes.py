"""Linear programmes in exact numbers, against all vertices of what they are about."""

from fractions import Fraction
from itertools import combinations

import flint
import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from polycorner.landscapes.programmes import ExactProgrammes

N, SIDE = 3, 2


def vertices(functions):
    """Points where ``N`` independent functions vanish and no other one is negative."""
    found = set()
    for some in combinations(functions, N):
        left = flint.fmpq_mat([[flint.fmpq(*x.as_integer_ratio()) for x in f[1:]] for f in some])
        right = flint.fmpq_mat([[-flint.fmpq(*f[0].as_integer_ratio())] for f in some])
        if left.det() != 0:
            q = [Fraction(int(x.p), int(x.q)) for x in left.solve(right).entries()]
            if all(at(f, q) >= 0 for f in functions):
                found.add(tuple(q))
    return found


def at(f, q):
    return f[0] + sum(a * x for a, x in zip(f[1:], q, strict=True))


NUMBERS = st.one_of(st.integers(-3, 3), st.sampled_from([0.1, -0.7, 1 / 3])).map(Fraction)
FUNCTION = st.lists(NUMBERS, min_size=N + 1, max_size=N + 1)


@given(st.lists(FUNCTION, min_size=1, max_size=5), FUNCTION, st.integers(0, 5))
def test_least_values_are_those_of_vertices(functions, energy, first):
    """Functions that are held later lead to the same least value, at a point that has it."""
    box = np.array([[Fraction(-SIDE), Fraction(SIDE)]] * N, dtype=object)
    some = ExactProgrammes(np.array(functions, dtype=object), np.array(energy, dtype=object), box)
    sides = [
        [Fraction(SIDE), *(Fraction(s * (i == k)) for i in range(N))]
        for k in range(N)
        for s in (1, -1)
    ]
    corners = vertices([*functions, *sides])
    found = some.start.holding(range(min(first, len(functions))))
    found = found and found.holding(range(len(functions)))
    assert (found is None) == (not corners)
    if found is not None:
        values = {q: at(energy, q) for q in corners}
        least = min(values.values())
        assert some.value(found) == least == at(energy, some.point(found))
        assert all(at(f, some.point(found)) >= 0 for f in [*functions, *sides])
        assert some.isolated(found) == (list(values.values()).count(least) == 1)


def test_beales_example():
    """Dantzig's rule turns in circles on it; its least value is published as ``-1/20``."""
    rows = [
        ["0", "-1/4", "60", "1/25", "-9"],
        ["0", "-1/2", "90", "1/50", "-3"],
        ["1", "0", "0", "-1", "0"],
    ]
    energy = ["0", "-3/4", "150", "-1/50", "6"]
    exact = [[Fraction(x) for x in row] for row in [*rows, energy]]
    box = np.array([[Fraction(0), Fraction(10)]] * 4, dtype=object)
    some = ExactProgrammes(
        np.array(exact[:-1], dtype=object), np.array(exact[-1], dtype=object), box
    )
    found = some.start.holding(range(3))
    assert found is not None
    assert some.value(found) == Fraction(-1, 20) == at(exact[-1], some.point(found))
