"""Points that are exactly in a set, and sets that are empty near a point."""

from decimal import Decimal, localcontext
from fractions import Fraction
from itertools import combinations

import numpy as np
import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import linprog

from polycorner import AnyOf, Manifold, Polyhedron, exact_point

EIGHTHS = st.integers(-40, 40).map(lambda k: Fraction(k, 8))
PLANE = Manifold.euclidean("x y")
x, y = PLANE.symbols


def value_at(expression, manifold, point):
    """The value, by SymPy."""
    return expression.subs(dict(zip(manifold.symbols, map(rational, point), strict=True)))


def rational(number):
    return sp.Rational(number.numerator, number.denominator)


def circles(n):
    """Circles in the unit square with radii of their own, each function written out."""
    names = [f"x{i} y{i} r{i}" for i in range(n)]
    manifold = Manifold.euclidean(" ".join(names))
    z = np.reshape(manifold.symbols, (n, 3))
    parts = {}
    for i, (a, b, r) in enumerate(z):
        parts |= {f"left{i}": a - r, f"right{i}": 1 - a - r, f"low{i}": b - r}
        parts |= {f"high{i}": 1 - b - r, f"size{i}": r}
    for i, j in combinations(range(n), 2):
        (a, b, r), (c, d, s) = z[i], z[j]
        parts[f"gap{i}_{j}"] = (a - c) ** 2 + (b - d) ** 2 - (r + s) ** 2
    return Polyhedron(manifold, parts), -sum(z[:, 2])


def lattice(k, radius):
    """Circles in rows and columns."""
    places = [((2 * i + 1) * radius, (2 * j + 1) * radius) for i in range(k) for j in range(k)]
    return [c for a, b in places for c in (a, b, radius)]


# ----------------------------------------------------------------------------- membership


@given(st.lists(st.tuples(EIGHTHS, EIGHTHS, EIGHTHS), min_size=1, max_size=4), EIGHTHS, EIGHTHS)
def test_membership_in_polygons_is_that_of_fractions(rows, a, b):
    rows = [row for row in rows if row[0] or row[1]] or [(Fraction(1), Fraction(0), Fraction(0))]
    parts = [rational(u) * x + rational(v) * y - rational(w) for u, v, w in rows]
    polygon = Polyhedron(PLANE, parts)
    found = exact_point(polygon, [a, b], within=100)
    missed = [u * a + v * b - w for u, v, w in rows]
    assert found.inside == all(f >= 0 for f in missed)
    values = {v.name: Fraction(v.value[0]) for v in found.violations}
    negative = {f"f{i + 1}": f for i, f in enumerate(missed) if f < 0}
    if found.inside:
        assert found.point == (a, b)
        assert not values
    else:
        assert values == negative
    # A point that is given satisfies all, and what is said to be empty is by a programme.
    least = linprog(
        [0, 0],
        [[-float(u), -float(v)] for u, v, _ in rows],
        [-float(w) for *_, w in rows],
        bounds=[(a - 100, a + 100), (b - 100, b + 100)],
    )
    if found.point:
        p, q = found.point
        assert all(u * p + v * q >= w for u, v, w in rows)
        assert found.moved == max(abs(p - a), abs(q - b))
    elif found.empty:
        assert least.status == 2
    if least.status == 2:
        assert not found.point


QUADRATICS = st.lists(st.tuples(*[EIGHTHS] * 6), min_size=1, max_size=4)


@given(QUADRATICS, EIGHTHS, EIGHTHS, st.sampled_from([1, 10**5, 10**10]), st.randoms())
def test_what_is_said_of_conics_is_true(rows, a, b, finer, random):
    def at(row, p, q):
        return (row[0] * p + row[1] * q + row[2]) * p + (row[3] * q + row[4]) * q - row[5]

    # Every function is nearly zero at the point.
    rows = [row for row in rows if any(row[:5])] or [(*[Fraction(0)] * 4, Fraction(1), Fraction(0))]
    rows = [(*row[:5], row[5] / finer + at((*row[:5], 0), a, b)) for row in rows]
    parts = [sp.expand(at([rational(c) for c in row], x, y)) for row in rows]
    found = exact_point(Polyhedron(PLANE, parts), [a, b], within=1)
    assert found.inside == all(at(row, a, b) >= 0 for row in rows)
    if found.point:
        assert all(at(row, *found.point) >= 0 for row in rows)
        assert max(abs(u - v) for u, v in zip(found.point, (a, b), strict=True)) == found.moved <= 1
    if found.empty:
        for _ in range(100):
            p, q = (c + Fraction(random.randint(-1000, 1000), 1000) for c in (a, b))
            assert any(at(row, p, q) < 0 for row in rows)


def test_the_smallest_move_onto_a_half_plane():
    # The nearest point of 3 x + 4 y >= 5 in the largest coordinate is (5/7, 5/7).
    found = exact_point(Polyhedron(PLANE, [3 * x + 4 * y - 5]), [0, 0], within=1)
    assert 0 <= found.moved - Fraction(5, 7) < Fraction(1, 10**9)


@pytest.mark.parametrize(("digits", "inside"), [("84", True), ("85", False)])
def test_irrational_boundaries_are_decided_beyond_doubles(digits, inside):
    place = "0.707106781186547524400844362104" + digits
    found = exact_point(Polyhedron(PLANE, {"wall": sp.sqrt(2) / 2 - x}), [place, 0])
    assert found.inside is (Fraction(place) ** 2 <= Fraction(1, 2))
    assert found.inside is inside
    if not inside:
        with localcontext() as context:
            context.prec = 80
            off = Decimal("0.5").sqrt() - Decimal(place)
        low, high = (Decimal(side) for side in found.violations[0].value)
        assert low <= off <= high
        assert Decimal(str(found.moved.numerator)) / found.moved.denominator < Decimal("1e-28")
        assert value_at(sp.sqrt(2) / 2 - x, PLANE, found.point) > 0


def test_points_exactly_on_the_boundary_are_inside():
    disc = Polyhedron(PLANE, {"disc": 1 - x**2 - y**2, "wall": sp.sqrt(2) * x - sp.sqrt(2) / 3})
    assert exact_point(disc, [Fraction(1, 3), 0]).inside
    assert exact_point(disc, {"x": "0.6", "y": Decimal("0.8")}).inside
    assert not exact_point(disc, [0.6, 0.8]).inside


# ------------------------------------------------------------------------------- packings


def test_a_radius_that_is_too_large_names_its_pairs_and_is_repaired():
    polyhedron, energy = circles(4)
    q = lattice(2, Fraction(1, 4))
    large = Fraction(9, 10**10)
    q[2] += large
    found = exact_point(polyhedron, q, energy)
    assert found.inside is False
    # Two walls and two neighbours; the fourth circle is diagonal.
    assert {v.name for v in found.violations[:2]} == {"left0", "low0"}
    assert {v.name for v in found.violations[2:]} == {"gap0_1", "gap0_2"}
    overlap = Fraction(1, 4) - (Fraction(1, 2) + large) ** 2
    assert Fraction(found.violations[-1].value[0]) == overlap
    assert Fraction(found.energy_given[0]) == -1 - large
    assert exact_point(polyhedron, found.point).inside
    for f in polyhedron.functions:
        assert value_at(f.expression, polyhedron.manifold, found.point) >= 0
    # The best sum to first order, by a programme in units of what is too large.
    values, gradients = (part[:] for part in polyhedron.evaluate([float(c) for c in q], 1))
    unit = float(large)
    cost = np.tile([0.0, 0.0, -1.0], 4)
    best = linprog(cost, -gradients, values / unit, bounds=[(-1000, 1000)] * 12)
    lost = Fraction(found.energy[1]) - Fraction(found.energy_given[0])
    assert float(lost) == pytest.approx(best.fun * unit, rel=1e-6)


def test_many_circles():
    polyhedron, energy = circles(25)
    q = lattice(5, 0.1)
    q[2] += 1e-9
    found = exact_point(polyhedron, q, energy)
    assert {"left0", "low0", "gap0_1", "gap0_5"} <= {v.name for v in found.violations}
    assert found.inside is False
    assert exact_point(polyhedron, found.point, energy).inside
    assert -2.5 <= float(Fraction(found.energy[0])) < -2.5 + 1e-8


# --------------------------------------------------------------- thin, empty and curved sets


def test_sets_without_interior_have_exactly_rational_points():
    third = Polyhedron(PLANE, {"up": 3 * x - 1, "down": 1 - 3 * x, "curve": y - x**2})
    found = exact_point(third, [0.3333333333, 1 / 9], within=1e-6)
    assert found.point[0] == Fraction(1, 3)
    assert found.point[1] >= Fraction(1, 9)


def test_points_of_curved_sets_without_interior_are_enclosed():
    ring = Polyhedron(PLANE, {"out": x**2 + y**2 - 2, "in": 2 - x**2 - y**2, "right": x})
    found = exact_point(ring, [1.1, 0.9], within=0.3)
    assert found.enclosed
    assert found.point is None
    (a, b), (c, d) = found.region
    assert a**2 + c**2 <= 2 <= b**2 + d**2


def test_sets_that_are_empty_near_a_point():
    strip = Polyhedron(PLANE, {"bowl": y - x**2, "lid": x**2 - y - Fraction(1, 10**12), "right": x})
    found = exact_point(strip, [0.5, 0.25], within=1e-3)
    assert set(found.empty) == {"bowl", "lid"}
    assert found.inside is False
    assert not found.region
    far = exact_point(Polyhedron(PLANE, {"wall": x - 1, "other": y}), [0, 0], within=0.5)
    assert far.empty == ("wall",)


def test_boxes_are_divided_where_one_proof_is_not_enough():
    # Outside a disc and inside a smaller one around another centre.
    both = Polyhedron(PLANE, {"out": x**2 + y**2 - 1, "in": Fraction(1, 4) - x**2 - 2 * y**2})
    assert set(exact_point(both, [0, 0], within=1).empty) == {"out", "in"}


def test_what_is_not_shown_is_said():
    # Both vanish together at the origin only, at which neither has a slope.
    point = Polyhedron(PLANE, {"peak": -(x**4) - y**4})
    found = exact_point(point, [0.001, 0.001], within=0.01)
    assert not found.empty
    assert found.point == (0, 0) or "nor shown" in found.reason


# ------------------------------------------------------------------ equations, unions, circles


def test_equations_are_solved_exactly_or_enclosed():
    line = Polyhedron(PLANE, {"right": x}, {"line": 3 * x + 7 * y - 1})
    found = exact_point(line, [0.2, 0.05], within=0.1)
    p, q = found.point
    assert 3 * p + 7 * q == 1
    circle = Polyhedron(PLANE, {"right": x - Fraction(1, 2)}, {"circle": x**2 + y**2 - 1})
    assert exact_point(circle, ["0.6", "0.8"]).inside
    found = exact_point(circle, [0.61, 0.79], y, within=0.1)
    assert [v.name for v in found.violations] == ["circle"]
    assert len(found.enclosed) >= 1
    low, high = ([Fraction(side[k]) for side in found.region] for k in (0, 1))
    assert sum(a**2 for a in low) <= 1 <= sum(b**2 for b in high)
    assert max(b - a for a, b in zip(low, high, strict=True)) < Fraction(1, 10**30)
    assert Fraction(found.energy[0]) <= low[1] <= high[1] <= Fraction(found.energy[1])


def test_equations_that_follow_from_others():
    line = Polyhedron(
        PLANE, {"right": x}, {"circle": x**2 + y**2 - 2, "twice": 4 - 2 * x**2 - 2 * y**2}
    )
    found = exact_point(line, [1.2, 0.7], within=0.1)
    assert found.enclosed


def test_unit_vectors_are_enclosed():
    manifold = Manifold.sphere("u")
    *_, height = manifold.symbols
    found = exact_point(Polyhedron(manifold, {"cap": height - Fraction(1, 2)}), [0.6, 0.6, 0.52915])
    assert found.inside is False
    assert found.region
    assert found.region[2][0] >= Fraction(1, 2)


def test_unit_quaternions_are_enclosed():
    manifold = Manifold.rotation("a")
    turned = Polyhedron(manifold, {"turn": manifold.symbols[0] ** 2 - Fraction(1, 4)})
    found = exact_point(turned, ["0.5", "0.5", "0.5", "0.49999"], within=1e-2)
    assert [v.name for v in found.violations] == ["|a|"]
    low, high = ([Fraction(side[k]) for side in found.region] for k in (0, 1))
    assert sum(a**2 for a in low) <= 1 <= sum(b**2 for b in high)
    assert low[0] ** 2 >= Fraction(1, 4)


def test_one_branch_of_a_union_is_enough():
    parts = {"side": AnyOf(-1 - x, x - 1)}
    union = Polyhedron(PLANE, parts)
    found = exact_point(union, [Fraction(3, 4), 0], within=0.5)
    assert found.point[0] >= 1
    assert [v.name for v in found.violations] == ["side2"]
    assert exact_point(union, [2, 0]).violations == ()
    assert set(exact_point(union, [0, 0], within=0.5).empty) == {"side1", "side2"}


@pytest.mark.parametrize("digits", [1, 300])
def test_any_number_of_digits(digits):
    disc = Polyhedron(PLANE, {"disc": 1 - x**2 - y**2, "wall": sp.sqrt(3) * (2 * x - 1)})
    found = exact_point(disc, ["0.5", "0.87"], -y, within=0.1, digits=digits)
    p, q = found.point
    assert p**2 + q**2 <= 1 <= 2 * p
    assert q**2 == pytest.approx(0.75, abs=0.02)
    assert Fraction(found.energy[0]) <= -q <= Fraction(found.energy[1])


def test_numbers_beyond_doubles():
    wall = Polyhedron(PLANE, {"wall": x - y})
    assert exact_point(wall, ["1e400", "-1e-400"]).inside
    assert exact_point(wall, ["-1e400", 0]).empty == ("wall",)
    assert exact_point(wall, [0, "1e-400"]).inside is False


def test_angles():
    manifold = Manifold(["a"], [2 * np.pi], [1.0])
    (a,) = manifold.symbols
    half = Polyhedron(manifold, {"up": sp.cos(a)})
    found = exact_point(half, [np.pi / 2 + 1e-9], sp.sin(a))
    assert found.inside is False
    assert sp.cos(rational(found.point[0])) > 0
    assert found.moved < Fraction(2, 10**9)
    assert exact_point(half, [np.pi / 2]).inside  # the double is below pi/2


def test_scales_measure_distances():
    manifold = Manifold.euclidean("x", scale=100)
    (s,) = manifold.symbols
    found = exact_point(Polyhedron(manifold, {"wall": s - 1}), [0], within=0.02)
    assert found.moved == pytest.approx(0.01)
    low, high = (Fraction(side) for side in found.violations[0].distance)
    assert low <= Fraction(-1, 100) <= high


# ----------------------------------------------------------------------------- printing, errors


def test_results_are_printed_in_words():
    polyhedron, energy = circles(4)
    q = lattice(2, 0.25)
    q[2] += 1e-9
    found = exact_point(polyhedron, q, energy)
    assert "not in the set" in str(found)
    assert "gap0_1" in str(found)
    assert "outside" in repr(found)


@pytest.mark.parametrize(
    ("arguments", "options", "kind", "words"),
    [
        (("D", [0, 0]), {}, TypeError, "polyhedron"),
        ((None, [0]), {}, ValueError, "point: expected 2"),
        ((None, 3), {}, TypeError, "point"),
        ((None, "01"), {}, TypeError, "point"),
        ((None, {"x": 0}), {}, ValueError, "point"),
        ((None, [0, float("nan")]), {}, ValueError, "point: y"),
        ((None, [0, "1e999999999"]), {}, ValueError, "point: y"),
        ((None, [0, "one"]), {}, ValueError, "point: y"),
        ((None, [0, "1/0"]), {}, ValueError, "point: y"),
        ((None, [0, 1j]), {}, TypeError, "point: y"),
        ((None, [0, True]), {}, TypeError, "point: y"),
        ((None, [0, 0], "x"), {}, TypeError, "energy"),
        ((None, [0, 0]), {"within": 0}, ValueError, "within"),
        ((None, [0, 0]), {"within": "far"}, TypeError, "within"),
        ((None, [0, 0]), {"digits": 0}, ValueError, "digits"),
        ((None, [0, 0]), {"digits": 1.5}, TypeError, "digits"),
    ],
)
def test_wrong_arguments_are_refused_in_one_sentence(arguments, options, kind, words):
    first, *rest = arguments
    polyhedron = Polyhedron(PLANE, {"f": x}) if first is None else first
    with pytest.raises(kind, match=words) as error:
        exact_point(polyhedron, *rest, **options)
    assert "\n" not in str(error.value)
