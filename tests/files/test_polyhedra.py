"""Polyhedra as entries of a file: formulas, tree and units come back."""

import json
import math

import numpy as np
import pytest
import sympy
import xarray

from polycorner import AllOf, AnyOf, Manifold, Polyhedron, SmoothFunction, simulate
from polycorner.bodies import (
    Arrangement,
    Cylinder,
    HalfSpace,
    box,
    capsule,
    compound,
    disc,
    polygon,
    polytope,
    sphere,
)
from polycorner.bodies.motions import poses_of
from polycorner.dumbbells import DumbbellPair
from polycorner.files import load_trajectory, save_trajectory
from polycorner.files.polyhedra import (
    arrangement_entry,
    mismatch,
    polyhedron_entry,
    read_arrangement,
    read_polyhedron,
)
from polycorner.files.trajectories import saved_poses
from polycorner.models import Pinball, SphereCluster, TorusDisks, Tutorial

M = Manifold(("x", "turn"), (math.inf, math.tau), (2.0, 0.1), ("m", "rad"))
X, T = M.symbols
BALL = SmoothFunction("ball", X**2 + sympy.sin(T), M, unit="m^2")
OWN = Polyhedron(
    M,
    AllOf(AnyOf(BALL, AllOf(X - 0.1, 2 - X)), BALL, sympy.cos(T) / 3),
    {"flat": X * sympy.cos(2 * T)},
    annotations={},
)
PAIR = DumbbellPair(16, 3, 1.5, 125)
POLYHEDRA = [
    OWN,
    PAIR.polyhedron,
    PAIR.section(0.3),
    DumbbellPair(16, 3, 1.5).polyhedron,
    Pinball().polyhedron,
    SphereCluster(4).polyhedron,
    TorusDisks(2, "hexagonal").polyhedron,
    Tutorial().polyhedron,
]


@pytest.mark.parametrize("polyhedron", POLYHEDRA, ids=repr)
def test_a_polyhedron_is_made_again(polyhedron):
    entry = json.loads(json.dumps(polyhedron_entry(polyhedron), allow_nan=False))
    read, energy = read_polyhedron(entry)
    assert energy is None
    assert (read.names, read.equation_names) == (polyhedron.names, polyhedron.equation_names)
    assert read.manifold == polyhedron.manifold
    assert read.manifold.units == polyhedron.manifold.units
    assert [f.unit for f in read.functions] == [f.unit for f in polyhedron.functions]
    assert mismatch(entry, polyhedron) == mismatch(entry, read) == ""
    assert polyhedron_entry(read) == entry | {"annotations": []}
    for one, other in zip(polyhedron.functions, read.functions, strict=True):
        assert one.family.program().digest() == other.family.program().digest()


def test_its_values_and_its_tree_are_the_same():
    read, energy = read_polyhedron(polyhedron_entry(OWN, BALL))
    points = np.random.default_rng(0).normal(size=(50, 2))
    np.testing.assert_array_equal(read.values(points), OWN.values(points))
    np.testing.assert_array_equal(read.implicit(points), OWN.implicit(points))
    np.testing.assert_array_equal(read.equation_values(points), OWN.equation_values(points))
    np.testing.assert_array_equal(energy.hessian(points), BALL.hessian(points))


@pytest.mark.parametrize(
    ("manifold", "parts", "told"),
    [
        (("x", "s"), {"f": 0}, "names of the coordinates: written x, y, found x, s"),
        (("x", "y"), {"g": 0}, "functions: written f, found g"),
    ],
)
def test_the_first_mismatch_is_named(manifold, parts, told):
    plane = Manifold.euclidean("x y")
    entry = polyhedron_entry(Polyhedron(plane, {"f": plane.symbols[0]}))
    other = Manifold(manifold)
    polyhedron = Polyhedron(other, {name: other.symbols[k] for name, k in parts.items()})
    assert mismatch(entry, polyhedron) == told


# ------------------------------------------------------------------------------------- arrangements

CUBE = polytope([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], 0.1)
DUMBBELL = compound({"1": sphere(0.5, [-1, 0, 0]), "rod": capsule([-1, 0, 0], [1, 0, 0], 0.2)})
CASES = {
    "plane": Arrangement(
        {"S": polygon([[0, 0], [1, 0], [0, 1]]), "C": capsule([-1, 0], [1, 0], 0.3)},
        {"drum": Cylinder(5.0, waves={2: (0.1, 0.3)}), "floor": HalfSpace([0, 1], [0, -4])},
        {"peg": disc(0.5, [0, 3])},
        orientations="all",
        unit="mm",
        turning=0.5,
    ),
    "channel": Arrangement([disc(0.5)] * 2, {"f": HalfSpace([0, 1], [0, 0])}, period=[4, None]),
    "space": Arrangement({"Q": CUBE, "D": DUMBBELL}, {"t": Cylinder(5.0, [0, 0, 1], spin=0.3)}),
}


@pytest.mark.parametrize("name", CASES)
def test_an_arrangement_is_read_back(name):
    a = CASES[name]
    b = read_arrangement("arrangement", json.loads(json.dumps(arrangement_entry(a))))
    assert a.manifold.names == b.manifold.names
    assert a.manifold.scales == b.manifold.scales
    assert a.manifold.periods == b.manifold.periods
    q = np.random.default_rng(0).normal(0, 1, a.manifold.size)
    q = np.asarray(a.manifold.onto(q))
    np.testing.assert_allclose(a.polyhedron.values(q), b.polyhedron.values(q), rtol=1e-12)
    for body, again in zip(a.placed(q).values(), b.placed(q).values(), strict=True):
        assert body.same(again)


def broken():
    """Entries in which one thing is wrong, and what the message names."""
    for path, value in [
        (("bodies", "S", "", 0), float("nan")),
        (("bodies", "S", "", 1, 0, 0), "x"),
        (("bodies", "S", "", 1), []),
        (("bodies", "S", ""), [1.0]),
        (("bodies",), {}),
        (("walls", "drum", "radius"), -1.0),
        (("walls", "floor", "normal"), [0.0, 0.0]),
        (("orientations",), "some"),
        (("period",), [1.0]),
        (("turning",), [0.0, 0.0]),
    ]:
        entry = json.loads(json.dumps(arrangement_entry(CASES["plane"])))
        place = entry
        for key in path[:-1]:
            place = place[key]
        place[path[-1]] = value
        yield entry
    yield []
    yield None


def test_broken_entries_are_refused():
    """Readers of files turn all of these into one sentence (``FileKind.reading``)."""
    for entry in broken():
        with pytest.raises((ValueError, TypeError, KeyError)):
            read_arrangement("arrangement", entry)


def motion():
    a = Arrangement({"A": disc(0.5)}, box([0, 0], [4, 4]), orientations="all")
    system = a.system(count=2, gravity=[0, -10], friction=0.3)
    return a, system, simulate(system, system.state([[1, 1, 0], [3, 2, 0]]), 0.6, 0.01)


def test_a_saved_motion_knows_its_bodies(tmp_path):
    a, system, path = motion()
    file = save_trajectory(path, tmp_path / "a.nc", arrangement=a)
    poses, expected = saved_poses(file), poses_of(a, path)
    for name in ("times", "origins", "velocities", "turns", "present"):
        np.testing.assert_array_equal(getattr(poses, name), getattr(expected, name))
    for k in (0, len(path) - 1):
        np.testing.assert_array_equal(poses.marks(k), expected.marks(k))
    assert len(load_trajectory(file, system)) == len(path)


def test_motions_without_bodies_and_of_others_are_refused(tmp_path):
    path = motion()[2]
    file = save_trajectory(path, tmp_path / "a.nc")
    with pytest.raises(ValueError, match=r"has no bodies, as save_trajectory\(..., arrangement"):
        saved_poses(file)
    with pytest.raises(ValueError, match="arrangement: expected one of the coordinates xA, yA"):
        save_trajectory(path, tmp_path / "b.nc", arrangement=CASES["plane"])


def test_gaps_of_bodies_are_told_by_digests(tmp_path):
    """Their formulas, written out at once, are too long; those of a user's own are kept as text."""
    square = polygon([[-1, -1], [1, -1], [1, 1], [-1, 1]], 0.1)
    a = Arrangement({"S": square, "D": disc(0.5)}, box([-4, 0], [4, 8]), orientations="all")
    system = a.system()
    start = system.state(a.point({"S": ([-2, 2], 0.1), "D": ([2, 2], 0.0)}))
    file = save_trajectory(simulate(system, start, 0.02, 0.01), tmp_path / "a.nc", arrangement=a)
    with xarray.open_dataset(file, engine="h5netcdf") as data:
        told = json.loads(data.attrs["system"])["gaps"]
    assert max(len(entry[0]) for entry in told.values()) < 100
    assert len(load_trajectory(file, system)) == 3
    other = Arrangement({"S": square, "D": disc(0.6)}, box([-4, 0], [4, 8]), orientations="all")
    with pytest.raises(ValueError, match="is of another system"):
        load_trajectory(file, other.system())
