"""Motion does not depend on where the origin of a body is: its centre of mass, or any other."""

import pickle
import signal
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation
from sympy import Symbol, cos, sin

from polycorner import simulate
from polycorner.bodies import (
    Arrangement,
    Ball,
    HalfSpace,
    Hinge,
    Mass,
    Motor,
    Prescribed,
    Spring,
    capsule,
    disc,
    polygon,
    polytope,
)
from polycorner.motion import Checkpoint, Noise, Solver, time_symbol, velocities

G = 9.81
FLOOR = {"floor": HalfSpace([0, 1], [0, 0])}
GROUND = {"ground": HalfSpace([0, 0, 1], [0, 0, 0])}
SQUARE = np.array([[-0.5, -0.3], [0.5, -0.3], [0.5, 0.3], [-0.5, 0.3]])
KITE = np.array([[1.0, 1, 1], [-1, -1, 1], [-1, 1, -1], [1, -1, -1]]) / 3
PLANE, SPACE = np.array([0.7, 0.2]), np.array([0.5, 0.2, -0.3])


def flat(angle, c):
    """Return a vector of a body in the plane in the axes of space."""
    return np.array(
        [np.cos(angle) * c[0] - np.sin(angle) * c[1], np.sin(angle) * c[0] + np.cos(angle) * c[1]]
    )


def along(path, c, name=0):
    """Return places and velocities of the centres of mass of the body with a number, in the plane.

    By definition, ``X = x + R c`` and ``X' = x' + w x R c``.
    """
    q, v = path.q[:, name], path.v[:, name]
    arms = np.array([flat(angle, c) for angle in q[:, 2]])
    swept = v[:, 2:] * np.column_stack([-arms[:, 1], arms[:, 0]])
    return np.hstack([q[:, :2] + arms, q[:, 2:]]), np.hstack([v[:, :2] + swept, v[:, 2:]])


def matrix(a):
    """Return the matrix of a quaternion, unit or not, entry by entry."""
    w, x, y, z = a
    return np.array(
        [
            [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
        ]
    )


def in_space(path, c):
    """Return places and velocities of the centre of mass of a body in space.

    The rate of a quadratic form ``R(a)`` is ``(R(a + a') - R(a - a')) / 2``.
    """
    q, v = path.q[:, 0], path.v[:, 0]
    places = [x[:3] + matrix(x[3:]) @ c for x in q]
    rates = [
        s[:3] + (matrix(x[3:] + s[3:]) - matrix(x[3:] - s[3:])) @ c / 2
        for x, s in zip(q, v, strict=True)
    ]
    return np.array(places), np.array(rates)


# ------------------------------------------------------------------------------ bodies in flight


@pytest.mark.parametrize("dt", [1e-2, 1e-3])
def test_the_centre_of_mass_flies_straight_in_the_plane(dt):
    """It keeps its velocity at a high spin, and so do energy and spin, whatever the step."""
    w, angle, speed = 30.0, 0.4, np.array([1.0, -0.5])
    a = Arrangement({"A": capsule([-0.5, 0], [0.5, 0], 0.1)})
    system = a.system(masses={"A": Mass(2.0, PLANE, 0.3)})
    q = a.point({"A": ([0.0, 0.0], angle)})
    arm = flat(angle, PLANE)
    start = speed - w * np.array([-arm[1], arm[0]])
    path = simulate(system, system.state(q, [*start, w]), 1.0, dt)
    places, rates = along(path, PLANE)
    assert rates == pytest.approx(np.broadcast_to([*speed, w], rates.shape), rel=1e-12)
    expected = arm + path.times[:, None] * speed
    assert places[:, :2] == pytest.approx(expected, abs=1e-12)
    assert path.kinetic == pytest.approx(speed @ speed + 0.15 * w**2, rel=1e-12)
    assert path.audit < 1e-12


def test_the_centre_of_mass_falls_as_a_point_does():
    """Weight pulls at it: a parabola, exactly at the instants of a step."""
    a = Arrangement({"A": polygon(SQUARE + PLANE)})
    system = a.system(gravity=[0, -G])
    path = simulate(system, system.state(a.point({"A": [0, 0]}), [0, 0, 25.0]), 1.0, 1e-2)
    places, rates = along(path, PLANE)
    t = path.times
    swept = 25 * np.array([-PLANE[1], PLANE[0]])
    assert rates[:, :2] == pytest.approx(swept + np.outer(t, [0, -G]), abs=1e-11)
    expected = PLANE + np.outer(t, swept) + np.outer(t**2 / 2, [0, -G])
    assert places[:, :2] == pytest.approx(expected, abs=1e-11)


def top(moments, w, times):
    """Return the matrices of a body that nothing turns, by Euler's equations."""

    def rate(_, y):
        turned, spin = y[:9].reshape(3, 3), y[9:]
        change = np.cross(moments * spin, spin) / moments
        return np.concatenate([(turned @ np.cross(np.eye(3), spin)).ravel(), change])

    start = np.concatenate([np.eye(3).ravel(), w])
    ends = times[0], times[-1]
    found = solve_ivp(rate, ends, start, "DOP853", t_eval=times, rtol=1e-13, atol=1e-13)
    return found.y[:9].T.reshape(-1, 3, 3)


def spinning(c, dt, w, t_end=1.0):
    """Return the motion of a body with its centre of mass at ``c``, from the centre at 0."""
    a = Arrangement({"A": polytope(KITE, 0.1)})
    system = a.system(masses={"A": Mass(2.0, c, [0.3, 0.4, 0.6])})
    q = a.point({"A": -c})
    v = a.velocity(q, {"A": ([1, -0.5, 0.3] - np.cross(w, c), w)})
    return simulate(system, system.state(q, v), t_end, dt)


def test_a_free_top_turns_by_eulers_equations_about_its_centre_of_mass():
    """The centre flies straight, exactly; the rotation is of second order in the step."""
    w, errors = np.array([4.0, 1.0, -6.0]), []
    for dt in (1e-2, 5e-3):
        path = spinning(SPACE, dt, w)
        places, rates = in_space(path, SPACE)
        expected = np.outer(path.times, [1, -0.5, 0.3])
        assert places == pytest.approx(expected, abs=1e-12)
        assert rates == pytest.approx(np.broadcast_to([1, -0.5, 0.3], rates.shape), abs=1e-12)
        turned = Rotation.from_quat(path.q[:, 0, [4, 5, 6, 3]]).as_matrix()
        errors.append(np.abs(turned - top(np.array([0.3, 0.4, 0.6]), w, path.times)).max())
    assert errors[0] < 0.02
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2, abs=0.1)


def test_a_free_top_turns_the_same_about_any_origin():
    """Up to the tolerance of the sphere of quaternions, and its energy too."""
    one, other = (spinning(c, 1e-2, np.array([10.0, 3, -20])) for c in (SPACE, 0 * SPACE))
    assert one.q[:, 0, 3:] == pytest.approx(other.q[:, 0, 3:], abs=1e-9)
    assert one.kinetic == pytest.approx(other.kinetic, rel=1e-9)


# ----------------------------------------------------------------------- contacts, joints, drives


def told(path):
    """Return what happened, without the instants."""
    return [(e.kind, e.bodies, e.contact) for e in path.events]


def same_motion(system_at, c, starts, t_end=0.8, dt=2e-3, **laws):
    """Compare bodies with their origins at the centre of mass and off it by ``-c``."""
    paths = []
    for shift in (c, 0 * c):
        a = system_at(shift)
        system = a.system(**{name: law(a, shift) for name, law in laws.items()})
        q = a.point({n: (np.subtract(x, flat(t, shift)), t) for n, (x, t, *_) in starts.items()})
        moving = {}
        for n, (_, t, v, w) in starts.items():
            arm = flat(t, shift)
            moving[n] = (np.subtract(v, [-w * arm[1], w * arm[0]]), w)
        paths.append(simulate(system, system.state(q, a.velocity(q, moving)), t_end, dt))
    off, about = paths
    for k in range(len(starts)):
        own = slice(3 * k, 3 * k + 3)
        parts = [replace(p, q=p.q[..., own], v=p.v[..., own]) for p in paths]
        for x, y in zip(along(parts[0], c), (parts[1].q[:, 0], parts[1].v[:, 0]), strict=True):
            assert x == pytest.approx(y, abs=1e-7)
    assert told(off) == told(about)
    assert off.kinetic == pytest.approx(about.kinetic, abs=1e-7)
    assert [*off.work] == [*about.work]
    for name, work in off.work.items():
        assert work == pytest.approx(about.work[name], abs=1e-7)
    return off


THROWN = {"A": ([0.0, 1.0], 0.3, [1.0, 0.0], 8.0), "B": ([1.6, 1.2], -0.4, [-1.0, 0.5], -5.0)}


def pair(shift):
    """Return two rounded bodies over a floor, with their origins off their centres."""
    body = polygon(SQUARE + shift, 0.1)
    return Arrangement({"A": body, "B": body}, FLOOR, orientations="all")


def test_listed_bodies_collide_the_same():
    """They bounce, slide and roll on the floor and on each other."""
    laws = {"gravity": [0, -G], "friction": 0.4, "restitution": 0.5}
    path = same_motion(pair, PLANE, THROWN, **{n: lambda *_, x=x: x for n, x in laws.items()})
    assert len({e.contact for e in path.events}) > 2


def test_forces_and_formulas_act_where_they_did():
    """A force at a mark has the torque of its lever, and formulas of places read those of marks."""

    def pushing(a, shift):
        # At the mark (0.2, 0.1) from the centre of mass, in coordinates about it.
        arm = flat_formula("A", np.array([0.2, 0.1]) if not shift.any() else [0.0, 0.0])
        x, y = (s + m for s, m in zip(a.manifold.symbols[:2], arm, strict=True))
        rate = velocities(a.manifold)[2]
        pull = [-3 * x + time_symbol(), -2 * y]
        return {"A": [*pull, arm[0] * pull[1] - arm[1] * pull[0] - 0.1 * rate]}

    def one(shift):
        return Arrangement({"A": polygon(SQUARE + shift)}, orientations="all")

    c = -np.array([0.2, 0.1])
    same_motion(one, c, {"A": THROWN["A"]}, forces=pushing)


def flat_formula(name, c):
    """Return a vector of a body as a formula."""
    angle = Symbol(f"theta{name}", real=True)
    cosine, sine = cos(angle), sin(angle)
    return [cosine * c[0] - sine * c[1], sine * c[0] + cosine * c[1]]


def test_joints_and_springs_hold_where_they_did():
    """A chain of two bars with a spring and a motor that follows a formula."""

    def chain(shift):
        bar = capsule(np.array([-0.5, 0]) + shift, np.array([0.5, 0]) + shift, 0.1)
        ends = np.array([[-0.5, 0.0], [0.5, 0.0]]) + shift
        joints = {
            "nail": Hinge("world", "A", at=[0, 2], on=ends[0]),
            "knee": Hinge("A", "B", at=ends[1], on=ends[0]),
        }
        return Arrangement({"A": bar, "B": bar}, joints=joints)

    def driving(a, shift):
        # With a formula in the place of the centre of mass of B.
        arm = flat_formula("B", shift)
        height = a.manifold.symbols[4] + arm[1]
        spring = Spring("world", "B", at=[0.3, 0], on=shift, stiffness=4.0, length=0.5, damping=0.2)
        return {"spring": spring, "motor": Motor("knee", 0.5 * height)}

    starts = {"A": ([0.5, 2.0], 0.0, [0.0, 0.0], 0.0), "B": ([1.5, 2.0], 0.0, [0.0, 0.0], 0.0)}
    same_motion(chain, PLANE, starts, gravity=lambda *_: [0, -G], drives=driving)


def test_ties_of_repeated_bodies_hold_where_they_did():
    """Two equal bars on a nail, with a hinge between them and a motor by a formula of both."""
    found, solver = [], Solver(tolerance=1e-10)
    for c in (PLANE, 0 * PLANE):
        bar = capsule(np.array([-0.5, 0]) + c, np.array([0.5, 0]) + c, 0.1)
        left, right = np.array([[-0.5, 0.0], [0.5, 0.0]]) + c
        a = Arrangement({"A": bar}, orientations="all")
        joints = {
            "nail": Hinge("world", "A 1", at=[0, 2], on=left),
            "knee": Hinge("A 1", "A 2", at=right, on=left),
        }
        height = Symbol("yA2", real=True) + flat_formula("A2", c)[1]
        system = a.system(
            count=2, gravity=[0, -G], joints=joints, drives={"motor": Motor("knee", 0.5 * height)}
        )
        start = [[*(x - c), 0.0] for x in ([0.5, 2.0], [1.5, 2.0])]
        path = simulate(system, system.state(start), 0.8, 2e-3, solver=solver)
        found.append([*along(path, c, 0), *along(path, c, 1)])
    for x, y in zip(*found, strict=True):
        assert x == pytest.approx(y, abs=1e-7)


def test_a_pendulum_swings_by_its_equation_about_any_origin():
    """Of second order in the step, with the moment of inertia about the nail."""
    length, radius, first = 1.0, 0.1, 1.2
    errors = []
    for dt in (4e-3, 2e-3):
        bar = capsule(np.array([0, -length]) + PLANE, PLANE, radius)
        joint = Hinge("world", "A", at=[0, 0], on=PLANE)
        a = Arrangement({"A": bar}, joints={"nail": joint})
        mass = 2.0, PLANE - [0, length / 2], 0.2
        system = a.system(gravity=[0, -G], masses={"A": Mass(*mass)})
        path = simulate(system, system.state(a.point(joints={"nail": first})), 2.0, dt)
        pull = 2.0 * G * length / 2 / (0.2 + 2.0 * (length / 2) ** 2)
        exact = solve_ivp(
            lambda _, y, pull=pull: [y[1], -pull * np.sin(y[0])],
            (0, 2),
            [first, 0],
            "DOP853",
            t_eval=path.times,
            rtol=1e-13,
            atol=1e-13,
        )
        errors.append(np.abs(path.q[:, 0, 2] - exact.y[0]).max())
    assert errors[0] < 1e-4
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2, abs=0.1)


def test_repeated_bodies_and_kinds_move_as_listed_ones():
    """Many of one kind, and of two, fly and fall as each alone, with their centres of mass."""
    bar, wheel = polygon(SQUARE + PLANE, 0.1), disc(0.3, at=[0.2, 0])
    places = [([30.0 * k, 3.0], 0.5 * k) for k in range(3)]
    alone = Arrangement({"bar": bar}, FLOOR, orientations="all")
    one = alone.system(gravity=[0, -G], restitution=0.5)
    runs = [
        simulate(one, one.state(alone.point({"bar": p}), [0.2, 0, 9.0]), 1.0, 2e-3) for p in places
    ]
    q = np.array([alone.point({"bar": p}) for p in places])
    v = np.tile([0.2, 0, 9.0], (3, 1))
    several = alone.system(gravity=[0, -G], restitution=0.5, count=3)
    path = simulate(several, several.state(q, v), 1.0, 2e-3)
    assert path.q == pytest.approx(np.concatenate([run.q for run in runs], axis=1), abs=1e-7)
    both = Arrangement({"wheel": wheel, "bar": bar}, FLOOR, orientations="all")
    kinds = both.system(gravity=[0, -G], restitution=0.5, count={"wheel": 2, "bar": 3})
    start = kinds.state(
        {"wheel": [[-50.0, 1.0, 0.0], [-30.0, 1.0, 0.0]], "bar": q}, {"bar": v, "wheel": 0 * v[:2]}
    )
    mixed = simulate(kinds, start, 1.0, 2e-3)
    assert mixed["bar"].q == pytest.approx(path.q, abs=1e-7)


def test_a_sharp_body_in_space_tumbles_the_same():
    """It lands, rubs and rolls on the ground."""
    laws = {"gravity": [0, 0, -G], "friction": 0.4, "restitution": 0.3}
    w, found = np.array([3.0, -2.0, 5.0]), []
    for c in (SPACE, 0 * SPACE):
        a = Arrangement({"A": polytope(KITE + c)}, GROUND, orientations="all")
        system = a.system(**laws)
        q = a.point({"A": np.array([0, 0, 1.0]) - c})
        v = a.velocity(q, {"A": ([1, 0, 0] - np.cross(w, c), w)})
        path = simulate(system, system.state(q, v), 0.6, 2e-3)
        found.append((*in_space(path, c), path.q[:, 0, 3:], told(path)))
    for x, y in zip(*(some[:3] for some in found), strict=True):
        assert x == pytest.approx(y, abs=1e-6)
    assert found[0][3] == found[1][3]


def test_a_ball_joint_in_space_holds_the_same():
    """A body hangs from a point, with its origin anywhere."""
    found = []
    for c in (SPACE, 0 * SPACE):
        joint = Ball("world", "A", at=[0, 0, 0], on=KITE[0] + c)
        a = Arrangement({"A": polytope(KITE + c, 0.1)}, joints={"pin": joint})
        system = a.system(gravity=[0, 0, -G])
        turned = Rotation.from_rotvec([1.0, 0.3, 0])
        q = a.point({"A": (-turned.apply(KITE[0] + c), turned)})
        path = simulate(system, system.state(q), 0.5, 2e-3)
        found.append((*in_space(path, c), path.q[:, 0, 3:]))
    for x, y in zip(*found, strict=True):
        assert x == pytest.approx(y, abs=1e-6)


# -------------------------------------------------------------------------- what goes on, and rests


def test_it_goes_on_bit_for_bit(tmp_path):
    """From the last state, from a checkpoint, and from a pickle, as one run would have."""
    a = Arrangement({"A": polygon(SQUARE + PLANE, 0.1)}, FLOOR, orientations="all")
    system = a.system(gravity=[0, -G], friction=0.4, restitution=0.5)
    state = system.state(a.point({"A": [0, 1.0]}), [1.0, 0, 8])
    whole = simulate(system, state, 0.8, 2e-3, every=10)
    half = simulate(system, state, 0.4, 2e-3, every=10)
    rest = simulate(system, half.last, 0.8, 2e-3, every=10)
    assert np.array_equal(rest.q[-1], whole.q[-1])
    assert np.array_equal(rest.v[-1], whole.v[-1])
    copied = pickle.loads(pickle.dumps(system))
    assert np.array_equal(simulate(copied, state, 0.8, 2e-3, every=10).q, whole.q)
    presses = [signal.SIGINT]
    options = {
        "every": 10,
        "checkpoint": Checkpoint(tmp_path),
        "progress": lambda done, *_: (
            signal.raise_signal(presses.pop()) if presses and done > 0.3 else None
        ),
    }
    part, done = (simulate(system, state, 0.8, 2e-3, **options) for _ in range(2))
    assert not part.finished
    assert np.array_equal(done.q, whole.q)
    assert np.array_equal(done.v, whole.v)


def test_what_rests_keeps_its_place():
    """To the last bit, as a body with its origin at the centre of mass does."""
    a = Arrangement({"A": polygon(SQUARE + PLANE)}, FLOOR, orientations="all")
    system = a.system(gravity=[0, -G], friction=0.5)
    q = a.point({"A": [0.3, 0.3 - PLANE[1]]})
    path = simulate(system, system.state(q), 0.2, 1e-2)
    assert path.rests[1:].all()
    assert np.array_equal(path.q, np.broadcast_to(path.q[0], path.q.shape))
    assert path.q[0, 0] == pytest.approx(q, abs=1e-15)


def test_where_coordinates_of_origins_are_more_than_coordinates():
    """Random forces on them, prescribed ones, and those by which bodies leave are as they were."""
    body = polygon(SQUARE + PLANE)
    a = Arrangement({"A": body}, orientations="all")
    q = a.point({"A": [0, 0]})
    assert a.system(exits={"xA": 2.0}).chart is None
    drives = {"lift": Prescribed("yA", 0.5 * time_symbol())}
    lifted = a.system(drives=drives)
    path = simulate(lifted, lifted.state(q, [0, 0.5, 0]), 0.5, 1e-3)
    assert path.q[-1, 0, 1] == pytest.approx(0.25, abs=1e-9)
    system = a.system()
    assert system.chart is not None
    assert replace(system, restitution=0.0).chart is None
    # A kick on the place of the origin leaves its force there: the body turns.
    kicked = simulate(system, system.state(q), 0.1, 1e-2, noise=Noise(kicks={"xA": 1.0}, seed=1))
    assert abs(kicked.v[-1, 0, 2]) > 1e-3
    assert Arrangement({"A": polygon(SQUARE)}).system().chart is None
    # What rolls on its round edge keeps the centre of this edge.
    wheel = Arrangement({"A": disc(0.3)}, FLOOR, orientations="all")
    loaded = {"A": Mass(1.0, [0.1, 0], 0.05)}
    assert wheel.system(masses=loaded).chart is not None
    assert wheel.system(masses=loaded, friction=0.1).chart is None
