"""Laws of impact: closed forms, Routh's integral in small pieces, and energy that nothing gains."""

import math

import numpy as np
import pytest
import sympy

from polycorner import Manifold, Polyhedron, System, velocities
from polycorner.models.textbook import body_on_plane, bouncing_ball, newtons_cradle, row_of_balls
from polycorner.motion import Assembly, EventKind, Friction, Interval, Solver, simulate
from polycorner.motion.bodies import IMPACT_LAWS

LIMITED = [law for law in IMPACT_LAWS if law != "newton unlimited"]
ROUNDING = 1e-9  # of velocities of the order 1, solved for to 1e-8 of that at most


def contacts(inverse_mass, friction, restitution, law, names="abc"):
    """Contacts with the normal and slip coordinates ``n_i, t_i``, and ``J M^-1 J'`` as given."""
    several = len(inverse_mass) // 2
    M = Manifold.euclidean(" ".join(f"n{c} t{c}" for c in names[:several]))
    v = velocities(M)
    mass = np.linalg.inv(inverse_mass)
    kinetic = sum(mass[i, j] * v[i] * v[j] for i in range(len(v)) for j in range(len(v))) / 2
    gaps = {c: M.symbols[2 * i] for i, c in enumerate(names[:several])}
    rough = [
        Friction(f"rough {c}", (v[2 * i + 1],), Interval(friction), c) for i, c in enumerate(gaps)
    ]
    return System(Polyhedron(M, gaps), kinetic, friction=rough, restitution=restitution, impact=law)


def after(system, v, open_=()):
    """Velocities after contacts at the distance 0, but for those that are open, are struck."""
    q = np.zeros(len(v))
    q[[2 * i for i in open_]] = 1e3
    return simulate(system, system.state(q, v), 1e-3, 1e-3).v[-1, 0]


W = np.array([[2.0, -0.6], [-0.6, 1.0]])


def bounced(law, e, u, s, mu):
    """The normal velocity after slip ``s`` stops in the compression and sticks."""
    (a, b), (_, c) = W
    if law == "newton unlimited":
        return e * u
    if law == "poisson":
        return e * (u + b * s / c)
    return e * math.sqrt(u * u + b * s / c * (2 * u - (a - mu * b) * s / (mu * c - b)))


@pytest.mark.parametrize("law", ["newton unlimited", "poisson", "stronge"])
@pytest.mark.parametrize("e", [1.0, 0.6])
def test_slip_that_stops_in_the_compression_tells_the_laws_apart(law, e):
    u, s, mu = 1.0, 0.4, 0.8
    found = after(contacts(W, mu, e, law), [-u, s])
    np.testing.assert_allclose(found, [bounced(law, e, u, s, mu), 0.0], atol=ROUNDING)


def test_the_elastic_case_in_numbers():
    energies = {}
    for law in IMPACT_LAWS:
        system = contacts(W, 0.8, 1.0, law)
        v = after(system, [-1.0, 0.4])
        mass = np.linalg.inv(W)
        energies[law] = (v @ mass @ v - np.array([-1.0, 0.4]) @ mass @ [-1.0, 0.4]) / 2
    assert energies["newton unlimited"] == pytest.approx(0.0488, abs=5e-5)
    assert energies["newton"] == pytest.approx(0.0, abs=ROUNDING)
    assert energies["poisson"] == pytest.approx(-(0.4**2) / 2, abs=ROUNDING)
    assert energies["stronge"] == pytest.approx(-0.8 * 0.4**2 / 2 / 1.4, abs=ROUNDING)


def routh(inverse_mass, mu, e, v, step=1e-5):
    """Follow velocities by the normal impulse, in small pieces, until the work is given back."""
    (a, b), (_, c) = inverse_mass
    (u, s), work, least = v, 0.0, 0.0
    while u < 0 or work < (1 - e * e) * least:
        hold = -b / c
        if abs(s) <= 2 * step * c * (mu + abs(hold)) and abs(hold) <= mu:
            s, k = 0.0, hold
        elif abs(s) <= 2 * step * c * (mu + abs(hold)):
            k = math.copysign(mu, hold)
        else:
            k = -math.copysign(mu, s)
        before = u
        u, s = u + step * (a + b * k), s + step * (b + c * k)
        work += step * (before + u) / 2
        least = min(least, work)
    return np.array([u, s])


@pytest.mark.parametrize("seed", range(12))
def test_stronges_law_follows_slip_through_the_impact(seed):
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(2, 2))
    inverse_mass = root @ root.T + 0.1 * np.eye(2)
    mu, e = rng.uniform(0.05, 1.5), rng.uniform(0.1, 1.0)
    v = np.array([-rng.uniform(0.5, 2.0), rng.normal()])
    found = after(contacts(inverse_mass, mu, e, "stronge"), v)
    np.testing.assert_allclose(found, routh(inverse_mass, mu, e, v), atol=3e-4)


def shuffled(seed):
    """The matrix of three contacts that hang together."""
    root = np.random.default_rng(seed).normal(size=(6, 6))
    return root @ root.T + 0.3 * np.eye(6)


@pytest.mark.parametrize("law", LIMITED)
@pytest.mark.parametrize("equal", [True, False])
def test_random_impacts_gain_no_energy_and_stay_in_their_cones(law, equal):
    rng = np.random.default_rng(7)
    inverse_mass = shuffled(3)
    mass = np.linalg.inv(inverse_mass)
    gained = []
    for _ in range(40):
        mu, several = rng.uniform(0.1, 1.5), int(rng.integers(1, 4))
        each = rng.uniform(0.0, 1.0, 3)
        e = float(each[0]) if equal else dict(zip("abc", each.tolist(), strict=True))
        v = rng.normal(size=6)
        v[0] = -abs(v[0])
        found = after(contacts(inverse_mass, mu, e, law), v, range(several, 3))
        p = mass @ (found - v)
        speed = abs(v).max()
        assert (p[::2] >= -1e-6).all()
        assert (abs(p[1::2]) <= mu * p[::2] + 1e-6).all()
        assert (found[: 2 * several : 2] >= -1e-6 * speed).all()
        gained.append(found @ mass @ found - v @ mass @ v)
    assert max(gained) <= 1e-8


def test_newtons_law_as_published_gains_energy_in_such_impacts():
    rng = np.random.default_rng(7)
    inverse_mass = shuffled(3)
    mass = np.linalg.inv(inverse_mass)
    gained = 0
    for _ in range(40):
        v = rng.normal(size=6)
        v[0] = -abs(v[0])
        system = contacts(inverse_mass, rng.uniform(0.1, 1.5), 0.9, "newton unlimited")
        found = after(system, v)
        gained += found @ mass @ found > v @ mass @ v + 1e-3
    assert gained > 0


def throw(law, seed):
    """A rod that is thrown onto a rough floor."""
    rng = np.random.default_rng(seed)
    rod = body_on_plane(
        [(-1.0, 0.0), (1.0, 0.0)],
        1 / 3,
        Interval(rng.uniform(0.1, 1.5)),
        restitution=rng.uniform(0.5, 1.0),
        impact=law,
    )
    q = [0.0, 1.5, rng.uniform(-3, 3)]
    v = [rng.normal(scale=3), rng.normal(), rng.normal(scale=4)]
    path = simulate(rod, rod.state(q, v), 1.5, 5e-3)
    energy = path.kinetic + path.potential
    assert path.of_kind(EventKind.IMPACT)
    return (energy.max() - energy[0]) / energy[0]


@pytest.mark.parametrize("law", LIMITED)
def test_thrown_rods_gain_no_energy(law):
    assert max(throw(law, seed) for seed in range(15)) <= 1e-7


def test_thrown_rods_gain_energy_by_newtons_law_as_published():
    assert max(throw("newton unlimited", seed) for seed in range(15)) > 1e-3


def test_without_friction_a_contact_is_the_same_by_all_laws():
    for e in (0.3, 1.0):
        for law in IMPACT_LAWS:
            ball = bouncing_ball(e, impact=law)
            path = simulate(ball, ball.state([1.0], [-1.0]), 0.5, 1e-3)
            first = path.of_kind(EventKind.IMPACT)[0]
            speed = math.sqrt(1 + 2 * 9.81)
            assert first.impulse == pytest.approx((1 + e) * speed, rel=1e-9)


@pytest.mark.parametrize("law", LIMITED)
def test_balls_in_a_row_that_touch_are_struck_together(law):
    row = row_of_balls(impact=law)
    path = simulate(row, row.state([-0.5, 1.0, 2.0], [1.0, 0.0, 0.0]), 1.0, 0.3)
    np.testing.assert_allclose(path.v[-1, 0], np.array([-1, 2, 2]) / 3, atol=1e-9)


@pytest.mark.parametrize("law", LIMITED)
def test_repeated_balls_exchange_velocities(law):
    cradle = newtons_cradle(3, impact=law)
    path = simulate(cradle, cradle.state([[0.0], [1.5], [3.0]], [[1.0], [0], [0]]), 4.0, 0.1)
    np.testing.assert_allclose(path.v[-1].ravel(), [0, 0, 1], atol=1e-9)


def test_poissons_law_throws_up_what_stands_on_an_elastic_floor():
    """Ball on block on floor: at the floor half the impulse comes back, at the ball nothing."""
    M = Manifold.euclidean("x1 x2")
    (x1, x2), (v1, v2) = M.symbols, velocities(M)
    gaps = Polyhedron(M, {"floor": x1, "ball": x2 - x1})
    stack = {}
    for law in ("poisson", "newton"):
        e = {"floor": 0.5, "ball": 0.0}
        system = System(gaps, (v1**2 + v2**2) / 2, restitution=e, impact=law)
        path = simulate(system, system.state([0.0, 0.1], [0.0, -1.0]), 0.2, 0.01)
        stack[law] = path.v[-1, 0]
    np.testing.assert_allclose(stack["poisson"], [0.25, 0.25], atol=1e-9)
    np.testing.assert_allclose(stack["newton"], [0.0, 0.0], atol=1e-9)


@pytest.mark.parametrize("refine", [True, False])
@pytest.mark.parametrize("e", [1.0, 0.5])
@pytest.mark.parametrize("steps", [3, 4, 8])
def test_an_impact_at_the_end_of_a_step_is_one_event(steps, e, refine):
    M = Manifold.euclidean("y")
    (y,), (v,) = M.symbols, velocities(M)
    ball = System(Polyhedron(M, {"floor": y}), v**2 / 2, restitution=e)
    path = simulate(ball, ball.state([1.0], [-1.0]), 2.0, 1.0 / steps, solver=Solver(refine=refine))
    assert [event.kind for event in path.events] == [EventKind.IMPACT]
    assert path.events[0].time == pytest.approx(1.0, abs=1e-6)
    np.testing.assert_allclose(path.v[-1, 0], [e], atol=1e-12)


@pytest.mark.parametrize("steps", [3, 4, 8])
def test_an_impact_of_two_bodies_at_the_end_of_a_step_is_one_event(steps):
    cradle = newtons_cradle(2)
    path = simulate(cradle, cradle.state([[0.0], [2.0]], [[1.0], [0.0]]), 2.0, 1.0 / steps)
    assert [event.kind for event in path.events] == [EventKind.IMPACT]
    np.testing.assert_allclose(path.v[-1].ravel(), [0, 1], atol=1e-12)


def test_a_ball_that_falls_for_whole_steps_bounces_once():
    h, steps = 1e-2, 40
    ball = bouncing_ball(1.0)
    start = 9.81 * (h * steps) ** 2 / 2
    path = simulate(ball, ball.state([start]), 1.5 * h * steps, h)
    assert [event.kind for event in path.events] == [EventKind.IMPACT]


def test_laws_are_checked():
    with pytest.raises(ValueError, match="impact"):
        bouncing_ball(1.0, impact="hertz")
    M = Manifold.euclidean("x")
    (x,), (v,) = M.symbols, velocities(M)
    kinds = {
        law: System(Polyhedron(M, {"wall": x}), v**2 / 2, sympy.S.Zero, impact=law)
        for law in ("poisson", "newton")
    }
    with pytest.raises(ValueError, match="law of impact"):
        Assembly(kinds, dict.fromkeys(kinds, 1))
