"""Figures of motions in the drum: coordinates against time, and the drum unrolled."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from polycorner.dumbbells.drum import DumbbellDrum, drum_of
from polycorner.dumbbells.dynamics.pairs import DumbbellLengths, dyads, mean_heading
from polycorner.dumbbells.pictures.bodies import rod_outlines
from polycorner.dumbbells.pictures.symbols import HANDS, WORDS, sizes_in_words
from polycorner.motion import Trajectory
from polycorner.toolkit import BODIES, Array, checked, real

SINGLE = "#8C9BA8"
ARROW = "0.35"
LOWEST: dict[str, Any] = {"color": "0.6", "linewidth": 0.8, "linestyle": "--"}
AVERAGE = "black"
FEW = 6  # largest number of bodies with colours of their own
LINES = (*BODIES, "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
CORNERS = 36  # of a ball's outline
LEAST = 4.0  # degrees or mm that a panel shows at least
TALL = 11.0  # inches at most, of a drum
PANELS = ("azimuth φ (degrees)", "axial position η (mm)", "heading θ (degrees)")


@checked
def draw_history(run: Trajectory) -> Figure:
    """Draw azimuth, axial position and heading against time, as in [GMBN] fig. 4 and 6.

    For two dumbbells their average is drawn in black.  More than ``FEW`` dumbbells share one
    colour, and the times they spend in dyads are coloured by chirality.
    """
    figure = Figure(figsize=(9, 8), layout="constrained")
    panels = figure.subplots(3, 1, sharex=True)
    path = run
    N = path.q.shape[1]
    curves = _curves(run)
    hands = _hands_in_time(run) if N > FEW else None
    for axes, values, label in zip(panels, curves, PANELS, strict=True):
        for body in range(N):
            shown = np.where(path.present[:, body], values[:, body], np.nan)
            colour = LINES[body] if N <= FEW else SINGLE
            width, label_of = (0.6, None) if N > FEW else (1.1, f"dumbbell {body + 1}")
            axes.plot(path.times, shown, color=colour, lw=width, label=label_of)
            if hands is not None:
                _overdraw(axes, path.times, shown, hands[:, body])
        axes.set_ylabel(label)
        axes.grid(color="0.92", linewidth=0.6)
    if N == 2:
        _draw_average(panels, run, curves)
    for axes in panels:
        _frame(axes)
    _legend(panels[0], N, hands)
    panels[-1].set_xlabel("time (s)")
    panels[-1].set_xlim(float(path.times[0]), max(float(path.times[-1]), 1e-9))
    figure.align_ylabels(panels)
    figure.suptitle(title(run))
    return figure


def _frame(axes: Axes) -> None:
    """Extend narrow panels to ``LEAST`` units, and draw the zero line if it is in view."""
    low, high = axes.get_ylim()
    lack = max(0.0, LEAST - (high - low)) / 2
    axes.set_ylim(low - lack, high + lack)
    if low - lack < 0 < high + lack:
        axes.axhline(0, color="0.6", linewidth=0.8, zorder=0.5)


def title(run: Trajectory) -> str:
    """Return the parameters of a run as the title of its figures."""
    drum = drum_of(run)
    place = f"R = {drum.drum_radius:g} mm, α = {math.degrees(drum.tilt):g}°"
    noise = f", noise {run.noise.chatter:g}" if run.noise.chatter else ""
    return f"{sizes_in_words(drum.pair)};  {place}, ω = {drum.spin:g} rad/s{noise}"


def _curves(run: Trajectory) -> tuple[Array, Array, Array]:
    """Return azimuth, axial position and heading ``(T, N)`` as drawn; nan breaks a line."""
    q = run.q
    heading = np.degrees(q[..., 2])
    wrapped = heading - 180 * np.ceil(heading / 180 - 0.5)
    jumps = np.abs(np.diff(wrapped, axis=0, prepend=wrapped[:1])) > 90
    return np.degrees(q[..., 0]), q[..., 1], np.where(jumps, np.nan, wrapped)


def _draw_average(panels: Sequence[Axes], run: Trajectory, curves: tuple[Array, ...]) -> None:
    path = run
    both = path.present.all(axis=1)
    heading = np.degrees(mean_heading(path))
    heading = heading - 180 * np.ceil(heading / 180 - 0.5)
    averages = (curves[0].mean(axis=1), curves[1].mean(axis=1), heading)
    for axes, values in zip(panels, averages, strict=True):
        shown = np.where(both, values, np.nan)
        axes.plot(path.times, shown, color=AVERAGE, lw=1.3, label="average", zorder=3)


def _hands_in_time(run: Trajectory) -> NDArray[np.int64]:
    """Return +1, -1 or 0 for each instant and dumbbell: the chirality of its dyad."""
    path = run
    hands = np.zeros(path.present.shape, dtype=np.int64)
    for index in range(len(path)):
        for i, j, hand in dyads(path, index):
            hands[index, [i, j]] = 1 if hand == "R" else -1
    return hands


def _overdraw(axes: Axes, times: Array, values: Array, hands: NDArray[np.int64]) -> None:
    for sign, hand in ((1, "R"), (-1, "L")):
        if (hands == sign).any():
            shown = np.where(hands == sign, values, np.nan)
            axes.plot(times, shown, color=HANDS[hand], lw=1.3, zorder=2.5)


def _legend(axes: Axes, count: int, hands: NDArray[np.int64] | None) -> None:
    if hands is not None:
        kinds = [(SINGLE, "single"), *((HANDS[h], f"{WORDS[h]} dyad") for h in ("R", "L"))]
        handles: list[Any] = [Line2D([], [], color=c, label=label) for c, label in kinds]
    elif count > 1:
        handles, _ = axes.get_legend_handles_labels()
    else:
        return
    place: dict[str, Any] = {
        "loc": "lower right",
        "bbox_to_anchor": (1.0, 1.0),
        "borderaxespad": 0.2,
    }
    axes.legend(handles=handles, ncols=len(handles), fontsize=9, frameon=False, **place)


@checked
def draw_drum(run: Trajectory, index: int = -1) -> Figure:
    """Draw the drum unrolled with the dumbbells at a recorded instant, dyads coloured."""
    return DrumView(run).show(index)


class DrumView:
    """A figure of the drum unrolled, its axis upwards, that shows any recorded instant.

    Parameters
    ----------
    run : Trajectory
        The extent of the figure covers all its instants.
    width : float, optional
        Of the figure, in inches.
    """

    @checked
    def __init__(self, run: Trajectory, *, width: float = 7.0) -> None:
        self.run = run
        real("width", width, above=0)
        self.sizes = DumbbellLengths.of(run)
        (left, right), (low, high) = self._extent()
        height = (width - 1.6) * (high - low) / (right - left) + 1.6
        if height > TALL:
            width, height = 1.6 + (TALL - 1.6) * (right - left) / (high - low), TALL
        # Space for the title above a narrow drum.
        size = (max(width, 4.6), max(height, 3.2))
        self.figure = Figure(figsize=size, layout="constrained")
        self.axes = self.figure.add_subplot()
        self.axes.set(xlim=(left, right), ylim=(low, high), aspect="equal")
        self.axes.set(xlabel="across, ρφ (mm)", ylabel="along the axis, η (mm)")
        rho = self.sizes.centre_radius
        to_degrees, to_mm = math.degrees(1) / rho, rho * math.radians(1)
        top = self.axes.secondary_xaxis(
            "top",
            functions=(lambda x: np.asarray(x) * to_degrees, lambda x: np.asarray(x) * to_mm),
        )
        top.set_xlabel("azimuth φ (degrees)")
        self._draw_drum(low, high)
        self.rods = PolyCollection([], linewidths=0.5, zorder=2)
        self.balls = PolyCollection([], linewidths=0.5, zorder=3)
        self.axes.add_collection(self.rods)
        self.axes.add_collection(self.balls)
        if handles := _key(drum_of(run)):
            place: dict[str, Any] = {"loc": "outside lower center", "ncols": 2, "frameon": False}
            self.figure.legend(handles=handles, fontsize=8, **place)
        self.words = self.figure.suptitle(" ", fontsize=11)
        self.moving = (self.rods, self.balls, self.words)

    def _extent(self) -> tuple[tuple[float, float], tuple[float, float]]:
        path, drum = self.run, drum_of(self.run)
        reach = drum.length / 2 + 1.6 * drum.ball_radius
        # Dumbbells that left keep their last coordinates, so all instants can be used.
        across, along = self.sizes.centre_radius * path.q[..., 0], path.q[..., 1]
        left, right = min(across.min() - reach, -reach), max(across.max() + reach, reach)
        low, high = along.min() - reach, along.max() + reach
        if drum.floor:
            low = -1.2 * drum.ball_radius
        if math.isfinite(drum.top) and (drum.floor or high > drum.top - drum.length):
            high = drum.top + reach
        lack = 2.5 * reach - (right - left)
        if lack > 0:
            left, right = left - lack / 2, right + lack / 2
        return (float(left), float(right)), (float(low), float(high))

    def _draw_drum(self, low: float, high: float) -> None:
        drum, axes = drum_of(self.run), self.axes
        axes.set_facecolor("#FBFAF7")
        axes.axvline(0, zorder=1, **LOWEST)
        if drum.floor:
            axes.axhspan(low, 0, color="0.55", zorder=1)
        if math.isfinite(drum.top) and high > drum.top:
            axes.axhline(drum.top, color="0.3", linewidth=1.2, linestyle=":", zorder=1)
        if drum.spin:
            ends = ((0.03, 0.94), (0.2, 0.94))
            start, stop = ends if drum.spin > 0 else ends[::-1]
            arrow = {"arrowstyle": "-|>", "color": ARROW, "lw": 1.4}
            axes.annotate(
                "", stop, xytext=start, xycoords="axes fraction", arrowprops=arrow, zorder=4
            )

    @checked
    def show(self, index: int = -1) -> Figure:
        """Show a recorded instant and return the figure."""
        path = self.run
        index = index % len(path)
        here = np.flatnonzero(path.present[index])
        colours = dict.fromkeys(
            here.tolist(), BODIES[0] if drum_of(self.run).count == 1 else SINGLE
        )
        for i, j, hand in dyads(path, index):
            colours[i] = colours[j] = HANDS[hand]
        balls = self.sizes.balls(path.q[index, here])
        faces = [colours[body] for body in here.tolist()]
        self.rods.set_verts(list(rod_outlines(balls, drum_of(self.run).rod_radius)))
        self.rods.set(facecolor=[(*_rgb(c), 0.75) for c in faces], edgecolor="white")
        self.balls.set_verts(_disks(balls.reshape(-1, 2), drum_of(self.run).ball_radius))
        self.balls.set(facecolor=[c for c in faces for _ in range(2)], edgecolor="white")
        left = path.present.shape[1] - len(here)
        gone = f",  {left} left" if left else ""
        self.words.set_text(f"t = {path.times[index]:.1f} s{gone}")
        return self.figure


def _key(drum: DumbbellDrum) -> list[Line2D]:
    """Return legend entries for the colours of dumbbells, the arrow and the lowest line."""
    entries = []
    if drum.count > 1:
        kinds = [(HANDS[hand], f"{WORDS[hand]} dyad") for hand in ("R", "L")]
        entries += [
            Line2D([], [], color=colour, lw=0, marker="o", label=label)
            for colour, label in [*kinds, (SINGLE, "dumbbell in no dyad")]
        ]
    if drum.spin:
        marker = ">" if drum.spin > 0 else "<"
        entries.append(Line2D([], [], color=ARROW, marker=marker, ms=5, label="motion of the wall"))
    entries.append(Line2D([], [], label="lowest line of the drum", **LOWEST))
    return entries


def _rgb(colour: str) -> tuple[float, float, float]:
    from matplotlib.colors import to_rgb

    return to_rgb(colour)


def _disks(centres: Array, radius: float) -> list[Array]:
    turn = np.linspace(0, 2 * np.pi, CORNERS, endpoint=False)
    outline = radius * np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    return list(centres[:, None] + outline)
