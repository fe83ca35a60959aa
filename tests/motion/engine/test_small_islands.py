"""Small islands: their linear systems, and how many rows they may have."""

import numpy as np
import pytest

from polycorner import Manifold, Polyhedron
from polycorner.motion import Disc, Friction, System, simulate
from polycorner.motion.contacts import velocities
from polycorner.motion.engine import small_islands
from polycorner.motion.engine.small_islands import ROWS, WIDTH
from tests.support.stages import callable_stage

solve = callable_stage(small_islands.solve)


@pytest.mark.parametrize("n", range(1, WIDTH + 1))
def test_small_systems_are_solved(n):
    rng = np.random.default_rng(n)
    for _ in range(20):
        A = rng.normal(size=(n, n)) + 3 * n * np.eye(n)
        matrix, b = np.zeros((WIDTH, WIDTH)), np.zeros(WIDTH)
        matrix[:n, :n], b[:n] = A, rng.normal(size=n)
        expected = np.linalg.solve(A, b[:n])
        assert solve(matrix.ravel(), b, n)
        np.testing.assert_allclose(b[:n], expected, rtol=1e-12)
        assert not b[n:].any()


def test_a_matrix_without_a_pivot_is_refused():
    assert not solve(np.zeros(WIDTH * WIDTH), np.ones(WIDTH), 3)


@pytest.mark.parametrize("copies", [1, ROWS // 3, ROWS // 3 + 1, 2 * ROWS])
def test_a_block_slides_alike_on_any_number_of_floors(copies):
    """A floor several times, each with its friction: more rows than a small island may have.

    The friction of the floors adds up to that of one: the block stops after ``v^2 / (2 mu g)``.
    """
    M = Manifold.euclidean("x z")
    (_, z), (vx, vz) = M.symbols, velocities(M)
    speed, mu, gravity = 2.0, 0.5, 10.0
    block = System(
        Polyhedron(M, {f"floor{i}": z + i * z**2 for i in range(copies)}),
        (vx**2 + vz**2) / 2,
        gravity * z,
        friction=tuple(
            Friction(f"grip{i}", (vx, 0 * vx), Disc(mu), f"floor{i}") for i in range(copies)
        ),
    )
    run = simulate(block, block.state([0.0, 0.0], [speed, 0.0]), 0.6, 1e-3)
    assert run.effort.unconverged == 0
    np.testing.assert_allclose(run.q[-1].ravel(), [speed**2 / (2 * mu * gravity), 0.0], atol=1e-6)
    assert not run.v[-1].any()
