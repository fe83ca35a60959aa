"""The least of smooth functions: its smooth energies, its stresses, its corners."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from polycorner.models.disks.critical_points import balance, extreme_stresses, judged, solved
from polycorner.models.disks.disks import TorusDisks
from polycorner.models.disks.smoothing import smooth

SEEDS = st.integers(0, 2**32 - 1)


@given(SEEDS, st.integers(2, 5), st.sampled_from(["square", "hexagonal"]))
def test_grouped_distances_are_the_polyhedrons(seed, count, lattice):
    model = TorusDisks(count, lattice)
    points = np.random.default_rng(seed).uniform(-2, 2, (3, 2 * count))
    values, gradients, hessians = model.distances(points, 2)
    grouped, by_pair, twice = model.pairs.derivatives(points)
    np.testing.assert_array_equal(grouped.reshape(values.shape), values)
    for pair, reads in enumerate(model.pairs.reads):
        rows = slice(9 * pair, 9 * pair + 9)
        np.testing.assert_array_equal(by_pair[:, pair], gradients[:, rows][..., reads])
        block = hessians[:, rows][..., reads[:, None], reads]
        np.testing.assert_array_equal(twice[:, pair], block)


@given(SEEDS, st.floats(1, 1e3))
def test_smooth_energy_from_the_definition(seed, sharpness):
    model = TorusDisks(3, "hexagonal")
    points = np.random.default_rng(seed).random((2, 6))
    (distances,) = model.distances(points, 0)
    at = smooth(model.pairs, points, sharpness)
    least = distances.min(axis=1)
    direct = least - np.log(np.exp(-sharpness * (distances - least[:, None])).sum(1)) / sharpness
    np.testing.assert_allclose(at.energy, direct, atol=1e-12)
    assert (at.energy <= least + 1e-12).all()
    assert (at.energy >= least - np.log(distances.shape[1]) / sharpness - 1e-12).all()
    np.testing.assert_allclose(at.weights.sum(axis=1), 1)


def test_derivatives_of_the_smooth_energy_by_the_order_of_their_error():
    """Along a line the Taylor polynomial of degree two misses by the third power of the step."""
    model, rng = TorusDisks(4), np.random.default_rng(7)
    points, direction = rng.random((1, 8)), rng.normal(size=8)
    at = smooth(model.pairs, points, 20.0)
    steps = 1e-2 / 2.0 ** np.arange(5)
    taylor = at.energy + steps * (at.gradient[0] @ direction)
    taylor += steps**2 / 2 * (direction @ at.hessian[0] @ direction)
    exact = [smooth(model.pairs, points + t * direction, 20.0).energy[0] for t in steps]
    order = np.polyfit(np.log(steps), np.log(abs(taylor - exact)), 1)[0]
    assert order == pytest.approx(3, abs=0.3)


@given(SEEDS, st.integers(2, 6), st.integers(1, 5))
def test_balance_finds_a_stress_where_there_is_one(seed, count, n):
    """Gradients are made so that given positive weights balance them."""
    rng = np.random.default_rng(seed)
    weights = rng.uniform(0.2, 1, count)
    gradients = rng.normal(size=(count, n))
    gradients -= weights @ gradients / weights.sum()
    stress, stresses = balance(gradients)
    np.testing.assert_allclose(stress @ gradients, 0, atol=1e-9)
    assert stress.min() > 0
    assert stress.sum() == pytest.approx(1)
    assert stresses == count - np.linalg.matrix_rank(gradients, tol=1e-7)
    if stresses == 1:
        np.testing.assert_allclose(stress, weights / weights.sum(), atol=1e-6)


@given(SEEDS)
def test_central_stress_has_the_largest_product(seed):
    rng = np.random.default_rng(seed)
    weights = rng.uniform(0.2, 1, 6)
    gradients = rng.normal(size=(6, 2))
    gradients -= weights @ gradients / weights.sum()
    stress, _ = balance(gradients)
    _, _, right = np.linalg.svd(np.column_stack([gradients, np.ones(6)]).T)
    for way in right[3:]:
        for step in (1e-3, -1e-3):
            other = stress + step * stress.min() * way
            assert np.log(other).sum() <= np.log(stress).sum() + 1e-12


@given(SEEDS)
def test_functions_that_cannot_be_loaded_are_not(seed):
    """Two opposite gradients balance; a third, across them, has nothing to balance it."""
    rng = np.random.default_rng(seed)
    turn = rng.uniform(0, 2 * np.pi)
    along = np.array([np.cos(turn), np.sin(turn)])
    across = np.array([-along[1], along[0]]) + rng.normal() * along
    stress, stresses = balance(np.array([along, across, -2 * along]))
    assert stresses == 1
    np.testing.assert_allclose(stress, [2 / 3, 0, 1 / 3], atol=1e-9)


def test_gradients_on_one_side_carry_no_stress():
    stress, stresses = balance(np.array([[1.0, 0.2], [1.0, -0.2], [0.5, 0.0]]))
    assert stresses == 0
    assert not stress.any()


def test_every_stress_is_a_mean_of_extreme_ones():
    """Pairs of opposite gradients along two axes: the extreme stresses load one pair each."""
    gradients = np.array([[1.0, 0], [-1, 0], [0, 1], [0, -1]])
    extreme = sorted(extreme_stresses(gradients), key=lambda s: -s[0])
    np.testing.assert_allclose(extreme, [[0.5, 0.5, 0, 0], [0, 0, 0.5, 0.5]], atol=1e-12)
    stress, stresses = balance(gradients)
    assert stresses == 2
    np.testing.assert_allclose(stress, 0.25)


def test_corner_is_solved_for_and_judged():
    """Two disks near half a lattice vector apart: a corner of two distances."""
    model = TorusDisks(2)
    near = np.array([-0.249, 0.0, 0.25, -0.002])
    chosen = np.flatnonzero(model.distances(near[None], 0)[0][0] < 0.51)
    assert len(chosen) == 2
    exact = solved(model.distances, near, chosen, np.array([0.4, 0.6]))
    corner = judged(model.distances, exact, np.tile(np.eye(2), 2))
    assert corner.value == pytest.approx(0.5, abs=1e-14)
    np.testing.assert_allclose(corner.stress, 0.5)
    assert (corner.index, corner.nullity, corner.degenerate) == (1, 0, False)
    assert judged(model.distances, near, np.tile(np.eye(2), 2)) is None
