"""Figures and movies of the drum show where the dumbbells are."""

import math
import subprocess
from dataclasses import replace

import numpy as np
import pytest
from drum_motions import moved
from matplotlib.colors import to_rgb
from PIL import Image

from polycorner.dumbbells.drum import DumbbellDrum
from polycorner.dumbbells.dynamics import starts as drum_starts
from polycorner.dumbbells.dynamics.pairs import dyads
from polycorner.dumbbells.pictures import movies
from polycorner.dumbbells.pictures.drum import AVERAGE, SINGLE, DrumView, draw_drum, draw_history
from polycorner.dumbbells.pictures.symbols import HANDS
from polycorner.motion.noise import Noise
from polycorner.motion.simulation import simulate
from polycorner.pictures import films
from polycorner.pictures.style import BODIES, save

NOISE = Noise(chatter=0.2, seed=1)


@pytest.fixture(scope="module")
def one():
    drum = DumbbellDrum()
    return simulate(drum, drum.state([[0.08, 20.0, 0.2]]), 2.0, 1e-3, noise=NOISE, every=50)


@pytest.fixture(scope="module")
def two():
    drum = DumbbellDrum(count=2)
    q = drum_starts.nested_pair(drum, "R", eta=40.0) + np.array([0.09, 0.0, 0.0])
    return simulate(drum, drum.state(q), 2.0, 1e-3, noise=NOISE, every=50)


@pytest.fixture(scope="module")
def many():
    """Seven dumbbells: two dyads of different hands, the first slid, among them; one leaves."""
    drum = DumbbellDrum(count=7, floor=True, top=150.0)
    q = np.zeros((7, 3))
    q[:2] = drum.pair.nested("R", heading=0.0, clearance=0.05).reshape(2, 3)
    q[:2, 1] += [30.0, 26.0]  # the inner balls have parted by 4 mm
    q[2:4] = drum_starts.nested_pair(DumbbellDrum(count=2), "L", eta=100.0)
    q[4:, :2] = [[0.08, 60.0], [-0.08, 60.0], [0.0, 130.0]]
    path = simulate(drum, drum.state(q), 0.5, 1e-3, every=25)
    present = path.present.copy()
    present[10:, 6] = False
    return replace(path, present=present)


def lines(axes, colour):
    return [line for line in axes.lines if to_rgb(line.get_color()) == to_rgb(colour)]


def test_the_history_of_one_is_its_coordinates(one):
    panels = draw_history(one).axes
    q = one.q[:, 0]
    for axes, values in zip(
        panels, (np.degrees(q[:, 0]), q[:, 1], np.degrees(q[:, 2])), strict=True
    ):
        (line,) = lines(axes, BODIES[0])
        np.testing.assert_array_equal(line.get_xdata(), one.times)
        np.testing.assert_allclose(line.get_ydata(), values, atol=1e-12)
        low, high = axes.get_ylim()
        assert low < values.min() <= values.max() < high
        assert high - low >= 4 - 1e-9


def test_the_history_of_two_has_their_average(two):
    panels = draw_history(two).axes
    q = two.q
    for k, (axes, unit) in enumerate(
        zip(panels, (math.degrees(1), 1, math.degrees(1)), strict=True)
    ):
        first, second = (lines(axes, colour)[0].get_ydata() for colour in BODIES)
        (average,) = lines(axes, AVERAGE)
        np.testing.assert_allclose([first, second], unit * q[:, :, k].T, atol=1e-9)
        np.testing.assert_allclose(average.get_ydata(), (first + second) / 2, atol=1e-9)
    assert [text.get_text() for text in panels[0].get_legend().get_texts()] == [
        "dumbbell 1",
        "dumbbell 2",
        "average",
    ]


def test_the_history_of_many_marks_dyads(many):
    for axes in draw_history(many).axes:
        assert len(lines(axes, SINGLE)) == 7
        assert len(lines(axes, HANDS["R"])) == len(lines(axes, HANDS["L"])) == 2
        (gone,) = [line for line in lines(axes, SINGLE) if np.isnan(line.get_ydata()).any()]
        assert np.isnan(gone.get_ydata()).tolist() == [k >= 10 for k in range(len(many))]


def test_a_heading_beyond_a_right_angle_comes_in_on_the_other_side(one):
    q = one.q.copy()
    q[:, 0, 2] = np.radians(np.linspace(80, 100, len(q)))
    figure = draw_history(replace(one, q=q))
    shown = lines(figure.axes[2], BODIES[0])[0].get_ydata()
    broken = np.isnan(shown)
    assert broken.sum() == 1  # the line does not run across
    assert np.nanmax(shown) <= 90
    assert shown[-1] == pytest.approx(-80)


def shapes(view):
    return [path.vertices[:-1] for path in view.balls.get_paths()], [
        path.vertices[:-1] for path in view.rods.get_paths()
    ]


@pytest.mark.parametrize("index", [0, 7, -1])
def test_bodies_are_drawn_where_they_are(two, index):
    view = DrumView(two)
    view.show(index)
    balls, rods = shapes(view)
    phi, eta, theta, _ = two.q[index].T
    centres = [
        [122 * (p + math.asin(e * 8 * math.sin(t) / 122)), z + e * 8 * math.cos(t)]
        for p, z, t in zip(phi, eta, theta, strict=True)
        for e in (-1, 1)
    ]
    for outline, centre in zip(balls, centres, strict=True):
        np.testing.assert_allclose(np.hypot(*(outline - centre).T), 3.0, rtol=1e-12)
    for corners, start, stop in zip(rods, centres[::2], centres[1::2], strict=True):
        assert math.dist(corners[0], corners[3]) == pytest.approx(3.0)
        np.testing.assert_allclose((corners[0] + corners[3]) / 2, start, atol=1e-9)
        np.testing.assert_allclose((corners[1] + corners[2]) / 2, stop, atol=1e-9)
    low, high = view.axes.get_ylim()
    left, right = view.axes.get_xlim()
    for outline in balls:
        assert left < outline[:, 0].min() <= outline[:, 0].max() < right
        assert low < outline[:, 1].min() <= outline[:, 1].max() < high


def test_dyads_are_coloured_and_who_left_is_not_drawn(many):
    view = DrumView(many)
    view.show(0)
    assert dyads(many, 0) == [(0, 1, "R"), (2, 3, "L")]
    colours = [tuple(colour[:3]) for colour in view.rods.get_facecolor()]
    assert colours == [to_rgb(c) for c in [HANDS["R"]] * 2 + [HANDS["L"]] * 2 + [SINGLE] * 3]
    view.show(-1)
    assert len(view.rods.get_paths()) == 6
    assert len(view.balls.get_paths()) == 12
    assert "1 left" in view.words.get_text()


def test_bottom_and_top_are_drawn(many, one):
    assert any(line.get_linestyle() == ":" for line in draw_drum(many).axes[0].lines)
    assert not any(line.get_linestyle() == ":" for line in draw_drum(one).axes[0].lines)


@pytest.mark.parametrize(("count", "spin"), [(1, 0.0), (1, -0.5), (3, 0.5)])
def test_the_legend_explains_every_colour_line_and_arrow(count, spin):
    drum = DumbbellDrum(count=count, spin=spin)
    places = np.zeros((2, count, 3)) + np.array([0.0, 30.0, 0.0]) * np.arange(count)[:, None]
    figure = draw_drum(moved(drum, places))
    (legend,) = figure.legends
    handles = dict(
        zip((t.get_text() for t in legend.get_texts()), legend.legend_handles, strict=True)
    )
    assert ("motion of the wall" in handles) is (spin != 0)
    assert handles["lowest line of the drum"].get_linestyle() == "--"
    if count > 1:
        colours = {to_rgb(handle.get_color()) for handle in handles.values()}
        drawn = {tuple(face[:3]) for face in figure.axes[0].collections[1].get_facecolor()}
        assert drawn <= colours


def test_figures_can_be_saved(one, two, many, tmp_path):
    for number, motion in enumerate((one, two, many)):
        for draw in (draw_history, draw_drum):
            path = save(draw(motion), tmp_path / f"{draw.__name__}{number}.png")
            assert np.asarray(Image.open(path).convert("L")).std() > 1


# ------------------------------------------------------------------------------------------- movies


def green(picture):
    """Return where a picture shows right-handed dyads."""
    target = np.array(to_rgb(HANDS["R"])) * 255
    return np.abs(np.asarray(picture, dtype=float) - target).max(axis=-1) < 40


def test_a_gif_shows_the_motion(two, tmp_path):
    told = []
    path = movies.write_movie(
        two, tmp_path / "deep" / "two.gif", frames=5, progress=lambda *x: told.append(x)
    )
    assert told == [(k, 5) for k in range(1, 6)]
    with Image.open(path) as movie:
        assert movie.n_frames == 5
        frames = []
        for number in range(5):
            movie.seek(number)
            frames.append(np.asarray(movie.convert("RGB")))
    assert all(green(frame).sum() > 1000 for frame in frames)
    assert (green(frames[0]) != green(frames[-1])).sum() > 500
    assert [entry.name for entry in path.parent.iterdir()] == ["two.gif"]


def test_an_mp4_shows_the_motion(two, tmp_path):
    ffmpeg = pytest.importorskip("imageio_ffmpeg")
    path = movies.write_movie(two, tmp_path / "two.mp4", frames=6, rate=10)
    width, height = (int(x) // 2 * 2 for x in DrumView(two).figure.get_size_inches() * movies.DOTS)
    raw = ("-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24", "-")
    command = [ffmpeg.get_ffmpeg_exe(), "-i", str(path), *raw]
    content = subprocess.run(command, check=True, capture_output=True).stdout
    frames = np.frombuffer(content, np.uint8).reshape(-1, height, width, 3)
    assert len(frames) == 6
    assert all(green(frame).sum() > 1000 for frame in frames)
    assert (green(frames[0]) != green(frames[-1])).sum() > 500


@pytest.mark.parametrize("count", [1, 2, 7, 300, 301, 12345])
@pytest.mark.parametrize("most", [1, 2, 300])
def test_frames_are_spread_over_the_record(count, most):
    numbers = movies.chosen_frames(count, most)
    assert len(numbers) == min(count, most)
    assert numbers[0] == 0
    assert len(numbers) == 1 or numbers[-1] == count - 1
    steps = np.diff(numbers)
    assert len(steps) == 0 or steps.max() - steps.min() <= 1


def test_a_movie_that_cannot_be_written_gets_a_sentence(two, tmp_path, monkeypatch):
    with pytest.raises(ValueError, match=r"^path: expected a file name that ends in \.mp4 or"):
        movies.write_movie(two, tmp_path / "two.avi")
    monkeypatch.setattr(films, "can_encode", lambda: False)
    assert films.movie_suffix() == ".gif"
    with pytest.raises(ValueError, match=r"^path: .*polycorner\[movies\]"):
        movies.write_movie(two, tmp_path / "two.mp4")
    assert list(tmp_path.iterdir()) == []


def test_a_movie_that_fails_leaves_nothing(two, tmp_path):
    def failing(_done, _all):
        raise RuntimeError

    with pytest.raises(RuntimeError):
        movies.write_movie(two, tmp_path / "two.gif", frames=3, progress=failing)
    assert list(tmp_path.iterdir()) == []
