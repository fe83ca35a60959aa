"""Reflected diffusion: oracles are stationary densities, mean times by quadrature, and angles."""

import math

import numpy as np
import pytest
from scipy.integrate import quad

from polycorner import AllOf, AnyOf, Drift, Manifold, Polyhedron, simulate
from polycorner.landscapes import landscape
from polycorner.motion import ContactFamily, EventKind, Noise, pair_coordinates

PLANE, LINE = Manifold.euclidean("x y"), Manifold.euclidean("s")
X, Y = PLANE.symbols
(S,) = LINE.symbols
HALF_LINE = Polyhedron(LINE, {"floor": S})


def late(drift, start, t_end, dt, seed, begin):
    """Return places at the instants after a time, of all bodies, ``(T, N, n)``."""
    path = simulate(drift, drift.state(start), t_end, dt, noise=Noise(seed=seed))
    return path.q[path.times >= begin], path


def mean_of(places):
    """Return the mean of numbers ``(T, N)`` and its error; bodies are independent."""
    each = places.mean(axis=0)
    return each.mean(), each.std(ddof=1) / math.sqrt(len(each))


def test_noise_diffuses_with_twice_the_noise_times_the_mobility():
    B = np.array([[2.0, 0.5], [0.5, 1.0]])
    drift = Drift(Polyhedron(PLANE, {}), {"x": 1}, mobility=B, noise=0.3, count=4000)
    path = simulate(drift, drift.state(np.zeros((4000, 2))), 1.0, 0.1, noise=Noise(seed=1))
    q = path.q[-1] - [1.0, 0.0]
    found, exact = np.cov(q.T), 2 * 0.3 * B
    assert np.abs(q.mean(axis=0)).max() < 5 * math.sqrt(exact.max() / 4000)
    assert np.abs(found - exact).max() < 5 * exact.max() * math.sqrt(2 / 4000)


def test_reflection_at_a_flat_wall_has_the_law_of_the_modulus():
    """|B_t| in one step and in many: normal reflection of Brownian motion on the half line."""
    for dt in (1.0, 0.1):
        drift = Drift(HALF_LINE, noise=0.5, count=4000)
        path = simulate(drift, drift.state(np.zeros((4000, 1))), 1.0, dt, noise=Noise(seed=2))
        q = path.q[-1, :, 0]
        assert q.min() >= 0
        assert q.mean() == pytest.approx(math.sqrt(2 / math.pi), abs=5 * 0.6 / math.sqrt(4000))
        assert (q**2).mean() == pytest.approx(1.0, abs=5 * math.sqrt(2 / 4000))


def test_the_density_is_uniform_in_an_l_and_ergodic_around_its_corner():
    D = Polyhedron(PLANE, AllOf(X, 1 - X, Y, 1 - Y, AnyOf(0.5 - X, 0.5 - Y)))
    drift = Drift(D, noise=0.5, count=300)
    places, path = late(drift, np.full((300, 2), 0.25), 3.0, 0.004, 3, 1.0)
    assert D.implicit(places).min() >= -1e-9
    assert path.converged
    share, error = mean_of((places < 0.5).all(axis=-1))
    assert share == pytest.approx(1 / 3, abs=4 * error + 0.01)
    across, error = mean_of(places[..., 0])
    assert across == pytest.approx(5 / 12, abs=4 * error + 0.01)


def sinking(dt, count, seed):
    """Return the mean height of a weight in equilibrium over a floor, where it is 1."""
    drift = Drift(HALF_LINE, potential=S, noise=1.0, count=count)
    start = np.random.default_rng(seed).exponential(size=(count, 1))
    places, _ = late(drift, start, 30.0, dt, seed, 5.0)
    return mean_of(places[..., 0])


def test_a_weight_over_a_floor_has_the_barometric_height_to_first_order():
    """The weak order is one: the error of the mean height halves with the step."""
    (coarse, e1), (fine, e2) = sinking(0.4, 3000, 1), sinking(0.2, 3000, 1)
    assert coarse - 1 > 10 * e1
    ratio = (coarse - 1) / (fine - 1)
    assert ratio == pytest.approx(2.0, abs=0.3 + 4 * ratio * e2 / (fine - 1))


def test_two_bodies_on_a_line_have_the_density_of_boltzmann():
    """Two that keep a distance and their order, and are drawn to the left."""
    M = LINE
    (s1,), (s2,) = pair_coordinates(M)
    apart = ContactFamily({"apart": s2 - s1 - 0.2}, 3.0, ["s"])
    D = Polyhedron(M, {"left": S, "right": 1 - S})
    drift = Drift(D, potential=2 * S, noise=1.0, count=2, between=apart)
    path = simulate(drift, drift.state([[0.2], [0.7]]), 400.0, 0.01, noise=Noise(seed=4), every=5)
    low, high = path.q[20:, 0, 0], path.q[20:, 1, 0]
    assert (high - low).min() > 0.2 - 1e-6
    # With b = high - 0.2 both are ordered numbers on [0, 0.8], of density exp(-2 (a + b)).
    cut = 0.8
    mean = (1 - math.exp(-2 * cut) * (1 + 2 * cut)) / (2 * (1 - math.exp(-2 * cut)))
    blocks = (low + high - 0.2)[: len(low) // 20 * 20].reshape(20, -1).mean(axis=1)
    error = blocks.std(ddof=1) / math.sqrt(20)
    assert blocks.mean() == pytest.approx(2 * mean, abs=4 * error + 0.01)


# ------------------------------------------------------------------------------- wedges and exits


def test_normal_reflection_never_reaches_the_corner_of_a_wedge_but_as_a_planar_motion_does():
    """Varadhan and Williams: with normal reflection the corner is not reached, for any angle.

    |q| is then the modulus of planar Brownian motion, whose logarithm is a martingale: between the
    radii a < 1 < b it leaves inwards with the probability log b / log(b / a).
    """
    angle = math.radians(60)
    wedge = {"low": Y, "up": math.sin(angle) * X - math.cos(angle) * Y}
    count, a, b, dt = 500, 0.25, 3.0, 0.005
    drift = Drift(Polyhedron(PLANE, wedge), noise=0.5, count=count)
    start = np.full((count, 2), [math.cos(angle / 2), math.sin(angle / 2)])
    path = simulate(drift, drift.state(start), 12.0, dt, noise=Noise(seed=6), every=1)
    radius = np.linalg.norm(path.q, axis=2)
    assert radius.min() > 0
    out = (radius <= a) | (radius >= b)
    first = out.argmax(axis=0)
    left = out.any(axis=0)
    inwards = (radius[first, np.arange(count)] <= a)[left]
    exact = math.log(b) / math.log(b / a)
    assert left.mean() > 0.95
    # Radii are overshot by 0.58 of a step's deviation between two instants, inwards and outwards.
    over = 0.58 * math.sqrt(dt)
    shifted = math.log(b + over) / math.log((b + over) / (a - over))
    error = math.sqrt(exact * (1 - exact) / left.sum())
    assert abs(exact - shifted) < 0.1
    assert inwards.mean() == pytest.approx(shifted, abs=4 * error)


def mean_exit(potential, start, low, high, noise):
    """Return the mean time to reach ``high``, reflected at ``low``, by quadrature.

    It is ``int_start^high exp(E(y) / T) / T  int_low^y exp(-E(z) / T) dz dy``.
    """

    def inner(y):
        return quad(lambda z: math.exp((potential(y) - potential(z)) / noise), low, y)[0]

    return quad(inner, start, high)[0] / noise


def exit_times(potential, start, limit, noise, dt, count, t_end, seed):
    drift = Drift(
        Polyhedron(LINE, {"floor": S + 2}), potential=potential, noise=noise, count=count,
        exits={"s": limit},
    )  # fmt: skip
    path = simulate(
        drift, drift.state(np.full((count, 1), start)), t_end, dt, noise=Noise(seed=seed)
    )
    assert not path.present[-1].any()
    times = np.array([e.time for e in path.of_kind(EventKind.EXIT)])
    return times.mean(), times.std(ddof=1) / math.sqrt(count)


def test_the_time_to_the_end_of_a_line_is_that_of_diffusion():
    found, error = exit_times(0, -2.0, -1.0, 0.5, 0.02, 3000, 15.0, 7)
    assert found == pytest.approx(1.0, abs=4 * error + 0.01)


@pytest.mark.slow
def test_escape_from_a_well_takes_the_time_of_the_quadrature_and_has_its_barrier():
    """The mean time over the pass, and its slope over 1/T, which tends to the landscape's depth."""
    energy, well = S**4 / 4 - S**2 / 2, lambda s: s**4 / 4 - s**2 / 2
    for noise in (0.2, 0.1):
        exact = mean_exit(well, -1.0, -2.0, 1.0, noise)
        found, error = exit_times(energy, -1.0, 1.0, noise, 0.02, 600, 40 * exact, 8)
        assert found == pytest.approx(exact, abs=4 * error + 0.02 * exact)
    D = Polyhedron(LINE, {"low": S + 2, "high": 2 - S})
    found = landscape(D, energy, box=[(-2, 2)])
    start = int(np.argmin([m.point[0] for m in found.minima]))
    slope = (
        math.log(mean_exit(well, -1, -2, 1, 0.004)) - math.log(mean_exit(well, -1, -2, 1, 0.005))
    ) / 50
    low, high = found.depth(start)
    assert low - 0.01 <= slope <= high + 0.01
