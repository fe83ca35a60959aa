"""Forces that depend on velocity and time, masses that depend on the placement: second order.

Exact solutions are closed forms, or those of SciPy's integrator for equations derived by hand.
"""

import math

import numpy as np
import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from polycorner import Manifold, Polyhedron, System, velocities
from polycorner.errors import SolverError
from polycorner.motion import simulate, time_symbol

FAR = 1e6
PLANE, LINE, POLAR = (Manifold.euclidean(names) for names in ("x y", "x", "r p"))
(X, Y), (VX, VY) = PLANE.symbols, velocities(PLANE)
(S,), (VS,) = LINE.symbols, velocities(LINE)
T = time_symbol()


def free(manifold, kinetic, potential=0, **forces):
    """A system that touches nothing."""
    return System(
        Polyhedron(manifold, {"far": FAR - manifold.symbols[0]}), kinetic, potential, forces
    )


def order(error, dt, levels=4):
    steps = dt / 2.0 ** np.arange(levels)
    return np.polyfit(np.log(steps), np.log([error(h) for h in steps]), 1)[0]


def last(system, q, v, t_end, dt):
    path = simulate(system, system.state(q, v), t_end, dt, every=10**7)
    assert path.converged
    return path


def is_second(measured):
    return 1.9 < measured < 2.1


@pytest.mark.parametrize("field", [3.0, -0.4, 50.0])
def test_a_gyroscopic_force_turns_the_velocity_and_does_no_work(field):
    system = free(PLANE, (VX**2 + VY**2) / 2, x=field * VY, y=-field * VX)

    def error(dt):
        path = last(system, [0, 0], [1, 0], 2.0, dt)
        assert np.linalg.norm(path.v[-1]) == pytest.approx(1, abs=1e-11)
        assert abs(path.work["applied"][-1]) < 1e-11
        exact = np.exp(-1j * field * 2.0)
        return abs(complex(*path.v[-1, 0]) - exact)

    assert is_second(order(error, 0.2 / abs(field)))


@pytest.mark.parametrize("drag", [0.5, 4.0])
def test_drag_slows_down_exponentially(drag):
    system = free(LINE, VS**2 / 2, x=-drag * VS)

    def error(dt):
        path = last(system, [0], [1], 1.5, dt)
        assert path.audit < 1e-12
        return abs(path.v[-1, 0, 0] - math.exp(-1.5 * drag))

    assert is_second(order(error, 0.1 / drag))


def test_a_free_particle_in_polar_coordinates_goes_straight():
    (r, _), (vr, vp) = POLAR.symbols, velocities(POLAR)
    system = System(Polyhedron(POLAR, {"r": r}), (vr**2 + r**2 * vp**2) / 2)
    start, speed = 1 + 0j, -0.5 + 0.3j

    def error(dt):
        q = last(system, [1, 0], [speed.real, speed.imag], 10.0, dt).q[-1, 0]
        return abs(q[0] * np.exp(1j * q[1]) - (start + 10 * speed))

    assert is_second(order(error, 0.02))
    path = last(system, [1, 0], [speed.real, speed.imag], 200.0, 0.01)
    assert path.kinetic[-1] == pytest.approx(path.kinetic[0], rel=1e-4)


def test_a_double_pendulum_swings_as_by_the_hand_written_equations():
    """Two unit masses on rods of unit length, gravity one."""
    M = Manifold.euclidean("a b")
    (a, b), (va, vb) = M.symbols, velocities(M)
    kinetic = va**2 + vb**2 / 2 + va * vb * sp.cos(a - b)
    system = free(M, kinetic, -2 * sp.cos(a) - sp.cos(b))

    def equations(_, state):
        a, b, u, w = state
        c, s = math.cos(a - b), math.sin(a - b)
        right = [-(w**2) * s - 2 * math.sin(a), u**2 * s - math.sin(b)]
        return [u, w, *np.linalg.solve([[2, c], [c, 1]], right)]

    exact = solve_ivp(
        equations, (0, 3), [1.2, -0.5, 0, 0.4], rtol=1e-12, atol=1e-12, method="DOP853"
    )

    def error(dt):
        path = last(system, [1.2, -0.5], [0, 0.4], 3.0, dt)
        return np.linalg.norm(path.q[-1, 0] - exact.y[:2, -1])

    assert is_second(order(error, 0.01))


def test_a_force_of_the_time_drives():
    """``x'' + x = cos(2 t)`` from rest: ``x = (cos t - cos 2t) / 3``."""
    system = free(LINE, VS**2 / 2, S**2 / 2, x=sp.cos(2 * T))

    def error(dt):
        path = last(system, [0], [0], 2.5, dt)
        return abs(path.q[-1, 0, 0] - (math.cos(2.5) - math.cos(5)) / 3)

    assert is_second(order(error, 0.05))
    late = system.state([0], [0], time=math.pi)
    shifted = simulate(system, late, math.pi + 2.5, 1e-3, every=10**7)
    assert shifted.q[-1, 0, 0] == pytest.approx((math.cos(2.5) - math.cos(5)) / 3, abs=1e-6)


def test_a_bead_in_a_ring_is_slowed_by_drag_at_the_same_order():
    """Contact and drag act together: along the ring the speed decays exponentially."""
    ring = Polyhedron(PLANE, {"ring": 1 - X**2 - Y**2})
    system = System(ring, (VX**2 + VY**2) / 2, forces={"x": -0.7 * VX, "y": -0.7 * VY})

    def error(dt):
        path = last(system, [1, 0], [0, 1], 2.0, dt)
        return abs(np.linalg.norm(path.v[-1]) - math.exp(-1.4))

    assert is_second(order(error, 0.02))


@pytest.mark.parametrize(
    "given",
    [{"kinetic": VS**2 * (1 + T)}, {"potential": S * T}],
    ids=["kinetic", "potential"],
)
def test_only_forces_know_the_time(given):
    (argument,) = given
    with pytest.raises(ValueError, match=f"^{argument}: expected no time"):
        System(Polyhedron(LINE, {"x": S}), **({"kinetic": VS**2} | given))


# ------------------------------------------------------------------------------------ bad numbers


@pytest.mark.parametrize(
    "force", [sp.sqrt(1 - S), sp.sqrt(0.4 - T), -sp.log(1 - S), 1 / sp.Max(0, 1 - S)], ids=str
)
def test_a_force_that_is_not_a_number_stops_the_run_at_the_state_before(force):
    system = free(LINE, VS**2 / 2, x=force)
    with pytest.raises(
        SolverError, match=r"the force on x at t = .*, x = .* is (nan|inf)"
    ) as caught:
        simulate(system, system.state([0.5], [1.0]), 5.0, 1e-3)
    state = caught.value.state
    assert state.time == pytest.approx(0.4, abs=2e-3) or state.q[0] == pytest.approx(1, abs=5e-3)
    assert np.isfinite(state.v).all()
    again = simulate(system, system.state([0.5], [1.0]), state.time - 1e-9, 1e-3, every=10**6)
    assert again.q[-1, 0, 0] == pytest.approx(state.q[0], abs=2e-2)


@pytest.mark.parametrize("equations", [{}, {"rail": Y}])
@pytest.mark.parametrize("force", [1 / X, sp.log(X), sp.sqrt(X - 1)])
def test_a_force_that_is_not_finite_at_the_start_is_named(force, equations):
    far = Polyhedron(PLANE, {"far": FAR - X}, equations=equations)
    system = System(far, (VX**2 + VY**2) / 2, forces={"x": force})
    with pytest.raises(SolverError, match=r"the force on x at t = 0, x = 0, y = 0 is"):
        simulate(system, system.state([0, 0]), 1.0, 1e-2)


@pytest.mark.parametrize("equations", [{}, {"rail": Y}])
def test_a_start_at_the_edge_of_the_forces_moves(equations):
    far = Polyhedron(PLANE, {"far": FAR - X}, equations=equations)
    system = System(far, (VX**2 + VY**2) / 2, forces={"x": sp.sqrt(X)})
    path = simulate(system, system.state([0, 0], [1, 0]), 1.0, 1e-3)
    assert path.v[-1, 0, 0] > 1


def test_a_gap_that_is_not_a_number_stops_the_run():
    walls = Polyhedron(LINE, {"root": 2 - sp.sqrt(1 - S)})
    system = System(walls, VS**2 / 2)
    with pytest.raises(SolverError, match="the gap 'root' at t = 1, x = 1 is not"):
        simulate(system, system.state([0.0], [1.0]), 5.0, 1e-2)


@pytest.mark.parametrize("kinetic", [VX**2 / 2, (VX**2 - VY**2) / 2, (VX + VY) ** 2])
def test_a_mass_matrix_has_to_be_positive_definite(kinetic):
    system = free(PLANE, kinetic)
    with pytest.raises(ValueError, match=r"^kinetic: expected a positive definite mass"):
        simulate(system, system.state([0, 0]), 1.0, 1e-2)


def test_a_mass_that_ceases_to_be_positive_stops_the_run():
    system = free(PLANE, (VX**2 + (1 - X) * VY**2) / 2)
    with pytest.raises(SolverError, match=r"mass matrix at t = 1.* is not positive definite"):
        simulate(system, system.state([0.0, 0.0], [1.0, 0.0]), 5.0, 1e-2)


def test_a_speed_that_becomes_infinite_stops_the_run():
    """A mass that vanishes at 1, where it would arrive after 2/3 s."""
    system = free(LINE, (1 - S) * VS**2 / 2)
    with pytest.raises(SolverError, match=r"(velocities after|mass matrix at) t = 0\.6") as stop:
        simulate(system, system.state([0.0], [1.0]), 5.0, 1e-2)
    assert 0.9 < stop.value.state.q[0] < 1


@given(st.floats(0.01, 30), st.floats(0.001, 3), st.floats(-5, 5))
def test_the_end_is_reached_whatever_the_step(dt, duration, begin):
    system = free(LINE, VS**2 / 2)
    state = system.state([0], [1], time=begin)
    path = simulate(system, state, begin + duration, dt)
    length = path.times[-1] - begin
    assert path.times[-1] == pytest.approx(begin + duration, abs=1e-12)
    assert path.dt <= dt * (1 + 1e-12)
    assert path.q[-1, 0, 0] == pytest.approx(length, rel=1e-12)


def test_the_work_of_an_applied_force_on_a_sleeper_is_booked():
    """A block that a belt carries against a force sleeps, and is examined now and then."""
    from polycorner.motion import Friction, Interval

    belt = Friction("belt", [VS - 2], Interval(0.5), load=[10.0])
    system = System(
        Polyhedron(LINE, {"far": FAR - S}),
        VS**2 / 2,
        forces={"x": -3},
        friction=[belt],
        substrate={"x": 2.0},
    )
    path = simulate(system, system.state([0.0]), 1.0, 1e-3)
    assert path.rests[-1].all()
    assert path.work["applied"][-1] == pytest.approx(-3 * 2.0, rel=0.01)
    assert path.work["substrate"][-1] == pytest.approx(3 * 2.0, rel=0.01)
    assert path.audit < 1e-9
