"""Points beside a degenerate corner, within the tolerance: the corner's verdict, or none."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from normal_forms import HALF, QUADRANT, posed

from polycorner import Manifold, Polyhedron, Verdict, certify

MINIMA = {Verdict.WEAK_MINIMUM, Verdict.STRICT_MINIMUM, Verdict.MINIMUM_ALONG_LOCUS}
FEW = settings(max_examples=3)
offsets = st.floats(-13, -9.3).map(lambda power: 10.0**power)
seeds = st.integers(0, 2**32 - 1)
M = Manifold.euclidean("x y")
x, y = M.symbols


@pytest.mark.parametrize(("form", "is_minimum"), HALF, ids=str)
@FEW
@given(seed=seeds, offset=offsets)
def test_beside_a_weak_contact_no_verdict_is_false(form, is_minimum, seed, offset):
    c = posed(form, np.random.default_rng(seed), contacts=(1, 3), push=1.0, offset=offset)
    allowed = MINIMA if is_minimum else {Verdict.SADDLE}
    assert c.verdict in {*allowed, Verdict.UNDECIDED}


@pytest.mark.parametrize(("form", "is_minimum"), QUADRANT, ids=str)
@FEW
@given(seed=seeds, offset=offsets)
def test_beside_a_corner_the_verdict_is_that_of_the_corner(form, is_minimum, seed, offset):
    """Three contacts determine the corner."""
    c = posed(form, np.random.default_rng(seed), contacts=(1, 2, 3), push=1.0, offset=offset)
    assert c.verdict is (Verdict.WEAK_MINIMUM if is_minimum else Verdict.SADDLE)


@given(
    st.sampled_from([-1, 1]),
    st.sampled_from([3, 5]),
    st.floats(-13, -8.05).map(lambda power: 10.0**power),
    st.floats(-1, 1),
    st.sampled_from([0, 1]),
)
@example(-1, 3, 5e-9, 0.0, 0)
@example(-1, 3, 5e-9, -1.0, 1)
def test_a_wall_beside_an_inflection(sign, power, gap, at, push):
    """On the wall side of ``-x^3`` or ``x^3`` the point may not be told from the inflection.

    ``sign x^p`` on ``x >= -gap`` has its only local minimum, if any, on the wall.
    """
    D = Polyhedron(M, {"wall": x + gap, "floor": y})
    c = certify(D, sign * x**power + y**2 + push * y, [at * gap, 0.0])
    if sign < 0:
        assert c.verdict not in MINIMA
    else:  # beside the wall, but within the tolerance of it, the point itself is no minimum
        beside = set() if at == -1.0 else {Verdict.SADDLE}
        assert c.verdict in {*MINIMA, *beside, Verdict.UNDECIDED}


@pytest.mark.parametrize("bend", [1, 30, 300, 3000])
@pytest.mark.parametrize("at", [1e-8, 2e-8, 1e-7, 1e-6, -2e-8, -1e-6])
def test_beside_an_inflection_along_a_curved_wall_no_minimum_is_seen(bend, at):
    """Along ``y = x^2`` the energy is ``bend x^3``, which no weak contact across it holds."""
    space = Manifold.euclidean("x y z")
    z = space.symbols[2]
    D = Polyhedron(space, {"curved": y - x**2, "weak": z})
    assert not certify(D, y - x**2 + bend * x**3 + z**2, [at, at * at, 0]).is_minimum


@pytest.mark.parametrize("at", [0, 1e-10, 1e-9, -1e-9])
def test_beside_a_weak_contact_a_minimum_stays_one(at):
    space = Manifold.euclidean("x y z")
    z = space.symbols[2]
    D = Polyhedron(space, {"curved": y - x**2, "weak": z})
    assert certify(D, y + x**3 + z**2, [at, at * at, 0]).verdict is Verdict.WEAK_MINIMUM


def test_a_point_short_of_the_end_of_a_steep_valley_is_no_minimum():
    """Along ``y = x^2`` the energy is ``x^2 + (1 - x)^2 / 100``, least at ``1 / 101``."""
    D = Polyhedron(M, {"far": x + 50})
    energy = 10**10 * (y - x**2) ** 2 + (1 - x) ** 2 / 100 + y
    assert not certify(D, energy, [0.01571306, 0.01571306**2 - 5e-11]).is_minimum
    assert certify(D, energy, [0.0099, 0.0099**2 - 5e-11]).verdict is not Verdict.SADDLE


def test_a_function_that_says_nothing_takes_no_multipliers_away():
    D = Polyhedron(M, {"product": -x * y, "x": x, "y": y})
    c = certify(D, x**2 + y**2 - 4 * x * y, [0, 0])
    assert c.verdict is Verdict.UNDECIDED
    assert "no multipliers exist" not in c.explain()
    assert "a function whose gradient vanishes" in c.explain()
