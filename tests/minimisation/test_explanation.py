"""The sentences of ``explain`` are true: names and numbers against independent computations."""

import itertools
import re

import numpy as np
import pytest
import sympy as sp
from explanations import NUMBER, direction, figures, opening_rates, sentence
from hypothesis import assume, given
from hypothesis import strategies as st
from oracles_minima import least_on_cone
from polynomials import linear, quadratic

from polycorner import AnyOf, Manifold, Polyhedron, Verdict, certify, minimise

M1, M2, M3 = (Manifold.euclidean(names) for names in ("x", "x y", "x y z"))
x, y, z = M3.symbols
numbers = st.floats(-2, 2).filter(lambda v: abs(v) > 0.05)


# ------------------------------------------------------------- programmes with known answers


@st.composite
def programmes(draw, multipliers=numbers):
    """Return rows ``A``, multipliers and a form: at the origin ``dE = sum lam_i a_i``."""
    n = draw(st.integers(2, 4))
    k = draw(st.integers(1, n))
    rows = np.array(draw(st.lists(numbers, min_size=k * n, max_size=k * n))).reshape(k, n)
    scales = np.array(draw(st.lists(st.sampled_from([0.1, 1.0, 5.0]), min_size=n, max_size=n)))
    singular = np.linalg.svd(rows * scales)[1]
    assume(singular[-1] > 0.05 * singular[0])
    held = np.array(draw(st.lists(multipliers, min_size=k, max_size=k)))
    form = np.array(draw(st.lists(st.floats(-2, 2), min_size=n * n, max_size=n * n)))
    return rows, held, form.reshape(n, n) + form.reshape(n, n).T, scales


def posed(rows, held, form, scales):
    n = len(scales)
    manifold = Manifold(tuple(f"q{i}" for i in range(n)), scales=tuple(scales))
    walls = [linear(manifold, row, 0.0, f"c{i}") for i, row in enumerate(rows)]
    return certify(Polyhedron(manifold, walls), quadratic(manifold, form, held @ rows), [0.0] * n)


def fastest(rows, slope):
    """Return the greatest rate ``-slope.d`` over unit ``d`` with ``rows d >= 0``, face by face."""
    best = 0.0
    for size in range(len(rows) + 1):
        for chosen in itertools.combinations(range(len(rows)), size):
            held = rows[list(chosen)]
            along = -slope + np.linalg.pinv(held) @ held @ slope if size else -slope
            if (rows @ along >= -1e-9).all():
                best = max(best, float(np.linalg.norm(along)))
    return best


@given(programmes())
def test_contacts_that_the_energy_pulls_open_are_named_with_their_rates(programme):
    rows, held, _, scales = programme
    text = posed(*programme).explain(unit="mm")
    negative = {f"c{i}": -value for i, value in enumerate(held) if value < 0}
    assert opening_rates(text) == pytest.approx(negative, rel=1e-5)
    assert ("per mm" in text) == bool(negative)
    falls = [line for line in text.splitlines() if line.startswith("The energy decreases fastest")]
    assert len(falls) == bool(negative)
    if negative:
        assert text.startswith("Not a minimum")
        manifold = posed(*programme).problem.polyhedron.manifold
        way, rate = direction(falls[0], manifold), figures(falls[0], "at the rate")[0]
        assert rate == pytest.approx(fastest(rows * scales, held @ rows * scales), rel=1e-5)
        assert np.linalg.norm(way / scales) == pytest.approx(1, abs=1e-5)
        assert -(held @ rows) @ way == pytest.approx(rate, rel=1e-4)
        assert (rows @ way >= -1e-4).all()


@given(programmes(multipliers=st.floats(0.1, 2)))
def test_the_least_curvature_along_the_face_is_told_with_its_direction(programme):
    rows, held, form, scales = programme
    c = posed(*programme)
    text = c.explain()
    assert "strict complementarity" in text
    for i, value in enumerate(held):
        assert f"{value:.6g} d(c{i})" in text
    basis = np.linalg.svd(rows * scales)[2][len(rows) :].T
    scaled = form * np.outer(scales, scales)
    if not basis.shape[1]:
        assert "The critical cone is the origin" in text
        return
    least = np.linalg.eigvalsh(basis.T @ scaled @ basis)[0]
    assume(abs(least) > 1e-3)
    (told,) = figures(text, "the least curvature is") + figures(text, "the curvature there is")
    assert told == pytest.approx(least, rel=1e-5)
    line = sentence(text, f"{told:.6g} per squared scale unit")
    way = direction(line, c.problem.polyhedron.manifold) / scales
    assert np.linalg.norm(way) == pytest.approx(1, abs=1e-5)
    assert (rows * scales) @ way == pytest.approx(0, abs=1e-4)
    assert way @ scaled @ way == pytest.approx(least, rel=1e-3, abs=1e-3)
    assert text.startswith("Strict local minimum" if least > 0 else "Not a minimum: stationary")


@given(st.lists(st.floats(-2, 2), min_size=9, max_size=9), st.integers(2, 3), st.integers(1, 3))
def test_weak_contacts_leave_the_least_value_on_their_cone(entries, n, k):
    """What is told is attained in the cone, and no sampled direction of the cone lies lower."""
    manifold = {2: M2, 3: M3}[n]
    form = np.array(entries).reshape(3, 3)[:n, :n]
    form = form + form.T
    rows = np.eye(n)[: min(k, n)] + 0.3
    walls = [linear(manifold, row, 0.0, f"c{i}") for i, row in enumerate(rows)]
    text = certify(Polyhedron(manifold, walls), quadratic(manifold, form), [0.0] * n).explain()
    least = least_on_cone(form, rows)
    assume(abs(least) > 0.05)
    names = ", ".join(f"c{i}" for i in range(len(rows)))
    assert f"Weakly active, with multiplier zero: {names}." in text
    (told,) = figures(text, "the least curvature is") + figures(text, "the curvature there is")
    assert told <= least + 1e-5 * (1 + abs(least))
    way = direction(sentence(text, "per squared scale unit"), manifold)
    assert (rows @ way >= -1e-5).all()
    assert way @ form @ way == pytest.approx(told, abs=1e-4)


@given(programmes(), st.data())
def test_the_worst_inequality_is_named_with_its_value(programme, data):
    rows, _, form, scales = programme
    n = len(scales)
    offsets = np.array(data.draw(st.lists(numbers, min_size=len(rows), max_size=len(rows))))
    away = offsets / np.linalg.norm(rows * scales, axis=1)
    assume(away.min() < 0)
    assume(len(set(away.round(6))) == len(away))
    manifold = Manifold(tuple(f"q{i}" for i in range(n)), scales=tuple(scales))
    walls = [
        linear(manifold, row, f, f"c{i}")
        for i, (row, f) in enumerate(zip(rows, offsets, strict=True))
    ]
    text = certify(Polyhedron(manifold, walls), quadratic(manifold, form), [0.0] * n).explain()
    assert text.startswith("The point does not lie in the polyhedron.")
    worst = int(away.argmin())
    assert f"the inequality c{worst}: its function is {offsets[worst]:.6g}," in text
    assert figures(text, "to first order") == pytest.approx([-away[worst]], rel=1e-5)
    others = [f"c{i}" for i in np.flatnonzero(away < 0) if i != worst]
    assert (f"Also violated: {', '.join(others)}." in text) == bool(others)
    assert "first-order conditions hold" not in text


# -------------------------------------------------------------------------- kinds of points


def test_an_equation_that_is_not_met_is_named():
    D = Polyhedron(M2, {"floor": y}, equations={"line": x + y - 3, "other": x - y})
    text = certify(D, y, [1.0, 0.5]).explain(unit="mm")
    assert "the equation line: its function is -1.5 mm," in text
    assert figures(text, "to first order") == pytest.approx([1.5 / 2**0.5], rel=1e-5)
    assert "Also violated: other." in text


def test_of_a_union_the_branch_that_is_missed_least_counts():
    D = Polyhedron(M2, AnyOf(linear(M2, [1, 0], -3, "right"), linear(M2, [0, 2], -2, "up")))
    text = certify(D, x + y, [0.0, 0.0]).explain()
    assert "the inequality up: its function is -2," in text
    assert "Also violated" not in text


def test_where_branches_meet_the_one_that_decides_is_named():
    D = Polyhedron(M2, AnyOf(linear(M2, [1, 0], 0, "right"), linear(M2, [0, 1], 0, "up")))
    text = certify(D, 3 * y + x**2, [0.0, 0.0]).explain()
    assert "2 branches of the union meet (right; up)" in text
    assert "the branch that decides, right." in text
    assert "(dy = -1) at the rate 3 per scale unit" in text


def test_an_interior_point_that_is_not_stationary():
    text = certify(Polyhedron(M2, {"floor": y}), (x - 3) ** 2 + y**2, [0.0, 4.0]).explain()
    assert "in the interior of the polyhedron" in text
    assert "(dx = 0.6, dy = -0.8), at the rate 10 per scale unit" in text


def test_a_slope_along_the_face_is_told_apart_from_the_contacts():
    """At (1, 1) on the parabola dE = (1, 1) = 0.2 d(bowl) - ..., with d(bowl) = (-2, 1)."""
    text = certify(Polyhedron(M2, {"bowl": y - x**2}), x + y, [1.0, 1.0]).explain()
    assert opening_rates(text) == {"bowl": 0.2}
    along = sentence(text, "Along the face")
    assert direction(along, M2) == pytest.approx([-(0.2**0.5), -(0.8**0.5)], abs=1e-6)
    assert figures(along, "at the rate") == pytest.approx([3 / 5**0.5], rel=1e-5)


def test_redundant_contacts_and_ranges_of_multipliers():
    D = Polyhedron(M2, {"floor": y, "again": 2 * y, "left": y - x, "right": y + x})
    text = certify(D, x**2 + 4 * y, [0.0, 0.0]).explain()
    assert "The 4 gradients of floor, again, left, right are dependent, of rank 2" in text
    ranges = re.findall(rf"(\w+) from {NUMBER} to {NUMBER}", text)
    most = {"floor": 4, "again": 2, "left": 2, "right": 2}
    assert {name: float(high) for name, _, high in ranges} == pytest.approx(most, abs=1e-5)
    assert all(abs(float(low)) < 1e-5 for _, low, _ in ranges)
    assert "each implied by the others: floor; again." in text


def test_dependent_contacts_that_are_pulled_open():
    D = Polyhedron(M2, {"floor": y, "again": 2 * y})
    text = certify(D, x**2 - 3 * y, [0.0, 0.0]).explain()
    assert "(dy = 1), at the rate 3 per scale unit" in text
    assert not opening_rates(text)  # which of the two carries it is not determined


def test_a_cusp_decides_nothing():
    text = certify(Polyhedron(M2, {"a": y - x**2, "b": -(x**2) - y}), x, [0.0, 0.0]).explain()
    assert text.startswith("Undecided: no multipliers exist")
    assert "The gradients of a, b are dependent and leave no inward direction" in text
    assert "decreases" not in text


def test_a_direction_in_which_the_energy_is_constant_is_free():
    text = certify(Polyhedron(M3, {"floor": z}), z + 2 * y**2, [1.0, 0.0, 0.0]).explain()
    assert "The second order vanishes, or nearly so, in the direction (dx = 1)." in text
    assert "The energy is constant along the curve on the face with the tangent (dx = 1)" in text
    across = sentence(text, "Across them")
    assert figures(across, "the least curvature is") == [4]
    assert direction(across, M3).tolist() == [0, 1, 0]
    assert "half-V: floor; U: y; free: x." in text


@pytest.mark.parametrize(("power", "verdict"), [(3, "Not a minimum"), (4, "Strict")])
def test_a_direction_of_higher_order_is_named_with_its_order(power, verdict):
    text = certify(Polyhedron(M2, {"floor": y}), y + x**power, [0.0, 0.0]).explain()
    assert text.startswith(verdict)
    assert f"the tangent (dx = 1): terms of degree {power} decide." in text
    assert "of higher order: x." in text
    assert "free" not in text


def test_what_higher_orders_do_not_decide_is_said():
    text = certify(Polyhedron(M2, {"floor": y}), y + x**18, [0.0, 0.0]).explain()
    assert text.startswith("Undecided")
    assert "Higher orders decide nothing: constant to the degree of the series, but" in text
    assert "undecided: x." in text


def test_a_gradient_that_vanishes_is_named():
    D = Polyhedron(M2, {"odd": (x - 1) ** 2, "up": y})
    c = certify(D, x**2 + y, [1.0, 0.0])
    text = c.explain()
    assert c.verdict is Verdict.NOT_STATIONARY
    assert "the gradient vanishes of odd" in text
    assert direction(sentence(text, "The energy decreases fastest"), M2).tolist() == [-1, 0]


def test_too_many_weak_contacts():
    M = Manifold.euclidean([f"x{i}" for i in range(15)])
    D = Polyhedron(M, {f"w{i}": s for i, s in enumerate(M.symbols)})
    form = sum(s**2 for s in M.symbols) - 4 * M.symbols[0] * M.symbols[1]
    text = certify(D, form, [0.0] * 15).explain()
    assert "15 functions are weakly active, and the critical cone has more extreme rays" in text


def test_a_contact_that_is_nearly_closed_under_a_large_force():
    c = certify(Polyhedron(M1, {"wall": 1e-6 * M1.symbols[0]}), M1.symbols[0], [5e-9])
    text = c.explain()
    if c.verdict is Verdict.NOT_STATIONARY:
        assert "wall is active within the tolerance, but its gap is 5e-15" in text
    c = certify(Polyhedron(M2, {"wall": x}), 100 * x + y**2, [9e-9, 0.0])
    assert ("active within the tolerance" in c.explain()) == (c.verdict is Verdict.NOT_STATIONARY)


def test_angles_bear_their_unit():
    M = Manifold(("phi", "s"), periods=(2 * np.pi, np.inf), scales=(0.5, 2.0))
    phi, s = M.symbols
    text = certify(Polyhedron(M, {"floor": s}), s + sp.sin(phi), [0.0, 0.0]).explain()
    assert "(dphi = -0.5 rad) at the rate 0.5 per scale unit" in text


def test_a_way_down_between_tangent_parabolas_is_seen():
    c = certify(Polyhedron(M2, {"a": y - x**2, "b": 2 * x**2 - y}), x, [0.0, 0.0])
    assert c.verdict is Verdict.NOT_STATIONARY
    assert "(dx = -1)" in c.explain()


def test_searches_that_failed_say_so():
    c = minimise(Polyhedron(M2, {"none": -1 - x**2 - y**2}), x**2 + y**2, [2.0, 0.5])
    assert c.explain().startswith("No point of the polyhedron was reached: no step lowers")
    assert "the inequality none" in c.explain()
    c = minimise(Polyhedron(M2, {"floor": y}), x + y, [0.0, 1.0])
    assert c.explain().startswith("The energy decreases without end")
    assert "(dx = -1)" in c.explain()
