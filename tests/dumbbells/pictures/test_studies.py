"""Figures of parameter studies: curves, bars and means against the data."""

import numpy as np
import pytest
import xarray as xr
from drawn_curves import bars
from matplotlib.backends.backend_agg import FigureCanvasAgg

from polycorner.dumbbells.pictures.studies import draw_study
from polycorner.dumbbells.studies import heading
from polycorner.sweeps import sweep

RODS = [1.5, 2.9]


@pytest.fixture(scope="module")
def headings():
    grid = {"length": (np.linspace(8, 32, 7), "mm"), "rod_radius": (RODS, "mm")}
    return sweep(heading, grid)


def test_heading_curves_are_the_datas(headings):
    figure = draw_study("heading", headings)
    FigureCanvasAgg(figure).draw()
    lines = {line.get_label(): line for line in figure.axes[0].lines}
    for k, rod in enumerate(RODS):
        line = lines[f"rod radius {rod:g} mm"]
        rests = headings["minimum"].values[:, k] == 1
        expected = np.where(rests, headings["heading"].values[:, k], np.nan)
        np.testing.assert_array_equal(line.get_ydata(), expected)
    paper = lines["paper, arctan(r/l)"].get_ydata()
    np.testing.assert_allclose(paper[1:], np.degrees(np.arctan(3 / headings["length"].values))[1:])
    assert figure.axes[0].get_xlabel() == "length (mm)"


def test_one_axis_and_a_second_of_one_value_are_drawn_too(headings):
    figure = draw_study("heading", headings.isel(rod_radius=[0]))
    FigureCanvasAgg(figure).draw()
    assert len(figure.axes[0].lines[0].get_xdata()) == 7


def test_climb_rates_have_bars_of_two_standard_errors():
    shape, names = (3, 2), ("noise", "tilt")
    rng = np.random.default_rng(1)
    columns = ("climb_rate", "climb_rate_error", "heading", "heading_error", "law")
    data = {name: (names, rng.uniform(size=shape)) for name in columns}
    data["status"] = (names, np.ones(shape, dtype=np.int8))
    coordinates = {"noise": [0.1, 0.2, 0.3], "tilt": ("tilt", [0.0, 7.0], {"units": "deg"})}
    found = xr.Dataset(data, coordinates)
    figure = draw_study("climbing", found)
    FigureCanvasAgg(figure).draw()
    labels = [one.get_label() for one in figure.axes[0].containers]
    assert labels == ["tilt 0°", "tilt 7°"]
    for k, (places, halves, _) in enumerate(bars(figure.axes[0])):
        np.testing.assert_array_equal(places[:, 1], found["climb_rate"].values[:, k])
        np.testing.assert_allclose(halves, 2 * found["climb_rate_error"].values[:, k])


def test_pairs_of_either_hand_under_noise_are_drawn_with_bars():
    shape, names = (3, 2), ("strength", "scale")
    rng = np.random.default_rng(3)
    columns = [f"{n}_{hand}" for n in ("heading", "climb_rate") for hand in ("right", "left")]
    columns += [f"{name}_error" for name in columns]
    data = {name: (names, rng.uniform(size=shape)) for name in columns}
    data["status"] = (names, np.ones(shape, dtype=np.int8))
    found = xr.Dataset(data, {"strength": [10.0, 20.0, 30.0], "scale": [0.01, 0.03]})
    for axes, name in zip(draw_study("driven", found).axes, ("heading", "climb_rate"), strict=True):
        for k, (places, halves, _) in enumerate(bars(axes)):
            column = f"{name}_{('right', 'left')[k % 2]}"
            values = [found[n].values[:, k // 2] for n in (column, f"{column}_error")]
            np.testing.assert_array_equal(places[:, 1], values[0])
            np.testing.assert_allclose(halves, 2 * values[1])


def test_lengths_of_driven_pairs_come_with_the_bounds_of_their_headings():
    columns = [f"{n}_{hand}" for n in ("heading", "climb_rate") for hand in ("right", "left")]
    columns += [f"{name}_error" for name in columns]
    data = {name: (("length",), np.ones(2)) for name in columns}
    data["status"] = (("length",), np.ones(2, dtype=np.int8))
    axes = draw_study("driven", xr.Dataset(data, {"length": [12.0, 24.0]})).axes[0]
    lines = {line.get_label(): line.get_ydata() for line in axes.lines}
    ends = {
        "parting, arctan(p/s)": (29.27, 12.66),
        "paper, arctan(r/l)": (14.04, 7.13),
        "least energy": (10.50, 5.33),
    }
    for label, values in ends.items():
        assert lines[label][[0, -1]] == pytest.approx(values, abs=0.01)


def test_the_rate_of_turning_is_drawn_with_its_two_parts():
    names, rng = ("heading", "part"), np.random.default_rng(6)
    columns = ("rate", "rate_error", "weight", "impacts")
    data = {name: (names, rng.uniform(size=(3, 2))) for name in columns}
    data["at"] = (names, np.array([[2.0, 2.0], [8.0, 8.0], [14.0, 14.0]]))
    data["status"] = (names, np.ones((3, 2), dtype=np.int8))
    found = xr.Dataset(data, {"heading": [2.0, 8.0, 14.0], "part": ["all", "rolling"]})
    lines = {line.get_label(): line for line in draw_study("turning", found).axes[0].lines}
    expected = found["rate"].values[:, 1] + found["weight"].values[:, 0]
    np.testing.assert_allclose(lines["rolling + weight"].get_ydata(), expected)


def test_members_of_an_ensemble_are_averaged():
    names, rng = ("rubbing", "start", "top"), np.random.default_rng(2)
    data = {name: (names, rng.integers(9, size=(2, 5, 3))) for name in ("left", "in_left")}
    data["in_right"] = (names, np.where(rng.random((2, 5, 3)) < 0.2, np.nan, 3.0))
    data["status"] = (names, np.ones((2, 5, 3), dtype=np.int8))
    data["message"] = (names, np.full((2, 5, 3), "", dtype=object))
    found = xr.Dataset(data, {"rubbing": [0.1, 0.3], "start": range(5), "top": [50, 60, 70]})
    figure = draw_study("bunch", found)
    FigureCanvasAgg(figure).draw()
    labels = [one.get_label() for one in figure.axes[0].containers]
    assert labels == ["rubbing 0.1", "rubbing 0.3"]
    first, second = map(bars, figure.axes)
    for left, (places, halves, _) in zip(found["left"].values, first, strict=True):
        np.testing.assert_allclose(places[:, 1], left.mean(axis=0))
        np.testing.assert_allclose(halves, 2 * left.std(axis=0, ddof=1) / np.sqrt(5))
    np.testing.assert_allclose(second[0][0][:, 1], 3.0)  # of those that were computed


def test_one_member_has_no_bar():
    names = ("start", "top")
    data = {name: (names, [[1, 2]]) for name in ("left", "in_left", "in_right", "status")}
    figure = draw_study("bunch", xr.Dataset(data, {"start": [0], "top": [50.0, 60.0]}))
    FigureCanvasAgg(figure).draw()
    assert figure.axes[0].containers[0][0].get_ydata().tolist() == [1, 2]


def test_other_studies_and_more_axes_have_no_figure(headings):
    assert draw_study("mine:own", headings) is None
    assert draw_study("heading", headings.expand_dims(drum_radius=[50.0, 125.0])) is None
    assert draw_study("heading", headings.isel(length=[0], rod_radius=[0])) is None
