"""Runs in the drum: placements, dyads, what is told of a motion, and going on when killed."""

import itertools
import math
import signal
import subprocess
import sys
import time
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from oracles import gaps

from polycorner import atomic as writing
from polycorner.dumbbells.drum import DumbbellDrum
from polycorner.dumbbells.dynamics import checkpoints as drum_checkpoints
from polycorner.dumbbells.dynamics import pairs as drum_pairs
from polycorner.dumbbells.dynamics import starts as drum_starts
from polycorner.dumbbells.dynamics.files import dataset, load_run, save_run
from polycorner.dumbbells.dynamics.pairs import Sizes
from polycorner.dumbbells.dynamics.runs import Saving, run
from polycorner.dumbbells.formulas import CONTACTS
from polycorner.dumbbells.pair import DumbbellPair
from polycorner.motion.events import Event, EventKind
from polycorner.motion.noise import Noise

PAIR = DumbbellPair(16, 3, 1.5, 125)
SIZES = Sizes(16.0, 3.0, 122.0, 1.5)
HERD = DumbbellDrum(count=6, floor=True, top=90.0)
START = drum_starts.bunch(HERD, np.random.default_rng(2))
NOISE = Noise(chatter=0.3, seed=5)
LASTING = 1.5  # s; the bunch collapses, collides and settles in it


def followed(**changes):
    chosen = {"noise": NOISE, "every": 20} | changes
    return run(HERD, START, LASTING, **chosen)


@pytest.fixture(scope="module")
def whole():
    """Return the run that nobody stopped."""
    return followed()


def same(one, other):
    """Check that two runs agree bit for bit in all that is recorded."""
    left, right = one.trajectory, other.trajectory
    for name in ("times", "q", "v", "rests", "present", "kinetic", "potential"):
        np.testing.assert_array_equal(getattr(left, name), getattr(right, name), strict=True)
    for name in ("dissipated", "work"):
        assert list(getattr(left, name)) == list(getattr(right, name))
        for mine, theirs in zip(
            getattr(left, name).values(), getattr(right, name).values(), strict=True
        ):
            np.testing.assert_array_equal(mine, theirs, strict=True)
    assert left.touching == right.touching
    assert left.events == right.events
    assert left.effort == right.effort
    assert (left.dt, left.max_penetration) == (right.dt, right.max_penetration)


# --------------------------------------------------------------------------------------- placements


@pytest.mark.parametrize("chirality", ["R", "L"])
@pytest.mark.parametrize("heading", [None, -12.0, -3.0, 0.0, 7.0, 20.0])
def test_a_nested_pair_touches_at_three_contacts(chirality, heading):
    angle = None if heading is None else math.radians(heading)
    drum = DumbbellDrum(count=2)
    q = drum_starts.nested_pair(drum, chirality, heading=angle, eta=70.0)
    found = gaps(PAIR, q.reshape(6))
    assert np.sum(np.abs(found) < 1e-9) == 3
    assert found.min() > -1e-9
    assert drum.pair.chirality(q.reshape(6)) == chirality
    np.testing.assert_allclose(q[:, :2].mean(axis=0), [0.0, 70.0], atol=1e-12)
    if heading is not None:
        assert math.degrees(q[:, 2].mean()) == pytest.approx(heading, abs=1e-9)


def test_the_default_heading_is_that_of_least_energy():
    drum = DumbbellDrum(count=2)
    at_rest = drum_starts.nested_pair(drum, "R")

    def height(q):
        return PAIR.ball_centres(q.reshape(6))[:, 2].sum()

    heading = at_rest[:, 2].mean()
    for change in (-0.05, -0.01, 0.01, 0.05):
        turned = drum_starts.nested_pair(drum, "R", heading=heading + change)
        assert height(turned) > height(at_rest)


def test_the_two_hands_are_mirror_images():
    drum = DumbbellDrum(count=2)
    right = drum_starts.nested_pair(drum, "R", heading=0.1)
    left = drum_starts.nested_pair(drum, "L", heading=-0.1)
    np.testing.assert_allclose(left, right * [-1, 1, -1], atol=1e-9)


@pytest.mark.parametrize(("count", "seed"), [(1, 0), (5, 1), (40, 2)])
def test_a_bunch_lies_apart_above_the_bottom(count, seed):
    drum = DumbbellDrum(count=count, floor=True)
    q = drum_starts.bunch(drum, np.random.default_rng(seed))
    assert q.shape == (count, 3)
    pairs = np.array([[*one, *other] for one, other in itertools.combinations(q, 2)])
    assert gaps(PAIR, pairs.reshape(-1, 6)).min(initial=1.0) > 0
    assert (q[:, 1] - 8 * np.abs(np.cos(q[:, 2])) - 3).min() > 0
    np.testing.assert_array_equal(q, drum_starts.bunch(drum, np.random.default_rng(seed)))


def test_isolated_dumbbells_cannot_touch_and_the_steepest_is_highest():
    headings = [0.1, -0.2, 0.3]
    q = drum_starts.isolated(DumbbellDrum(count=3), headings, azimuth=0.05, eta=10.0)
    np.testing.assert_array_equal(q[:, 2], headings)
    assert np.argsort(q[:, 1]).tolist() == [1, 0, 2]
    assert np.diff(np.sort(q[:, 1])).min() > 16 + 2 * 3
    assert q[:, 1].min() == 10.0
    with pytest.raises(ValueError, match=r"^headings: expected 3 angles"):
        drum_starts.isolated(DumbbellDrum(count=3), [0.1])


# -------------------------------------------------------------------------------------------- dyads

PLACES = st.tuples(
    *[st.floats(-0.15, 0.15), st.floats(-20, 20), st.floats(-4, 4)] * 2,
).map(np.array)


def centres(q):
    return np.concatenate([SIZES.balls(q[:3]), SIZES.balls(q[3:])], axis=-2)


def line_distance(p, a, b):
    u = (b - a) / math.dist(a, b)
    return abs(u[0] * (p - a)[1] - u[1] * (p - a)[0])


@given(PLACES)
def test_balls_lie_where_the_pair_has_them(q):
    developed = PAIR.developed(q)
    middle = SIZES.centre_radius * (q[0] + q[3]) / 2
    np.testing.assert_allclose(centres(q) - [middle, 0.0], developed, atol=1e-9)


@given(PLACES)
def test_chirality_is_the_pairs(q):
    expected = {"R": 1, "L": -1, None: 0}[PAIR.chirality(q)]
    assert drum_pairs.chirality(centres(q)) == expected


@given(PLACES)
def test_the_neighbourhood_is_the_three_inequalities(q):
    a1, a2, b1, b2 = centres(q)
    largest = max(
        max(line_distance(p, b1, b2) for p in (a1, a2)) / 6,
        max(line_distance(p, a1, a2) for p in (b1, b2)) / 6,
        max(math.dist(a, b) for a in (a1, a2) for b in (b1, b2)) / (2 * math.hypot(16, 3)),
    )
    assert drum_pairs.in_neighbourhood(centres(q), 3.0) == (largest < 1)


@given(st.lists(PLACES, min_size=2, max_size=5))
def test_many_pairs_are_judged_as_each_alone(places):
    balls, pairs = np.stack([centres(q) for q in places]), np.stack(places).reshape(-1, 2, 3)
    for judge, stacked in (
        (drum_pairs.chirality, balls),
        (lambda balls: drum_pairs.in_neighbourhood(balls, 3.0), balls),
        (lambda pairs: drum_pairs.is_dyad(SIZES, pairs), pairs),
    ):
        np.testing.assert_array_equal(judge(stacked), [judge(one) for one in stacked])


@pytest.mark.parametrize("chirality", ["R", "L"])
@pytest.mark.parametrize("heading", [-0.3, 0.0, 0.2])
@pytest.mark.parametrize("gap", [0.0, 0.5])
def test_nested_pairs_are_dyads_however_they_are_named(chirality, heading, gap):
    q = PAIR.nested(chirality, heading=heading, clearance=gap)
    for named in (q, PAIR.swap(q), PAIR.half_turn(q, "A"), PAIR.half_turn(q, "B")):
        assert drum_pairs.is_dyad(SIZES, named.reshape(2, 3))
        assert drum_pairs.chirality(centres(named)) == {"R": 1, "L": -1}[chirality]


def slid(pair, by):
    """Return a pair ``(..., 2, k)`` with B moved along its axis, towards A if A is below."""
    moved = np.array(pair)
    heading = moved[..., 1, 2]
    moved[..., 1, 0] -= by * np.sin(heading) / SIZES.centre_radius
    moved[..., 1, 1] -= by * np.cos(heading)
    return moved


SHIFT = 16 - math.sqrt(6**2 - 4.5**2)  # mm along their axis, of two in the corner


@given(
    st.sampled_from("RL"),
    st.floats(-0.3, 0.3),
    st.floats(0.02, 0.6),
    st.floats(0, 2 * SHIFT - 16),
)
def test_pairs_that_have_slid_along_each_other_are_dyads(chirality, heading, gap, by):
    """Parallel, a ball of each beside the other's rod: ``T`` asks for no more."""
    corner = PAIR.nested(chirality, heading=heading, clearance=gap).reshape(2, 3)
    pair = slid(corner, by)
    assert min(gaps_of(pair).values()) > 0
    assert drum_pairs.is_dyad(SIZES, pair)
    assert drum_pairs.is_dyad(DumbbellDrum(), pair)
    assert drum_pairs.chirality(centres(pair.ravel())) == {"R": 1, "L": -1}[chirality]


def gaps_of(pair):
    return dict(zip(CONTACTS, gaps(PAIR, pair.ravel()), strict=True))


@given(PLACES)
def test_dyads_are_parallel_and_hold_each_others_rods(q):
    found = gaps_of(q)
    rods = [min(found[name] for name in names) for names in (("A1b", "A2b"), ("aB1", "aB2"))]
    turned = math.degrees(abs(math.remainder(q[5] - q[2], math.pi)))
    assert drum_pairs.is_dyad(SIZES, q.reshape(2, 3)) == (max(rods) < 0.75 and turned < 20)


@pytest.mark.parametrize("rod_radius", [0.5, 1.5, 2.0, 2.8])
@pytest.mark.parametrize("gap", [0.1, 0.0, -1e-3])
def test_dumbbells_that_touch_side_by_side_or_end_to_end_are_no_dyads(rod_radius, gap):
    """Also when the rods are so thick that the balls are not far from them."""
    pair, sizes = replace(PAIR, rod_radius=rod_radius), replace(SIZES, rod_radius=rod_radius)
    for q in (pair.side_by_side(clearance=gap), pair.end_to_end(gap=gap)):
        assert not drum_pairs.is_dyad(sizes, q.reshape(2, 3))
    nest = pair.nested("R", clearance=0.05).reshape(2, 3)
    assert drum_pairs.is_dyad(sizes, nest)


def test_pairs_that_are_apart_or_crossed_are_no_dyads():
    apart = PAIR.nested("R", clearance=0.9)  # more than half of r - t
    crossed = PAIR.nested("R", clearance=0.5)
    crossed[5] += math.radians(21)
    for q in (apart, crossed):
        assert not drum_pairs.is_dyad(SIZES, q.reshape(2, 3))


# ------------------------------------------------------------------------- what is told of a motion


def motion(q, drum, events=(), present=None):
    """Return a trajectory with given coordinates ``(T, N, 4)``, one instant per second."""
    q = np.array(q, dtype=float)
    T, N = q.shape[:2]
    path = run(drum, drum_starts.bunch(drum, np.random.default_rng(0)), 0.0).trajectory
    here = np.ones((T, N), dtype=bool) if present is None else np.array(present)
    times = np.arange(T, dtype=float)
    return replace(path, times=times, q=q, v=0 * q, present=here, events=tuple(events))


def test_turns_of_a_zigzag():
    phi = np.radians([0.0, 3, 6, 9, 4, 5, 6, 7, 2, 2.5, 2.1, 3, 4])
    q = np.zeros((len(phi), 1, 4))
    q[:, 0, 0] = phi
    top, bottom = drum_pairs.turning_azimuths(motion(q, DumbbellDrum()))
    assert math.degrees(top) == pytest.approx((9 + 7) / 2)
    assert math.degrees(bottom) == pytest.approx((4 + 2) / 2)  # 2.5 to 2.1 is no turn
    still = drum_pairs.turning_azimuths(motion(q[:4], DumbbellDrum()))
    assert all(math.isnan(x) for x in still)


def test_the_mean_heading_is_that_of_directions():
    q = np.zeros((4, 2, 4))
    q[:, :, 2] = np.radians([[80, 84], [88, 90], [-86, 91], [-80, -84]])  # through 90 degrees
    heading = np.degrees(drum_pairs.mean_heading(motion(q, DumbbellDrum(count=2))))
    np.testing.assert_allclose(heading, [82, 89, 92.5, 98], atol=1e-9)


def test_the_climb_of_who_left_ends_there():
    q = np.zeros((5, 2, 4))
    q[:, 0, 1] = [0, 1, 2, 3, 4]
    q[:, 1, 1] = [0, 3, 6, 6, 6]
    present = np.array([[1, 1], [1, 1], [1, 1], [1, 0], [1, 0]], dtype=bool)
    rate = drum_pairs.climb_rate(motion(q, DumbbellDrum(count=2), present=present))
    assert rate == pytest.approx((1 + 3) / 2)


def nested_in_time(chirality, eta):
    """Return coordinates ``(T, 2, 4)`` of a nested pair whose mean is at ``eta``."""
    q = drum_starts.nested_pair(DumbbellDrum(count=2), chirality)
    placed = np.zeros((len(eta), 2, 4))
    placed[:, :, :3] = q
    placed[:, :, 1] += np.array(eta)[:, None]
    return placed


@pytest.mark.parametrize("by", [0.0, 4.0])
def test_exits_are_counted_by_kind(by):
    """A right dyad, a left one and a single leave; the second of the dyad some time later.

    In the corner, and after the two have slid along each other.
    """
    T = 20
    right, left = (
        slid(nested_in_time(hand, [eta] * T), by) for hand, eta in (("R", 50.0), ("L", 150.0))
    )
    single = np.zeros((T, 1, 4))
    single[:, 0, 1] = 250
    q = np.concatenate([right, left, single], axis=1)
    times = {1: 4.5, 0: 8.5, 2: 5.5, 4: 6.5}  # body 3 stays
    present = np.array([[t < times.get(body, math.inf) for body in range(5)] for t in range(T)])
    events = [
        Event(t, EventKind.EXIT, (body,), "", 0.0)
        for body, t in sorted(times.items(), key=lambda item: item[1])
    ]
    path = motion(
        q, DumbbellDrum(count=5), [*events, Event(9.0, EventKind.REST, (3,), "", 0.0)], present
    )
    assert drum_pairs.exits(path) == {"right": 2, "left": 1, "single": 1}
    assert drum_pairs.exits(path, memory=2.0) == {"right": 1, "left": 1, "single": 2}
    assert drum_pairs.dyads(path, 0) == [(0, 1, "R"), (2, 3, "L")]
    assert drum_pairs.dyads(path, 5) == [(2, 3, "L")]


def test_the_second_of_a_dyad_that_climbs_out_leaves_as_one_too():
    """It follows the first by its shift along the drum, as long as the climb takes for that."""
    drum = DumbbellDrum(count=2, top=50.0)
    start = drum_starts.nested_pair(drum, "R", heading=math.radians(12), eta=49.6 - SHIFT / 2)
    path = drum.simulate(start, 80.0, dt=2e-3)
    first, second = (event.time for event in path.of_kind(EventKind.EXIT))
    assert second - first > 20
    assert drum_pairs.exits(path) == {"right": 2, "left": 0, "single": 0}
    assert drum_pairs.exits(path, memory=20.0) == {"right": 1, "left": 0, "single": 1}


def test_the_commoner_hand_counts_and_where_they_balance_the_record_before():
    records = [[(0, 1, -1)], [(0, 1, 1)], [(0, 1, 1), (0, 2, -1)], [(1, 3, 1)]]
    times = np.arange(4.0)
    assert drum_pairs.left_as(times, [(3.5, 0)], records.__getitem__) == ["right"]
    assert drum_pairs.left_as(times, [(3.5, 0)], records.__getitem__, memory=2.0) == ["single"]
    assert drum_pairs.left_as(times, [(1.0, 0), (3.5, 4)], records.__getitem__) == [
        "left",
        "single",
    ]
    three = [[(0, 1, 1), (0, 2, -1), (3, 0, -1)]]
    assert drum_pairs.left_as(times[:1], [(0.5, 0)], three.__getitem__) == ["left"]


def test_a_pair_is_held_while_it_is_near_and_handed():
    drum = DumbbellDrum(count=2)
    q = nested_in_time("R", [50.0] * 4)
    assert drum_pairs.held(motion(q, drum))
    assert drum_pairs.handedness(motion(q, drum)) == "R"
    apart = q.copy()
    apart[2, 1, 1] += 16 + 6
    assert not drum_pairs.held(motion(apart, drum))
    turned = q.copy()
    turned[3] = nested_in_time("L", [50.0])[0]
    assert not drum_pairs.held(motion(turned, drum))
    gone = np.array([[1, 1], [1, 1], [1, 1], [1, 0]], dtype=bool)
    assert not drum_pairs.held(motion(q, drum, present=gone))
    with pytest.raises(ValueError, match=r"^trajectory: expected one of two dumbbells"):
        drum_pairs.held(motion(np.zeros((2, 1, 4)), DumbbellDrum()))


def test_other_trajectories_are_refused(whole):
    class Other:
        pass

    with pytest.raises(TypeError, match=r"^trajectory: expected one of dumbbells in a drum"):
        drum_pairs.dyads(replace(whole.trajectory, system=Other()), 0)


# ------------------------------------------------------------------------------------------ the run


def test_a_run_is_that_of_the_model(whole):
    path = HERD.simulate(START, LASTING, every=20, noise=NOISE)
    same(whole, replace(whole, trajectory=path))
    assert whole.finished
    assert len(path.events) > 20  # the bunch did collide
    assert any(len(touches) > 1 for touches in path.touching)
    np.testing.assert_array_equal(whole.start[:, :3], START)


def test_saving_changes_nothing(whole, tmp_path):
    same(followed(saving=Saving(tmp_path / "deep" / "state", 60)), whole)


class Killed(BaseException):
    """What a process that is killed does not get to handle."""


@pytest.mark.parametrize("moment", range(1, 30, 3))
def test_a_run_killed_while_a_file_is_written_goes_on(whole, tmp_path, monkeypatch, moment):
    """Every saving synchronises two files and their folder twice; the run dies at one of these."""
    usual, seen = writing._synchronise, itertools.count(1)

    def dying(path):
        if next(seen) == moment:
            raise Killed
        usual(path)

    saving = Saving(tmp_path / "state", 60)
    with monkeypatch.context() as patch:
        patch.setattr(writing, "_synchronise", dying)
        patch.setattr("pathlib.Path.unlink", lambda *_, **__: None)  # nor does it tidy up
        with pytest.raises(Killed):
            followed(saving=saving)
    done = drum_checkpoints.Checkpoint(saving.folder, {}).exists
    assert done == (moment > 3)
    same(followed(saving=replace(saving, resume=done)), whole)


SCRIPT = """
import sys
sys.path[:0] = {path!r}
from test_drum_runs import followed
from polycorner.dumbbells.dynamics.runs import Saving
followed(saving=Saving({folder!r}, 20, resume={resume}))
"""


def start_process(folder, *, resume):
    here = Path(__file__).parent
    code = SCRIPT.format(path=[str(here), str(here.parent)], folder=str(folder), resume=resume)
    return subprocess.Popen([sys.executable, "-c", code])


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="the system has no SIGKILL")
def test_a_killed_process_loses_nothing(whole, tmp_path):
    """Kill it again and again at random moments; it saves almost all the time."""
    rng = np.random.default_rng()
    folder, kills = tmp_path / "state", 0
    state = folder / drum_checkpoints.STATE
    for _ in range(4):
        before = state.stat().st_mtime_ns if state.exists() else 0
        process = start_process(folder, resume=state.exists())
        while process.poll() is None and (not state.exists() or state.stat().st_mtime_ns == before):
            time.sleep(0.001)
        time.sleep(rng.uniform(0, 0.1))
        process.kill()
        kills += process.wait() == -signal.SIGKILL
    assert kills >= 1
    same(followed(saving=Saving(folder, 20, resume=True)), whole)


def interrupting(*times):
    """Return a progress that presses Ctrl-C at these times."""
    left = list(times)

    def progress(now):
        if left and now > left[0]:
            left.pop(0)
            signal.raise_signal(signal.SIGINT)

    return progress


def test_an_interrupted_run_keeps_what_is_done(whole, tmp_path):
    saving = Saving(tmp_path / "state")
    part = followed(saving=saving, progress=interrupting(0.5))
    assert not part.finished
    count = len(part.trajectory)
    assert 0.5 < part.trajectory.times[-1] < 0.6
    np.testing.assert_array_equal(part.trajectory.q, whole.trajectory.q[:count])
    same(followed(saving=replace(saving, resume=True)), whole)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_a_second_interruption_ends_at_once(tmp_path):
    def impatient(_now):
        signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        followed(saving=Saving(tmp_path / "state"), progress=impatient)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_progress_tells_the_time():
    told = []
    followed(progress=told.append)
    np.testing.assert_allclose(told, np.arange(1, 76) * 0.02, atol=1e-12)


def test_a_resumed_run_that_was_finished_is_the_same(whole, tmp_path):
    saving = Saving(tmp_path / "state")
    followed(saving=saving)
    same(followed(saving=replace(saving, resume=True)), whole)


CHANGES = {
    "noise": {"noise": Noise(chatter=0.3, seed=6)},
    "dt": {"dt": 5e-4},
    "every": {"every": 10},
}


@pytest.mark.parametrize("name", [*CHANGES, "duration", "drum", "start"])
def test_a_checkpoint_of_another_run_is_refused(tmp_path, name):
    saving = Saving(tmp_path / "state")
    followed(saving=saving, progress=interrupting(0.1))
    again = {"noise": NOISE, "every": 20, "saving": replace(saving, resume=True)}
    drum = replace(HERD, spin=0.02) if name == "drum" else HERD
    start = START + np.array([1e-9, 0, 0]) if name == "start" else START
    lasting = 2.0 if name == "duration" else LASTING
    with pytest.raises(ValueError, match=r"^checkpoint: expected the parameters of the run in"):
        run(drum, start, lasting, **(again | CHANGES.get(name, {})))


def test_nothing_and_damaged_files_are_refused(tmp_path):
    saving = Saving(tmp_path / "state", 100, resume=True)
    with pytest.raises(ValueError, match=r"^checkpoint: expected an unfinished run in .*got none"):
        followed(saving=saving)
    followed(saving=replace(saving, resume=False), progress=interrupting(0.5))
    chunks = sorted((tmp_path / "state").glob("chunk-*"))
    assert len(chunks) > 2
    content = chunks[1].read_bytes()
    for damaged in (content[: len(content) // 2], b""):
        chunks[1].write_bytes(damaged)
        with pytest.raises(ValueError, match=r"^checkpoint: .* is damaged"):
            followed(saving=saving)
    chunks[1].unlink()
    with pytest.raises(ValueError, match=r"^checkpoint: .* is damaged"):
        followed(saving=saving)
    (tmp_path / "state" / drum_checkpoints.STATE).write_text("something else")
    with pytest.raises(ValueError, match=r"^checkpoint: .* is damaged"):
        followed(saving=saving)


def test_a_new_run_clears_the_old_one(whole, tmp_path):
    saving = Saving(tmp_path / "state", 40)
    followed(saving=saving, progress=interrupting(1.0))
    (tmp_path / "state" / "mine.txt").write_text("kept")
    same(followed(saving=replace(saving, every=700)), whole)
    assert len(list((tmp_path / "state").glob("chunk-*"))) == 3
    drum_checkpoints.Checkpoint(tmp_path / "state", {}).clear()
    assert [entry.name for entry in (tmp_path / "state").iterdir()] == ["mine.txt"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"duration": -1}, "duration: expected a time"),
        ({"duration": math.nan}, "duration: expected a time"),
        ({"duration": True}, "duration: expected a time"),
        ({"dt": 0.1}, "dt: expected at most"),
        ({"every": 0}, "every: expected a positive whole number"),
    ],
)
def test_bad_arguments_get_a_sentence(arguments, message):
    chosen = {"duration": 1.0} | arguments
    with pytest.raises(ValueError, match=rf"^{message}"):
        run(HERD, START, **chosen)


@pytest.mark.parametrize("every", [0, 1.5, True])
def test_saving_takes_whole_numbers(every):
    with pytest.raises(ValueError, match=r"^every: expected a positive whole number of steps"):
        Saving("state", every)


# -------------------------------------------------------------------------------------------- files


def test_a_file_has_it_all(whole, tmp_path):
    path = save_run(whole, tmp_path / "deep" / "run.nc")
    read = load_run(path)
    same(read, whole)
    assert (read.drum, read.noise) == (whole.drum, whole.noise)
    assert (read.duration, read.every) == (whole.duration, whole.every)
    assert [entry.name for entry in path.parent.iterdir()] == ["run.nc"]


def test_a_file_of_one_dumbbell_without_contacts(tmp_path):
    drum = DumbbellDrum(sliding=(0.4, 0.1), tilt=0.1)
    noise = Noise(kicks={"phi": 1e-3}, seed=2**63 - 1)
    once = run(drum, [[0.01, 5.0, 0.2]], 0.5, noise=noise)
    read = load_run(save_run(once, tmp_path / "one.nc"))
    same(read, once)
    assert (read.drum, read.noise) == (drum, noise)


def test_a_dataset_explains_itself(whole):
    data = dataset(whole)
    units = {"time": "s", "phi": "rad", "eta": "mm", "theta": "rad", "psi": "rad"}
    units |= {"eta_dot": "mm/s", "kinetic": "nJ", "event_impulse": "g mm/s"}
    for name, unit in units.items():
        assert data[name].attrs["units"] == unit
    assert all(data[name].attrs["units"] and data[name].attrs["long_name"] for name in data)
    for name, value in asdict(HERD).items():
        np.testing.assert_array_equal(data.attrs[name], value)
    assert data.attrs["seed"] == NOISE.seed
    assert data.attrs["polycorner_version"].count(".") == 2
    assert data.phi.dims == ("time", "body")


def test_other_files_are_refused(whole, tmp_path):
    (tmp_path / "text.nc").write_text("no NetCDF")
    dataset(whole).drop_attrs().to_netcdf(tmp_path / "bare.nc", engine="h5netcdf")
    dataset(whole).drop_vars("phi").to_netcdf(tmp_path / "part.nc", engine="h5netcdf")
    for name in ("text.nc", "bare.nc", "part.nc"):
        with pytest.raises(ValueError, match=r"^path: expected a run that save_run wrote"):
            load_run(tmp_path / name)
    with pytest.raises(FileNotFoundError):
        load_run(tmp_path / "none.nc")
