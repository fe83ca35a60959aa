"""Figures of parameter studies: results over one parameter, a curve for each value of another."""

import math
import warnings
from collections.abc import Callable, Iterator, Mapping
from itertools import cycle
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from polycorner.toolkit import SHADES, Array, bridged, checked, refuse

if TYPE_CHECKING:
    import xarray as xr

PAPER = (16.0, 15.0, 2.0)  # measured: length in mm, heading and its fluctuation in degrees
MOST_CURVES = 12  # drawn for a second parameter of many values


@checked
def draw_study(study: str, found: "xr.Dataset") -> Figure | None:
    """Draw an installed study; None for others, and for more than two axes of several values."""
    draw = DRAWN.get(study)
    if study in REPEATED:
        found = _averaged(found, REPEATED[study])
    try:
        across, others = _axes(found)
    except ValueError:
        return None
    return None if draw is None else draw(found.squeeze(), across, others)


def _averaged(found: "xr.Dataset", over: str) -> "xr.Dataset":
    """Return means along an axis of members, with their standard errors as ``<name>_error``."""
    if over not in found.dims:
        return found
    results = found.drop_vars([name for name in found if found[name].dtype.kind not in "iuf"])
    with warnings.catch_warnings(action="ignore", category=RuntimeWarning):  # none, or one member
        count = results.count(over)
        errors = results.std(over, ddof=1) / np.sqrt(count)
        return results.mean(over).merge(errors.rename({n: f"{n}_error" for n in errors}))


def _axes(found: "xr.Dataset") -> tuple[str, str | None]:
    """Return the axis with most values, and the other one that has several."""
    several = [name for name in found["status"].dims if found.sizes[name] > 1]
    numbers = [name for name in several if found[name].dtype.kind in "iuf"]
    if not numbers or len(several) > 2:
        refuse("found", "one or two axes of several values", len(several))
    across = max(numbers, key=lambda name: found.sizes[name])
    return str(across), next((str(name) for name in several if name != across), None)


def _curves(
    found: "xr.Dataset", others: str | None
) -> "Iterator[tuple[str, str | None, xr.Dataset]]":
    """Yield colour, label and results for the values of the second axis."""
    if others is None:
        yield SHADES[1], None, found
        return
    count = found.sizes[others]
    chosen = np.unique(np.linspace(0, count - 1, min(count, MOST_CURVES)).round().astype(int))
    unit = found[others].attrs.get("units", "")
    for colour, k in zip(cycle(SHADES), chosen, strict=False):
        value = found[others].values[k]
        text = f"{value:g}" if found[others].dtype.kind in "iuf" else str(value)
        yield colour, f"{_words(others)} {text}{_after(unit)}", found.isel({others: k})


def _words(name: str) -> str:
    return name.replace("_", " ")


def _after(unit: str) -> str:
    return {"deg": "°", "1": "", "": ""}.get(unit, f" {unit}")


def _axis_label(found: "xr.Dataset", name: str) -> str:
    unit = found[name].attrs.get("units", "")
    shown = {"deg": "degrees", "1": "", "": ""}.get(unit, unit)
    return _words(name) + (f" ({shown})" if shown else "")


def _panels(title: str) -> tuple[Figure, Axes, Axes]:
    figure = Figure(figsize=(12, 5), layout="constrained")
    first, second = figure.subplots(1, 2)
    figure.suptitle(title)
    return figure, first, second


def draw_heading_sweep(found: "xr.Dataset", across: str, others: str | None) -> Figure:
    """Draw the heading of the corner and the smallest of its multipliers.

    Lines are solid where the corner is a certified minimum and dotted elsewhere; the paper's
    ``arctan(r/l)`` is dashed.
    """
    figure, first, second = _panels("Heading of a dyad at its corner, certified")
    x = found[across].values
    papers: list[Array] = []
    for colour, label, curve in _curves(found, others):
        minimal = curve["minimum"].values == 1
        multipliers = [curve[n].values for n in curve.data_vars if "multiplier" in str(n)]
        for axes, y in ((first, curve["heading"].values), (second, np.min(multipliers, axis=0))):
            axes.plot(x, np.where(minimal, y, np.nan), ".-", ms=4, color=colour, label=label)
            axes.plot(x, np.where(bridged(~minimal), y, np.nan), ":", color=colour)
        paper = curve["paper_heading"].values
        if not any(np.allclose(paper, p, equal_nan=True) for p in papers):
            papers.append(paper)
    for k, paper in enumerate(papers):
        first.plot(x, paper, "k--", lw=1.2, label=None if k else "paper, arctan(r/l)")
    if (found["minimum"] == 0).any():
        first.plot([], [], ":", color="0.4", label="corner is no minimum")
    first.set(ylabel="heading (degrees)", xlabel=_axis_label(found, across))
    second.axhline(0, color="0.8", lw=0.8, zorder=0)
    unit = _after(found["multiplier_A2B1"].attrs.get("units", ""))
    label = f"smallest multiplier, dE/dgap{f' ({unit.strip()})' if unit else ''}"
    second.set(ylabel=label, xlabel=_axis_label(found, across))
    first.legend(fontsize=9, frameon=False)
    return figure


def draw_climbing_sweep(found: "xr.Dataset", across: str, others: str | None) -> Figure:
    """Draw climb rates and headings with twice their standard errors; the law is dotted."""
    figure, first, second = _panels("Nested pairs driven by a turning drum")
    for x, colour, label, curve in _side_by_side(found, across, others):
        for axes, name in ((first, "climb_rate"), (second, "heading")):
            _with_bars(axes, x, curve, name, color=colour, label=label)
        first.plot(x, curve["law"].values, ":", color=colour)
    first.plot([], [], ":", color="0.4", label="ω ρ tan(heading)")
    first.axhline(0, color="0.8", lw=0.8, zorder=0)
    first.set(ylabel="climb rate (mm/s)", xlabel=_axis_label(found, across))
    second.set(ylabel="heading (degrees)", xlabel=_axis_label(found, across))
    first.legend(fontsize=9, frameon=False)
    return figure


def _side_by_side(
    found: "xr.Dataset", across: str, others: str | None
) -> "Iterator[tuple[Array, str, str | None, xr.Dataset]]":
    """Yield abscissae, colour, label and results of curves, shifted so that all bars are seen."""
    x = found[across].values
    width = float(np.ptp(x)) / max(1, len(x) - 1)
    curves = list(_curves(found, others))
    for k, (colour, label, curve) in enumerate(curves):
        yield x + 0.04 * width * (k - (len(curves) - 1) / 2), colour, label, curve


def _with_bars(axes: Axes, x: Array, curve: "xr.Dataset", name: str, **looks: Any) -> None:
    """Draw a result with twice its standard error, if there is one."""
    y, bar = curve[name].values, 2 * curve[f"{name}_error"].values
    axes.errorbar(x, y, yerr=bar, ms=4, capsize=3, **{"fmt": "o-", **looks})


def draw_bunch_sweep(found: "xr.Dataset", across: str, others: str | None) -> Figure:
    """Draw how many left, and how many are in dyads at the end, with twice the standard errors."""
    figure, first, second = _panels("Dumbbells of a bunch in a turning drum")
    for x, colour, label, curve in _side_by_side(found, across, others):
        _with_bars(first, x, curve, "left", color=colour, label=label)
        _with_bars(second, x, curve, "in_right", color=colour)
        _with_bars(second, x, curve, "in_left", color=colour, fmt="s:", mfc="white")
    second.plot([], [], "ko-", ms=4, label="in right-handed dyads")
    second.plot([], [], "ks:", ms=4, mfc="white", label="in left-handed dyads")
    for axes, words in ((first, "have left"), (second, "in the drum at the end")):
        axes.set(ylabel=words, xlabel=_axis_label(found, across))
        axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
    second.legend(fontsize=9, frameon=False)
    return figure


def draw_driven_sweep(found: "xr.Dataset", across: str, others: str | None) -> Figure:
    """Draw headings and climb rates of right- and left-handed pairs, with twice the errors."""
    figure, first, second = _panels("Pairs under noise in a turning drum")
    for x, colour, label, curve in _side_by_side(found, across, others):
        for axes, name in ((first, "heading"), (second, "climb_rate")):
            _with_bars(axes, x, curve, f"{name}_right", color=colour, label=label)
            _with_bars(axes, x, curve, f"{name}_left", color=colour, fmt="s:", mfc="white")
    for axes, words in ((first, "heading (degrees)"), (second, "climb rate (mm/s)")):
        axes.axhline(0, color="0.8", lw=0.8, zorder=0)
        axes.set(ylabel=words, xlabel=_axis_label(found, across))
    second.plot([], [], "ko-", ms=4, label="right-handed")
    second.plot([], [], "ks:", ms=4, mfc="white", label="left-handed")
    if across == "length":
        _bounds(first, found[across].values)
        first.legend(fontsize=8, frameon=False, ncols=2, loc="center")
    elif others:
        first.legend(fontsize=9, frameon=False)
    second.legend(fontsize=9, frameon=False)
    return figure


def _bounds(axes: Axes, lengths: Array) -> None:
    """Draw headings of either hand between which noise leaves pairs, and the paper's."""
    from polycorner.dumbbells.drum import DumbbellDrum
    from polycorner.dumbbells.dynamics.dyads import parting_heading

    drums = [DumbbellDrum(float(x)) for x in np.linspace(lengths.min(), lengths.max(), 100)]
    x = np.array([drum.length for drum in drums])
    curves = {
        "parting, arctan(p/s)": ([parting_heading(drum) for drum in drums], "-"),
        "paper, arctan(r/l)": (np.degrees(np.arctan2([d.ball_radius for d in drums], x)), "--"),
        "least energy": ([math.degrees(drum.pair.plane_corner()[0]) for drum in drums], ":"),
    }
    for label, (heading, line) in curves.items():
        for sign in (1, -1):
            y = sign * np.asarray(heading)
            axes.plot(x, y, f"k{line}", lw=1, label=label if sign > 0 else None)
    if lengths.min() <= PAPER[0] <= lengths.max():
        both = np.array([1, -1])
        axes.errorbar(
            [PAPER[0]] * 2, PAPER[1] * both, yerr=PAPER[2], fmt="kD", capsize=3, label="measured"
        )


def draw_turning_sweep(found: "xr.Dataset", across: str, others: str | None) -> Figure:
    """Draw how fast pairs turn, and how fast their impacts would turn them, by their heading.

    With a second axis ``part`` that has "all" and "rolling", a line is the rate by rolling kicks
    alone plus that of the weight, from single dumbbells under all of them.
    """
    figure, first, second = _panels("How fast pairs turn")
    name = "at" if across == "heading" else across  # the heading changes in the meantime
    for colour, label, curve in _curves(found, others):
        x = curve[name].values
        bars = 2 * curve["rate_error"].values
        first.errorbar(x, curve["rate"].values, bars, fmt="o", ms=4, color=colour, label=label)
        second.plot(x, curve["impacts"].values, "o--", ms=4, color=colour, label=label)
    if others == "part" and {"all", "rolling"} <= set(found["part"].values.tolist()):
        rolling, both = found.sel(part="rolling"), found.sel(part="all")
        x = rolling[name].values
        weight = np.interp(x, both[name].values, both["weight"].values)
        first.plot(x, rolling["rate"].values + weight, "k-", lw=1, label="rolling + weight")
    words = ("rate of the heading (degrees/s)", "that of impacts alone (degrees/s)")
    for axes, title in ((first, words[0]), (second, words[1])):
        axes.axhline(0, color="0.8", lw=0.8, zorder=0)
        axes.set(xlabel=_axis_label(found, across), ylabel=title)
    if others:
        first.legend(fontsize=9, frameon=False)
    return figure


REPEATED: Mapping[str, str] = {"bunch": "start"}  # the axis over which to average
DRAWN: Mapping[str, Callable[["xr.Dataset", str, str | None], Figure]] = {
    "heading": draw_heading_sweep,
    "climbing": draw_climbing_sweep,
    "bunch": draw_bunch_sweep,
    "driven": draw_driven_sweep,
    "turning": draw_turning_sweep,
}
