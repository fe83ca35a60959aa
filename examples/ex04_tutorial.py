"""
A region that is locally convex
===============================

A region that is locally convex but not convex: its corners and sides, and two minima.

Seven segments and arcs bound the region; three of the arcs bulge into it.  Tracing them finds
seven corners, seven edges and one face.  At each corner two functions vanish with independent
gradients, so that the region is a quadrant in the coordinates they define: that is local
convexity.  Yet a segment between two points of an inward arc leaves the region, however near they
are, and the height ``y`` has local minima at both A and B: on a convex region every local minimum
of a linear energy is global.

Run it to draw the figure: ``python examples/ex04_tutorial.py [FOLDER]``.
"""

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from polycorner import Certificate, Skeleton, certify, skeleton
from polycorner.models import Tutorial
from polycorner.skeletons import Corner

REGION = Tutorial()


@dataclass(frozen=True)
class Result:
    """The atlas, corners by their letters, the middle of a chord, and ``y`` at every corner."""

    atlas: Skeleton
    corners: dict[str, Corner]
    middle: np.ndarray
    heights: dict[str, Certificate]


def main() -> Result:
    atlas = skeleton(REGION.polyhedron, REGION.starts(np.random.default_rng(0), 3))
    corners = dict(sorted((letter(corner), corner) for corner in atlas.corners))
    _, y = REGION.manifold.symbols
    return Result(
        atlas=atlas,
        corners=corners,
        middle=REGION.sides()["AB"][[30, 34]].mean(axis=0),
        heights={name: certify(REGION.polyhedron, y, c.point) for name, c in corners.items()},
    )


def letter(corner: Corner) -> str:
    """Return the letter that the names of a corner's two sides share."""
    (name,) = set.intersection(*map(set, corner.active))
    return name


def draw(result: Result, path: Path) -> Path:
    """Draw the region with the names of its corners and sides."""
    from polycorner.pictures import draw_region, save

    figure = draw_region(
        REGION.polyhedron,
        (-3.9, 4.1, -3.2, 3.5),
        corners=[(name, corner.point) for name, corner in result.corners.items()],
        edges=list(REGION.sides().items()),
    )
    return save(figure, path)


if __name__ == "__main__":
    result = main()
    print(result.atlas)
    for name, corner in result.corners.items():
        (x, y), rest = corner.point, result.heights[name]
        sides = " and ".join(corner.active)
        print(f"{name}  ({x:+.6f}, {y:+.6f})  {sides}: {corner.local_type.value}")
        if rest.is_minimum:
            print(f"   minimum of the height: {rest.verdict.value}")
    depth = REGION.polyhedron.implicit(result.middle)
    print(f"the middle of a short chord of AB is outside the region: f = {depth:.1e}")
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    print(f"wrote {draw(result, folder / 'ex04_tutorial.png')}")
