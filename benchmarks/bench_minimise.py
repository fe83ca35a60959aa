"""Descents from two hundred nested pairs in the drum: polycorner's search against other solvers.

Every solver gets the same start before the next start is taken.  A run counts as right if it ends
in the certified corner of the start's own chirality, wherever along the drum.  The residual of the
first-order conditions at its end is that of polycorner's certificate.
"""

import statistics
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import solvers
from side_by_side import interleave, print_table, ratio, write

from polycorner import Certificate, certify, minimise
from polycorner.dumbbells import DumbbellPair

STARTS, ROUNDS = 200, 2
SAME = 1e-4  # largest scaled distance at which a point counts as the corner
OURS = "polycorner"

Solver = solvers.Solver


def starts(pair: DumbbellPair, generator: np.random.Generator) -> list[tuple[str, np.ndarray]]:
    """Return feasible nested pairs with their chirality, contacts at most 1.5 mm open.

    Headings lie within 20 degrees of the meridian and differ by at most 4; the azimuth of the pair
    lies within 8 degrees of the lowest meridian.
    """
    found: list[tuple[str, np.ndarray]] = []
    while len(found) < STARTS:
        chirality = "RL"[len(found) % 2]
        heading, clearance = np.radians(generator.uniform(-18, 18)), generator.uniform(0, 1.5)
        q = pair.nested(chirality, heading=heading, clearance=clearance)
        q[[2, 5]] += np.radians(generator.uniform(-2, 2, 2))
        q[[0, 3]] += np.radians(generator.uniform(-8, 8))
        nearest = np.sort(pair.polyhedron.values(q))[:3]
        if nearest[0] >= 0 and nearest[2] <= 1.5 and pair.chirality(q) == chirality:
            found.append((chirality, q))
    return found


def candidates(pair: DumbbellPair, rest: np.ndarray, folder: Path) -> dict[str, Solver]:
    """Return every solver that is installed, ours first."""
    D, E = pair.polyhedron, pair.energy

    def with_verdict(start: np.ndarray) -> np.ndarray:
        certificate = minimise(D, E, start)
        _ = certificate.verdict
        return certificate.point

    available: dict[str, Solver] = {
        OURS: lambda start: minimise(D, E, start).point,
        "polycorner, verdict read": with_verdict,
        "SciPy SLSQP": solvers.scipy_slsqp(pair, rest),
    }
    if find_spec("nlopt") is None:
        print("NLopt is left out: it is not installed; `make bench` installs it.")
    else:
        available["NLopt LD_SLSQP"] = solvers.nlopt_slsqp(pair, rest)
    if find_spec("casadi") is None:
        print("CasADi is left out: it is not installed; `make bench` installs it.")
    else:
        for how in ("regularize", "eigen-clip"):
            available[f"CasADi sqpmethod, {how}"] = solvers.casadi_sqp(pair, rest, how, folder)
    return available


def is_at(pair: DumbbellPair, q: np.ndarray, corner: Certificate) -> bool:
    """Whether ``q`` is the corner, up to a shift along the drum."""
    away = pair.manifold.difference(q, corner.point)
    away[[1, 4]] -= away[[1, 4]].mean()
    return bool(abs(away / pair.manifold.scale_array).max() < SAME)


def residual(pair: DumbbellPair, q: np.ndarray) -> float:
    """Return the largest KKT residual at ``q``, contacts within ``SAME`` taken as active."""
    return certify(pair.polyhedron, pair.energy, q, tolerance=SAME).residuals.worst


def race(
    pair: DumbbellPair, tools: dict[str, Solver], corners: dict[str, Certificate]
) -> dict[str, dict[str, Any]]:
    """Run every tool from every start and return its times, hits and residuals."""
    record: dict[str, dict[str, Any]] = {
        name: {"times": [], "right": 0, "residuals": []} for name in tools
    }
    for chirality, start in starts(pair, np.random.default_rng(2)):
        ends: dict[str, np.ndarray] = {}
        tasks = {name: _recorded(tool, name, start, ends) for name, tool in tools.items()}
        for name, times in interleave(tasks, ROUNDS).items():
            record[name]["times"].append(min(times))
            record[name]["right"] += is_at(pair, ends[name], corners[chirality])
            record[name]["residuals"].append(residual(pair, ends[name]))
    return record


def _recorded(
    tool: Solver, name: str, start: np.ndarray, ends: dict[str, np.ndarray]
) -> Callable[[], None]:
    def run() -> None:
        ends[name] = tool(start)

    return run


def main() -> None:
    pair = DumbbellPair(length=16, ball_radius=3, rod_radius=1.5, drum_radius=125)
    corners = {c: minimise(pair.polyhedron, pair.energy, pair.nested(c)) for c in ("R", "L")}
    assert all(corner.holds() for corner in corners.values())
    with TemporaryDirectory() as folder:
        record = race(pair, candidates(pair, corners["R"].point, Path(folder)), corners)
    ours = record[OURS]["times"]
    figures = {
        name: {
            "right corner": f"{100 * found['right'] / STARTS:g} %",
            "KKT, median": f"{statistics.median(found['residuals']):.0e}",
            "KKT, worst": f"{max(found['residuals']):.0e}",
            "ms": round(1e3 * statistics.median(found["times"]), 3),
            "time over ours": round(ratio(found["times"], ours), 2),
        }
        for name, found in record.items()
    }
    columns = ["", *figures[OURS]]
    print_table(f"{STARTS} starts", columns, [[n, *row.values()] for n, row in figures.items()])
    write("minimise", {"starts": STARTS, **figures})


if __name__ == "__main__":
    main()
