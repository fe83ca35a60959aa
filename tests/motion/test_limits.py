"""Limits on velocities and nonholonomic equations, against closed forms and slow oracles."""

import itertools
import math
import re

import numpy as np
import pytest
import sympy
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from polycorner import Friction, Manifold, Polyhedron, System, simulate, velocities
from polycorner.motion import Disc, EventKind, Interval, accelerations, time_symbol
from polycorner.motion.noise import Solver

LINE, PLANE = Manifold.euclidean("x"), Manifold.euclidean("x y")
(X,), (V,) = LINE.symbols, velocities(LINE)
(PX, PY), (VX, VY) = PLANE.symbols, velocities(PLANE)
T = time_symbol()
ROUNDING = 1e-12


def point(force=0, **more):
    """A point of mass 1 on a line, under a force."""
    return System(
        Polyhedron(LINE, {"far": X + 1000}), V**2 / 2, forces={"x": force + 0 * X}, **more
    )


def in_plane(along=0, across=0, kinetic=(VX**2 + VY**2) / 2, contacts=None, **more):
    forces = {"x": along + 0 * PX, "y": across + 0 * PX}
    far = {"far": PX + 1000} if contacts is None else contacts
    return System(Polyhedron(PLANE, far), kinetic, forces=forces, **more)


def halved(end, exact, largest, levels=5):
    """The orders in the step with which the error of an end vanishes, at each halving."""
    errors = [np.abs(end(largest / 2**k) - exact).max() for k in range(levels)]
    return np.log2(np.array(errors[:-1]) / errors[1:])


# ------------------------------------------------------------------------- a limit that is followed


def limit(x):
    return 1 + 0.3 * np.sin(x)


def turned(t, y):
    """A point at the speed ``limit(x)`` in a direction ``phi`` that a force ``2 (cos t, sin t)``
    turns: what acts along its way is taken up by the limit."""
    x, _, phi = y
    c = limit(x)
    return c * np.cos(phi), c * np.sin(phi), 2 * np.sin(t - phi) / c


def under_a_turning_force(dt, **more):
    c = 1 + sympy.Rational(3, 10) * sympy.sin(PX)
    system = in_plane(
        2 * sympy.cos(T), 2 * sympy.sin(T), limits={"speed": c**2 - VX**2 - VY**2}, **more
    )
    return simulate(system, system.state([0, 0], [1, 0]), 2.0, dt, every=1)


def test_a_turning_force_is_followed_to_second_order_and_the_limit_to_rounding():
    x, y, phi = solve_ivp(turned, (0, 2), [0, 0, 0], rtol=1e-12, atol=1e-13).y[:, -1]
    exact = np.array([x, y, limit(x) * np.cos(phi), limit(x) * np.sin(phi)])
    paths = []

    def end(dt):
        paths.append(under_a_turning_force(dt))
        return np.concatenate([paths[-1].q[-1, 0], paths[-1].v[-1, 0]])

    assert halved(end, exact, 0.1, levels=6) == pytest.approx(2, abs=0.1)
    for path in paths:
        above = np.hypot(*path.v[:, 0].T) - limit(path.q[:, 0, 0])
        assert above.max() <= ROUNDING
        assert path.converged
        assert path.audit < ROUNDING
        assert [e.kind for e in path.events] == [EventKind.ACTED]


def test_friction_that_turns_with_a_limit_is_of_second_order():
    """It acts along the way, where the limit takes up what is left of the force."""
    rub = 0.2

    def rate(t, y):
        return *turned(t, y[:3]), rub * limit(y[0])

    x, y, phi, heat = solve_ivp(rate, (0, 2), [0, 0, 0, 0], rtol=1e-12, atol=1e-13).y[:, -1]
    exact = np.array([x, y, limit(x) * np.cos(phi), limit(x) * np.sin(phi), heat])

    def end(dt):
        path = under_a_turning_force(dt, friction=[Friction("rub", (VX, VY), Disc(1), load=rub)])
        assert path.converged
        assert path.audit < ROUNDING
        assert (np.hypot(*path.v[:, 0].T) - limit(path.q[:, 0, 0])).max() <= ROUNDING
        return np.concatenate([path.q[-1, 0], path.v[-1, 0], sum(path.dissipated.values())[-1:]])

    assert halved(end, exact, 0.1, levels=6) == pytest.approx(2, abs=0.1)


def test_a_limit_begins_and_ceases_to_act_where_it_is_met():
    """``v' = 2 cos t`` with ``v <= 1``: 2 sin t, then 1 until the force turns."""

    system = point(2 * sympy.cos(T), limits={"top": 1 - V})

    def run(dt):
        return simulate(system, system.state([0.0]), 3.0, dt, every=10**6)

    begin, cease = math.pi / 6, math.pi / 2
    way = 2 - 2 * math.cos(begin) + (cease - begin)
    way += -(3 - cease) + 2 * (math.cos(cease) - math.cos(3))
    steps = 0.1 / 2.0 ** np.arange(5)
    # A limit is met at any part of a step: of several steps about as long the worst counts.
    worst = [max(abs(run(dt * f).q[-1, 0, 0] - way) for f in (1, 1.1, 1.3, 1.6)) for dt in steps]
    assert np.polyfit(np.log(steps), np.log(worst), 1)[0] == pytest.approx(2, abs=0.3)
    first, last = run(0.01).events
    assert (first.kind, last.kind) == (EventKind.ACTED, EventKind.CEASED)
    assert (first.contact, last.bodies) == ("top", (0,))
    assert [first.time, last.time] == pytest.approx([begin, cease], abs=1e-4)


def test_the_force_of_a_limit_is_recorded_and_its_work_booked():
    """At 1.5 a limit takes what a pull of 5 is more than friction of 3."""
    system = System(
        Polyhedron(PLANE, {"floor": PY}),
        (VX**2 + VY**2) / 2,
        10 * PY,
        {"x": 5 + 0 * PX},
        [Friction("rub", [VX], Interval(0.3), "floor")],
        limits={"speed": sympy.Rational(3, 2) - VX},
    )
    path = simulate(system, system.state([0, 0]), 2.0, 0.01)
    assert path.v[-1, 0].tolist() == pytest.approx([1.5, 0.0], abs=ROUNDING)
    forces = {name: force for _, name, force in path.touching[-1]}
    assert forces == pytest.approx({"floor": 10.0, "speed": 2.0})
    assert path.work["speed"][-1] == pytest.approx(-2 * 1.5 * 1.25)
    assert path.dissipated["sliding"][-1] == pytest.approx(3 * path.q[-1, 0, 0])
    assert path.audit < 1e-9


def test_a_limit_that_moves_gives_energy():
    """A belt of the speed t pulls: v >= t."""
    system = point(limits={"belt": V - T})
    path = simulate(system, system.state([0.0]), 1.0, 0.1)
    assert path.v[-1, 0, 0] == pytest.approx(1.0, abs=ROUNDING)
    assert path.work["belt"][-1] == pytest.approx(0.5, abs=ROUNDING)


def test_each_of_several_bodies_has_limits_and_a_run_goes_on_bit_for_bit():
    system = point(1, count=2, limits={"top": 1 - V}, nonholonomic={})
    start = system.state([[0.0], [1.0]], [[0.0], [0.5]])
    whole = simulate(system, start, 2.0, 0.01, every=1)
    part = simulate(system, start, 0.75, 0.01)
    rest = simulate(part.system, part.last, 2.0, 0.01)
    assert whole.v[-1] == pytest.approx(1.0, abs=ROUNDING)
    assert rest.q[-1].tolist() == whole.q[-1].tolist()
    assert [(e.bodies, round(e.time, 6)) for e in whole.events] == [((1,), 0.5), ((0,), 1.0)]


# -------------------------------------------------------------------------------------------- jumps


@pytest.mark.parametrize("steps", [7, 10, 33])
def test_a_limit_that_falls_at_a_place_is_met_there(steps):
    """Free fall x = t + t^2 / 2 to the place 1, and 1 m/s from there."""
    slow = sympy.Piecewise((1, X > 1), (3, True))
    system = point(1, limits={"zone": slow - V})
    path = simulate(system, system.state([0.0], [1.0]), 2.0, 2 / steps)
    met = math.sqrt(3) - 1
    assert path.q[-1, 0, 0] == pytest.approx(1 + 2 - met, abs=1e-8)
    assert path.events[0].time == pytest.approx(met, abs=1e-8)
    # Loss at the place, and what the limit takes from the force afterwards.
    assert path.work["zone"][-1] == pytest.approx((1 - 3) / 2 - (2 - met), abs=1e-8)
    assert path.audit < ROUNDING


def test_a_limit_that_falls_at_a_time_is_kept_at_the_end_of_the_step():
    system = point(limits={"zone": sympy.Piecewise((1, sympy.Rational(1, 2) <= T), (3, True)) - V})
    path = simulate(system, system.state([0.0], [2.0]), 1.0, 0.1, every=1)
    assert path.v[:, 0, 0].tolist() == [2.0] * 5 + [1.0] * 6
    assert path.q[-1, 0, 0] == pytest.approx(1.5, abs=1e-8)


def test_a_limit_that_acts_may_fall_and_rise():
    c = sympy.Piecewise((2, X < 1), (1, X < 2), (2, True))
    system = point(1, limits={"zone": c - V})
    for dt in (0.3, 0.0625, 0.01):
        path = simulate(system, system.state([0.0], [2.0]), 4.0, dt)
        # Half a second, a second at 1, a second up to 2, and the rest at 2.  Jumps are located;
        # where the limit is met smoothly, within a step, the mean velocity is off by up to dt / 2.
        assert path.q[-1, 0, 0] == pytest.approx(3.5 + 2 * 1.5, abs=dt**2 / 8 + 1e-8)


def test_an_impact_projects_onto_a_convex_limit_in_the_metric_of_the_masses():
    masses = np.array([1.0, 4.0])
    falls = sympy.Piecewise((1, sympy.Rational(1, 2) <= T), (9, True))
    kinetic = (VX**2 + 4 * VY**2) / 2
    system = in_plane(kinetic=kinetic, limits={"disc": falls - VX**2 - VY**2})
    v = np.array([2.0, 1.5])
    path = simulate(system, system.state([0, 0], v), 1.0, 0.1)

    def at(p):
        return masses * v / (masses + p)

    root = brentq(lambda p: at(p) @ at(p) - 1, 0, 100, xtol=1e-14)
    assert path.v[-1, 0] == pytest.approx(at(root), abs=1e-9)
    lost = masses @ (v**2 - at(root) ** 2) / 2
    assert path.work["disc"][-1] == pytest.approx(-lost, abs=1e-9)
    assert path.audit < ROUNDING


def projected(v, rows, bounds):
    """The nearest point of ``rows w >= bounds``, by looking at all sets of rows that hold."""
    found = []
    for k in range(len(rows) + 1):
        for some in map(list, itertools.combinations(range(len(rows)), k)):
            A, b = rows[some], bounds[some]
            if some and np.linalg.matrix_rank(A) < k:
                continue
            p = np.linalg.solve(A @ A.T, b - A @ v) if some else np.zeros(0)
            w = v + A.T @ p
            if (p >= 0).all() and (rows @ w >= bounds - 1e-12).all():
                found.append(w)
    (w,) = found
    return w


def test_a_contact_and_limits_are_met_in_one_impact():
    """A point falls on a slope of 45 degrees, down which it may go at 0.3 along x only."""
    slope = (PX + PY) / sympy.sqrt(2)
    system = System(
        Polyhedron(PLANE, {"slope": slope}),
        (VX**2 + VY**2) / 2,
        limits={"x": sympy.Rational(3, 10) - VX, "y": VY + 4},
    )
    path = simulate(system, system.state([0.0, 1.0], [0.1, -2.0]), 1.0, 0.01)
    rows = np.array([[1.0, 1.0], [-1.0, 0.0], [0.0, 1.0]]) / np.array([[math.sqrt(2)], [1], [1]])
    after = projected(np.array([0.1, -2.0]), rows, np.array([0.0, -0.3, -4.0]))
    assert path.v[-1, 0] == pytest.approx(after, abs=1e-9)
    assert path.audit < ROUNDING


# ----------------------------------------------------------------------------- one way, and at rest


def test_a_ratchet_turns_one_way():
    """``v' = cos t``, ``v >= 0``, from rest: ``sin t``, and after a pause ``1 + sin t``."""
    system = point(sympy.cos(T), limits={"ratchet": V})
    path = simulate(system, system.state([0.0]), 4 * math.pi, 1e-2, every=1)
    assert path.v.min() == 0.0
    # It is back at rest at pi, and held until 3 pi / 2.
    way = 2 + (4 - 1.5) * math.pi - (math.cos(4 * math.pi) - math.cos(1.5 * math.pi))
    assert path.q[-1, 0, 0] == pytest.approx(way, abs=1e-3)
    assert abs(path.work["ratchet"]).max() < 1e-4  # an ideal one takes nothing as the step vanishes


def test_a_ratchet_holds_what_pulls_back_at_rest():
    system = System(Polyhedron(LINE, {"far": X + 100}), V**2 / 2, X, limits={"ratchet": V})
    path = simulate(system, system.state([0.0], [1.0]), 2.0, 1e-2)
    assert [e.kind for e in path.events] == [EventKind.ACTED, EventKind.REST]
    assert path.v[-1].item() == 0.0
    assert path.rests[-1].all()
    assert path.q[-1].item() == pytest.approx(0.5, abs=ROUNDING)
    assert path.touching[-1] == (((0,), "ratchet", pytest.approx(1.0)),)


def test_a_least_speed_lets_nothing_rest():
    """Friction would hold the block, which a limit keeps going."""
    system = System(
        Polyhedron(PLANE, {"floor": PY}),
        (VX**2 + VY**2) / 2,
        10 * PY,
        friction=[Friction("rub", [VX], Interval(0.3), "floor")],
        limits={"least": VX - sympy.Rational(1, 10)},
    )
    path = simulate(system, system.state([0, 0], [1, 0]), 1.0, 1e-2)
    assert path.v[-1, 0, 0] == pytest.approx(0.1, abs=ROUNDING)
    assert not path.rests.any()
    forces = {name: force for _, name, force in path.touching[-1]}
    assert forces == pytest.approx({"floor": 10.0, "least": 3.0})


# --------------------------------------------------------------------------- nonholonomic equations

SKATER = Manifold.euclidean("x y theta")
SX, SY, THETA = SKATER.symbols
UX, UY, TURN = velocities(SKATER)
ALONG = -sympy.sin(THETA) * UX + sympy.cos(THETA) * UY


def skate(dt):
    """A skate that turns at the rate 1 on a slope of the pull 1/2 against x."""
    system = System(
        Polyhedron(SKATER, {"far": SX + 1000}),
        (UX**2 + UY**2 + TURN**2) / 2,
        SX / 2,
        nonholonomic={"skate": ALONG},
    )
    return simulate(system, system.state([0, 0, 0], [0, 0, 1]), 6.0, dt, every=1)


def test_a_skate_on_a_slope_runs_on_a_cycloid():
    """Along itself it goes at ``-sin(t) / 2``: x = -sin^2(t) / 4, y = (sin(2 t) - 2 t) / 8."""
    exact = np.array([-(math.sin(6) ** 2) / 4, (math.sin(12) - 12) / 8, 6.0])
    paths = []

    def end(dt):
        paths.append(skate(dt))
        return paths[-1].q[-1, 0]

    assert halved(end, exact, 0.1) == pytest.approx(2, abs=0.02)
    for path in paths:
        assert np.ptp(path.kinetic + path.potential) < ROUNDING
        assert abs(path.work["skate"]).max() < ROUNDING
        assert path.touching[-1][0][:2] == ((0,), "skate")


def test_a_skate_that_rubs_loses_what_friction_takes_along_its_way():
    """Along itself it goes at ``1 - sin(t) / 2 - rub t``, always forwards."""
    rub, t_end = 0.05, 3.0
    system = System(
        Polyhedron(SKATER, {"far": SX + 1000}),
        (UX**2 + UY**2 + TURN**2) / 2,
        SX / 2,
        nonholonomic={"skate": ALONG},
        friction=[Friction("rub", (UX, UY), Disc(1), load=rub)],
    )
    speed = 1 - math.sin(t_end) / 2 - rub * t_end
    way = t_end + (math.cos(t_end) - 1) / 2 - rub * t_end**2 / 2
    exact = np.array([speed * math.cos(t_end), speed * math.sin(t_end), rub * way])

    def end(dt):
        path = simulate(system, system.state([0, 0, 0], [1, 0, 1]), t_end, dt, every=1)
        assert path.audit < ROUNDING
        assert abs(path.work["skate"]).max() < ROUNDING
        return np.append(path.v[-1, 0, :2], sum(path.dissipated.values())[-1])

    assert halved(end, exact, 0.1) == pytest.approx(2, abs=0.1)


def test_an_equation_with_the_time_drives():
    """``x' = cos t``: its work is the kinetic energy that it gives."""
    system = in_plane(nonholonomic={"pull": VX - sympy.cos(T)})
    path = simulate(system, system.state([0, 0], [1, 2]), 1.0, 0.01)
    assert path.v[-1, 0] == pytest.approx([math.cos(1), 2], abs=1e-4)
    gained = path.kinetic[-1] - path.kinetic[0]
    assert path.work["pull"][-1] == pytest.approx(gained, abs=ROUNDING)


# -------------------------------------------------------------------------- what admits no velocity


def test_limits_that_admit_no_velocity_are_said_to_fail():
    system = System(Polyhedron(LINE, {"wall": 1 - X}), V**2 / 2, limits={"on": V - 1})
    path = simulate(system, system.state([0.0], [1.0]), 1.5, 0.1)
    failed = path.of_kind(EventKind.FAILED)
    assert failed
    assert failed[0].time == pytest.approx(1.0, abs=0.1)
    assert failed[0].contact in {"on", "wall"}
    assert "limits may admit no velocity together" in failed[0].kind.sentence
    assert not path.converged


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ({"limits": {"a": 1 - X}}, "limits: expected a formula in the velocities x_dot for 'a'"),
        ({"limits": {"a": V**2 - 1}}, "limits: expected a function that is concave in the"),
        ({"limits": {"a": sympy.sin(V)}}, "limits: expected a function that is concave in the"),
        ({"limits": {"a": 1 - V - PY}}, "formula in x, x_dot, time for 'a'; got 'y'"),
        ({"nonholonomic": {"a": V**2 - 1}}, "nonholonomic: expected an affine function"),
        ({"nonholonomic": {"a": X}}, "nonholonomic: expected a formula in the velocities"),
        ({"limits": {"far": 1 - V}}, "limits: expected names that nothing else has; got 'far'"),
        ({"limits": {"noise": 1 - V}}, "limits: expected names that nothing else has"),
        ({"limits": {"a": V}, "nonholonomic": {"a": V}}, "nonholonomic: expected names that"),
        ({"limits": 1 - V}, "limits: expected"),
    ],
)
def test_what_is_no_limit_is_refused(arguments, told):
    with pytest.raises((TypeError, ValueError), match=re.escape(told)):
        point(**arguments)


def test_velocities_beyond_a_limit_are_refused():
    system = point(limits={"top": 1 - V + X})
    with pytest.raises(ValueError, match="within the limit 'top'; its value is -1"):
        system.state([0.0], [2.0])
    system.state([1.0], [2.0])
    several = point(count=2, limits={"top": 1 - V})
    with pytest.raises(ValueError, match="limit 'top' of body 1; its value is -1"):
        several.state([[0.0], [1.0]], [[0.0], [2.0]])
    still = System(
        Polyhedron(SKATER, {"far": SX + 1000}),
        (UX**2 + UY**2 + TURN**2) / 2,
        nonholonomic={"skate": ALONG},
    )
    with pytest.raises(ValueError, match="with which equation 'skate' holds; it is 1"):
        still.state([0, 0, 0], [0, 1, 0])


def test_what_knows_nothing_of_limits_says_so():
    system = point(limits={"top": 1 - V})
    state = system.state([0.0])
    with pytest.raises(NotImplementedError, match="without limits on velocities"):
        accelerations(system, state)
    with pytest.raises(NotImplementedError, match="crowd_sweeps=0 for bodies with limits"):
        simulate(system, state, 1.0, 0.1, solver=Solver.crowd(1))


def test_a_system_tells_of_its_limits():
    system = point(limits={"top": 1 - V})
    assert system.described()["limit top"] == "1 - x_dot"
    assert "limits on velocities" in str(system)
    assert point(nonholonomic={"held": V}).described()["nonholonomic held"] == "x_dot"
