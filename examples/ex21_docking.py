"""
How two rigid clusters dock
===========================

Every way in which two rigid clusters of equal spheres hold each other.

A triangle and a triangle, a tetrahedron and a pair, ...: the spheres of one cluster touch those of
the other, and where enough of them do, neither can move.  Such dockings are the corners of the
polyhedron of placements without overlap, modulo motions of the whole, exchanges and rotations of a
cluster onto itself.  Its edges are the ways from one docking to the next along which one contact
less is held; chemists know this polyhedron as the atlas of a docking problem.

A corner is a rigid cluster of all spheres, divided into the two.  So there must be as many corners
as divisions of the known rigid clusters of five, six and seven spheres, up to rotations: mirror
images are different dockings.

Run it to draw them: ``python examples/ex21_docking.py [FOLDER]``.
"""

import sys
from pathlib import Path

from polycorner import Skeleton, skeleton
from polycorner.bodies import Arrangement, Body, compound, sphere
from polycorner.models import SphereCluster


def main(first: int = 3, second: int = 3) -> tuple[Arrangement, Skeleton]:
    """Return two clusters of two, three or four spheres, and all their dockings."""
    dock = Arrangement({"A": cluster(first), "B": cluster(second)})
    start = dock.point({"A": [0, 0, 0], "B": [3.0, 0.2, 0.1]})
    return dock, skeleton(dock.polyhedron, [start], symmetry=dock.symmetry)


def cluster(count: int) -> Body:
    """Return spheres of diameter 1 that all touch each other, about their centroid."""
    centres = SphereCluster(count).stacked().reshape(count, 3)
    return compound([sphere(0.5, at=c) for c in centres - centres.mean(axis=0)])


def draw(dock: Arrangement, found: Skeleton, path: Path) -> Path:
    from polycorner.pictures import draw_arrangement, save

    titles = [f"{len(c.active)} contacts" for c in found.corners]
    return save(draw_arrangement(dock, [c.point for c in found.corners], titles=titles), path)


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    dock, found = main()
    print(f"{len(found.corners)} dockings, {len(found.edges)} ways between them")
    print(f"wrote {draw(dock, found, folder / 'ex21_docking.png')}")
