"""Forms on orthants and cones against sampling, exact families and known extreme matrices."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from polycorner.minimisation.conditions import least_directions, simplex_minimisers

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
