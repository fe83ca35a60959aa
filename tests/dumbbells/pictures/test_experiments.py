"""Figures of the studies in the drum show the numbers that they are given."""

import math
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from drawn_curves import bars
from drum_motions import recorded
from matplotlib.colors import same_color

from polycorner.dumbbells.drum import DumbbellDrum
from polycorner.dumbbells.dynamics.bunch import BunchRun
from polycorner.dumbbells.dynamics.dyads import Steady
from polycorner.dumbbells.dynamics.singles import Mean, Zigzag
from polycorner.dumbbells.dynamics.starts import nested_pair
from polycorner.dumbbells.pictures.experiments import (
    COLOURS,
    LEVEL,
    MINIMISER,
    OTHER_END,
    PAPER,
    TILTED,
    draw_balance,
    draw_climbing,
    draw_exits,
    draw_steady_headings,
)
from polycorner.motion.events import Event, EventKind
from polycorner.pictures.style import save

DRUM = DumbbellDrum()
LENGTHS = (12.0, 16.0, 20.0)


def steady(length, tilt, shift):
    """Return made-up means that depend on their arguments."""
    heading = Mean(100 / length + tilt, 0.1 + tilt, 4)
    drum = replace(DRUM, length=length, tilt=math.radians(tilt))
    rate = Mean(0.01 * length, 0.002, 4)
    return Steady(
        drum=drum,
        chatter=0.4,
        heading=heading,
        shift=Mean(shift, 0.3, 4),
        azimuth=Mean(4.0, 0.1, 4),
        climb_rate=rate,
        early=heading,
        late=heading,
        drift=Mean(0.0, 0.1, 4),
        scatter=1.0,
        samples=20.0,
        held=4,
        count=4,
        minimiser=8.0,
        strata={},
    )


@pytest.fixture(scope="module")
def found():
    return [steady(x, tilt, 0.4 * x + tilt) for tilt in (7.0, 0.0) for x in LENGTHS]


def curve(axes, colour, style=None):
    """Return the points of the one drawn curve in a colour that has many points."""
    (line,) = [
        line
        for line in axes.lines
        if same_color(line.get_color(), colour)
        and len(line.get_xdata()) > 50
        and style in (None, line.get_linestyle())
    ]
    return line.get_xydata()


def least(length, shift):
    """Return the heading of least energy, in degrees, of parallel dumbbells, by search."""
    p = DRUM.ball_radius + DRUM.rod_radius
    theta = np.linspace(0.0, 0.5, 200_001)
    apart = shift * np.sin(theta) - p * np.cos(theta)
    across = length * np.sin(theta)
    energy = sum((a * apart + b * across) ** 2 for a in (-0.5, 0.5) for b in (-0.5, 0.5))
    return math.degrees(theta[np.argmin(energy)])


# -------------------------------------------------------------------------------- steady headings


def test_means_are_drawn_with_two_standard_errors(found):
    figure = draw_steady_headings(found)
    for axes, what in zip(figure.axes, ("heading", "shift"), strict=True):
        shown = bars(axes)
        assert len(shown) == 2
        for (places, halves, _), some in zip(shown, (found[:3], found[3:]), strict=True):
            means = [getattr(one, what) for one in some]
            assert places[:, 0] == pytest.approx(LENGTHS)
            assert places[:, 1] == pytest.approx([mean.value for mean in means])
            assert halves == pytest.approx([2 * mean.error for mean in means])


def test_tilted_are_filled_and_level_are_open(found):
    for axes in draw_steady_headings(found).axes:
        (_, _, tilted), (_, _, level) = bars(axes)
        assert same_color(tilted.get_markerfacecolor(), TILTED)
        assert same_color(level.get_markerfacecolor(), "white")
        assert same_color(level.get_color(), LEVEL)
        names = [text.get_text() for text in axes.get_legend().get_texts()]
        assert names[-2:] == ["simulated, tilt 7°", "simulated, tilt 0°"]


def test_only_the_tilts_that_there_are_are_drawn(found):
    figure = draw_steady_headings(found[:3])
    assert [len(axes.containers) for axes in figure.axes] == [1, 1]


def test_curves_are_headings_of_least_energy(found):
    axes = draw_steady_headings(found).axes[0]
    waist = math.sqrt(36 - 4.5**2)
    for colour, shift in ((MINIMISER, lambda x: x - waist), (OTHER_END, lambda _: waist)):
        points = curve(axes, colour)[::40]
        assert points[:, 1] == pytest.approx([least(x, shift(x)) for x in points[:, 0]], abs=1e-3)
    paper = curve(axes, PAPER)
    assert np.tan(np.radians(paper[:, 1])) == pytest.approx(3 / paper[:, 0])
    names = [text.get_text() for text in axes.get_legend().get_texts()]
    assert names[:3] == ["arctan(r/l)", "least energy (plane)", "least energy, balls side by side"]


def test_shifts_end_where_balls_touch(found):
    """At the ends of the way along the rods, inner balls or neighbouring ones are 2 r apart."""
    axes = draw_steady_headings(found).axes[1]
    for length, corner in curve(axes, MINIMISER):
        assert math.hypot(4.5, length - corner) == pytest.approx(6.0)
    for _, side in curve(axes, OTHER_END):
        assert math.hypot(4.5, side) == pytest.approx(6.0)


def test_the_title_says_sizes_and_noise(found):
    title = draw_steady_headings([*found, replace(found[0], chatter=0.2)]).get_suptitle()
    assert "r = 3 mm, t = 1.5 mm, R = 125 mm" in title
    assert "chatter 0.2, 0.4" in title


# --------------------------------------------------------------------------------------- climbing


def zigzag(heading, rate, slips=4):
    """Return slips every 10 s that rise by 10 s times a rate."""
    starts = 10.0 * np.arange(slips)
    full = np.full(slips, 1.0)
    return Zigzag(
        starts, starts + 1, 0.1 * full, 0.0 * full, heading * full, 0.0 * full, 10 * rate * full
    )


def test_climb_rates_are_drawn_against_headings(found):
    singles = [zigzag(math.radians(angle), 0.02 * angle) for angle in (-10.0, 5.0, 12.0)]
    figure = draw_climbing(singles, DRUM, found)
    (axes,) = figure.axes
    (dots,) = [line for line in axes.lines if line.get_marker() == "o"]
    assert dots.get_xydata() == pytest.approx(
        np.array([[-10.0, -0.2], [5.0, 0.1], [12.0, 0.24]]), abs=1e-9
    )
    shown = bars(axes)
    for (places, halves, line), some in zip(shown, (found[:3], found[3:]), strict=True):
        assert places[:, 0] == pytest.approx([one.heading.value for one in some])
        assert places[:, 1] == pytest.approx([one.climb_rate.value for one in some])
        assert halves == pytest.approx([2 * one.climb_rate.error for one in some])
        colour = COLOURS["left"] if some[0].drum.tilt else LEVEL
        assert same_color(line.get_color(), colour)


def test_the_law_is_that_of_a_keel(found):
    (axes,) = draw_climbing([zigzag(0.2, 0.2)], DRUM, found).axes
    law = curve(axes, MINIMISER)
    assert law[:, 1] == pytest.approx(0.01 * (125 - 3) * np.tan(np.radians(law[:, 0])))
    most = max(math.degrees(0.2), *(abs(one.heading.value) for one in found))
    assert law[-1, 0] == -law[0, 0] == pytest.approx(1.05 * most)


def test_climbing_of_single_dumbbells_alone():
    (axes,) = draw_climbing([zigzag(0.1, 0.1)], DRUM).axes
    assert not axes.containers
    names = [text.get_text() for text in axes.get_legend().get_texts()]
    assert names == ["ω ρ tan θ", "single dumbbells, no noise"]


# ------------------------------------------------------------------------------------------ exits


@pytest.fixture(scope="module")
def bunch():
    """Return a right-handed and a left-handed dyad and a single dumbbell, of which two leave."""
    drum = replace(DRUM, count=5, top=300.0, floor=True)
    q = np.zeros((5, 4))
    for k, (hand, eta) in enumerate((("R", 50.0), ("L", 150.0))):
        q[2 * k : 2 * k + 2, :3] = nested_pair(replace(DRUM, count=2), hand, eta=eta)
    q[4, 1] = 250.0
    times = np.arange(0.0, 41.0)
    present = np.ones((41, 5), dtype=bool)
    present[21:, 4] = present[31:, 0] = False
    exits = ((20.5, 4), (30.5, 0))
    events = tuple(Event(t, EventKind.EXIT, (body,), "", 0.0) for t, body in exits)
    q = np.tile(q, (41, 1, 1))
    return BunchRun(recorded(drum, times, q, present=present, events=events))


def stairs(axes, kind):
    """Return the one line of a kind."""
    (line,) = [line for line in axes.lines if same_color(line.get_color(), COLOURS[kind])]
    return line.get_xydata()


def test_who_leaves_is_counted_up(bunch):
    above = draw_exits({"some": bunch}).axes[0]
    assert stairs(above, "single").tolist() == [[0, 0], [20.5, 1], [40, 1]]
    assert stairs(above, "right").tolist() == [[0, 0], [30.5, 1], [40, 1]]
    assert stairs(above, "left").tolist() == [[0, 0], [40, 0]]
    assert all(line.get_drawstyle() == "steps-post" for line in above.lines)
    assert above.get_title() == "some"


def test_who_is_in_the_drum_is_counted(bunch):
    """When one of the right-handed dyad has left, the other is single."""
    below = draw_exits({"some": bunch}).axes[1]
    at = {kind: dict(stairs(below, kind).tolist()) for kind in ("right", "left", "single")}
    for time, expected in ((0, (2, 2, 1)), (20, (2, 2, 1)), (25, (2, 2, 0)), (40, (0, 2, 1))):
        assert tuple(at[kind][time] for kind in ("right", "left", "single")) == expected
    assert below.get_ylim() == (0, 5)


def test_bunches_stand_side_by_side(bunch, tmp_path):
    nobody = BunchRun(replace(bunch.trajectory, events=()))
    figure = draw_exits({"one": bunch, "two": nobody})
    assert [axes.get_title() for axes in figure.axes[:2]] == ["one", "two"]
    assert stairs(figure.axes[1], "single")[-1].tolist() == [40, 0]
    assert save(figure, tmp_path / "exits.png").read_bytes().startswith(b"\x89PNG")


def test_rates_of_turning_are_drawn_beside_the_sum_of_their_parts():
    names, rng = ("heading", "part", "hand", "strength"), np.random.default_rng(8)
    places = {"heading": [2.0, 8.0, 14.0], "part": ["all", "rolling"], "hand": ["right", "left"]}
    shape = (3, 2, 2, 1)
    data = {n: (names, rng.uniform(size=shape)) for n in ("rate", "rate_error", "weight")}
    at = np.broadcast_to(np.array([2.0, 8.0, 14.0])[:, None, None, None], shape)
    found = xr.Dataset(data | {"at": (names, at)}, places | {"strength": [30.0]})
    for axes, hand in zip(draw_balance(found).axes, ("right", "left"), strict=True):
        one = found.sel(hand=hand, strength=30.0)
        ((shown, halves, _),) = bars(axes)
        np.testing.assert_allclose(shown[:, 1], one["rate"].sel(part="all"))
        np.testing.assert_allclose(halves, 2 * one["rate_error"].sel(part="all"))
        (line,) = [x for x in axes.lines if x.get_label() == "strength 30"]
        expected = one["rate"].sel(part="rolling").values + one["weight"].sel(part="all").values
        np.testing.assert_allclose(line.get_ydata(), expected)
