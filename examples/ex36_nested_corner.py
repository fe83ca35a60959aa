"""
A nested pair over its sizes
============================

Two dumbbells in a drum nest in each other: ball on ball, and a ball of each on the other's rod.
Where does this equilibrium end, and what is beyond?

Thicker rods push the pair apart, until both contacts with the rods lose their force at once.  There
the minimum meets the pass over which the pair falls apart, and nothing is beyond.  Both contacts
open together as long as the dumbbells are equal.  If one is heavier they do not: the corner opens
the contact of the heavier ball first and goes on as a minimum with two contacts, which meets the
pass later.  In the plane of the rods' radius and the ratio of the weights four curves of events
meet where the dumbbells are equal.

Short dumbbells do not reach each other's rods: three balls hold the pair there.

In a tilted drum a part of the weight pulls along the axis, and without friction the whole pair
slides.  What carries it decides.  If each dumbbell's own share is carried, the sum of the axial
positions is held and the corner stays at every tilt.  If the drum holds one of them alone, or the
pair leans on the drum's end, the other pulls or pushes the contacts open at a tenth to four tenths
of a degree.

Run it to draw the maps: ``python examples/ex36_nested_corner.py [FOLDER]``.
"""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
import sympy

from polycorner import Certificate, Polyhedron, SmoothFunction, Symmetry, minimise
from polycorner.branches import (
    BranchKind,
    Diagram,
    EventMap,
    Jump,
    branches,
    event_curves,
    hysteresis,
)
from polycorner.dumbbells import DumbbellPair
from polycorner.polyhedra import AllOf

LENGTH, BALL, ROD, DRUM = 16.0, 3.0, 1.5, 125.0  # mm
HANDS: tuple[Literal["R", "L"], ...] = ("R", "L")
SUPPORTS = {"each": 90.0, "lower": 0.2, "upper": 0.6, "end": 0.2}  # what is held, to which tilt
SHIFT = Symmetry(lambda _: np.array([[0.0, 1, 0, 0, 1, 0]]))  # along the drum


@dataclass(frozen=True)
class Result:
    """Equilibria over the rods' radius, and maps of events over it and the other numbers.

    At the paper's radius a contact opens where B is ``ratio`` times as heavy as A.  ``tilts`` are
    equilibria over the tilt, in radians, by what is held and by the hand; on the drum's end the
    pair slides together where they end, in the ``slide``.
    """

    equal: Diagram
    unequal: Diagram
    ratio: float
    weights: EventMap
    lengths: EventMap
    drums: EventMap
    tilts: dict[tuple[str, str], Diagram]
    slide: Jump


def heights(pair: DumbbellPair) -> list[sympy.Expr]:
    """Return the height of A and that of B, of both balls, above the lowest line.

    The mean height of the balls is ``rho (1 - cos(phi) sqrt(1 - (l sin(theta) / 2 rho)^2))``.
    """
    phi1, _, theta1, phi2, _, theta2 = pair.manifold.symbols
    rho = pair.centre_radius
    return [
        2
        * rho
        * (1 - sympy.cos(phi) * sympy.sqrt(1 - (LENGTH * sympy.sin(theta) / (2 * rho)) ** 2))
        for phi, theta in ((phi1, theta1), (phi2, theta2))
    ]


def weighed(pair: DumbbellPair, ratio: float) -> SmoothFunction:
    """Return the height of A, and that of B as often as it is heavier."""
    a, b = heights(pair)
    energy = a + sympy.Symbol("b") * b
    return SmoothFunction("energy", energy, pair.manifold, parameters={"b": ratio})


def tilted(pair: DumbbellPair, hand: Literal["R", "L"], held: str) -> Certificate:
    """Return the nested pair at a small tilt, in a drum that rises with ``eta``.

    The weights of the four balls have the parts ``cos(tilt)`` and ``sin(tilt)``.  B is the upper
    dumbbell.  Held is an axial position by an equation, whose multiplier is the force that carries
    it; or every ball by the end of the drum, at ``eta = 0``.
    """
    _, eta1, theta1, _, eta2, theta2 = pair.manifold.symbols
    tilt, small = sympy.Symbol("tilt"), 1e-5
    energy = sympy.cos(tilt) * sum(heights(pair)) + sympy.sin(tilt) * 2 * (eta1 + eta2)
    gaps, start = list(pair.polyhedron.functions), pair.nested(hand)
    if held == "end":
        balls = [(eta1, theta1, "A"), (eta2, theta2, "B")]
        gaps += [
            SmoothFunction(
                f"{name}{k}", eta + side * LENGTH / 2 * sympy.cos(theta) - BALL, pair.manifold
            )
            for eta, theta, name in balls
            for k, side in ((1, -1), (2, 1))
        ]
        start[[1, 4]] += LENGTH / 2 + BALL - start[1]
        polyhedron = Polyhedron(pair.manifold, AllOf(*gaps))
    else:
        place = {"lower": eta1, "upper": eta2, "each": (eta1 + eta2) / 2}[held]
        start[[1, 4]] -= {"lower": start[1], "upper": start[4], "each": 0.0}[held]
        support = SmoothFunction("support", place, pair.manifold)
        polyhedron = Polyhedron(pair.manifold, AllOf(*gaps), support)
    energy = SmoothFunction("energy", energy, pair.manifold, parameters={"tilt": small})
    return minimise(polyhedron, energy, start)


def main() -> Result:
    pair = DumbbellPair(LENGTH, BALL, ROD, DRUM)
    nested = pair.nested("R")
    start = minimise(pair.polyhedron, pair.energy, nested)
    equal = branches(start, "t", (1.0, 2.99), symmetry=SHIFT)
    drums = event_curves(equal, {"R": 1.0, "rho": 1.0}, (-100.0, 75.0), symmetry=SHIFT)

    start = minimise(pair.polyhedron, weighed(pair, 1.05), nested)
    unequal = branches(start, "t", (1.0, 2.99), symmetry=SHIFT)
    weights = event_curves(unequal, "b", (0.4, 2.5), symmetry=SHIFT)
    events = branches(start, "b", (1.0, 2.5), symmetry=SHIFT).events
    (ratio,) = (event.parameter for event in events if event.kind is BranchKind.OPENS)

    # Short dumbbells, in both states.
    starts = []
    for rod in (1.0, 2.1):
        pair = DumbbellPair(7.0, BALL, rod, DRUM)
        starts.append(minimise(pair.polyhedron, pair.energy, pair.nested("R")))
    short = branches(starts, "t", (0.2, 2.99), symmetry=SHIFT)
    lengths = event_curves(short, "l", (6.05, 30.0), symmetry=SHIFT)

    pair = DumbbellPair(LENGTH, BALL, ROD, DRUM)
    tilts = {
        (held, hand): branches(tilted(pair, hand, held), "tilt", (1e-5, np.radians(most)))
        for held, most in SUPPORTS.items()
        for hand in HANDS
    }
    slide = hysteresis(tilts["end", "R"]).jumps[0]
    return Result(equal, unequal, ratio, weights, lengths, drums, tilts, slide)


def draw(result: Result, folder: Path) -> list[Path]:
    """Draw the maps over the weights and over the length."""
    from polycorner.pictures import draw_event_map, save

    rod = "radius of the rods (mm)"
    weights = draw_event_map(result.weights, labels=(rod, "weight of B over that of A"))
    lengths = draw_event_map(result.lengths, labels=(rod, "length (mm)"), minima=False)
    weights.axes[0].plot(ROD, 1.0, "k*")
    lengths.axes[0].plot(ROD, LENGTH, "k*")
    for place, words in (((0.3, 7.5), "three balls touch"), ((1.0, 20.0), "balls touch rods")):
        lengths.axes[0].text(*place, words)
    return [
        save(weights, folder / "ex36_nested_corner_weights.png"),
        save(lengths, folder / "ex36_nested_corner_lengths.png"),
    ]


if __name__ == "__main__":
    result = main()
    print(f"a contact opens where one is {result.ratio:.4f} times as heavy")
    for name in ("weights", "lengths", "drums"):
        print(getattr(result, name))
    for (held, hand), found in result.tilts.items():
        ends = [(e.kind.name, e.functions, np.degrees(e.parameter)) for e in found.events]
        print(held, hand, *(end for end in ends if end[0] != "END"))
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    folder.mkdir(parents=True, exist_ok=True)
    print(f"wrote {', '.join(map(str, draw(result, folder)))}")
