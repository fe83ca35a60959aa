"""Runs in the drum in files."""

import pytest
import xarray as xr
from kept_files import motion
from kept_files import same_run as same

from polycorner.dumbbells import DumbbellDrum
from polycorner.dumbbells.dynamics.files import KIND, dataset, load_run, save_run
from polycorner.dumbbells.dynamics.runs import DrumRun
from polycorner.files.motions import save_dataset
from polycorner.motion.noise import Noise

DRUM = DumbbellDrum(floor=True, top=60.0, tilt=0.5, spin=0.02)
NOISE = Noise(chatter=0.3, kicks={"phi": 1e-3}, seed=7)
RUN = DrumRun(DRUM, NOISE, motion(DRUM.bodies, 1, 4, "floor1"), 0.4, 20, 50.0)


def test_a_run_names_its_drum_and_its_noise(tmp_path):
    path = save_run(RUN, tmp_path / "deep" / "run.nc")
    same(load_run(path), RUN)
    with xr.open_dataset(path, engine="h5netcdf") as data:
        units = {name: data[name].attrs["units"] for name in ("phi", "eta", "theta_dot", "time")}
        assert (data.attrs["tilt"], data.attrs["tilt_units"]) == (0.5, "rad")
    assert units == {"phi": "rad", "eta": "mm", "theta_dot": "rad/s", "time": "s"}
    assert [entry.name for entry in path.parent.iterdir()] == ["run.nc"]


@pytest.mark.parametrize("attributes", [{"count": -1}, {"seed": "x"}, {"noise_kicks": "{"}])
def test_attributes_that_cannot_be_are_refused(tmp_path, attributes):
    path = save_dataset(KIND, tmp_path / "run.nc", dataset(RUN).assign_attrs(attributes))
    with pytest.raises(ValueError, match=r"^path: expected a run that save_run wrote.*is damaged"):
        load_run(path)


def test_a_missing_file_is_not_found(tmp_path):
    with pytest.raises(FileNotFoundError):
        load_run(tmp_path / "none.nc")
