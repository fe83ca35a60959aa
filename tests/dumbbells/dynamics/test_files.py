"""Runs in the drum in files: those of the first version too, checked when they are loaded."""

import gzip
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray as xr
from kept_files import same_run as same
from kept_files import written
from oracles import gaps

from polycorner.dumbbells import DumbbellDrum
from polycorner.dumbbells.dynamics.files import KIND, dataset, load_run, save_run
from polycorner.dumbbells.dynamics.runs import run as follow
from polycorner.motion import EventKind
from polycorner.motion.noise import Noise

OLD = Path(__file__).parents[2] / "data" / "run_v1.nc.gz"


@pytest.fixture(scope="module")
def old(tmp_path_factory):
    path = tmp_path_factory.mktemp("old") / "run_v1.nc"
    path.write_bytes(gzip.decompress(OLD.read_bytes()))
    return path


@pytest.fixture(scope="module")
def run(old):
    return load_run(old)


def test_a_run_of_the_first_version_is_read(old, run):
    with h5py.File(old) as file:
        assert file.attrs["polycorner_drum_run"] == 1
        path = run.trajectory
        for k, name in enumerate(("phi", "eta", "theta", "psi")):
            np.testing.assert_array_equal(path.q[..., k], file[name][:])
            np.testing.assert_array_equal(path.v[..., k], file[f"{name}_dot"][:])
        for name in ("kinetic", "potential"):
            np.testing.assert_array_equal(getattr(path, name), file[name][:])
        for k, cause in enumerate(("impact", "sliding", "rolling")):
            np.testing.assert_array_equal(path.dissipated[cause], file["dissipated"][:, k])
    assert run.drum == DumbbellDrum(floor=True, top=60.0, tilt=0.5, spin=0.02)
    assert run.noise == Noise(chatter=0.3, kicks={"phi": 1e-3}, seed=7)
    assert (run.duration, run.every, len(run.trajectory)) == (0.4, 20, 21)
    assert [event.kind for event in path.events] == [EventKind.MADE, EventKind.REST]
    assert path.touching[-1][0][:2] == ((0,), "floor1")
    assert run.finished


def test_it_is_saved_in_the_present_version(run, tmp_path):
    path = save_run(run, tmp_path / "deep" / "run.nc")
    same(load_run(path), run)
    with xr.open_dataset(path, engine="h5netcdf") as data:
        assert data.attrs["polycorner_drum_run"] == KIND.schema == 2
        assert data.attrs["polycorner_sealed"]
        units = {name: data[name].attrs["units"] for name in ("phi", "eta", "theta_dot", "time")}
    assert units == {"phi": "rad", "eta": "mm", "theta_dot": "rad/s", "time": "s"}
    assert [entry.name for entry in path.parent.iterdir()] == ["run.nc"]


def test_the_weight_is_where_mechanics_has_it(run):
    """Two balls of mass m on the cylinder of radius rho, gravity tilted by alpha."""
    drum, path = run.drum, run.trajectory
    rho, (phi, eta, theta, _) = drum.centre_radius, np.moveaxis(path.q[:, 0], -1, 0)
    half = np.arcsin(drum.length * np.sin(theta) / (2 * rho))
    weight = 2 * drum.ball_mass * 9806.65
    low = -rho * np.cos(phi) * np.cos(half) * np.cos(drum.tilt)
    high = eta * np.sin(drum.tilt)
    np.testing.assert_allclose(path.potential, weight * (low + high), rtol=1e-12)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"eta": (5, 3.0)}, "potential energy at the time 0.1"),
        ({"theta_dot": (5, 3.0)}, "kinetic energy at the time 0.1"),
        ({"potential": (5, 0.0)}, "potential energy at the time 0.1"),
    ],
)
@pytest.mark.parametrize("digest", [True, False])
def test_energies_are_computed_again(run, tmp_path, change, told, digest):
    data = dataset(run).copy(deep=True)
    for name, (place, value) in change.items():
        data[name].values[place] = value
    path = tmp_path / "changed.nc"
    if digest:
        written(data, path)
    else:  # as the first version would have it
        del data.attrs["polycorner_sealed"]
        data.assign_attrs(polycorner_drum_run=1).to_netcdf(path, engine="h5netcdf")
    with pytest.raises(ValueError, match=rf"^path: expected a run .* computed here: {told}"):
        load_run(path)


def test_a_dumbbell_that_left_has_no_energy(run, tmp_path):
    data = dataset(run).copy(deep=True)
    data["present"].values[10:] = 0
    with pytest.raises(ValueError, match=r"energy at the time 0\.2: written .*, found 0$"):
        load_run(written(data, tmp_path / "run.nc"))
    for name in ("kinetic", "potential"):
        data[name].values[10:] = 0.0
    assert not load_run(written(data, tmp_path / "run.nc")).trajectory.present[-1]


def test_another_drum_is_another_energy(run, tmp_path):
    path = written(dataset(run).assign_attrs(tilt=0.4), tmp_path / "run.nc")
    with pytest.raises(ValueError, match="potential energy at the time 0"):
        load_run(path)


def test_a_ball_is_no_deeper_in_the_bottom_than_the_run_says(run, tmp_path):
    """A dumbbell moved down by a millimetre, and its weight with it."""
    data, drum = dataset(run).copy(deep=True), run.drum
    data["eta"].values[:] -= 1.0
    data["potential"].values[:] -= 2 * drum.ball_mass * 9806.65 * np.sin(drum.tilt)
    with pytest.raises(
        ValueError, match=r"contact 'floor1' overlaps by .* deepest overlap is said"
    ):
        load_run(written(data, tmp_path / "run.nc"))


def test_dumbbells_are_no_deeper_in_each_other_than_the_run_says(tmp_path):
    """One of two is moved along a level drum, where no energy tells: by the gaps it overlaps."""
    drum = DumbbellDrum(count=2, tilt=0.0, spin=0.0)
    two = follow(drum, [[0.0, 0.0, 0.0], [0.0, 40.0, 0.0]], 0.02)
    data = dataset(two)
    load_run(written(data, tmp_path / "apart.nc"))
    for eta, deep in ((22.1, False), (21.9, True)):
        near = data.copy(deep=True)
        near["eta"].values[:, 1] = eta
        q = np.stack([near[name].values[0] for name in ("phi", "eta", "theta")], axis=-1)
        assert (gaps(drum.pair, q.reshape(6)).min() < -0.05) == deep
        path = written(near, tmp_path / "near.nc")
        if not deep:
            load_run(path)
            continue
        with pytest.raises(ValueError, match=r"contact 'A2B1' overlaps by 0\.1 at the time 0"):
            load_run(path)


@pytest.mark.parametrize(
    ("attributes", "told"),
    [
        ({"polycorner_drum_run": 3}, r"has version 3 of polycorner .*reads up to version 2"),
        ({"polycorner_drum_run": "x"}, "is something else"),
        ({"count": -1}, "is damaged"),
        ({"seed": "x"}, "is damaged"),
        ({"noise_kicks": "{"}, "is damaged"),
    ],
)
def test_attributes_that_cannot_be_are_refused(run, tmp_path, attributes, told):
    path = written(dataset(run).assign_attrs(attributes), tmp_path / "run.nc")
    with pytest.raises(ValueError, match=rf"^path: expected a run that save_run wrote.*{told}"):
        load_run(path)


def test_a_missing_file_is_not_found(tmp_path):
    with pytest.raises(FileNotFoundError):
        load_run(tmp_path / "none.nc")
