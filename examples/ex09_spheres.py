"""
Six sticky spheres
==================

Six hard spheres that stick: two rigid clusters, and the motions between them.

A rigid cluster is a corner of the polyhedron of all placements, modulo congruence and relabelling.
Breaking one contact opens a motion with one degree of freedom, an edge, that continues until a new
contact closes; breaking two opens a face.  From stacked tetrahedra the search finds the octahedron,
five motions and thirteen faces, as many as are known ([HGB] table I).  The number of motions out of
a cluster follows from its symmetry: contacts that a symmetry exchanges break in the same way, so
the octahedron, whose twelve contacts are all equivalent, has a single one.

Run it to draw both figures: ``python examples/ex09_spheres.py [FOLDER]``.
"""

import sys
from dataclasses import dataclass
from pathlib import Path

from polycorner import Skeleton, skeleton
from polycorner.models import SphereCluster

MODEL = SphereCluster(6)


@dataclass(frozen=True)
class Row:
    """A rigid cluster: contacts, order of its symmetry group, kinds of contacts, ways out.

    A motion that returns to its own cluster counts twice in ``degree``, once for either end.
    """

    contacts: int
    order: int
    kinds: int
    degree: int
    leads_to: tuple[int, ...]


@dataclass(frozen=True)
class Result:
    """The atlas, and a row for each of its corners."""

    atlas: Skeleton
    table: list[Row]


def main() -> Result:
    atlas = skeleton(MODEL.polyhedron, MODEL.starts(), symmetry=MODEL.symmetry)
    return Result(atlas, [row(atlas, k) for k in range(len(atlas.corners))])


def row(atlas: Skeleton, k: int) -> Row:
    """Describe a corner by its symmetry and by the edges that leave it."""
    corner = atlas.corners[k]
    group = MODEL.symmetry.relabellings(MODEL.manifold, corner.point, corner.point, 1e-6)
    kinds = {frozenset(g[contact] for g in group) for contact in corner.active}
    ends = [edge.ends for edge in atlas.edges if k in edge.ends]
    return Row(
        contacts=len(corner.active),
        order=len(group),
        kinds=len(kinds),
        degree=atlas.graph.degree[k],
        leads_to=tuple(sorted(b if a == k else a for a, b in ends)),
    )


def draw(result: Result, folder: Path) -> list[Path]:
    """Draw the clusters, and the motion from one to the other."""
    from polycorner.pictures import draw_clusters, draw_motion, save

    points = [corner.point for corner in result.atlas.corners]
    change = next(edge for edge in result.atlas.edges if not edge.is_loop)
    return [
        save(draw_clusters(MODEL, points), folder / "ex09_clusters.png"),
        save(draw_motion(MODEL, change.polyline), folder / "ex09_motion.png"),
    ]


if __name__ == "__main__":
    result = main()
    print(result.atlas)
    print("cluster  contacts  symmetry  kinds of contact  degree  motions to")
    for k, r in enumerate(result.table):
        others = " ".join(f"C{other}" for other in r.leads_to)
        print(f"C{k:<6} {r.contacts:9} {r.order:9} {r.kinds:17} {r.degree:7}  {others}")
    for edge in result.atlas.edges:
        a, b = edge.ends
        print(f"C{a} to C{b}, length {edge.length:.3f}, while {', '.join(edge.active)} hold")
    for path in draw(result, Path(sys.argv[1] if len(sys.argv) > 1 else "out")):
        print(f"wrote {path}")
