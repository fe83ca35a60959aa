"""Figures of landscapes: the tree of minima and passes, and barcodes."""

from collections.abc import Callable, Sequence
from itertools import count
from math import isfinite
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import MaxNLocator

from polycorner import checks
from polycorner.checks import about, real, refuse
from polycorner.kinds import checked
from polycorner.landscapes import Landscape, Minimum, Pass
from polycorner.pictures.regions import MINIMA, SIDE
from polycorner.pictures.style import SHADES
from polycorner.pictures.trees import Crossbar, DrawnTree, tree_of
from polycorner.polyhedra.nerves import Nerve
from polycorner.spaces.manifold import Array
from polycorner.values import cached_property

Height = Callable[[float], float]
Draw = Callable[[Axes, Array], None]

TALL, LEAST_WIDE, MOST_WIDE = 4.6, 2.6, 15.0  # inches of the tree
PITCH = (0.24, 1.15)  # least and greatest distance of leaves, in inches
PICTURE, ROW, COLUMN = 0.85, 0.24, 1.0  # inches: sides of a picture, lines, a column of texts
TALLER = 1.7  # sides of pictures below minima, at most
LETTER, LINE, FONT = 0.075, 0.17, 9.0  # inches of a letter, of a line, points
EDGE = 0.12  # inches between things
MARKS = {"saddle": "o", "tip": "^", "locus": "D", "exit": ">"}
WORDS = {
    "saddle": "saddle",
    "tip": "tip of an obstacle",
    "locus": "set of saddles",
    "exit": "way out of the region",
}
STEM, GUIDE, OPEN = "0.25", "0.8", "#E69F00"


@checked
def draw_landscape(
    landscape: Landscape,
    *,
    pictures: Draw | None = None,
    names: Sequence[str] | None = None,
    pass_names: Sequence[str] | None = None,
    height: Height | None = None,
    label: str = "energy",
    loops: bool = False,
    title: str = "",
) -> Figure:
    """Draw the disconnectivity graph of a landscape: how components merge as the energy rises.

    A line stands on each minimum and ends where its component merges with a deeper one.  Marks on
    the bars tell the kinds of passes; they are hollow where a side is not verified.  A bar is a
    band where the energy of its pass is known between two bounds that are seen to differ.  Hatched
    bands across the figure are passes that are not decided: what is above one may be joined there.
    Passes are listed at the right, images of each other once; where there is no room for all, those
    at which deep components end.  Dotted lines lead to the outside of a region, a grey edge at
    the right; the dashed line is the ``cap``.

    Parameters
    ----------
    landscape : Landscape
    pictures : callable, optional
        ``pictures(axes, point)`` draws the configuration at a point ``(n,)`` into empty axes; it
        is shown below each minimum and beside each pass.
    names, pass_names : sequence of str, optional
        For each minimum and each pass; default their numbers.
    height : callable, optional
        The height at which an energy is drawn, an increasing function; default the energy.
    label : str, optional
        What the height is, with its unit.
    loops : bool, optional
        Also mark passes both of whose sides are joined below them.
    title : str, optional

    Raises
    ------
    TypeError, ValueError
        For another number of names.
    """
    shown = named("names", names, landscape.minima, "{}")
    passes = named("pass_names", pass_names, landscape.passes, "pass {}")
    return _TreeFigure(landscape, pictures, shown, passes, checked_height(height), loops).drawn(
        label, title
    )


def named(argument: str, given: Sequence[str] | None, every: Sequence[Any], form: str) -> list[str]:
    """Return texts for all, those of a form where none are given."""
    if given is None:
        return [form.format(k) for k in range(len(every))]
    if isinstance(given, str) or len(given) != len(every):
        refuse(argument, f"{len(every)} texts", given if isinstance(given, str) else len(given))
    return list(given)


def checked_height(height: Height | None) -> Height:
    """Return the function that tells heights, and checks that they are numbers."""
    if height is None:
        return float
    return lambda energy: real("height", height(energy))


def draw_into(axes: Axes, pictures: Draw, point: Array) -> None:
    """Draw the configuration at a point into axes without ticks and frame."""
    with about("pictures"):
        pictures(axes, point)
    axes.set_axis_off()


class _TreeFigure:
    """A figure in the making; places are in inches from its lower left corner."""

    def __init__(
        self,
        landscape: Landscape,
        pictures: Draw | None,
        names: list[str],
        pass_names: list[str],
        height: Height,
        loops: bool,
    ) -> None:
        self.landscape, self.pictures, self.names = landscape, pictures, names
        self.pass_names, self.height = pass_names, height
        self.tree: DrawnTree = tree_of(landscape)
        self.loops = landscape.loops if loops else ()
        self.count = max(self.tree.places.values(), default=0.0) + 1
        self.pitch = min(max(MOST_WIDE / self.count, PITCH[0]), PITCH[1])
        self.wide = max(self.pitch * self.count, LEAST_WIDE)
        longest = max(map(len, names), default=1) * LETTER
        self.turned = longest > self.pitch - EDGE / 2
        self.side = min(PICTURE, self.pitch - EDGE / 2) if pictures else 0.0
        self.high = min(PICTURE, TALLER * self.side)
        self._scale()
        self.entries = self._entries()

    def drawn(self, label: str, title: str) -> Figure:
        """Return the figure."""
        legend = self._legend()
        text = max((len(self._entry(bar)) for bar in self.entries), default=0) * LETTER
        right = (COLUMN / 2 + PICTURE * bool(self.pictures) + text) if self.entries else 2 * EDGE
        left, low = 0.95, 0.2 + (ROW * (1 + len(legend) // 3) if legend else 0.0)
        size = left + self.wide + right + EDGE, low + self.tall + (0.4 if title else 0.2)
        self.figure, self.size = Figure(figsize=size), size
        self.corner = left, low
        self.axes = self._inset(left, low, self.wide, self.tall)
        margin = (self.wide / self.pitch - self.count) / 2 + 0.5
        self.axes.set(xlim=(-margin, self.count - 1 + margin), ylim=(self.bottom, self.top))
        self.axes.set(xticks=[], title=title)
        middle = (TALL / 2 * self.inch + self.least - self.bottom) / (self.top - self.bottom)
        self.axes.set_ylabel(label, y=middle)
        self.axes.yaxis.set_major_locator(MaxNLocator(7))
        # No numbers below the lowest minimum, where there are names and pictures alone.
        self.axes.set_yticks([y for y in self.axes.get_yticks() if self.least <= y <= self.top])
        self.axes.spines[["top", "right", "bottom"]].set_visible(False)
        self.axes.spines["left"].set_bounds(self.least, self.top)
        self._draw_open_passes()
        self._draw_lines()
        for k, one in enumerate(self.landscape.minima):
            self._draw_leaf(k, one)
        self._draw_passes()
        if legend:
            self.figure.legend(
                handles=legend, loc="lower center", ncols=3, frameon=False, fontsize=FONT - 1
            )
        return self.figure

    # ------------------------------------------------------------------------------------- heights

    def _scale(self) -> None:
        """Choose heights that are drawn: below all is room for pictures, above all for stems."""
        land = self.landscape
        energies = [e for m in land.minima for e in m.energy]
        energies += [e for bar in self.tree.bars for e in bar.merge.energy]
        energies += [e for way in self.tree.exits for e in way.energy]
        energies += [land.passes[k].energy[0] for k in (*self.open_passes, *self.loops)]
        if isfinite(land.cap):
            energies.append(land.cap)
        heights = [self.height(e) for e in energies if isfinite(e)] or [0.0]
        self.least, most = min(heights), max(heights)
        span = (most - self.least) or abs(most) or 1.0
        self.inch = span / (TALL - 4 * EDGE)
        ends = [
            self.height(m.energy[0]) - self.inch * self._hanging(name)
            for m, name in zip(land.minima, self.names, strict=True)
        ]
        self.bottom, self.top = min([self.least, *ends]), self.least + TALL * self.inch
        self.tall = (self.top - self.bottom) / self.inch

    def _hanging(self, name: str) -> float:
        """Return the room below a minimum in inches."""
        return self.high + (len(name) * LETTER if self.turned else LINE) + 2 * EDGE

    def _y(self, energy: float) -> float:
        """Return the height of an energy, cut off at the edges."""
        if not isfinite(energy):
            return self.top if energy > 0 else self.bottom
        return min(max(self.height(energy), self.bottom), self.top)

    # --------------------------------------------------------------------------------------- parts

    @cached_property
    def open_passes(self) -> list[int]:
        """The passes that may join whatever is there."""
        return [k for k, p in enumerate(self.landscape.passes) if _is_open(p)]

    def _draw_open_passes(self) -> None:
        """Draw bands, each for all passes that overlap in it: there may be thousands."""
        least = EDGE / 4 * self.inch
        ends = [map(self._y, self.landscape.passes[k].energy) for k in self.open_passes]
        bands: list[tuple[float, float]] = []
        for low, high in sorted((low, max(high, low + least)) for low, high in ends):
            below = bands.pop() if bands and low <= bands[-1][1] else (low, high)
            bands.append((below[0], max(below[1], high)))
        for low, high in bands:
            self.axes.axhspan(low, high, fc="none", ec=OPEN, hatch="////", lw=0.6, zorder=0)

    def _draw_lines(self) -> None:
        axes, land = self.axes, self.landscape
        for stem in self.tree.stems:
            ends = [self._y(stem.low), self._y(min(stem.high, land.cap))]
            axes.plot([stem.across] * 2, ends, color=STEM, solid_capstyle="butt", zorder=2)
        for bar in self.tree.bars:
            low, high = map(self._y, bar.merge.energy)
            wide = bar.right - bar.left
            axes.add_patch(
                Rectangle((bar.left, low), wide, high - low, fc=SIDE, alpha=0.25, lw=0, zorder=1)
            )
            axes.plot([bar.left, bar.right], [high] * 2, color=STEM, solid_capstyle="projecting")
        right = axes.get_xlim()[1]
        for way in self.tree.exits:
            low, high = map(self._y, way.energy)
            axes.add_patch(
                Rectangle((way.across, low), right, high - low, fc=SIDE, alpha=0.25, lw=0)
            )
            axes.plot([way.across, right], [high] * 2, color=SIDE, ls=":", zorder=1)
        if self.tree.exits:
            axes.axvline(right, color="0.7", lw=6, zorder=0)
            axes.annotate(
                "outside", (1, 0), (-6, 4), "axes fraction", "offset points", rotation=90,
                ha="right", va="bottom", color="0.4", fontsize=FONT,
            )  # fmt: skip
        if isfinite(land.cap):
            axes.axhline(self._y(land.cap), color="0.5", ls="--", lw=0.9, zorder=0)
            axes.annotate(
                "known up to here", (1, self._y(land.cap)), (0, 2), ("axes fraction", "data"),
                "offset points", ha="right", color="0.4", fontsize=FONT - 1,
            )  # fmt: skip

    def _draw_leaf(self, k: int, one: Minimum) -> None:
        x, (low, high) = self.tree.places[k], map(self._y, one.energy)
        colour = MINIMA[one.orbit % len(MINIMA)]
        self.axes.add_patch(
            Rectangle((x - 0.2, low), 0.4, high - low, fc=colour, alpha=0.25, lw=0, zorder=1)
        )
        if one.kind == "locus":
            self.axes.plot([x - 0.25, x + 0.25], [low] * 2, color=colour, lw=3.5, zorder=5)
        else:
            self.axes.plot(x, low, "o", color=colour, mec="white", mew=0.6, ms=7, zorder=5)
        across, up = self._place(x, low)
        up -= EDGE + self.high
        if self.pictures is not None:
            self._draw_picture(one.point, (across - self.side / 2, up), self.side, self.high)
        self.figure.text(
            across / self.size[0], (up - EDGE / 3) / self.size[1], self.names[k], va="top",
            ha="center", rotation=90 if self.turned else 0, fontsize=FONT,
        )  # fmt: skip

    def _draw_passes(self) -> None:
        land, axes = self.landscape, self.axes
        for bar in self.tree.bars:
            p = land.passes[bar.merge.number]
            self._mark(bar.middle, self._y(bar.merge.energy[1]), p, SIDE)
        for way in self.tree.exits:
            self._mark(way.across, self._y(way.energy[1]), land.passes[way.number], SIDE)
        for k in self.loops:
            p = land.passes[k]
            known = [s.minimum for s in p.sides if s.minimum is not None and s.minimum >= 0]
            if known and p.energy[1] <= land.cap:
                stem = self.tree.stem(known[0], p.energy[0])
                self._mark(stem.across, self._y(p.energy[1]), p, "0.5")
        right = axes.get_xlim()[1]
        for bar, up in zip(self.entries, self._spread(), strict=True):
            y = self._y(bar.merge.energy[1])
            end = right + COLUMN / 2 / self.pitch
            level = self.bottom + up * self.inch
            axes.plot(
                [bar.right, right, end], [y, y, level], color=GUIDE, lw=0.8, zorder=0, clip_on=False
            )
            across = self.corner[0] + self.wide + COLUMN / 2
            if self.pictures is not None:
                point = land.passes[bar.merge.number].point
                place = across, self.corner[1] + up - PICTURE / 2
                self._draw_picture(point, place, PICTURE, PICTURE)
                across += PICTURE
            self.figure.text(
                (across + EDGE / 2) / self.size[0], (self.corner[1] + up) / self.size[1],
                self._entry(bar), va="center", fontsize=FONT,
            )  # fmt: skip

    def _mark(self, x: float, y: float, p: Pass, colour: str) -> None:
        verified = all(side.verified for side in p.sides)
        face = colour if verified else "white"
        mark = MARKS.get(p.kind, "o")
        self.axes.plot(x, y, mark, mec=colour, mfc=face, mew=1.2, ms=6.5, zorder=4)

    # ------------------------------------------------------------------------------ list of passes

    def _entries(self) -> list[Crossbar]:
        """Return one bar for each orbit of passes, as many as there is room for, by height."""
        first: dict[int, Crossbar] = {}
        for bar in self.tree.bars:
            first.setdefault(self.landscape.passes[bar.merge.number].orbit, bar)
        chosen = sorted(first.values(), key=self._depth, reverse=True)
        return sorted(
            chosen[: int(self.tall / self._row)], key=lambda bar: self._y(bar.merge.energy[1])
        )

    def _depth(self, bar: Crossbar) -> float:
        """Return the height of a bar over the lowest minimum that ends there."""
        ended = self.landscape.minima[bar.merge.ended]
        return self._y(bar.merge.energy[1]) - self.height(ended.energy[0])

    @property
    def _row(self) -> float:
        return PICTURE if self.pictures else ROW

    def _entry(self, bar: Crossbar) -> str:
        ends = [f"{self.height(energy):.6g}" for energy in bar.merge.energy]
        return f"{self.pass_names[bar.merge.number]}  {' to '.join(dict.fromkeys(ends))}"

    def _spread(self) -> list[float]:
        """Return the heights of the entries in inches, near those of their bars and apart."""
        row = self._row
        places: list[float] = []
        for bar in self.entries:
            wanted = (self._y(bar.merge.energy[1]) - self.bottom) / self.inch
            places.append(max([wanted, *(place + row for place in places[-1:])]))
        limit = self.tall - row / 2
        for k in reversed(range(len(places))):
            places[k] = min(places[k], limit)
            limit = places[k] - row
        return places

    def _legend(self) -> list[Any]:
        from matplotlib.lines import Line2D
        from matplotlib.patches import Patch

        used = [*(bar.merge.number for bar in self.tree.bars), *self.loops]
        used += [way.number for way in self.tree.exits]
        passes = [self.landscape.passes[k] for k in used]
        kinds = [kind for kind in MARKS if any(p.kind == kind for p in passes)]
        style: dict[str, Any] = {"ls": "", "mec": SIDE, "mew": 1.2, "ms": 6}
        hollow = any(not s.verified for p in passes for s in p.sides)
        found: list[Any] = []
        if len(kinds) > 1 or hollow or self.loops:
            found = [
                Line2D([], [], marker=MARKS[k], mfc=SIDE, label=WORDS[k], **style) for k in kinds
            ]
        if hollow:
            found.append(Line2D([], [], marker="o", mfc="white", label="not verified", **style))
        if self.loops:
            style["mec"] = "0.5"
            found.append(Line2D([], [], marker="o", mfc="0.5", label="loop", **style))
        if self.open_passes:
            found.append(Patch(fc="none", ec=OPEN, hatch="////", label="not decided"))
        return found

    # -------------------------------------------------------------------------------------- places

    def _place(self, x: float, y: float) -> tuple[float, float]:
        """Return a place in the axes in inches."""
        left = self.axes.get_xlim()[0]
        return (
            self.corner[0] + (x - left) * self.pitch,
            self.corner[1] + (y - self.bottom) / self.inch,
        )

    def _inset(self, left: float, low: float, wide: float, tall: float) -> Axes:
        whole, high = self.size
        return self.figure.add_axes((left / whole, low / high, wide / whole, tall / high))

    def _draw_picture(
        self, point: Array, place: tuple[float, float], wide: float, tall: float
    ) -> None:
        assert self.pictures is not None
        axes = self._inset(*place, wide, tall)
        draw_into(axes, self.pictures, point)
        axes.set_anchor("N")


def _is_open(p: Pass) -> bool:
    return p.kind == "undecided" or not p.sides or any(s.minimum is None for s in p.sides)


# ----------------------------------------------------------------------------------------- barcodes

WIDTH, HEAD, BAR = 7.0, 1.2, 0.09  # inches
MARGIN = 0.15  # of the span of the heights, beyond which bars go on that do not end


@checked
def draw_barcode(nerve: Nerve, label: str = "height") -> Figure:
    """Draw a bar for every class of homology, from its death to its birth.

    Bars that reach the left side do not end, and those that reach the right side have no birth.
    Dashed lines are the critical heights; colours tell dimensions.

    Parameters
    ----------
    nerve : Nerve
    label : str, optional
        What the height is.
    """
    checks.instance("nerve", nerve, Nerve, "nerve(polyhedron)")
    heights = np.array(nerve.critical or (0.0,))
    margin = MARGIN * (np.ptp(heights) or 1.0)
    left, right = float(heights.min() - margin), float(heights.max() + margin)
    rows = count()
    figure = Figure(figsize=(WIDTH, HEAD + BAR * len(nerve.bars)), layout="constrained")
    axes = figure.add_subplot()
    for dimension in sorted({bar.dimension for bar in nerve.bars}):
        some = [bar for bar in nerve.bars if bar.dimension == dimension]
        axes.hlines(
            [next(rows) for _ in some],
            [max(bar.death, left) for bar in some],
            [min(bar.birth, right) for bar in some],
            color=SHADES[dimension % len(SHADES)],
            lw=3,
            label=f"dimension {dimension}",
        )
    for height in nerve.critical:
        axes.axvline(height, color="0.6", lw=0.8, ls="--", zorder=0)
    axes.set(xlim=(left, right), yticks=[], xlabel=label)
    figure.legend(loc="outside right upper", frameon=False, fontsize=8)
    return figure
