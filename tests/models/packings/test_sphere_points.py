"""Points on the sphere: energies from the definition, known optima, and proofs modulo rotations."""

import math
from itertools import combinations, product

import numpy as np
import pytest

from polycorner import certify, minimise, prove
from polycorner.models import PointsOnSphere, basin_hopping

TETRAHEDRON = [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]
OCTAHEDRON = [[s * (k == a) for k in range(3)] for a in range(3) for s in (1, -1)]
GOLDEN = (1 + math.sqrt(5)) / 2
ICOSAHEDRON = [
    np.roll([0, s, t * GOLDEN], k) for k in range(3) for s, t in product((1, -1), repeat=2)
]
REGULAR = {4: TETRAHEDRON, 6: OCTAHEDRON, 12: ICOSAHEDRON}


@pytest.mark.parametrize("problem", ["tammes", "thomson"])
def test_energies_are_those_of_the_definition(problem):
    model, rng = PointsOnSphere(5, problem), np.random.default_rng(3)
    for q in model.starts(rng, 4):
        vectors = model.vectors(q)
        pairs = list(combinations(vectors, 2))
        expected = sum(1 / math.dist(p, o) for p, o in pairs)
        if problem == "tammes":
            expected = max(1 - math.dist(p, o) ** 2 / 2 for p, o in pairs)
        assert model.energy.value(q) == pytest.approx(expected, rel=1e-12)
        assert model.polyhedron.contains(q, tolerance=1e-12)
        turned = model.vectors(model.moved(q, rng))
        assert np.linalg.norm(turned, axis=1) == pytest.approx(np.ones(5))


def test_the_cosine_bounds_every_pair():
    model = PointsOnSphere(3, "tammes")
    q = model.starts(np.random.default_rng(0), 1)[0]
    cosines = [float(p @ o) for p, o in combinations(model.vectors(q), 2)]
    for c in (*cosines, max(cosines) + 0.1, min(cosines) - 0.1):
        inside = all(c >= other - 1e-12 for other in cosines)
        assert bool(model.polyhedron.contains([*q[:-1], c], tolerance=1e-10)) == inside


@pytest.mark.parametrize("problem", ["tammes", "thomson"])
@pytest.mark.parametrize("count", [4, 6])
def test_platonic_solids_are_found_and_proved(problem, count):
    model = PointsOnSphere(count, problem)
    known = float(model.energy.value(model.point(REGULAR[count])))
    found = basin_hopping(model, 1, hops=20, below=known)
    assert found.energy == pytest.approx(known, abs=1e-9)
    take = certify if problem == "tammes" else minimise
    certificate = take(model.polyhedron, model.energy, model.point(REGULAR[count]))
    proof = prove(certificate, symmetry=model.symmetry)
    assert proof.proved, proof.conditions
    low, high = map(float, proof.enclosures["energy"])
    assert low - 1e-15 <= known + 1e-12
    assert high >= known - 1e-12


def test_the_icosahedron_is_best_for_both():
    tammes, thomson = (PointsOnSphere(12, problem) for problem in ("tammes", "thomson"))
    assert tammes.energy.value(tammes.point(ICOSAHEDRON)) == pytest.approx(1 / math.sqrt(5))
    known = float(thomson.energy.value(thomson.point(ICOSAHEDRON)))
    assert basin_hopping(tammes, 0, hops=10, below=1 / math.sqrt(5)).energy == pytest.approx(
        1 / math.sqrt(5), abs=1e-9
    )
    assert basin_hopping(thomson, 0, hops=10, below=known).energy == pytest.approx(known, abs=1e-9)


@pytest.mark.parametrize("problem", ["tammes", "thomson"])
def test_fields_turn_all_vectors_alike(problem):
    model = PointsOnSphere(3, problem)
    q = model.starts(np.random.default_rng(1), 1)[0]
    fields = model.symmetry.directions(model.manifold, q) * model.manifold.scale_array
    for field in fields:
        velocities = field[:9].reshape(3, 3)
        for (p, v), (o, w) in combinations(zip(model.vectors(q), velocities, strict=True), 2):
            assert v @ p == pytest.approx(0, abs=1e-12)
            assert v @ o + p @ w == pytest.approx(0, abs=1e-12)
    assert np.linalg.matrix_rank(fields) == 3


@pytest.mark.parametrize(
    ("make", "argument"),
    [
        (lambda: PointsOnSphere(1, "tammes"), "count"),
        (lambda: PointsOnSphere(3, "thompson"), "problem"),
        (lambda: PointsOnSphere(2, "tammes").point([[0, 0, 1], [0, 0, 0]]), "vectors"),
        (lambda: PointsOnSphere(2, "tammes").point([[0, 0, 1]]), "vectors"),
    ],
)
def test_wrong_arguments(make, argument):
    with pytest.raises((TypeError, ValueError), match=f"^{argument}: expected "):
        make()
