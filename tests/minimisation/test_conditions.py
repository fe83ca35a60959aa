"""Second order: forms on cones, vanishing forms, loci."""

import numpy as np
import pytest
import sympy as sp
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from oracles_minima import least_on_cone
from polynomials import linear, quadratic

from polycorner import Manifold, Polyhedron, Verdict, certify, minimise
from polycorner.minimisation.conditions import least_directions, simplex_minimisers

M2, M3 = Manifold.euclidean("x y"), Manifold.euclidean("x y z")
x, y, z = M3.symbols
QUADRANT = Polyhedron(M2, {"right": x, "up": y})


# ------------------------------------------------------- second order on a cone that is no space


entries = st.floats(-3, 3)


@given(st.tuples(entries, entries, entries))
def test_a_form_on_a_quadrant_is_a_minimum_when_copositive(numbers):
    a, b, c = numbers
    form = np.array([[a, b], [b, c]])
    least = least_on_cone(form, np.eye(2), count=20_001)
    assume(abs(least) > 0.01)
    found = certify(QUADRANT, quadratic(M2, form), [0, 0])
    assert found.verdict is (Verdict.WEAK_MINIMUM if least > 0 else Verdict.SADDLE)
    assert found.multipliers == {"right": 0, "up": 0}


@given(
    arrays(float, (3, 3), elements=st.floats(-2, 2)),
    arrays(float, (4, 3), elements=st.floats(-1, 1)),
    st.integers(1, 4),
)
def test_a_form_on_any_cone_is_a_minimum_when_copositive(matrix, rows, count):
    rows = rows[:count]
    assume((np.linalg.norm(rows, axis=1) > 0.2).all())
    assume((rows @ _inward(rows) > 0.2 * np.linalg.norm(rows, axis=1)).all())
    form = matrix + matrix.T
    least = least_on_cone(form, rows, count=60_001)
    assume(abs(least) > 0.05)
    D = Polyhedron(M3, [linear(M3, row, 0.0, f"c{i}") for i, row in enumerate(rows)])
    found = certify(D, quadratic(M3, form), [0, 0, 0])
    assert found.verdict is (Verdict.WEAK_MINIMUM if least > 0 else Verdict.SADDLE)


def _inward(rows):
    """Return a direction that leads inward from every row, or one that does not."""
    directions = np.random.default_rng(0).normal(size=(2000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return directions[(directions @ rows.T).min(axis=1).argmax()]


def test_a_form_that_vanishes_on_the_cones_edges_is_a_minimum_along_them():
    # x y is nowhere negative on the quadrant and zero along both axes.
    assert certify(QUADRANT, x * y, [0, 0]).verdict is Verdict.MINIMUM_ALONG_LOCUS


def test_a_square_that_vanishes_inside_the_cone_is_a_minimum_along_it():
    c = certify(QUADRANT, (x - y) ** 2, [0, 0])
    assert c.verdict is Verdict.MINIMUM_ALONG_LOCUS


@pytest.mark.parametrize("slope", [-0.9, 0.9, 1.1, 3.0])
def test_strongly_active_faces_leave_only_their_own_plane(slope):
    # E = z + slope^2 x^2 - y^2 on z >= 0, x >= |y|: along the cone's sides E = (slope^2 - 1) x^2.
    D = Polyhedron(M3, {"floor": z, "left": x - y, "right": x + y})
    c = certify(D, z + slope**2 * x**2 - y**2, [0, 0, 0])
    assert c.verdict is (Verdict.WEAK_MINIMUM if slope**2 > 1 else Verdict.SADDLE)
    assert c.multipliers["floor"] == pytest.approx(1, abs=1e-14)


# ---------------------------------------------------------------- where the second order vanishes


FLOOR = Polyhedron(M3, {"floor": y})


@pytest.mark.parametrize("power", range(3, 13))
@pytest.mark.parametrize("sign", [1, -1])
def test_the_first_term_that_does_not_vanish_decides(power, sign):
    c = certify(FLOOR, y + z**2 + sign * x**power, [0, 0, 0])
    rises = sign > 0 and power % 2 == 0
    assert c.verdict is (Verdict.STRICT_MINIMUM if rises else Verdict.SADDLE)
    assert c.signature == (1, 1, 1)
    assert not c.lemma[3].holds
    assert f"terms of degree {power} decide" in c.explain()


@pytest.mark.parametrize(
    "energy",
    [
        x * z * (x - z),
        x**3 - 3 * x * z**2,
        -(x**2) * z**2,
        -((x * z * (x - z)) ** 2),
        -(x**4) / 10**7,
        -(x**4) + 10**6,
    ],
    ids=str,
)
def test_an_energy_that_falls_is_never_called_a_minimum(energy):
    assert not certify(FLOOR, y**2 + y + energy, [0, 0, 0]).is_minimum
    assert not certify(Polyhedron(M3, {"far": y + 5}), y**2 + energy, [0, 0, 0]).is_minimum


@pytest.mark.parametrize(
    ("energy", "point"),
    [
        (sp.S.Zero, (1, 0, 2)),
        ((x**2 + z**2 - 1) ** 2, (1, 0, 0)),
        (sp.cos(x + z), (np.pi / 2, 0, np.pi / 2)),
        ((x + z**2) ** 2, (0, 0, 0)),
        ((x + x * z + z**2 / 4) ** 2, (0, 0, 0)),
        ((x + z - z**2) ** 2, (0, 0, 0)),
    ],
    ids=str,
)
def test_an_energy_constant_along_a_locus_is_recognised(energy, point):
    c = certify(FLOOR, y + energy, point)
    assert c.verdict is Verdict.MINIMUM_ALONG_LOCUS


@given(st.floats(-1, 1), st.floats(0.1, 1))
def test_an_inflection_is_never_called_a_minimum(start, height):
    c = minimise(Polyhedron(M2, {"floor": y}), x**3 + y, [start, height], max_iterations=60)
    assert not c.is_minimum


def test_a_bent_locus_of_two_dimensions_is_recognised():
    far = Polyhedron(M3, {"far": x + 100})
    c = certify(far, (x + x * z + y**2 / 4) ** 2, [0, 0, 0])
    assert c.verdict is Verdict.MINIMUM_ALONG_LOCUS
    assert c.signature == (0, 1, 2)


@pytest.mark.parametrize("seed", range(4))
def test_ranges_of_multipliers_have_the_signs_of_multipliers(seed):
    """Of six walls through a point in space some may carry nothing: their least multiplier is 0."""
    walls = np.random.default_rng(seed).normal((0.0, 0.0, 2.0), size=(6, 3))
    cone = Polyhedron(M3, [float(a) * x + float(b) * y + float(c) * z for a, b, c in walls])
    pull = walls[:4].sum(axis=0)
    found = certify(cone, float(pull[0]) * x + float(pull[1]) * y + float(pull[2]) * z, [0, 0, 0])
    assert len(found.multiplier_ranges) == 6
    assert min(low for low, _ in found.multiplier_ranges.values()) == 0.0


# ------------------------------------------------------------------------------------- copositivity

HORN = np.array(
    [
        [1, -1, 1, 1, -1],
        [-1, 1, -1, 1, 1],
        [1, -1, 1, -1, 1],
        [1, 1, -1, 1, -1],
        [-1, 1, 1, -1, 1],
    ],
    dtype=float,
)


def hildebrand(angles):
    """Return the extreme copositive matrix of order five with five angles of sum below pi."""
    a = np.asarray(angles)
    form = np.eye(5)
    for i in range(5):
        near, far = -np.cos(a[i]), np.cos(a[i] + a[(i + 1) % 5])
        form[i, (i + 1) % 5] = form[(i + 1) % 5, i] = near
        form[i, (i + 2) % 5] = form[(i + 2) % 5, i] = far
    return form


def rotated(form, generator):
    """Return the form with its rows and columns permuted and rescaled: as copositive as before."""
    order = generator.permutation(len(form))
    scale = generator.uniform(0.5, 2, len(form))
    return (form * np.outer(scale, scale))[np.ix_(order, order)]


def sampled(form, count=40_000, seed=0):
    """Return the least value on points of the simplex, corners and edges included."""
    k = len(form)
    generator = np.random.default_rng(seed)
    points = generator.dirichlet(np.full(k, 0.4), size=count)
    points *= generator.random((count, k)) < generator.random((count, 1))
    points = points[points.sum(axis=1) > 0]
    points /= points.sum(axis=1)[:, None]
    return np.einsum("ni,ij,nj->n", points, form, points).min()


@pytest.mark.parametrize("seed", range(6))
def test_the_horn_form_is_copositive_and_not_strictly(seed):
    form = rotated(HORN, np.random.default_rng(seed))
    points, values = simplex_minimisers(form)
    assert values.min() == pytest.approx(0, abs=1e-14)
    zeros = points[abs(values) < 1e-13]
    assert len(zeros) == 5  # e_i + e_{i+1}, up to the scale
    assert ((zeros > 0).sum(axis=1) == 2).all()
    assert simplex_minimisers(form + 1e-6)[1].min() > 1e-7
    assert simplex_minimisers(form - 1e-6)[1].min() < -1e-7


@given(arrays(float, 5, elements=st.floats(0.15, 0.6)))
def test_hildebrands_forms_are_copositive_with_interior_zeros(angles):
    form = hildebrand(angles)
    points, values = simplex_minimisers(form)
    assert values.min() == pytest.approx(0, abs=1e-12)
    assert ((points[abs(values) < 1e-12] > 0).sum(axis=1) == 3).sum() == 5


@given(st.integers(2, 7), st.integers(0, 2**32 - 1))
def test_the_least_value_is_a_lower_bound_that_is_attained(k, seed):
    generator = np.random.default_rng(seed)
    raw = generator.normal(size=(k, k)) * generator.choice([1, 3])
    form = raw + raw.T + generator.uniform(0, 4) * np.eye(k)
    points, values = simplex_minimisers(form)
    assert (points >= 0).all()
    assert points.sum(axis=1) == pytest.approx(1)
    assert np.einsum("ni,ij,nj->n", points, form, points) == pytest.approx(values, abs=1e-9)
    if values.min() > 0 and np.linalg.eigvalsh(form)[0] > 0:
        return  # definite: only the sign is claimed
    assert values.min() <= sampled(form) + 1e-12


@given(st.integers(2, 12), st.integers(0, 2**32 - 1))
def test_sums_of_squares_and_positive_products_are_copositive(k, seed):
    generator = np.random.default_rng(seed)
    factor = generator.normal(size=(k, max(1, k // 2)))
    product = abs(generator.normal(size=(k, k)))
    form = factor @ factor.T + product + product.T
    form[np.diag_indices(k)] -= 2 * np.diag(product)
    assert simplex_minimisers(form)[1].min() >= -1e-12 * abs(form).max()


@given(
    arrays(float, (3, 3), elements=st.floats(-2, 2)),
    st.integers(1, 6),
    st.integers(0, 2**32 - 1),
)
def test_the_sign_on_any_cone_is_that_of_samples(raw, count, seed):
    generator = np.random.default_rng(seed)
    form = raw + raw.T
    rows = generator.normal(size=(count, 3)) + np.array([0.7, 0, 0])
    rows /= np.linalg.norm(rows, axis=1)[:, None]
    points = generator.normal(size=(60_000, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    inside = points[(points @ rows.T >= 0).all(axis=1)]
    assume(len(inside) > 500)
    least, _, decided = least_directions(form, rows, 1e-9, 1e-9)
    seen = np.einsum("ni,ij,nj->n", inside, form, inside).min()
    assert decided
    if abs(seen) > 0.05:
        assert np.sign(least) == np.sign(seen)
    if seen < 0:
        assert least >= np.linalg.eigvalsh(form)[0] - 1e-9


def test_a_line_that_pulls_is_a_way_down():
    # s z on s >= 0, z free: not copositive, though it vanishes on both axes.
    form = np.array([[0.0, 0.5], [0.5, 0.0]])
    least, _, decided = least_directions(form, np.array([[1.0, 0.0]]), 1e-9, 1e-9)
    assert decided
    assert least == pytest.approx(-0.5)
