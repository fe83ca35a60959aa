"""A curvilinear polyhedron in the plane with its corners and sides."""

import math

import numpy as np
from matplotlib.figure import Figure as Drawing

from paper_checks.figures import style
from paper_checks.figures.figure import Figure
from polycorner.models import Tutorial
from polycorner.pictures import draw_region
from polycorner.polyhedra import LocalType, stratum_at

REGION = Tutorial()
BOUNDS = (-3.9, 4.1, -3.2, 3.5)


def inward() -> list[str]:
    """Return the sides that bulge into the region: the midpoints of their chords lie outside."""
    found = []
    for name, line in REGION.sides().items():
        if REGION.polyhedron.implicit((line[0] + line[-1]) / 2) < -1e-9:
            found.append(name)
    return found


def straight() -> list[str]:
    """Return the sides that are segments."""
    found = []
    for name, line in REGION.sides().items():
        chord, way = line[-1] - line[0], np.diff(line, axis=0)
        if math.isclose(np.hypot(*chord), np.hypot(*way.T).sum(), rel_tol=1e-9):
            found.append(name)
    return found


@style.styled()
def draw_tutorial() -> Drawing:
    """Draw the region with the names of its corners and sides."""
    figure = draw_region(
        REGION.polyhedron,
        BOUNDS,
        corners=[(f"${name}$", point) for name, point in REGION.corners().items()],
        edges=list(REGION.sides().values()),
    )
    figure.set_size_inches(style.NARROW, 4.0)
    (axes,) = figure.axes
    axes.set(xlabel="$x$ (any unit of length)", ylabel="$y$")
    axes.text(0.1, 0.35, "$D_2$", ha="center", va="center", fontsize=14, color="0.35")
    side = REGION.sides()["EF"]
    axes.annotate(
        "$D_1$",
        tuple(side[len(side) // 2]),
        xytext=(-1.4, 3.3),
        color=style.RIGHT[0],
        fontsize=13,
        va="center",
        arrowprops={"arrowstyle": "-", "color": style.RIGHT[0], "lw": 0.8},
    )
    axes.annotate(
        "$D_0$",
        tuple(REGION.corners()["C"]),
        xytext=(3.5, -2.2),
        fontsize=13,
        ha="center",
        arrowprops={"arrowstyle": "-", "lw": 0.8, "shrinkB": 4},
    )
    return figure


def _caption() -> str:
    corners = REGION.corners()
    quadrants = sum(
        stratum_at(REGION.polyhedron, point).local_type is LocalType.QUADRANT
        for point in corners.values()
    )
    return (
        f"A region of the plane bounded by {len(REGION.walls)} walls, like the one with which the "
        f"paper explains polyhedra: D0 has {len(corners)} corners, A to G, D1 "
        f"{len(REGION.sides())} sides, D2 is the shaded inside. At {quadrants} of the corners two "
        "functions vanish with independent gradients, so that the region is locally convex in "
        f"coordinates that they give. It is not convex: {len(inward())} arcs "
        f"({', '.join(inward())}) bulge inwards, and the middles of their chords lie outside. "
        f"{' and '.join(straight())} are straight. The shape is ours; the paper gives no numbers "
        "for its own."
    )


def _alt() -> str:
    return (
        f"A shaded region with {len(REGION.corners())} marked corners A to G, counterclockwise "
        f"from below left, and as many blue sides: {len(straight())} straight, {len(inward())} "
        "arcs that bulge into the region and "
        f"{len(REGION.sides()) - len(straight()) - len(inward())} that bulge outwards."
    )


FIGURES = (Figure("tutorial", "A curvilinear polyhedron", _caption, _alt, draw_tutorial),)
