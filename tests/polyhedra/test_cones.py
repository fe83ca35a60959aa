"""Ranks, null spaces, inward directions and rays of cones given by their facets' normals."""

import itertools
from fractions import Fraction

import numpy as np
import oracles
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from polycorner.polyhedra.cones import (
    extreme_rays,
    independent_rows,
    inward_direction,
    null_space,
    rank,
    unit_rows,
)


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


class TestIndependentRows:
    @given(integer_matrices((1, 6), (1, 5)))
    def test_they_are_independent_and_span_the_rows(self, matrix):
        units = unit_rows(matrix)
        chosen = independent_rows(units, 1e-8)
        full = oracles.exact_rank(matrix)
        assert len(chosen) == len(set(chosen)) == full
        if chosen:
            assert oracles.exact_rank(matrix[chosen]) == full

    @given(arrays(np.float64, (5, 3), elements=st.floats(-1, 1)))
    def test_the_first_is_the_longest_and_what_is_left_shrinks(self, matrix):
        assume(np.linalg.norm(matrix, axis=1).max() > 0.1)
        chosen = independent_rows(matrix, 1e-6)
        sizes = np.linalg.norm(matrix, axis=1)
        assert sizes[chosen[0]] == pytest.approx(sizes.max(), rel=1e-14)
        left = []
        for k, row in enumerate(chosen):
            before = np.linalg.qr(matrix[chosen[:k]].T)[0] if k else np.zeros((3, 0))
            left.append(np.linalg.norm(matrix[row] - before @ (before.T @ matrix[row])))
        assert all(a >= b - 1e-9 for a, b in itertools.pairwise(left))
        assert min(left) > 1e-6

    def test_nothing_is_chosen_from_nothing(self):
        assert independent_rows(np.empty((0, 3)), 1e-8) == []
        assert independent_rows(np.zeros((2, 3)), 1e-8) == []


def exact_rays(rows):
    """Return the extreme rays of ``{d : rows d >= 0}`` and their tight rows, in the fractions.

    A ray is the null line of ``n - 1`` independent rows, in the direction that all rows allow.
    """
    rows = [[Fraction(int(x)) for x in row] for row in rows]
    n = len(rows[0])
    found = {}
    for chosen in itertools.combinations(rows, n - 1):
        minors = [
            (-1) ** k * _determinant([[x for j, x in enumerate(row) if j != k] for row in chosen])
            for k in range(n)
        ]
        if not any(minors):
            continue
        for sign in (1, -1):
            slopes = [sign * sum(a * d for a, d in zip(row, minors, strict=True)) for row in rows]
            if min(slopes) >= 0:
                d = np.array([float(sign * x) for x in minors])
                tight = frozenset(i for i, slope in enumerate(slopes) if slope == 0)
                found[tight] = d / np.linalg.norm(d)
    return found


def _determinant(rows):
    if not rows:
        return Fraction(1)
    return sum(
        (-1) ** k * x * _determinant([[y for j, y in enumerate(r) if j != k] for r in rows[1:]])
        for k, x in enumerate(rows[0])
    )


class TestExtremeRays:
    @given(st.integers(2, 4).flatmap(lambda n: integer_matrices((n, n + 5), (n, n))))
    def test_they_are_those_found_by_trying_every_line(self, matrix):
        """Whatever the cone: simplicial, not simplicial, flat, a single ray, the origin alone."""
        matrix = matrix[abs(matrix).sum(axis=1) > 0]
        n = matrix.shape[1]
        assume(len(matrix) > 0)
        assume(oracles.exact_rank(matrix) == n)
        expected = exact_rays(matrix)
        found = extreme_rays(matrix, 1e-9)
        assert sorted(map(sorted, (tight for _, tight in found))) == sorted(map(sorted, expected))
        for d, tight in found:
            np.testing.assert_allclose(d, expected[tight], atol=1e-12)

    @pytest.mark.parametrize("sides", [3, 4, 6, 11])
    def test_a_round_cone_has_as_many_rays_as_sides(self, sides):
        angles = 2 * np.pi * np.arange(sides) / sides
        rows = np.column_stack([np.cos(angles), np.sin(angles), np.ones(sides)])
        found = extreme_rays(rows, 1e-9)
        assert len(found) == sides
        assert {tight for _, tight in found} == {
            frozenset((k, (k + 1) % sides)) for k in range(sides)
        }
        for d, _ in found:
            assert np.linalg.norm(d) == pytest.approx(1)
            assert (rows @ d).min() > -1e-12

    @given(integer_matrices((4, 7), (3, 3)), st.permutations(range(7)), st.floats(0.01, 100))
    def test_order_and_length_of_the_rows_do_not_matter(self, matrix, order, size):
        matrix = matrix[abs(matrix).sum(axis=1) > 0]
        assume(len(matrix) > 0)
        assume(oracles.exact_rank(matrix) == 3)
        order = [k for k in order if k < len(matrix)]
        one = {tight: d for d, tight in extreme_rays(matrix, 1e-9)}
        other = {
            frozenset(order[k] for k in tight): d
            for d, tight in extreme_rays(size * matrix[order], 1e-9)
        }
        assert one.keys() == other.keys()
        for tight, d in one.items():
            np.testing.assert_allclose(other[tight], d, atol=1e-12)

    def test_the_cone_over_a_cube(self):
        """The cone over a cube, from its six facets: a ray through every corner."""
        rows = np.array([[*(s * e), 1] for s in (1, -1) for e in np.eye(3)])
        found = extreme_rays(rows, 1e-9)
        corners = {tuple((d[:3] / d[3]).round(9)) for d, _ in found}
        assert corners == set(itertools.product((1.0, -1.0), repeat=3))
