"""The sparse analysis beside that with full matrices, and known corners."""

import itertools
import math

import numpy as np
import pytest
from scipy.sparse import csr_array

from polycorner import Manifold, Polyhedron, Verdict, certify, minimise
from polycorner.minimisation.analysis import analyse_sparse
from polycorner.minimisation.problem import pose
from polycorner.minimisation.sparse.factorisation import negative_eigenvalues, rank
from polycorner.tolerances import DEFAULT

# Largest least distance of N points in a unit square, as published: packomania.com.
DISTANCES = {
    2: 1.414213562373095,
    3: 1.035276180410083,
    4: 1.0,
    5: 0.707106781186548,
    6: 0.600925212577332,
    7: 0.535898384862245,
    8: 0.517638090205041,
    9: 0.5,
    10: 0.421279543983903,
    11: 0.398207310236844,
    12: 0.388730126323020,
}


def square(count):
    """Return the polyhedron and the energy of points in a square with their least distance."""
    names = [f"{a}{i}" for i in range(count) for a in "xy"]
    M = Manifold.euclidean([*names, "m"])
    *places, m = M.symbols
    points = list(zip(places[::2], places[1::2], strict=True))
    parts = {
        f"{i}-{j}": (points[i][0] - points[j][0]) ** 2 + (points[i][1] - points[j][1]) ** 2 - m**2
        for i, j in itertools.combinations(range(count), 2)
    }
    for i, (x, y) in enumerate(points):
        parts |= {f"{i} left": x, f"{i} right": 1 - x, f"{i} low": y, f"{i} high": 1 - y}
    parts["m"] = m
    return Polyhedron(M, parts), -m


@pytest.mark.parametrize("count", DISTANCES)
def test_densest_packings_in_a_square_are_certified(count):
    D, E = square(count)
    rng = np.random.default_rng(count)
    for _ in range(400):
        start = np.append(rng.random(2 * count), 0.05)
        best = minimise(D, E, start)
        if best.energy < -DISTANCES[count] + 1e-9:
            break
    assert -best.energy == pytest.approx(DISTANCES[count], abs=1e-10)
    # A free point that happens to lie on a wall is beyond the analysis with full matrices.
    assert best.is_minimum or (count in {7, 11} and best.verdict is Verdict.UNDECIDED)
    found = analyse_sparse(best.problem, best.point, DEFAULT)
    assert found.verdict.is_minimum
    assert found.names == best.active


def icosahedron():
    golden = (1 + math.sqrt(5)) / 2
    corners = [np.roll([0.0, a, b * golden], k) for k in range(3) for a in (1, -1) for b in (1, -1)]
    return np.array(corners) / math.hypot(1, golden)


def test_twelve_spheres_around_one():
    """On a sphere of radius 1 the least distance of 12 points is largest at an icosahedron."""
    points = icosahedron()
    names = [f"{a}{i}" for i in range(12) for a in "xyz"]
    M = Manifold.euclidean([*names, "t"])
    *places, t = M.symbols
    centres = [places[3 * i : 3 * i + 3] for i in range(12)]

    def squared(i, j):
        return sum((a - b) ** 2 for a, b in zip(centres[i], centres[j], strict=True))

    near = [(i, j) for i, j in itertools.combinations(range(12), 2)]
    edge = min(float(((points[i] - points[j]) ** 2).sum()) for i, j in near)
    spheres = {f"on {i}": sum(x**2 for x in c) - 1 for i, c in enumerate(centres)}
    # No rotation: one point does not move, and a second one moves in a plane only.
    held = {"y0": centres[0][1] - points[0][1], "x0": centres[0][0] - points[0][0]}
    normal = np.cross(points[0], points[1])
    held["turn"] = sum(float(n) * x for n, x in zip(normal, centres[1], strict=True))
    D = Polyhedron(M, {f"{i}-{j}": squared(i, j) - t for i, j in near}, spheres | held)
    q = np.append(points.ravel(), edge)
    problem = pose(D, -t)
    found = analyse_sparse(problem, q, DEFAULT)
    assert len(found.active) == 30
    assert found.verdict is certify(D, -t, q).verdict is Verdict.STRICT_MINIMUM
    assert found.rank == 37  # a corner
    assert len(found.active) + 15 - 37 == 8  # states of self-stress beside the normalised one
    assert not found.independent
    values = found.named_multipliers
    assert [values[name] for name in found.names] == pytest.approx([1 / 30] * 30, abs=1e-9)
    assert math.sqrt(edge) > 1.05  # so the twelve have room: their diameter is below 1


@pytest.mark.parametrize("seed", range(20))
def test_rank_and_inertia_are_those_of_full_matrices(seed):
    rng = np.random.default_rng(seed)
    k, n, r = rng.integers(1, 30, 3)
    left, right = rng.normal(size=(k, min(r, k, n))), rng.normal(size=(min(r, k, n), n))
    matrix = left @ right
    assert rank(csr_array(matrix), 1e-6) == np.linalg.matrix_rank(matrix)
    full = rng.normal(size=(n, n))
    symmetric = full + full.T
    expected = int((np.linalg.eigvalsh(symmetric) < 0).sum())
    assert negative_eigenvalues(csr_array(symmetric)) in {expected, None}


def chain_of_springs(count, sign=1.0):
    """Return coordinates that are held apart, with a floor under each."""
    M = Manifold.euclidean([f"x{i}" for i in range(count)])
    x = M.symbols
    floors = {f"floor{i}": x[i] for i in range(0, count, 2)}
    energy = sum(x[i] for i in range(0, count, 2))
    energy += sign * sum((x[i] - x[i - 1]) ** 2 for i in range(1, count, 2))
    return Polyhedron(M, floors), energy


@pytest.mark.parametrize(("sign", "verdict"), [(1.0, "STRICT_MINIMUM"), (-1.0, "SADDLE")])
def test_second_order_by_inertia(sign, verdict):
    D, E = chain_of_springs(12, sign)
    q = np.zeros(12)
    found = analyse_sparse(pose(D, E), q, DEFAULT)
    assert found.verdict is certify(D, E, q).verdict is Verdict[verdict]
    assert found.second.dimension == 6


def test_first_order_verdicts():
    M = Manifold.euclidean("x y")
    x, y = M.symbols
    D = Polyhedron(M, {"floor": y, "wall": x})
    for energy, q in [(2 * y - 3 * x, (0, 0)), (x + y, (0, 0)), (x + y, (0, 1)), (x + y, (-1, 0))]:
        found = analyse_sparse(pose(D, energy), np.array(q, dtype=float), DEFAULT)
        assert found.verdict is certify(D, energy, q).verdict


def test_what_is_not_computed_is_refused_with_a_sentence():
    D, E = chain_of_springs(600)
    found = certify(D, E, np.zeros(600))
    assert found.problem.is_sparse
    assert found.verdict is Verdict.STRICT_MINIMUM
    assert found.signature == (300, 300, 0)
    for name in ("curvatures", "entrapment", "stratum"):
        with pytest.raises(ValueError, match=r"computed|full matrices"):
            getattr(found, name)
    assert "300 are active" in found.explain()
    assert "600 coordinates" in repr(found)
