"""Jammed packings: time and memory against the number of bodies, and beside spheropack.

Each size runs in a process of its own, on one core.  ``python benchmarks/bench_packings.py`` runs
all sizes but the largest; ``--sizes discs:10000`` chooses others.  The results are added to
``benchmarks/results/packings.json``.
"""

import argparse
import json
import os
import resource
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

RESULTS = Path(__file__).parent / "results" / "packings.json"
SIZES = "discs:64 discs:256 discs:1024 spheres:64 spheres:256 spheres:1024"
SEED = 1


def measured(kind: str, count: int) -> dict[str, float | int | str | bool]:
    """Jam one packing; return times, memory and residuals."""
    from polycorner.models import PeriodicPacking

    discs = kind == "discs"
    packing = PeriodicPacking.bidisperse(count) if discs else PeriodicPacking.monodisperse(count, 3)
    PeriodicPacking.bidisperse(100, 2 if discs else 3).jam(0)  # compiles the kernel
    wall, begin = time.perf_counter(), time.process_time()
    start = packing.soft_start(SEED)
    middle = time.process_time()
    jammed = packing.jam(start)
    end, wall = time.process_time(), time.perf_counter() - wall
    residuals = jammed.residuals
    return {
        "kind": kind,
        "count": count,
        "soft start, s": middle - begin,
        "jamming, s": end - middle,
        "seconds": end - begin,  # of the processor: the machine may be shared
        "wall, s": wall,
        "memory, MB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
        "programmes": jammed.programmes,
        "verdict": jammed.verdict.name,
        "density": jammed.density,
        "contacts": len(jammed.pairs),
        "rattlers": len(jammed.rattlers),
        "isostatic": jammed.is_isostatic,
        "overlap": residuals.overlap,
        "contact": residuals.contact,
        "balance": residuals.balance,
        "least force, of the mean": float(jammed.forces.min() / jammed.forces.mean()),
    }


def spheropack(count: int) -> dict[str, float | int | str]:
    """Pack equal spheres by spheropack's event-driven dynamics until they jam."""
    import spheropack as other

    begin = time.process_time()
    packed = other.pack(n=count, density="max", seed=SEED)  # in a box of edge 1
    seconds = time.process_time() - begin
    centres, radii = np.asarray(packed.positions), np.asarray(packed.radii)
    from scipy.spatial import cKDTree

    diameter = 2 * float(radii.mean())
    tree = cKDTree(centres % 1.0, boxsize=np.ones(3))
    rows = {"kind": "spheropack", "count": count, "seconds": seconds, "density": packed.density}
    for gap in (1e-4, 1e-6, 1e-8, 1e-10):
        rows[f"contacts within {gap:g} diameters"] = len(tree.query_pairs(diameter * (1 + gap)))
    return rows


def exponent(rows: list[dict[str, float]]) -> float:
    """Return the slope of the logarithm of the time against that of the number of bodies."""
    counts, seconds = (np.log([row[key] for row in rows]) for key in ("count", "seconds"))
    return float(np.polyfit(counts, seconds, 1)[0])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sizes", default=SIZES)
    parser.add_argument("--one", help="run this size here and print it as JSON")
    chosen = parser.parse_args()
    if chosen.one:
        kind, count = chosen.one.split(":")
        found = spheropack(int(count)) if kind == "spheropack" else measured(kind, int(count))
        print(json.dumps(found))
        return
    kept = json.loads(RESULTS.read_text()) if RESULTS.exists() else {"runs": []}
    single = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"), "1")
    for size in chosen.sizes.split():
        command = [sys.executable, __file__, "--one", size]
        done = subprocess.run(
            command, check=True, capture_output=True, text=True, env={**os.environ, **single}
        )
        row = json.loads(done.stdout.splitlines()[-1])
        print(row, flush=True)
        same = (row["kind"], row["count"])
        kept["runs"] = [r for r in kept["runs"] if (r["kind"], r["count"]) != same] + [row]
        kept["runs"].sort(key=lambda r: (r["kind"], r["count"]))
        for kind in ("discs", "spheres"):
            rows = [r for r in kept["runs"] if r["kind"] == kind]
            if len(rows) > 1:
                kept[f"exponent of {kind}"] = exponent(rows)
        RESULTS.write_text(json.dumps(kept, indent=1) + "\n")


if __name__ == "__main__":
    main()
