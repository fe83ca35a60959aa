"""Quadratic programmes against programmes solved by trying every face."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from oracles_minima import quadratic_programme
from stages import callable_stage

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
