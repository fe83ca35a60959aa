"""The drum as a MuJoCo model: the same bodies in the same places, and what the engine does to them.

Tests of motion say how MuJoCo moves dumbbells, in numbers that follow from the laws it solves; the
comparison of engines rests on them.
"""

import math
import sys
import xml.etree.ElementTree as ET
from importlib.util import find_spec

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mjcf import GRAVITY, DrumScene, mjcf
from mujoco_drum import MujocoDrum

from polycorner.dumbbells import DumbbellPair

SIZES = (16.0, 3.0, 1.5)
DRUM = 125.0
needs_mujoco = pytest.mark.skipif(find_spec("mujoco") is None, reason="MuJoCo is not installed")
kinds = pytest.mark.parametrize("rolling", ["cone", "joint"])
angles = st.floats(-3.1, 3.1)


def plane(**changes):
    return DrumScene(*SIZES, spin=0.0, **changes)


def numbers(text):
    return np.array([float(word) for word in text.split()])


class TestScene:
    @pytest.mark.parametrize(
        ("name", "value"),
        [
            ("count", 0),
            ("ball_mass", 0.0),
            ("mu_slide", 0.0),
            ("mu_roll", -0.1),
            ("mu_contact", -0.1),
            ("drum_length", 0.0),
            ("dt", 0.0),
            ("segments", 7),
            ("impratio", 0.0),
            ("noslip_iterations", -1),
            ("rolling", "both"),
        ],
    )
    def test_wrong_numbers_are_named(self, name, value):
        with pytest.raises(ValueError, match=f"^{name}: expected .*; got"):
            DrumScene(*SIZES, DRUM, **{name: value})

    def test_sizes_are_checked_like_those_of_a_pair(self):
        with pytest.raises(ValueError, match=r"^rod_radius: expected "):
            DrumScene(16, 3, 3, DRUM)

    def test_a_plane_cannot_turn(self):
        with pytest.raises(ValueError, match=r"^spin: expected "):
            DrumScene(*SIZES)

    @pytest.mark.parametrize("radius", [DRUM, math.inf])
    def test_rows_touch_neither_each_other_nor_the_bottom(self, radius):
        scene = DrumScene(*SIZES, radius, count=30, spin=0.0)
        rows = scene.rows()
        pairs = [np.concatenate([rows[i], rows[j]]) for i in range(30) for j in range(i)]
        assert scene.pair.polyhedron.values(np.array(pairs)).min() > 0.1
        assert rows[:, 1].min() - 16 / 2 - 3 == pytest.approx(3)


class TestDocument:
    def test_the_boxes_are_tangent_to_the_drum_all_around(self):
        """Middles of inner faces lie on the drum, normals point to its axis, edges meet."""
        boxes = ET.fromstring(mjcf(DrumScene(*SIZES, DRUM, segments=90))).findall(
            ".//geom[@type='box']"
        )
        azimuths = []
        for box in boxes:
            x, y = numbers(box.get("xyaxes")).reshape(2, 3)
            z, (width, length, thickness) = np.cross(x, y), numbers(box.get("size"))
            face = numbers(box.get("pos")) + thickness * z
            assert face == pytest.approx([-DRUM * z[0], 150.0, -DRUM * z[2]])
            assert (length, y[1]) == (150.0, 1.0)
            assert width >= DRUM * math.tan(math.pi / 90)
            azimuths.append(math.atan2(face[0], -face[2]) % math.tau)
        assert np.diff(np.sort(azimuths)) == pytest.approx(math.tau / 90)

    @kinds
    def test_each_dumbbell_is_one_body(self, rolling):
        tree = ET.fromstring(mjcf(plane(count=5, rolling=rolling)))
        bodies = tree.findall("worldbody/body")
        assert [body.get("name") for body in bodies] == [f"dumbbell{k}" for k in range(5)]
        assert len(tree.findall(".//freejoint")) == (5 if rolling == "cone" else 0)


def test_without_mujoco_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(ImportError, match=r"the extra 'bench'"):
        MujocoDrum(plane()).placements()


@needs_mujoco
class TestBodies:
    @kinds
    def test_mass_and_inertia_are_those_of_two_solid_balls(self, rolling):
        """Moments ``2 (2/5 m r^2)`` about the own axis, ``2 (2/5 m r^2 + m l^2 / 4)`` across."""
        model = MujocoDrum(plane(ball_mass=0.7, rolling=rolling)).model
        ball = 0.4 * 0.7 * 3**2
        across = 2 * (ball + 0.7 * 16**2 / 4)
        assert model.body_mass[-1] == pytest.approx(1.4)
        assert sorted(model.body_inertia[-1]) == pytest.approx([2 * ball, across, across])

    @pytest.mark.parametrize("count", [1, 20])
    def test_the_drum_keeps_its_speed_whatever_it_carries(self, count):
        drum = MujocoDrum(DrumScene(*SIZES, DRUM, count=count, segments=90))
        rows = drum.scene.rows()
        rows[:, 0] += 0.3
        drum.set_placements(rows)
        drum.step(300)
        assert drum.data.qvel[0] == pytest.approx(0.01, rel=1e-3)
        assert drum.data.qpos[0] == pytest.approx(0.003, rel=1e-3)


@needs_mujoco
class TestPlacements:
    SCENES = tuple(
        MujocoDrum(DrumScene(*SIZES, radius, count=2, segments=8, spin=0.0, rolling=rolling))
        for radius in (DRUM, math.inf)
        for rolling in ("cone", "joint")
    )

    @given(
        st.sampled_from(SCENES),
        st.lists(
            st.tuples(st.floats(-1.4, 1.4), st.floats(0, 300), angles, angles),
            min_size=2,
            max_size=2,
        ),
    )
    def test_what_is_set_is_read(self, drum, rows):
        drum.set_placements(rows)
        assert drum.placements() == pytest.approx(np.array(rows), abs=1e-9)

    @given(
        st.sampled_from(SCENES),
        st.lists(
            st.tuples(st.floats(-1.4, 1.4), st.floats(0, 300), angles), min_size=2, max_size=2
        ),
    )
    def test_balls_are_where_the_pair_has_them(self, drum, rows):
        import mujoco

        drum.set_placements(rows)
        mujoco.mj_kinematics(drum.model, drum.data)
        balls = drum.model.geom_type == mujoco.mjtGeom.mjGEOM_SPHERE
        expected = drum.scene.pair.ball_centres(np.ravel(rows))
        if drum.scene.pair.is_plane:
            expected[:, 2] += 3  # for the pair the plane lies at the height of the centres
        assert drum.data.geom_xpos[balls] == pytest.approx(expected, abs=1e-9)

    def test_a_wrong_shape_is_refused(self):
        drum = MujocoDrum(plane(count=2))
        with pytest.raises(ValueError, match=r"^placements: expected shape \(2, 3\) or \(2, 4\)"):
            drum.set_placements([[0.0, 0.0, 0.0]])

    @kinds
    def test_what_lies_on_the_drum_turns_with_it(self, rolling):
        """Set velocities are those of a rotation with the drum: points of the body follow it."""
        import mujoco

        drum = MujocoDrum(DrumScene(*SIZES, DRUM, segments=8, spin=0.5, rolling=rolling))
        drum.set_placements([[0.3, 100.0, 0.4, 1.0]])
        mujoco.mj_forward(drum.model, drum.data)
        turn, middle = drum.data.cvel[-1][:3], drum.data.xpos[-1]
        velocity = np.zeros(6)
        mujoco.mj_objectVelocity(
            drum.model, drum.data, mujoco.mjtObj.mjOBJ_XBODY, drum.model.nbody - 1, velocity, 0
        )
        assert turn == pytest.approx([0, -0.5, 0])
        assert velocity[3:] == pytest.approx(np.cross([0, -0.5, 0], middle))


def sideways(drum, time):
    """Return how far a dumbbell goes along its axis and across while rolling, from rest."""
    before = drum.placements()[0]
    drum.step(round(time / drum.scene.dt))
    after = drum.placements()[0]
    theta = before[2]
    moved = after[:2] - before[:2]
    return moved @ [math.sin(theta), math.cos(theta)], moved @ [-math.cos(theta), math.sin(theta)]


@needs_mujoco
class TestMotion:
    @kinds
    def test_rolling_down_an_incline(self, rolling):
        """Solid balls without rolling resistance: ``g sin(tilt) / (1 + 2/5)``, and no slip."""
        drum = MujocoDrum(plane(tilt=0.1, mu_roll=0.0, rolling=rolling))
        drum.set_placements([[0.0, 0.0, math.pi / 2, 0.0]])
        drum.step(300)
        _, y, _, psi = drum.placements()[0]
        assert y == pytest.approx(-GRAVITY * math.sin(0.1) / 1.4 * 0.3**2 / 2, rel=0.01)
        assert math.remainder(psi - y / 3, math.tau) == pytest.approx(0, abs=0.01 * abs(y) / 3)

    def test_friction_of_the_joint_is_rolling_resistance(self):
        drum = MujocoDrum(plane(tilt=0.1, mu_roll=0.05, rolling="joint"))
        drum.set_placements([[0.0, 0.0, math.pi / 2]])
        drum.step(300)
        pull = GRAVITY * (math.sin(0.1) - 0.05 * math.cos(0.1)) / 1.4
        assert drum.placements()[0, 1] == pytest.approx(-pull * 0.3**2 / 2, rel=0.01)

    def test_what_rests_on_the_drum_creeps_as_friction_is_soft(self):
        """Downhill, at a speed inversely proportional to ``impratio``."""
        speeds = []
        for impratio in (10.0, 100.0):
            drum = MujocoDrum(DrumScene(*SIZES, DRUM, mu_roll=0.2, impratio=impratio))
            drum.set_placements([[0.0, 150.0, 0.0]])
            drum.step(500)
            before = drum.placements()[0]
            drum.step(1000)
            change = drum.placements()[0] - before
            assert change[0] == pytest.approx(0.01, rel=0.02)
            speeds.append(change[1])
        assert speeds[0] == pytest.approx(10 * speeds[1], rel=0.05)
        assert speeds[0] < 0

    @pytest.mark.parametrize("heading", [30, 45, 60])
    def test_sliding_and_rolling_in_one_cone_make_a_roller_go_sideways(self, heading):
        """The slip of a single cone is normal to it: ``f_s / mu_s^2`` along the axis, ``f_r /
        mu_r^2`` of rolling and ``f_r / mu_s^2`` of sliding across.

        On the incline where it rolls without gaining speed, forces are in the proportion of the
        pull, so the path leaves the rolling direction by the tangent
        ``cot(theta) / (1 + (mu_s / mu_r)^2)``.
        """
        mu_s, mu_r, theta = 0.3, 0.1, math.radians(heading)
        slope = 1 / math.sqrt(1 / mu_s**2 + math.sin(theta) ** 2 / mu_r**2)
        moved = {}
        for rolling in ("cone", "joint"):
            drum = MujocoDrum(
                plane(tilt=math.atan(slope), mu_slide=mu_s, mu_roll=mu_r, rolling=rolling, dt=5e-4)
            )
            drum.set_placements([[0.0, 0.0, theta]])
            drum.step(200)
            speed = 20.0
            drum.data.qvel[:2] += speed * np.array([math.cos(theta), -math.sin(theta)])
            drum.data.qvel[4 if rolling == "cone" else 5] += speed / 3
            moved[rolling] = sideways(drum, 0.2)
        (along, across), (slid, rolled) = moved["cone"], moved["joint"]
        law = 1 / math.tan(theta) / (1 + (mu_s / mu_r) ** 2)
        assert along / across == pytest.approx(law, rel=0.15)
        assert abs(slid / rolled) < 0.02 * law

    def test_a_right_handed_dyad_climbs_unless_sliding_and_rolling_share_a_cone(self):
        """With friction apart it climbs at ``rho omega tan(theta)``; in one cone it goes down."""
        rows = DumbbellPair(*SIZES, DRUM).nested("R", clearance=0.05).reshape(2, 3)
        rows += [0.1, 150.0, 0.0]
        rates = {}
        for rolling in ("cone", "joint"):
            drum = MujocoDrum(DrumScene(*SIZES, DRUM, count=2, rolling=rolling))
            drum.set_placements(rows)
            drum.step(2000)
            before = drum.placements()
            drum.step(10_000)
            after = drum.placements()
            rates[rolling] = (after - before)[:, 1].mean() / 10
        ideal = 122 * 0.01 * math.tan(after[:, 2].mean())
        assert rates["joint"] == pytest.approx(ideal, rel=0.1)
        assert rates["cone"] < 0
