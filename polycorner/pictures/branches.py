"""Diagrams of equilibria with hysteresis loops, maps of events, cells of proofs."""

from collections.abc import Callable, Mapping, Sequence
from itertools import cycle, product
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import PatchCollection
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
from matplotlib.transforms import BboxBase
from scipy import ndimage
from scipy.interpolate import PchipInterpolator

from polycorner.branches import (
    Arc,
    BranchEvent,
    BranchKind,
    Diagram,
    EventMap,
    Hysteresis,
    MeetingKind,
)
from polycorner.checks import about, choice, real, refuse
from polycorner.kinds import checked
from polycorner.pictures.style import SHADES
from polycorner.spaces.manifold import Array

if TYPE_CHECKING:
    from polycorner.proofs import Proof

Height = str | Callable[[Array], float]

SIZE, FONT = (7.6, 4.6), 8.5  # inches, points
SAMPLES = 12  # pieces of a line between two points of an arc
MARGIN = 0.03  # of the interval at either side
FREE, MARK, LOOP, FALL = "0.2", "0.1", "#F0E442", "#D55E00"
DASHES = (0, (3, 2))
GAP = 7.0  # points between a mark and its name
SIDES = [(1, 1), (-1, 1), (1, -1), (-1, -1), (0, 1), (0, -1), (1, 0), (-1, 0)]
ALIGNED = {1: ("left", "bottom"), 0: ("center", "center"), -1: ("right", "top")}
# Marks and words of events; where the interval ends nothing is marked.
MARKS = {
    BranchKind.FOLD: ("o", "fold"),
    BranchKind.CORNER_LIMIT: ("s", "corner limit"),
    BranchKind.BRANCH: ("X", "branch point"),
    BranchKind.OPENS: ("v", "contact opens"),
    BranchKind.CLOSES: ("^", "contact closes"),
    BranchKind.EXCHANGE: ("D", "contacts exchanged"),
    BranchKind.DEPENDENT: ("P", "gradients dependent"),
    BranchKind.VANISHES: ("*", "component vanishes"),
    BranchKind.RE_ENTRANT: ("<", "another piece begins"),
    BranchKind.FAR: (">", "left the extent"),
    BranchKind.UNDECIDED: ("$?$", "undecided"),
}


@checked
def draw_branches(
    diagram: Diagram,
    of: Height = "",
    *,
    label: str = "",
    parameter: str = "",
    loop: Hysteresis | None = None,
    title: str = "",
) -> Figure:
    """Draw equilibria over their parameter, with the events at which arcs end.

    Minima are full lines, other equilibria dashed; colours tell the active functions.  Marks tell
    the kinds of events, beside them stand the functions that vanish there.  Ends of the interval
    have no marks.

    Parameters
    ----------
    diagram : Diagram
    of : str or callable, optional
        What is drawn over the parameter: the name of a coordinate, ``"energy"``, or a function of
        a point ``(n,)``; default the coordinate if there is but one, else the energy.
    label, parameter : str, optional
        Labels of the axes.
    loop : Hysteresis, optional
        A way along the arcs, which is drawn as a band, with arrows where it jumps.
    title : str, optional

    Raises
    ------
    TypeError, ValueError
        For a name of no coordinate, or a function that returns no number.
    """
    manifold = diagram.problem.polyhedron.manifold
    if of == "":
        of = manifold.names[0] if manifold.size == 1 else "energy"
    if isinstance(of, str):
        choice("of", of, ("energy", *manifold.names))
    figure = Figure(figsize=SIZE, layout="constrained")
    axes = figure.add_subplot()
    drawing = _Drawing(axes, of, manifold.names)
    diagrams = (diagram,) if loop is None else loop.diagrams
    if loop is not None:
        drawing.draw_loop(loop)
    for one in diagrams:
        for arc in one.arcs:
            drawing.draw_arc(arc)
        for event in one.events:
            drawing.draw_event(one, event)
    low, high = diagram.interval
    axes.set(xlabel=parameter or diagram.parameter, title=title)
    axes.set_ylabel(label or (of if isinstance(of, str) else ""))
    axes.set_xlim(low - MARGIN * (high - low), high + MARGIN * (high - low))
    axes.margins(y=2 * MARGIN)
    axes.spines[["top", "right"]].set_visible(False)
    figure.legend(handles=drawing.legend(), loc="outside right upper", frameon=False, fontsize=FONT)
    figure.draw_without_rendering()  # so that it is known how large texts are
    drawing.write_names()
    return figure


class _Drawing:
    """A diagram in the making."""

    def __init__(self, axes: Axes, of: Height, names: tuple[str, ...]) -> None:
        self.axes, self.of, self.names = axes, of, names
        self.shades = cycle(SHADES)
        self.colours: dict[tuple[str, ...], str] = {}
        self.styles: set[bool] = set()
        self.kinds: set[BranchKind] = set()
        self.curves: list[Array] = []
        self.marks: dict[tuple[float, float], str] = {}
        self.loop = False

    def height(self, energy: float, point: Array) -> float:
        """Return what is drawn of a point."""
        if self.of == "energy":
            return energy
        if isinstance(self.of, str):
            return float(point[self.names.index(self.of)])
        with about("of"):
            return real("of", self.of(point))

    def line(self, columns: Array) -> Array:
        """Return the polyline of parameters, energies and points ``(k, 2 + n)``, ``(k, 2)``."""
        return np.array([(row[0], self.height(float(row[1]), row[2:])) for row in columns])

    def draw_arc(self, arc: Arc) -> None:
        x = arc.curve.x
        places = np.interp(np.arange((len(x) - 1) * SAMPLES + 1) / SAMPLES, np.arange(len(x)), x)
        line = self.line(arc.curve(places))
        if arc.active not in self.colours:
            self.colours[arc.active] = next(self.shades) if arc.active else FREE
        style: dict[str, Any] = {"ls": "-", "lw": 2.0} if arc.stable else {"ls": DASHES}
        self.axes.plot(*line.T, color=self.colours[arc.active], zorder=3, **style)
        self.styles.add(arc.stable)
        self.curves.append(line)

    def draw_event(self, diagram: Diagram, event: BranchEvent) -> None:
        if event.kind not in MARKS or not event.arcs:
            return
        arc = diagram.arcs[event.arcs[0]]
        end = int(np.argmin(abs(arc.parameters - event.parameter)))
        height = self.height(float(arc.energies[end]), arc.points[end])
        style: dict[str, Any] = {"ms": 7, "mfc": "white", "mec": MARK, "mew": 1.3, "zorder": 5}
        self.axes.plot(event.parameter, height, marker=MARKS[event.kind][0], **style)
        self.kinds.add(event.kind)
        self.marks[event.parameter, height] = ", ".join(event.functions)

    def draw_loop(self, loop: Hysteresis) -> None:
        style: dict[str, Any] = {"color": LOOP, "lw": 7, "solid_capstyle": "round", "zorder": 1}
        for leg in loop.legs:
            columns = np.column_stack([leg.parameters, leg.energies, leg.points])
            self.axes.plot(*self.line(columns).T, **style)
        for jump in loop.jumps:
            start, end = (
                (jump.parameter, self.height(energy, point))
                for energy, point in zip(jump.energies, (jump.start, jump.end), strict=True)
            )
            arrow = {"arrowstyle": "-|>", "color": FALL, "lw": 1.6, "shrinkA": 4, "shrinkB": 1}
            self.axes.annotate("", end, start, arrowprops=arrow, zorder=4)
            self.axes.update_datalim([start, end])
            self.curves.append(np.linspace(start, end, SAMPLES**2))
        self.loop = True

    def legend(self) -> list[Artist]:
        """Return the entries of what is drawn."""
        words = {True: ("-", 2.0, "minimum"), False: (DASHES, 1.5, "other equilibrium")}
        found: list[Artist] = [
            Line2D([], [], color="0.55", ls=ls, lw=lw, label=label)
            for stable, (ls, lw, label) in words.items()
            if stable in self.styles
        ]
        found += [
            Patch(color=colour, label=", ".join(active) or "no contact")
            for active, colour in sorted(self.colours.items(), key=lambda item: len(item[0]))
        ]
        if self.loop:
            found.append(Line2D([], [], color=LOOP, lw=7, label="quasi-static way"))
            found.append(Line2D([], [], color=FALL, lw=1.6, label="fall"))
        style: dict[str, Any] = {"ls": "", "ms": 6, "mfc": "white", "mec": MARK, "mew": 1.3}
        found += [
            Line2D([], [], marker=mark, label=label, **style)
            for kind, (mark, label) in MARKS.items()
            if kind in self.kinds
        ]
        return found

    def write_names(self) -> None:
        """Write the functions that vanish beside events, where no curve or name is in the way."""
        inside = self.axes.get_window_extent()
        taken: list[BboxBase] = []
        curves = np.vstack([self.axes.transData.transform(line) for line in self.curves])
        for place, words in self.marks.items():
            tried: list[Any] = []
            for (dx, dy), far in product(SIDES, (1, 2)):
                text = self.axes.annotate(
                    words, place, (GAP * far * dx, GAP * far * dy), textcoords="offset points",
                    ha=ALIGNED[dx][0], va=ALIGNED[dy][1], fontsize=FONT, zorder=6,
                )  # fmt: skip
                box = text.get_window_extent()
                hidden = sum(map(box.padded(GAP).contains, *curves.T))
                out = not all(map(inside.contains, *box.corners().T))
                tried.append((out or box.count_overlaps(taken), hidden, len(tried), text, box))
            blocked, *_, chosen, box = min(tried)
            for *_, text, _ in tried:
                if blocked or text is not chosen:
                    text.remove()
            taken.append(box.padded(GAP))


# ---------------------------------------------------- maps of events in the plane of two parameters

MAP_SIZE, MAP_FONT = (6.4, 4.8), 9.0  # inches, points
CELLS = 80  # of the grid on which minima are counted, along each side
LEAST = 12  # cells of a region that is labelled
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
MEETINGS = {
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
    figure = Figure(figsize=MAP_SIZE, layout="constrained")
    axes = figure.add_subplot()
    if minima:
        _shade(axes, found)
    for curve in found.curves:
        _, colour, ls, lw = LINES[curve.kind]
        axes.plot(*_line(curve.parameters).T, color=colour, ls=ls, lw=lw, zorder=3)
    for meeting in found.meetings:
        if meeting.kind in MEETINGS:
            axes.plot(*meeting.parameters, MEETINGS[meeting.kind][0], **_style(7))
    kinds = {curve.kind for curve in found.curves}
    handles = [
        Line2D([], [], color=colour, ls=ls, lw=lw, label=word)
        for kind, (word, colour, ls, lw) in LINES.items()
        if kind in kinds
    ]
    met = {meeting.kind for meeting in found.meetings}
    handles += [
        Line2D([], [], ls="", marker=mark, label=word, **_style(6))
        for kind, (mark, word) in MEETINGS.items()
        if kind in met
    ]
    names = [given or name for given, name in zip(labels, found.parameters, strict=True)]
    axes.set(xlabel=names[0], ylabel=names[1], title=title)
    axes.set(xlim=found.rectangle[0], ylim=found.rectangle[1])
    figure.legend(handles=handles, loc="outside right upper", frameon=False, fontsize=MAP_FONT)
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
                    fontsize=MAP_FONT + 1, color="0.25",
                )  # fmt: skip


# ---------------------------------------------------------------------------------- cells of proofs

COLOURS = {"proved": "#009E73", "failed": "#D55E00", "undecided": "#E69F00"}


@checked
def draw_cells(proof: "Proof", units: Mapping[str, str] | None = None) -> Figure:
    """Draw the cells of a proof over one or two parameters, coloured by what was decided.

    Parameters
    ----------
    proof : Proof
        A proof over a box of parameters.
    units : mapping from str to str, optional
        Labels of the axes by parameter, such as ``{"t": "rod radius t (mm)"}``.

    Raises
    ------
    ValueError
        If the proof has no parameters, or more than two.
    """
    names = list(proof.parameters)
    if len(names) not in (1, 2):
        refuse("proof", "one over one or two parameters", names)
    figure = Figure(figsize=(6.5, 5 if len(names) == 2 else 2), layout="constrained")
    axes = figure.add_subplot()
    for status, colour in COLOURS.items():
        boxes = [
            _rectangle([cell.parameters[name] for name in names])
            for cell in proof.cells
            if cell.status == status
        ]
        axes.add_collection(
            PatchCollection(boxes, facecolor=colour, edgecolor="white", linewidth=0.4)
        )
    labels = dict(units or {})
    axes.set_xlim(*proof.parameters[names[0]])
    axes.set_xlabel(labels.get(names[0], names[0]))
    if len(names) == 2:
        axes.set_ylim(*proof.parameters[names[1]])
        axes.set_ylabel(labels.get(names[1], names[1]))
    else:
        axes.set_ylim(0, 1)
        axes.set_yticks([])
    found = {str(cell.status) for cell in proof.cells}
    axes.legend(
        handles=[Patch(color=c, label=s) for s, c in COLOURS.items() if s in found],
        loc="lower center",
        bbox_to_anchor=(0.5, 1.01),
        ncols=3,
        frameon=False,
    )
    axes.set_title(f"{100 * np.floor(1e4 * proof.proved_fraction) / 1e4:g} % proved", pad=28)
    return figure


def _rectangle(sides: Sequence[tuple[float, float]]) -> Rectangle:
    (left, right), (low, high) = sides if len(sides) == 2 else (sides[0], (0.0, 1.0))
    return Rectangle((left, low), right - left, high - low)
