"""Lists of local minima alone, and the curvature that closes boxes near saddles."""

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st
from proof_files import changed
from scipy.linalg import null_space
from scipy.optimize import root

from polycorner import AnyOf, Manifold, NonsmoothWarning, Polyhedron, SmoothFunction
from polycorner.minimisation.problem import pose
from polycorner.proofs import stationary_points
from polycorner.proofs.checker.balls import NotShownError
from polycorner.proofs.checker.verdict import check
from polycorner.proofs.lists import search as searching
from polycorner.proofs.lists.domains import domain
from polycorner.proofs.lists.examination import without_minima
from polycorner.proofs.lists.search import StationarySearch
from polycorner.proofs.lists.tree import Boxes

PLANE = Manifold.euclidean("x y")
X, Y = PLANE.symbols
SIDES = [(-4.0, 4.0), (-4.0, 4.0)]
SPACE = Manifold.euclidean("x y z")
U, V, W = SPACE.symbols


@pytest.fixture
def eager(monkeypatch):
    """Let a search use second derivatives from its first box on."""
    monkeypatch.setattr(searching, "SHARP", 0)


def places(points):
    return sorted(np.round([p.point for p in points], 9).tolist())


PROBLEMS = {
    "Himmelblau's function in a disc": (
        Polyhedron(PLANE, {"disc": 15 - X**2 - Y**2}),
        (X**2 + Y - 11) ** 2 + (X + Y**2 - 7) ** 2,
    ),
    "saddles on the boundary": (
        Polyhedron(PLANE, {"disc": 9 - X**2 - Y**2, "hole": X**2 + Y**2 - 1}),
        (X - 2) ** 2 + 3 * Y**2 - X * Y**2,
    ),
    "a union": (
        Polyhedron(PLANE, [AnyOf(1 - X**2 - Y**2, 1 - (X - 1) ** 2 - Y**2)]),
        X * Y - X / 4,
    ),
    "on a curve": (
        Polyhedron(PLANE, {"right": X + 1}, equations={"ellipse": X**2 / 4 + Y**2 - 1}),
        X**2 - Y + X / 3,
    ),
}


@pytest.mark.parametrize("name", PROBLEMS)
@pytest.mark.usefixtures("eager")
def test_minima_are_those_of_the_whole_list(name, tmp_path):
    d, energy = PROBLEMS[name]
    whole = stationary_points(d, energy, box=SIDES)
    found = stationary_points(d, energy, box=SIDES, minima_only=True)
    assert whole.complete
    assert found.complete
    assert len(whole) > len(whole.minima) > 0
    assert places(found) == places(whole.minima)
    assert "strict local minima" in found.statement
    told = check(str(found.save(tmp_path / "list.zip")), None, 1)
    assert told.startswith(f"verified: {len(found)} local minima")


@pytest.mark.usefixtures("eager")
def test_a_minimum_that_is_left_out_is_missed(tmp_path):
    d, energy = PROBLEMS["Himmelblau's function in a disc"]
    path = stationary_points(d, energy, box=SIDES, minima_only=True).save(tmp_path / "list.zip")
    changed(path, lambda data: data["points"].pop(0))
    with pytest.raises(NotShownError, match="is not listed"):
        check(str(path), None, 1)


@pytest.mark.usefixtures("eager")
def test_a_list_of_minima_that_passes_for_a_whole_one_is_refused(tmp_path):
    """Where negative curvature is needed, a list of all stationary points is not proved."""
    d, energy = PROBLEMS["saddles on the boundary"]
    path = stationary_points(d, energy, box=SIDES, minima_only=True).save(tmp_path / "list.zip")
    changed(path, lambda data: data.update(minima_only=False))
    with pytest.raises(NotShownError):
        check(str(path), None, 1)


def kkt_points(problem, active, rng, starts=12):
    """Return KKT points and multipliers of a face, by a general root finder."""
    found = []

    def residual(u):
        values, slopes, _ = problem.evaluate(u[:3], 2)
        pull = slopes[-1] - (u[3] * slopes[0] if active else 0)
        return [*pull, *([values[0]] if active else [])]

    for start in rng.uniform(-1.5, 1.5, (starts, 4 if active else 3)):
        solved = root(residual, start, tol=1e-12)
        if solved.success and abs(solved.x[:3]).max() < 2:
            found.append((solved.x[:3], solved.x[3:]))
    return found


numbers = st.integers(-6, 6).map(lambda k: sympy.Rational(k, 2))


@given(
    energy=st.lists(numbers, min_size=9, max_size=9),
    wall=st.lists(numbers, min_size=4, max_size=4),
    active=st.booleans(),
    seed=st.integers(0, 2**32 - 1),
)
@settings(max_examples=12, deadline=None)
def test_boxes_that_are_closed_contain_no_minimum(energy, wall, active, seed):
    """By the definition: at every KKT point in such a box a tangent vector bends down."""
    terms = [U**2, V**2, W**2, U * V, V * W, U * W, U, V, W * U**2]
    formula = sum((c * term for c, term in zip(energy, terms, strict=True)), U**2 / 7)
    bound = wall[0] * U + wall[1] * V + W + wall[2] * U**2 + wall[3] * V * W
    problem = pose(Polyhedron(SPACE, {"wall": bound}), formula)
    search = StationarySearch(problem, domain(SPACE, [(-2, 2)] * 3), 1e-6)
    rng = np.random.default_rng(seed)
    for q, lam in kkt_points(problem, active, rng):
        half = 10.0 ** rng.uniform(-4, 0, (8, 1))
        middle = q + rng.uniform(-0.9, 0.9, (8, 3)) * half
        nodes = np.zeros(8, dtype=np.int64)
        boxes = Boxes(middle - half, middle + half, nodes, nodes)
        found, directions = without_minima(
            search, boxes, np.arange(8), np.full((8, 1), active, dtype=np.bool_)
        )
        _, slopes, bends = problem.evaluate(q, 2)
        flat = null_space(slopes[:1]) if active else np.eye(3)
        form = bends[-1] - (lam[0] * bends[0] if active else 0)
        least = np.linalg.eigvalsh(flat.T @ form @ flat)[0]
        if found.any():
            assert least < 0
            assert directions[found].any(axis=1).all()
        if least < -1e-2:
            assert found[half[:, 0] < 2e-4].all()


def test_saddles_whose_multiplier_passes_through_zero(tmp_path):
    """The saddle of ``(x - a)^2 - y^2`` on ``x >= 0`` has the multiplier ``-2 a``, or none."""
    wall = Polyhedron(PLANE, {"wall": X})
    for value, active in ((-1e-3, ("wall",)), (1e-3, ())):
        (p,) = stationary_points(wall, (X - value) ** 2 - Y**2, box=[(-1, 1), (-1, 1)])
        assert (p.index, p.active) == (1, active)
    a = sympy.Symbol("a")
    energy = SmoothFunction("E", (X - a) ** 2 - Y**2, PLANE, parameters={"a": 0.0})
    problem = {"box": [(-1, 1), (-1, 1)], "parameters": {"a": (-1e-3, 1e-3)}}
    assert not stationary_points(wall, energy, **problem).complete
    found = stationary_points(wall, energy, **problem, minima_only=True)
    assert (found.complete, len(found)) == (True, 0)
    assert check(str(found.save(tmp_path / "saddles.zip")), None, 1).startswith("verified: 0 local")


@pytest.mark.parametrize("wall", [X + Y / 3, X - X**2])
def test_a_saddle_on_a_wall_without_force_is_no_minimum(wall, tmp_path):
    """The saddle of ``x^2 - y^2`` lies on the wall, along which the energy decreases."""
    d = Polyhedron(PLANE, {"wall": wall})
    found = stationary_points(d, X**2 - Y**2, box=[(-0.5, 0.5), (-0.5, 0.5)], minima_only=True)
    assert (found.complete, len(found), found.open_points) == (True, 0, ())
    path = found.save(tmp_path / "saddle.zip")
    assert check(str(path), None, 1).startswith("verified: 0 local minima")
    changed(path, lambda data: data["regions"][0].update(way=["0x0p0", "0x0p0"]))
    with pytest.raises(NotShownError, match="is not listed"):
        check(str(path), None, 1)
    upright = Polyhedron(PLANE, {"wall": wall.subs({X: Y, Y: X}, simultaneous=True)})
    found = stationary_points(
        upright, X**2 - Y**2, box=[(-0.5, 0.5), (-0.5, 0.5)], minima_only=True, resolution=1e-3
    )
    assert not found.complete  # it descends one way only, along no tangent of the wall


def test_a_weakly_active_minimum_is_not_closed():
    """With ``x >= 0`` and ``y >= 0``, where both multipliers vanish, 0 is the minimum."""
    d = Polyhedron(PLANE, {"right": X, "above": Y})
    found = stationary_points(
        d, X**2 + 4 * X * Y + Y**2, box=[(-1, 1), (-1, 1)], minima_only=True, resolution=1e-3
    )
    assert not found.complete
    lower, upper = found.undecided[:, 0], found.undecided[:, 1]
    assert ((lower <= 0) & (0 <= upper)).all(axis=1).any()


@pytest.mark.usefixtures("eager")
def test_a_kink_is_not_taken_for_negative_curvature():
    """Near 0 the second derivative is negative on either side, and 0 is the minimum."""
    d = Polyhedron(PLANE, {"disc": 1 - X**2 - Y**2})
    energy = sympy.Abs(X) - X**2 / 4 + Y**2
    with pytest.warns(NonsmoothWarning):
        found = stationary_points(d, energy, box=SIDES, minima_only=True, resolution=1e-2)
    lower, upper = found.undecided[:, 0], found.undecided[:, 1]
    assert not found.complete
    assert ((lower <= 0) & (0 <= upper)).all(axis=1).any()


def test_a_saddle_where_a_function_of_another_branch_vanishes_is_no_minimum(tmp_path):
    union = Polyhedron(PLANE, [AnyOf(X + Y, 1 - X)])
    box = [(-0.5, 0.625), (-0.625, 0.5)]
    found = stationary_points(union, Y**2 - X**2, box=box, minima_only=True)
    assert (found.complete, len(found), found.open_points) == (True, 0, ())
    assert check(str(found.save(tmp_path / "saddle.zip")), None, 1).startswith("verified")
