"""Runs that go on from the last state of another: bit for bit as one run, or anew."""

import pickle
from dataclasses import replace

import numpy as np
import pytest
from discs import DISCS, START

from polycorner.bodies import Arrangement, HalfSpace, Hinge, Prescribed, capsule, disc
from polycorner.motion import Checkpoint, Noise, simulate, time_symbol
from polycorner.spaces.manifold import Array

NOISE = Noise(kicks={"x": 0.3}, seed=5)
BOX = {
    "floor": HalfSpace([0, 1], [0, 0]),
    "left": HalfSpace([1, 0], [0, 0]),
    "right": HalfSpace([-1, 0], [7, 0]),
}


def discs():
    return DISCS, DISCS.state(START), {"noise": NOISE}


def kinds():
    names = {"large": disc(1.0), "small": disc(0.6)}
    laws = {"gravity": [0, -10], "friction": 0.4, "restitution": 0.3}
    a = Arrangement(names, BOX, orientations="all").system(count={"large": 2, "small": 3}, **laws)
    large = [[1.2, 1.1, 0.0], [3.5, 1.1, 0.3]]
    small = [[1.0 + 1.5 * k, 3.0 + 0.7 * k, 0.0] for k in range(3)]
    return a, a.state({"large": large, "small": small}), {}


def chain():
    """Bars that hang from each other; the upper ones turn as the time says, the last one rubs."""
    joints = {
        "nail": Hinge("world", "bar 1", at=[0, 2]),
        "pin": Hinge("bar 1", "bar 2", at=[0.5, 0], on=[-0.5, 0]),
        "low": Hinge("bar 2", "bar 3", at=[0.5, 0], on=[-0.5, 0], limits=(-0.4, 0.4)),
    }
    bars = Arrangement({"bar": capsule([-0.5, 0], [0.5, 0], 0.05)}, orientations="all")
    laws = {"drives": {"turned": Prescribed("pin", time_symbol() ** 2)}, "friction": {"low": 0.1}}
    system = bars.system(count=3, joints=joints, gravity=[0, -10], **laws)
    return system, system.state([[0, 2, 0], [1, 2, 0], [2, 2, 0]]), {}


def same(one, other, first, before):
    """Assert that a run is the rest of another from a record on, to the last bit.

    Events are told with those of the runs ``before`` it: instants of contacts are extrapolated, so
    that some of the last step of a run are a little later than its end.
    """
    for name in ("times", "q", "v", "rests", "present", "kinetic", "potential"):
        part: Array = getattr(other, name)[first:]
        np.testing.assert_array_equal(getattr(one, name), part, err_msg=name)
    assert one.touching == other.touching[first:]
    every = [event for path in (*before, one) for event in path.events]
    assert sorted(every, key=lambda e: e.time) == [*other.events]


@pytest.mark.parametrize("made", [discs, kinds, chain])
def test_a_run_goes_on_bit_for_bit(made, tmp_path):
    system, state, more = made()
    more |= {"every": 20}
    whole = simulate(system, state, 1.4, 1e-3, **more)
    begun = simulate(system, state, 0.6, 1e-3, **more)
    assert begun.last.time == begun.times[-1]
    middle = simulate(system, begun.last, 1.0, 1e-3, **more)
    again, last = pickle.loads(pickle.dumps((system, middle.last)))  # of another process
    rest = simulate(again, last, 1.4, 1e-3, **more)
    same(middle, simulate(system, state, 1.0, 1e-3, **more), 30, [begun])
    same(rest, whole, 50, [begun, middle])
    assert rest.effort.steps == 400
    assert rest.finished
    # Accounts are those of the run, and close in it.
    for table, known in ((rest.work, whole.work), (rest.dissipated, whole.dissipated)):
        for name, done in table.items():
            assert done[0] == 0
            # Impulses that cancel leave rounding errors of their own size.
            assert done == pytest.approx(known[name][50:] - known[name][50], abs=1e-8)
    folder = Checkpoint(tmp_path / "run", seconds=0.0)
    saved = simulate(system, begun.last, 1.0, 1e-3, **more, checkpoint=folder)
    for kept in (saved, simulate(system, begun.last, 1.0, 1e-3, **more, checkpoint=folder)):
        np.testing.assert_array_equal(kept.q, middle.q)
        np.testing.assert_array_equal(kept.times, middle.times)


def test_what_is_no_continuation_begins_anew():
    """With another step, another system or a changed state, as from one without a memory."""
    system, state, _ = discs()
    last = simulate(system, state, 0.6, 1e-3, noise=NOISE, every=20).last
    plain = replace(last, memory=None)
    moved = last.q + np.array([0.0, 1e-3])
    for other, one, dt in (
        (system, last, 5e-4),
        (replace(system, restitution=0.1), last, 1e-3),
        (system, replace(last, q=moved), 1e-3),
    ):
        found = simulate(other, one, 0.7, dt, noise=NOISE, every=20)
        anew = simulate(other, replace(plain, q=one.q), 0.7, dt, noise=NOISE, every=20)
        np.testing.assert_array_equal(found.q, anew.q)
