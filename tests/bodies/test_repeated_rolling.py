"""Sliding friction and rolling resistance at the same contacts of repeated bodies."""

from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from polycorner import simulate
from polycorner.bodies import Arrangement, HalfSpace, capsule, disc, sphere
from polycorner.motion import Checkpoint, Solver
from polycorner.motion.simulation import start

GROUND = {"ground": HalfSpace([0, 0, 1], [0, 0, 0])}
LINE = {"ground": HalfSpace([0, 1], [0, 0])}
UPRIGHT = Rotation.identity()
R, G = 0.5, 10.0


@cache
def balls(count, gravity=(0.0, 0.0, -G), **coefficients):
    """Return spheres on the ground, and their system."""
    a = Arrangement({"D": sphere(R)}, GROUND, orientations="all")
    named = {name: dict(value) for name, value in coefficients.items()}
    return a, a.system(gravity=gravity, count=count, **named)


def coefficients(**named):
    """Return coefficients on the ground and between bodies that can be hashed."""
    return {name: (("D-ground", a), ("between", b)) for name, (a, b) in named.items()}


@pytest.mark.parametrize("dimension", [2, 3])
def test_two_repeated_bodies_move_as_two_that_are_listed(dimension):
    """They fall on each other, turning, and roll apart; static and dynamic coefficients differ."""
    if dimension == 2:
        body, walls = capsule([-0.2, 0], [0.2, 0], 0.3), LINE
        turns, spins = [0.3, -0.2], [2.0, -1.0]
    else:
        body, walls = sphere(0.3), GROUND
        turns, spins = [UPRIGHT] * 2, [[1.0, 3.0, 2.0], [0.5, -1.0, 0.0]]
    up, along = np.eye(dimension)[-1], np.eye(dimension)[0]
    places, speeds = [0.5 * up, 1.3 * up + 0.2 * along], [0.2 * along, 0.1 * up]
    rubs, rolls = (0.4, 0.3), (0.2, 0.1)
    one = Arrangement({"D": body}, walls, orientations="all")
    two = Arrangement({"A": body, "B": body}, walls, orientations="all")
    repeated = one.system(gravity=-G * up, friction=rubs, rolling=rolls, count=2)
    listed = two.system(gravity=-G * up, friction=rubs, rolling=rolls)
    starts = [one.point({"D": pose}) for pose in zip(places, turns, strict=True)]
    rates = [
        one.velocity(q, {"D": moving})
        for q, moving in zip(starts, zip(speeds, spins, strict=True), strict=True)
    ]
    ways = [
        simulate(system, system.state(shape(starts), shape(rates)), 0.6, 1e-3, every=20)
        for system, shape in ((repeated, np.array), (listed, np.concatenate))
    ]
    first, second = ways
    assert first.dissipated["rolling"][-1] > 1e-3 * first.kinetic[0]
    np.testing.assert_allclose(first.q.reshape(len(first.q), -1), second.q[:, 0], atol=1e-6)
    np.testing.assert_allclose(first.dissipated["rolling"], second.dissipated["rolling"], atol=1e-6)
    rubbed = first.dissipated["sliding"] + first.dissipated["rubbing"]
    np.testing.assert_allclose(rubbed, second.dissipated["sliding"], atol=1e-6)


@pytest.mark.parametrize(
    ("count", "ground", "between"), [(2, 0.3, 0.2), (3, 0.3, 0.6), (2, 0.1, 1)]
)
@pytest.mark.parametrize(("share", "stands"), [(0.98, True), (1.02, False)])
def test_a_column_of_spheres_stands_up_to_the_slope_of_statics(
    count, ground, between, share, stands
):
    """About its lowest point the column has the torque ``n m g sin(s) n r``, at most ``mu r N``.

    The spheres above a contact, ``j`` of them, have ``j m g sin(s) j r``, at most ``mu (r / 2) N``.
    """
    limit = min(ground / count, between / 2 / (count - 1))
    slope = np.arctan(share * limit)
    pull = np.array([0.6 * np.sin(slope), 0.8 * np.sin(slope), -np.cos(slope)])
    named = coefficients(friction=(0.9, 0.9), rolling=(ground, between))
    a, system = balls(count, tuple((G * pull).tolist()), **named)
    begun = system.state([a.point({"D": [0, 0, R * (1 + 2 * k)]}) for k in range(count)])
    path = simulate(system, begun, 0.1, 1e-3)
    moves = np.abs(path.v[-1]).max()  # three bodies are solved to 1e-4 of the speeds
    assert moves < 1e-5 if stands else moves > 1e-4


def test_a_column_without_resistance_rolls_apart():
    named = coefficients(friction=(0.9, 0.9))
    a, system = balls(2, (0.1, 0.0, -G), **named)
    path = simulate(
        system, system.state([a.point({"D": [0, 0, h]}) for h in (R, 3 * R)]), 0.5, 1e-3
    )
    assert np.abs(path.v[-1]).max() > 0.02


def pyramid():
    """Return the centres of three spheres on the ground that touch, and of one on top of them."""
    around = np.exp(2j * np.pi * np.arange(3) / 3) * 2 * R / 3**0.5
    below = np.column_stack([around.real, around.imag, np.full(3, R)])
    return np.vstack([below, [0, 0, R + 2 * R * (2 / 3) ** 0.5]])


def angular(q, v):
    """Return angular velocities in space: the vector part of ``2 a' a*`` for quaternions ``a``."""
    w, a = q[:, 3:4], q[:, 4:]
    rate, turned = v[:, 3:4], v[:, 4:]
    return 2 * (turned * w - rate * a - np.cross(turned, a))


def basis(n):
    """Return two unit vectors across a unit vector, [Duff]."""
    x, y, z = n
    side = 1.0 if z >= 0 else -1.0
    a = -1 / (side + z)
    b = x * y * a
    return np.array([[1 + side * x * x * a, side * b, -side * x], [b, side + y * y * a, -y]])


@pytest.mark.parametrize("seed", range(3))
def test_a_step_is_a_solution_of_the_inclusion(seed):
    """Four spheres touch each other and the ground, and spin: the step written from its definition.

    ``m dv = h F + sum p``, ``J dw = sum r x p + torques``, and at each contact ``p_n`` and ``u_n``
    are complementary; force and torque across the normal oppose the slip and ``R`` times the
    difference of the spins, with ``mu p_n`` where these are not zero, and else at most so much.
    """
    given, h = {"friction": (0.4, 0.3), "rolling": (0.1, 0.2)}, 1e-3
    a, system = balls(4, **coefficients(**given))
    rng, places = np.random.default_rng(seed), pyramid()
    q = np.array([a.point({"D": (p, Rotation.random(random_state=rng))}) for p in places])
    spins = rng.normal(size=(4, 3)) * [[3.0], [0.0], [2.0], [0.1]]
    v = [a.velocity(x, {"D": ([0, 0, 0], w)}) for x, w in zip(q, spins, strict=True)]
    engine = start(system, system.state(q, v), h, solver=Solver(tolerance=1e-10))
    engine.advance(1)
    found, middle = engine.motion, q + h / 2 * np.array(v)
    middle[:, 3:] /= np.linalg.norm(middle[:, 3:], axis=1)[:, None]
    mass, inertia = 4 / 3 * np.pi * R**3, 0.4 * 4 / 3 * np.pi * R**5
    speed, spin = found.v[:, :3], angular(middle, found.v)
    pushed = mass * speed - h * mass * np.array([0, 0, -G])
    turned = inertia * (spin - angular(middle, np.array(v)))
    normal, friction = found.normal.reshape(4, -1), found.friction.reshape(4, -1, 2)
    contacts = [
        ((i, None), np.array([0, 0, 1.0]), R, normal[i, 0], [*friction[i]], "ground")
        for i in range(3)
    ]
    pairs = [divmod(int(key), 4) for key in found.keys[: found.counts[0]]]
    for (i, j), impulses in zip(pairs, found.pair_impulse, strict=False):
        n = (places[i] - places[j]) / (2 * R)
        contacts.append(((i, j), n, R / 2, impulses[0], [impulses[1:3], impulses[3:5]], "pair"))
    assert len(pairs) == 6
    for (i, j), n, radius, normal, (slides, rolls), kind in contacts:
        across = basis(n)
        force, torque = normal * n + slides @ across, radius * rolls @ across
        other, others = (np.zeros(3), np.zeros(3)) if j is None else (speed[j], spin[j])
        pushed[i] -= force
        turned[i] -= np.cross(-R * n, force) + torque
        if j is not None:
            pushed[j] += force
            turned[j] -= np.cross(R * n, -force) - torque
        slip = speed[i] - other + np.cross(spin[i], -R * n)
        if j is not None:
            slip = slip - np.cross(others, R * n)
        assert normal >= 0
        assert n @ slip > -1e-9
        assert normal * (n @ slip) < 1e-9
        for impulse, rate, name in (
            (slides, across @ slip, "friction"),
            (rolls, radius * across @ (spin[i] - others), "rolling"),
        ):
            most = given[name][kind == "pair"] * normal
            size = np.linalg.norm(rate)
            assert np.linalg.norm(impulse) < most * (1 + 1e-6) + 1e-12
            if size > 1e-7:
                np.testing.assert_allclose(impulse, -most * rate / size, atol=1e-7 * h)
    np.testing.assert_allclose(pushed, 0, atol=1e-9 * h)
    np.testing.assert_allclose(turned, 0, atol=1e-9 * h)


def heap(count):
    """Return spheres that fall on each other, and spin."""
    a, system = balls(count, **coefficients(friction=(0.4, 0.3), rolling=(0.1, 0.1)))
    rng, side = np.random.default_rng(0), 2 * R
    levels, rest = np.divmod(np.arange(count), 4)
    places = np.column_stack([*np.divmod(rest, 2), levels]) * [side, side, 0.9 * side]
    places += np.array([0.0, 0.0, R]) + rng.uniform(0.02, 0.2, (count, 3))
    places[:, 0] += 0.3 * levels
    q = np.array([a.point({"D": (p, UPRIGHT)}) for p in places * [1.2, 1.2, 1.3]])
    rates = [a.velocity(x, {"D": ([0, 0, -1], rng.normal(size=3))}) for x in q]
    return system, system.state(q, rates)


def test_the_energy_of_a_heap_never_grows():
    system, begun = heap(8)
    path = simulate(system, begun, 1.0, 2e-3)
    total = path.kinetic + path.potential
    assert np.diff(total).max() < 1e-6 * total[0]
    assert path.dissipated["rolling"][-1] > 0.01 * (total[0] - total[-1])
    assert path.audit < 1e-3


def test_a_run_goes_on_bit_for_bit_with_the_impulses_of_all_laws(tmp_path):
    system, begun = heap(4)

    def stop(done, _total, _note):
        if done > 0.25:
            raise KeyboardInterrupt

    whole = simulate(system, begun, 0.5, 2e-3, every=5)
    with pytest.raises(KeyboardInterrupt):
        simulate(system, begun, 0.5, 2e-3, every=5, checkpoint=Checkpoint(tmp_path), progress=stop)
    rest = simulate(system, begun, 0.5, 2e-3, every=5, checkpoint=Checkpoint(tmp_path))
    assert whole.dissipated["rolling"][-1] > 0
    np.testing.assert_array_equal(rest.q, whole.q)
    np.testing.assert_array_equal(rest.v, whole.v)


def test_only_one_law_holds_where_only_one_coefficient_is_positive():
    discs = Arrangement({"D": disc(0.5)}, LINE, orientations="all")
    for given, kinds in (({"friction": 0.3}, ["rubbing"]), ({"rolling": 0.1}, ["rolling"])):
        between = discs.system(count=2, **given).between
        assert [law.kind for law in between.friction] == kinds
    assert discs.system(count=2).between.friction == ()
