"""Scenes for several engines: masses, overlaps and energies, and a run without other engines."""

import bench_scenes
import numpy as np
import pytest
import scenes
from hypothesis import given
from hypothesis import strategies as st
from scene_engines import ENGINES, Moved, our_body
from scenes import DENSITY, SCENES
from scipy.optimize import linprog
from scipy.spatial.transform import Rotation

from polycorner.bodies import mass_of

SHAPES = {
    "disc": scenes.disc(0.3),
    "rectangle": scenes.rectangle(0.3, 0.2),
    "rod": scenes.rod(0.3, 0.1),
    "sphere": scenes.sphere(0.3),
    "cube": scenes.cube(0.3),
}


@pytest.mark.parametrize("name", SHAPES)
def test_masses_are_those_of_the_bodies(name):
    shape = SHAPES[name]
    mass = mass_of(our_body(shape), DENSITY)
    assert shape.mass == pytest.approx(mass.mass, rel=1e-9)
    assert np.diag(np.atleast_2d(mass.inertia)) == pytest.approx(shape.inertia, rel=1e-9)


def common_point(p, q):
    """Whether two hulls have a point in common, by linear programming."""
    n, m = len(p), len(q)
    rows = np.vstack([np.hstack([p.T, -q.T]), np.eye(2, n + m)])
    rows[-2:] = [[1] * n + [0] * m, [0] * n + [1] * m]
    return linprog(np.zeros(n + m), A_eq=rows, b_eq=[*[0] * p.shape[1], 1, 1]).status == 0


@pytest.mark.parametrize("pair", [("rectangle", "rectangle"), ("rod", "rectangle"), ("cube",) * 2])
@given(seed=st.integers(0, 10_000))
def test_hulls_cross_if_no_plane_separates_them(pair, seed):
    rng = np.random.default_rng(seed)
    one, two = (SHAPES[name] for name in pair)
    d = one.points.shape[1]
    places = 0.3 * rng.normal(size=(2, d))
    turns = (
        Rotation.random(2, rng).as_quat(scalar_first=True) if d == 3 else rng.normal(size=(2, 1))
    )
    p, q = (
        scenes.placed_points(body, np.concatenate(x))
        for body, *x in zip((one, two), places, turns, strict=True)
    )
    gap = scenes.separation(p, q)
    if abs(gap) > 1e-6:
        assert common_point(p, q) == (gap < 0)


@pytest.mark.parametrize("name", SCENES)
def test_scenes_start_without_an_overlap(name):
    scene = SCENES[name]()
    assert len(scene.start) == len(scene.bodies) == sum(scene.counts.values())
    assert scene.overlap(scene.start) == 0


def test_an_overlap_is_in_sizes_of_the_smallest_body():
    scene = SCENES["10 discs"]()
    q = scene.start.copy()
    q[0, 1] = 0.09  # a disc of 0.1 on the floor
    assert scene.overlap(q) == pytest.approx(0.1)


def test_energy_that_grows_is_told():
    scene = SCENES["10 boxes"]()
    rest, q = np.zeros_like(scene.start), [scene.start] * 3
    up = np.add(scene.start, [0, scene.bodies[0].size, 0])
    assert bench_scenes.growth(scene, Moved([*q, up], [rest] * 4)) == pytest.approx(1)
    assert bench_scenes.growth(scene, Moved([up, *q], [rest] * 4)) == 0


def test_our_energy_is_that_of_the_trajectory():
    scene = SCENES["10 spheres in space"]()
    ours = ENGINES["polycorner"](scene, 2e-3)
    path = ours.move(300, 3)
    found = [scene.energy(q, v) for q, v in zip(path.q, path.v, strict=True)]
    assert found[0] == pytest.approx(ours.path.kinetic[0] + ours.path.potential[0])
    assert found[-1] == pytest.approx(ours.path.kinetic[-1] + ours.path.potential[-1])
    assert len(found) == 4


def test_the_program_says_what_is_missing(monkeypatch, capsys):
    kept = {}
    monkeypatch.setattr(bench_scenes, "write", lambda _, figures: kept.update(figures))
    for name in ("mujoco", "pymunk"):
        monkeypatch.setitem(bench_scenes.sys.modules, name, None)
    bench_scenes.main(["--scenes", "10 discs", "--rounds", "1", "--dt", "0.01", "--finer"])
    said = capsys.readouterr().out
    assert "MuJoCo: not taken: ModuleNotFoundError" in said
    assert "Pymunk: not taken: ModuleNotFoundError" in said
    (row,) = kept["scenes"]["10 discs"].values()
    assert row["overlap"] < 1e-2
    assert row["energy"] < 1e-6
    assert row["off"] == row["from ours"]
