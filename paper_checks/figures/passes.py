"""The way from hand to hand over the pair side by side, and how deep dyads lie."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing

from paper_checks.figures import style
from paper_checks.figures.figure import Figure
from paper_checks.section6.depths import landscape_of
from polycorner.dumbbells import PairLandscape, RelativePlacements, critical_rod_radius
from polycorner.dumbbells.statics.critical import escape_barrier
from polycorner.dumbbells.statics.depths import HANDS
from polycorner.dumbbells.viewer import descent
from polycorner.landscapes import Pass, Side

PAIR = style.PAIR
LENGTHS = (12.0, 16.0, 24.0)  # mm
COLOURS = ("#E69F00", "#0072B2", "#CC79A7")
PROVED = ((12.0, 1.5), (16.0, 1.5), (16.0, 2.0))  # mm: length and rod radius
RODS = 60  # points of a curve
BESIDE = 0.05  # mm, from rods of radius 0
NEAR = 0.02  # mm, up to which a contact in the developed drum counts as closed


Station = tuple[float, float, Any]  # length and height in mm, centres of the balls


def profile(found: PairLandscape) -> tuple[Any, Any, list[Station]]:
    """Return lengths and heights, in mm, along the way from ``G`` to ``G`` by both hands.

    From each pass the way is that of steepest descent, which begins where the proved one does.
    Lengths are root mean square displacements of the four balls about their middle along the drum.
    """
    places, ends = [], [0]
    for side, top, back in _sides(found):
        path = _descent(found, side, top)
        places.append(path[::-1] if back else path)
        ends.append(ends[-1] + len(path))
    points = np.concatenate(places)
    ground = found.pair.energy.value(found.pair.end_to_end())
    heights = np.asarray(found.pair.energy.value(points)) - ground
    centres = found.pair.developed(points)
    centres[..., 1] -= centres[..., 1].mean(axis=1, keepdims=True)
    steps = np.sqrt((np.diff(centres, axis=0) ** 2).sum(axis=(1, 2)) / 4)
    lengths = np.concatenate([[0.0], np.cumsum(steps)])
    marks = [0, *(end - 1 for end in ends[1:])]
    return lengths, heights, [(lengths[k], heights[k], centres[k]) for k in marks]


def _sides(found: PairLandscape) -> Iterator[tuple[Side, Pass, bool]]:
    """Yield sides of passes in the order of the way, and whether they are climbed."""
    names, passes = found.names, found.landscape.passes
    turns = (p for p in passes if {names[s.minimum or 0] for s in p.sides} == HANDS)
    turn = next(turns)
    for hand, back in (("delta_R", True), ("delta_L", False)):
        inner = next(s for s in turn.sides if names[s.minimum or 0] == hand)
        opens = next(
            p for p in passes
            if p is not turn and inner.minimum in {s.minimum for s in p.sides} and len(p.active) < 2
        )  # fmt: skip
        outer, nearer = sorted(opens.sides, key=lambda s: s.minimum == inner.minimum)
        half = [(outer, opens, True), (nearer, opens, False), (inner, turn, True)]
        yield from half if back else [(s, p, not up) for s, p, up in half[::-1]]


def _descent(found: PairLandscape, side: Side, top: Pass) -> Any:
    """Return placements of the pair from a pass down one of its sides, ``(k, 6)``."""
    model = RelativePlacements(found.pair)
    start = top.point if side.route is None else side.route.vertices[1]
    fallen = descent(found.pair.polyhedron, found.pair.energy, model.placement(start))
    return np.vstack([model.placement(top.point), fallen.points])


@style.styled()
def draw_passes() -> Drawing:
    """Draw the profile of the way with the pairs at its stations, and depths over rods."""
    figure = style.canvas(style.WIDE, 6.4)
    upper, lower = style.parts(figure, 2, 1, height_ratios=[1.75, 1])
    _draw_profile(upper)
    _draw_depths(lower.subplots())
    return figure


def _draw_profile(part: Any) -> None:
    found = landscape_of(PAIR)
    lengths, heights, stations = profile(found)
    part.suptitle(r"$\bf(a)$ from hand to hand, and how either opens", x=0.02, ha="left")
    pairs, axes = part.subplots(2, 1, height_ratios=[1.1, 1])
    axes.plot(lengths, heights, color="black")
    words = ("$G$", "opens", r"$\delta_R$", "side by side", r"$\delta_L$", "opens", "$G$")
    gap = 24.0  # mm between the pairs that are drawn
    for k, ((along, height, centres), name) in enumerate(zip(stations, words, strict=True)):
        axes.plot(along, height, "o", color="black", ms=3.5)
        hand = "R" if k in (1, 2) else "L" if k in (4, 5) else None
        moved = centres - centres.mean(axis=0) + [gap * k, 0.0]
        pairs.plot([gap * k] * 2, [-24, 24], color=style.FAINT, lw=0.8, ls=(0, (3, 2)), zorder=0)
        style.draw_pair(pairs, PAIR, moved, style.HANDS[hand])
        style.mark_contacts(pairs, PAIR, moved, _closed(centres))
        pairs.text(gap * k, -27, name, ha="center", va="top")
    style.bare(pairs)
    pairs.set(xlim=(-9, 6 * gap + 9), ylim=(-35, 25))
    axes.set(xlabel="root mean square displacement of the balls (mm)", ylabel="height (mm)")
    style.grid(axes)


def _closed(centres: Any) -> list[str]:
    """Return the contacts of balls and rods that touch, in the developed plane."""
    balls = dict(zip(("A1", "A2", "B1", "B2"), centres, strict=True))
    names = [a + b for a in ("A1", "A2") for b in ("B1", "B2")]
    touch = [
        n for n in names
        if np.linalg.norm(balls[n[:2]] - balls[n[2:]]) < 2 * PAIR.ball_radius + NEAR
    ]  # fmt: skip
    for ball, centre in balls.items():
        one, two = (balls[f"{'B' if ball[0] == 'A' else 'A'}{k}"] for k in (1, 2))
        share = np.clip((centre - one) @ (two - one) / PAIR.length**2, 0, 1)
        apart = np.linalg.norm(centre - one - share * (two - one))
        if apart < PAIR.ball_radius + PAIR.rod_radius + NEAR:
            touch.append(f"{ball}b" if ball[0] == "A" else f"a{ball}")
    return touch


def _draw_depths(axes: Axes) -> None:
    style.letter(axes, "b", "depth of a dyad over the radius of the rods")
    for length, colour in zip(LENGTHS, COLOURS, strict=True):
        pair = replace(PAIR, length=length)
        rods = np.linspace(BESIDE, critical_rod_radius(pair) or PAIR.ball_radius, RODS)[:-1]
        depths = [escape_barrier(replace(pair, rod_radius=t)) or 0.0 for t in rods.tolist()]
        axes.plot(rods, depths, color=colour, label=rf"$\ell = {length:g}$ mm")
    for length, rod in PROVED:
        low, high = landscape_of(replace(PAIR, length=length, rod_radius=rod)).depth or (0.0, 0.0)
        axes.plot(rod, (low + high) / 2, "o", mfc="white", mec="black", ms=4.5, zorder=5)
    axes.set(xlabel="$t$ (mm)", ylabel="depth (mm)", xlim=(0, PAIR.ball_radius), ylim=(0, None))
    axes.legend(loc="lower left")
    style.grid(axes)


def _caption() -> str:
    found = landscape_of(PAIR)
    low, high = found.depth or (0.0, 0.0), found.turnover or (0.0, 0.0)
    listed = ", ".join(f"({length:g}, {rod:g})" for length, rod in PROVED)
    return (
        f"Heights of the balls together, times the weight of one, above G; {style.sizes(PAIR)}, "
        "horizontal drum. (a) Steepest descents from the passes to what is proved to lie on "
        "either side of them, one after the other; above, the pairs in the developed wall, the "
        "lowest line dashed, contacts yellow. A dyad opens when it is lifted by "
        f"{low[0]:.6f} mm, over a pass with one contact; it takes {high[1]:.6f} mm to "
        "go over to the other hand, over two dumbbells side by side, without a hand. (b) The depth "
        "is 0 where rods are so thick that the corner is no minimum. Circles: proved, with a "
        f"complete list of passes, for (ℓ, t) = {listed} mm."
    )


def _alt() -> str:
    return (
        "Seven pairs above a curve with three humps. Two dumbbells end to end; with one contact, "
        "inner balls side by side, on a low hump; a right-handed dyad, in a dip; side by side, on "
        "a hump twice as high; then the mirror image of the first half. Below, three curves of the "
        "depth over the radius of the rods, one for each length, which fall to zero where rods are "
        "almost as thick as balls."
    )


FIGURES = (
    Figure(
        "passes", "From hand to hand, and how deep dyads lie", _caption, _alt, draw_passes, True
    ),
)
