"""
Clusters of atoms and the passes between them
=============================================

Six atoms that attract each other have two shapes at rest, and three passes between copies of these.

Atoms with the potential of Lennard-Jones are at rest as an octahedron or, a little higher, as three
tetrahedra in a row.  ``search_landscape`` descends from random clusters, walks uphill from them and
from the minima, and goes down on both sides of each saddle.  Shapes are told apart up to
congruence and the order of the atoms, so that a pass may lead from a shape to itself: atoms have
then changed places.  The lowest one joins the two shapes; so the row of tetrahedra is left by
climbing the difference of the two energies.  Nothing here is proved; the numbers of minima and
saddles are those that are published [DW].

Run it to draw the clusters: ``python examples/ex30_clusters_of_atoms.py [FOLDER]``.
"""

import sys
from pathlib import Path

import numpy as np

from polycorner.landscapes import Landscape, search_landscape
from polycorner.models import LennardJones, SphereCluster

ATOMS, STARTS = 6, 60


def main() -> Landscape:
    """Return minima and passes of six atoms."""
    model, rng = LennardJones(ATOMS), np.random.default_rng(1)
    return search_landscape(
        model.polyhedron,
        model.energy,
        starts=model.starts(rng, STARTS),
        symmetry=model.symmetry,
        rng=rng,
    )


def draw(found: Landscape, path: Path) -> Path:
    from polycorner.pictures import draw_clusters, save

    points = np.array([*(m.point for m in found.minima), *(p.point for p in found.passes)])
    shapes = [f"minimum {m.energy[0]:.3f}" for m in found.minima]
    shapes += [f"pass {p.energy[0]:.3f}" for p in found.passes]
    return save(draw_clusters(SphereCluster(ATOMS), points, labels=shapes), path)


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    landscape = main()
    print(landscape.statement)
    print(f"the row of tetrahedra is left by climbing {landscape.depth(1)[1]:.4f}")
    print(f"wrote {draw(landscape, folder / 'ex30_clusters.png')}")
