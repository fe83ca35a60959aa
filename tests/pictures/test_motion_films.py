"""Films of bodies: frames and pages show them where they are, and contacts where they touch."""

import base64
import gzip
import json
import re

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from PIL import Image

from polycorner import simulate
from polycorner.bodies import (
    Arrangement,
    Cylinder,
    HalfSpace,
    Mass,
    Robot,
    RobotJoint,
    RobotLink,
    box,
    capsule,
    disc,
    polygon,
    polytope,
    sphere,
)
from polycorner.bodies.motions import poses_of
from polycorner.models.spheres import SphereCluster
from polycorner.pictures import draw_motion, film
from polycorner.pictures.arrangements import COLOURS, window_of
from polycorner.pictures.films import can_encode

READY = "document.documentElement.dataset.ready === 'yes'"


def falling(count=3):
    """Discs that fall into a box and lie on its floor at the end."""
    a = Arrangement(
        {"A": disc(0.5)}, box([0, 0], [6, 4]), {"post": polygon([[0, 3], [1, 3], [0, 4]])}
    )
    system = a.system(count=count, gravity=[0, -10])
    start = [[1.5 + 1.5 * k, 1.0 + 0.5 * k] for k in range(count)]
    return a, simulate(system, system.state(start), 1.0, 0.01)


def frames(path):
    with Image.open(path) as image:
        for k in range(image.n_frames):
            image.seek(k)
            yield np.asarray(image.convert("RGB"), dtype=float)


def data_of(page):
    return json.loads(re.search(r'id="film">(.*?)</script>', page, re.DOTALL).group(1))


def unpacked(text, kind="<f4"):
    return np.frombuffer(gzip.decompress(base64.b64decode(text)), kind)


# ----------------------------------------------------------------------------------------- frames


def test_frames_are_as_many_as_the_speed_asks_for(tmp_path):
    a, path = falling()
    for speed, fps, count in [(1.0, 10, 11), (0.5, 10, 21), (4.0, 20, 6)]:
        film(a, path, tmp_path / "a.gif", speed=speed, fps=fps, size=60)
        assert sum(1 for _ in frames(tmp_path / "a.gif")) == count


def test_discs_are_drawn_where_they_are(tmp_path):
    a, path = falling()
    film(a, path, tmp_path / "a.gif", fps=5, size=200, contacts=False)
    low, high = window_of(poses_of(a, path))
    shown = [*frames(tmp_path / "a.gif")]
    side = 0.94 * 200  # below the line with the time
    for k, frame in enumerate(shown):
        q = path.q[path.at(0.2 * k)]
        for x, y in q:
            column = 0.03 * 200 + (x - low[0]) / (high - low)[0] * side
            row = 200 - (y - low[1]) / (high - low)[1] * side
            colour = frame[round(row), round(column)] / 255
            np.testing.assert_allclose(colour, to_rgb(COLOURS[0]), atol=0.06)


def test_points_are_frames(tmp_path):
    a = Arrangement([disc(0.5), disc(0.3)])
    film(a, [[0, 0, 2, 0], [0, 0, 1, 0], [0, 0, 0.8, 0.1]], tmp_path / "a.gif", size=60)
    assert sum(1 for _ in frames(tmp_path / "a.gif")) == 3


def test_a_film_in_space_shows_balls_in_front_of_others(tmp_path):
    a = Arrangement({"A": sphere(1.0), "B": sphere(1.0)})
    # The eye looks from below the first axis, from where y is negative.
    for y, first in ((-3, 1), (3, 0)):
        film(a, [[0, 0, 0, 0, y, y * -0.36]], tmp_path / "a.gif", size=100, contacts=False)
        (frame,) = frames(tmp_path / "a.gif")
        hues = [np.array(to_rgb(COLOURS[k])) for k in (0, 1)]
        seen = [(abs(frame / 255 - hue).sum(axis=2) < 0.4).sum() for hue in hues]
        assert seen[first] > 100


@pytest.mark.skipif(not can_encode(), reason="imageio-ffmpeg is not installed")
def test_mp4_has_the_frames_too(tmp_path):
    import imageio_ffmpeg

    a, path = falling()
    film(a, path, tmp_path / "a.mp4", fps=10, size=100)
    count, _ = imageio_ffmpeg.count_frames_and_secs(str(tmp_path / "a.mp4"))
    assert count == 11


def test_another_suffix_is_refused(tmp_path):
    a, path = falling()
    with pytest.raises(ValueError, match=r"path: expected a file name that ends in .html, .gif"):
        film(a, path, tmp_path / "a.avi")


# ------------------------------------------------------------------------------------------ pages


def test_a_page_carries_places_turns_and_contacts():
    a, path = falling()
    data = data_of(film(a, path).page)
    centres = unpacked(data["centres"]).reshape(len(path), 3, 3)
    np.testing.assert_allclose(centres[..., :2], path.q, atol=1e-5)
    first = unpacked(data["contacts"]["first"], "<u4")
    np.testing.assert_array_equal(np.diff(first), [len(t) for t in path.touching])
    places = unpacked(data["contacts"]["places"]).reshape(-1, 3)[first[-2] :]
    on_floor = np.column_stack([path.q[-1, :, 0], np.zeros(3)])
    np.testing.assert_allclose(places[:, :2], on_floor, atol=1e-5)
    assert data["contacts"]["names"] == ["A-bottom"]


def test_who_left_is_not_on_the_page():
    a = Arrangement({"A": disc(0.5)}, {"floor": HalfSpace([0, 1], [0, 0])})
    system = a.system(count=2, exits={"xA": 2.0})
    path = simulate(system, system.state([[0, 1], [0, 4]], [[0, 0], [4, 0]]), 1.0, 0.01)
    centres = unpacked(data_of(film(a, path).page)["centres"]).reshape(len(path), 2, 3)
    np.testing.assert_array_equal(np.isnan(centres).any(axis=2), ~path.present)


def test_a_notebook_gets_the_page_in_a_frame_of_its_own():
    a, path = falling()
    shown = film(a, path)
    fragment = shown._repr_html_()
    assert fragment.startswith("<iframe")
    assert "allow-same-origin" not in fragment
    assert "&lt;script&gt;" in fragment
    assert "<script>" not in fragment


def scenes():
    square = polygon([[-1, -1], [1, -1], [1, 1], [-1, 1]], 0.1)
    cube = polytope([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], 0.1)
    plane = Arrangement(
        {"S": square, "C": capsule([-1, 0], [1, 0], 0.3)},
        {"drum": Cylinder(6.0)},
        {"peg": disc(0.5, [0, 3])},
        orientations="all",
    )
    around = Arrangement([disc(0.4), disc(0.4)], {"f": HalfSpace([0, 1], [0, 0])}, period=[3, None])
    space = Arrangement({"Q": cube, "B": sphere(0.8)}, box([-4, -4, -2], [4, 4, 4]))
    yield "plane", plane, [[0, 0, 0.3, -2.5, 0, 1.0]], {"S": (0, 0), "C": (-2.5, 0), "peg": (0, 3)}
    yield "period", around, [[0.1, 1, 1.5, 2]], {"1": (0.1, 1), "image": (3.1, 1), "2": (1.5, 2)}
    yield "space", space, [[0, 0, 0, 1, 0, 0, 0, 2.5, 0, 0]], {"Q": (0, 0, 0), "B": (2.5, 0, 0)}


HUES = {"S": 0, "C": 1, "1": 0, "image": 0, "2": 1, "Q": 0, "B": 1}


def test_pages_open_offline_and_show_bodies_where_they_are(tab, tmp_path):
    """Project the middles of bodies as the camera does, and look at the colours there."""
    for name, a, points, places in scenes():
        file = tmp_path / f"{name}.html"
        film(a, points, file, title=name)
        tab.open(file, width=400)
        tab.wait(READY)
        assert tab.complaints() == []
        assert tab.requests() == [file.as_uri()]
        for body, place in places.items():
            x, y, z = (*place, 0)[:3]
            colour = tab.value(f"""(() => {{
              const stage = player.stage, canvas = stage.renderer.domElement;
              stage.renderer.render(stage.scene, stage.camera);
              const seen = new THREE.Vector3({x}, {y}, {z}).project(stage.camera);
              stage.renderer.render(stage.scene, stage.camera);
              const gl = stage.renderer.getContext(), pixel = new Uint8Array(4);
              gl.readPixels((seen.x + 1) / 2 * canvas.width, (seen.y + 1) / 2 * canvas.height, 1, 1,
                gl.RGBA, gl.UNSIGNED_BYTE, pixel);
              return [...pixel].slice(0, 3);
            }})()""")
            hue = np.array(to_rgb(COLOURS[HUES[body]]) if body in HUES else (0.55,) * 3)
            seen = np.array(colour) / 255
            # In space light changes the brightness, not the hue.
            scale = seen @ hue / (hue @ hue)
            assert abs(seen - scale * hue).max() < 0.17, (name, body, colour)
            assert scale == pytest.approx(1, abs=0.6 if len(place) == 3 else 0.03)


def test_a_page_plays_a_motion_in_its_own_time(tab, tmp_path):
    a, path = falling()
    film(a, path, tmp_path / "a.html", speed=0.5)
    tab.open(tmp_path / "a.html", width=700)
    tab.wait(READY)
    value = "document.getElementById('speed').selectedOptions[0].textContent"
    assert tab.value(value) == "1× (0.5 × real time)"
    tab.slide("#when", len(path) - 1)
    assert tab.value("document.getElementById('clock').textContent") == "1.00 s"
    shown = tab.value("[...document.querySelectorAll('#contacts li')].map(e => e.textContent)")
    assert shown == ["A-bottom"]


# --------------------------------------------------------------------------------- rows of pictures

ROD = Arrangement({"A": capsule([-1, 0], [1, 0], 0.3)}, box([-3, 0], [3, 4]))
# Along the floor, from the left wall to the right one; a unit is as long as the scale.
ALONG = np.array([[x, 0.3, 0.0] for x in (-1.7, -1.0, 0.0, 1.2, 1.7)])


def marks(axes):
    """The points that are marked."""
    return [line.get_xydata() for line in axes.lines if line.get_marker() == "o"]


def test_frames_along_an_edge_are_at_equal_steps():
    panes = draw_motion(ROD, ALONG, 5).axes
    lengths = [float(pane.get_title().split("\n")[0]) for pane in panes]
    np.testing.assert_allclose(lengths, np.linspace(0, 3.4 / 0.3, 5), atol=0.006)
    for pane, x in zip(panes, np.linspace(-1.7, 1.7, 5), strict=True):
        (points,) = marks(pane)
        floor = points[points[:, 1] < 0.01]
        np.testing.assert_allclose(np.sort(floor[:, 0]), [x - 1, x + 1], atol=1e-9)


def test_contacts_that_open_and_close_are_named():
    titles = [pane.get_title() for pane in draw_motion(ROD, ALONG, 3).axes]
    assert titles[0].endswith("opening A.v1-left")
    assert titles[1].endswith("\n")
    assert titles[2].endswith("closing A.v2-right")


def test_a_trajectory_is_shown_at_equal_times():
    a = Arrangement({"D": disc(0.5)}, box([0, 0], [4, 4]))
    system = a.system(count=2, gravity=[0, -10])
    path = simulate(system, system.state([[1, 0.5], [3, 2.5]]), 1.0, 0.01)
    panes = draw_motion(a, path, 3).axes
    assert [pane.get_title() for pane in panes] == ["0 s", "0.5 s", "1 s"]
    (first,), (last,) = marks(panes[1]), marks(panes[2])
    np.testing.assert_allclose(first, [[1, 0]], atol=1e-6)
    np.testing.assert_allclose(last, [[1, 0], [3, 0]], atol=1e-6)


def test_what_is_no_motion_is_refused():
    with pytest.raises(ValueError, match="polyline: expected at least two points"):
        draw_motion(ROD, [0, 1, 0])
    a = Arrangement({"D": disc(0.5)}, box([0, 0], [4, 4]))
    system = a.system()
    path = simulate(system, system.state([1, 1]), 0.1, 0.01)
    with pytest.raises(TypeError, match="polyline: expected points of the cluster"):
        draw_motion(SphereCluster(3), path)
    with pytest.raises(ValueError, match="polyline: expected one of the coordinates xA, yA"):
        draw_motion(ROD, path)
    for given, words in (
        ({"motion": np.empty((0, 2))}, "motion: expected at least one point; got 'none'"),
        ({"motion": path, "size": 10**6}, "size: expected a whole number >= 16 and <= 8192"),
        ({"arrangement": pendulum(), "motion": path}, "motion: expected one of the coord.* pivot;"),
    ):
        with pytest.raises(ValueError, match=words):
            film(**{"arrangement": a, **given})


def pendulum():
    rod = RobotLink(capsule([0, 0, 0], [0, 0, -1], 0.1), Mass(1.0, [0, 0, -0.5], np.eye(3)))
    joints = {"pivot": RobotJoint("stand", "rod", axis=[0, 1, 0])}
    floor = {"floor": HalfSpace([0, 0, 1], [0, 0, -0.8])}
    return Robot({"stand": RobotLink(), "rod": rod}, joints, walls=floor)


def test_a_robot_is_shown_where_it_is_and_where_it_touches():
    robot = pendulum()
    system = robot.system(gravity=[0, 0, -10])
    path = simulate(system, system.state([1.5]), 2.0, 0.01)
    shown = film(robot, path).poses
    assert shown.timed
    np.testing.assert_array_equal(shown.times, path.times)
    for k in (0, 60, -1):
        angle = path.q[k, 0, 0]
        end = np.array([-np.sin(angle), 0, -np.cos(angle)])
        drawn = shown.placed(k % len(shown))["rod"].markers
        np.testing.assert_allclose(drawn, [[0, 0, 0], end], atol=1e-9)
    lowest = np.array([-np.sin(angle), 0, -0.8])
    assert path.touching[-1][0][1] == "rod.v2-floor"
    np.testing.assert_allclose(shown.marks(len(shown) - 1), [lowest], atol=1e-4)
