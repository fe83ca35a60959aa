"""An atlas in a file: whole, readable, and gone on with."""

import json

import numpy as np
import pytest

from polycorner import AllOf, Completeness, Manifold, Polyhedron, skeleton
from polycorner.models import SphereCluster
from polycorner.polyhedra.skeleton import resume
from polycorner.studies.files import load_atlas, save_atlas

M = Manifold.euclidean("x y")
X, Y = M.symbols
RING = Polyhedron(M, {"out": 9 - X**2 - Y**2, "in": X**2 + Y**2 - 1, "cut": X + 2 - Y})
MODEL = SphereCluster(6)


def same(one, other):
    assert one.complete is other.complete
    assert one.components == other.components
    assert one.notes == other.notes
    for left, right in zip(one.corners, other.corners, strict=True):
        np.testing.assert_array_equal(left.point, right.point)
        assert (left.stratum, left.edges) == (right.stratum, right.edges)
    for left, right in zip(one.edges, other.edges, strict=True):
        np.testing.assert_array_equal(left.polyline, right.polyline)
        assert (left.active, left.ends, left.kinds) == (right.active, right.ends, right.kinds)
    assert one.faces == other.faces


@pytest.mark.parametrize("budget", [1, 2, 100])
def test_a_loaded_atlas_goes_on_as_the_saved_one(tmp_path, budget):
    starts = [[0.0, 1.5], [2.5, 0.0]]
    path = save_atlas(skeleton(RING, starts, budget=budget), tmp_path / "deep" / "ring.json")
    same(load_atlas(path, RING), skeleton(RING, starts, budget=budget))
    same(resume(load_atlas(path, RING)), skeleton(RING, starts))
    assert [entry.name for entry in path.parent.iterdir()] == ["ring.json"]


def test_relabellings_survive(tmp_path):
    part = skeleton(MODEL.polyhedron, MODEL.starts(), symmetry=MODEL.symmetry, budget=2)
    assert part.complete is Completeness.BUDGET
    path = save_atlas(part, tmp_path / "spheres.json")
    whole = resume(load_atlas(path, MODEL.polyhedron, symmetry=MODEL.symmetry))
    same(whole, skeleton(MODEL.polyhedron, MODEL.starts(), symmetry=MODEL.symmetry))


def test_other_files_are_refused(tmp_path):
    (tmp_path / "text").write_text("not JSON")
    (tmp_path / "other").write_text(json.dumps({"corners": []}))
    ring = save_atlas(skeleton(RING, [[0.0, 1.5]]), tmp_path / "ring")
    disc = Polyhedron(M, AllOf(1 - X**2 - Y**2))
    for path, polyhedron in ((tmp_path / "text", RING), (tmp_path / "other", RING), (ring, disc)):
        with pytest.raises(ValueError, match=r"^path: expected an atlas"):
            load_atlas(path, polyhedron)
