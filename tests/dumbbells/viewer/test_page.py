"""Films, and the page that plays them: the same words as the library's, and no request leaves."""

import base64
import gzip
import hashlib
import json
import math
import re
from dataclasses import replace

import chromium
import numpy as np
import pytest
import trimesh
from drum_motions import moved

from polycorner import AnyOf, Manifold, Polyhedron, minimise, stratum_at
from polycorner.dumbbells import DumbbellDrum, DumbbellPair, pair_atlas
from polycorner.dumbbells.dynamics.pairs import handedness
from polycorner.dumbbells.pictures import film as scene_film
from polycorner.dumbbells.viewer import page as scene_page
from polycorner.dumbbells.viewer.steepest_descent import descent
from polycorner.errors import PolycornerError

DRUM, PLANE = DumbbellPair(16, 3, 1.5, 125), DumbbellPair(16, 3, 1.5)
BEGIN = DRUM.nested("R", heading=0.5, clearance=1.5) + np.array([0.08, 0, 0, 0.06, 0, -0.1])


@pytest.fixture(scope="module")
def way():
    return descent(DRUM.polyhedron, DRUM.energy, BEGIN)


# ---------------------------------------------------------------------------------- the way down


def test_a_descent_falls_inside_the_polyhedron_to_the_minimum(way):
    energies = DRUM.energy.value(way.points)
    assert (np.diff(energies) < 0).all()
    assert DRUM.polyhedron.implicit(way.points).min() > -1e-8
    corner = minimise(DRUM.polyhedron, DRUM.energy, DRUM.nested("R"))
    assert way.certificate.is_minimum
    assert set(way.certificate.active) == set(corner.active)
    heading = DRUM.heading(corner.point)
    np.testing.assert_allclose(DRUM.heading(way.points[-1]), heading, atol=1e-9)
    np.testing.assert_allclose(way.points[0], BEGIN)
    assert np.diff(way.lengths).max() < 0.2


def test_a_descent_leaves_along_the_gradient_and_closes_contacts_one_by_one(way):
    scales = DRUM.manifold.scale_array
    first = (way.points[1] - way.points[0]) / scales
    down = -DRUM.energy.gradient(BEGIN) * scales
    assert first @ down == pytest.approx(np.linalg.norm(first) * np.linalg.norm(down))
    strata = [stratum_at(DRUM.polyhedron, q, tolerance=1e-6) for q in way.points]
    dimensions = [stratum.dimension for stratum in strata]
    assert (dimensions[0], dimensions[-1]) == (6, 3)
    assert max(np.diff(dimensions)) <= 1


def test_a_descent_on_a_line_is_known_exactly():
    """Down a slope to a floor, then along the floor to its lowest point."""
    M = Manifold.euclidean("x y")
    x, y = M.symbols
    found = descent(Polyhedron(M, {"floor": y}), y + x**2 / 20, [2.0, 1.0])
    assert found.certificate.point == pytest.approx([0, 0], abs=1e-12)
    # Without a floor x' = -x/10, y' = -1 from (2, 1): it is reached at x = 2 exp(-1/10).
    grounded = found.points[found.points[:, 1] < 1e-12][0]
    assert grounded[0] == pytest.approx(2 * math.exp(-0.1), rel=0.05)
    assert (np.diff(found.points[:, 0]) <= 0).all()


def test_a_descent_begins_at_the_nearest_point_of_the_polyhedron():
    overlapping = DRUM.nested("L", clearance=-0.5)
    assert not DRUM.polyhedron.contains(overlapping)
    found = descent(DRUM.polyhedron, DRUM.energy, overlapping)
    assert DRUM.polyhedron.implicit(found.points[0]) > -1e-8
    M = Manifold.euclidean("x")
    (x,) = M.symbols
    nowhere = descent(Polyhedron(M, {"low": x - 1, "high": -x - 1}), x, [0.0])
    assert nowhere.points.tolist() == [[0.0]]
    assert nowhere.certificate.verdict.name == "INFEASIBLE"
    union = Polyhedron(M, AnyOf(*Polyhedron(M, {"a": x, "b": -x - 1}).functions))
    with pytest.raises(ValueError, match="polyhedron: expected an intersection; got a union"):
        descent(union, x, [0.5])


# ------------------------------------------------------------------------------------- the films


def test_a_film_of_a_pair_says_what_the_library_says(way):
    film = scene_film.pair_film(DRUM, way.points)
    np.testing.assert_allclose(film.times, way.lengths)
    np.testing.assert_array_equal(film.centres.reshape(-1, 4, 3), DRUM.ball_centres(way.points))
    for k, q in enumerate(way.points):
        stratum = stratum_at(DRUM.polyhedron, q, tolerance=1e-6)
        assert tuple(film.contacts[k]) == stratum.active
        assert f"dimension {stratum.dimension}, rank {stratum.rank}, " in film.words[k].stratum
        assert (
            film.words[k].chirality == {"R": "right-handed", "L": "left-handed"}[DRUM.chirality(q)]
        )
    np.testing.assert_array_equal(film.energies["Energy (mm)"], DRUM.energy.value(way.points))


def test_one_configuration_is_a_film_of_one_frame():
    film = scene_film.pair_film(PLANE, PLANE.nested("L"))
    assert len(film) == 1
    assert list(film.energies) == ["Energy (mm²)"]


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"q": np.zeros((3, 5))}, r"q: expected shape \(T, 6\)"),
        ({"q": np.zeros((0, 6))}, r"q: expected shape \(T, 6\)"),
        ({"q": np.full(6, math.inf)}, "q: expected finite"),
        ({"q": [BEGIN, BEGIN], "times": [0.0, 0.0]}, "times: expected 2 increasing"),
        ({"q": [BEGIN, BEGIN], "times": [0.0]}, "times: expected 2 increasing"),
    ],
)
def test_what_a_film_refuses(given, message):
    with pytest.raises(ValueError, match=message):
        scene_film.pair_film(DRUM, **given)


def test_a_film_of_a_run_agrees_with_the_polyhedron(way):
    run = moved(DumbbellDrum(count=2), way.points.reshape(-1, 2, 3))
    film = scene_film.run_film(run)
    assert film.unit == "s"
    for k, q in enumerate(way.points):
        stratum = stratum_at(DRUM.polyhedron, q, tolerance=1e-6)
        assert tuple(film.contacts[k]) == stratum.active
        assert film.words[k].stratum.startswith(
            f"dimension {stratum.dimension}, rank {stratum.rank}, "
        )
        assert film.words[k].chirality == scene_film.HANDS[handedness(run.trajectory, k)]
    assert len(scene_film.run_film(run, frames=7)) == 7


def test_a_film_of_many_counts_dyads_and_leaves_out_who_has_left():
    pair = minimise(DRUM.polyhedron, DRUM.energy, DRUM.nested("R")).point.reshape(2, 3)
    q = np.stack([np.concatenate([pair, [[0.3, 200.0, 0.1]]])] * 3)
    film = scene_film.run_film(moved(DumbbellDrum(count=3), q, leaves=(2, 1)))
    assert [w.chirality for w in film.words] == ["1 right-handed, 0 left-handed dyads"] * 3
    assert film.roles[0].tolist() == [scene_film.RIGHT, scene_film.RIGHT, scene_film.SINGLE]
    assert np.isnan(film.centres[1:, 2]).all()
    assert not np.isnan(film.centres[0]).any()
    assert set(film.contacts[0]) == {"1-2 A2B1", "1-2 A2b", "1-2 aB1"}
    assert film.words[0].stratum == ""


# -------------------------------------------------------------------------------------- the page


def unpacked(text, kind):
    return np.frombuffer(gzip.decompress(base64.b64decode(text)), kind)


def test_a_page_carries_its_numbers_and_forbids_everything_else(way):
    film = replace(scene_film.pair_film(DRUM, way.points), title="A < B & </script>", note='"x"')
    page = scene_page.film_page(film)
    blocks = re.findall(r"<script([^>]*)>(.*?)</script>", page, re.DOTALL)
    assert len(blocks) == 4
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', page).group(1)
    assert policy.startswith("default-src 'none'; script-src 'sha256-")
    for attributes, text in blocks:
        digest = base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
        assert (f"'sha256-{digest}'" in policy) is (attributes == "")
        assert "eval(" not in text
    assert "unsafe" not in policy
    data = json.loads(blocks[0][1])
    np.testing.assert_allclose(
        unpacked(data["centres"], "<f4").reshape(-1, 4, 3), DRUM.ball_centres(way.points), atol=1e-5
    )
    energies = dict(data["energies"])
    np.testing.assert_array_equal(
        unpacked(energies["Energy (mm)"], "<f8"), DRUM.energy.value(way.points)
    )
    assert "A &lt; B &amp; &lt;/script&gt;" in page


def test_a_thousand_frames_fit_in_two_megabytes():
    rng = np.random.default_rng(5)  # noise does not compress: the worst case
    q = DRUM.nested("R") + rng.normal(0, 0.01, (1000, 6))
    assert len(scene_page.film_page(scene_film.pair_film(DRUM, q)).encode()) < 2e6


def test_a_trimesh_without_three_is_one_sentence(monkeypatch):
    monkeypatch.setattr(trimesh.resources, "get_bytes", lambda _: b"no archive")
    with pytest.raises(PolycornerError, match=r"three.js: expected it in templates/viewer.zip"):
        scene_page.three_script.__wrapped__()


def test_pages_are_html_files(tmp_path):
    with pytest.raises(ValueError, match=r"path: expected a name ending in \.html; got page.txt"):
        scene_page.write_page("", tmp_path / "page.txt")


# ----------------------------------------------------------------------------------- the browser


@pytest.fixture(scope="module")
def file(way, tmp_path_factory):
    film = scene_film.pair_film(DRUM, way.points)
    path = tmp_path_factory.mktemp("pages") / "film.html"
    return scene_page.write_page(scene_page.film_page(film), path)


READY = "document.documentElement.dataset.ready === 'yes'"


def text(tab, name):
    return tab.value(f"document.getElementById('{name}').textContent")


@pytest.mark.parametrize("width", [1200, 360])
@pytest.mark.parametrize("dark", [False, True])
def test_a_page_opens_offline(tab, file, width, dark):
    tab.open(file, width=width, dark=dark)
    tab.wait(READY)
    assert tab.requests() == [file.as_uri()]
    assert tab.complaints() == []
    assert tab.value("document.documentElement.scrollWidth") <= width
    colour = tab.value("getComputedStyle(document.body).backgroundColor")
    assert (sum(map(int, re.findall(r"\d+", colour)[:3])) < 150) is dark
    named = "[...document.querySelectorAll('button, input, select')].every(e => e.labels?.length"
    assert tab.value(f"{named} || e.textContent || e.getAttribute('aria-label'))")


def test_the_timeline_moves_and_labels_change_as_the_library_says(tab, file, way):
    tab.open(file, width=1200)
    tab.wait(READY)
    assert tab.value("document.getElementById('when').max") == str(len(way.points) - 1)
    seen = set()
    for k in (0, len(way.points) // 2, len(way.points) - 1):
        tab.slide("#when", k)
        stratum = stratum_at(DRUM.polyhedron, way.points[k], tolerance=1e-6)
        shown = tab.value("[...document.querySelectorAll('#contacts li')].map(e => e.textContent)")
        assert tuple(shown) == stratum.active
        assert text(tab, "stratum") == scene_film.stratum_words(stratum)
        assert text(tab, "chirality") == scene_film.HANDS[stratum.chirality]
        energy = DRUM.energy.value(way.points[k])
        assert float(text(tab, "energy-0")) == pytest.approx(energy, rel=1e-6)
        assert float(text(tab, "clock").split()[0]) == pytest.approx(way.lengths[k], abs=1e-3)
        seen.add(stratum.dimension)
    assert len(seen) > 1


def test_keys_and_buttons_play_and_step(tab, file, way):
    tab.open(file, width=1200)
    tab.wait(READY)
    at = "Number(document.getElementById('when').value)"
    for key, expected in (("ArrowRight", 1), ("ArrowRight", 2), ("ArrowLeft", 1), ("Home", 0)):
        tab.press(key)
        assert tab.value(at) == expected
    tab.press("End")
    assert tab.value(at) == len(way.points) - 1
    tab.value("document.getElementById('speed').value = '10'")
    tab.click("#play")  # from the end it begins anew
    tab.wait(f"{at} > 3 && document.getElementById('play').textContent === 'Pause'")
    tab.click("#play")
    assert text(tab, "play") == "Play"
    stopped = tab.value(at)
    tab.click("#on")
    assert tab.value(at) == stopped + 1
    tab.press(" ", 32)  # the button in focus is pressed
    assert tab.value(at) == stopped + 2
    assert tab.complaints() == []


def test_the_picture_can_be_turned_zoomed_and_set_back(tab, file):
    tab.open(file, width=1200)
    tab.wait(READY)
    camera = "player.stage.camera.position.toArray()"
    target = "player.stage.controls.target.toArray()"
    start, aim = np.array(tab.value(camera)), np.array(tab.value(target))
    away = np.linalg.norm(start - aim)
    tab.drag("#stage", 120, 40)
    tab.wait(f"Math.abs({camera}[0] - {start[0]}) > 1")
    assert np.linalg.norm(np.array(tab.value(camera)) - aim) == pytest.approx(away)
    tab.wheel("#stage", -400)
    tab.wait(f"Math.hypot(...{camera}.map((x, k) => x - {target}[k])) < {0.98 * away}")
    tab.click("#reset")
    np.testing.assert_allclose(tab.value(camera), start)
    tab.value("document.getElementById('stage').focus()")
    tab.press("ArrowLeft")
    assert abs(tab.value(camera)[0] - start[0]) > 1
    assert tab.complaints() == []


def test_the_picture_shows_balls_where_they_are_and_contacts_that_glow(tab, file, way):
    """Project a ball and a contact as a camera does, and look at the colours there."""
    tab.open(file, width=1200)
    tab.wait(READY)
    tab.press("End")
    place = way.points[-1]
    names = stratum_at(DRUM.polyhedron, place, tolerance=1e-6).active
    film = scene_film.pair_film(DRUM, place)
    points = [film.centres[0, 0, 0], film.centres[0, 1, 1], film.contacts[0][names[0]]]
    pixels = [colour_at(tab, point) for point in points]
    blue, orange, glow = (np.array(p, dtype=float) for p in pixels)
    assert blue[2] > blue[0] + 40
    assert orange[0] > orange[2] + 40
    assert glow[0] > 180
    assert glow[1] > 120
    assert glow[2] < 120


def colour_at(tab, point):
    """Return the colour that is drawn where a point in space is seen."""
    x, y, z = point.tolist()
    return tab.value(f"""(() => {{
      const stage = player.stage, canvas = stage.renderer.domElement;
      const seen = new THREE.Vector3({x}, {y}, {z}).project(stage.camera);
      stage.renderer.render(stage.scene, stage.camera);
      const gl = stage.renderer.getContext(), pixel = new Uint8Array(4);
      gl.readPixels((seen.x + 1) / 2 * canvas.width, (seen.y + 1) / 2 * canvas.height, 1, 1,
        gl.RGBA, gl.UNSIGNED_BYTE, pixel);
      return [...pixel];
    }})()""")


def test_a_browser_without_webgl_says_so_and_shows_the_numbers(file, tmp_path):
    with chromium.page(chromium.needed(), tmp_path / "profile") as flat:
        flat.ask(
            "Page.addScriptToEvaluateOnNewDocument",
            source="HTMLCanvasElement.prototype.getContext = () => null;",
        )
        flat.open(file, width=800)
        flat.wait(READY)
        assert "no WebGL" in text(flat, "stage")
        flat.press("End")
        assert "dimension 3" in text(flat, "stratum")
        assert flat.complaints() == []


def test_an_atlas_is_a_page_of_its_own(tab, tmp_path):
    atlas = pair_atlas(DumbbellPair(7, 3, 1.5))
    page = scene_page.atlas_page(atlas, resolution=16)
    file = scene_page.write_page(page, tmp_path / "atlas.html")
    tab.open(file, width=360)
    tab.wait(READY)
    assert tab.requests() == [file.as_uri()]
    assert tab.complaints() == []
    hands = {corner.chirality for corner in atlas.skeleton.corners}
    shown = tab.value("[...document.querySelectorAll('#legend-0 li')].map(e => e.textContent)")
    assert set(shown) == {scene_film.HANDS[hand] for hand in hands}
    assert tab.value("document.getElementById('timeline').offsetHeight") == 0
    assert tab.value("document.documentElement.scrollWidth") <= 360
