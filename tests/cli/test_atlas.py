"""The command ``polycorner atlas``: answers, tables, files, and a line for every mistake."""

import json
import math
from itertools import pairwise

import numpy as np
import pytest
from atlas_commands import answer, fits_together, run, same_atlas

from polycorner import skeleton
from polycorner.models.pinball import Pinball
from polycorner.models.planar import Tutorial
from polycorner.models.spheres import SphereCluster

SEARCHES = ("dyad", "spheres", "tutorial", "pinball")
MODELS = (*SEARCHES, "disks")
# Rigid clusters, motions with one and with two degrees of freedom: [HC] table I, [HGB] table I.
KNOWN = {5: (1, 2, 4), 6: (2, 5, 13), 7: (5, 16, 51)}


pytestmark = pytest.mark.usefixtures("own_searches")


@pytest.mark.parametrize("count", KNOWN)
def test_clusters_are_as_many_as_are_known(count):
    found = answer("spheres", "--count", str(count))
    numbers = (found["corners_count"], found["edges_count"], found["faces_count"])
    assert numbers == KNOWN[count]
    assert numbers == tuple(len(found[key]) for key in ("corners", "edges", "faces"))
    assert found["singular_count"] == 0
    assert found["complete"] == "exhausted"
    for corner in found["corners"]:
        centres = np.reshape(corner["point"], (-1, 3))
        i, j = np.triu_indices(count, 1)
        apart = np.linalg.norm(centres[i] - centres[j], axis=1)
        assert apart.min() > 1 - 1e-9
        assert sum(apart < 1 + 1e-6) == len(corner["active"]) == 3 * count - 6
        assert corner["rank"] == 3 * count - 6
    model = SphereCluster(count)
    same_atlas(found, skeleton(model.polyhedron, model.starts(), symmetry=model.symmetry))


def test_tutorial_is_a_disc_with_the_corners_it_was_built_from():
    found, region = answer("tutorial"), Tutorial()
    assert found["euler_characteristic"] == 1
    assert found["components"] == {"0": 7, "1": 7, "2": 1}
    for letter, point in region.corners().items():
        (corner,) = (c for c in found["corners"] if all(letter in name for name in c["active"]))
        np.testing.assert_allclose(corner["point"], point, atol=1e-9)
    sides = region.sides(2000)
    for edge in found["edges"]:
        (name,) = edge["active"]
        length = sum(math.dist(p, q) for p, q in pairwise(sides[name]))
        assert edge["length"] == pytest.approx(length, rel=1e-2)
    fits_together(found)


def test_pinball_has_as_many_holes_as_islands():
    """Islands are counted on a grid; corners are where walls are known to meet."""
    from scipy.ndimage import label

    board = Pinball()
    found = answer("pinball")
    x, y = np.meshgrid(
        np.linspace(-0.1, board.width + 0.1, 500), np.linspace(-0.1, board.height + 0.1, 665)
    )
    solid = ~board.polyhedron.contains(np.stack([x, y], axis=-1))
    _, solids = label(solid, structure=np.ones((3, 3)))
    assert found["euler_characteristic"] == 1 - (solids - 1)  # one solid is the world outside
    assert found["components"]["2"] == 1
    known = sorted(map(tuple, np.round(board.corners(), 6)))
    assert sorted(tuple(np.round(c["point"], 6)) for c in found["corners"]) == known
    closed = [edge for edge in found["edges"] if edge["ends"] == [None, None]]
    assert {edge["kinds"][0] for edge in closed} == {"closed"}
    assert len(found["edges"]) == len(found["corners"]) + len(closed)
    fits_together(found)


# Radius and index of every critical configuration, and radii in closed form: [EM] data for n = 2.
DISKS = {
    ("--count", "2"): [(math.sqrt(2) / 4, 0), (1 / 4, 1)],
    ("--count", "2", "--torus", "hexagonal"): [(1 / math.sqrt(12), 0), (1 / 4, 1)],
}


@pytest.mark.parametrize("arguments", DISKS, ids=" ".join)
def test_disks_have_the_known_radii(arguments):
    found = answer("disks", *arguments)
    for row, (radius, index) in zip(found["critical"], DISKS[arguments], strict=True):
        assert row["radius"] == pytest.approx(radius, abs=1e-9)
        assert row["index"] == index
        assert row["hits"] > 0


@pytest.mark.parametrize("arguments", [("tutorial",), ("dyad", "--plane"), ("spheres",)])
def test_the_seed_changes_nothing_but_the_order(arguments):
    one, other = (answer(*arguments, "--seed", seed) for seed in ("0", "5"))
    for key in ("components", "euler_characteristic", "complete"):
        assert one[key] == other[key]
    for key in ("corners", "edges"):
        assert len(one[key]) == len(other[key])
    if arguments != ("spheres",):  # where names depend on the copy that was met first
        active = [sorted(sorted(c["active"]) for c in found["corners"]) for found in (one, other)]
        assert active[0] == active[1]


def test_the_table_says_what_the_json_says():
    _, table, err = run("spheres", "--count", "6")
    assert err == ""
    assert "2 rigid clusters (0 singular), 5 one-dimensional motions" in table
    assert "complete: exhausted" in table
    _, table, _ = run("tutorial")
    for k, corner in enumerate(answer("tutorial")["corners"]):
        (row,) = (line for line in table.splitlines() if line.split()[:1] == [f"C{k}"])
        assert " ".join(corner["active"]) in row
        assert corner["local_type"] in row


FILES = {
    ("tutorial",): {"tutorial.png"},
    ("spheres", "--count", "5"): {"clusters.png"},
    ("disks", "--count", "2"): {"critical.png"},
    ("dyad", "--plane"): {"atlas.png", "motions.png", "solid.png", "solid.glb", "solid.json"},
}


@pytest.mark.parametrize(
    "arguments",
    FILES,
    ids=" ".join,
)
def test_files_are_written(tmp_path, arguments):
    folder = tmp_path / "new" / "folder"
    code, out, err = run(*arguments, "--out", str(folder))
    assert (code, err) == (0, "")
    written = {path.name: path for path in folder.iterdir()}
    assert set(written) == FILES[arguments] | {"atlas.json"}
    assert all(str(path) in out.replace("\n", "") for path in written.values())
    assert json.loads(written["atlas.json"].read_text()) == answer(*arguments)
    for name, path in written.items():
        if name.endswith(".png"):
            assert path.read_bytes().startswith(b"\x89PNG")


# ----------------------------------------------------------------------------------- help, mistakes


@pytest.mark.parametrize("arguments", [(), ("--help",), *((model, "--help") for model in MODELS)])
def test_help_is_an_answer(arguments):
    code, out, err = run(*arguments)
    assert (code, err) == (0, "")
    assert out.startswith("Usage: polycorner atlas")
    for option in ("--json", "--out", "--seed") if len(arguments) == 2 else MODELS:
        assert option in out
