"""What a certificate says where gradients depend on each other, and how it says it."""

import numpy as np
import pytest
import sympy as sp
from hypothesis import assume, given
from hypothesis import strategies as st
from oracles_minima import plain_residuals
from polynomials import linear

from polycorner import (
    Manifold,
    Polyhedron,
    SmoothFunction,
    Verdict,
    certify,
    minimise,
)

METHODS = ("newton", "slsqp", "scp")
every_method = pytest.mark.parametrize("method", METHODS)
M2, M3 = Manifold.euclidean("x y"), Manifold.euclidean("x y z")
x, y, z = M3.symbols


# ------------------------------------------------------------------- dependent gradients


def test_doubled_constraints_share_the_multiplier():
    D = Polyhedron(M2, {"floor": y, "again": 2 * y})
    c = certify(D, x**2 + 3 * y, [0, 0])
    assert c.verdict is Verdict.STRICT_MINIMUM
    assert not c.multipliers_unique
    assert not c.licq
    lam = c.multipliers
    assert lam["floor"] + 2 * lam["again"] == pytest.approx(3, rel=1e-12)
    assert c.multiplier_ranges["floor"] == pytest.approx((0, 3), abs=1e-9)
    assert c.multiplier_ranges["again"] == pytest.approx((0, 1.5), abs=1e-9)
    assert c.signature == (1, 1, 0)
    assert "one choice of several" in str(c)


@given(
    st.integers(3, 6),
    st.lists(st.floats(-3, 3), min_size=6, max_size=6),
    st.lists(st.floats(0.1, 2), min_size=6, max_size=6),
)
def test_multiplier_ranges_are_those_of_the_linear_programme(count, tilts, weights):
    """A fan of half-planes through the origin: more faces than dimensions."""
    rows = np.array([[t, 1.0] for t in tilts[:count]])
    assume(np.ptp(rows[:, 0]) > 0.1)
    force = np.array(weights[:count]) @ rows
    D = Polyhedron(M2, [linear(M2, row, 0.0, f"c{i}") for i, row in enumerate(rows)])
    c = certify(D, linear(M2, force, 0.0, "energy"), [0, 0])
    assert c.verdict is Verdict.STRICT_MINIMUM
    assert c.signature == (2, 0, 0)
    assert not c.multipliers_unique
    lam = np.array(list(c.multipliers.values()))
    assert lam @ rows == pytest.approx(force, abs=1e-9)
    assert (lam >= -1e-12).all()
    for i, (low, high) in enumerate(c.multiplier_ranges.values()):
        assert low - 1e-9 <= lam[i] <= high + 1e-9
        for side, ours in ((1, low), (-1, high)):
            assert ours == pytest.approx(_extreme(rows, force, i, side), abs=1e-6)


def _extreme(rows, force, i, side):
    """Least (side 1) or largest (side -1) multiplier ``i``: a vertex holds two of them at most."""
    found = []
    for j in range(len(rows)):
        for k in range(j):
            pair = rows[[j, k]].T
            if abs(np.linalg.det(pair)) < 1e-9:
                continue
            two = np.linalg.solve(pair, force)
            if (two >= -1e-9).all():
                found.append(two[0] if i == j else two[1] if i == k else 0.0)
        if abs(rows[j, 0] * force[1] - rows[j, 1] * force[0]) < 1e-9:
            found.append(force[1] if i == j else 0.0)
    return side * min(side * f for f in found)


def test_opposite_constraints_leave_their_multipliers_unbounded():
    D = Polyhedron(M2, {"above": y, "below": -y})
    c = certify(D, x**2 + y, [0, 0])
    lam = c.multipliers
    assert lam["above"] - lam["below"] == pytest.approx(1, rel=1e-12)
    assert c.multiplier_ranges["above"][1] == c.multiplier_ranges["below"][1] == np.inf
    assert c.is_minimum


@every_method
def test_redundant_equations_do_no_harm(method):
    D = Polyhedron(M3, {"floor": x}, equations={"sum": x + y - 1, "twice": 2 * x + 2 * y - 2})
    c = minimise(D, (x + 2) ** 2 + y**2 + z**2, [0.5, 0.5, 0.3], method=method)
    if method == "slsqp" and not c.is_minimum:
        # SLSQP's least-squares step needs independent equations; it may give up, never mislead.
        assert not c.holds(1)
        return
    assert c.verdict is Verdict.STRICT_MINIMUM
    assert c.point == pytest.approx([0, 1, 0], abs=1e-9)
    assert c.active == ("floor",)
    assert not c.multipliers_unique
    lam = c.multipliers
    assert lam["sum"] + 2 * lam["twice"] == pytest.approx(2, abs=1e-9)
    assert lam["floor"] == pytest.approx(2, abs=1e-9)


@every_method
@pytest.mark.parametrize("start", [(2.0, 2.0), (-2.0, -2.0), (0.1, 0.1), (3.0, -5.0)])
def test_equations_alone_are_met_from_both_sides(method, start):
    line = Polyhedron(M2, [], equations={"line": x + 2 * y - 1})
    circle = Polyhedron(M2, [], equations={"circle": x**2 + y**2 - 1})
    c = minimise(line, x**2 + y**2, start, method=method)
    assert c.point == pytest.approx([0.2, 0.4], abs=1e-9)
    assert c.multipliers == pytest.approx({"line": 0.4}, abs=1e-9)
    assert c.verdict is Verdict.STRICT_MINIMUM
    c = minimise(circle, 3 * x + 4 * y, start, method=method)
    assert c.point == pytest.approx([-0.6, -0.8], abs=1e-9)
    assert c.multipliers == pytest.approx({"circle": -2.5}, abs=1e-9)
    assert c.signature == (0, 1, 0)


# ---------------------------------------------------------------------- what is written down


BOWL = {"bowl": y - x**2, "lid": 2 - y}


@given(st.floats(-1.5, 1.5), st.floats(-2, 2), st.floats(-2, 2))
def test_residuals_are_recomputed_from_the_expressions(at, a, b):
    assume(abs(a) + abs(b) > 0.1)
    energy = a * sp.sin(x) + b * y * sp.exp(x / 3)
    left, right = sp.symbols("a b", real=True)
    form = left * sp.sin(x) + right * y * sp.exp(x / 3)
    D, E = Polyhedron(M2, BOWL), SmoothFunction("E", form, M2, parameters={"a": a, "b": b})
    points = [[at, at**2 + 3e-9 * abs(b)], [2**0.5, 2.0]]
    for q in points:
        c = certify(D, E, q)
        r = c.residuals
        expected = plain_residuals(c, (x, y), energy, BOWL)
        ours = (r.infeasibility, r.stationarity, r.complementarity)
        assert ours == pytest.approx(expected, rel=1e-9, abs=1e-14)
        assert r.worst == max(ours)


def test_a_certificate_holds_within_a_tolerance_only():
    D = Polyhedron(M2, BOWL)
    good = minimise(D, x + y, [1.0, 1.5])
    assert good.holds(1e-12)
    near = certify(D, x + y, good.point + np.array([0, 3e-9]))
    assert near.is_minimum
    assert near.residuals.worst > 1e-9
    assert near.holds(1e-8)
    assert not near.holds(1e-9)
    assert not certify(D, x + y, [0, 0]).holds(10)


def test_a_certificate_is_written_out_in_full():
    c = minimise(Polyhedron(M2, BOWL), x + y, [1.0, 1.5])
    text = str(c)
    assert c.verdict.value in text
    lines = [line.split() for line in text.splitlines()]
    for label in ("verdict", "energy", "active", "signature", "coordinate", "direction"):
        assert any(words[:1] == [label] for words in lines)
    for row in (["x", "-0.5"], ["y", "0.25"], ["bowl", "0", "1"], ["bowl", "half-V"]):
        assert row in lines
    assert "(1, 1, 0)" in text
    for name in ("infeasibility", "stationarity", "complementarity"):
        assert [name, f"{getattr(c.residuals, name):.1e}"] in lines


def test_a_certificate_is_a_value():
    c = minimise(Polyhedron(M2, BOWL), x + y, [1.0, 1.5])
    with pytest.raises(ValueError, match="read-only"):
        c.point[0] = 1.0
    with pytest.raises(AttributeError):
        c.point = np.zeros(2)
    start = np.array([1.0, 1.5])
    minimise(c.problem.polyhedron, x + y, start)
    assert start.tolist() == [1.0, 1.5]


def test_every_direction_has_its_own_label():
    # A contact may be called like a coordinate.
    D = Polyhedron(M2, {"y": x})
    c = certify(D, x + y**2, [0, 0])
    assert c.signature == (1, 1, 0)
    assert sorted(kind.value for kind in c.entrapment.values()) == ["U", "half-V"]


@given(st.integers(1, 8))
def test_entrapment_accounts_for_every_dimension(n):
    manifold = Manifold.euclidean([f"x{i}" for i in range(n)])
    symbols = manifold.symbols
    D = Polyhedron(manifold, {"wall": sum(symbols)})
    c = certify(D, sum(symbols) + sum(s**2 for s in symbols), [0.0] * n)
    assert c.entrapment_counts == {"half-V": 1, "half-U": 0, "U": n - 1, "free": 0}
    assert len(c.entrapment) == n


def test_certificates_of_many_contacts_are_short_and_say_what_they_leave_out():
    manifold = Manifold.euclidean([f"x{i}" for i in range(150)])
    D = Polyhedron(manifold, {f"f{i}": s for i, s in enumerate(manifold.symbols)})
    c = certify(D, sum(manifold.symbols), np.zeros(150))
    text = str(c)
    assert len(text.splitlines()) < 100
    assert max(map(len, text.splitlines())) < 120
    assert text.count("(the first 20 of 150)") == 3  # coordinates, multipliers, directions
    assert "150 functions" in text
    assert len(c.multipliers) == len(c.entrapment) == 150
