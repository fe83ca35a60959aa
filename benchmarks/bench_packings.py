"""Jammed packings: time and memory against the number of bodies, and beside spheropack.

Each size runs in a process of its own, on one core.  ``python benchmarks/bench_packings.py`` runs
all sizes but the largest; ``--sizes discs:10000`` chooses others.  ``--exponents discs:256:20``
jams twenty packings and estimates how small forces and gaps are distributed; ``--spread
discs:256:8`` tells how times differ between eight starts.  The results are added to
``benchmarks/results/packings.json``.
"""

import argparse
import json
import resource
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from side_by_side import alone

if TYPE_CHECKING:
    from polycorner.models import PeriodicPacking

RESULTS = Path(__file__).parent / "results" / "packings.json"
SIZES = "discs:64 discs:256 discs:1024 spheres:64 spheres:256 spheres:1024"
SEED = 1
STRONGEST = 0.1  # forces, relative to the mean, that count as small
WIDEST = 1e-2, 1e-3  # gaps, in mean diameters, that count as small
TOUCHING = 1e-10  # gaps, in mean diameters, that are closed: implied by others in regular patches


def bodies(kind: str, count: int) -> "PeriodicPacking":
    """Return discs of two sizes, or equal spheres."""
    from polycorner.models import PeriodicPacking

    if kind == "discs":
        return PeriodicPacking.bidisperse(count)
    return PeriodicPacking.monodisperse(count, 3)


def measured(kind: str, count: int) -> dict[str, float | int | str | bool]:
    """Jam one packing; return times, memory and residuals."""
    from polycorner.models import PeriodicPacking

    packing = bodies(kind, count)
    PeriodicPacking.bidisperse(100, packing.dimension).jam(0)  # compiles the kernel
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


def small(values: np.ndarray, below: float) -> tuple[float, float]:
    """Return ``a`` of ``P(X < x) ~ x**a`` for ``x < below``: maximum likelihood, and its error."""
    least = values[values < below]
    found = len(least) / np.log(below / least).sum()
    return float(found), float(found / np.sqrt(len(least)))


def distributions(kind: str, count: int, seeds: int) -> dict[str, float | int | str]:
    """Return the exponents of densities ``f**theta`` of small forces, ``h**-gamma`` of small gaps.

    Bodies with the least possible number of contacts, ``d + 1``, may buckle, and forces on them are
    distributed otherwise than those on all others.  Forces are relative to the mean, gaps to the
    mean diameter.
    """
    packing = bodies(kind, count)
    forces: dict[str, list[np.ndarray]] = {"buckling": [], "extended": []}
    gaps = []
    for seed in range(seeds):
        jammed = packing.jam(seed)
        least = (jammed.degrees == packing.dimension + 1)[jammed.pairs].any(axis=1)
        relative = jammed.forces / jammed.forces.mean()
        forces["buckling"].append(relative[least])
        forces["extended"].append(relative[~least])
        gaps.append(jammed.near_gaps(max(WIDEST))[1])
    row: dict[str, float | int | str] = {"kind": kind, "count": count, "packings": seeds}
    for name, parts in forces.items():
        found, error = small(np.concatenate(parts), STRONGEST)
        row |= {f"theta, {name}": found - 1, f"error of theta, {name}": error}
    all_gaps = np.concatenate(gaps)
    closed = all_gaps < TOUCHING
    for below in WIDEST:
        found, error = small(all_gaps[~closed], below)
        row |= {f"gamma, below {below:g}": 1 - found, f"error of gamma, below {below:g}": error}
    return row | {"closed without force": int(closed.sum())}


def spread(kind: str, count: int, seeds: int) -> dict[str, Any]:
    """Jam one packing for each seed; return processor times and numbers of programmes."""
    from polycorner.models import PeriodicPacking

    packing = bodies(kind, count)
    PeriodicPacking.bidisperse(100, packing.dimension).jam(0)  # compiles the kernel
    soft, jamming, programmes = [], [], []
    for seed in range(1, seeds + 1):
        begin = time.process_time()
        start = packing.soft_start(seed)
        middle = time.process_time()
        programmes.append(packing.jam(start).programmes)
        soft.append(middle - begin)
        jamming.append(time.process_time() - middle)
    total = np.add(soft, jamming)
    return {
        "kind": kind,
        "count": count,
        "seconds, least": float(total.min()),
        "seconds, mean": float(total.mean()),
        "seconds, most": float(total.max()),
        "soft start, mean": float(np.mean(soft)),
        "jamming, mean": float(np.mean(jamming)),
        "programmes": programmes,
    }


def exponent(rows: list[dict[str, float]]) -> float:
    """Return the slope of the logarithm of the time against that of the number of bodies."""
    counts, seconds = (np.log([row[key] for row in rows]) for key in ("count", "seconds"))
    return float(np.polyfit(counts, seconds, 1)[0])


def keep(row: dict[str, Any], under: str) -> None:
    """Print a row and add it to the results."""
    print(row)
    kept = json.loads(RESULTS.read_text()) if RESULTS.exists() else {"runs": []}
    same = (row["kind"], row["count"])
    others = [r for r in kept.get(under, []) if (r["kind"], r["count"]) != same]
    RESULTS.write_text(json.dumps(kept | {under: [*others, row]}, indent=1) + "\n")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sizes", default=SIZES)
    parser.add_argument("--exponents", help="kind:bodies:packings, for small forces and gaps")
    parser.add_argument("--spread", help="kind:bodies:seeds, for times of several starts")
    parser.add_argument("--one", help="run this size here and print it as JSON")
    chosen = parser.parse_args()
    if chosen.exponents:
        kind, count, seeds = chosen.exponents.split(":")
        keep(distributions(kind, int(count), int(seeds)), "small")
        return
    if chosen.spread:
        kind, count, seeds = chosen.spread.split(":")
        keep(spread(kind, int(count), int(seeds)), "spread")
        return
    if chosen.one:
        kind, count = chosen.one.split(":")
        found = spheropack(int(count)) if kind == "spheropack" else measured(kind, int(count))
        print(json.dumps(found))
        return
    alone(__file__, chosen.sizes, RESULTS, dict.fromkeys(("discs", "spheres"), exponent))


if __name__ == "__main__":
    main()
