"""The command ``polycorner atlas``: what it prints, what it keeps, and how it is interrupted."""

import json
import math
import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections import Counter
from contextlib import redirect_stderr, redirect_stdout
from functools import cache
from io import StringIO
from itertools import pairwise

import numpy as np
import pytest
from oracles import CONTACTS, gaps

from polycorner import skeleton
from polycorner.cli.main import main
from polycorner.dumbbells import DumbbellPair
from polycorner.dumbbells.statics.skeleton import long_rod_length, pair_atlas
from polycorner.models.pinball import Pinball
from polycorner.models.spheres import SphereCluster
from polycorner.models.tutorial import Tutorial

SEARCHES = ("dyad", "spheres", "tutorial", "pinball")
MODELS = (*SEARCHES, "disks")
CORNER = {"name", "active", "rank", "dimension", "local_type", "chirality"}
ANSWER = {"components", "corners", "edges", "faces", "euler_characteristic", "complete"}
# Rigid clusters, motions with one and with two degrees of freedom: [HC] table I, [HGB] table I.
KNOWN = {5: (1, 2, 4), 6: (2, 5, 13), 7: (5, 16, 51)}


@pytest.fixture(scope="module", autouse=True)
def own_cache(tmp_path_factory):
    """Keep unfinished searches, and compiled kernels, away from the user's."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("POLYCORNER_CACHE_DIR", str(tmp_path_factory.mktemp("cache")))
        yield


def run(*arguments):
    """Run the command in this process; return its exit code, output and errors."""
    sys.argv = ["polycorner", "atlas", *arguments]
    out, err = StringIO(), StringIO()
    with redirect_stdout(out), redirect_stderr(err), pytest.raises(SystemExit) as stopped:
        main()
    return stopped.value.code, out.getvalue(), err.getvalue()


@cache
def answer(*arguments):
    """Return a whole answer; nothing but JSON is printed, and nothing else is said."""
    code, out, err = run(*arguments, "--json")
    assert (code, err) == (0, "")
    return json.loads(out)


def started(*arguments, **options):
    command = [sys.executable, "-m", "polycorner", "atlas", *arguments]
    return subprocess.Popen(command, stdout=subprocess.PIPE, text=True, **options)


def plain(shown):
    """Return what a terminal shows without colours and cursor movements."""
    return re.sub(r"\x1b\[[\d;?]*[A-Za-z]", "", bytes(shown).decode(errors="ignore"))


def on_terminal(*arguments, interrupt_at=None):
    """Run with errors on a terminal; return the exit code, what is printed and what is shown."""
    pty = pytest.importorskip("pty")
    terminal, end = pty.openpty()
    process = started(*arguments, stderr=end, env=os.environ | {"TERM": "xterm"})
    os.close(end)
    shown = bytearray()

    def read():
        try:
            while part := os.read(terminal, 1024):
                shown.extend(part)
        except OSError:  # the other end is closed
            pass

    reader = threading.Thread(target=read)
    reader.start()
    if interrupt_at is not None:
        while process.poll() is None and not re.search(interrupt_at, plain(shown)):
            time.sleep(0.01)
        process.send_signal(signal.SIGINT)
    out, _ = process.communicate(timeout=300)
    reader.join()
    os.close(terminal)
    return process.returncode, out, plain(shown)


def same_atlas(found, atlas):
    """Check that printed corners, edges and faces are those of an atlas."""
    assert [c["active"] for c in found["corners"]] == [list(c.active) for c in atlas.corners]
    for printed, corner in zip(found["corners"], atlas.corners, strict=True):
        np.testing.assert_allclose(printed["point"], corner.point, atol=1e-12)
        assert printed["local_type"] == corner.local_type.name.lower()
        assert printed["chirality"] == corner.chirality
    for printed, edge in zip(found["edges"], atlas.edges, strict=True):
        assert printed["ends"] == list(edge.ends)
        assert printed["active"] == list(edge.active)
        assert printed["length"] == pytest.approx(edge.length, rel=1e-12)
    for printed, face in zip(found["faces"], atlas.faces, strict=True):
        assert printed["active"] == list(face.active)
        assert printed["boundary"] == [list(curve) for curve in face.boundary]


def fits_together(found):
    """Check that what vanishes along an edge vanishes at its ends, and on a face along its edges.

    Only for models without relabelling, where names are the same everywhere.
    """
    for edge in found["edges"]:
        assert edge["length"] > 0
        for end in edge["ends"]:
            assert end is None or set(edge["active"]) < set(found["corners"][end]["active"])
    for face in found["faces"]:
        for edge in (found["edges"][k] for curve in face["boundary"] for k in curve):
            assert set(face["active"]) < set(edge["active"])


# ------------------------------------------------------------------------------------------ answers

PAIRS = {
    ("--plane",): (DumbbellPair(16, 3, 1.5), 0.0),
    ("--heading", "20", "--drum", "60", "--length", "20"): (DumbbellPair(20, 3, 1.5, 60), 20.0),
}


@pytest.mark.parametrize("arguments", PAIRS, ids=" ".join)
def test_pair_is_the_librarys(arguments):
    pair, heading = PAIRS[arguments]
    found = answer("dyad", *arguments)
    atlas = pair_atlas(pair, heading=math.radians(heading))
    assert set(found) >= ANSWER
    same_atlas(found, atlas.skeleton)
    for key, counts in (
        ("components", atlas.components),
        ("components_ordered", atlas.components_ordered),
        ("components_unordered", atlas.components_unordered),
    ):
        assert found[key] == {str(dimension): n for dimension, n in counts.items()}
        assert list(found[key]) == ["3", "4", "5", "6"]
    assert found["parameters"]["heading"] == heading
    assert found["parameters"]["length"] == pair.length


@pytest.mark.parametrize("arguments", PAIRS, ids=" ".join)
def test_pair_follows_from_its_own_points(arguments):
    """Gaps by minimisation and their differences say what is active, of which rank."""
    pair, heading = PAIRS[arguments]
    found = answer("dyad", *arguments)
    scales = np.array(pair.manifold.scales)
    for corner in found["corners"]:
        assert set(corner) >= CORNER
        q = np.array(corner["point"])
        apart = dict(zip(CONTACTS, gaps(pair, q), strict=True))
        assert {name for name, gap in apart.items() if gap < 1e-6} == set(corner["active"])
        assert min(apart.values()) > -1e-6
        steps = 1e-6 * np.diag(scales)
        slopes = (gaps(pair, q + steps) - gaps(pair, q - steps)) / 2e-6
        rows = [CONTACTS.index(name) for name in corner["active"]]
        assert np.linalg.matrix_rank(slopes[:, rows], tol=1e-3) == corner["rank"] == 3
        assert corner["dimension"] == 6 - corner["rank"]
        assert corner["chirality"] in ("R", "L")
        assert corner["name"].endswith(corner["chirality"])
        if not pair.is_plane:
            mean = (q[2] + q[5]) / 2 - math.radians(heading)
            assert math.sin(mean) == pytest.approx(0, abs=1e-9)
    fits_together(found)


def test_pair_counts():
    """Forbidden placements are a ring around the circle of headings: its surface is a torus.

    Relabelling changes neither the kind of a corner nor its hand, and joins all of one kind.
    """
    found = answer("dyad", "--plane")
    assert found["euler_characteristic"] == 0
    kinds = Counter(corner["name"] for corner in found["corners"])
    assert kinds == {"Delta_R": 4, "Delta_L": 4, "E_R": 4, "E_L": 4}
    assert found["components_unordered"]["3"] == len(kinds)
    assert found["components"]["3"] == kinds.total()
    leaving = Counter(end for edge in found["edges"] for end in edge["ends"])
    for k, corner in enumerate(found["corners"]):
        assert leaving[k] == len(corner["active"])
    assert 2 * found["components"]["4"] == leaving.total()
    assert found["components"]["6"] == found["components_unordered"]["6"] == 1


def test_short_rods_are_never_touched():
    length = long_rod_length(3, 1.5) - 0.5
    found = answer("dyad", "--plane", "--length", str(length))
    assert found["corners"]
    assert all(len(name) == 4 for corner in found["corners"] for name in corner["active"])


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
        (row,) = (line for line in table.splitlines() if line.split()[:1] == [str(k)])
        assert " ".join(corner["active"]) in row
        assert corner["local_type"] in row


FILES = {
    ("tutorial",): {"tutorial.png"},
    ("spheres", "--count", "5"): {"clusters.png"},
    ("disks", "--count", "2"): {"critical.png"},
    ("dyad", "--plane"): {"atlas.png", "motions.png", "solid.png", "solid.glb", "solid.json"},
}


@pytest.mark.parametrize("arguments", FILES, ids=" ".join)
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


# ----------------------------------------------------------------------------- searches that go on


@pytest.mark.parametrize(
    ("arguments", "budget"),
    [
        (("tutorial",), 3),
        (("spheres", "--count", "6"), 2),
        (("dyad", "--plane"), 15),
        (("dyad", "--heading", "20", "--drum", "60", "--length", "20"), 20),
    ],
    ids=str,
)
def test_parts_add_up_to_the_whole(arguments, budget):
    whole = answer(*arguments)
    code, out, err = run(*arguments, "--budget", str(budget), "--json")
    part, edges = json.loads(out), 0
    while part["complete"] != "exhausted":
        edges += budget
        assert (code, part["complete"], len(part["edges"])) == (0, "budget", edges)
        assert re.fullmatch(r"polycorner: unfinished, kept in \S+; --resume goes on\n", err)
        code, out, err = run(*arguments, "--budget", str(budget), "--resume", "--json")
        part = json.loads(out)
    assert edges
    assert part == whole
    code, out, err = run(*arguments, "--resume")
    assert (code, out) == (2, "")
    assert err.startswith("polycorner: --resume: expected an unfinished search")


def test_a_folder_keeps_its_own_search(tmp_path):
    code, _, err = run("spheres", "--budget", "2", "--out", str(tmp_path))
    assert code == 0
    assert str(tmp_path) in err
    assert json.loads((tmp_path / "atlas.json").read_text())["complete"] == "budget"
    code, _, err = run("spheres", "--resume")
    assert (code, "--resume" in err) == (2, True)
    code, _, err = run("spheres", "--resume", "--out", str(tmp_path))
    assert (code, err) == (0, "")
    assert json.loads((tmp_path / "atlas.json").read_text()) == answer("spheres")
    assert {path.name for path in tmp_path.iterdir()} == {"atlas.json", "clusters.png"}


OTHERS = {
    ("spheres", "--count", "5"): ("spheres", "--count", "6"),
    ("dyad", "--plane"): ("dyad", "--plane", "--length", "20"),
    ("tutorial",): ("pinball",),
    ("tutorial", "--seed", "0"): ("tutorial", "--seed", "1"),
}


@pytest.mark.parametrize("folder", [False, True], ids=["cache", "folder"])
@pytest.mark.parametrize("one", OTHERS, ids=" ".join)
def test_only_the_same_search_goes_on(tmp_path, one, folder):
    where = ("--out", str(tmp_path)) if folder else ()
    code, _, err = run(*one, "--budget", "1", *where)
    assert (code, "unfinished" in err) == (0, True)
    code, out, err = run(*OTHERS[one], "--resume", *where)
    assert (code, out) == (2, "")
    assert err.startswith("polycorner: --resume: ")
    assert err.count("\n") == 1


@pytest.mark.parametrize("content", ["", "{", "[]", "{}", '{"polycorner atlas": 1}', "\x00\xff"])
def test_a_damaged_search_is_refused(tmp_path, content):
    run("tutorial", "--budget", "1", "--out", str(tmp_path))
    (state,) = tmp_path.glob("*state*")
    state.write_text(content, encoding="latin-1")
    code, out, err = run("tutorial", "--resume", "--out", str(tmp_path))
    assert (code, out) == (2, "")
    assert err.startswith("polycorner: --resume: ")
    assert err.count("\n") == 1


def test_ctrl_c_keeps_what_was_found():
    """Nine spheres take long; the bar tells when there is something to interrupt."""
    search = ("spheres", "--count", "9", "--json")
    code, out, shown = on_terminal(*search, interrupt_at=r"edges \S+ +[1-9]\d*/\d+")
    found = json.loads(out)
    assert (code, found["complete"]) == (130, "interrupted")
    assert found["edges"]
    assert "unfinished, kept in" in shown
    process = started(*search, "--resume", "--budget", "3", stderr=subprocess.PIPE)
    out, err = process.communicate(timeout=300)
    later = json.loads(out)
    assert (process.returncode, later["complete"]) == (0, "budget")
    assert len(later["edges"]) == len(found["edges"]) + 3
    assert later["edges"][: len(found["edges"])] == found["edges"]
    known = [corner["point"] for corner in found["corners"]]
    assert [corner["point"] for corner in later["corners"][: len(known)]] == known
    assert err.count("\n") == 1


def test_a_terminal_shows_progress_and_a_pipe_does_not():
    code, out, shown = on_terminal("spheres", "--count", "6", "--json")
    assert code == 0
    assert json.loads(out)["complete"] == "exhausted"
    assert re.search(r"spheres: 2 corners, edges \S+ +\d+/\d+", shown)
    process = started("spheres", "--count", "6", "--json", stderr=subprocess.PIPE)
    piped, err = process.communicate(timeout=300)
    assert (process.returncode, piped, err) == (0, out, "")


# ----------------------------------------------------------------------------------- help, mistakes


@pytest.mark.parametrize("arguments", [(), ("--help",), *((model, "--help") for model in MODELS)])
def test_help_is_an_answer(arguments):
    code, out, err = run(*arguments)
    assert (code, err) == (0, "")
    assert out.startswith("Usage: polycorner atlas")
    for option in ("--json", "--out", "--seed") if len(arguments) == 2 else MODELS:
        assert option in out


MISTAKES = {
    ("--seed", "-1"): ("--seed", MODELS),
    ("--seed", "x"): ("--seed", MODELS),
    ("--budget", "0"): ("--budget", SEARCHES),
    ("--budget", "1.5"): ("--budget", SEARCHES),
    ("--resume", "--seed", "99"): ("--resume", SEARCHES),
    ("--no-such-option",): ("--no-such-option", MODELS),
    ("extra",): ("extra", MODELS),
    ("--out", "README.md"): ("--out", MODELS),
    ("--count", "1"): ("--count", ("spheres",)),
    ("--count", "-3"): ("--count", ("spheres", "disks")),
    ("--count", "2.5"): ("--count", ("spheres", "disks")),
    ("--count", "0"): ("--count", ("spheres", "disks")),
    ("--torus", "round"): ("--torus", ("disks",)),
    ("--heading", "nan"): ("--heading", ("dyad",)),
    ("--heading", "inf"): ("--heading", ("dyad",)),
    ("--heading", "x"): ("--heading", ("dyad",)),
    ("--plane", "--length", "5"): ("--length", ("dyad",)),
    ("--drum", "10"): ("--length", ("dyad",)),
    ("--ball", "nan"): ("--ball", ("dyad",)),
    ("--rod", "3"): ("--rod", ("dyad",)),
    ("--rod-weight", "-1"): ("--rod-weight", ("dyad",)),
    ("--config", "no-such-file.toml"): ("--config", ("dyad",)),
}
WRONG = [(model, words, option) for words, (option, ms) in MISTAKES.items() for model in ms]


@pytest.mark.parametrize(("model", "words", "option"), WRONG)
def test_every_mistake_gets_one_line(model, words, option):
    code, out, err = run(model, *words)
    assert (code, out) == (2, "")
    assert err.count("\n") == 1
    assert err.startswith("polycorner: ")
    assert option in err


@pytest.mark.parametrize("words", [(), ("--budget", "1")], ids=["whole", "part"])
def test_out_that_cannot_be_a_folder_is_refused(tmp_path, words):
    (tmp_path / "taken").write_text("")
    code, out, err = run("tutorial", "--out", str(tmp_path / "taken" / "below"), *words)
    assert (code, out) == (2, "")
    assert err.startswith("polycorner: --out: ")
    assert err.count("\n") == 1


def test_an_unknown_model_is_refused():
    code, out, err = run("cubes")
    assert (code, out) == (2, "")
    assert "cubes" in err
