"""Thresholds of friction that are drawn anew at every stop: their distribution, and resumption."""

import math
from dataclasses import replace

import numpy as np
import pytest

from polycorner import Manifold, Polyhedron, System, velocities
from polycorner.motion import Checkpoint, EventKind, Friction, Interval, Noise, simulate

LINE = Manifold.euclidean("x")
(S,), (VS,) = LINE.symbols, velocities(LINE)
MU, LOAD, SPEED, WIDTH, WORD = 0.5, 10.0, 0.1, 0.2, 2**64
SIGMA = math.sqrt(math.log(1 + WIDTH**2))


def belt(dynamic=0.5, count=1, kind="sliding"):
    """Blocks of the mass 1 held by springs of the stiffness 100 on a belt that moves."""
    shapes = Interval(MU), Interval(dynamic * MU)
    rubs = Friction("belt", [VS - SPEED], shapes[0], [LOAD], shapes[1], kind)
    room = Polyhedron(LINE, {"far": 1e3 - S})
    spring = 50 * S**2
    return System(room, VS**2 / 2, spring, friction=[rubs], count=count, substrate={"x": SPEED})


def mixed(x):
    """The finaliser of SplitMix64 ([Steele]), in whole numbers of Python."""
    x = (x + 0x9E3779B97F4A7C15) % WORD
    x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9 % WORD
    x = (x ^ (x >> 27)) * 0x94D049BB133111EB % WORD
    return x ^ (x >> 31)


def factor(seed, stop, body):
    """The lognormal factor of a stop, by Box and Muller; that of the start has the number 0."""
    key = mixed(seed ^ mixed((-1 - stop) % WORD ^ mixed(body * 64)))
    u, w = (((bits >> 11) + 0.5) / 2**53 for bits in (key, mixed(key)))
    drawn = math.sqrt(-2 * math.log(u)) * math.cos(2 * math.pi * w)
    return math.exp(SIGMA * drawn - SIGMA**2 / 2)


def held(path):
    """What each block bore, over ``MU LOAD``, when it began to slip: body, stop, factor."""
    last, found = dict.fromkeys(range(path.q.shape[1]), 0), []
    for event in path.events:
        (body,) = event.bodies
        if event.kind == EventKind.MOTION:
            x = np.interp(event.time, path.times, path.q[:, body, 0])
            found.append((body, last[body], 100 * x / (MU * LOAD)))
        elif event.kind == EventKind.REST and event.time > 1.5 * path.dt:  # not from the start
            last[body] = round(event.time / path.dt)
    return found


@pytest.fixture(scope="module")
def slips():
    many = belt(count=30)
    noise = Noise(scatter={"sliding": WIDTH}, seed=3)
    dt = 1e-3
    path = simulate(many, many.state(np.zeros((30, 1))), 12.0, dt, noise=noise, every=5)
    return path, held(path)


def test_blocks_slip_at_thresholds_of_their_stops(slips):
    """To within what the belt moves in the time between two records."""
    _, found = slips
    slack = 2 * 100 * SPEED * 5e-3 / (MU * LOAD)
    assert len(found) > 200
    first = [(body, bore) for body, stop, bore in found if stop == 0]
    assert len(first) == 30
    for body, bore in first:
        assert bore == pytest.approx(factor(3, 0, body), abs=slack)
    later = [(body, stop, bore) for body, stop, bore in found if stop > 0]
    for body, stop, bore in later:
        assert bore == pytest.approx(factor(3, stop, body), abs=slack)


def test_thresholds_have_the_stated_distribution(slips):
    """Logarithms are normal; moments to within four standard errors; stops are independent."""
    _, found = slips
    logs = np.log([bore for _, _, bore in found])
    n = len(logs)
    assert logs.mean() == pytest.approx(-(SIGMA**2) / 2, abs=4 * SIGMA / math.sqrt(n))
    assert logs.std() == pytest.approx(SIGMA, rel=4 / math.sqrt(2 * n))
    bodies = np.array([body for body, _, _ in found])
    each = [logs[bodies == body] for body in range(30)]
    pairs = np.concatenate([np.stack([x[:-1], x[1:]]) for x in each], axis=1)
    assert abs(np.corrcoef(pairs)[0, 1]) < 4 / math.sqrt(n)


def test_energy_is_balanced(slips):
    path, _ = slips
    assert path.audit < 1e-5


def test_a_threshold_is_at_least_that_of_slip():
    """With a dynamic set of 0.9 of the static one no block slips below it."""
    many = belt(dynamic=0.9, count=20)
    noise = Noise(scatter={"sliding": 0.5}, seed=1)
    path = simulate(many, many.state(np.zeros((20, 1))), 2.0, 1e-3, noise=noise, every=5)
    first = [bore for _, stop, bore in held(path) if stop == 0]
    assert len(first) == 20
    assert min(first) == pytest.approx(0.9, abs=0.02)
    assert max(first) > 1.2


def test_without_scatter_thresholds_are_the_same():
    many = belt(count=5)
    start = many.state(np.zeros((5, 1)))
    plain = simulate(many, start, 2.0, 1e-3)
    none = simulate(many, start, 2.0, 1e-3, noise=Noise(scatter={"sliding": 0.0}, seed=9))
    assert (plain.q == none.q).all()


def test_runs_go_on_and_resume_bit_for_bit(tmp_path):
    many = belt(count=3)
    start, noise = many.state(np.zeros((3, 1))), Noise(scatter={"sliding": WIDTH}, seed=5)
    whole = simulate(many, start, 4.0, 1e-3, noise=noise, every=50)
    half = simulate(many, start, 2.0, 1e-3, noise=noise, every=50)
    rest = simulate(half.system, half.last, 4.0, 1e-3, noise=noise, every=50)
    assert (rest.q[-1] == whole.q[-1]).all()
    stopped = Checkpoint(tmp_path / "run", seconds=0.0)

    def stop(done, _total, _unit):
        if done > 1.5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        simulate(many, start, 4.0, 1e-3, noise=noise, every=50, checkpoint=stopped, progress=stop)
    resumed = simulate(many, start, 4.0, 1e-3, noise=noise, every=50, checkpoint=stopped)
    assert (resumed.q == whole.q).all()
    other = replace(noise, scatter={"sliding": 0.3})
    with pytest.raises(ValueError, match=r"noise\.scatter sliding"):
        simulate(
            many,
            start,
            4.0,
            1e-3,
            noise=other,
            every=50,
            checkpoint=Checkpoint(tmp_path / "run"),
        )


@pytest.mark.parametrize(
    ("scatter", "error", "told"),
    [
        ({"sliding": -0.1}, ValueError, "scatter: expected"),
        (0.3, TypeError, "scatter: expected a mapping"),
        ({"sliding": math.nan}, ValueError, "scatter: expected"),
    ],
)
def test_a_scatter_that_is_none_is_refused(scatter, error, told):
    with pytest.raises(error, match=told):
        Noise(scatter=scatter)


def test_kinds_of_friction_that_have_no_known_load_are_refused():
    block = belt()
    with pytest.raises(ValueError, match="scatter: expected names among sliding; got rolling"):
        simulate(block, block.state([0.0]), 1.0, 1e-3, noise=Noise(scatter={"rolling": 0.1}))
