"""Proofs for boxes of parameters, cell by cell, and what is asked of their parameters."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from heapq import heappop, heappush
from itertools import count, product
from math import isfinite, nextafter, prod
from numbers import Real
from typing import Any

import numpy as np

from polycorner import checks
from polycorner.intervals.balls import (
    Ball,
    ball,
    balls,
    between,
    bounds,
    column,
    entries,
    matrix,
    middle_inverse,
    midpoints,
    precision,
)
from polycorner.intervals.enclosures import Formulas, Undecided
from polycorner.intervals.tapes import Box
from polycorner.minimisation import Certificate, Problem
from polycorner.progress import Progress, silent
from polycorner.proofs.hypotheses import (
    INACTIVE,
    Claim,
    ConditionResult,
    Status,
    check_hypotheses,
    closed_on,
    of_a_choice,
    without_enclosure,
)
from polycorner.proofs.kkt import Cell, Enclosure, enclose, newton
from polycorner.tolerances import DEFAULT
from polycorner.values import Checked

CELL_BITS = 64
MOST_STRIDES = 16  # into which a path through the parameters is divided
STRIDE_STEPS = 8  # steps of Newton's method at the end of a stride
FARTHEST = 0.5  # largest distance of a solution from its prediction, in scale units
Interval = tuple[float, float]
CHECK_BITS = 128


@dataclass(frozen=True)
class ParameterCell(Checked):
    """A cell of a box of parameters, and the status of the claim on it.

    Attributes
    ----------
    parameters : mapping from str to (float, float)
        The cell's sides, exactly.
    status : Status
        Proved; failed (a condition is violated throughout); or undecided.
    conditions : mapping from str to Status
        Status of each condition.
    reason : str
        The reason why the first condition is not proved; empty if all are.
    bounds : mapping from str to (float, float)
        Bounds of the coordinates, of the energy (``energy``) and of the multipliers
        (``multiplier NAME``) over the cell; empty where there is no enclosure.
    """

    parameters: Mapping[str, Interval]
    status: Status
    conditions: Mapping[str, Status]
    reason: str
    bounds: Mapping[str, Interval]

    @property
    def volume(self) -> float:
        """The product of the sides' lengths."""
        return prod(upper - lower for lower, upper in self.parameters.values())


@dataclass(frozen=True, eq=False)
class _Waiting:
    """A cell in the queue, with a solution for given parameters to start from."""

    sides: tuple[Interval, ...]
    start: "list[Ball]"
    at: tuple[float, ...]


def cover(
    claim: Claim,
    start: "list[Ball]",
    at: Sequence[float],
    sides: Mapping[str, Interval],
    *,
    max_cells: int,
    progress: Progress = silent,
) -> tuple[ParameterCell, ...]:
    """Divide a box of parameters into cells until all are decided or ``max_cells`` are reached.

    The claim's system has the parameters as inputs, in the order of ``sides``; ``start`` are the
    unknowns at the parameters ``at``.  Progress is told the decided fraction of the box, 1, and the
    number of cells.
    """
    names, whole = tuple(sides), prod(upper - lower for lower, upper in sides.values())
    order = count()
    root = _Waiting(tuple(sides.values()), start, tuple(at))
    waiting = [(-1.0, next(order), root)]
    done: list[ParameterCell] = []
    decided = 0.0
    while waiting:
        _, _, item = heappop(waiting)
        with precision(CELL_BITS):
            cell, parts = _tried(claim, names, item, sides)
        if parts and len(done) + len(waiting) + 2 <= max_cells:
            for half in parts:
                volume = prod(upper - lower for lower, upper in half.sides)
                heappush(waiting, (-volume / whole, next(order), half))
            continue
        done.append(cell)
        decided += cell.volume / whole
        progress(min(1.0, decided), 1.0, f"{len(done)} cells")
    return tuple(done)


def _tried(
    claim: Claim, names: tuple[str, ...], item: _Waiting, whole: Mapping[str, Interval]
) -> tuple[ParameterCell, list[_Waiting]]:
    """Return the cell with its status, and its halves if it is undecided."""
    sides = dict(zip(names, item.sides, strict=True))
    middle = tuple(lower + (upper - lower) / 2 for lower, upper in item.sides)
    centre = follow(claim, item.start, item.at, middle)
    if isinstance(centre, Undecided):
        found = without_enclosure(centre, symmetric=bool(claim.fields))
        cell = _cell(sides, found, {})
        return cell, [_Waiting(half, item.start, item.at) for half in halves(item.sides, whole)]
    p0 = [ball(x) for x in middle]
    reach = [between(*side) - p for side, p in zip(item.sides, p0, strict=True)]
    enclosure = enclose(claim.system, centre, Cell(p0, reach), bits=CELL_BITS)
    if isinstance(enclosure, Undecided):
        cell = _cell(sides, without_enclosure(enclosure, symmetric=bool(claim.fields)), {})
    else:
        found = check_hypotheses(claim, enclosure)
        refuted = any(x.status is Status.FAILED for k, x in found.items() if k != INACTIVE)
        # A function that is negative throughout refutes the claim, whatever supports.
        closed = closed_on(claim, enclosure) if refuted else []
        kept = {**of_a_choice(claim, closed, found), INACTIVE: found[INACTIVE]}
        cell = _cell(sides, kept, _bounds(claim, enclosure))
    if cell.status is not Status.UNDECIDED:
        return cell, []
    return cell, [_Waiting(half, centre, middle) for half in halves(item.sides, whole)]


def _cell(
    sides: Mapping[str, Interval],
    found: Mapping[str, ConditionResult],
    where: Mapping[str, Interval],
) -> ParameterCell:
    conditions = {name: result.status for name, result in found.items()}
    for status in (Status.FAILED, Status.UNDECIDED):
        for name, result in found.items():
            if result.status is status:
                return ParameterCell(sides, status, conditions, f"{name}: {result.reason}", where)
    return ParameterCell(sides, Status.PROVED, conditions, "", where)


def undecided_cell(sides: Mapping[str, Interval], undecided: Undecided) -> ParameterCell:
    """Return the undecided cell of the whole box."""
    return _cell(sides, without_enclosure(undecided), {})


def summary(cells: Sequence[ParameterCell]) -> dict[str, ConditionResult]:
    """Return the result of each condition over all cells."""
    names = dict.fromkeys(name for cell in cells for name in cell.conditions)
    return {name: _over_all(cells, name) for name in names}


def _over_all(cells: Sequence[ParameterCell], name: str) -> ConditionResult:
    """Return the result of one condition over all cells."""
    for status in (Status.FAILED, Status.UNDECIDED):
        some = [cell for cell in cells if cell.conditions.get(name) is status]
        if some:
            largest = max(some, key=lambda cell: cell.volume)
            reason = (
                f"on {len(some)} of {len(cells)} cells, the largest with "
                f"{shown_box(largest.parameters)}"
            )
            partly = status is Status.FAILED and len(some) < len(cells)
            return ConditionResult(Status.PARTLY if partly else status, reason)
    return ConditionResult(Status.PROVED, f"on all of the {len(cells)} cells")


def _bounds(claim: Claim, enclosure: Enclosure) -> dict[str, Interval]:
    d = claim.problem.polyhedron
    n = d.manifold.size
    found = dict(zip(d.manifold.names, enclosure.solution[:n], strict=True))
    found["energy"] = enclosure.linear.energy
    for name, value in zip(claim.names, enclosure.solution[n:], strict=False):
        if name not in d.hidden:
            found[f"multiplier {name}"] = value
    return {name: _outwards(value) for name, value in found.items()}


def _outwards(value: "Ball") -> Interval:
    lower, upper = bounds(value)
    return nextafter(float(lower), float("-inf")), nextafter(float(upper), float("inf"))


def halves(
    sides: tuple[Interval, ...], whole: Mapping[str, Interval]
) -> Iterator[tuple[Interval, ...]]:
    """Return the halves across the side that is longest relative to the whole box, if any."""
    lengths = [
        (upper - lower) / (last - first)
        for (lower, upper), (first, last) in zip(sides, whole.values(), strict=True)
    ]
    a = lengths.index(max(lengths))
    lower, upper = sides[a]
    middle = lower + (upper - lower) / 2
    if lower < middle < upper:
        for side in ((lower, middle), (middle, upper)):
            yield (*sides[:a], side, *sides[a + 1 :])


def follow(
    claim: Claim, z: "list[Ball]", at: Sequence[float], to: Sequence[float]
) -> "list[Ball] | Undecided":
    """Follow a solution from parameters ``at`` to parameters ``to``.

    The path is divided into strides, each predicted along the tangent; a stride is halved if
    Newton's method fails.  Nothing here needs to be rigorous.
    """
    done, stride = 0.0, 1.0
    undecided = Undecided(
        "the KKT equations", "the solution could not be followed to the parameters"
    )
    for _ in range(2 * MOST_STRIDES):
        now = [a + done * (b - a) for a, b in zip(at, to, strict=True)]
        nearly = done + stride >= 1.0
        then = (
            list(to)
            if nearly
            else [a + (done + stride) * (b - a) for a, b in zip(at, to, strict=True)]
        )
        found = _stride(claim, z, now, then)
        if found is None:
            stride /= 2
            if stride * MOST_STRIDES < 1:
                return undecided
            continue
        if nearly:
            return found
        z, done, stride = found, done + stride, 2 * stride
    return undecided


def _stride(
    claim: Claim, z: "list[Ball]", now: Sequence[float], then: Sequence[float]
) -> "list[Ball] | None":
    system = claim.system
    p = [ball(x) for x in now]
    linear = system.at(z, p)
    if isinstance(linear, Undecided):
        return None
    inner = middle_inverse(linear.jacobian)
    if inner is None:
        return None
    change = column([ball(b) - ball(a) for a, b in zip(now, then, strict=True)])
    moved = entries(inner * (matrix(linear.drift) * change))
    guess = midpoints([a - b for a, b in zip(z, moved, strict=True)])
    found = newton(system, guess, [ball(x) for x in then], bits=CELL_BITS, steps=STRIDE_STEPS)
    if isinstance(found, Undecided):
        return None
    steps = zip(found, guess, system.scales, strict=False)
    near = all(abs(a - b) <= FARTHEST * scale for a, b, scale in steps)
    return found if near else None


def shown_box(sides: Mapping[str, Interval]) -> str:
    """Return the sides of a box of parameters in words."""
    return ", ".join(f"{name} in [{a:g}, {b:g}]" for name, (a, b) in sides.items())


def check_unchanged(certificate: Certificate, formulas: Formulas) -> None:
    """Raise ValueError for a certificate whose functions have changed since it was made.

    A certificate computes with kernels bound once, a proof with the formulas as they are now.
    """
    problem = certificate.problem
    point = certificate.point
    seen, gradients = problem.evaluate(point, 1)
    rows = range(problem.rows)
    with precision(CHECK_BITS):
        now = formulas.values(Box(balls(point)), rows)
    sizes = 1 + abs(seen) + np.nan_to_num(abs(gradients).max(axis=1), nan=np.inf, posinf=np.inf)
    for name, before, value, size in zip(formulas.names, seen, now, sizes, strict=True):
        if not (isfinite(before) and value.is_finite() and isfinite(size)):
            continue
        if abs(float(value.mid()) - before) > 1e4 * DEFAULT.alike * size + float(value.rad()):
            msg = (
                f"certificate: expected the problem it was made for; {name} was {before:g} at its "
                f"point and is {float(value.mid()):g} now"
            )
            raise ValueError(msg)


def check_parameters(problem: Problem, parameters: Any) -> tuple[dict[str, Interval], list[float]]:
    """Return the box of parameters, and their values in the problem."""
    if parameters is None:
        return {}, []
    if not isinstance(parameters, Mapping) or not parameters:
        checks.refuse("parameters", "a mapping from names to (lower, upper)", parameters, TypeError)
    problem.check_parameters(parameters)
    sides = {name: _side(name, side) for name, side in parameters.items()}
    return sides, [min(problem.parameter_values[name]) for name in sides]


def _side(name: str, side: Any) -> Interval:
    pair = isinstance(side, tuple | list | np.ndarray) and len(side) == 2
    if not pair or not all(isinstance(x, Real) and not isinstance(x, bool) for x in side):
        msg = f"parameters: expected {name} as a pair of numbers (lower, upper); got {side!r}"
        raise TypeError(msg)
    lower, upper = float(side[0]), float(side[1])
    if not (isfinite(lower) and isfinite(upper) and lower < upper):
        msg = f"parameters: expected finite lower < upper for {name}; got ({lower:g}, {upper:g})"
        raise ValueError(msg)
    return lower, upper


def check_domain(formulas: Formulas, sides: Mapping[str, Interval]) -> None:
    """Raise ValueError for a box of parameters with a corner at which a function is undefined."""
    with precision(CHECK_BITS):
        for corner in product(*sides.values()):
            name = formulas.undefined([ball(x) for x in corner])
            if name:
                place = ", ".join(f"{p} = {x:g}" for p, x in zip(sides, corner, strict=True))
                msg = f"parameters: expected values for which {name} is defined; got {place}"
                raise ValueError(msg)
