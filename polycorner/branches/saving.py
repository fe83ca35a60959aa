"""Proofs of diagrams as plain data, in archives that :mod:`~polycorner.proofs.checker` verifies.

A file is a zip archive like that of a list (:mod:`polycorner.proofs.files`).  In ``problem.json``
are the functions as one program, whose last input is the parameter ``t``; its interval; for each
arc the functions that it holds, points along it with their multipliers, what vanishes at its ends,
the numbers of its events and its index; for each event its kind.  If a box was searched the other
parts have its subdivision, with directions for its leaves, which is made here by the checker's own
test.
"""

import json
import os
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from polycorner import checks
from polycorner.branches.diagram import Diagram
from polycorner.branches.mirrors import Image
from polycorner.branches.proof_options import BranchProofOptions
from polycorner.branches.system import Face
from polycorner.branches.tubes import Setting
from polycorner.intervals.balls import ball, precision
from polycorner.intervals.enclosures import Formulas
from polycorner.progress import Progress
from polycorner.proofs.checker.balls import BITS, NotShownError, hull, moved
from polycorner.proofs.checker.diagrams import StoredDiagram
from polycorner.proofs.checker.problem import DIAGRAM
from polycorner.proofs.files import archived, stated, text, texts
from polycorner.proofs.lists.intermediate import directions
from polycorner.spaces.manifold import Array
from polycorner.values import Value

CLOSED = -1  # the code of a leaf, as of a list


@dataclass(frozen=True, eq=False)
class ProvedArc(Value):
    """What an arc is saved with.

    Attributes
    ----------
    face : tuple of int
    zeros : (tuple of int, tuple of int)
        What is watched and vanishes at its ends.
    nodes : (k, N) array
        Unknowns along it: coordinates, the formulas' parameters, multipliers.
    """

    face: Face
    zeros: tuple[tuple[int, ...], tuple[int, ...]]
    nodes: Array


@dataclass(frozen=True, eq=False)
class Evidence(Value):
    """What a proof of a diagram is saved with.

    Attributes
    ----------
    arcs : tuple of ProvedArc
    images : tuple of Image
    weights, units : tuple of float
    start, rates : tuple of Fraction
    moved : int
        The place of the formulas' parameter that moves most, among the unknowns.
    every : bool
        Whether no equation follows from others.
    options : BranchProofOptions
    sides : (2, n) array
        Of the box that was searched; empty if none was.
    """

    arcs: tuple[ProvedArc, ...]
    images: tuple[Image, ...]
    weights: tuple[float, ...]
    units: tuple[float, ...]
    start: tuple[Fraction, ...]
    rates: tuple[Fraction, ...]
    moved: int
    every: bool
    options: BranchProofOptions
    sides: Array

    @classmethod
    def of(
        cls,
        setting: Setting,
        arcs: Sequence[ProvedArc],
        equations: int,
        options: BranchProofOptions,
        sides: Array,
    ) -> "Evidence":
        """Return the evidence of arcs that are proved."""
        every = len(setting.equations) == equations
        units, line = setting.units, (setting.start, setting.rates)
        known = tuple(arcs), setting.images, setting.weights, units, *line
        return cls(*known, setting.moved, every, options, sides)


def save_proof(
    path: str | os.PathLike[str], diagram: Diagram, evidence: Evidence, progress: Progress
) -> Path:
    """Save a diagram with the evidence for it; return the path.

    Raises
    ------
    ValueError
        If the checker does not follow the proof, or the name does not end in ``.zip``.
    OSError
        If the file could not be written.
    """
    if not evidence.every:
        checks.refuse("save", "a diagram whose equations are independent", diagram)
    data, parts = _described(diagram, evidence), {}
    with precision(BITS):
        try:
            proof = StoredDiagram(data)
            "".join(proof.said())
        except NotShownError as error:
            msg = f"save: expected a proof that the checker follows; it says: {error}"
            raise ValueError(msg) from None
        if proof.searched:
            parts = _cover(proof, evidence, progress)
    content = json.dumps(data, indent=1).encode()
    return archived(path, {"problem.json": content, **parts})


def _described(diagram: Diagram, evidence: Evidence) -> dict[str, Any]:
    problem, (low, high) = diagram.problem, diagram.interval
    n, m = problem.dimension, problem.inequalities
    names, count = tuple(diagram.rates), len(diagram.rates)
    formulas = Formulas(problem.functions, problem.polyhedron.manifold, names)
    data, _ = stated(problem, formulas, [range(m)])
    _substitute(data, n, evidence)
    data |= {
        "format": DIAGRAM,
        "coordinates": [*data["coordinates"][:n], diagram.parameter],
        "periods": [*data["periods"][:n], None],
        "parameters": [n],
        "fixed": [],
        "minima_only": False,
        "interval": [low.hex(), high.hex()],
        "domain": _domain(evidence, low, high),
        "open": 0,
        "weights": texts(Fraction(w) for w in evidence.weights),
        "scales": texts(Fraction(u) for u in (*evidence.units[:n], (high - low) / 5)),
        "symmetries": [
            {
                "order": list(g.order),
                "signs": list(g.signs),
                "functions": list(g.functions),
                "equations": [list(pair) for pair in g.equations],
            }
            for g in evidence.images
        ],
    }
    k = evidence.moved - n
    start, rate = float(evidence.start[k]), float(evidence.rates[k])
    data["arcs"] = [
        {
            "active": list(proved.face),
            "index": arc.index,
            "events": list(arc.events),
            "zeros": [list(zeros) for zeros in proved.zeros],
            "points": [
                [x.hex() for x in (*row[:n], (row[n + k] - start) / rate, *row[n + count :])]
                for row in proved.nodes.tolist()
            ],
        }
        for arc, proved in zip(diagram.arcs, evidence.arcs, strict=True)
    ]
    data["events"] = [{"kind": event.kind.name.lower()} for event in diagram.events]
    return data


def _domain(evidence: Evidence, low: float, high: float) -> dict[str, list[str]] | None:
    if not evidence.sides.size:
        return None
    lower, upper = evidence.sides.tolist()
    return {
        "lower": [x.hex() for x in (*lower, low)],
        "upper": [x.hex() for x in (*upper, high)],
    }


def _substitute(data: dict[str, Any], n: int, evidence: Evidence) -> None:
    """Write the formulas' parameters as functions of the last input: ``start + rate t``."""
    places, nodes = list[int](), list[list[Any]]()
    for op, *args in data["nodes"]:
        if op == "var" and args[0] >= n:
            start, rate = (some[args[0] - n] for some in (evidence.start, evidence.rates))
            nodes.append(["var", n])
            for other, given in (("mul", rate), ("add", start)):
                if given != (other == "mul"):
                    last = len(nodes) - 1
                    nodes += [["const", text(given)], [other, last, last + 1]]
        else:
            nodes.append([op, *(args if op in {"const", "var"} else [places[a] for a in args])])
        places.append(len(nodes) - 1)
    data["nodes"], data["outputs"] = nodes, [places[a] for a in data["outputs"]]


# ------------------------------------------------------------------------------------------ the box


def _cover(proof: StoredDiagram, evidence: Evidence, progress: Progress) -> dict[str, bytes]:
    """Return the subdivision of a box in which the checker finds no other equilibria."""
    codes, positions, counts, hints = list[int](), list[float](), list[int](), list[float]()
    p, options = proof.p, evidence.options
    units = np.append(evidence.units[: p.n - 1], (p.upper[-1] - p.lower[-1]) / 5)
    waiting, started = [(list(p.lower), list(p.upper))], time.monotonic()
    while waiting:
        lo, hi = waiting.pop()
        ways = _closing(proof, evidence, lo, hi)
        if ways is not None:
            codes.append(CLOSED)
            counts.append(len(ways))
            hints += [x for way in ways for x in way]
            continue
        widths = (np.array(hi) - lo) / units
        axis = int(widths.argmax())
        late = time.monotonic() - started > options.max_seconds
        if late or widths[axis] <= options.resolution or len(codes) >= options.max_boxes:
            names = p.names[:-1]
            where = ", ".join(f"{name} = {x:.6g}" for name, x in zip(names, lo, strict=False))
            found = f"a box near {where}, {p.names[-1]} = {lo[-1]:.6g} that it leaves open"
            checks.refuse("save", "a proof that the checker follows", found)
        middle = 0.5 * (lo[axis] + hi[axis])
        codes.append(axis)
        positions.append(middle)
        waiting += [(moved(lo, axis, middle), hi), (lo, moved(hi, axis, middle))]
        progress(len(codes), None, f"{len(waiting)} boxes wait")
    return {
        "tree.bin": np.array(codes, dtype="<i1").tobytes(),
        "positions.bin": np.array(positions, dtype="<f8").tobytes(),
        "counts.bin": np.array(counts, dtype="<u2").tobytes(),
        "directions.bin": np.array(hints, dtype="<f4").tobytes(),
    }


def _closing(
    proof: StoredDiagram, evidence: Evidence, lo: list[float], hi: list[float]
) -> list[list[float]] | None:
    """Return directions with which the checker closes a box, or None if it does not."""
    if proof.shown(lo, hi, []):
        return []
    ways = list(_ways(proof, evidence, lo, hi))
    if not ways:
        return None
    balls = [[ball(x) for x in way] for way in ways]
    return ways if proof.shown(lo, hi, balls) else None


def _ways(
    proof: StoredDiagram, evidence: Evidence, lo: list[float], hi: list[float]
) -> Iterator[list[float]]:
    """Yield directions in which the energy falls and functions grow that may vanish in a box.

    One for all of them, or some for as many subsets as are looked at.
    """
    p = proof.p
    n, box = p.n - 1, hull(lo, hi)
    v, memo = p.values(box), dict[int, Any]()
    slopes = np.full((2, 1, len(p.outputs), n), np.nan)
    for row in range(len(p.outputs)):
        found = p.forms(v, row, memo)
        if found is None:
            return
        slopes[:, 0, row] = 0.0
        for i, x in found[0].items():
            if i < n:
                slopes[:, 0, row, i] = float(x.lower()), float(x.upper())
    if not np.isfinite(slopes).all():
        return
    (may,) = p.open_sets(p.signs(v)) or [frozenset[int]()]
    units = np.array(evidence.units[:n])
    top = min(len(may), n - p.k)
    if len(may) > evidence.options.most_open:
        return
    sizes = sorted({len(may), *range(top + 1)}, reverse=True)
    served: list[frozenset[int]] = []
    for some in (frozenset(a) for size in sizes for a in combinations(sorted(may), size)):
        if any(some <= other for other in served):
            continue
        mask = np.zeros((1, p.m), dtype=np.bool_)
        mask[0, list(some)] = True
        where = np.zeros(1, dtype=np.int64)
        found, way, _ = directions((slopes[0], slopes[1]), where, mask, p.k, units, -1.0)
        if found[0]:
            served.append(some)
            yield [*way[0].astype(np.float32).tolist(), 0.0]
        if served and len(some) == len(may):
            return
