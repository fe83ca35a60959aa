"""Searches without a minimum to find end in their own words: at infinity, or at a domain's edge."""

import numpy as np
import pytest
import sympy as sp
from hypothesis import example, given
from hypothesis import strategies as st

from polycorner import Certificate, Manifold, Polyhedron, SmoothFunction, Verdict, minimise
from polycorner.formulas import Family
from polycorner.minimisation.problem import pose

METHODS = ("newton", "slsqp", "scp")
LINE, PLANE = Manifold.euclidean("x"), Manifold.euclidean("x y")
x, y = PLANE.symbols
FREE = Polyhedron(PLANE, {"far": x**2 + y**2 + 1})

# Turned by a right angle's parts, moved and stretched: u goes along, v across.
c, s, a, r, p, w = sp.symbols("c s a r p w")
u, v = (c * x + s * y - a) / r, (c * y - s * x) / r
NAMES = ["c", "s", "a", "r", "p", "w"]
turns = st.sampled_from([(1, 0), (0, -1), (0.6, 0.8), (-0.8, 0.6), (5 / 13, -12 / 13)])
shifts, stretches = st.integers(-3, 3), st.sampled_from([0.1, 1, 30])
weights = st.sampled_from([0, 1, 100])


def family(energy):
    return Family.of({"energy": energy + w * v**2}, ["x", "y"], NAMES)


def placed(kind, turn, a, r, p, w, at):
    """Return a member, and the point with the coordinates ``at`` in its own frame."""
    c, s = turn
    E = SmoothFunction.member(kind, "energy", PLANE, parameters=[c, s, a, r, p, w])
    along, across = r * at[0] + a, r * at[1]
    return E, [c * along - s * across, s * along + c * across]


def along(q, turn, a, r):
    return (turn[0] * q[0] + turn[1] * q[1] - a) / r


# ------------------------------------------------------------------------ infinity

BOUNDED = {
    "power": family(u**-p),
    "exponential": family(sp.exp(-p * u)),
    "angle": family(-sp.atan(p * u)),
    "logarithm": family(1 / sp.log(2 + u)),
}


@given(
    st.sampled_from(sorted(BOUNDED)),
    turns,
    shifts,
    st.sampled_from([1, 30]),
    st.sampled_from([0.5, 1]),
    weights,
)
@example("exponential", (1, 0), 0, 30, 0.5, 1)  # ends where the energy is below its rounding errors
def test_an_infimum_at_infinity_is_not_attained(kind, turn, a, r, p, w):
    E, start = placed(BOUNDED[kind], turn, a, r, p, w, (1.0, 0.3))
    found = minimise(FREE, E, start)
    assert found.verdict is Verdict.NOT_ATTAINED
    assert along(found.point, turn, a, r) > 3
    assert "finite sum" in found.explain()


WITHOUT_BOUND = {
    "power": family(-(u**p)),
    "exponential": family(-sp.exp(p * u / 2)),
    "logarithm": family(-sp.log(p * u)),
    "root of a logarithm": family(-sp.sqrt(sp.log(3 + p * u))),
}


@given(
    st.sampled_from(sorted(WITHOUT_BOUND)),
    turns,
    shifts,
    stretches,
    st.sampled_from([0.5, 1, 1.5]),
    weights,
)
def test_an_energy_without_bound_is_followed(kind, turn, a, r, p, w):
    E, start = placed(WITHOUT_BOUND[kind], turn, a, r, p, w, (1.0, 0.3))
    found = minimise(FREE, E, start)
    assert found.verdict in {Verdict.UNBOUNDED, Verdict.NOT_CONVERGED}
    if w == 0 or kind == "exponential":
        assert found.verdict is Verdict.UNBOUNDED
        assert found.energy < float(E.value(np.array(start)))


FAR = {
    "bowl": family((u - 1) ** 2),
    "quartic": family((u - 1) ** 4 + u**2 / 9),
    "hyperbolic": family(sp.sqrt(1 + (u - 1) ** 2)),
}


@given(st.sampled_from(sorted(FAR)), turns, st.integers(6, 14), st.sampled_from([1, 100]))
def test_a_minimum_at_any_distance_is_found_or_declined(kind, turn, order, w):
    E, start = placed(FAR[kind], turn, 0, 10.0**order, 1, w, (0.0, 0.0))
    found = minimise(FREE, E, start)
    assert found.verdict in {Verdict.STRICT_MINIMUM, Verdict.NOT_CONVERGED, Verdict.UNDECIDED}
    if found.verdict is Verdict.STRICT_MINIMUM:
        least = {"bowl": 1, "quartic": 0.7, "hyperbolic": 1}[kind]
        assert along(found.point, turn, 0, 10.0**order) == pytest.approx(least, abs=0.1)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("order", [9, 12])
def test_a_wall_far_down_is_reached(order, method):
    D = Polyhedron(PLANE, {"wall": 10**order - x, "floor": y})
    found = minimise(D, y - x, [0.0, 1.0], method=method)
    assert found.verdict is not Verdict.UNBOUNDED
    if found.is_minimum:
        assert found.point == pytest.approx([10**order, 0])


BRANCHES = {"hyperbola": x * y - 1, "steep": x**2 * y - 1, "flat": x * y**2 - 1}


@pytest.mark.parametrize("kind", BRANCHES)
def test_an_asymptote_is_not_attained(kind):
    D = Polyhedron(PLANE, {"branch": BRANCHES[kind], "right": x, "up": y})
    found = minimise(D, x, [1.0, 2.0])
    assert found.verdict is Verdict.NOT_ATTAINED
    assert D.contains(found.point, tolerance=1e-8)


def test_a_valley_that_ends_at_a_wall_is_not_called_endless():
    D = Polyhedron(PLANE, {"wall": 300 - y, "right": x, "branch": x * y - 1})
    found = minimise(D, x, [1.0, 2.0])
    assert found.verdict in {Verdict.STRICT_MINIMUM, Verdict.NOT_CONVERGED}


# ------------------------------------------------------------------------ edges of domains

EDGES = {
    "power": family(u**p),
    "logarithm": family(sp.log(p * u)),
    "pole": family(-(u**-2)),
    "mixed": family(sp.sqrt(u) - u**2 / 9),
}


@given(
    st.sampled_from(sorted(EDGES)),
    turns,
    shifts,
    st.sampled_from([0.5, 1, 4]),
    st.sampled_from([0.25, 0.5, 0.9]),
    weights,
)
def test_a_search_that_runs_to_a_domains_edge_says_so(kind, turn, a, r, p, w):
    E, start = placed(EDGES[kind], turn, a, r, p, w, (0.7, 0.0))
    found = minimise(FREE, E, start)
    assert found.verdict is Verdict.DOMAIN_EDGE
    assert along(found.point, turn, a, r) == pytest.approx(0, abs=1e-5)
    text = found.explain()
    assert "the domain of energy" in text
    assert ("without bound" in text) == (kind in {"logarithm", "pole"})


CONSTRAINED = {
    "root": 1 + sp.sqrt(x),
    "logarithm": 5 - sp.log(x),
    "quotient": 5 + x * sp.log(x),
}


@pytest.mark.parametrize("kind", CONSTRAINED)
def test_the_edge_of_a_constraints_domain_is_named(kind):
    D = Polyhedron(PLANE, {"edged": CONSTRAINED[kind], "floor": y})
    found = minimise(D, x + (y + 1) ** 2, [1.0, 1.0])
    assert found.verdict is Verdict.DOMAIN_EDGE
    assert found.point[0] == pytest.approx(0, abs=1e-8)
    assert "the domain of edged" in found.explain()


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("exponent", ["1/3", "1/2", "3/2", "5/3"])
def test_a_power_at_its_edge_is_never_a_saddle_or_outside(exponent, method):
    D = Polyhedron(LINE, {"lid": 5 - x})
    found = minimise(D, x ** sp.Rational(exponent), [1.0], method=method)
    assert np.isfinite(found.energy)
    assert found.verdict in {
        Verdict.DOMAIN_EDGE,
        Verdict.NOT_CONVERGED,
        Verdict.STRICT_MINIMUM,
        Verdict.NOT_SMOOTH,
    }
    assert found.energy < 0.1 or found.verdict is Verdict.NOT_CONVERGED


INFINITE = {  # infinite on a face of the quadrant
    "logarithm": sp.log(x) + y,
    "distance": -1 / (x**2 + y**2),
    "radius": sp.log(x**2 + y**2),
    "quotient": (y - x) / y,
}


@pytest.mark.parametrize("start", [(1.0, 1.0), (0.5, 0.1), (2.0, 0.25)], ids=str)
@pytest.mark.parametrize("method", ["newton", "slsqp"])
@pytest.mark.parametrize("kind", INFINITE)
def test_where_an_energy_is_infinite_is_an_edge_and_not_outside(kind, method, start):
    D = Polyhedron(PLANE, {"left": x, "floor": y})
    found = minimise(D, INFINITE[kind], start, method=method)
    if not np.isfinite(found.energy):
        assert found.verdict is Verdict.DOMAIN_EDGE
        assert "the domain of energy" in found.explain()
    assert found.verdict is not Verdict.OUTSIDE
    assert found.analysis.verdict is not Verdict.OUTSIDE


def test_a_point_of_infinite_energy_is_at_an_edge():
    D = Polyhedron(PLANE, {"left": x, "floor": y})
    found = Certificate(pose(D, sp.log(x)), np.array([0.0, 1.0]))
    assert found.verdict is Verdict.DOMAIN_EDGE
    assert "energy has no finite value there" in found.explain()
