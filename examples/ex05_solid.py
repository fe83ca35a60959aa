"""
The solid of forbidden placements
=================================

The solid of forbidden relative placements of two dumbbells, with its edges and corners.

In the plane two dumbbells overlap at a relative placement ``(x, y, delta)`` exactly when it lies in
a parallelogram with the sides of both, widened by ``r + t``, or in a disc of radius ``2 r`` about
one of its corners.  So the solid's edges (two contacts) are the intersections of discs with widened
sides, for every relative heading, and for parallel dumbbells the lines and arcs between its
corners: three contacts at ``Delta``, four at ``E``.  Edges and corners point inwards: the allowed
placements lie outside.

Run it to draw the solid: ``python examples/ex05_solid.py [FOLDER]``, with a GLB beside it.
"""

import math
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from polycorner.dumbbells import DumbbellPair
from polycorner.dumbbells.pictures import forbidden_solid, relative_placements
from polycorner.pictures import components_of_complement, draw_solid, write_mesh

PAIR = DumbbellPair(length=16, ball_radius=3, rod_radius=1.5)
P = PAIR.ball_radius + PAIR.rod_radius
REACH = math.sqrt(4 * PAIR.ball_radius**2 - P**2)  # along a side, from a corner to the edge


@dataclass(frozen=True)
class Result:
    """Volume in mm^2 rad, topology, and errors in mm.

    Those of the edges in closed form, and of the corners in the mesh.
    """

    volume: float
    euler_characteristic: int
    allowed_components: int
    edge_error: float
    corner_error: float


def main(resolution: int = 48) -> Result:
    solid = forbidden_solid(PAIR, resolution, period=math.pi)
    points = np.concatenate([points for _, points in edges()])
    gaps = np.sort(PAIR.polyhedron.values(relative_placements(PAIR, points)), axis=-1)
    return Result(
        volume=solid.curved_volume,
        euler_characteristic=solid.euler_characteristic,
        allowed_components=components_of_complement(solid),
        edge_error=float(abs(gaps[:, :2]).max()),
        corner_error=solid.corner_error(corners()[0], (1.0, 1.0, PAIR.length / 2)),
    )


def edges(count: int = 91) -> list[tuple[str, np.ndarray]]:
    """Return the edges from one quarter turn to the other: kind of contacts, and points."""
    curves = []
    for headings in (np.linspace(-math.pi / 2, 0, count), np.linspace(0, math.pi / 2, count)):
        a = PAIR.length / 2 * np.stack([0 * headings, 1 + 0 * headings], axis=1)
        b = PAIR.length / 2 * np.stack([np.sin(headings), np.cos(headings)], axis=1)
        outwards = 1 if headings.mean() > 0 else -1
        for middle, half in ((a, b), (b, -a), (-a, -b), (-b, a)):
            along = half / (PAIR.length / 2)
            normal = outwards * np.stack([-along[:, 1], along[:, 0]], axis=1)
            for sign in (-1, 1):
                places = middle + sign * (half - REACH * along) + P * normal
                curves.append(("ball on ball, ball on rod", np.column_stack([places, headings])))
    straight = np.linspace(REACH, PAIR.length - REACH, count)
    angle = np.linspace(-1, 1, count) * math.acos(P / (2 * PAIR.ball_radius))
    for sign in (-1, 1):
        for up in (-1, 1):
            line = np.column_stack([0 * straight + sign * P, up * straight, 0 * straight])
            curves.append(("two balls on rods", line))
        arc = 2 * PAIR.ball_radius * np.stack([sign * np.cos(angle), np.sin(angle)], axis=1)
        curves.append(("ball on ball twice", np.column_stack([arc, 0 * angle])))
    return curves


def corners() -> tuple[np.ndarray, list[str]]:
    """Return the eight corners of parallel dumbbells and their names."""
    along = (REACH, PAIR.length - REACH)
    places = [(x, y * up, 0.0) for x in (-P, P) for y in along for up in (-1, 1)]
    return np.array(places), ["$E$", "$E$", "$\\Delta$", "$\\Delta$"] * 2


def draw(path: Path, resolution: int = 128) -> Path:
    """Draw the solid over half a turn, and write it as a GLB with ``l/2`` mm to a radian."""
    from polycorner.pictures import save

    solid = forbidden_solid(PAIR, resolution, period=math.pi)
    points, names = corners()
    drawn = save(draw_solid(solid.mesh, edges(), points, names, caps=solid.caps), path)
    scale = (1.0, 1.0, PAIR.length / 2)
    write_mesh(solid.mesh, path.with_suffix(".glb"), curves=edges(), points=points, scale=scale)
    return drawn


if __name__ == "__main__":
    print(main())
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    print(f"wrote {draw(folder / 'ex05_solid.png')}")
