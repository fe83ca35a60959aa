"""Kinds of entrapment: a mass in a well without a wall, at a wall, and pressed against a wall."""

import math
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing

from paper_checks.figures import style
from paper_checks.figures.figure import Figure
from polycorner.dumbbells import dyad_minima
from polycorner.models.wells import Well, ladder

FRICTION, RESTITUTION = 0.04, 0.6  # friction in units of depth per rim; restitution of the wall
# starting position of the mass, in rims; duration, in rims times sqrt(mass / depth)
START, TIME = 0.9, 16.0
WELLS = ladder(1.0, friction=FRICTION, restitution=RESTITUTION)
COLOURS = ("#0072B2", "#E69F00", "#D55E00")
SHOWN = 0.62  # position of the mass in the drawing of its well, in rims


@cache
def motions() -> tuple[tuple[Any, Any], ...]:
    """Return times and positions of a mass released in each well, in closed form for each phase."""
    return tuple(_motion(well) for well in WELLS)


def _motion(well: Well) -> tuple[Any, Any]:
    """Follow falls and rises until the mass is at rest, on both sides of 0 if there is no wall."""
    grid = np.linspace(0.0, TIME, 4001)
    places = np.full_like(grid, math.nan)
    clock, side, height = 0.0, 1.0, START
    while clock < TIME:
        down = _Phase(height, 0.0, well.slope - well.friction, well.stiffness)
        _record(grid, places, down, clock, side)
        clock += down.duration
        speed = well.kept * down.end_speed
        if speed < 1e-9:
            places[grid >= clock] = side * down.end
            break
        side = side if well.wall else -side
        up = _Phase(0.0, speed, well.slope + well.friction, well.stiffness)
        _record(grid, places, up, clock, side)
        clock, height = clock + up.duration, up.end
    return grid, places


def _record(grid: Any, places: Any, phase: "_Phase", clock: float, side: float) -> None:
    now = (grid >= clock) & (grid < clock + phase.duration)
    places[now] = side * phase.place(grid[now] - clock)


@dataclass(frozen=True)
class _Phase:
    """Motion of a unit mass under a force towards 0 and a spring, until it turns or reaches 0.

    It starts at ``start``; ``speed`` points away from 0.
    """

    start: float
    speed: float
    force: float
    stiffness: float

    def place(self, time: Any) -> Any:
        """Return its position after a time in the phase."""
        if self.stiffness == 0:
            return self.start + self.speed * time - self.force * time**2 / 2
        omega, centre = math.sqrt(self.stiffness), self.force / self.stiffness
        swing = (self.start + centre) * np.cos(omega * time)
        return swing + self.speed / omega * np.sin(omega * time) - centre

    @property
    def duration(self) -> float:
        """Time until it turns round (rising), or reaches 0 or rests (falling)."""
        omega = math.sqrt(self.stiffness)
        if self.speed > 0:
            if omega == 0:
                return self.speed / self.force
            return math.atan2(self.speed / omega, self.force / self.stiffness) / omega
        if self.force + self.stiffness * self.start <= 0:
            return 0.0
        if omega == 0:
            return math.sqrt(2 * self.start / self.force)
        centre = self.force / self.stiffness
        if self.start + 2 * centre < 0:
            return math.pi / omega
        return math.acos(centre / (self.start + centre)) / omega

    @property
    def end(self) -> float:
        """Return the position at which the phase ends."""
        return float(self.place(self.duration))

    @property
    def end_speed(self) -> float:
        """Return its speed at that position, from the energy."""
        end = max(self.end, 0.0)
        gain = self.force * (self.start - end) + self.stiffness * (self.start**2 - end**2) / 2
        return math.sqrt(max(0.0, self.speed**2 + 2 * gain))


@style.styled()
def draw_entrapment() -> Drawing:
    """Draw the three wells with their forces, and the capture of a released mass."""
    figure = style.canvas(style.WIDE, 4.4)
    grid = figure.subplots(2, 3, sharey="row")
    names = ("U: harmonic", "half-U: harmonic, wall", "half-V: triangular, wall")
    for axes, letter, name, well, colour in zip(grid[0], "abc", names, WELLS, COLOURS, strict=True):
        _draw_well(axes, well, colour)
        style.letter(axes, letter, name)
    for axes, letter, path, well, colour in zip(
        grid[1], "def", motions(), WELLS, COLOURS, strict=True
    ):
        _draw_motion(axes, path, well, colour)
        style.letter(axes, letter)
    grid[0, 0].set_ylabel("energy $V / D$")
    grid[1, 0].set_ylabel("place $x / a$")
    return figure


def _draw_well(axes: Axes, well: Well, colour: str) -> None:
    x = np.linspace(0.0 if well.wall else -1.0, 1.0, 201)
    axes.plot(x, well.potential(x), color=colour, lw=2)
    place = SHOWN
    axes.plot(place - 0.055, well.potential(place) + 0.045, "o", color="0.25", ms=8, zorder=4)
    for at in (0.0, place):
        _draw_force(axes, well, at)
    if well.wall:
        axes.axvline(0, color="0.2", lw=1.2)
        axes.axvspan(-0.14, 0, facecolor="none", hatch="////", edgecolor="0.5", lw=0)
    axes.set(xlim=(-1.15, 1.15), ylim=(-0.3, 1.12), xticks=[-1, -0.5, 0, 0.5, 1])
    axes.set_xlabel("place $x / a$")
    axes.spines[["top", "right"]].set_visible(False)


def force(well: Well, place: float) -> float:
    """Return minus the right-hand slope of the energy, in units of depth per rim."""
    return -(well.slope + well.stiffness * place)


def _draw_force(axes: Axes, well: Well, place: float) -> None:
    """Draw the force below the bottom: an arrow ending at its point of action, a dot if it is 0."""
    size = force(well, place)
    if size == 0:
        axes.plot(place, -0.17, "o", color="0.2", ms=3.5, mfc="white")
        axes.text(place + 0.07, -0.17, "no force", va="center", fontsize=8.5, color="0.2")
        return
    start = place - 0.22 * size
    head = {"arrowstyle": "-|>", "color": "0.2", "lw": 1.2, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", (place, -0.17), xytext=(start, -0.17), arrowprops=head)


def _draw_motion(axes: Axes, path: tuple[Any, Any], well: Well, colour: str) -> None:
    times, places = path
    style.grid(axes)
    axes.plot(times, places, color=colour)
    if well.wall:
        axes.axhspan(-0.14, 0, facecolor="none", hatch="////", edgecolor="0.5", lw=0)
    axes.set(xlim=(0, TIME), ylim=(-1, 1), xlabel=r"time $t\,/\,a\sqrt{m/D}$")


def captured(path: tuple[Any, Any]) -> float:
    """Return the time from which a motion is within a thousandth of its end; inf if only there."""
    times, places = path
    away = np.flatnonzero(abs(places - places[-1]) > 1e-3)
    last = int(away[-1]) + 1
    return float(times[last]) if times[last] < 0.98 * TIME else math.inf


def _caption() -> str:
    after = [captured(path) for path in motions()]
    words = [f"after {time:.1f}" if time < math.inf else f"not within {TIME:g}" for time in after]
    counts = dyad_minima(style.PAIR)[0].certificate.entrapment_counts
    held = ", ".join(f"{count} {kind}" for kind, count in counts.items() if count)
    return (
        "A point mass m on a line in wells of the same depth D and rim a. (a)–(c) Energy, the "
        f"wall (hatched), and the force at the bottom and at {SHOWN:g} a (arrows): only in the "
        "half-V well does the mass press on the wall where its energy is least. (d)–(f) Motion "
        f"of a mass released at {START:g} a, with dry friction of {FRICTION:g} D/a and a "
        f"wall that gives back {RESTITUTION:g} of the speed; it is at rest, to within a/1000, "
        f"{words[0]}, {words[1]} and {words[2]} times a√(m/D). The six directions at the corner "
        f"of a dyad, {style.sizes(style.PAIR)}, as its certificate labels them: {held}."
    )


def _alt() -> str:
    return (
        "Above, three wells: a parabola, without force at its lowest point; the right half of "
        "it, ending at a hatched wall at zero, also without force there; and a straight slope "
        "that ends at the wall, with an arrow towards the wall at zero too. Below, place against "
        "time: in the first well the mass swings to both sides with slowly falling amplitude; in "
        "the second it bounces off the wall with falling height; in the third its bounces become "
        "lower and shorter and end soon."
    )


FIGURES = (Figure("entrapment", "Three kinds of entrapment", _caption, _alt, draw_entrapment),)
