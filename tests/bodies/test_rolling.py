"""Rolling resistance, static and dynamic coefficients, and velocities of bodies."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from polycorner import simulate
from polycorner.bodies import Arrangement, Cylinder, HalfSpace, capsule, disc, polygon, sphere

GROUND = {"ground": HalfSpace([0, 0, 1], [0, 0, 0])}
LINE = {"ground": HalfSpace([0, 1], [0, 0])}


def run(a, gravity, q, duration=1.0, v=None, **coefficients):
    system = a.system(gravity=gravity, **coefficients)
    return simulate(system, system.state(q, v), duration, 1e-3)


@pytest.mark.parametrize("dimension", [2, 3])
def test_a_ball_rolls_against_the_resistance(dimension):
    """``a = (g sin - mu g cos) / (1 + J / m r^2)``, or not at all."""
    body, walls = (disc(0.5), LINE) if dimension == 2 else (sphere(0.5), GROUND)
    a = Arrangement({"A": body}, walls, orientations="all")
    up, along = np.eye(dimension)[-1], np.eye(dimension)[0]
    inert = 1.5 if dimension == 2 else 1.4
    start = a.point({"A": 0.5 * up})
    path = run(a, along - 5 * up, start, friction=0.4, rolling=0.1)
    assert path.v[-1, 0, 0] == pytest.approx((1 - 0.1 * 5) / inert, rel=1e-9)
    path = run(a, 0.4 * along - 5 * up, start, friction=0.4, rolling=0.1)
    assert path.v[-1] == pytest.approx(np.zeros_like(path.v[-1]), abs=1e-12)


def test_a_ball_that_rolls_meets_the_dynamic_coefficient():
    a = Arrangement({"A": sphere(0.5)}, GROUND, orientations="all")
    q = a.point({"A": [0, 0, 0.5]})
    v = a.velocity(q, {"A": ([1.0, 0, 0], [0, 2.0, 0])})
    path = run(a, [0, 0, -5.0], q, 0.5, v, friction=0.4, rolling=(0.2, 0.05))
    assert path.v[-1, 0, 0] == pytest.approx(1 - 0.5 * 0.05 * 5 / 1.4, rel=1e-6)


@pytest.mark.parametrize(("share", "holds"), [(0.98, True), (1.02, False)])
def test_resistance_between_two_bodies_has_their_effective_radius(share, holds):
    """A disc on a fixed one stays if ``r tan(slope)`` is at most ``mu r s / (r + s)``."""
    a = Arrangement({"A": disc(0.5)}, fixed={"B": disc(2.0)}, orientations="all")
    angle = share * np.arctan(0.2 * 2.0 / 2.5)
    q = a.point({"A": [2.5 * np.sin(angle), 2.5 * np.cos(angle)]})
    path = run(a, [0, -10.0], q, 0.1, friction=0.9, rolling=0.2)
    assert (np.abs(path.v[-1]).max() < 1e-12) == holds


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("orientations", ["all", "needed", "none"])
def test_velocities_are_derivatives_of_placements(dimension, orientations):
    rng = np.random.default_rng(dimension)
    turns = orientations != "none"
    end = np.eye(dimension)[0]
    rod = capsule(-end, end, 0.3)
    ground = GROUND if dimension == 3 else LINE
    a = Arrangement([rod, rod], ground, orientations=orientations)
    (here, speed), dt = rng.normal(size=(2, dimension)), 1e-6
    spin = rng.normal(size=3) * turns
    turn = Rotation.from_rotvec(rng.normal(size=3) * turns)
    if dimension == 2:
        angle = 0.4 * turns
        ways = [angle, angle + spin[2] * dt]
        moving = {"1": (speed, spin[2])}
    else:
        ways = [turn, Rotation.from_rotvec(spin * dt) * turn]
        moving = {"1": (speed, spin)}
    q, after = (
        a.point({"1": (here + speed * t, way), "2": here + 9})
        for t, way in zip((0.0, dt), ways, strict=True)
    )
    assert a.velocity(q, moving) == pytest.approx((after - q) / dt, abs=1e-5)


SHAFT = {
    "floor": HalfSpace([0, 1], [0, 0]),
    "left": HalfSpace([1, 0], [-0.5, 0]),
    "right": HalfSpace([-1, 0], [0.5, 0]),
}


COEFFICIENTS = [
    (0.0, 0.3),
    (0.03, 0.3),
    (0.15, 0.05),
    (0.15, 0.0),
    ((0.4, 0.15), (0.3, 0.05)),
    ((0.4, 0.03), (0.3, 0.2)),
]


@pytest.mark.parametrize(("mu", "rolls"), COEFFICIENTS)
def test_of_two_discs_in_a_shaft_sum_and_difference_of_spins_decrease_evenly(mu, rolls):
    """One lies on the other, in a smooth shaft as wide as they are, so that the load is ``m g``.

    Friction ``mu m g`` turns both against the sum of their spins, resistance ``rolls m g r / 2``
    each against the difference; with the inertia ``m r^2 / 2`` they decrease by ``4 mu g / r`` and
    ``2 rolls g / r``, independently of each other, until they are zero.  Coefficients are dynamic
    while the one slips, whether or not the other sticks.
    """
    a, r, g = Arrangement({"D": disc(0.5)}, SHAFT, orientations="all"), 0.5, 10.0
    one, two, dt, steps = 1.0, 4.0, 1e-3, 500
    coefficients = {"friction": {"between": mu}, "rolling": {"between": rolls}}
    system = a.system(gravity=[0, -g], count=2, **coefficients)
    state = system.state([[0, r, 0], [0, 3 * r, 0]], [[0, 0, one], [0, 0, two]])
    path = simulate(system, state, steps * dt, dt, every=20)
    spins, (slides, turns) = path.v[..., 2], (np.min(c) for c in (mu, rolls))
    sums = np.maximum(one + two - 4 * slides * g / r * path.times, 0)
    differences = np.maximum(two - one - 2 * turns * g / r * path.times, 0)
    assert spins.sum(axis=1) == pytest.approx(sums, abs=1e-6)
    assert spins[:, 1] - spins[:, 0] == pytest.approx(differences, abs=1e-6)
    inertia = np.pi * r**4 / 2  # the energy is J (sum^2 + difference^2) / 4
    for cause, rates in (("rubbing", sums), ("rolling", differences)):
        lost = inertia * (rates[0] ** 2 - rates**2) / 4
        assert path.dissipated.get(cause, 0 * lost) == pytest.approx(lost, abs=1e-5)


def test_rolling_at_the_sides_of_polygons_is_refused():
    square = polygon([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    a = Arrangement({"A": disc(0.5)}, fixed={"B": square}, orientations="all")
    with pytest.raises(NotImplementedError, match=r"^rolling: expected .*; got 'A-B'"):
        a.system(rolling=0.1)


def test_bad_input():
    a = Arrangement({"A": sphere(0.5)}, {"d": Cylinder(3, axis=[0, 1, 0])}, orientations="all")
    pair = "rolling: expected a coefficient >= 0, or a pair of a static and a smaller dynamic one"
    for wrong in (-1, (0.1, 0.2), (1, 2, 3), [np.nan, 0]):
        with pytest.raises(ValueError, match=pair):
            a.system(rolling=wrong)
    with pytest.raises(TypeError, match=pair):
        a.system(rolling="much")
    with pytest.raises(ValueError, match="rolling: expected"):
        a.system(rolling={"B-d": 0.1})
    shifted = Arrangement({"A": sphere(0.5)}, GROUND)
    with pytest.raises(ValueError, match="rolling: expected coordinates of all rotations"):
        shifted.system(rolling=0.1)
    q = a.point({"A": [0, 0, -2.5]})
    with pytest.raises(ValueError, match="moving: expected 3 finite numbers for 'A'"):
        a.velocity(q, {"A": [1, 2]})
    with pytest.raises(ValueError, match="moving: expected"):
        a.velocity(q, {"B": [1, 2, 3]})
    with pytest.raises(ValueError, match="moving: expected no angular velocity of 'A'"):
        shifted.velocity(shifted.point({"A": [0, 0, 1]}), {"A": ([0, 0, 0], [1, 0, 0])})
