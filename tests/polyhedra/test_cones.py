"""Ranks, null spaces and inward directions of cones given by their facets' normals."""

import numpy as np
import oracles
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from polycorner.polyhedra.cones import inward_direction, null_space, rank, unit_rows


def integer_matrices(rows, columns):
    shapes = st.tuples(st.integers(*rows), st.integers(*columns))
    return arrays(np.int64, shapes, elements=st.integers(-3, 3)).map(lambda a: a.astype(float))


NOTHING = np.empty((0, 3))


@given(integer_matrices((1, 5), (1, 6)))
def test_rank_is_the_rank_over_the_fractions(matrix):
    assert rank(matrix, 1e-8) == oracles.exact_rank(matrix)


@given(integer_matrices((1, 4), (2, 5)), st.lists(st.floats(1e-6, 1e6), min_size=4, max_size=4))
def test_rank_does_not_depend_on_the_length_of_the_rows(matrix, lengths):
    stretched = matrix * np.array(lengths[: len(matrix)])[:, None]
    assert rank(stretched, 1e-8) == rank(matrix, 1e-8)


@given(integer_matrices((1, 5), (1, 6)))
def test_the_null_space_is_what_the_rows_annihilate(matrix):
    basis = null_space(matrix, 1e-8)
    n = matrix.shape[1]
    assert basis.shape == (n, n - oracles.exact_rank(matrix))
    np.testing.assert_allclose(matrix @ basis, 0, atol=1e-12)
    np.testing.assert_allclose(basis.T @ basis, np.eye(basis.shape[1]), atol=1e-12)


@pytest.mark.parametrize("matrix", [np.empty((0, 4)), np.zeros((2, 4))])
def test_without_rows_everything_is_in_the_null_space(matrix):
    assert rank(matrix, 1e-8) == 0
    assert null_space(matrix, 1e-8).shape == (4, 4)


@given(integer_matrices((1, 4), (2, 3)))
def test_unit_rows_have_length_one_or_stay_zero(matrix):
    units = unit_rows(matrix)
    sizes = np.linalg.norm(matrix, axis=1)
    np.testing.assert_allclose(np.linalg.norm(units, axis=1), sizes > 0, atol=1e-15)
    np.testing.assert_allclose(units * sizes[:, None], matrix, atol=1e-14)


@given(integer_matrices((1, 4), (3, 3)), integer_matrices((0, 1), (3, 3)))
def test_the_inward_direction_is_the_fastest(inequalities, equations):
    a, e = unit_rows(inequalities), unit_rows(equations)
    fastest = oracles.fastest_rate(a, e)
    d, rate = inward_direction(inequalities, equations)
    assert (abs(d) <= 1 + 1e-9).all()
    assert abs(e @ d).max(initial=0) <= 1e-9
    assert (a @ d >= rate - 1e-9).all()
    assert (rate > 1e-7) == (fastest > 1e-7)
    assert rate == pytest.approx(min(fastest, 1.0), abs=1e-7)


@given(integer_matrices((2, 4), (3, 3)), st.lists(st.floats(0.1, 3), min_size=4, max_size=4))
def test_normals_with_a_vanishing_positive_combination_have_no_inward_direction(normals, weights):
    """Gordan: either ``A d > 0`` has a solution, or ``y A = 0`` with ``y >= 0``, not both."""
    last = -np.array(weights[: len(normals)]) @ normals
    assume(np.linalg.norm(last) > 0.1)
    _, rate = inward_direction(np.vstack([normals, last]), NOTHING)
    assert rate == pytest.approx(0, abs=1e-9)


def test_an_inward_direction_lies_in_the_equations():
    d, rate = inward_direction(np.array([[0.0, 0.0, 1.0]]), np.array([[1.0, 0.0, 1.0]]))
    assert rate == pytest.approx(1)
    assert d[0] == pytest.approx(-d[2])
