"""Runs in the drum in files."""

from dataclasses import replace

import pytest
import xarray as xr
from kept_files import motion
from kept_files import same_motion as same

from polycorner.dumbbells import DumbbellDrum, OutOfRound, Shaking, UnevenFriction, Wobble
from polycorner.dumbbells.dynamics.files import KIND, dataset, load_run, save_run
from polycorner.files.motions import save_dataset
from polycorner.models.textbook import bouncing_ball
from polycorner.motion.noise import Noise

DRUM = DumbbellDrum(floor=True, top=60.0, tilt=0.5, spin=0.02)
NOISE = Noise(chatter=0.3, kicks={"phi": 1e-3}, kick_time=0.02, seed=7)
RUN = replace(motion(DRUM, 1, 4, "floor1"), noise=NOISE, every=20, t_end=0.8)


def test_a_run_names_its_drum_and_its_noise(tmp_path):
    path = save_run(RUN, tmp_path / "deep" / "run.nc")
    read = load_run(path)
    same(read, RUN)
    assert read.system == DRUM
    assert read.finished == RUN.finished
    with xr.open_dataset(path, engine="h5netcdf") as data:
        units = {name: data[name].attrs["units"] for name in ("phi", "eta", "theta_dot", "time")}
        assert (data.attrs["tilt"], data.attrs["tilt_units"]) == (0.5, "rad")
    assert units == {"phi": "rad", "eta": "mm", "theta_dot": "rad/s", "time": "s"}
    assert [entry.name for entry in path.parent.iterdir()] == ["run.nc"]


def test_a_run_keeps_the_imperfections_of_its_drum(tmp_path):
    drum = replace(
        DRUM,
        shaking=Shaking((1 / 3, 20.0, 5.0), (2.0, 30.1), seed=4),
        out_of_round=OutOfRound({1: 0.7, 3: -0.1}, {3: 0.1 + 0.2}),
        wobble=Wobble(0.01, 2.0),
        uneven_friction=UnevenFriction(0.3, 6.0, seed=1),
    )
    run = replace(RUN, system=drum)
    read = load_run(save_run(run, tmp_path / "run.nc"))
    same(read, run)
    assert read.system == drum
    content = dataset(run)
    del content.attrs["noise_kick_time"]  # as in a file of an earlier version
    for name in ("shaking", "out_of_round", "wobble", "uneven_friction"):
        del content.attrs[name]
    old = load_run(save_dataset(KIND, tmp_path / "old.nc", content))
    assert old.system == DRUM
    assert old.noise == replace(NOISE, kick_time=0.0)


@pytest.mark.parametrize(
    "attributes", [{"count": -1}, {"seed": "x"}, {"noise_kicks": "{"}, {"wobble": "{}"}]
)
def test_attributes_that_cannot_be_are_refused(tmp_path, attributes):
    path = save_dataset(KIND, tmp_path / "run.nc", dataset(RUN).assign_attrs(attributes))
    with pytest.raises(ValueError, match=r"^path: expected a run that save_run wrote.*is damaged"):
        load_run(path)


def test_a_missing_file_is_not_found(tmp_path):
    with pytest.raises(FileNotFoundError):
        load_run(tmp_path / "none.nc")


def test_the_trajectory_of_another_system_is_refused(tmp_path):
    path = motion(bouncing_ball(), 1, 1, "floor")
    with pytest.raises(TypeError, match=r"^trajectory: expected one of dumbbells in a drum"):
        save_run(path, tmp_path / "run.nc")
