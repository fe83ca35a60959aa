"""An atlas in a file: whole, readable, checked, and gone on with."""

import json
import math

import numpy as np
import pytest
from kept_files import rewritten
from kept_files import same_atlas as same

from polycorner import AllOf, Manifold, Polyhedron, Symmetry, skeleton
from polycorner.dumbbells import DumbbellPair
from polycorner.files import load_skeleton, save_skeleton
from polycorner.files.skeletons import KIND
from polycorner.models import SphereCluster
from polycorner.polyhedra import WalkOptions
from polycorner.skeletons import Completeness
from polycorner.skeletons.search import resume
from polycorner.tolerances import Tolerances

M = Manifold.euclidean("x y")
X, Y = M.symbols
PARTS = {"out": 9 - X**2 - Y**2, "in": X**2 + Y**2 - 1, "cut": X + 2 - Y}
RING = Polyhedron(M, PARTS)
MODEL = SphereCluster(6)


@pytest.mark.parametrize("budget", [1, 2, 100])
def test_a_loaded_atlas_goes_on_as_the_saved_one(tmp_path, budget):
    starts = [[0.0, 1.5], [2.5, 0.0]]
    path = save_skeleton(skeleton(RING, starts, budget=budget), tmp_path / "deep" / "ring.json")
    same(load_skeleton(path, RING), skeleton(RING, starts, budget=budget))
    same(resume(load_skeleton(path, RING)), skeleton(RING, starts))
    assert [entry.name for entry in path.parent.iterdir()] == ["ring.json"]


def test_tolerances_are_kept_and_those_of_older_files_are_the_defaults(tmp_path):
    chosen = {"tolerance": 3e-7, "rank_tolerance": 2e-5}
    path = save_skeleton(skeleton(RING, [[0.0, 1.5]], **chosen), tmp_path / "ring.json")
    assert load_skeleton(path).state.quotient.tolerances == Tolerances.of(**chosen)
    rewritten(KIND, path, lambda entries: entries.pop("rank tolerance"))
    assert load_skeleton(path).state.quotient.tolerances == Tolerances.of(3e-7)


def test_options_are_kept_and_those_of_older_files_are_the_defaults(tmp_path):
    careful = WalkOptions.careful()
    path = save_skeleton(skeleton(RING, [[0.0, 1.5]], options=careful), tmp_path / "ring.json")
    assert load_skeleton(path).state.quotient.options == careful
    rewritten(KIND, path, lambda entries: entries.pop("options"))
    assert load_skeleton(path).state.quotient.options == WalkOptions()


def test_relabellings_survive(tmp_path):
    part = skeleton(MODEL.polyhedron, MODEL.starts(), symmetry=MODEL.symmetry, budget=2)
    assert part.complete is Completeness.BUDGET
    path = save_skeleton(part, tmp_path / "spheres.json")
    whole = resume(load_skeleton(path, MODEL.polyhedron, symmetry=MODEL.symmetry))
    same(whole, skeleton(MODEL.polyhedron, MODEL.starts(), symmetry=MODEL.symmetry))


@pytest.mark.parametrize("kind", ["MT19937", "PCG64", "PCG64DXSM", "Philox", "SFC64"])
def test_every_random_generator_goes_on(tmp_path, kind):
    rng = np.random.Generator(getattr(np.random, kind)(7))
    atlas = skeleton(RING, [[0.0, 1.5], [2.5, 0.0]], budget=1, rng=rng)
    read = load_skeleton(save_skeleton(atlas, tmp_path / "ring.json"), RING)
    wanted = atlas.state.rng.integers(2**63, size=9)
    np.testing.assert_array_equal(read.state.rng.integers(2**63, size=9), wanted)


@pytest.mark.parametrize(
    ("polyhedron", "starts"),
    [
        (Polyhedron(M, {"out": 9 - X**2 - Y**2}), [[0.0, 1.5]]),
        (Polyhedron(M, {"cusp": X**3 - Y**2, "cap": 4 - X}), [[1.0, 0.0]]),
        (Polyhedron(M, {"half": Y}), [[0.0, 1.0]]),
        (Polyhedron(M, {"half": Y}), [[0.0, -1.0]]),
    ],
)
def test_closed_singular_and_open_edges_survive_and_no_edges_at_all(tmp_path, polyhedron, starts):
    atlas = skeleton(polyhedron, starts)
    same(load_skeleton(save_skeleton(atlas, tmp_path / "a.json"), polyhedron), atlas)


def test_an_endless_extent_survives(tmp_path):
    atlas = skeleton(RING, [[0.0, 1.5]], extent=math.inf)
    read = load_skeleton(save_skeleton(atlas, tmp_path / "ring.json"), RING)
    assert read.state.quotient.extent == math.inf


def test_units_are_those_of_the_manifold(tmp_path):
    pair = DumbbellPair(16, 3, 1.5)
    atlas = skeleton(pair.polyhedron, [pair.nested("R")], symmetry=pair.symmetry, budget=1)
    path = save_skeleton(atlas, tmp_path / "pair.json")
    written = json.loads(path.read_text())
    units = {c["name"]: c["unit"] for c in written["polyhedron"]["coordinates"]}
    assert units == {name: "rad" if "theta" in name else "mm" for name in pair.manifold.names}
    assert written["symmetry"] == {"motions": 3, "elements": 0, "relabels": False}
    with pytest.raises(ValueError, match=r"^polyhedron: expected that of .* annotations chirality"):
        load_skeleton(path, symmetry=pair.symmetry)
    same(load_skeleton(path, pair.polyhedron, symmetry=pair.symmetry), atlas)


def test_ones_own_polyhedron_need_not_be_passed(ring):
    same(load_skeleton(ring), skeleton(RING, [[0.0, 1.5]]))
    same(resume(load_skeleton(ring)), skeleton(RING, [[0.0, 1.5]]))


# ------------------------------------------------------------------------------------- other files


def test_other_files_are_refused(tmp_path):
    (tmp_path / "text").write_text("not JSON")
    (tmp_path / "other").write_text(json.dumps({"corners": []}))
    ring = save_skeleton(skeleton(RING, [[0.0, 1.5]]), tmp_path / "ring")
    disc = Polyhedron(M, AllOf(1 - X**2 - Y**2))
    for path, polyhedron in ((tmp_path / "text", RING), (tmp_path / "other", RING), (ring, disc)):
        with pytest.raises(ValueError, match=r"^path: expected a skeleton"):
            load_skeleton(path, polyhedron)
    with pytest.raises(ValueError, match=r"^path: expected a skeleton called 'this'; .* called ''"):
        load_skeleton(ring, RING, label="this")
    with pytest.raises(TypeError, match=r"^skeleton: expected a Skeleton"):
        save_skeleton("ring", ring)
    with pytest.raises(FileNotFoundError):
        load_skeleton(tmp_path / "none", RING)


@pytest.fixture
def ring(tmp_path):
    return save_skeleton(skeleton(RING, [[0.0, 1.5]]), tmp_path / "ring.json")


@pytest.mark.parametrize(
    ("parts", "told"),
    [
        (PARTS | {"out": 9.001 - X**2 - Y**2}, "'out' at corner 0: written "),
        (PARTS | {"in": X**2 + Y**2 - 1 - 1e-7}, "'in' at corner 0: written "),
    ],
)
def test_another_polyhedron_with_the_same_names_is_refused(ring, parts, told):
    with pytest.raises(ValueError, match=rf"is of another polyhedron or symmetry: {told}"):
        load_skeleton(ring, Polyhedron(M, parts))


def test_another_space_or_symmetry_is_refused(ring, tmp_path):
    wide = Manifold(("x", "y"), (), (1.0, 2.0))
    x, y = wide.symbols
    parts = {"out": 9 - x**2 - y**2, "in": x**2 + y**2 - 1, "cut": x + 2 - y}
    with pytest.raises(ValueError, match=r"scales of the coordinates: written 1, 1, found 1, 2"):
        load_skeleton(ring, Polyhedron(wide, parts))
    with pytest.raises(ValueError, match=r"equations: written none, found flat"):
        load_skeleton(ring, Polyhedron(M, PARTS, {"flat": Y}))
    part = skeleton(MODEL.polyhedron, MODEL.starts(), symmetry=MODEL.symmetry, budget=1)
    path = save_skeleton(part, tmp_path / "spheres.json")
    for symmetry in (None, Symmetry(tangents=MODEL.symmetry.tangents)):
        with pytest.raises(ValueError, match=r"symmetry: written motions 6, elements 0"):
            load_skeleton(path, MODEL.polyhedron, symmetry=symmetry)


def moved(entries):
    entries["corners"][0]["point"][0] += 1e-4


def valued(entries):
    entries["corners"][1]["values"][1] += 1e-6


def flat(entries):
    entries["edges"][0]["points"] = [1.0, 2.0]


def wild(entries):
    entries["random"]["bit_generator"] = "Generator"


def unfinished(entries):
    del entries["notes"]


def odd(entries):
    entries["complete"] = "NEARLY"


def code(entries):
    entries["polyhedron"]["families"][0]["formulas"]["in"] = "open('file')"


def at(*path):
    """Return what puts a value at a place of nested entries."""

    def put(entries, value):
        for key in path[:-1]:
            entries = entries[key]
        entries[path[-1]] = value

    return put


FAR = [1e30, 1e30]
FORGED = [
    *[(at("tolerance"), x) for x in (-1, 0, 1e12, "nan", 10**400)],
    *[(at("rank tolerance"), x) for x in (-1, 0, 1, "nan")],
    *[(at("options", "turn"), x) for x in (-1, 0, 2, "nan")],
    *[(at("options", "radii"), x) for x in ([], [1e-3, 1e-2], [0.0], 1.0)],
    *[(at("extent"), x) for x in (-1, 0, "nan", 0.1)],
    *[(at("corners", 0, "point"), x) for x in (FAR, [1e300, 0.0], [1.0], 10**400)],
    *[(at("corners", 0, "active"), x) for x in ([], ["in"], ["nobody"], 7)],
    *[(at("corners", 0, "edges", 0), x) for x in ([99, 0], [-1, 0], [0, 99], [0, -1], [0, 10**12])],
    *[(at("edges", 0, "points", 1), x) for x in (FAR, [0.0, 0.0], ["nan", 0.0], [1])],
    *[(at("edges", 0, "start"), x) for x in ([-1, 0], [99, 0], [0, 99], [0, -1], None, [1, 0])],
    *[(at("edges", 0, "stop"), x) for x in ([-1, 0], [0, 10**12], [0, 0, 0], "12")],
    *[(at("edges", 0, "active"), x) for x in ([], [-1], [99], [0, 10**12])],
    *[(at("edges", 0, "kinds"), x) for x in (["CORNER"], ["CLOSED", "CORNER"], [1, 2])],
    *[(at("edges", 0, "relabelled"), x) for x in ({"in": "nobody"}, {"nobody": "in"}, [])],
    *[(at("pending"), x) for x in ([[0, 99]], [[99, 0]], [[-1, 0]], [[0, -2]], [0], [[0, 0]])],
    *[(at("starts"), x) for x in ([[0, FAR]], [[-2, [0.0, 1.5]]], [[0, [1.0]]], [[0.5, [1, 1]]])],
    *[(at("tried"), [[*x, ["in"]]]) for x in (["half", [0, 99]], ["curve", 99], ["apex", [0, 99]])],
    *[(at("crossings"), [[["curve", -1, []]] * 2]), (at("links"), [[["corner", 99]]])],
    *[(at("patches"), [[[99], [0.0, 1.5]]]), (at("least"), {"nobody": 1.0})],
    *[(at("sought"), [-1, 0]), (at("lost"), 2), (at("notes"), [1]), (at("label"), 1)],
    *[(at("random", "state", "state"), x) for x in (-1, 2**128, 0.5)],
    (at("polyhedron", "functions", 0, "family"), -1),
    (at("polyhedron", "tree", "all", 0), -1),
    (at("polyhedron", "coordinates", 0, "scale"), -1),
]


@pytest.mark.parametrize("k", range(len(FORGED)))
def test_a_forged_number_is_refused(ring, k):
    """Whatever becomes an index, a size or a state, though the digest fits."""
    put, value = FORGED[k]
    rewritten(KIND, ring, lambda entries: put(entries, value))
    with pytest.raises(
        ValueError, match=r"^path: expected a skeleton that save_skeleton wrote; "
    ) as e:
        load_skeleton(ring)
    assert f"{ring} is " in str(e.value)


@pytest.mark.parametrize("change", [moved, valued, flat, wild, unfinished, odd, code])
def test_entries_that_someone_changed_are_refused(ring, change):
    rewritten(KIND, ring, change)
    told = r"^path: expected a skeleton that save_skeleton wrote; .* is "
    with pytest.raises(ValueError, match=told):
        load_skeleton(ring)
