"""Atlases of sticky spheres as they grow, walked by this process and by others.

Numbers of spheres are arguments, by default 7 8 9; ten take a minute or two, and 0.8 GiB.
"""

import math
import resource
import sys
from time import perf_counter

from side_by_side import print_table, write

from polycorner import Skeleton, skeleton
from polycorner.models import SphereCluster
from polycorner.workers import opened

WORKERS = (None, 1, 2)


def seconds(who: int) -> float:
    used = resource.getrusage(who)
    return used.ru_utime + used.ru_stime


def search(count: int, workers: int | None) -> tuple[Skeleton, dict[str, float]]:
    """Return the atlas, processor time here and in workers, and wall time, without their start."""
    model = SphereCluster(count)
    options = {"symmetry": model.symmetry}
    others = seconds(resource.RUSAGE_CHILDREN)
    if workers is None:
        here, begun = seconds(resource.RUSAGE_SELF), perf_counter()
        found = skeleton(model.polyhedron, model.starts(), **options)
        times = seconds(resource.RUSAGE_SELF) - here, perf_counter() - begun
    else:
        with opened(workers) as executor:
            here, begun = seconds(resource.RUSAGE_SELF), perf_counter()
            found = skeleton(model.polyhedron, model.starts(), **options, executor=executor)
            times = seconds(resource.RUSAGE_SELF) - here, perf_counter() - begun
    walked = seconds(resource.RUSAGE_CHILDREN) - others
    return found, {"here": times[0], "workers": walked, "wall": times[1]}


def main() -> None:
    search(5, None)  # loads the kernels
    rows, figures, before = [], {}, (0, 0.0)
    for count in map(int, sys.argv[1:] or (7, 8, 9)):
        for workers in WORKERS:
            found, times = search(count, workers)
            sizes = len(found.corners), len(found.edges), len(found.faces)
            growth = ""
            if workers is None:
                clusters, taken = before
                if clusters:
                    power = math.log(times["here"] / taken) / math.log(sizes[0] / clusters)
                    growth = f"{power:.2f}"
                before = sizes[0], times["here"]
            spent = [f"{times[key]:.2f}" for key in ("here", "workers", "wall")]
            rows.append((str(count), str(workers or "-"), *spent, *map(str, sizes), growth))
            memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
            figures[f"{count} spheres, workers {workers or 0}"] = {
                **times, "clusters": sizes[0], "edges": sizes[1], "faces": sizes[2],
                "MiB so far": memory, "complete": found.complete.name,
            }  # fmt: skip
    head = ["spheres", "workers", "here s", "in workers s", "wall s", "clusters", "edges", "faces",
            "power of clusters"]  # fmt: skip
    print_table("Clusters of spheres", head, rows)
    write("clusters", figures)


if __name__ == "__main__":
    main()
