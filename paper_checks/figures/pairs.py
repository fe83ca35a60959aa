"""Pairs of dumbbells: one for every kind of face of their polyhedron, and those near its corner."""

import math
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing

from paper_checks.figures import style
from paper_checks.figures.figure import Figure
from paper_checks.figures.style import minus
from polycorner.dumbbells import DyadMinimum, PairAtlas, dyad_minima, pair_atlas
from polycorner.skeletons import traced

PAIR = style.PLANE
TOUCH = 1e-6  # mm
LETTERS = {"Delta": r"\Delta", "E": r"\mathcal{E}"}


@dataclass(frozen=True, eq=False)
class Kind:
    """A kind of face up to relabelling: a pair ``(6,)``, its contacts, its name, its hand."""

    q: Any
    contacts: tuple[str, ...]
    name: str
    hand: str | None


@cache
def atlas() -> PairAtlas:
    """Return corners, edges and faces of the pair in the plane."""
    return pair_atlas(PAIR)


def closed(q: Any) -> tuple[str, ...]:
    """Return the contacts of a pair in the plane that touch."""
    gaps = zip(PAIR.polyhedron.names, PAIR.polyhedron.values(q), strict=True)
    return tuple(name for name, gap in gaps if abs(gap) < TOUCH)


def corners() -> list[Kind]:
    """Return the kinds of ``D3``, one corner of each."""
    found, kinds = atlas().skeleton.corners, []
    for group in atlas().unordered["corners"]:
        corner = found[min(group)]
        letter, hand = atlas().kind(corner).split("_")
        kinds.append(Kind(corner.point, corner.active, f"${LETTERS[letter]}_{hand}$", hand))
    return sorted(kinds, key=lambda kind: (len(kind.contacts), kind.hand != "R"))


def edges() -> list[Kind]:
    """Return the kinds of ``D4``, the middle of an edge of each; the hand is that of both ends."""
    skeleton, kinds = atlas().skeleton, []
    for group in atlas().unordered["edges"]:
        edge = skeleton.edges[min(group)]
        line = traced(skeleton, edge)
        names = [
            atlas().kind(skeleton.corners[end]).split("_") for end in edge.ends if end is not None
        ]
        hands = {hand for _, hand in names}
        hand = hands.pop() if len(hands) == 1 else None
        ends = [f"{LETTERS[letter]}_{side}" for letter, side in sorted(names)]
        name = rf"${ends[0]}$ – ${ends[1]}$"
        kinds.append(Kind(line[len(line) // 2], edge.active, name, hand))
    return sorted(kinds, key=lambda kind: (kind.hand is None, kind.hand != "R", kind.name))


def faces() -> list[Kind]:
    """Return the kinds of ``D5``: ball on ball, and ball on rod."""
    r, t, half = PAIR.ball_radius, PAIR.rod_radius, PAIR.length / 2
    lean, up = math.radians(62), math.radians(-25)
    tip = half * np.array([math.sin(up), math.cos(up)])
    end = half * np.array([math.sin(lean), math.cos(lean)])
    first = tip + 2 * r * np.array([math.cos(0.1), -math.sin(0.1)]) + end
    second = 0.15 * tip + (r + t) * np.array([math.cos(up), -math.sin(up)]) + end
    found = []
    for place, angle, name in (
        (first, lean, "ball on ball"),
        (second, lean, "ball on rod"),
    ):
        q = np.array([0.0, 0.0, up, *place, angle])
        found.append(Kind(q, closed(q), name, None))
    return found


def apart() -> Kind:
    """Return a pair of ``D6``."""
    q = np.array([0.0, 0.0, math.radians(-20), 12.6, 3.0, math.radians(30)])
    return Kind(q, closed(q), "no contact", None)


def upright(q: Any) -> Any:
    """Return the centres ``(4, 2)`` of a pair about its middle, its mean axis upright."""
    centres = PAIR.developed(q)
    centres = centres - centres.mean(axis=0)
    first, second = centres[1] - centres[0], centres[3] - centres[2]
    axis = first + math.copysign(1.0, float(first @ second)) * second
    x, y = axis / np.linalg.norm(axis)
    return centres @ np.array([[y, x], [-x, y]])


@style.styled()
def draw_faces() -> Drawing:
    """Draw one pair for each kind of face, from the sharpest corner to the interior."""
    figure = style.canvas(style.WIDE, 6.3)
    upper, middle, lower = style.parts(figure, 3, 1)
    left, right = style.parts(lower, 1, 2, width_ratios=[2, 1])
    rows = (upper, 3, corners()), (middle, 4, edges()), (left, 5, faces()), (right, 6, [apart()])
    for part, dimension, kinds in rows:
        part.suptitle(_heading(dimension), x=0.02, ha="left")
        for axes, kind in zip(part.subplots(1, len(kinds), squeeze=False)[0], kinds, strict=True):
            _draw_kind(axes, kind)
    return figure


def counts(dimension: int) -> tuple[int, int, int]:
    """Return components of a stratum: up to relabelling, of ordered pairs, with labelled balls."""
    found = atlas()
    tables = (found.components_unordered, found.components_ordered, found.components)
    few, some, all_ = (table[dimension] for table in tables)
    return few, some, all_


def _heading(dimension: int) -> str:
    few, some, all_ = counts(dimension)
    words = {3: "corners", 4: "edges", 5: "faces", 6: "interior"}[dimension]
    if dimension == 6:
        return rf"$D_{dimension}$, {words}"
    numbers = f"{few} kinds; {some} of ordered pairs, {all_} with balls labelled"
    return rf"$D_{dimension}$, {words}: {numbers}"


def _draw_kind(axes: Axes, kind: Kind) -> None:
    centres = upright(kind.q)
    style.draw_pair(axes, PAIR, centres, style.HANDS[kind.hand])
    style.mark_contacts(axes, PAIR, centres, kind.contacts)
    style.bare(axes)
    axes.set(xlim=(-14.5, 14.5), ylim=(-27, 17.5))
    colour = style.HANDS[kind.hand][0]
    axes.text(0, -18.3, kind.name, ha="center", va="top", color=colour)
    axes.text(0, -23, ", ".join(kind.contacts), ha="center", va="top", fontsize=8.5, color="0.35")


def _faces_caption() -> str:
    listed = "; ".join(f"D{k}: {', '.join(map(str, counts(k)))}" for k in (3, 4, 5))
    return (
        f"One pair for every kind of face of the pair's polyhedron, {style.sizes(PAIR)}, in the "
        "developed plane; dumbbell A is dark, B light, contacts are yellow and named below "
        "(A2B1: ball on ball; A2b: ball A2 on the rod of B). Blue: right-handed, green: "
        "left-handed, grey: ends of different hand or no chirality. An edge is shown at its "
        "middle with the corners that it joins. Connected components, computed by walking along "
        f"all edges ({listed}), up to relabelling of dumbbells and balls, for ordered pairs with "
        f"balls alike, and with all balls labelled; D6 has {counts(6)[0]}."
    )


def _faces_alt() -> str:
    return (
        f"Three rows of pairs. {counts(3)[0]} corners: two nested pairs that touch at three "
        "points, mirror images of each other, and two pairs almost side by side that touch at "
        f"four, also mirror images. {counts(4)[0]} edges with two contacts: nested pairs sliding "
        "along each other's rods, right- and left-handed; a ball of one in the notch between "
        "ball and rod of the other, and its mirror image; and two dumbbells side by side, ball "
        "on ball twice. Then faces with one contact, ball on ball and ball on rod, and two "
        "dumbbells apart."
    )


# ----------------------------------------------------------------------------------- nested

NEAR_COUNT, NEAR_SEED, WIDTH = 4, 5, 0.22  # how many near each corner; their spread in the scales


def near(hand: str) -> list[Any]:
    """Return random pairs near the minimiser, without overlap and of its hand, in the drum."""
    pair, rng = style.PAIR, np.random.default_rng(NEAR_SEED)
    rest = minimiser(hand).point
    scales = pair.manifold.scale_array
    found: list[Any] = []
    while len(found) < NEAR_COUNT:
        q = rest + WIDTH * scales * rng.standard_normal(6)
        if pair.polyhedron.contains(q) and pair.chirality(q) == hand:
            found.append(q)
    return found


@cache
def minimiser(hand: str) -> DyadMinimum:
    """Return the certified minimiser of a hand."""
    right, left, _ = dyad_minima(style.PAIR)
    return right if hand == "R" else left


@style.styled()
def draw_nested() -> Drawing:
    """Draw pairs near the minimisers, and the minimisers with headings and contacts."""
    figure = style.canvas(style.WIDE, 3.9)
    left, right = style.parts(figure, 1, 2, width_ratios=[1.25, 1])
    left.suptitle(r"$\bf(a)$ near $\delta_R$ and near $\delta_L$", x=0.02, ha="left")
    right.suptitle(r"$\bf(b)$ least energy: $\delta_R$ and $\delta_L$", x=0.02, ha="left")
    grid = left.subplots(2, NEAR_COUNT)
    for row, hand in zip(grid, "RL", strict=True):
        for axes, q in zip(row, near(hand), strict=True):
            _draw_near(axes, q, hand)
    for axes, hand in zip(right.subplots(1, 2), "RL", strict=True):
        _draw_rest(axes, minimiser(hand), hand)
    return figure


def _draw_near(axes: Axes, q: Any, hand: str) -> None:
    pair = style.PAIR
    centres = pair.developed(q)
    middle = centres.mean(axis=0)
    style.draw_pair(axes, pair, centres - middle, style.HANDS[hand])
    axes.axvline(-middle[0], color=style.FAINT, lw=0.8, ls=(0, (3, 2)), zorder=0)
    style.bare(axes)
    axes.set(xlim=(-9.5, 9.5), ylim=(-18, 18))


def _draw_rest(axes: Axes, found: DyadMinimum, hand: str) -> None:
    pair, sign = found.pair, 1 if hand == "R" else -1
    centres = pair.developed(found.point)
    centres = centres - centres.mean(axis=0)
    style.draw_pair(axes, pair, centres, style.HANDS[hand])
    style.mark_contacts(axes, pair, centres, found.multipliers)
    axes.plot([0, 0], [-18, 14], color=style.LINE, lw=0.9, ls=(0, (3, 2)), zorder=0)
    heading = math.radians(found.headings[0])
    tip = centres[np.argmax(centres[:, 1])]
    start = tip - pair.length * np.array([math.sin(heading), math.cos(heading)])
    turn, reach = np.linspace(0, heading, 20), pair.length + 4.6
    axes.plot(*np.stack([start, start + np.array([0, reach + 1])]).T, color="0.2", lw=0.8, zorder=1)
    end = start + (reach + 1) * np.array([math.sin(heading), math.cos(heading)])
    axes.plot(*np.stack([start, end]).T, color="0.2", lw=0.8, zorder=1)
    arc = start + reach * np.stack([np.sin(turn), np.cos(turn)], axis=-1)
    axes.plot(*arc.T, color="0.2", lw=0.9, zorder=1)
    words = rf"$\theta_s = {found.headings[0]:+.2f}°$".replace("-", "−")
    x, y = arc.mean(axis=0) + np.array([0, 2.0])
    axes.text(x, y, words, ha="center", va="bottom")
    rows = [f"{name}:  {1e3 * value:.1f} µm/mm" for name, value in found.multipliers.items()]
    axes.text(sign * -0.5, -19.5, "\n".join(rows), ha="center", va="top", fontsize=8.5, color="0.3")
    style.bare(axes)
    axes.set(xlim=(-10, 10), ylim=(-29, 26))


def _nested_caption() -> str:
    right, left = minimiser("R"), minimiser("L")
    weights = ", ".join(f"{name} {1e3 * value:.2f}" for name, value in right.multipliers.items())
    return minus(
        f"Dyads, {style.sizes(style.PAIR)}, horizontal drum, in the developed wall; the lowest "
        "line is dashed, the first dumbbell dark, the second light; blue: right-handed, green: "
        f"left-handed. (a) Random pairs around the minimisers: normal deviations of {WIDTH:g} of "
        "the coordinates' scales (a ball radius, or the turn that moves a ball so far), seed "
        f"{NEAR_SEED}; what overlaps is left out. (b) The certified minimisers with headings "
        f"{right.headings[0]:+.3f}° and {left.headings[0]:+.3f}°, azimuths "
        f"±{abs(right.azimuths[0]):.3f}°. All three contacts (yellow) press: opening one by 1 mm "
        f"raises the sum of the ball heights at the rate of the multipliers, {weights} µm per mm."
    )


def _nested_alt() -> str:
    right = minimiser("R")
    return (
        f"Left: {NEAR_COUNT} right-handed pairs, loosely nested and leaning to the right, above "
        "as many left-handed ones leaning to the left. Right: the two pairs of least energy, "
        "mirror images, nested at three contacts astride the lowest line; the axis of the upper "
        f"dumbbell makes an angle of {right.headings[0]:.2f} degrees with the meridian, to the "
        "right for the right-handed pair and to the left for the other."
    )


FIGURES = (
    Figure("faces", "Pairs on the faces of the polyhedron", _faces_caption, _faces_alt, draw_faces),
    Figure("nested", "Dyads near and at least energy", _nested_caption, _nested_alt, draw_nested),
)
