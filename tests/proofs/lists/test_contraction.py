"""What is cut off from boxes before they are bisected lies outside of the set."""

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st

from polycorner import AnyOf, Manifold, NonsmoothWarning, Polyhedron, SmoothFunction
from polycorner.intervals.boxes import BoxFunctions
from polycorner.proofs import corners, stationary_points
from polycorner.proofs.checker.balls import hull
from polycorner.proofs.checker.proof import StoredProof
from polycorner.proofs.checker.verdict import check, contents
from polycorner.proofs.lists import search
from polycorner.proofs.lists.branches import conjunctions
from polycorner.proofs.lists.contraction import narrowed
from polycorner.proofs.lists.tree import Boxes

PLANE = Manifold.euclidean("x y")
X, Y = PLANE.symbols
SIDES = [(-4.0, 4.0), (-4.0, 4.0)]


def sides_of(polyhedron, lower, upper):
    """Narrow the sides of boxes ``(B, n)``."""
    functions = [*polyhedron.functions, *polyhedron.equations]
    enclosed = BoxFunctions(functions, polyhedron.manifold)
    bounds = enclosed.gradients(lower, upper, monotone=True)
    nodes = np.zeros(len(lower), dtype=np.int64)
    return narrowed(
        Boxes(lower, upper, nodes, nodes),
        bounds,
        enclosed.continuous(lower, upper),
        conjunctions(polyhedron),
        len(polyhedron.equations),
    )


def test_a_wedge_is_cut_at_its_sides():
    """Of the square 0..1 the wedge leaves x from 0.5, which is reached but for a twentieth."""
    wedge = Polyhedron(PLANE, {"side": 2 * X - 1 - Y})
    low, high = sides_of(wedge, np.zeros((1, 2)), np.ones((1, 2)))
    assert low == pytest.approx(np.array([[0.95 * 0.5, 0]]))
    assert (high == 1).all()
    mirrored = Polyhedron(PLANE, {"side": 1 - Y - 2 * X})
    low, high = sides_of(mirrored, np.zeros((1, 2)), np.ones((1, 2)))
    assert (low == 0).all()
    assert high == pytest.approx(np.array([[1 - 0.95 * 0.5, 1]]))


def test_equations_cut_on_both_sides():
    line = Polyhedron(PLANE, {"above": Y + 5}, equations={"line": X - Y / 4 - sympy.Rational(1, 2)})
    low, high = sides_of(line, np.zeros((1, 2)), np.ones((1, 2)))
    assert low[0, 0] == pytest.approx(0.95 * 0.5)
    assert high[0, 0] == pytest.approx(1 - 0.95 * 0.25)


def test_a_step_cuts_nothing_off():
    """Its slope is 1 wherever it has one, which tells nothing across the step at ``x = 1/2``."""
    step = sympy.Piecewise((X - sympy.Rational(1, 4), X < sympy.Rational(1, 2)), (X - 2, True))
    with pytest.warns(NonsmoothWarning):
        d = Polyhedron(PLANE, {"step": step})
    low, high = sides_of(d, np.zeros((1, 2)), np.ones((1, 2)))
    assert (low == 0).all()
    assert (high == 1).all()


numbers = st.integers(-6, 6).map(lambda k: sympy.Rational(k, 2))


@given(
    terms=st.lists(numbers, min_size=12, max_size=12),
    union=st.booleans(),
    seed=st.integers(0, 2**32 - 1),
)
@settings(max_examples=max(10, settings.default.max_examples // 2), deadline=None)
def test_no_point_of_the_set_is_cut_off(terms, union, seed):
    """By the definition, on a grid in each box."""
    forms = [
        sum((c * t for c, t in zip(row, (1, X, Y, X * Y), strict=True)), Y**2 / 7 - X**2 / 9)
        for row in (terms[:4], terms[4:8], terms[8:])
    ]
    d = Polyhedron(PLANE, [forms[0], AnyOf(*forms[1:])] if union else forms)
    rng = np.random.default_rng(seed)
    middle = rng.uniform(-2, 2, (20, 2))
    half = 10.0 ** rng.uniform(-3, 0, (20, 2))
    lower, upper = middle - half, middle + half
    low, high = sides_of(d, lower, upper)
    share = np.linspace(0, 1, 41)
    grid = np.stack(np.meshgrid(share, share), axis=-1).reshape(-1, 2)
    f = [sympy.lambdify((X, Y), form, "numpy") for form in forms]
    for a, b, c, e in zip(lower, upper, low, high, strict=True):
        q = np.minimum(a + grid * (b - a), b)
        values = np.array([np.broadcast_to(g(*q.T), len(q)) for g in f])
        held = values[0] >= 0
        held &= values[1:].max(axis=0) >= 0 if union else values[1:].min(axis=0) >= 0
        assert ((q[held] >= c) & (q[held] <= e)).all()


@pytest.mark.parametrize("minima_only", [False, True])
def test_lists_are_the_same_without_cuts_and_both_are_verified(minima_only, tmp_path, monkeypatch):
    d = Polyhedron(PLANE, {"disc": 9 - X**2 - Y**2, "hole": X**2 + Y**2 - 1, "side": X + Y + 2})
    energy = (X - 2) ** 2 + 3 * Y**2 - X * Y**2
    problem = {"box": SIDES, "minima_only": minima_only}
    found = stationary_points(d, energy, **problem)
    monkeypatch.setattr(search, "LEAST_CUT", 2.0)
    whole = stationary_points(d, energy, **problem)
    assert found.complete
    assert whole.complete
    assert found.tally.outside != whole.tally.outside
    places = [np.round(sorted(p.point.tolist() for p in some), 9) for some in (found, whole)]
    assert (places[0] == places[1]).all()
    for some in (found, whole):
        assert check(str(some.save(tmp_path / "list.zip")), None, 1).startswith("verified")


def test_corners_are_the_same_without_cuts(tmp_path, monkeypatch):
    d = Polyhedron(PLANE, {"disc": 9 - X**2 - Y**2, "cubic": Y - X**3 / 4, "side": X + Y + 2})
    found = corners(d, box=SIDES)
    assert check(str(found.save(tmp_path / "corners.zip")), None, 1).startswith("verified")
    monkeypatch.setattr(search, "LEAST_CUT", 2.0)
    whole = corners(d, box=SIDES)
    assert found.complete
    assert whole.complete
    assert len(found) == len(whole) == 3
    assert found.tally.boxes < whole.tally.boxes


def test_slopes_in_the_checker_contain_those_of_points(tmp_path):
    d = Polyhedron(PLANE, {"disc": 9 - X**2 - Y**2})
    energy = sympy.sin(X * Y) + X**3 / (3 + Y)
    path = stationary_points(d, energy, box=SIDES, max_boxes=9).save(tmp_path / "list.zip")
    proof = StoredProof(contents(str(path))[0])
    p = proof.p
    rng = np.random.default_rng(2)
    slope = sympy.lambdify((X, Y), [energy.diff(X), energy.diff(Y)])
    for _ in range(30):
        middle, half = rng.uniform(-2, 2, 2), 10.0 ** rng.uniform(-4, -1)
        box = hull((middle - half).tolist(), (middle + half).tolist())
        centre = [x.mid() for x in box]
        w = [*map(type(centre[0]), rng.standard_normal(2).tolist())]
        away = [x - c for x, c in zip(box, centre, strict=True)]
        enclosed = proof.slope(-1, w, p.values(box), {}, p.values(centre), {}, away)
        corners_of = half * np.array([[a, b] for a in (-1, 1) for b in (-1, 1)])
        ends = [np.dot(slope(*(middle + end)), [float(x) for x in w]) for end in corners_of]
        for q in middle + half * rng.uniform(-1, 1, (20, 2)):
            assert enclosed.contains(
                type(centre[0])(float(np.dot(slope(*q), [float(x) for x in w])))
            )
        if half < 1e-3:
            assert 2 * enclosed.rad() < 1.2 * (max(ends) - min(ends))


@pytest.mark.parametrize("formula", [sympy.sqrt(X), sympy.log(X), 1 / X])
def test_the_checker_reads_no_sign_from_slopes_that_are_not_bounded(formula, tmp_path):
    d = Polyhedron(PLANE, {"f": formula, "right": X})
    proof = stationary_points(d, X + Y, box=[(0, 1), (0, 1)], max_boxes=5).save(tmp_path / "l.zip")
    p = StoredProof(contents(str(proof))[0]).p
    lo, hi = [0.0, 0.0], [1.0, 1.0]
    assert p.sign(p.values(hull(lo, hi)), 0, {}, lo, hi) == 0


def test_parameters_are_cut_and_the_list_holds_for_all_of_them(tmp_path, monkeypatch):
    """Of the box some values of ``a`` leave a part only; the minimum is at ``(a, a^2 - a / 2)``."""
    a = sympy.Symbol("a")
    wall = SmoothFunction("wall", X - a, PLANE, parameters={"a": 0.3})
    energy = SmoothFunction("E", X**2 + (Y - X**2 + a / 2) ** 2, PLANE, parameters={"a": 0.3})
    problem = {"box": [(-1, 1), (-1, 1)], "parameters": {"a": (0.25, 0.35)}}
    found = stationary_points(Polyhedron(PLANE, [wall]), energy, **problem)
    axes = found.record.codes
    assert (axes == 2).any()  # the parameter comes after the coordinates
    assert check(str(found.save(tmp_path / "list.zip")), None, 1).startswith("verified")
    monkeypatch.setattr(search, "LEAST_CUT", 2.0)
    whole = stationary_points(Polyhedron(PLANE, [wall]), energy, **problem)
    assert not (whole.record.codes == 2).any()
    for some in (found, whole):
        assert some.complete
        (p,) = some
        assert (p.lower <= [0.25, 0.25**2 - 0.125]).all()
        assert (p.upper >= [0.35, 0.35**2 - 0.175]).all()
