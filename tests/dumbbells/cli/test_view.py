"""The command ``polycorner view``: pages in a browser, files and mistakes."""

import re
import signal
import socket
import subprocess
import sys
from contextlib import contextmanager

import commands
import numpy as np
import pytest
import trimesh
from drum_motions import moved

from polycorner import minimise
from polycorner.dumbbells import DumbbellDrum, DumbbellPair
from polycorner.dumbbells.dynamics.files import save_run
from polycorner.dumbbells.viewer.board import Board

PAIR = DumbbellPair(16, 3, 1.5, 125)
BOARD = Board.of(PAIR)
READY = "document.documentElement.dataset.ready === 'yes'"


@contextmanager
def serving(*arguments):
    """Serve a page by a process of its own, and end it as a user does."""
    command = [sys.executable, "-m", "polycorner", "view", *arguments, "--port", "0"]
    with subprocess.Popen(
        [*command, "--no-browser"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        try:
            line = process.stdout.readline()
            assert line.startswith("http://127.0.0.1:"), process.stderr.read()
            yield line.split()[0]
            process.send_signal(signal.SIGINT)
            assert process.wait(30) == 0
            said = process.stderr.read().splitlines()
            assert not [line for line in said if "once on this machine" not in line]
        finally:
            process.kill()


@pytest.fixture(scope="module")
def live(tab):
    assert tab.complaints() == []  # without a browser nothing is served
    with serving("dyad") as address:
        yield address


def texts(tab, *names):
    return {name: tab.value(f"document.getElementById('{name}').textContent") for name in names}


def moved_to(tab, name, value):
    """Move a slider and wait for the answer."""
    tab.value("delete document.documentElement.dataset.latency")
    tab.slide(f"#{name}", value)
    tab.wait("document.documentElement.dataset.latency")


def shown_gaps(tab):
    return {
        name: tab.value(f"document.querySelector('#gap-{name} span').textContent")
        for name in PAIR.polyhedron.names
    }


@pytest.mark.parametrize("width", [1200, 360])
@pytest.mark.parametrize("dark", [False, True])
def test_the_page_opens_and_asks_for_nothing_elsewhere(tab, live, width, dark):
    tab.open(live, width=width, dark=dark)
    tab.wait(READY)
    tab.wait("document.documentElement.dataset.solid === 'yes'")
    assert tab.complaints() == []
    assert all(url.startswith((live, "data:,")) for url in tab.requests())
    assert tab.value("document.documentElement.scrollWidth") <= width
    colour = tab.value("getComputedStyle(document.body).backgroundColor")
    assert (sum(map(int, re.findall(r"\d+", colour)[:3])) < 150) is dark
    named = "[...document.querySelectorAll('button, input')].every(e => e.labels?.length"
    assert tab.value(f"{named} || e.textContent || e.getAttribute('aria-label'))")


def test_sliders_move_and_the_numbers_are_the_library_s(tab, live):
    tab.open(live, width=1200)
    tab.wait(READY)
    values = {"heading_A": 41.25, "axial_B": 13.5, "lateral_A": -2.5}
    for name, value in values.items():
        moved_to(tab, name, value)
    board = BOARD.moved(values)
    q = np.array(board.q)
    gaps = dict(zip(PAIR.polyhedron.names, PAIR.polyhedron.values(q), strict=True))
    assert shown_gaps(tab) == {name: f"{gap:.4f}" for name, gap in gaps.items()}
    found = texts(tab, "energy", "chirality", "stratum", "headings", "contacts")
    assert found["energy"] == f"{PAIR.energy.value(q):.6f} mm"
    assert found == {name: board.words[name] for name in found}
    assert tab.complaints() == []


def test_an_overlap_is_lit_and_said(tab, live):
    tab.open(live, width=1200)
    tab.wait(READY)
    moved_to(tab, "axial_B", 0.0)
    board = BOARD.moved({"axial_B": 0.0})
    overlapping = {
        name
        for name, gap in zip(PAIR.polyhedron.names, PAIR.polyhedron.values(board.q), strict=True)
        if gap < 0
    }
    lit = tab.value("[...document.querySelectorAll('.gaps .overlap')].map(e => e.id)")
    assert {name.removeprefix("gap-") for name in lit} == overlapping != set()
    assert texts(tab, "multipliers")["multipliers"] == "none: the dumbbells overlap"


def test_a_number_can_be_typed_and_one_out_of_range_is_not_sent(tab, live):
    tab.open(live, width=1200)
    tab.wait(READY)
    tab.slide("#heading_B-number", 12.5)
    expected = BOARD.moved({"heading_B": 12.5}).words["headings"]
    tab.wait(f"document.getElementById('headings').textContent === '{expected}'")
    tab.slide("#heading_B-number", 720)
    moved_to(tab, "axial_A", 1.0)
    assert texts(tab, "headings", "problem") == {"headings": expected, "problem": ""}


def test_a_shape_that_cannot_be_is_explained(tab, live):
    tab.open(live, width=1200)
    tab.wait(READY)
    moved_to(tab, "rod_radius", 5.0)
    problem = texts(tab, "problem")["problem"]
    assert "rod_radius: expected a number > 0 and < 3 in mm" in problem
    assert tab.value("document.getElementById('rod_radius').value") == "1.5"


@pytest.mark.parametrize(("button", "hand"), [("right", "R"), ("left", "L")])
def test_the_descent_ends_at_the_corner_with_the_library_s_heading(tab, live, button, hand):
    tab.open(live, width=1200)
    tab.wait(READY)
    tab.click(f"#{button}")
    tab.click("#fall")
    tab.wait("document.getElementById('verdict').textContent")
    corner = minimise(PAIR.polyhedron, PAIR.energy, PAIR.nested(hand))
    headings = [float(x) for x in re.findall(r"-?\d+\.\d+", texts(tab, "headings")["headings"])]
    np.testing.assert_allclose(headings, np.degrees(PAIR.heading(corner.point)), atol=1e-6)
    found = texts(tab, "verdict", "contacts", "stratum", "rest")
    assert found["verdict"] == found["rest"] == corner.verdict.value
    assert set(found["contacts"].split(", ")) == set(corner.active)
    assert found["stratum"] == "dimension 3, rank 3, quadrant"
    closed = tab.value("[...document.querySelectorAll('.gaps .closed')].map(e => e.id.slice(4))")
    assert set(closed) == set(corner.active)
    assert "the energy decreases from" in texts(tab, "way")["way"]
    assert tab.value("board.trail.flat().length") > 10
    moved_to(tab, "lateral_A", 3.0)  # whatever is moved afterwards ends the show
    assert texts(tab, "verdict")["verdict"] == ""
    assert tab.value("board.trail.length") == 0
    assert tab.complaints() == []


def test_the_plane_and_back(tab, live):
    tab.open(live, width=1200)
    tab.wait(READY)
    tab.click("#plane")
    tab.wait("document.getElementById('energy').textContent.endsWith('mm²')")
    tab.click("#drum")
    tab.wait("document.getElementById('energy').textContent.endsWith('mm')")
    assert texts(tab, "energy")["energy"] == BOARD.words["energy"]


def test_a_server_that_has_ended_is_said_to(tab):
    with serving() as address:
        tab.open(address, width=800)
        tab.wait(READY)
    tab.wait(
        "document.getElementById('problem').textContent.startsWith('The connection is closed')"
    )


# ------------------------------------------------------------------------------------------ files


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    start = PAIR.nested("R")
    q = np.linspace(start, start + np.array([0.1, 9, 0, 0.1, 9, 0]), 12)
    motion = moved(DumbbellDrum(count=2), q.reshape(-1, 2, 3))
    file = save_run(motion, tmp_path_factory.mktemp("run") / "trajectory.nc")
    return motion, file


def test_a_trajectory_becomes_a_page_and_a_scene(capsys, recorded, tmp_path):
    motion, file = recorded
    page, scene = tmp_path / "film.html", tmp_path / "last.glb"
    code, out, err = commands.run(capsys, "view", "trajectory", str(file), "--out", str(page))
    assert (code, out, err) == (0, f"wrote {page}\n", "")
    assert "Dumbbells in the drum" in page.read_text(encoding="utf-8")
    arguments = ("view", "trajectory", str(file), "--out", str(scene), "--quiet")
    assert commands.run(capsys, *arguments) == (0, "", "")
    found = trimesh.load_scene(scene)
    last = PAIR.ball_centres(motion.q[-1, :, :3].ravel())
    np.testing.assert_allclose(found.graph["2.2"][0][:3, 3], last[3], atol=2e-5)


def test_a_trajectory_is_served(tab, recorded):
    motion, file = recorded
    with serving("trajectory", str(file)) as address:
        tab.open(address, width=800)
        tab.wait(READY)
        assert tab.value("document.getElementById('when').max") == str(len(motion) - 1)
        tab.press("End")
        assert texts(tab, "clock")["clock"] == f"{motion.times[-1]:.2f} s"
        assert tab.complaints() == []
        assert tab.requests() == [address]


def test_an_atlas_becomes_a_scene(capsys, tmp_path):
    path = tmp_path / "new" / "atlas.glb"
    arguments = ("view", "atlas", "--length", "7", "--drum", "inf", "--out", str(path))
    assert commands.run(capsys, *arguments) == (0, f"wrote {path}\n", "")
    assert "solid" in trimesh.load_scene(path).geometry


# --------------------------------------------------------------------------------------- mistakes


def test_a_port_in_use_is_one_sentence(capsys):
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        code, out, err = commands.run(capsys, "view", "--port", str(port), "--no-browser")
    assert (code, out) == (2, "")
    assert re.fullmatch(
        rf"polycorner: --port: expected a port that is free; {port} is in use; \d+ is free\n", err
    )


def test_without_tornado_the_extra_is_named(capsys, monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda _: None)
    code, _, err = commands.run(capsys, "view", "--no-browser")
    assert code == 2
    assert "pip install 'polycorner[view]'" in err
    assert "pip install '.[view]'" in err  # in a checkout
