"""The verbs on sparse polyhedra beside those with full matrices, and closed forms."""

import itertools
import math

import numpy as np
import pytest
import sympy

from polycorner import (
    AllOf,
    AnyOf,
    Manifold,
    Polyhedron,
    SmoothFunction,
    Verdict,
    certify,
    minimise,
    sensitivity,
    stationary_on,
)
from polycorner.formulas.families import Family
from polycorner.minimisation import problem as problems
from polycorner.minimisation.analysis import analyse_sparse
from polycorner.minimisation.problem import pose
from polycorner.tolerances import DEFAULT

SIDES = (("floor", "low", "y"), ("left", "low", "x"), ("right", "high", "x"))


@pytest.fixture
def everything_sparse(monkeypatch):
    """Let every polyhedron without unions count as large."""
    monkeypatch.setattr(problems, "MOST_NUMBERS", 0)
    monkeypatch.setattr(problems, "MOST_READ", 2.0)
    problems._posed.cache_clear()
    yield
    problems._posed.cache_clear()


def cable(count, weight=1.0):
    """Balls on a cable between two ends at one height; consecutive ones at most 1 apart."""
    M = Manifold.euclidean([f"{a}{i}" for i in range(count) for a in "xy"])
    s = M.symbols
    span = 0.8 * (count + 1)
    places = [(0, 0), *zip(s[::2], s[1::2], strict=True), (span, 0)]
    links = {
        f"link{i}": 1 - (c - a) ** 2 - (d - b) ** 2
        for i, ((a, b), (c, d)) in enumerate(itertools.pairwise(places))
    }
    x = 0.8 * np.arange(1, count + 1)
    start = np.column_stack([x, -0.2 * x * (span - x) / span**2]).ravel()
    return Polyhedron(M, links), weight * sympy.Add(*s[1::2]), start


def catenary(count):
    """Return centres ``(N, 2)`` and tensions of a cable, by bisection of the horizontal force.

    Link ``i`` carries the horizontal force ``H`` and the vertical one ``count / 2 - i``.
    """
    vertical = count / 2 - np.arange(count + 1)

    def width(force):
        return float((force / np.hypot(force, vertical)).sum())

    low, high = 1e-9, 1e3 * count
    for _ in range(200):
        middle = (low + high) / 2
        low, high = (middle, high) if width(middle) < 0.8 * (count + 1) else (low, middle)
    tension = np.hypot(low, vertical)
    links = np.column_stack([np.full(count + 1, low), -vertical]) / tension[:, None]
    return np.cumsum(links, axis=0)[:-1], tension


@pytest.mark.parametrize("count", [100, 1000])
def test_a_cable_hangs_as_statics_has_it(count, request):
    if count < 1000:
        request.getfixturevalue("everything_sparse")
    D, E, start = cable(count)
    found = minimise(D, E, start)
    assert found.problem.is_sparse
    assert found.verdict is Verdict.STRICT_MINIMUM
    centres, tension = catenary(count)
    assert found.point.reshape(-1, 2) == pytest.approx(centres, abs=1e-9 * count)
    # The gradient of 1 - |r|^2 by an end of a link of length 1 has the length 2.
    held = np.array([found.multipliers[f"link{i}"] for i in range(count + 1)])
    assert 2 * held == pytest.approx(tension, rel=1e-8)
    assert found.residuals.worst < 1e-9


def beam(count, floor=0.3):
    """Masses on springs between two walls above a curved floor."""
    M = Manifold.euclidean([f"x{i}" for i in range(count)])
    x = M.symbols
    ground = {f"floor{i}": x[i] + floor * math.cos(7 * i / count) for i in range(count)}
    chain = (0, *x, 0)
    springs = [(b - a) ** 2 * count / 4 for a, b in itertools.pairwise(chain)]
    return Polyhedron(M, ground), sympy.Add(*springs, *[2 * s / count for s in x]), np.ones(count)


def tray(radii, width):
    """Return discs in a tray, their height as energy, and centres of discs that fall into it."""
    count = len(radii)
    M = Manifold.euclidean([f"{a}{i}" for i in range(count) for a in "xy"])
    names = ("x1", "y1", "x2", "y2", "s", "w")
    x1, y1, x2, y2, s, w = sympy.symbols(names, real=True)
    gap = Family.of({"gap": sympy.sqrt((x1 - x2) ** 2 + (y1 - y2) ** 2) - s}, names[:4], "s")
    wall = Family.of({"low": x1 - s, "high": w - s - x1}, ["x1"], ["s", "w"])
    row = int(width / 2.3)
    places = np.array([(1.1 + 2.25 * (i % row), 1.2 + 2.3 * (i // row)) for i in range(count)])
    places[:, 0] += 0.05 * np.random.default_rng(count).random(count)
    parts = []
    for i, r in enumerate(radii):
        for name, member, axis in (
            ("floor", "low", "y"),
            ("left", "low", "x"),
            ("right", "high", "x"),
        ):
            part = SmoothFunction.member(
                wall, member, M, parameters=[r, width], reads=[f"{axis}{i}"], label=f"{name}{i}"
            )
            parts.append(part)
        for j in range(i):
            if np.hypot(*(places[i] - places[j])) < 6:
                reads = [f"x{i}", f"y{i}", f"x{j}", f"y{j}"]
                numbers = [r + radii[j]]
                parts.append(
                    SmoothFunction.member(
                        gap, "gap", M, parameters=numbers, reads=reads, label=f"{i}-{j}"
                    )
                )
    return Polyhedron(M, AllOf(*parts)), sympy.Add(*M.symbols[1::2]), places.ravel()


MODELS = {
    "beam": lambda: beam(60),
    "cable": lambda: cable(20),
    "tray": lambda: tray(1 - 0.1 * np.random.default_rng(1).random(16), 9.5),
    "equal discs": lambda: tray(np.ones(15), 9.5),
}


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.usefixtures("everything_sparse")
def test_minima_are_those_of_full_matrices(name, monkeypatch):
    D, E, start = MODELS[name]()
    sparse = minimise(D, E, start)
    assert sparse.problem.is_sparse
    assert sparse.is_minimum
    point, active = sparse.point, sparse.active
    values, energy, verdict = sparse.multipliers, sparse.energy, sparse.verdict
    monkeypatch.undo()
    problems._posed.cache_clear()
    dense = minimise(D, E, point)
    assert not dense.problem.is_sparse
    assert dense.verdict is verdict
    assert dense.point == pytest.approx(point, abs=1e-9)
    assert dense.energy == pytest.approx(energy, abs=1e-10)
    assert dense.active == active
    if dense.multipliers_unique:
        assert values == pytest.approx(dense.multipliers, abs=1e-8)


def loaded_beam(count):
    """A beam whose floor and load are parameters."""
    M = Manifold.euclidean([f"x{i}" for i in range(count)])
    u, v, h, c, load = sympy.symbols("u v h c load", real=True)
    floor = Family.of({"floor": u + h * c}, ["u"], ["h", "c"])
    spring = Family.of({"spring": (u - v) ** 2}, ["u", "v"])
    weight = Family.of({"weight": load * u}, ["u"], ["load"])
    last = Family.of({"end": u**2}, ["u"])
    x, mem = M.names, SmoothFunction.member
    parts = [
        mem(
            floor,
            "floor",
            M,
            parameters=[0.3, math.cos(7 * i / count)],
            reads=[x[i]],
            label=f"f{i}",
        )
        for i in range(count)
    ]
    terms = [mem(spring, "spring", M, reads=pair) for pair in itertools.pairwise(x)]
    terms += [mem(last, "end", M, reads=[x[i]]) for i in (0, -1)]
    terms += [mem(weight, "weight", M, parameters=[0.01], reads=[name]) for name in x]
    return Polyhedron(M, AllOf(*parts)), SmoothFunction.sum("energy", terms), np.ones(count)


@pytest.mark.usefixtures("everything_sparse")
def test_derivatives_are_those_of_full_matrices(monkeypatch):
    D, E, start = loaded_beam(40)
    sparse = minimise(D, E, start)
    assert 0 < len(sparse.active) < 40
    found = sensitivity(sparse, ["h", "load"])
    assert found.energy == pytest.approx(found.envelope, abs=1e-10)
    point, multipliers, energy = found.point, found.multipliers, found.energy
    assert found.free.shape == (40, 0)
    monkeypatch.undo()
    problems._posed.cache_clear()
    full = sensitivity(minimise(D, E, start), ["h", "load"])
    assert point == pytest.approx(full.point, abs=1e-9)
    assert energy == pytest.approx(full.energy, abs=1e-10)
    for name, row in full.multipliers.items():
        assert multipliers[name] == pytest.approx(row, abs=1e-9)


@pytest.mark.usefixtures("everything_sparse")
def test_derivatives_of_a_free_coordinate_and_of_a_weak_contact():
    M = Manifold.euclidean("x y z")
    x, y, _ = M.symbols
    a = sympy.Symbol("a")
    floor = SmoothFunction("floor", x - a, M, parameters={"a": 2.0})
    D = Polyhedron(M, {"floor": floor, "wall": y + 5})
    found = sensitivity(certify(D, x + y**2, [2.0, 0.0, 7.0]), ["a"])
    assert found.point.tolist() == [[1.0], [0.0], [0.0]]
    assert found.free.tolist() == [[0.0], [0.0], [1.0]]
    assert found.multipliers["floor"].tolist() == [0.0]
    weak = Polyhedron(M, {"floor": floor, "wall": y})
    with pytest.raises(ValueError, match="wall is zero, so that derivatives are one-sided"):
        sensitivity(certify(weak, x + y**2, [2.0, 0.0, 7.0]), ["a"])
    flat = SmoothFunction("energy", x + (y - a) ** 4, M, parameters={"a": 0.0})
    with pytest.raises(ValueError, match="second order vanishes"):
        sensitivity(certify(Polyhedron(M, {"floor": x}), flat, [0.0, 0.0, 0.0]), ["a"])


@pytest.mark.usefixtures("everything_sparse")
def test_stationary_points_of_a_face():
    M = Manifold.euclidean("x y z")
    x, y, z = M.symbols
    D = Polyhedron(M, {"cup": 4 - x**2 - y**2, "lid": 3 - z}, {"level": z - 1})
    top = stationary_on(D, y, [0.1, 1.9, 1.2], ["cup"])
    assert top.point == pytest.approx([0, 2, 1], abs=1e-12)
    assert top.multipliers["cup"] == pytest.approx(-0.25)
    assert top.verdict is Verdict.NOT_STATIONARY
    none = stationary_on(D, y, [0.1, 0.0, 1.0], [])
    assert none.verdict is Verdict.NOT_CONVERGED


@pytest.mark.usefixtures("everything_sparse")
def test_a_start_outside_and_equations():
    M = Manifold.euclidean("x y z")
    x, y, z = M.symbols
    D = Polyhedron(M, {"ball": 1 - x**2 - y**2 - z**2}, {"plane": x + y + z, "twice": x + y + z})
    found = minimise(D, x, [5.0, -3.0, 4.0])
    assert found.point == pytest.approx([-math.sqrt(2 / 3), *[math.sqrt(1 / 6)] * 2], abs=1e-9)
    assert found.verdict.is_minimum


@pytest.mark.usefixtures("everything_sparse")
def test_failures_are_verdicts():
    M = Manifold.euclidean("x y")
    x, y = M.symbols
    nowhere = Polyhedron(M, {"above": y - 1, "below": -1 - y})
    assert minimise(nowhere, x**2 + y**2, [3.0, 0.0]).verdict is Verdict.INFEASIBLE
    curved = Polyhedron(M, {"disc": 1 - x**2 - y**2, "far": x - 3})
    assert minimise(curved, y, [0.0, 2.0]).verdict is Verdict.INFEASIBLE
    assert minimise(Polyhedron(M, {"wall": x}), y + x, [1.0, 0.0]).verdict is Verdict.UNBOUNDED
    cut = minimise(Polyhedron(M, {"wall": x}), (y - 1000) ** 2 + x, [1.0, 0.0], max_iterations=1)
    assert cut.verdict in {Verdict.NOT_CONVERGED, Verdict.STRICT_MINIMUM}


@pytest.mark.parametrize(("tolerance", "is_empty"), [(1e-8, True), (1e-5, False)])
@pytest.mark.usefixtures("everything_sparse")
def test_a_set_that_is_empty_by_less_than_the_tolerance_has_a_minimum(tolerance, is_empty):
    M = Manifold.euclidean("x y")
    x, y = M.symbols
    D = Polyhedron(M, {"right": x - 1e-7, "left": -x})
    c = minimise(D, x + y**2, [0.5, 1.0], tolerance=tolerance)
    assert (c.verdict is Verdict.INFEASIBLE) == is_empty
    assert c.is_minimum != is_empty


@pytest.mark.usefixtures("everything_sparse")
def test_saddles_are_left():
    M = Manifold.euclidean("x y z")
    x, y, z = M.symbols
    D = Polyhedron(M, {"cup": 4 - x**2 - y**2, "pin": x**2 + y**2 - 0.25, "floor": z})
    found = minimise(D, y + z, [0.0, 1.5, 1.0])  # exactly above the top of the pin
    assert found.point == pytest.approx([0, -2, 0], abs=1e-9)
    inner = minimise(Polyhedron(M, {"box": 9 - x**2 - y**2 - z**2}), y**2 + z**2 - x**2, [0, 1, 1])
    assert abs(inner.point) == pytest.approx([3, 0, 0], abs=1e-9)


@pytest.mark.usefixtures("everything_sparse")
def test_circles_and_rotations():
    """A rotation that turns one axis as far down as a wall allows, and a pendulum on a circle."""
    M = Manifold.rotation("a") * Manifold(("phi",), periods=(2 * math.pi,))
    turned = M.matrix()
    phi = M.symbols[-1]
    D = Polyhedron(M, {"wall": turned[2, 2] + sympy.Rational(1, 2)})
    E = turned[2, 2] - 2 * sympy.cos(phi) + turned[1, 0] ** 2
    start = np.array([1.0, 0.1, 0.2, 0.05])
    found = minimise(D, E, [*start / np.linalg.norm(start), 2.5])
    assert found.energy == pytest.approx(-2.5, abs=1e-9)
    assert found.point[-1] == pytest.approx(0, abs=1e-9)
    assert found.multipliers["wall"] == pytest.approx(1, abs=1e-8)
    assert found.verdict in {Verdict.MINIMUM_ALONG_LOCUS, Verdict.UNDECIDED}


def test_multiplier_ranges_of_a_redundant_pile():
    """A plate lies on three supports: the force of the middle one is not determined."""
    M = Manifold.euclidean("y t")
    y, t = M.symbols
    D = Polyhedron(M, {"left": y - t, "middle": y, "right": y + t, "stop": 1 - t})
    dense, sparse = certify(D, y, [0.0, 0.0]), analyse_sparse(pose(D, y), np.zeros(2), DEFAULT)
    assert not sparse.independent
    # left + middle + right = 1 and left = right.
    exact = {"left": (0, 0.5), "middle": (0, 1), "right": (0, 0.5)}
    for name, ends in exact.items():
        assert sparse.named_ranges[name] == pytest.approx(ends, abs=1e-7)
        assert dense.multiplier_ranges[name] == pytest.approx(ends, abs=1e-7)


def test_large_unions_are_refused_in_words():
    M = Manifold.euclidean([f"x{i}" for i in range(1100)])
    x = M.symbols
    D = Polyhedron(M, AllOf(*[AnyOf(a, b - 1) for a, b in itertools.pairwise(x[:900])]))
    with pytest.raises(ValueError, match="expected no unions, as sparse matrices need"):
        minimise(D, sympy.Add(*x), np.ones(1100))


def test_a_sum_of_functions_is_one_function():
    M = Manifold.euclidean("x y z")
    x, y, z = M.symbols
    k = sympy.Symbol("k")
    terms = [
        SmoothFunction("a", k * x * y, M, parameters={"k": 2.0}),
        SmoothFunction("b", k * z**2, M, parameters={"k": 3.0}),
    ]
    total = SmoothFunction.sum("total", terms)
    q = np.array([[1.0, 2.0, 3.0], [-1.0, 0.5, 2.0]])
    whole = SmoothFunction("whole", 2 * x * y + 3 * z**2, M)
    assert total.value(q) == pytest.approx(whole.value(q))
    assert total.gradient(q) == pytest.approx(whole.gradient(q))
    assert total.hessian(q) == pytest.approx(whole.hessian(q))
    assert len(SmoothFunction.sum("again", [total, terms[0]]).terms) == 3
    with pytest.raises(ValueError, match="at least one function"):
        SmoothFunction.sum("none", [])


def test_sums_are_taken_term_by_term():
    M = Manifold.euclidean([f"x{i}" for i in range(150)])
    x = M.symbols
    springs = [(b - a) ** 2 for a, b in itertools.pairwise(x)]
    E = pose(Polyhedron(M, {"floor": x[0]}), sympy.Add(5, *springs)).energy
    assert len(E.terms) == 149
    assert E.value(np.arange(150.0)) == pytest.approx(154)
