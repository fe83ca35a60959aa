"""Sampling a parabola with a lid, ten million points; clusters, their weights and floppy modes.

110 s are reported for the ten million points by the published sampler ([HC20]).  ``--points`` is
their number, ``--clusters`` lists numbers of spheres, ``--floppy`` points of each of four chains,
``--wells`` steps of a plain chain with square wells of several widths, which floppy clusters of six
spheres are compared with (none by default; for each width 1e8 take half a minute of a processor).
"""

import argparse
import math
from time import perf_counter, process_time

import numpy as np
from side_by_side import print_table, write

from polycorner import Manifold, Polyhedron, skeleton
from polycorner.measures import SampleOptions, Weighting, face_weights, measure, sample
from polycorner.models import SphereCluster

ROOT = math.sqrt(2)


def parabola(points: int) -> dict[str, float]:
    M = Manifold.euclidean("x y")
    x, y = M.symbols
    D = Polyhedron(M, {"parabola": y - x**2, "lid": 2 - y})
    options = SampleOptions(step=0.9, sideways=0.3, reach=0.7)
    sizes = {
        (): 8 * ROOT / 3,
        ("parabola",): 3 * ROOT + math.asinh(2 * ROOT) / 2,
        ("lid",): 2 * ROOT,
        ("parabola", "lid"): 2.0,
    }
    total = sum(sizes.values())
    ways = {"weighting": Weighting(gradients=False), "rng": 1, "options": options}
    sample(D, [[0.0, 1.0]], 10, **ways)
    wall, cpu = perf_counter(), process_time()
    found = sample(D, [[0.0, 1.0]], points, **ways)
    row = {"points": points, "wall_s": perf_counter() - wall, "cpu_s": process_time() - cpu}
    shares = [(found.fraction(stratum=s), size / total) for s, size in sizes.items()]
    row["effective_least"] = min(e.effective for e, _ in shares)
    row["worst_z"] = max(abs(e.value - exact) / e.error for e, exact in shares)
    return row


def cluster(n: int, *, edges: bool) -> dict[str, float]:
    model = SphereCluster(n)
    begin = process_time()
    atlas = skeleton(model.polyhedron, model.starts(), symmetry=model.symmetry)
    middle = process_time()
    found = measure(atlas, edges=edges)
    row = {"spheres": n, "atlas_cpu_s": middle - begin, "measure_cpu_s": process_time() - middle}
    row["corners"] = len(found.corners)
    row["declined"] = int(np.isnan(found.corners).sum())
    row["largest"], row["least"] = np.nanmax(found.probabilities), np.nanmin(found.probabilities)
    row["Z1/Z0"] = np.nansum(found.edges) / np.nansum(found.corners) if edges else math.nan
    return row


def floppy(points: int) -> dict[str, float]:
    """Weigh strata of six spheres with eleven and ten contacts, by chains."""
    model = SphereCluster(6)
    options = SampleOptions(step=0.15, sideways=0.05, reach=0.25, every=5, gain=0.3, lose=0.3)
    begin = process_time()
    found = sample(
        model.polyhedron, np.tile(model.starts(), (4, 1)), points,
        weighting=Weighting(stickiness=12.0), contacts=(10, 12), rng=1, options=options,
    )  # fmt: skip
    one, two = found.ratio(11, 12), found.ratio(10, 11)
    row = {"points": 4 * points, "cpu_s": process_time() - begin}
    return row | {"Z1/Z0": one.value, "error": one.error, "Z2/Z1": two.value, "error 2": two.error}


def faces(points: int) -> dict[str, float]:
    """Weigh the faces of six spheres beside their edges."""
    model = SphereCluster(6)
    measures = measure(skeleton(model.polyhedron, model.starts(), symmetry=model.symmetry))
    options = SampleOptions(step=0.15, sideways=0.05, reach=0.25, every=5, gain=0.3, lose=0.3)
    begin = process_time()
    found = face_weights(measures, points=points, rng=1, options=options).total
    row = {"points": 4 * points, "cpu_s": process_time() - begin}
    z = float(measures.corners.sum())
    row |= {"Z1/Z0": float(measures.edges.sum()) / z, "Z2/Z0": found.value / z}
    return row | {"error": found.error / z}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--points", type=int, default=10_000_000)
    parser.add_argument("--clusters", type=int, nargs="*", default=[6, 7, 8])
    parser.add_argument("--floppy", type=int, default=50_000)
    parser.add_argument("--wells", type=int, default=0)
    given = parser.parse_args()
    results = {"parabola": [parabola(given.points)]}
    results["clusters"] = [cluster(n, edges=n < 9) for n in given.clusters]
    results["floppy"] = [floppy(given.floppy)] if given.floppy else []
    results["faces"] = [faces(given.floppy)] if given.floppy else []
    if given.wells:
        from square_wells import ratios

        results["square wells"] = [ratios(width, given.wells) for width in (0.08, 0.04)]
    for title, rows in results.items():
        if rows:
            print_table(title, list(rows[0]), [[f"{v:.6g}" for v in row.values()] for row in rows])
    write("measures", results)


if __name__ == "__main__":
    main()
