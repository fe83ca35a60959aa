"""The figure of the wells shows what was computed and measured."""

import math

import numpy as np
import pytest
from matplotlib.colors import same_color

from polycorner import Entrapment
from polycorner.dumbbells import DumbbellPair
from polycorner.dumbbells.pictures.wells import COLOURS, RIMS, SHAKEN, draw_wells
from polycorner.dumbbells.statics.wells import dyad_holds
from polycorner.models.wells.holding import Comparison, Escapes
from polycorner.models.wells.wells import KINDS, Well
from polycorner.pictures.style import save

PAIR = DumbbellPair(length=16, ball_radius=3, rod_radius=1.5, drum_radius=125)


@pytest.fixture(scope="module")
def comparison():
    """Return made-up numbers, all different."""
    wells = tuple(Well.of_depth(kind, 2.0, drag=1.0) for kind in KINDS)
    elastic = Well.of_depth(Entrapment.HALF_V, 2.0, drag=1.0, restitution=1.0)
    times = np.random.default_rng(0).exponential(10.0, 50)
    runs = tuple(
        Escapes(well, 1.0, (k + 1) * times, 1e3) for k, well in enumerate([*wells, elastic])
    )
    drags, losses = np.array([0.5, 1.0, 4.0]), np.array([0.0, 0.5, 1.0])
    by_drag = np.array([[1.0, 2.0, 4.0], [2.0, 3.0, 4.0], [7.0, 5.0, 3.0]])
    by_loss = np.array([[2.0, 2.0, 2.0], [6.0, 4.0, 2.0], [9.0, 5.0, 1.0]])
    return Comparison(wells, 1.0, drags, by_drag, losses, by_loss, runs)


@pytest.fixture(scope="module")
def panels(comparison):
    return draw_wells(comparison, PAIR).axes


def lines(axes, colour, style="-"):
    """Return the points of drawn curves of more than two points in a colour."""
    found = [line for line in axes.lines if same_color(line.get_color(), colour)]
    return [line.get_xydata() for line in found if line.get_linestyle() == style]


def test_panels_are_named_in_order(panels):
    assert [axes.get_title()[:3] for axes in panels] == [f"({letter})" for letter in "abcdefgh"]
    assert all(axes.get_xlabel() for axes in panels)


def test_wells_are_drawn_as_they_are(panels, comparison):
    for well in comparison.wells:
        (curve,) = lines(panels[0], COLOURS[well.kind])
        assert curve[:, 1] == pytest.approx(well.potential(curve[:, 0]) / well.depth)
        assert curve[-1].tolist() == [1.0, 1.0]
        assert curve[0, 0] == (0.0 if well.wall else -1.0)


def test_paths_stay_between_bottom_and_rim_until_they_end(panels):
    for rank, kind in enumerate(reversed(KINDS)):
        curve = max(lines(panels[1], COLOURS[kind]), key=len) - [0.0, 1.5 * rank]
        assert curve[:, 1].min() >= -1e-9
        assert curve[:, 1].max() <= 1 + 1e-9
        marks = lines(panels[1], COLOURS[kind], "None")
        assert len(marks) == (curve[-1, 0] < 0.99 * SHAKEN)
        if marks:
            assert marks[0][0, 0] == pytest.approx(curve[-1, 0], abs=0.5)


def test_times_are_drawn_as_multiples_of_those_of_u(panels, comparison):
    for panel, where, times in (
        (panels[2], comparison.drags, comparison.over_drag),
        (panels[3], comparison.restitutions, comparison.over_restitution),
    ):
        for kind, row in zip(KINDS, times, strict=True):
            curve = max(lines(panel, COLOURS[kind]), key=len)
            assert curve[:, 0] == pytest.approx(where)
            assert curve[:, 1] == pytest.approx(row / times[0])


def test_simulations_are_points_with_bars(panels, comparison):
    """Two of them behind absorbing walls; the elastic one only by restitution."""
    assert [len(panel.containers) for panel in panels[2:4]] == [2, 3]
    bars = [*panels[2].containers, *panels[3].containers]
    shown = [bar.lines[0].get_ydata()[0] for bar in bars]
    first, *others = (run.mean for run in comparison.runs)
    assert shown == pytest.approx([mean / first for mean in [*others[:2], *others]])
    for bar in bars:
        ((low, high),) = [segment[:, 1] for segment in bar.lines[2][0].get_segments()]
        mean = bar.lines[0].get_ydata()[0]
        assert low < mean < high
        assert low * high == pytest.approx(mean**2)


def test_captured_masses_lose_energy_until_the_dashed_line(panels):
    for kind in KINDS:
        curve = max(lines(panels[4], COLOURS[kind]), key=len)
        shown = curve[np.isfinite(curve[:, 1])]
        assert (np.diff(shown[:, 1]) < 0).all()
        (end,) = lines(panels[4], COLOURS[kind], "--")
        assert shown[-1, 0] <= end[0, 0] * (1 + 1e-9)
        assert curve[-1, 0] == pytest.approx(end[0, 0], rel=1e-3)


def test_only_half_v_rests_at_its_wall(panels):
    for kind in KINDS:
        ((*_, curve),) = [lines(panels[5], COLOURS[kind])]
        spread = curve[1:-1, 0]
        if kind is Entrapment.HALF_V:
            assert abs(spread).max() < 1e-9
        else:
            assert 0.015 < abs(spread).max() < 0.021
        assert curve[-1, 1] == 1.0


def test_holds_of_the_dyad_are_drawn_once_each(panels):
    holds = dyad_holds(PAIR)[:5]
    curves = [line.get_xydata() for line in panels[6].lines if line.get_linestyle() == "-"]
    assert len(curves) == 4  # two contacts with rods are alike
    for curve, hold in zip(curves, [holds[0], holds[1], holds[3], holds[4]], strict=True):
        s = curve[:, 0]
        assert curve[:, 1] == pytest.approx(1e3 * (hold.slope * s + hold.stiffness * s**2 / 2))
    names = [text.get_text() for text in panels[7].get_legend().get_texts()]
    assert names[1] == "half-V:  A2b, aB1"
    times = [line.get_xydata() for line in panels[7].lines if line.get_linestyle() == "-"]
    times = [row for row in times if len(row) == len(RIMS)]
    assert len(times) == 4
    assert all((np.diff(row[np.isfinite(row[:, 1]), 1]) > 0).all() for row in times)
    assert not any(math.isnan(row[0, 1]) for row in times)


def test_saved_as_an_image(panels, tmp_path):
    path = save(panels[0].figure, tmp_path / "wells.png")
    assert path.read_bytes().startswith(b"\x89PNG")
