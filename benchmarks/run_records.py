"""Published records, found anew: circles in a square and in a disc, points on the sphere, spheres.

Every search has one seed and a time limit, and ends where it reaches what is published.  ``python
benchmarks/run_records.py`` runs all; ``square:20 sum:26`` some; ``--seconds`` limits each.  The
results are added to ``benchmarks/results/records.json``.
"""

import argparse
import json
import math
import time
from typing import Any

from side_by_side import RESULTS, print_table, write

# Radii in the unit square ([Specht]) for 2, 3, ... circles, and in the unit disc.
SQUARE = """
0.292893218813 0.254333095030 0.25 0.207106781187 0.187680601147 0.174457630187 0.170540688701
0.166666666667 0.148204322565 0.142399237696 0.139958844038 0.133993513499 0.129331793710
0.127166547515 0.125 0.117196742783 0.115521432464 0.112265437571 0.111382347512 0.106860212352
0.105665296757 0.102802323380 0.101381800432 0.1 0.096362339010 0.095420001748 0.093672833833
0.092463144040 0.091671057986
"""
DISC = """
0.5 0.464101615138 0.414213562373 0.370191908159 0.333333333333 0.333333333333 0.302593388349
0.276768653914 0.262258924190 0.254854701717 0.248163470572 0.236067977500 0.231030727971
0.221172539086 0.216664742924 0.208679665570 0.205604646760 0.205604646760
"""
# Energies of 2, 3, ... charges, and angles in degrees of 4, 5, ... points, as they are tabulated.
THOMSON = """
0.5 1.732050808 3.674234614 6.474691495 9.985281374 14.452977414 19.675287861 25.759986531
32.716949460 40.596450510 49.165253058
"""
TAMMES = """
109.4712206 90 90 77.8695421 74.8584922 70.5287794 66.1468220 63.4349488 63.4349488
"""
# Sums of radii in the unit square, and radii on the square torus and in the unit cube.
OTHERS = {
    "sum:26": 2.63598,
    "torus:7": (math.sqrt(3) - 1) / 4,
    "cube:8": 0.25,
    "cube:14": (math.sqrt(2) - 1) / 2,  # at the corners and in the middles of the faces
}
LIMIT, HOPS, SEED = 60.0, 1_000_000, 1


def published() -> dict[str, float]:
    """Return the published values by name."""
    tables = {
        "square": (2, SQUARE),
        "disc": (2, DISC),
        "thomson": (2, THOMSON),
        "tammes": (4, TAMMES),
    }
    known = {
        f"{kind}:{n}": float(value)
        for kind, (first, table) in tables.items()
        for n, value in enumerate(table.split(), first)
    }
    return known | OTHERS


def model(kind: str, count: int) -> Any:
    """Return the model of a record."""
    from polycorner.models import CirclesIn, PointsOnSphere, SpheresInCube

    if kind in {"tammes", "thomson"}:
        return PointsOnSphere(count, kind)
    if kind == "cube":
        return SpheresInCube(count)
    return CirclesIn({"disc": "circle", "sum": "square"}.get(kind, kind), count, kind != "sum")


def energy(kind: str, value: float) -> float:
    """Return the energy of a published value."""
    if kind == "tammes":
        return math.cos(math.radians(value))
    return value if kind == "thomson" else -value


def searched(name: str, seconds: float) -> dict[str, Any]:
    """Search until the record is reached, or the time is over."""
    from polycorner.models import basin_hopping

    kind, count = name.split(":")
    shape, value = model(kind, int(count)), published()[name]
    # The last digit of a table is rounded, and angles have seven of them.
    below = energy(kind, value) + (1e-8 if kind in {"tammes", "thomson"} else 0.0)
    begin, wall = time.process_time(), time.perf_counter()
    found = basin_hopping(shape, SEED, hops=HOPS, seconds=seconds, below=below)
    begin, wall = time.process_time() - begin, time.perf_counter() - wall
    energies = found.energy
    shown = math.degrees(math.acos(energies)) if kind == "tammes" else abs(energies)
    return {
        "name": name,
        "found": shown,
        "published": value,
        "reached": bool(energies <= below + 1e-9 * abs(below)),
        "descents": found.hops,
        "seconds of the processor": begin,
        "wall, s": wall,
        "verdict": found.certificate.verdict.name,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help="such as square:20, disc:19, sum:26, thomson:12")
    parser.add_argument("--seconds", type=float, default=LIMIT)
    chosen = parser.parse_args()
    path = RESULTS / "records.json"
    kept = {
        row["name"]: row for row in (json.loads(path.read_text())["runs"] if path.exists() else [])
    }
    order = list(published())
    for name in chosen.names or order:
        row = kept[name] = searched(name, chosen.seconds)
        print(row, flush=True)
        write("records", {"runs": sorted(kept.values(), key=lambda row: order.index(row["name"]))})
    rows = [
        (r["name"], f"{r['found']:.12g}", r["published"], "yes" if r["reached"] else "no",
         r["descents"], f"{r['seconds of the processor']:.1f}")
        for r in kept.values()
    ]  # fmt: skip
    columns = ("record", "found", "published", "reached", "descents", "processor, s")
    print_table("Published records, found anew", columns, rows)


if __name__ == "__main__":
    main()
