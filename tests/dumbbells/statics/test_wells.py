"""The wells of a dyad's corner are those of the pair itself."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigh

from polycorner import Entrapment
from polycorner.dumbbells import DumbbellPair
from polycorner.dumbbells.statics.critical import critical_rod_radius
from polycorner.dumbbells.statics.minima import CORNER, dyad_minima
from polycorner.dumbbells.statics.wells import (
    GRAVITY,
    Agitation,
    dyad_holds,
    hold_escapes,
    hold_times,
    inertia,
)
from polycorner.models.wells.escape import mean_escape_time

PAIR = DumbbellPair(length=16, ball_radius=3, rod_radius=1.5, drum_radius=125)
HOLDS = dyad_holds(PAIR)
CERTIFICATE = dyad_minima(PAIR)[0].certificate
ROWS = [PAIR.polyhedron.names.index(name) for name in CORNER]
HALF_V, BOUND = HOLDS[:3], HOLDS[:5]


def gaps(q):
    return PAIR.polyhedron.values(q)[..., ROWS]


def jacobian(function, q, step=1e-5):
    """Central differences in steps of the size of a coordinate's unit."""
    steps = step * np.diag(PAIR.manifold.scale_array)
    columns = [(function(q + h) - function(q - h)) / (2 * h[i]) for i, h in enumerate(steps)]
    return np.stack(columns, axis=-1)


def test_labels_are_those_of_the_certificate():
    assert {hold.direction: hold.kind for hold in HOLDS} == CERTIFICATE.entrapment
    kinds = [hold.kind for hold in HOLDS]
    assert kinds == [Entrapment.HALF_V] * 3 + [Entrapment.U] * 2 + [Entrapment.FREE]
    assert {h.direction: h.multiplier for h in HALF_V} == pytest.approx(CERTIFICATE.multipliers)
    assert [hold.slope == 0 for hold in HOLDS] == [False] * 3 + [True] * 3
    assert HOLDS[5].stiffness == 0.0


def test_inertia_is_that_of_the_moving_balls():
    """Velocities of the centres, and balls that turn with the heading about the vertical."""
    q = CERTIFICATE.point
    rates = jacobian(lambda p: PAIR.ball_centres(p).ravel(), q)
    turning = np.diag([0, 0, 2 * 0.4 * PAIR.ball_radius**2] * 2)
    short = DumbbellPair(16, 3, 1.5, 1e5)
    flat = jacobian(lambda p: short.ball_centres(p).ravel(), q * [0, 1, 1, 0, 1, 1])
    for pair, found, slack in ((PAIR, rates, 0.01), (short, flat, 1e-5)):
        scale = 1 / np.sqrt(inertia(pair))
        mass = (found.T @ found + turning) * np.outer(scale, scale)
        np.testing.assert_allclose(mass, np.eye(6), atol=slack)


def direction(hold, q):
    """Return the velocity that opens one contact and has no momentum along the face."""
    slopes = jacobian(gaps, q)
    pushed = slopes.T / inertia(PAIR)[:, None]
    velocity = pushed @ np.linalg.solve(slopes @ pushed, np.eye(3)[CORNER.index(hold.direction)])
    return 2 * velocity / math.sqrt(velocity @ (inertia(PAIR) * velocity))


def on_the_others(q, held):
    """Move a point until the gaps that stay closed are closed again, across the face."""
    for _ in range(30):
        slopes = jacobian(gaps, q)[held]
        pushed = slopes.T / inertia(PAIR)[:, None]
        q = q - pushed @ np.linalg.solve(slopes @ pushed, gaps(q)[held])
    return q


@pytest.mark.parametrize("hold", HALF_V, ids=lambda hold: hold.direction)
def test_energy_of_the_pair_along_an_opening_contact(hold):
    """``E - E0 - lam gap = k s^2 / 2``, with an error of third order, and ``gap = opening s``."""
    q, own = CERTIFICATE.point, CORNER.index(hold.direction)
    velocity = direction(hold, q)
    held = [k for k in range(3) if k != own]
    left, opened, ways = [], [], 0.4 / 2.0 ** np.arange(4)
    for s in ways:
        point = on_the_others(q + s * velocity, held)
        gap = gaps(point)[own]
        energy = PAIR.energy.value(point) - CERTIFICATE.energy
        left.append(energy - hold.multiplier * gap - hold.stiffness * s**2 / 2)
        opened.append(gap - hold.opening * s)
    orders = np.log2(np.abs(left[:-1]) / np.abs(left[1:]))
    assert orders[-1] > 2.8
    assert np.log2(opened[-2] / opened[-1]) == pytest.approx(2, abs=0.1)
    assert hold.slope == pytest.approx(hold.multiplier * hold.opening)


def test_modes_along_the_face_are_those_of_a_generalised_eigenproblem():
    """In coordinates as they are, from differences of the model's functions."""
    q = CERTIFICATE.point
    force = np.array([CERTIFICATE.multipliers[name] for name in CORNER])

    def pull(p):
        return jacobian(lambda x: PAIR.energy.value(x) - gaps(x) @ force, p, 1e-4)

    hessian = jacobian(pull, q, 1e-4)
    face = np.linalg.svd(jacobian(gaps, q))[2][3:].T
    mass = face.T @ np.diag(inertia(PAIR)) @ face
    squares = eigh(face.T @ (hessian + hessian.T) / 2 @ face, mass, eigvals_only=True)
    found = [hold.stiffness / 4 for hold in HOLDS[3:]]
    assert found == pytest.approx(sorted(squares, reverse=True), abs=1e-6)


def test_rolling_together_is_a_pendulum_of_four_balls():
    """All balls turn about the drum's axis by the same angle ``s / rho``."""
    (rolling,) = (hold for hold in HOLDS if hold.direction == "phi1+phi2")
    heights = -PAIR.ball_centres(CERTIFICATE.point)[:, 2]
    assert rolling.stiffness == pytest.approx(heights.sum() / PAIR.centre_radius**2)


def test_chiralities_hold_alike():
    for right, left in zip(HOLDS, dyad_holds(PAIR, "L"), strict=True):
        assert (right.slope, right.stiffness) == pytest.approx((left.slope, left.stiffness))


def test_where_forces_vanish_half_v_becomes_half_u():
    """With thicker rods the contacts with rods lose their force, but not their stiffness."""
    critical = critical_rod_radius(PAIR)
    forces = []
    for share in (0.1, 0.01, 0.001):
        holds = dyad_holds(replace(PAIR, rod_radius=critical - share))
        hold = next(h for h in holds if h.direction == "A2b")
        forces.append(hold.slope)
        assert hold.stiffness > 0.02
    assert forces[0] > forces[1] > forces[2] > 0
    assert math.log10(forces[1] / forces[2]) == pytest.approx(1, abs=0.05)
    with pytest.raises(ValueError, match="pair: expected one held by three contacts"):
        dyad_holds(replace(PAIR, rod_radius=critical))


# -------------------------------------------------------------------------------------------- wells


def test_wells_have_the_kind_and_the_energy_of_their_hold():
    for hold in BOUND:
        well = hold.well(0.5, ball_mass=2.0)
        assert well.kind is hold.kind
        assert well.mass == 8.0
        assert well.depth == pytest.approx(
            2.0 * GRAVITY * (hold.slope * 0.5 + hold.stiffness * 0.125)
        )
    assert HALF_V[0].without_slope.well(0.5).kind is Entrapment.HALF_U
    assert HALF_V[1].well(HALF_V[1].crossover).depth == pytest.approx(
        2 * HALF_V[1].without_slope.well(HALF_V[1].crossover).depth
    )


def test_the_mass_of_a_ball_does_not_matter():
    """Three times the mass, the drag and the energy of the noise: the same time."""
    shaking = Agitation(2e-3, 5.0)
    assert shaking.well(HALF_V[0], 0.2).temperature(shaking.kick) == pytest.approx(2e-3 * GRAVITY)
    heavy = HALF_V[0].well(0.2, ball_mass=3.0, drag=4 * 3 * 5.0)
    ((light,),) = hold_times(HALF_V[:1], [0.2], shaking, cells=20)
    assert mean_escape_time(heavy, 3 * shaking.kick, cells=20) == pytest.approx(light, rel=1e-9)


def test_half_v_holds_longer_than_u_near_the_corner_but_not_far_from_it():
    """Below the way where the slope's energy is the modes' the contacts are the stronger holds."""
    near, far = hold_times(BOUND, [0.2, 0.8], Agitation(2e-3, 5.0), cells=30).T
    assert near[:3].min() > 2 * near[3:].max()
    assert far[0] < far[3:].min()
    bare = hold_times(
        [hold.without_slope for hold in HALF_V], [0.2], Agitation(2e-3, 5.0), cells=30
    )
    assert (near[:3] > 2 * bare[:, 0]).all()


@pytest.mark.parametrize("hold", [HOLDS[0], HOLDS[1], HOLDS[3]], ids=lambda hold: hold.direction)
def test_simulated_times(hold):
    shaking = Agitation(2e-3, 5.0)
    ((exact,),) = hold_times([hold], [0.2], shaking, cells=60)
    run = hold_escapes(hold, 0.2, shaking, duration=12 * exact, count=300, seed=4)
    assert run.escaped.mean() > 0.99
    assert abs(run.mean - exact) < 4 * run.error + 0.03 * exact


def test_times_out_of_reach_are_not_numbers():
    assert math.isnan(hold_times(HALF_V[:1], [2.0], Agitation(1e-5, 5.0))[0, 0])
