"""Rates between corners: against the diffusion on the graph itself, solved and simulated."""

import numpy as np
import pytest

from polycorner import Manifold, Polyhedron, skeleton
from polycorner.measures import Weighting, measure, rates
from polycorner.models import SphereCluster

M = Manifold.euclidean("x y")
x, y = M.symbols
A, B = 1.5, 1.0
BOX = Polyhedron(M, {"left": x, "right": A - x, "bottom": y, "top": B - y})
KAPPA, DIFFUSION = 0.8, 0.7
ENERGY = 2 * x * y + x
CORNERS = [(0.0, 0.0), (A, 0.0), (A, B), (0.0, B)]


def box_rates(**ways):
    atlas = skeleton(BOX, [[0.5, 0.5]])
    found = measure(atlas, weighting=Weighting(stickiness=KAPPA, energy=ENERGY))
    order = [min(range(4), key=lambda k: np.abs(atlas.corners[k].point - p).max()) for p in CORNERS]
    return rates(found, diffusion=DIFFUSION, **ways), order


def chain_on_the_boundary(cells):
    """Return rates up and down of a walk on the boundary of the box, by finite volumes.

    A node of an edge weighs ``kappa w h``, a corner ``kappa^2 w`` and half of the cells beside it;
    between nodes flows ``D kappa w / h``.
    """
    points = np.concatenate(
        [
            np.linspace(p, q, cells, endpoint=False)
            for p, q in zip(CORNERS, [*CORNERS[1:], CORNERS[0]], strict=True)
        ]
    )
    following = np.roll(points, -1, axis=0)
    h = np.linalg.norm(following - points, axis=1)

    def w(q):
        return np.exp(-(2 * q[:, 0] * q[:, 1] + q[:, 0]))

    flow = DIFFUSION * KAPPA * w((points + following) / 2) / h
    mass = KAPPA * w(points) * (h + np.roll(h, 1)) / 2
    mass[::cells] += KAPPA**2 * w(points)[::cells]
    return flow / mass, np.roll(flow, 1) / mass


def test_mean_times_and_committors_are_those_of_the_diffusion():
    cells = 400
    up, down = chain_on_the_boundary(cells)
    size = len(up)
    G = np.diag(-up - down)
    at = np.arange(size)
    G[at, (at + 1) % size] += up
    G[at, (at - 1) % size] += down
    free = at != 2 * cells
    times = np.zeros(size)
    times[free] = np.linalg.solve(G[np.ix_(free, free)], -np.ones(free.sum()))
    inner = free & (at != 0)
    u = np.where(at == 2 * cells, 1.0, 0.0)
    u[inner] = np.linalg.solve(G[np.ix_(inner, inner)], -G[inner, 2 * cells])
    k, order = box_rates()
    assert k.passage_times([order[2]])[order] == pytest.approx(times[::cells], rel=1e-4, abs=1e-9)
    assert k.committor([order[0]], [order[2]])[order] == pytest.approx(u[::cells], rel=1e-4)


def test_a_simulated_walk_takes_as_long():
    """Walkers with waiting times of their own, on a coarse boundary, until the opposite corner."""
    cells, walkers = 12, 4000
    up, down = chain_on_the_boundary(cells)
    rng = np.random.default_rng(3)
    at, time, going = np.zeros(walkers, int), np.zeros(walkers), np.arange(walkers)
    while len(going):
        here = at[going]
        total = up[here] + down[here]
        time[going] += rng.exponential(1 / total)
        rising = rng.random(len(going)) * total < up[here]
        at[going] = (here + np.where(rising, 1, -1)) % len(up)
        going = going[at[going] != 2 * cells]
    k, order = box_rates()
    exact = k.passage_times([order[2]])[order[0]]
    # The coarse grid is wrong by its squared mesh, half a percent.
    assert abs(time.mean() - exact) < 4 * time.std() / np.sqrt(walkers) + 0.005 * exact


def test_equilibrium_is_kept_and_the_matrix_is_in_detailed_balance():
    k, _ = box_rates()
    flux = k.stationary[:, None] * k.matrix
    assert flux == pytest.approx(flux.T)
    assert k.matrix.sum(axis=1) == pytest.approx(0, abs=1e-12)
    assert k.matrix.T @ k.stationary == pytest.approx(0, abs=1e-12)


def test_without_edges_rates_are_inverse_to_stickiness():
    model = SphereCluster(6, 2)
    atlas = skeleton(model.polyhedron, model.starts(), symmetry=model.symmetry)
    slow, fast = (
        rates(measure(atlas, weighting=Weighting(stickiness=s)), edges=False).matrix
        for s in (300.0, 30.0)
    )
    assert slow * 10 == pytest.approx(fast)
    exact = rates(measure(atlas, weighting=Weighting(stickiness=1e6))).matrix
    assert exact == pytest.approx(slow * 300 / 1e6, rel=1e-3)


def test_six_discs_have_three_ground_states_joined_by_their_rates():
    """Parallelogram, chevron and triangle, 3 : 3 : 1; no rate between them vanishes."""
    model = SphereCluster(6, 2)
    atlas = skeleton(model.polyhedron, model.starts(), symmetry=model.symmetry)
    found = measure(atlas, weighting=Weighting(stickiness=30.0))
    assert sorted(found.probabilities) == pytest.approx([1 / 7, 3 / 7, 3 / 7], rel=1e-9)
    k = rates(found, edges=False)
    assert (k.matrix[~np.eye(3, dtype=bool)] > 0).all()


def test_it_says_that_faces_are_left_out():
    assert "faces" in str(box_rates()[0])


def test_refusals():
    found = measure(skeleton(BOX, [[0.5, 0.5]]))
    with pytest.raises(ValueError, match="finite stickiness"):
        rates(found)
    k, _ = box_rates()
    with pytest.raises(ValueError, match="at least one corner"):
        k.passage_times([])
    with pytest.raises(ValueError, match="no sources"):
        k.committor([0], [0])
