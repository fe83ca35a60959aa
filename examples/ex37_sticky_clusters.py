"""
How often sticky clusters are seen
==================================

Spheres that stick, and how often each of their rigid clusters is seen.

Colloidal spheres that attract each other over a short range form rigid clusters, all with the same
energy.  ``measure`` weighs them by rotations, vibrations and the symmetry number ([HGB]); of six
spheres, the octahedron has four percent, as measured ([MABM]).  Along the edges of the skeleton
one cluster changes into another: ``rates`` gives the matrix of rates, where spheres stick strongly.

Run it to draw the clusters: ``python examples/ex37_sticky_clusters.py [FOLDER]``.
"""

import sys
from pathlib import Path

import numpy as np

from polycorner import skeleton
from polycorner.measures import StrataMeasures, TransitionRates, Weighting, measure, rates
from polycorner.models import SphereCluster

STICKINESS = 100.0  # of |x|^2 - 1: twice that of the distance, in diameters


def main(count: int = 6) -> tuple[StrataMeasures, TransitionRates]:
    """Return the weights of clusters and the rates between them."""
    model = SphereCluster(count)
    found = skeleton(model.polyhedron, model.starts(), symmetry=model.symmetry)
    measured = measure(found, weighting=Weighting(stickiness=STICKINESS))
    return measured, rates(measured)


def draw(measured: StrataMeasures, path: Path) -> Path:
    from polycorner.pictures import draw_clusters, save

    points = np.array([corner.point for corner in measured.skeleton.corners])
    labels = [f"{100 * p:.1f} %" for p in measured.probabilities]
    return save(draw_clusters(SphereCluster(points.shape[1] // 3), points, labels=labels), path)


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    measured, between = main()
    print(measured)
    print(between)
    print(f"wrote {draw(measured, folder / 'ex37_sticky_clusters.png')}")
