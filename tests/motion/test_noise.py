"""Random forces that are held, against direct summation; their limits, work and sleepers."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from polycorner import Manifold, Polyhedron, System, velocities
from polycorner.motion import Checkpoint, EventKind, Friction, Interval, Noise, simulate

PLANE, LINE = Manifold.euclidean("x y"), Manifold.euclidean("x")
(X, Y), (VX, VY) = PLANE.symbols, velocities(PLANE)
(S,), (VS,) = LINE.symbols, velocities(LINE)
MASS, G, FAR = 2.0, 9.81, 1e6
POINT = System(Polyhedron(PLANE, {"far": FAR - X}), MASS * (VX**2 + VY**2) / 2)
BALL = System(Polyhedron(PLANE, {"floor": Y}), (VX**2 + VY**2) / 2, G * Y, restitution=0.8)
NOISE = Noise(kicks={"x": 0.7, "y": 0.2}, kick_time=0.013, seed=5)
WORD = 2**64


def mixed(x):
    """The finaliser of SplitMix64 ([Steele]), in whole numbers of Python."""
    x = (x + 0x9E3779B97F4A7C15) % WORD
    x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9 % WORD
    x = (x ^ (x >> 27)) * 0x94D049BB133111EB % WORD
    return x ^ (x >> 31)


def drawn(seed, n, body, coordinate):
    """The standard normal number of an interval, a body and a coordinate, by Box and Muller."""
    key = mixed(seed ^ mixed(n ^ mixed(body * 64 + 32 + coordinate)))
    u, w = (((bits >> 11) + 0.5) / 2**53 for bits in (key, mixed(key)))
    return math.sqrt(-2 * math.log(u)) * math.cos(2 * math.pi * w)


def impulse(noise, name, t, body=0):
    """Impulse of the held force from 0 to ``t``, interval by interval."""
    tau, coordinate = noise.kick_time, "xy".index(name)
    shares = [(n, min(t - n * tau, tau)) for n in range(math.ceil(t / tau))]
    total = sum(share * drawn(noise.seed, n, body, coordinate) for n, share in shares)
    return noise.kicks[name] / math.sqrt(tau) * total


@pytest.mark.parametrize("dt", [1e-3, 2.7e-3, 0.013, 0.05])
def test_impulses_are_integrals_of_the_held_force(dt):
    """Whether steps are shorter or longer than a force is held, or fit into it, or not."""
    path = simulate(POINT, POINT.state([0, 0]), 20 * dt, dt, noise=NOISE, every=1)
    for c, name in enumerate("xy"):
        expected = [impulse(NOISE, name, t) / MASS for t in path.times]
        assert path.v[:, 0, c] == pytest.approx(expected, abs=1e-12)
    assert path.audit < 1e-12
    assert path.work["noise"][-1] == pytest.approx(path.kinetic[-1])


def test_bodies_have_forces_of_their_own():
    three = replace(POINT, count=3)
    path = simulate(three, three.state(np.arange(6.0).reshape(3, 2)), 0.1, 1e-3, noise=NOISE)
    expected = [impulse(NOISE, "y", 0.1, body) / MASS for body in range(3)]
    assert path.v[-1, :, 1] == pytest.approx(expected, abs=1e-12)


def test_parts_of_steps_have_their_parts_of_the_impulse():
    """The ball bounces, in parts of steps; what acts on ``x`` is the same as without a floor."""
    path = simulate(BALL, BALL.state([0, 0.3]), 1.5, 0.004, noise=NOISE, every=1)
    assert path.effort.parts > 4
    expected = [impulse(NOISE, "x", t) for t in path.times]
    assert path.v[:, 0, 0] == pytest.approx(expected, abs=1e-12)
    assert path.audit < 1e-12


def test_forces_that_are_held_for_a_step_are_white_noise_of_that_step():
    for held, dt in ((0.01, 0.01), (0.0, 0.01)):
        noise = replace(NOISE, kick_time=held)
        last = simulate(POINT, POINT.state([0, 0]), 1.0, dt, noise=noise).v[-1, 0]
        expected = [
            noise.kicks[name] * math.sqrt(dt) * sum(drawn(5, n, 0, c) for n in range(100)) / MASS
            for c, name in enumerate("xy")
        ]
        assert last == pytest.approx(expected, abs=1e-12)


def test_velocities_diffuse_as_under_white_noise():
    """``<dv^2> = (sigma / m)^2 t``; of 4000 bodies the mean square is known to 2.2 per cent."""
    many = System(Polyhedron(LINE, {"far": FAR - S}), MASS * VS**2 / 2, count=4000)
    noise = Noise(kicks={"x": 3.0}, kick_time=1e-3, seed=1)
    start = many.state(np.zeros((4000, 1)))
    path = simulate(many, start, 0.5, 0.01, noise=noise)
    assert (path.v[-1] ** 2).mean() == pytest.approx((3.0 / MASS) ** 2 * 0.5, rel=0.07)


def differences(system, state, t_end, steps, noise):
    """Changes of the end of a motion from one step to the next."""
    ends = [simulate(system, state, t_end, dt, noise=noise).q[-1].ravel() for dt in steps]
    return [float(np.abs(one - other).max()) for one, other in itertools.pairwise(ends)]


def test_an_oscillator_under_held_forces_is_of_second_order():
    """White kicks have another path in every step: there is nothing to converge to."""
    spring = System(Polyhedron(LINE, {"far": FAR - S}), VS**2 / 2, 18 * S**2 + S**4)
    steps = 0.013 / 2.0 ** np.arange(2, 6)
    held = Noise(kicks={"x": 3.0}, kick_time=0.013, seed=2)
    found = differences(spring, spring.state([0.1]), 1.3, steps, held)
    orders = np.log2(np.array(found[:-1]) / found[1:])
    assert orders == pytest.approx(2.0, abs=0.2)
    white = differences(spring, spring.state([0.1]), 1.3, steps, replace(held, kick_time=0.0))
    assert min(white) > 100 * max(found)


def test_a_block_that_slips_now_and_then_converges():
    """Onset and end of slip are of first order in the step, which does not divide the time held."""
    table = Friction("table", [VS], Interval(0.3), load=[G], dynamic=Interval(0.2))
    block = System(Polyhedron(LINE, {"far": FAR - S}), VS**2 / 2, 0, friction=[table])
    noise = Noise(kicks={"x": 0.9}, kick_time=0.07, seed=3)
    path = simulate(block, block.state([0.0]), 6.0, 1e-3, noise=noise)
    assert len(path.of_kind(EventKind.REST)) > 3
    steps = 8e-3 / 4.0 ** np.arange(4)
    found = differences(block, block.state([0.0]), 6.0, steps, noise)
    assert found[-1] < found[0] / 8
    assert found[-1] < 3e-3 * abs(path.q[-1, 0, 0])


def test_a_sleeper_wakes_in_the_step_in_which_a_force_exceeds_its_friction():
    """It sleeps as long as ``|sigma xi_n| / sqrt(tau) <= mu N``, and its place does not change."""
    table = Friction("table", [VS], Interval(0.5), load=[G])
    block = System(Polyhedron(LINE, {"far": FAR - S}), VS**2 / 2, 0, friction=[table])
    sigma, tau = 0.41, 0.04
    for seed in range(4):
        noise = Noise(kicks={"x": sigma}, kick_time=tau, seed=seed)
        forces = (sigma / math.sqrt(tau) * drawn(seed, n, 0, 0) for n in itertools.count())
        first = next(n for n, force in enumerate(forces) if abs(force) > 0.5 * G)
        assert first > 2
        end = (first + 2) * tau
        path = simulate(block, block.state([1.0]), end, 1e-3, noise=noise, every=1)
        wakes = next(e.time for e in path.events if e.kind == EventKind.MOTION)
        assert wakes == pytest.approx(first * tau, abs=1e-9)
        assert (path.q[path.times < wakes - 1e-9] == 1.0).all()
        assert path.q[-1, 0, 0] != 1.0


def test_a_run_that_resumes_meets_the_same_forces(tmp_path):
    def bounce(**options):
        return simulate(BALL, BALL.state([0, 0.3]), 1.0, 0.003, every=5, **options)

    def stop(done, total, _):
        if done > total / 2:
            raise KeyboardInterrupt

    saving = Checkpoint(tmp_path, seconds=0.0)
    with pytest.raises(KeyboardInterrupt):
        bounce(noise=NOISE, progress=stop, checkpoint=saving)
    again = bounce(noise=NOISE, checkpoint=saving)
    assert (again.q == bounce(noise=NOISE).q).all()
    with pytest.raises(ValueError, match=r"noise.kick_time"):
        bounce(noise=replace(NOISE, kick_time=0.02), checkpoint=saving)


def test_forces_held_far_shorter_than_a_step_are_refused():
    noise = replace(NOISE, kick_time=1e-9)
    with pytest.raises(ValueError, match=r"^kick_time: expected a number >= 1e-07 in s"):
        simulate(POINT, POINT.state([0, 0]), 1.0, 1e-3, noise=noise)
    with pytest.raises(ValueError, match=r"^kick_time: expected a number >= 0 in s"):
        Noise(kick_time=-1.0)
