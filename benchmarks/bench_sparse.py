"""Large sparse polyhedra: time and memory of each verb against size, beside other solvers.

Three models: a cable of balls between two ends, masses on springs above a curved floor, and discs
that fall into a tray.  Each size runs in a process of its own, on one core.
``python benchmarks/bench_sparse.py`` runs the sizes of ``SIZES``; ``--sizes cable:1000`` chooses
others (number of balls, masses, discs).  ``sparse_ipopt.py`` solves the same problems by Ipopt.
Results are added to ``benchmarks/results/sparse.json``.
"""

import argparse
import itertools
import json
import math
import resource
import time
from pathlib import Path
from typing import Any

import numpy as np
from side_by_side import alone

RESULTS = Path(__file__).parent / "results" / "sparse.json"
SIZES = (
    "cable:250 cable:500 cable:1500 beam:1000 beam:3000 beam:10000 discs:150 discs:500 discs:1500"
)


def cable(count: int) -> tuple[Any, Any, np.ndarray]:
    """Return balls on a cable between ends 0.8 apart a link; consecutive ones at most 1 apart."""
    import sympy

    from polycorner import Manifold, Polyhedron, SmoothFunction
    from polycorner.formulas.families import Family
    from polycorner.polyhedra.groups import AllOf

    names = [f"{a}{i}" for i in range(count) for a in "xy"]
    M = Manifold.euclidean(names)
    a, b, c, d, span = sympy.symbols("a b c d span", real=True)
    inner = Family.of({"link": 1 - (c - a) ** 2 - (d - b) ** 2}, ["a", "b", "c", "d"])
    first = Family.of({"link": 1 - a**2 - b**2}, ["a", "b"])
    outer = Family.of({"link": 1 - (span - a) ** 2 - b**2}, ["a", "b"], ["span"])
    weight = Family.of({"weight": b}, ["b"])
    width = 0.8 * (count + 1)
    member = SmoothFunction.member
    pairs = itertools.pairwise(zip(names[::2], names[1::2], strict=True))
    links = [
        member(inner, "link", M, reads=[*p, *q], label=f"link{i}")
        for i, (p, q) in enumerate(pairs, 1)
    ]
    links.append(member(first, "link", M, reads=names[:2], label="link0"))
    last = f"link{count}"
    links.append(member(outer, "link", M, parameters=[width], reads=names[-2:], label=last))
    terms = [member(weight, "weight", M, reads=[y]) for y in names[1::2]]
    energy = SmoothFunction.sum("weight", terms)
    x = 0.8 * np.arange(1, count + 1)
    start = np.column_stack([x, -0.8 * x * (width - x) / width])
    return Polyhedron(M, AllOf(*links)), energy, start.ravel()


def beam(count: int) -> tuple[Any, Any, np.ndarray]:
    """Return masses on springs, to each other and to the ground, above a curved floor."""
    import sympy

    from polycorner import Manifold, Polyhedron, SmoothFunction
    from polycorner.formulas.families import Family
    from polycorner.polyhedra.groups import AllOf

    M = Manifold.euclidean([f"x{i}" for i in range(count)])
    u, v, h, load = sympy.symbols("u v h load", real=True)
    floor = Family.of({"floor": u + h}, ["u"], ["h"])
    spring = Family.of({"spring": (u - v) ** 2}, ["u", "v"])
    held = Family.of({"held": u**2 / 100 + load * u}, ["u"], ["load"])
    member, names = SmoothFunction.member, M.names
    heights = 0.3 * np.cos(7 * np.arange(count) / count)
    floors = [
        member(floor, "floor", M, parameters=[height], reads=[name], label=f"floor {name}")
        for name, height in zip(names, heights.tolist(), strict=True)
    ]
    terms = [member(spring, "spring", M, reads=pair) for pair in itertools.pairwise(names)]
    terms += [member(held, "held", M, parameters=[0.004], reads=[name]) for name in names]
    return Polyhedron(M, AllOf(*floors)), SmoothFunction.sum("energy", terms), np.ones(count)


def discs(count: int, seed: int = 1) -> tuple[Any, Any, np.ndarray]:
    """Return discs of radii between 0.8 and 1 above a tray, with gaps of pairs up to 6 apart."""
    import sympy
    from scipy.spatial import cKDTree

    from polycorner import Manifold, Polyhedron, SmoothFunction
    from polycorner.formulas.families import Family
    from polycorner.polyhedra.groups import AllOf

    rng = np.random.default_rng(seed)
    radii, row = 1 - 0.2 * rng.random(count), int(math.sqrt(count))
    width = 2.1 * row + 0.2
    i = np.arange(count)
    places = np.column_stack([1.1 + 2.1 * (i % row), 1.1 + 2.1 * (i // row)])
    names = [f"{a}{k}" for k in range(count) for a in "xy"]
    M = Manifold.euclidean(names)
    x1, y1, x2, y2, s, w = sympy.symbols("x1 y1 x2 y2 s w", real=True)
    four = ["x1", "y1", "x2", "y2"]
    gap = Family.of({"gap": sympy.sqrt((x1 - x2) ** 2 + (y1 - y2) ** 2) - s}, four, ["s"])
    wall = Family.of({"low": x1 - s, "high": w - s - x1}, ["x1"], ["s", "w"])
    weight = Family.of({"weight": x1}, ["x1"])
    member, parts = SmoothFunction.member, []
    for k, r in enumerate(radii.tolist()):
        for side, axis in (("low", "y"), ("low", "x"), ("high", "x")):
            label = f"{side} {axis}{k}"
            numbers = [r, width]
            parts.append(
                member(wall, side, M, parameters=numbers, reads=[f"{axis}{k}"], label=label)
            )
    for j, k in sorted(cKDTree(places).query_pairs(6.0)):
        reads = [*names[2 * j : 2 * j + 2], *names[2 * k : 2 * k + 2]]
        numbers = [float(radii[j] + radii[k])]
        parts.append(member(gap, "gap", M, parameters=numbers, reads=reads, label=f"{j}-{k}"))
    energy = SmoothFunction.sum(
        "weight", [member(weight, "weight", M, reads=[y]) for y in names[1::2]]
    )
    return Polyhedron(M, AllOf(*parts)), energy, places.ravel()


MODELS = {"cable": cable, "beam": beam, "discs": discs}


def peak() -> float:
    """Return the largest memory of this process so far, in MB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def measured(kind: str, count: int) -> dict[str, Any]:
    """Minimise, certify and differentiate one model; return processor times and memory."""
    from polycorner import certify, minimise, sensitivity, stationary_on

    small = MODELS[kind](400)
    minimise(*small, max_iterations=3)  # compiles the kernels
    marks = [time.process_time()]
    D, E, start = MODELS[kind](count)
    marks.append(time.process_time())
    found = minimise(D, E, start, max_iterations=1000)
    marks.append(time.process_time())
    verdict = certify(D, E, found.point).verdict.name
    marks.append(time.process_time())
    row = {
        "kind": kind,
        "count": count,
        "coordinates": found.problem.dimension,
        "functions": found.problem.inequalities,
        "statement, s": marks[1] - marks[0],
        "minimise, s": marks[2] - marks[1],
        "certify, s": marks[3] - marks[2],
        "steps": found.iterations,
        "verdict": verdict,
        "energy": found.energy,
        "active": len(found.active),
        "worst residual": found.residuals.worst,
        "full matrices would have, MB": found.problem.rows * found.problem.dimension**2 / 2**17,
    }
    if kind != "discs":
        begin = time.process_time()
        again = stationary_on(D, E, found.point, list(found.active))
        row["stationary_on, s"] = time.process_time() - begin
        row["moved by it"] = float(abs(again.point - found.point).max())
        begin = time.process_time()
        parameters = {"cable": {"ends": {"span": 1.0}}, "beam": {"load": {"load": 1.0}}}[kind]
        s = sensitivity(found, parameters)
        row["sensitivity, s"] = time.process_time() - begin
        row["envelope and chain rule differ by"] = float(abs(s.energy - s.envelope).max())
    return row | {"memory, MB": peak()}


def exponents(rows: list[dict[str, Any]]) -> dict[str, float]:
    """Return slopes of the logarithms of times and memory against that of the coordinates."""
    found = {}
    n = np.log([row["coordinates"] for row in rows])
    for key in ("minimise, s", "certify, s", "sensitivity, s", "memory, MB"):
        if all(row.get(key, 0) > 0 for row in rows):
            found[key] = float(np.polyfit(n, np.log([row[key] for row in rows]), 1)[0])
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sizes", default=SIZES)
    parser.add_argument("--one", help="run this size here and print it as JSON")
    chosen = parser.parse_args()
    if chosen.one:
        kind, count = chosen.one.split(":")
        print(json.dumps(measured(kind, int(count))))
        return
    alone(__file__, chosen.sizes, RESULTS, dict.fromkeys(MODELS, exponents))


if __name__ == "__main__":
    main()
