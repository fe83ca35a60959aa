"""Imperfect drums against two balls in space, a reference step, and shorter steps."""

import json
import math
import pickle
from dataclasses import replace
from itertools import pairwise

import imperfect_drums as oracle
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from polycorner.dumbbells import DumbbellDrum, OutOfRound, Shaking, UnevenFriction, Wobble
from polycorner.dumbbells.imperfections import KINDS
from polycorner.motion import Checkpoint, Noise, simulate
from polycorner.motion.engine.driver import Engine
from polycorner.motion.formulation import moment

SHAKEN = DumbbellDrum(shaking=Shaking((300.0, 200.0, 400.0), (2.0, 15.0), seed=3))
OVAL = DumbbellDrum(out_of_round=OutOfRound({1: 0.8, 2: 0.5, 5: 0.05}, {2: 1.0, 5: -0.4}))
WOBBLING = DumbbellDrum(wobble=Wobble(0.02, 0.7), spin=0.05)
UNEVEN = DumbbellDrum(uneven_friction=UnevenFriction(0.4, 7.0, seed=2))
ALL = DumbbellDrum(
    shaking=SHAKEN.shaking,
    out_of_round=OVAL.out_of_round,
    wobble=WOBBLING.wobble,
    uneven_friction=UNEVEN.uneven_friction,
    spin=0.03,
)
DRUMS = {"shaken": SHAKEN, "oval": OVAL, "wobbling": WOBBLING, "uneven": UNEVEN, "all": ALL}
each = pytest.mark.parametrize("drum", DRUMS.values(), ids=DRUMS)
places = st.tuples(
    st.floats(-1.2, 1.2), st.floats(-50, 50), st.floats(-3, 3), st.floats(0, 500)
)  # azimuth, axial position, heading, time


def at_time(drum, t):
    """The parameters of a dumbbell's equations at a time, as the engine sets them."""
    body = drum.bodies.body
    (now,) = body.signals.kernel.at(np.array([t]), body.signal_parameters.ctypes.data, 0)
    return np.array([*body.parameters[: -1 - len(now)], t, *now])


def evaluated(drum, q, t):
    formulation = drum.bodies.body.formulation
    return moment(formulation, at_time(drum, t), np.array([*q, 0.0]), np.zeros(4))


# ------------------------------------------------------------------------------- forces and loads


@each
@given(places)
def test_forces_are_differences_of_the_energy_of_two_balls_in_space(drum, place):
    *q, t = place
    weight = drum.ball_mass * oracle.GRAVITY
    expected = oracle.force(drum, q, t)
    found = evaluated(drum, q, t).force
    assert found == pytest.approx(expected, abs=1e-7 * weight * drum.centre_radius)


@pytest.mark.parametrize("drum", [SHAKEN, WOBBLING, UNEVEN])
@given(places)
def test_loads_are_effective_gravity_along_the_normal_of_the_wall(drum, place):
    *q, t = place
    expected = oracle.loads(drum, q, t)
    weight = drum.ball_mass * oracle.GRAVITY
    assert evaluated(drum, q, t).loads == pytest.approx(expected, abs=1e-7 * weight)


@given(places)
def test_loads_on_a_wall_out_of_round_are_of_first_order_in_its_amplitude(place):
    *q, t = place
    weight, errors = OVAL.ball_mass * oracle.GRAVITY, []
    for share in (1.0, 0.25):
        wall = {k: share * a for k, a in OVAL.out_of_round.amplitudes.items()}
        drum = replace(OVAL, out_of_round=OutOfRound(wall, OVAL.out_of_round.phases))
        difference = evaluated(drum, q, t).loads - oracle.loads(drum, q, t)
        errors.append(np.abs(difference).max())
    slope = OVAL.out_of_round.steepest / OVAL.centre_radius
    assert errors[0] < slope**2 * weight
    assert errors[1] < slope**2 * weight / 16 + 1e-7 * weight


def test_no_load_is_negative_and_a_drum_that_falls_has_none():
    falling = DumbbellDrum(shaking=Shaking((0.0, 0.0, 2e4), (1.0, 2.0)))
    rising = [oracle.acceleration(falling, t)[2] for t in np.arange(0, 5, 0.01)]
    t = 0.01 * int(np.argmin(rising))
    assert min(rising) < -oracle.GRAVITY
    assert evaluated(falling, [0.1, 0.0, 0.2], t).loads.tolist() == [0.0, 0.0]
    rough = replace(UNEVEN, uneven_friction=UnevenFriction(3.0, 7.0))
    found = [evaluated(rough, [phi, 0.0, 0.3], 0.0).loads for phi in np.linspace(-1, 1, 200)]
    assert np.min(found) == 0.0
    assert np.mean(found) > 0.0


def test_imperfections_of_no_size_leave_forces_and_loads_as_they_are():
    none = DumbbellDrum(
        shaking=Shaking((0.0, 0.0, 0.0), (1.0, 2.0)),
        out_of_round=OutOfRound({2: 0.0}),
        wobble=Wobble(0.0),
        uneven_friction=UnevenFriction(0.0, 5.0),
    )
    perfect, q = DumbbellDrum(), [0.2, 3.0, 0.4]
    body, at = perfect.bodies.body, np.array([*q, 0.0])
    expected = moment(body.formulation, body.parameters, at, np.zeros(4))
    found = evaluated(none, q, 7.0)
    assert found.force == pytest.approx(expected.force, rel=1e-12)
    assert found.loads == pytest.approx(expected.loads, rel=1e-12)


def test_the_wall_and_its_friction_turn_with_the_drum():
    for drum in (OVAL, UNEVEN):
        for t in (0.0, 3.0, 40.0):
            turned = [0.05 + drum.spin * t, 2.0, 0.3]
            found = oracle.loads(drum, turned, t) / oracle.loads(DumbbellDrum(), turned, t)
            first = oracle.loads(drum, [0.05, 2.0, 0.3], 0.0)
            alone = first / oracle.loads(DumbbellDrum(), [0.05, 2.0, 0.3], 0.0)
            assert found == pytest.approx(alone, rel=2e-2 if drum is OVAL else 1e-9)
            around = [turned[0] - 2 * math.pi, *turned[1:]]
            assert evaluated(drum, around, t).loads == pytest.approx(
                evaluated(drum, turned, t).loads
            )


def test_shaking_has_the_strengths_and_the_band_stated():
    times = np.arange(0, 300, 0.02)
    values = np.array([oracle.acceleration(SHAKEN, t) for t in times])
    assert np.sqrt((values**2).mean(axis=0)) == pytest.approx(SHAKEN.shaking.rms, rel=0.01)
    assert np.corrcoef(values.T) == pytest.approx(np.eye(3), abs=0.02)
    power = np.abs(np.fft.rfft(values * np.hanning(len(times))[:, None], axis=0)) ** 2
    frequency = np.fft.rfftfreq(len(times), 0.02)
    inside = (frequency > 1.99) & (frequency < 15.01)
    assert power[~inside].sum() < 1e-4 * power.sum()


def test_one_seed_makes_different_numbers_for_different_uses():
    one = Shaking((1.0, 1.0, 1.0), (1.0, 2.0), seed=5).numbers
    axes = np.reshape(one, (3, -1))[:, 1:]
    assert len({tuple(axis) for axis in axes}) == 3
    assert one != Shaking((1.0, 1.0, 1.0), (1.0, 2.0), seed=6).numbers


def test_the_mirror_image_of_a_wall_in_a_drum_that_turns_the_other_way():
    """``phi, theta, psi, omega`` and the phases change sign."""
    drum = replace(OVAL, wobble=Wobble(0.01, 0.3), tilt=0.1)
    phases = {k: -p for k, p in drum.out_of_round.phases.items()}
    wall = OutOfRound(drum.out_of_round.amplitudes, phases)
    image = replace(drum, spin=-drum.spin, out_of_round=wall, wobble=Wobble(0.01, -0.3))
    q = np.array([[0.12, 1.0, 0.2]])
    first = simulate(drum, drum.state(q), 8.0, 1e-3).q
    second = simulate(image, image.state(q * [-1, 1, -1]), 8.0, 1e-3).q
    assert first[-1, 0, 1] != first[0, 0, 1]
    assert second * [-1, 1, -1, -1] == pytest.approx(first, abs=1e-5)


# ----------------------------------------------------------------------------------------- motion


@each
def test_a_stretch_of_motion_is_that_of_the_reference_step(drum):
    """From a dumbbell that rolls back, past its stop in some of the drums."""
    dt, steps = 2e-3, 40
    start = drum.state([[0.17, 2.0, 0.25]], [[drum.spin - 0.2, 2.0, 0.0, 8.0]])
    path = simulate(drum, start, steps * dt, dt, every=1)
    sticks = start.sticking[0].tolist()
    expected = oracle.reference_motion(drum, start.q[0], start.v[0], sticks, dt, steps)
    assert np.ptp(expected[:, 0]) > 5e-3
    assert path.q[1:, 0] * [125, 1, 8, 3] == pytest.approx(expected * [125, 1, 8, 3], abs=1e-6)


@each
def test_results_converge_as_the_step_is_shortened(drum):
    """Onset and end of slip are of first order: differences fall with the step, by halves."""
    ends = []
    for dt in 4e-3 / 4.0 ** np.arange(4):
        path = simulate(drum, drum.state([[0.11, 0.0, 0.2]]), 8.0, dt)
        assert path.converged
        ends.append(path.q[-1, 0] * [125, 1, 8, 3])
    assert abs(ends[-1][3]) > 1.0  # it has rolled
    found = [np.abs(one - other).max() for one, other in pairwise(ends)]
    assert found[2] < found[0] / 4
    assert found[2] < 0.05


@each
def test_energy_is_accounted_for(drum):
    """Work on a dumbbell at rest is booked by the trapezoidal rule between examinations."""
    path = simulate(drum, drum.state([[0.11, 0.0, 0.2]]), 8.0, 5e-4)
    assert path.audit < 1e-4
    if drum is not UNEVEN:
        assert abs(path.work["applied"][-1]) > 0.1


def test_a_sleeper_wakes_when_the_drum_is_shaken_more_than_friction_holds():
    """Signals pass within a step: sleepers are examined in each of them."""
    mild = replace(SHAKEN, spin=0.0, shaking=Shaking((50.0, 0.0, 0.0), (1.0, 4.0)))
    rest = simulate(mild, mild.state([[0.0, 0.0, 0.0]]), 6.0, 2e-3)
    assert (rest.q == rest.q[0]).all()
    hard = replace(mild, shaking=Shaking((1500.0, 0.0, 0.0), (1.0, 4.0)))
    path = simulate(hard, hard.state([[0.0, 0.0, 0.0]]), 6.0, 2e-3, every=1)
    times = np.arange(3000) * 2e-3 + 1e-3
    pull = [oracle.force(hard, [0.0, 0.0, 0.0], t)[0] / hard.centre_radius for t in times]
    held = [hard.rolling[0] * oracle.loads(hard, [0.0, 0.0, 0.0], t).sum() for t in times]
    first = int(np.argmax(np.abs(pull) > held))
    moved = int(np.argmax(path.v[:, 0, 0] != 0.0))
    assert moved == first + 1


@pytest.mark.parametrize("drum", [OVAL, WOBBLING, UNEVEN])
def test_sleepers_under_slow_signals_wake_as_if_examined_in_every_step(drum):
    bodies = replace(drum, count=2).bodies
    always = replace(bodies, body=replace(bodies.body, slow_signals=False))
    q = np.array([[0.05, 0.0, 0.1, 0.0], [0.08, 90.0, -0.2, 0.0]])
    v, sticks, ends = np.tile([drum.spin, 0, 0, 0], (2, 1)), np.ones((2, 3), dtype=bool), []
    for given_bodies in (bodies, always):
        engine = Engine(given_bodies, q, v, sticks, 1e-3, noise=Noise())
        events = engine.advance(15_000)
        ends.append((engine.motion.q, [(e.kind, e.bodies, e.time) for e in events]))
    assert len(ends[0][1]) > 4
    assert ends[0][1] == ends[1][1]
    assert ends[0][0] == pytest.approx(ends[1][0], abs=1e-9)


@each
def test_a_heap_in_an_imperfect_drum_moves_on(drum):
    two = replace(drum, count=2)
    q = np.array([[0.0, 0.0, 0.1], [0.06, 1.0, 0.1]])
    path = simulate(two, two.state(q), 3.0, 2e-3, noise=Noise(chatter=0.2, seed=1))
    assert path.converged
    assert path.audit < 1e-3


# ------------------------------------------------------------------------------ values and limits


@each
def test_imperfections_are_described_and_restored(drum):
    for name, told in drum.imperfections.described().items():
        read = KINDS[name].restored(json.loads(json.dumps(told)))
        assert read == getattr(drum, name)
        assert hash(read) == hash(getattr(drum, name))
    assert pickle.loads(pickle.dumps(drum)) == drum
    assert json.loads(json.dumps(drum.described(), default=str))


def test_a_saved_run_with_another_imperfection_is_refused(tmp_path):
    def run(drum):
        saving = Checkpoint(tmp_path)
        return simulate(drum, drum.state([[0.1, 0.0, 0.2]]), 0.2, 2e-3, checkpoint=saving)

    first = run(ALL)
    assert (run(ALL).q == first.q).all()
    other = replace(ALL, shaking=replace(ALL.shaking, seed=9))
    with pytest.raises(ValueError, match="expected shaking ="):
        run(other)


def test_a_step_resolves_the_shortest_period_of_shaking():
    fast = replace(SHAKEN, shaking=Shaking((1.0, 1.0, 1.0), (10.0, 80.0)))
    with pytest.raises(
        ValueError, match=r"dt: expected at most 0.00125 s, a tenth of the shortest"
    ):
        simulate(fast, fast.state([[0.0, 0.0, 0.1]]), 1.0, 2e-3)
    state, still = (drum.state([[0.0, 0.0, 0.1]]) for drum in (SHAKEN, DumbbellDrum()))
    assert SHAKEN.largest_step(state)[0] < DumbbellDrum().largest_step(still)[0]


def test_numbers_alone_compile_nothing_anew():
    for drum, other in (
        (SHAKEN, DumbbellDrum(shaking=Shaking((1.0, 0.0, 2.0), (5.0, 9.0), seed=8))),
        (OVAL, DumbbellDrum(out_of_round=OutOfRound({2: 0.1, 3: 0.2, 4: 0.3}))),
        (UNEVEN, DumbbellDrum(uneven_friction=UnevenFriction(0.1, 3.0, seed=8))),
    ):
        assert other.bodies.body.formulation is drum.bodies.body.formulation
        assert other.bodies.body.signals is drum.bodies.body.signals


@pytest.mark.parametrize(
    ("call", "kind", "named"),
    [
        (lambda: Shaking((1.0, 2.0), (1.0, 2.0)), TypeError, "rms"),
        (lambda: Shaking((1.0, 2.0, -1.0), (1.0, 2.0)), ValueError, "rms"),
        (lambda: Shaking((1.0, 2.0, 1.0), (2.0, 2.0)), ValueError, "band"),
        (lambda: OutOfRound({}), ValueError, "amplitudes"),
        (lambda: OutOfRound({0: 1.0}), ValueError, "amplitudes"),
        (lambda: OutOfRound({1: 1.0}, {2: 0.0}), ValueError, "phases"),
        (lambda: OutOfRound(1.0), TypeError, "amplitudes"),
        (lambda: Wobble(-0.1), ValueError, "angle"),
        (lambda: UnevenFriction(-0.1, 1.0), ValueError, "rms"),
        (lambda: UnevenFriction(0.1, 0.0), ValueError, "correlation_length"),
        (lambda: DumbbellDrum(shaking=0.1), TypeError, "shaking"),
        (lambda: DumbbellDrum(wobble=Wobble(1.5)), ValueError, "wobble"),
        (lambda: DumbbellDrum(out_of_round=OutOfRound({20: 5.0})), ValueError, "out_of_round"),
    ],
)
def test_wrong_arguments_are_named(call, kind, named):
    with pytest.raises(kind, match=f"^{named}: expected"):
        call()
