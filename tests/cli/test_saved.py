"""``polycorner view`` of motions and skeletons in files."""

import commands
import numpy as np
import pytest
from PIL import Image

from polycorner import Manifold, Polyhedron, simulate, skeleton
from polycorner.bodies import Arrangement, box, capsule, disc
from polycorner.files import save_skeleton, save_trajectory


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    """A motion of discs, a skeleton in the plane, and one of a rod that turns."""
    folder = tmp_path_factory.mktemp("saved")
    a = Arrangement({"A": disc(0.5)}, box([0, 0], [4, 4]))
    system = a.system(count=2, gravity=[0, -10])
    path = simulate(system, system.state([[1, 1], [3, 2]]), 0.5, 0.01, every=10)
    save_trajectory(path, folder / "motion.nc", arrangement=a)
    save_trajectory(path, folder / "bare.nc")
    M = Manifold.euclidean("x y")
    x, y = M.symbols
    region = Polyhedron(M, {"floor": y, "curve": x**2 - y, "right": 2 - x})
    rng = np.random.default_rng(0)
    save_skeleton(skeleton(region, [[1.5, 0.5]], rng=rng), folder / "region.json")
    rod = Arrangement({"A": capsule([-1, 0], [1, 0], 0.3)}, box([-3, 0], [3, 4]))
    start = rod.point({"A": ([0, 1], 0.3)})
    save_skeleton(skeleton(rod.polyhedron, start, rng=rng), folder / "rod.json")
    return folder


def test_a_motion_becomes_a_page_a_film_or_a_file(capsys, saved, tmp_path):
    for suffix, start in (
        (".html", b"<!DOCTYPE"),
        (".gif", b"GIF8"),
        (".glb", b"glTF"),
        (".xyz", b"2\n"),
    ):
        path = tmp_path / f"motion{suffix}"
        code, out, _ = commands.run(capsys, "view", str(saved / "motion.nc"), "--out", str(path))
        assert (code, out) == (0, f"wrote {path}\n")
        assert path.read_bytes().startswith(start)


def test_a_skeleton_of_the_plane_is_a_picture_and_others_are_pages(capsys, saved, tmp_path):
    picture, page = tmp_path / "region.png", tmp_path / "rod.html"
    code, _, _ = commands.run(capsys, "view", str(saved / "region.json"), "--out", str(picture))
    assert code == 0
    with Image.open(picture) as image:
        assert min(image.size) > 300
    code, _, _ = commands.run(capsys, "view", str(saved / "rod.json"), "--out", str(page))
    assert code == 0
    assert "xA, yA, thetaA in units of their scales" in page.read_text()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("bare.nc",), "has no bodies"),
        (("motion.nc", "--out", "a.txt"), "--out: expected a file name that ends in .html, .gif"),
        (("region.json", "--out", "a.txt"), "--out: "),
        (("nowhere.nc",), "cannot be read"),
        (("nowhere.json",), "cannot be read"),
    ],
)
def test_mistakes_are_one_line(capsys, saved, arguments, words, monkeypatch):
    monkeypatch.chdir(saved)
    code, _, err = commands.run(capsys, "view", *arguments)
    assert code == 2
    assert words in err
    assert err.count("\n") == 1


def test_edges_on_the_page_end_at_corners(tab, saved, capsys, tmp_path):
    """Every end of a polyline is at a corner or at the seam of the angle."""
    page = tmp_path / "rod.html"
    commands.run(capsys, "view", str(saved / "rod.json"), "--out", str(page))
    tab.open(page, width=500)
    tab.wait("document.documentElement.dataset.ready === 'yes'")
    assert tab.complaints() == []
    assert tab.requests() == [page.as_uri()]
    count = tab.value("document.querySelectorAll('#contacts li').length")
    ends = tab.value("""[...Array(24).keys()].map((k) => {
      const line = player.stage.scene.getObjectByName(`line ${k}`);
      const points = [...line.geometry.attributes.position.array];
      return [points.slice(0, 3), points.slice(-3)];
    })""")
    corners = np.array(tab.value("[...player.film.places]")).reshape(-1, 3)
    assert count == len(corners) == 16
    apart = [np.linalg.norm(corners - end, axis=1).min() for pair in ends for end in pair]
    assert np.mean(np.array(apart) < 1e-3) > 0.8
