"""The figure of the keel effect shows boundaries where the forces are on the boundary."""

import math

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from polycorner.dumbbells.pictures.experiments import (
    CURVE,
    GROWING,
    HEADINGS,
    INNER,
    NEGATIVE,
    OUTER,
    POSITIVE,
    draw_keel,
    place_region,
)
from polycorner.dumbbells.statics.keel import Keel, net_torque, rolling_cosine
from polycorner.pictures.style import save

KEEL = Keel(math.radians(7), 0.1, 0.3, 0.05, 0.2)


@pytest.fixture(scope="module")
def figure():
    return draw_keel(KEEL, friction=0.9)


@pytest.fixture(scope="module")
def pixels(figure):
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[::-1, :, :3] / 255


def shade(axes, pixels, phi, theta):
    column, row = axes.transData.transform((phi, theta))
    return pixels[int(row), int(column)]


def curve(axes, colour):
    """Return the drawn points of the one line in a colour, in radians."""
    (line,) = [line for line in axes.lines if line.get_color() == colour]
    points = np.radians(line.get_xydata())
    return points[np.isfinite(points).all(axis=1)].T


@pytest.mark.parametrize(("colour", "sign"), [(POSITIVE, 1), (NEGATIVE, -1)])
def test_the_eastern_boundary_is_one_and_has_the_colour_of_its_headings(figure, colour, sign):
    phi, theta = curve(figure.axes[0], colour)
    assert (sign * theta >= 0).all()
    assert KEEL.onset.margin(phi, theta) == pytest.approx(np.zeros(len(phi)), abs=1e-9)
    assert not KEEL.onset.contains(phi + 1e-6, theta).any()


@pytest.mark.parametrize("panel", [0, 1])
def test_the_curve_has_no_pull_across(figure, panel):
    phi, theta = curve(figure.axes[panel], CURVE)
    inside = abs(phi) < 1.5
    assert rolling_cosine(phi, theta, KEEL.tilt)[inside] == pytest.approx(0, abs=1e-9)


def test_regions_are_filled_where_they_are(figure, pixels):
    axes = figure.axes[0]
    seen = set()
    for phi in range(-22, 23, 2):
        for theta in range(-87, 45, 3):  # below the legend
            margins = [
                region.margin(math.radians(phi), math.radians(theta))
                for region in (KEEL.onset, KEEL.arrest)
            ]
            outer, inner = margins
            if min(map(abs, margins)) < 0.008 or theta in HEADINGS or 0 in (phi, theta):
                continue
            if abs(rolling_cosine(math.radians(phi), math.radians(theta), KEEL.tilt)) < 0.15:
                continue
            colour = INNER if inner > 0 else OUTER if outer > 0 else "white"
            assert shade(axes, pixels, phi, theta) == pytest.approx(to_rgb(colour), abs=0.01)
            seen.add(colour)
    assert seen == {INNER, OUTER, "white"}


def test_arrows_lead_from_where_it_starts_to_roll_to_where_it_stops(figure):
    arrows = [note for note in figure.axes[0].texts if note.arrow_patch is not None]
    assert [note.xy[1] for note in arrows] == list(HEADINGS)
    turning = KEEL.turning(np.radians(HEADINGS))
    assert [note.xyann[0] for note in arrows] == pytest.approx(np.degrees(turning.upper).tolist())
    assert [note.xy[0] for note in arrows] == pytest.approx(np.degrees(turning.coasting).tolist())


def test_where_headings_grow_it_is_hatched(figure, pixels):
    """Hatching is black on the fill; around each point the fill's colour is looked for."""
    axes, tried = figure.axes[1], []
    for phi, theta in [(60, 88), (75, 87), (-60, -88), (60, 60), (60, -88), (-60, 60)]:
        torque = net_torque(math.radians(phi), math.radians(theta), KEEL.tilt, 0.9)
        column, row = (int(x) for x in axes.transData.transform((phi, theta)))
        around = pixels[row - 2 : row + 3, column - 4 : column + 5]
        filled = (abs(around - to_rgb(GROWING)).max(axis=-1) < 0.02).any()
        assert filled == (torque * theta > 0)
        tried.append(filled)
    assert True in tried
    assert False in tried


def test_a_region_alone_has_its_boundary_and_the_curve():
    axes = Figure().add_subplot()
    place_region(axes, KEEL.onset)
    phi, theta = curve(axes, POSITIVE)
    assert KEEL.onset.margin(phi, theta) == pytest.approx(np.zeros(len(phi)), abs=1e-9)
    assert len(axes.lines) == 3
    assert not axes.texts


@pytest.mark.parametrize("tilt", [0.0, 25.0])
def test_level_and_steep_drums_are_drawn_too(tilt, tmp_path):
    """Nothing grows in the first, nothing rests in the second."""
    keel = Keel(math.radians(tilt), 0.1, 0.3, 0.05, 0.2)
    assert save(draw_keel(keel), tmp_path / "keel.png").stat().st_size > 10_000
