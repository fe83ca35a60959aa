"""Values of the library in studies: regions as fixed arguments and in closures, on any workers."""

import copy
import json
import subprocess
import sys

import elsewhere
import numpy as np
import pytest
import regions
import xarray as xr

from polycorner import Polyhedron, minimise
from polycorner.sweeps import Axis, Grid, SweepError, sweep
from polycorner.sweeps.study import canonical

GRID = {"slope": [0.5, 1.0, 2.0], "start": [-0.2, 0.2]}


def plain(found):
    return found.load().drop_vars("seconds").drop_attrs(deep=False)


def test_a_region_of_ones_own_as_argument_and_in_a_closure_on_processes(tmp_path):
    region, plane = regions.bowl(), regions.PLANE
    certificate = minimise(region, plane.symbols[1], [0.2, 2.0])

    def lowest(slope, start, region):
        x, y = plane.symbols
        found = minimise(region, y + slope * x, [start, 2.0])
        return {"point": found.point, "away": np.linalg.norm(found.point - certificate.point)}

    def closed(slope, start):
        return lowest(slope, start, region)

    def again(slope, start, found):
        shifted = minimise(found.problem.polyhedron, plane.symbols[1], [start, 2.0 + slope])
        return {"away": np.linalg.norm(shifted.point - found.point)}

    here = sweep(lowest, GRID, fixed={"region": region})
    assert (here["status"].values == 1).all()
    there = sweep(lowest, GRID, fixed={"region": region}, executor=2, store=tmp_path / "s")
    xr.testing.assert_identical(plain(here), plain(there))
    xr.testing.assert_identical(plain(here), plain(sweep(closed, GRID, executor=1)))
    told = sweep(again, GRID, fixed={"found": certificate}, executor=1)
    assert told["away"].max() < 1e-9


def test_a_store_knows_its_region_again_and_refuses_another(tmp_path):
    region, (x, y) = regions.bowl(), regions.PLANE.symbols

    def height(a, region):
        return {"inside": region.contains([0.0, a])}

    given = {"function": height, "grid": {"a": [-1.0, 1.0]}, "store": tmp_path / "s"}
    first = sweep(**given, fixed={"region": region})
    assert first["inside"].values.tolist() == [0, 1]
    minimise(region, y, [0.2, 2.0])  # what is computed from a region does not change it
    sweep(**given, fixed={"region": regions.bowl()})
    other = Polyhedron(regions.PLANE, {"bowl": y - x**2, "ramp": y - 2 + x})
    with pytest.raises(ValueError, match=r"store: expected fixed region .*Polyhedron.* of another"):
        sweep(**given, fixed={"region": other})


@pytest.mark.parametrize("seed", ["1", "2"])
def test_the_identity_of_a_region_is_the_same_in_every_process(seed):
    code = (
        "import regions; from polycorner.sweeps.study import canonical;"
        "print(canonical({'r': regions.bowl(), 'names': {'a', 'b', 'c'}}))"
    )
    path = f"{regions.FOLDER}:{regions.FOLDER.parents[1]}"
    there = subprocess.run(
        [sys.executable, "-c", code],
        env={"PYTHONPATH": path, "PYTHONHASHSEED": seed},
        capture_output=True,
        text=True,
        check=True,
    )
    here = canonical({"r": regions.bowl(), "names": {"a", "b", "c"}})
    assert json.loads(there.stdout) == json.loads(here)


def test_axes_grids_and_exceptions_travel():
    for value in (Axis([1, 2], "mm"), Grid.of({"a": [1.0, np.inf], "b": ["R", "L"]})):
        assert elsewhere.called(copy.deepcopy, value) == copy.deepcopy(value) == value
    error = elsewhere.called(copy.copy, SweepError("gone", results=3))
    assert (str(error), error.results) == ("gone", 3)
