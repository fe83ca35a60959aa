"""Landscapes: processor time of trees with proof, of passes without, and of bounds by boxes.

``python benchmarks/bench_landscapes.py`` takes all problems; names, such as ``dyad discs``, some.
Formulas are compiled, or loaded, in the first round; the second one is told.
"""

import argparse
from collections.abc import Callable
from time import process_time
from typing import Any

import numpy as np
from side_by_side import print_table, write

from polycorner import AllOf, AnyOf, Manifold, Polyhedron, Symmetry
from polycorner.dumbbells import DumbbellPair, pair_landscape
from polycorner.landscapes import Landscape, landscape, search_landscape
from polycorner.models import CirclesIn
from polycorner.polyhedra import Element

COLUMNS = ("problem", "minima", "passes", "merges", "complete", "width", "first", "second")
FLOOR = 0.2505  # radius below which discs that touch across the torus have a whole line of passes


def dyad() -> Landscape:
    """Return the landscape of the experiment's dyad."""
    return pair_landscape(DumbbellPair(16, 3, 1.5, 125)).landscape


def discs() -> Landscape:
    """Return the landscape of three discs on the square torus, down to a radius."""
    model = CirclesIn("torus", 3)
    names = model.manifold.names

    def carried(pairs: str, signs: str = "") -> Element:
        swap = dict(pair.split("-") for pair in pairs.split())
        swap |= {b: a for a, b in swap.items()}
        order = [names.index(swap.get(name, name)) for name in names]
        sign = np.array([-1.0 if name[0] in signs else 1.0 for name in names])
        return Element(lambda q: sign * np.asarray(q)[..., order], {})

    elements = (
        carried("x2-x3 y2-y3"),
        carried("x1-y1 x2-y2 x3-y3"),
        carried("", "x"),
        carried("", "y"),
    )
    box = {"x1": 0.0, "y1": 0.0, "r": (0.1, 0.4)}
    return landscape(
        model.polyhedron, model.energy, box=box, cap=-FLOOR, symmetry=Symmetry(elements=elements)
    )


def squares(count: int) -> Landscape:
    """Return the landscape of hard squares in the unit square, minus their side as energy."""
    names = [f"{axis}{k}" for k in range(count) for axis in "xy"]
    manifold = Manifold.euclidean(" ".join([*names, "s"]))
    *q, s = manifold.symbols
    x, y = q[::2], q[1::2]
    walls = [f for z in q for f in (z - s / 2, 1 - s / 2 - z)]
    apart = [
        AnyOf(x[i] - x[j] - s, x[j] - x[i] - s, y[i] - y[j] - s, y[j] - y[i] - s)
        for i in range(count)
        for j in range(i)
    ]
    box = [(0, 1)] * (2 * count) + [(0, 1)]
    return landscape(Polyhedron(manifold, AllOf(*walls, *apart, s)), -s, box=box)


def ten() -> Landscape:
    """Return what a search finds in ten coordinates: wells in a ball, walls across passes."""
    manifold = Manifold.euclidean(" ".join(f"q{k}" for k in range(10)))
    q = manifold.symbols
    wells = sum(((z**2 - 1) ** 2 for z in q[:3]), 0 * q[0]) + sum(z**2 for z in q[3:])
    tilt = sum(z / (11 + k) for k, z in enumerate(q))
    walls = {"ball": 16 - sum(z**2 for z in q), "wall": q[0] + q[3] / 4 + 0.9}
    return search_landscape(
        Polyhedron(manifold, walls), wells + tilt, box=[(-2, 2)] * 10, starts=60, rng=1
    )


PROBLEMS: dict[str, Callable[[], Landscape]] = {
    "dyad": dyad,
    "discs": discs,
    "squares:2": lambda: squares(2),
    "squares:3": lambda: squares(3),
    "ten": ten,
}


def measured(problem: Callable[[], Landscape]) -> dict[str, Any]:
    """Solve a problem twice."""
    times = []
    for _ in range(2):
        begun = process_time()
        found = problem()
        times.append(process_time() - begun)
    widths = [
        (b.upper - b.lower) / (b.upper - found.minima[m.ended].energy[0])
        for m in found.merges
        for b in [found.barrier(m.ended, m.kept)]
    ]
    return {
        "minima": len(found.minima), "passes": len(found.passes), "merges": len(found.merges),
        "complete": found.complete, "width": max(widths, default=0.0), "seconds": times,
    }  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help=f"some of {', '.join(PROBLEMS)}")
    chosen = parser.parse_args().names or list(PROBLEMS)
    unknown = [name for name in chosen if name not in PROBLEMS]
    if unknown:
        parser.error(f"names: expected some of {', '.join(PROBLEMS)}; got {unknown[0]}")
    results = {name: measured(PROBLEMS[name]) for name in chosen}
    rows = [
        [
            name, *(str(r[c]) for c in COLUMNS[1:5]), f"{r['width']:.1e}",
            *(f"{t:.1f} s" for t in r["seconds"]),
        ]
        for name, r in results.items()
    ]  # fmt: skip
    print_table("Landscapes", COLUMNS, rows)
    write("landscapes", results)


if __name__ == "__main__":
    main()
