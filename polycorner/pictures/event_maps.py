"""Maps of the events of equilibria in the plane of two parameters."""

from typing import Any

import numpy as np
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from scipy import ndimage
from scipy.interpolate import PchipInterpolator

from polycorner.branches import BranchKind, EventMap, MeetingKind
from polycorner.kinds import checked
from polycorner.pictures.style import SHADES
from polycorner.spaces.manifold import Array

SIZE, FONT = (6.4, 4.8), 9.0  # inches, points
CELLS = 80  # of the grid on which minima are counted, along each side
LEAST = 12  # cells of a region that is labelled
SAMPLES = 12  # pieces of a line between two points of a curve
LINES = {
    BranchKind.OPENS: ("contact changes", SHADES[0], "-", 1.6),
    BranchKind.EXCHANGE: ("contacts exchanged", SHADES[5], "-", 1.6),
    BranchKind.CORNER_LIMIT: ("corner limit", SHADES[3], "-", 2.4),
    BranchKind.FOLD: ("fold", SHADES[1], "-", 2.4),
    BranchKind.BRANCH: ("branch point", SHADES[2], "-", 1.6),
    BranchKind.DEPENDENT: ("gradients dependent", SHADES[4], "-", 2.4),
    BranchKind.VANISHES: ("component vanishes", SHADES[4], "--", 2.4),
    BranchKind.RE_ENTRANT: ("another piece begins", SHADES[4], ":", 2.4),
    BranchKind.UNDECIDED: ("not decided", "0.4", ":", 1.6),
}
MARKS = {
    MeetingKind.CUSP: ("^", "cusp"),
    MeetingKind.FOLD_AT_CONTACT: ("s", "fold at a contact change"),
    MeetingKind.FOLD_AT_BRANCH: ("X", "fold at a branch point"),
    MeetingKind.CONTACTS: ("o", "several contacts change"),
    MeetingKind.DEPENDENT: ("P", "gradients dependent, too"),
    MeetingKind.UNDECIDED: ("$?$", "not decided"),
}


@checked
def draw_event_map(
    found: EventMap, *, labels: tuple[str, str] = ("", ""), minima: bool = True, title: str = ""
) -> Figure:
    """Draw curves of events by kind, the points at which they meet, and the number of minima.

    Parameters
    ----------
    found : EventMap
    labels : (str, str), optional
        Labels of the axes; default the names of the parameters.
    minima : bool, optional
        Whether regions are shaded by, and labelled with, the number of minima that are connected
        with the start, as far as it is known.
    title : str, optional
    """
    figure = Figure(figsize=SIZE, layout="constrained")
    axes = figure.add_subplot()
    if minima:
        _shade(axes, found)
    for curve in found.curves:
        _, colour, ls, lw = LINES[curve.kind]
        axes.plot(*_line(curve.parameters).T, color=colour, ls=ls, lw=lw, zorder=3)
    for meeting in found.meetings:
        if meeting.kind in MARKS:
            axes.plot(*meeting.parameters, MARKS[meeting.kind][0], **_style(7))
    kinds = {curve.kind for curve in found.curves}
    handles = [
        Line2D([], [], color=colour, ls=ls, lw=lw, label=word)
        for kind, (word, colour, ls, lw) in LINES.items()
        if kind in kinds
    ]
    met = {meeting.kind for meeting in found.meetings}
    handles += [
        Line2D([], [], ls="", marker=mark, label=word, **_style(6))
        for kind, (mark, word) in MARKS.items()
        if kind in met
    ]
    names = [given or name for given, name in zip(labels, found.parameters, strict=True)]
    axes.set(xlabel=names[0], ylabel=names[1], title=title)
    axes.set(xlim=found.rectangle[0], ylim=found.rectangle[1])
    figure.legend(handles=handles, loc="outside right upper", frameon=False, fontsize=FONT)
    return figure


def _style(size: float) -> dict[str, Any]:
    return {"ms": size, "mfc": "white", "mec": "0.1", "mew": 1.3, "zorder": 5}


def _line(points: Array) -> Array:
    """Return points of a smooth curve through given ones."""
    moved = np.linalg.norm(np.diff(points, axis=0) / np.ptp(points, axis=0).max(), axis=1)
    kept = np.concatenate([[True], moved > 0])
    if kept.sum() < 2:
        return points
    along = np.concatenate([[0.0], np.cumsum(moved)])[kept]
    fine = np.interp(np.linspace(0, 1, SAMPLES * len(along)), np.linspace(0, 1, len(along)), along)
    return np.asarray(PchipInterpolator(along, points[kept])(fine))


def _shade(axes: Any, found: EventMap) -> None:
    """Shade regions by the number of minima, and label each where it is widest."""
    first, second = (
        low + (np.arange(CELLS) + 0.5) / CELLS * (high - low) for low, high in found.rectangle
    )
    counts = np.array(
        [[found.minima(s, r) for s in first.tolist()] for r in second.tolist()], float
    )
    known = counts[np.isfinite(counts)]
    if not len(known):
        return
    shades = LinearSegmentedColormap.from_list("minima", ["white", "0.82"])
    extent = tuple(np.ravel(found.rectangle).tolist())
    ends = {"vmin": known.min(), "vmax": max(known.max(), known.min() + 1)}
    axes.imshow(counts, cmap=shades, origin="lower", extent=extent, aspect="auto", zorder=0, **ends)
    for count in np.unique(known).tolist():
        regions, several = ndimage.label(counts == count)
        for k in range(1, several + 1):
            region = np.pad(regions == k, 1)
            if region.sum() >= LEAST:
                inside = ndimage.distance_transform_edt(region)[1:-1, 1:-1]
                row, column = np.unravel_index(int(np.argmax(inside)), inside.shape)
                axes.text(
                    first[column], second[row], f"{count:.0f}", ha="center", va="center",
                    fontsize=FONT + 1, color="0.25",
                )  # fmt: skip
