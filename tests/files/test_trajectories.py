"""Trajectories in files: computed again where they can be, and refused where they differ."""

import json
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from kept_files import same_motion as same

from polycorner import Manifold, Polyhedron, System, simulate, velocities
from polycorner.dumbbells import DumbbellDrum
from polycorner.dumbbells.dynamics.files import load_run
from polycorner.files import load_trajectory, save_trajectory
from polycorner.files.motions import save_dataset
from polycorner.files.trajectories import KIND, trajectory_dataset
from polycorner.models import textbook as scenes
from polycorner.motion import Disc, EventKind, Interval

G = scenes.GRAVITY
BALL = scenes.bouncing_ball(0.5)
STATED = {"y": "m", "energy": "J", "force": "N", "impulse": "N s", "gap": "m"}


@pytest.fixture(scope="module")
def path():
    """Return a ball that falls and bounces once or twice."""
    return simulate(BALL, BALL.state([1.0]), 1.0, 1e-3, every=50)


@pytest.fixture
def saved(path, tmp_path):
    return save_trajectory(path, tmp_path / "ball.nc", units=STATED)


def test_a_trajectory_is_read_bit_for_bit(path, saved):
    read = load_trajectory(saved, BALL)
    same(read, path)
    assert read.system is BALL
    assert len(read.of_kind(EventKind.IMPACT)) == len(path.of_kind(EventKind.IMPACT)) > 0


def test_contacts_friction_and_several_coordinates_survive(tmp_path):
    box = scenes.box_on_plane(0.5, 1.0, Interval(0.5), angle=0.1)
    motion = simulate(box, box.state([0.0, 1.0, 0.0], [1.0, 0.0, 0.4]), 0.5, 2e-3, every=10)
    assert any(motion.touching)
    assert motion.max_penetration > 0
    same(load_trajectory(save_trajectory(motion, tmp_path / "box.nc"), box), motion)


def test_the_file_alone_tells_of_a_ball(saved):
    """Energies and gaps from the numbers in the file, as mechanics has them."""
    with xr.open_dataset(saved, engine="h5netcdf") as file:
        data = file.load()
    y, v = data.q.sel(coordinate="y", body=0), data.v.sel(coordinate="y", body=0)
    np.testing.assert_allclose(data.kinetic, v**2 / 2, rtol=1e-14)
    np.testing.assert_allclose(data.potential, G * y, rtol=1e-14)
    np.testing.assert_array_equal(data.gaps.sel(gap="floor"), y)
    lost = data.dissipated.sel(dissipated_by="impact")
    assert float(lost[-1]) > 0.7 * G  # of m g h the first bounce leaves a quarter
    units = {name: data[name].attrs["units"] for name in ("time", "kinetic", "touch_force")}
    assert units == {"time": "s", "kinetic": "J", "touch_force": "N"}
    assert (data.gaps.attrs["units"], data.event_impulse.attrs["units"]) == ("m", "N s")
    assert json.loads(data.q.attrs["coordinate_units"]) == ["m"]
    assert data.attrs["polycorner_trajectory"] == KIND.schema


def test_angles_have_their_unit_and_others_are_not_stated():
    pendulum = Manifold(("theta", "x"), (2 * np.pi, np.inf))
    (theta, x), (w, v) = pendulum.symbols, velocities(pendulum)
    system = System(Polyhedron(pendulum, {"right": x}), w**2 / 2 + v**2 / 2, theta**2)
    data = trajectory_dataset(simulate(system, system.state([0.1, 1.0]), 0.1, 0.01))
    assert json.loads(data.q.attrs["coordinate_units"]) == ["rad", "not stated"]
    assert data.kinetic.attrs["units"] == "not stated"


# ------------------------------------------------------------------------------------ other systems


@pytest.mark.parametrize(
    ("system", "told"),
    [
        (scenes.bouncing_ball(0.6), "restitution: written"),
        (scenes.wall_pendulum(), "coordinates: written"),
        (scenes.row_of_balls(), "coordinates: written"),
    ],
)
def test_another_system_is_refused_naming_the_difference(saved, system, told):
    with pytest.raises(ValueError, match=rf"is of another system: {told}"):
        load_trajectory(saved, system)


def ball(*, mass=1.0, gravity=G, floor=0.0):
    space = Manifold.euclidean("y")
    (y,), (v,) = space.symbols, velocities(space)
    d = Polyhedron(space, {"floor": y - floor})
    return System(d, mass * v**2 / 2, gravity * y, restitution=0.5)


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"mass": 1.0001}, "kinetic energy at the time"),
        ({"gravity": 9.80665}, "potential energy at the time"),
        ({"floor": -1e-6}, "gap 'floor' at the time"),
        ({"floor": 0.5}, "contact 'floor' overlaps by"),
    ],
)
def test_other_formulas_are_refused_naming_the_difference(saved, changes, told):
    load_trajectory(saved, ball())
    with pytest.raises(ValueError, match=rf"is not what is computed here: {told}"):
        load_trajectory(saved, ball(**changes))


def test_friction_is_the_systems(tmp_path):
    slides = scenes.sliding_block(Disc(0.3))
    motion = simulate(slides, slides.state([0.0, 0.0], [1.0, 0.0]), 0.1, 1e-2)
    path = save_trajectory(motion, tmp_path / "block.nc")
    with pytest.raises(ValueError, match="friction: written"):
        load_trajectory(path, scenes.sliding_block(Disc(0.4)))


def test_wrong_arguments_get_a_sentence(path, saved, tmp_path):
    with pytest.raises(TypeError, match=r"^system: expected a System"):
        load_trajectory(saved, BALL.polyhedron)
    with pytest.raises(TypeError, match=r"^trajectory: expected a Trajectory"):
        save_trajectory(BALL, tmp_path / "a.nc")
    other = replace(path, system=DumbbellDrum().bodies)
    with pytest.raises(
        TypeError, match=r"got one of IdenticalBodies: save_run keeps runs in the drum"
    ):
        save_trajectory(other, tmp_path / "a.nc")
    for units in ({"z": "m"}, {"y": ""}):
        with pytest.raises(ValueError, match=r"^units: expected"):
            save_trajectory(path, tmp_path / "a.nc", units=units)
    with pytest.raises(FileNotFoundError):
        load_trajectory(tmp_path / "none.nc", BALL)


# ----------------------------------------------------------------- what the digest does not tell


def changed(**values):
    def change(data):
        for name, (place, value) in values.items():
            array = data[name].values.copy()
            array[place] = value
            data[name] = (data[name].dims, array, data[name].attrs)
        return data

    return change


def without(name):
    return lambda data: data.drop_vars(name)


def told_other(**attributes):
    return lambda data: data.assign_attrs(attributes)


def reversed_time(data):
    return data.assign_coords(time=data.time.values[::-1])


def other_causes(data):
    return data.assign_coords(dissipated_by=["wear"])


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (changed(q=((3, 0, 0), 0.7)), "potential energy at the time 0.15"),
        (changed(v=((3, 0, 0), 0.7)), "kinetic energy at the time 0.15"),
        (changed(kinetic=(2, 0.0)), "kinetic energy at the time 0.1"),
        (changed(potential=(2, np.nan)), "potential energy at the time 0.1"),
        (changed(gaps=((1, 0), 0.3)), "gap 'floor' at the time 0.05"),
        (changed(q=((3, 0, 0), np.inf)), "q has numbers that are not finite"),
        (reversed_time, "instants do not grow"),
        (told_other(dt=2e-3), "steps|whole steps"),
        (told_other(dt=7e-4), "instants are not whole steps"),
        (told_other(effort_steps=17), "17 steps were done"),
        (changed(event_time=(0, 99.0)), "an event at 99 is outside"),
        (changed(event_body_1=(0, 5)), "of the bodies"),
        (other_causes, "causes of dissipation: written wear"),
        (told_other(contacts='["ceiling"]'), "contact 'ceiling'"),
        (without("touch_force"), "is damaged"),
        (without("q"), "is damaged"),
        (told_other(effort_steps="many"), "is damaged"),
        (told_other(contacts="["), "is damaged"),
        (told_other(system="{}"), "is damaged"),
        (changed(event_kind=(0, 77)), "is damaged"),
    ],
)
def test_what_is_not_computed_again_is_refused_even_with_a_digest(path, tmp_path, change, told):
    data = change(trajectory_dataset(path).copy(deep=True))
    file = save_dataset(KIND, tmp_path / "changed.nc", data)
    with pytest.raises(ValueError, match=rf"^path: expected a trajectory .*{told}"):
        load_trajectory(file, BALL)


def test_a_file_written_anew_by_another_program_has_no_digest(path, tmp_path):
    data = trajectory_dataset(path).assign_attrs({KIND.key: KIND.schema})
    data.to_netcdf(tmp_path / "anew.nc", engine="h5netcdf")
    with pytest.raises(ValueError, match="was changed after it was written"):
        load_trajectory(tmp_path / "anew.nc", BALL)
    del data.attrs["polycorner_sealed"]
    data.to_netcdf(tmp_path / "anew.nc", engine="h5netcdf")
    with pytest.raises(ValueError, match=r"was changed after it was written \(no digest\)"):
        load_trajectory(tmp_path / "anew.nc", BALL)
    data.drop_attrs().to_netcdf(tmp_path / "bare.nc", engine="h5netcdf")
    with pytest.raises(ValueError, match="is something else"):
        load_trajectory(tmp_path / "bare.nc", BALL)


def test_a_run_in_the_drum_is_no_trajectory(saved):
    with pytest.raises(
        ValueError, match=r"^path: expected a run that save_run wrote; .* something"
    ):
        load_run(saved)
