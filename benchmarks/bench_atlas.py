"""Atlases of the pair, sphere clusters and a polytope, timed against a plain walker and Qhull.

With `--nine` also the clusters of nine spheres (minutes for the plain walker).
"""

import statistics
import sys
from functools import partial
from itertools import product

import numpy as np
from plain_walker import clusters
from scipy.spatial import HalfspaceIntersection
from side_by_side import interleave, peak, print_table, ratio, write

from polycorner import Manifold, Polyhedron, skeleton
from polycorner.dumbbells import DumbbellPair
from polycorner.dumbbells.statics.skeleton import pair_atlas
from polycorner.models import SphereCluster

ROUNDS = 5
COUNTS = (5, 6, 7, 8)


def pair(drum: float) -> object:
    return pair_atlas(
        DumbbellPair(length=16, ball_radius=3, rod_radius=1.5, drum_radius=drum)
    ).skeleton


def spheres(count: int) -> object:
    model = SphereCluster(count)
    return skeleton(model.polyhedron, model.starts(), symmetry=model.symmetry)


def cross_polytope() -> tuple[Polyhedron, np.ndarray]:
    """Return the cross-polytope in four dimensions, and its half-spaces in Qhull's format."""
    space = Manifold.euclidean("x y z w")
    signs = list(product((1, -1), repeat=4))
    facets = [1 - sum(s * x for s, x in zip(row, space.symbols, strict=True)) for row in signs]
    return Polyhedron(space, facets), np.array([[*row, -1.0] for row in signs])


def main() -> None:
    rows, figures = [], {}
    counts = (*COUNTS, 9) if "--nine" in sys.argv else COUNTS
    for count in counts:
        tasks = {"polycorner": partial(spheres, count), "plain": partial(clusters, count)}
        times = interleave(tasks, ROUNDS if count < 8 else 1)
        ours, plain = (statistics.median(times[name]) for name in tasks)
        factor = ratio(times["plain"], times["polycorner"])
        atlas = spheres(count)
        memory = peak(f"import bench_atlas; bench_atlas.spheres({count})")
        figures[f"spheres {count}"] = {
            "seconds": ours, "plain over ours": factor, "corners": len(atlas.corners),
            "edges": len(atlas.edges), "plain finds": len(clusters(count)), "MiB": memory,
        }  # fmt: skip
        rows.append(
            (f"spheres {count}", f"{ours:.2f}", f"{plain:.2f}", f"{factor:.1f}",
             len(atlas.corners), figures[f"spheres {count}"]["plain finds"], f"{memory:.0f}")
        )  # fmt: skip
    head = ["", "s", "plain walker s", "plain / ours", "clusters", "plain finds", "MiB"]
    print_table("Rigid clusters of spheres", head, rows)

    polytope, halfspaces = cross_polytope()
    tasks = {
        "pair, plane": partial(pair, np.inf),
        "pair, drum": partial(pair, 125.0),
        "cross-polytope": partial(skeleton, polytope, [[0.1, 0.2, 0.0, 0.05]]),
        "cross-polytope, Qhull (corners only)": partial(
            HalfspaceIntersection, halfspaces, np.array([0.1, 0.2, 0.0, 0.05])
        ),
    }
    times = interleave(tasks, ROUNDS)
    rest = {name: statistics.median(taken) for name, taken in times.items()}
    print_table("Atlases", ["", "s"], [(name, f"{taken:.4f}") for name, taken in rest.items()])
    write("atlas", {"spheres": figures, "seconds": rest})


if __name__ == "__main__":
    main()
