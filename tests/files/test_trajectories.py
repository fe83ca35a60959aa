"""Trajectories in files: read bit for bit, for the system that moved."""

import json
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from discs import DISCS
from kept_files import motion
from kept_files import same_motion as same

from polycorner import Manifold, Polyhedron, System, simulate, velocities
from polycorner.dumbbells import DumbbellDrum
from polycorner.files import load_trajectory, save_trajectory
from polycorner.files.motions import save_dataset
from polycorner.files.trajectories import KIND, trajectory_dataset
from polycorner.models import textbook
from polycorner.motion import Disc, EventKind

G = textbook.GRAVITY


def ball(*, mass=1.0, gravity=G, floor=0.0, restitution=0.5, scale=1.0):
    space = Manifold.euclidean("y", scale=scale, unit="m")
    (y,), (v,) = space.symbols, velocities(space)
    d = Polyhedron(space, {"floor": y - floor})
    return System(d, mass * v**2 / 2, gravity * y, restitution=restitution)


BALL = ball()
STATED = {"energy": "J", "force": "N", "impulse": "N s", "gap": "m"}


@pytest.fixture(scope="module")
def path():
    """Return a ball that falls and bounces once or twice."""
    return simulate(BALL, BALL.state([1.0]), 1.0, 1e-3, every=50)


@pytest.fixture
def saved(path, tmp_path):
    return save_trajectory(path, tmp_path / "ball.nc", units=STATED)


@pytest.fixture
def made(tmp_path):
    """Return the file of a trajectory whose numbers were not computed."""
    return save_trajectory(motion(BALL, 1, 1, "floor"), tmp_path / "made.nc")


def test_a_trajectory_is_read_bit_for_bit(path, saved):
    read = load_trajectory(saved, BALL)
    same(read, path)
    assert read.system is BALL
    assert len(read.of_kind(EventKind.IMPACT)) == len(path.of_kind(EventKind.IMPACT)) > 0


def test_the_file_alone_tells_of_a_ball(saved):
    """Energies and gaps from the numbers in the file, as mechanics has them."""
    with xr.open_dataset(saved, engine="h5netcdf") as file:
        data = file.load()
    y, v = data.q.sel(coordinate="y", body=0), data.v.sel(coordinate="y", body=0)
    np.testing.assert_allclose(data.kinetic, v**2 / 2, rtol=1e-14)
    np.testing.assert_allclose(data.potential, G * y, rtol=1e-14)
    np.testing.assert_array_equal(data.gaps.sel(gap="floor", body=0), y)
    lost = data.dissipated.sel(dissipated_by="impact")
    assert float(lost[-1]) > 0.7 * G  # of m g h the first bounce leaves a quarter


def test_units_are_those_of_the_manifold_and_stated_ones():
    data = trajectory_dataset(motion(BALL, 1, 1, "floor"), units=STATED)
    units = {name: data[name].attrs["units"] for name in ("time", "kinetic", "touch_force")}
    assert units == {"time": "s", "kinetic": "J", "touch_force": "N"}
    assert (data.gaps.attrs["units"], data.event_impulse.attrs["units"]) == ("m", "N s")
    assert json.loads(data.q.attrs["coordinate_units"]) == ["m"]
    pendulum = Manifold(("theta", "x"), (2 * np.pi, np.inf))
    (theta, x), (w, v) = pendulum.symbols, velocities(pendulum)
    system = System(Polyhedron(pendulum, {"right": x}), w**2 / 2 + v**2 / 2, theta**2)
    data = trajectory_dataset(motion(system, 1, 2, "right"))
    assert json.loads(data.q.attrs["coordinate_units"]) == ["rad", "not stated"]
    assert data.kinetic.attrs["units"] == "not stated"


# ------------------------------------------------------------------------------------ other systems


@pytest.mark.parametrize(
    ("system", "told"),
    [
        (ball(restitution=0.6), r"restitution: written \[0\.5\], found \[0\.6\]"),
        (ball(scale=2.0), "scales: written"),
        (ball(mass=1.0001), "kinetic: written"),
        (ball(gravity=9.80665), "potential: written"),
        (ball(floor=-1e-6), "gaps: written"),
        (textbook.wall_pendulum(), "coordinates: written"),
    ],
)
def test_another_system_is_refused_naming_the_difference(made, system, told):
    same(load_trajectory(made, ball()), motion(BALL, 1, 1, "floor"))
    with pytest.raises(ValueError, match=rf"^path: expected a trajectory .* system: {told}"):
        load_trajectory(made, system)


def test_friction_is_the_systems(tmp_path):
    slides = textbook.sliding_block(Disc(0.3))
    known = motion(slides, 1, slides.manifold.dimension, slides.contacts[0])
    path = save_trajectory(known, tmp_path / "block.nc")
    same(load_trajectory(path, slides), known)
    with pytest.raises(ValueError, match="friction: written"):
        load_trajectory(path, textbook.sliding_block(Disc(0.4)))


HERD = replace(motion(BALL, 1, 1, "floor"), system=DumbbellDrum())


@pytest.mark.parametrize(
    ("call", "kind", "argument"),
    [
        (lambda path: load_trajectory(path, BALL.polyhedron), TypeError, "system"),
        (lambda path: save_trajectory(BALL, path), TypeError, "trajectory"),
        (lambda path: save_trajectory(HERD, path), TypeError, "trajectory"),
        (
            lambda path: save_trajectory(motion(BALL, 1, 1, "floor"), path, units={"z": "m"}),
            ValueError,
            "units",
        ),
    ],
)
def test_wrong_arguments_get_a_sentence(made, call, kind, argument):
    with pytest.raises(kind, match=rf"^{argument}: expected"):
        call(made)


def test_a_missing_file_is_not_found(tmp_path):
    with pytest.raises(FileNotFoundError):
        load_trajectory(tmp_path / "none.nc", BALL)


# ------------------------------------------------------------------------- files made by someone


@pytest.mark.parametrize(
    "change",
    [
        lambda data: data.drop_vars("touch_force"),
        lambda data: data.drop_vars("q"),
        lambda data: data.assign_attrs(effort_steps="many"),
        lambda data: data.assign_attrs(contacts="["),
        lambda data: data.assign_attrs(system="{}"),
        lambda data: data.assign(event_kind=data.event_kind + 70),
    ],
)
def test_what_cannot_be_read_is_damage(tmp_path, change):
    data = change(trajectory_dataset(motion(BALL, 1, 1, "floor")))
    file = save_dataset(KIND, tmp_path / "changed.nc", data)
    with pytest.raises(ValueError, match=r"^path: expected a trajectory .* is damaged"):
        load_trajectory(file, BALL)


def test_a_file_that_another_program_wrote_is_refused(tmp_path):
    data = trajectory_dataset(motion(BALL, 1, 1, "floor"))
    data.to_netcdf(tmp_path / "anew.nc", engine="h5netcdf")
    with pytest.raises(ValueError, match=r"^path: expected a trajectory .* was changed or cut off"):
        load_trajectory(tmp_path / "anew.nc", BALL)


def test_several_bodies_are_those_of_the_system(tmp_path):
    known = motion(DISCS, DISCS.count, DISCS.manifold.dimension, DISCS.contacts[0])
    path = save_trajectory(known, tmp_path / "discs.nc")
    same(load_trajectory(path, DISCS), known)
    with pytest.raises(ValueError, match="between: written"):
        load_trajectory(path, replace(DISCS, between=replace(DISCS.between, restitution=0.9)))
