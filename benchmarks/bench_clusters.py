"""Atlases of sticky spheres as they grow, walked by this process and by others.

Numbers of spheres are arguments, by default 7 8 9; ten take a minute or two.  With ``--save FILE``
one atlas is searched for by ``--workers`` processes for up to ``--minutes``, and resumed if the
file exists.  With ``--faces`` the faces of one that is finished are examined for clusters that no
motion with one degree of freedom leads to.
"""

import argparse
import math
import resource
from collections import Counter
from pathlib import Path
from time import monotonic, perf_counter

from side_by_side import print_table, write

from polycorner import Skeleton, skeleton
from polycorner.files import load_skeleton, save_skeleton
from polycorner.models import SphereCluster
from polycorner.skeletons import Budget, Completeness, examine_faces, resume
from polycorner.workers import opened

WORKERS = (None, 1, 2)
EVERY = 300.0  # s between two times that an atlas is saved
MANY = 10**9  # edges


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


def kinds(found: Skeleton) -> dict[str, int]:
    """Return the numbers of clusters by contacts and rank, both less the dimension ``3 n - 6``."""
    full = len(found.polyhedron.manifold.names) - 6
    every = ((len(c.active) - full, c.rank - full) for c in found.corners)
    return {f"contacts {k:+d}, rank {r:+d}": n for (k, r), n in sorted(Counter(every).items())}


def mebibytes(who: int) -> float:
    return resource.getrusage(who).ru_maxrss / 1024


def resumable(count: int, workers: int, minutes: float, file: Path, faces: bool) -> None:
    """Search for one atlas, or resume, and save it; print counts, times and memory."""
    model, start = SphereCluster(count), monotonic()
    found = load_skeleton(file, symmetry=model.symmetry) if file.exists() else None
    print(f"{monotonic() - start:.0f} s to load", flush=True)
    with opened(workers) as executor:
        while True:
            left = 60 * minutes - (monotonic() - start)
            options = {"budget": Budget(MANY, max(1.0, min(EVERY, left))), "executor": executor}
            if found is None:
                symmetry = model.symmetry
                found = skeleton(model.polyhedron, model.starts(), symmetry=symmetry, **options)
            else:
                found = resume(found, **options)
            save_skeleton(found, file)
            report(found, monotonic() - start)
            if found.complete is not Completeness.BUDGET or left < EVERY:
                break
        if faces and found.complete is not Completeness.BUDGET:
            found = examine_faces(found, executor=executor)
            print("faces examined")
            report(found, monotonic() - start)
            save_skeleton(found, file)
    print(f"in workers {seconds(resource.RUSAGE_CHILDREN):.0f} s, "
          f"the largest {mebibytes(resource.RUSAGE_CHILDREN):.0f} MiB")  # fmt: skip


def report(found: Skeleton, wall: float) -> None:
    pending = len(found.state.pending)
    print(
        f"wall {wall:.0f} s, here {seconds(resource.RUSAGE_SELF):.0f} s, "
        f"{mebibytes(resource.RUSAGE_SELF):.0f} MiB: {len(found.corners)} clusters, "
        f"{len(found.edges)} edges, {len(found.faces)} faces, {pending} pending, "
        f"{found.complete.name}, {len(found.notes)} notes; {kinds(found)}",
        flush=True,
    )
    for note in found.notes[:10]:
        print(f"  {note}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("counts", nargs="*", type=int, default=[7, 8, 9], help="numbers of spheres")
    parser.add_argument("--workers", type=int, default=2, help="with --save: processes")
    parser.add_argument("--minutes", type=float, default=math.inf, help="with --save: limit")
    parser.add_argument("--save", type=Path, help="file of one atlas, resumed if it exists")
    parser.add_argument("--faces", action="store_true", help="with --save: examine faces as well")
    given = parser.parse_args()
    if given.save is None and given.faces:
        parser.error("--faces: expected a file with --save; got none")
    if given.save is None:
        compare(given.counts)
    else:
        resumable(given.counts[0], given.workers, given.minutes, given.save, given.faces)


def compare(counts: list[int]) -> None:
    """Print and write times of this process and with workers."""
    search(5, None)  # loads the kernels
    rows, figures, before = [], {}, (0, 0.0)
    for count in counts:
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
            figures[f"{count} spheres, workers {workers or 0}"] = {
                **times, "clusters": sizes[0], "edges": sizes[1], "faces": sizes[2],
                "MiB so far": mebibytes(resource.RUSAGE_SELF), "complete": found.complete.name,
                "kinds": kinds(found),
            }  # fmt: skip
    head = ["spheres", "workers", "here s", "in workers s", "wall s", "clusters", "edges", "faces",
            "power of clusters"]  # fmt: skip
    print_table("Clusters of spheres", head, rows)
    write("clusters", figures)


if __name__ == "__main__":
    main()
