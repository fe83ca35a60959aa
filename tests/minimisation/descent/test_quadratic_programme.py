"""Quadratic programmes against programmes solved by trying every face."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from oracles_minima import quadratic_programme
from stages import callable_stage

from polycorner.minimisation.descent import linear_algebra
from polycorner.minimisation.descent import quadratic_programme as stage

solve_quadratic = callable_stage(stage.solve_quadratic)

whole = st.integers(-2, 2).map(float)
real = st.floats(-3, 3).filter(lambda x: x == 0 or abs(x) > 1e-3)


@st.composite
def programmes(draw, *, most=4, equations=(0, 2)):
    """Small programmes: whole or real numbers, repeated and opposite rows, met or missed at 0."""
    n = draw(st.integers(1, 4))
    e = draw(st.integers(*equations))
    rows = draw(st.integers(0, most)) + e
    entries = draw(st.sampled_from([whole, real]))
    A = draw(arrays(float, (rows, n), elements=entries))
    if rows > 1 and draw(st.booleans()):
        i, j = draw(st.permutations(range(rows)))[:2]
        A[i] = A[j] * draw(st.sampled_from([1.0, -1.0, 2.0]))
    lengths = np.linalg.norm(A, axis=1)
    assume((lengths > 0.1).all())
    b = draw(arrays(float, rows, elements=entries))
    if draw(st.booleans()):
        b[rows - e :] = -A[rows - e :] @ draw(arrays(float, n, elements=entries))
    root = draw(arrays(float, (n, n), elements=real))
    B = root @ root.T + 0.1 * np.eye(n)
    g = draw(arrays(float, n, elements=real))
    return B, g, A / lengths[:, None], b / lengths, e


def check_programme(programme):
    B, g, A, b, e = programme
    feasible, d, lam = solve_quadratic(np.linalg.cholesky(B), g, A, b, e)
    expected = quadratic_programme(*programme)
    assert feasible == (expected is not None)
    if expected is None:
        return
    rows = len(A)
    assert d == pytest.approx(expected, abs=1e-7 * (1 + abs(expected).max()))
    size = 1 + abs(lam).max(initial=0)
    assert B @ d + g == pytest.approx(A.T @ lam, abs=1e-9 * size * np.linalg.cond(B) ** 0.5)
    assert lam[: rows - e].min(initial=0) >= -1e-12 * size
    slack = A @ d + b
    assert slack[: rows - e].min(initial=0) >= -1e-9 * size
    assert abs(slack[rows - e :]).max(initial=0) <= 1e-9 * size
    assert abs(lam * slack).max(initial=0) <= 1e-8 * size**2


@given(programmes())
def test_quadratic_programme_has_the_minimiser_of_its_best_face(programme):
    check_programme(programme)


@given(programmes(most=0, equations=(1, 3)))
def test_quadratic_programme_meets_equations_without_inequalities(programme):
    check_programme(programme)


@given(programmes(most=0, equations=(0, 0)))
def test_quadratic_programme_without_rows_is_newtons_step(programme):
    B, g, *_ = programme
    _, d, _ = solve_quadratic(np.linalg.cholesky(B), *programme[1:])
    assert B @ d == pytest.approx(-g, abs=1e-8 * (1 + abs(d).max()))


# ----------------------------------------------------------------------------------- linear algebra

svd, solve_truncated, cholesky, forward, backward = map(
    callable_stage,
    (
        linear_algebra.svd,
        linear_algebra.solve_truncated,
        linear_algebra.cholesky,
        linear_algebra.forward,
        linear_algebra.backward,
    ),
)


@st.composite
def matrices(draw):
    """Matrices of every shape up to 6 by 6, of full rank or not, small or large."""
    m, n = draw(st.integers(1, 6)), draw(st.integers(1, 6))
    r = draw(st.integers(0, min(m, n)))
    left = draw(arrays(float, (m, r), elements=real))
    right = draw(arrays(float, (r, n), elements=real))
    return left @ right * 10.0 ** draw(st.integers(-9, 9))


@given(matrices())
def test_singular_values_are_numpys_and_the_factors_multiply_back(A):
    U, s, V = svd(A)
    top = max(abs(A).max(), 1e-300)
    assert (U * s) @ V.T / top == pytest.approx(A / top, abs=1e-13)
    assert V.T @ V == pytest.approx(np.eye(A.shape[1]), abs=1e-14)
    reference = np.linalg.svd(A, compute_uv=False)
    ours = np.sort(s)[::-1]
    assert ours[: len(reference)] / top == pytest.approx(reference / top, abs=1e-13)
    assert ours[len(reference) :] / top == pytest.approx(0, abs=1e-13)


@given(matrices(), st.integers(0, 2**32 - 1))
def test_truncated_solution_is_the_shortest_least_squares_solution(A, seed):
    singular = np.linalg.svd(A, compute_uv=False)
    top = max(singular[0], 1e-300)
    # A singular value on the threshold is cut by one and kept by the other.
    assume(not ((singular / top > 1e-12) & (singular / top < 1e-3)).any())
    b = np.random.default_rng(seed).normal(size=len(A))
    x = solve_truncated(A, b, 1e-8 * top)
    expected = np.linalg.lstsq(A, b, rcond=1e-8)[0]
    assert x * top == pytest.approx(expected * top, abs=1e-8 * (1 + abs(expected * top).max()))


@given(st.integers(0, 2**32 - 1), st.integers(1, 6))
def test_cholesky_and_its_triangular_solutions_invert(seed, n):
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(n, n))
    B, b = root @ root.T + np.eye(n), rng.normal(size=n)
    L = np.zeros((n, n))
    assert cholesky(B, L)
    x = backward(L, forward(L, b))
    assert B @ x == pytest.approx(b, abs=1e-12)
    assert not cholesky(B - 2 * np.linalg.eigvalsh(B)[0] * np.eye(n), np.zeros((n, n)))
