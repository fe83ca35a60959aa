"""
The paper's heading of a dyad
=============================

The paper's heading of a dyad, computed: which of its assumptions give ``arctan(r/l)``.

The paper has weightless rods, a level drum, and a nested pair that rests where its three contacts
are closed, at the heading ``+-arctan(r/l)``.  Under these assumptions alone the heading is another
one, 7.94 degrees in place of 10.62 for the experiment's dumbbells ([GMBN] sec. 6, app. C).  The
formula follows from two more, which the paper makes without saying so:

*across*
    the line through the two inner balls is at right angles to the rods, as if these were as thick
    as the balls, so that the dumbbells are ``2 r`` apart and shifted by the whole length;
*outer*
    the outer balls lie on the lowest line, as if the inner ones had no weight.

Each is put on its own, and both together, and the energy is minimised again, for right- and
left-handed pairs of all lengths.  Only both give the formula, to all digits; *across*, which
contradicts the paper's "rods significantly thinner than the balls", makes most of the difference.
Neither pair is held: under *across* the weight pulls the dumbbells apart along the rods, where no
contact acts, and under *outer* no contact has a force at all.  The third curve is what the paper's
types of entrapment, (1, 4, 1), say: that of three contacts only the one between balls has a force.
Then the heading is ``arcsin(r/l)``, and the point is not a minimum but the pass over which dyads
open.

Run it to draw the figure: ``python examples/ex39_paper_heading.py [FOLDER]``.
"""

import math
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import sympy

from polycorner import AllOf, Certificate, Polyhedron, SmoothFunction, stationary_on
from polycorner.dumbbells import DumbbellPair, dyad_minima
from polycorner.dumbbells.pair import Chirality

if TYPE_CHECKING:
    from matplotlib.axes import Axes

DRUM = DumbbellPair(length=16, ball_radius=3, rod_radius=1.5, drum_radius=125)
LENGTHS = (8.0, 10.0, 12.0, 14.0, 16.0, 18.0, 20.0, 24.0, 28.0)
MEASURED = (16.0, 15.0, 2.0)  # mm, and degrees: what the text gives; other points are not numbers
CORNER = ("A2B1", "A2b", "aB1")
CASES = {  # whether inner balls are beside each other across the rods, and weightless
    "neither": (False, False),
    "across": (True, False),
    "outer": (False, True),
    "both": (True, True),
}
FORCE = 1e-9  # of the energy per mm, above which a contact is pressed
HANDS: dict[Chirality, str] = {"R": "#0072B2", "L": "#009E73"}


@dataclass(frozen=True)
class Row:
    """Headings in degrees of pairs of one length and hand, in the plane but for ``drum``.

    ``cases`` are by assumption, and ``held`` says in which of them all contacts are pressed and no
    force is left that no contact carries.  ``single`` is the heading where only the balls press.
    """

    length: float
    hand: Chirality
    drum: float
    cases: dict[str, float]
    held: dict[str, bool]
    single: float

    @property
    def formula(self) -> float:
        """The paper's ``+-arctan(r/l)``."""
        sign = 1 if self.hand == "R" else -1
        return sign * math.degrees(math.atan(DRUM.ball_radius / self.length))


def main() -> list[Row]:
    return [row(length, hand) for hand in ("R", "L") for length in LENGTHS]


def row(length: float, hand: Chirality) -> Row:
    """Return the headings of one length and hand under each of the assumptions."""
    drum = replace(DRUM, length=length)
    pair = replace(drum, drum_radius=math.inf)
    found = {name: assumed(pair, hand, *case) for name, case in CASES.items()}
    only = stationary_on(pair.polyhedron, pair.energy, pair.nested(hand), CORNER[:1])
    return Row(
        length,
        hand,
        dyad_minima(drum)["RL".index(hand)].headings[0],
        {name: heading(pair, one) for name, one in found.items()},
        {name: held(one) for name, one in found.items()},
        heading(pair, only),
    )


def assumed(pair: DumbbellPair, hand: Chirality, across: bool, outer: bool) -> Certificate:
    """Return the pair of least energy whose contacts are closed, under the assumptions."""
    start = pair.nested(hand, clearance=0.0)
    energy = outer_weights(pair) if outer else pair.energy
    if not across:
        return stationary_on(pair.polyhedron, energy, start, CORNER)
    beside = Polyhedron(pair.manifold, AllOf(*side_by_side(pair, hand)))
    return stationary_on(beside, energy, start, beside.names)


def side_by_side(pair: DumbbellPair, hand: Chirality) -> list[SmoothFunction]:
    """Return functions that vanish where inner balls touch across the rods, which are parallel.

    The first one is positive where they are farther apart, the second where the dumbbells overlap
    more along their rods.
    """
    x1, y1, theta1, x2, y2, theta2 = pair.manifold.symbols
    axis = sympy.Matrix([sympy.sin(theta1), sympy.cos(theta1)])
    other = sympy.Matrix([sympy.sin(theta2), sympy.cos(theta2)])
    normal = (1 if hand == "R" else -1) * sympy.Matrix([-axis[1], axis[0]])
    apart = sympy.Matrix([x2 - x1, y2 - y1]) - pair.length / 2 * (axis + other)  # from A2 to B1
    gaps = {
        "apart": apart.dot(normal) - 2 * pair.ball_radius,
        "overlap": -apart.dot(axis),
        "parallel": sympy.sin(theta2 - theta1),
    }
    return [SmoothFunction(name, gap, pair.manifold) for name, gap in gaps.items()]


def outer_weights(pair: DumbbellPair) -> SmoothFunction:
    """Return half the squared lateral positions of the outer balls, A1 and B2."""
    x1, _, theta1, x2, _, theta2 = pair.manifold.symbols
    half = pair.length / 2
    places = x1 - half * sympy.sin(theta1), x2 + half * sympy.sin(theta2)
    return SmoothFunction("outer", sum(x**2 for x in places) / 2, pair.manifold)


def held(found: Certificate) -> bool:
    """Return whether all contacts are pressed, and nothing pulls along the rods."""
    forces = dict(found.multipliers)
    along = forces.pop("overlap", 0.0)
    forces.pop("parallel", None)
    return min(forces.values()) > FORCE and abs(along) < FORCE


def heading(pair: DumbbellPair, found: Certificate) -> float:
    """Return the mean heading in degrees."""
    return float(np.degrees(pair.heading(found.point)[0]))


def draw(rows: list[Row], path: Path) -> Path:
    """Draw all headings against length, and the experiment's pair and the paper's."""
    from matplotlib.figure import Figure

    from polycorner.pictures import save

    figure = Figure(figsize=(12, 5.6), layout="constrained")
    curves, *pairs = figure.subplots(1, 3, width_ratios=[2.2, 1, 1])
    _draw_headings(curves, rows)
    plane = replace(DRUM, drum_radius=math.inf)
    titles = {"neither": "(b) the pair that rests", "both": "(c) the paper's"}
    for axes, (name, title) in zip(pairs, titles.items(), strict=True):
        found = assumed(plane, "R", *CASES[name])
        _draw_pair(axes, plane, found)
        axes.set_title(f"{title}: {heading(plane, found):.2f}°")
    return save(figure, path)


def _draw_headings(axes: "Axes", rows: list[Row]) -> None:
    lengths = np.linspace(min(LENGTHS), max(LENGTHS), 200)
    formula = np.degrees(np.arctan2(DRUM.ball_radius, lengths))
    for sign in (1, -1):
        label = "the paper's formula, ±arctan(r/l)" if sign > 0 else None
        axes.plot(lengths, sign * formula, color="#C1272D", lw=1.2, label=label)
    lines = {"across": ":", "outer": "--"}
    for hand, colour in HANDS.items():
        own = [one for one in rows if one.hand == hand]
        x = [one.length for one in own]
        told = hand == "R"
        axes.plot(x, [r.drum for r in own], "o-", color=colour, label=f"at rest, hand {hand}")
        axes.plot(
            x, [r.cases["both"] for r in own], "x", color="#C1272D", ms=7,
            label="computed under both assumptions" if told else None,
        )  # fmt: skip
        for name, line in lines.items():
            y = [r.cases[name] for r in own]
            axes.plot(
                x, y, line, color="0.45", lw=1, label=f"under “{name}” alone" if told else None
            )
    length, measured, about = MEASURED
    axes.errorbar(
        [length] * 2,
        [measured, -measured],
        yerr=about,
        fmt="kD",
        capsize=3,
        label="measured (text)",
    )
    axes.axhline(0, color="0.8", lw=0.8, zorder=0)
    axes.set(title="(a) heading against length", xlabel="length l (mm)", ylabel="heading (degrees)")
    axes.legend(fontsize=8, frameon=False, loc="upper center", bbox_to_anchor=(0.5, -0.1), ncols=3)


def _draw_pair(axes: "Axes", pair: DumbbellPair, found: Certificate) -> None:
    from matplotlib.patches import Circle

    centres = pair.developed(found.point)
    middle = centres.mean(axis=0)
    for (start, end), colour in zip(
        centres.reshape(2, 2, 2) - middle, ("0.35", "#0072B2"), strict=True
    ):
        axes.plot(*np.stack([start, end], axis=-1), color=colour, lw=6, solid_capstyle="butt")
        for centre in (start, end):
            axes.add_patch(Circle(tuple(centre), pair.ball_radius, color=colour, alpha=0.75))
    axes.axvline(-middle[0], color="#C1272D", lw=1)
    reach = pair.length + 2 * pair.ball_radius
    axes.set(aspect="equal", xlim=(-9, 9), ylim=(-reach, reach), xlabel="across the drum (mm)")


if __name__ == "__main__":
    rows = main()
    print("length hand  at rest   across    outer     both  arctan(r/l)  arcsin(r/l)  held")
    for one in rows:
        cases = "".join(f"{one.cases[name]:9.3f}" for name in ("across", "outer", "both"))
        good = ", ".join(name for name, fast in one.held.items() if fast)
        told = f"{one.length:4g}   {one.hand}   {one.drum:9.3f}{cases}  {one.formula:11.3f}"
        print(f"{told}  {one.single:11.3f}  {good}")
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    print(f"wrote {draw(rows, folder / 'ex39_paper_heading.png')}")
