"""Rigid dumbbells in the drum: the same scene for polycorner and MuJoCo, from closed formulas."""

import math
import sys
from importlib.util import find_spec

import numpy as np
import pytest
from bench_bodies_motion import OURS, Scene, in_drum, watched
from bodies_in_drum import (
    BALL,
    DENSITY,
    DT,
    GRAVITY,
    LENGTH,
    RADIUS,
    ROD,
    SPIN,
    PolycornerMotion,
    deepest_overlap,
    heap_of,
    rows_of,
)
from hypothesis import given
from hypothesis import strategies as st
from mujoco_bodies import MujocoMotion
from scipy.spatial.transform import Rotation

needs_mujoco = pytest.mark.skipif(find_spec("mujoco") is None, reason="MuJoCo is not installed")
engines = pytest.mark.parametrize(
    "engine", [PolycornerMotion, pytest.param(MujocoMotion, marks=needs_mujoco)]
)


def placement(centre, turn):
    return np.concatenate([centre, turn.as_quat(scalar_first=True)])


def turn_of(placed):
    return Rotation.from_quat(placed[3:], scalar_first=True)


ALONG, ACROSS = Rotation.identity(), Rotation.from_rotvec([0, 0, math.pi / 2])
# two dumbbells, the second displaced along z: its place and turn, and the distance of contact
TOUCHING = {
    "balls, side by side": ([0, 0, 0], ALONG, 2 * BALL),
    "balls, end to end": ([0, LENGTH, 0], ALONG, 2 * BALL),
    "rods, crossed": ([0, 0, 0], ACROSS, 2 * ROD),
    "ball on rod": ([LENGTH / 2, 0, 0], ACROSS, BALL + ROD),
}


class TestOverlap:
    @given(
        st.sampled_from(list(TOUCHING.values())),
        st.floats(0.01, 0.4),
        st.tuples(*[st.floats(-3, 3)] * 3),
    )
    def test_two_dumbbells_closer_than_contact_overlap_by_the_difference(self, case, depth, vector):
        offset, turn, contact = case
        whole = Rotation.from_rotvec(vector)
        second = whole.apply(np.add(offset, [0, 0, contact - depth]))
        two = [placement(np.zeros(3), whole), placement(second, whole * turn)]
        assert deepest_overlap(np.array(two)) == pytest.approx(depth, abs=1e-9)

    @given(st.floats(-math.pi, math.pi), st.floats(-2, 2))
    def test_a_level_dumbbell_overlaps_the_drum_by_how_far_it_is_beyond_contact(self, phi, beyond):
        away = RADIUS - BALL + beyond
        centre = [away * math.sin(phi), 5.0, -away * math.cos(phi)]
        overlap = deepest_overlap(np.array([placement(centre, ALONG)]))
        assert overlap == pytest.approx(max(0.0, beyond), abs=1e-9)


class TestStarts:
    def test_in_rows_every_ball_touches_the_drum_and_nothing_overlaps(self):
        rows = rows_of(60)
        assert np.hypot(rows[:, 0], rows[:, 2]) == pytest.approx(RADIUS - BALL)
        assert np.cos(turn_of_rows(rows)) == pytest.approx(1.0)
        assert deepest_overlap(rows) < 1e-9

    def test_in_a_heap_spheres_around_dumbbells_are_apart_and_inside(self):
        places, around = heap_of(60)[:, :3], LENGTH / 2 + BALL
        apart = np.linalg.norm(places[:, None] - places, axis=-1)[np.triu_indices(60, 1)]
        assert apart.min() > 2 * around
        assert np.hypot(places[:, 0], places[:, 2]).max() + around < RADIUS


def turn_of_rows(rows):
    """Angles between rods and the drum's axis."""
    rods = Rotation.from_quat(rows[:, 3:], scalar_first=True).apply([0, 1, 0])
    return np.arccos(np.clip(rods[:, 1], -1, 1))


class TestMotion:
    @engines
    def test_free_fall(self, engine):
        """Exact by the midpoint rule; by MuJoCo's rule, half implicit, ``g h^2 k (k + 1) / 2``."""
        start, steps = heap_of(2), 10
        motion = engine(start)
        motion.advance(steps)
        factor = steps**2 if engine is PolycornerMotion else steps * (steps + 1)
        fallen = start[:, :3] - [0, 0, GRAVITY * DT**2 * factor / 2]
        assert motion.placements()[:, :3] == pytest.approx(fallen, abs=1e-9)
        assert motion.placements()[:, 3:] == pytest.approx(start[:, 3:], abs=1e-9)

    @engines
    def test_a_dumbbell_on_the_bottom_soon_rolls_without_slip_on_the_turning_drum(self, engine):
        """Its lowest point has the velocity ``spin x r`` of the drum there, ``-spin R`` along x."""
        start = [placement([0, y, BALL - RADIUS], ALONG) for y in (0.0, 30.0)]
        motion = engine(np.array(start))
        motion.advance(100)
        before, _ = motion.placements()
        motion.advance(1)
        after, _ = motion.placements()
        velocity = (after - before)[:3] / DT
        rate = (turn_of(after) * turn_of(before).inv()).as_rotvec() / DT
        lowest = velocity + np.cross(rate, [0, 0, -BALL])
        assert lowest[0] == pytest.approx(-SPIN * RADIUS, rel=0.01)

    @engines
    def test_a_loaded_state_is_continued_as_at_first(self, engine):
        motion = engine(rows_of(2))
        motion.advance(5)
        saved = motion.save()
        motion.advance(5)
        first = motion.placements()
        motion.load(saved)
        motion.advance(5)
        assert np.array_equal(motion.placements(), first)

    @needs_mujoco
    def test_mujoco_moves_the_mass_of_two_balls_and_a_rod(self):
        """Parts that overlap count twice, as in polycorner."""
        balls = 2 * (4 / 3) * math.pi * BALL**3
        rod = math.pi * ROD**2 * (LENGTH + 4 / 3 * ROD)
        model = MujocoMotion(rows_of(2)).model
        assert model.body_mass[-2:] == pytest.approx(DENSITY * (balls + rod))

    @needs_mujoco
    def test_both_engines_let_dumbbells_roll_to_the_bottom_equally_fast(self):
        """A tenth of a second: the boxes are up to 2 % too steep or too flat here, and soft."""
        start = rows_of(2)
        moved = []
        for engine in (PolycornerMotion, MujocoMotion):
            motion = engine(start)
            motion.advance(100)
            moved.append((motion.placements() - start)[:, :3])
        assert moved[1] == pytest.approx(moved[0], abs=0.1 * np.abs(moved[0]).max())

    def test_without_mujoco_the_extra_is_named(self, monkeypatch):
        monkeypatch.setitem(sys.modules, "mujoco", None)
        with pytest.raises(ImportError, match=r"the extra 'bench'"):
            MujocoMotion(rows_of(1))


class Sinking:
    """A dumbbell that sinks into the drum by a tenth in each step.

    Every step but the first three leaves an island unsolved.
    """

    def __init__(self):
        self.steps = 0

    @property
    def unsolved(self):
        return max(0, self.steps - 3)

    def advance(self, steps):
        self.steps += steps

    def placements(self):
        depth = 0.1 * self.steps
        return np.array([placement([0, 0, BALL - RADIUS - depth], ALONG)])

    def save(self):
        return self.steps

    def load(self, saved):
        self.steps = saved


class TestFigures:
    def test_watching_finds_the_deepest_of_the_next_steps_and_goes_back(self):
        motion = Sinking()
        motion.advance(2)
        found = watched(motion, 3)
        assert found == {"deepest overlap, mm": 0.5, "islands unsolved": 2}
        assert motion.steps == 2

    def test_every_engine_is_measured_beside_the_first(self, capsys):
        figures = in_drum(Scene(rows_of, 1, 4), count=2, rounds=1)
        assert figures[OURS]["time over ours"] == 1
        assert all(row["steps a second"] > 0 for row in figures.values())
        alone = find_spec("mujoco") is None
        assert ("MuJoCo" in figures) is not alone
        assert ("is left out" in capsys.readouterr().out) is alone
