"""Where failed searches lead: to infinity, or to the edge of the domain of a formula.

*Infinity*.  A search that has gone far, or has run out of steps, is repeated in scales that grow
with the distance ``d`` from its start.  So distances grow geometrically, and a minimum at any
distance is found where the numbers resolve it.  Otherwise the descent leaves a trace of energies,
judged by how fast they fall as the distance is multiplied: with ``t = log d`` and ``a = -dE/dt``,

================================  ==============================================================
``a`` grows, or shrinks as        ``E`` falls without bound, as ``-d^p``, ``-log d`` and
``t^-q`` with ``q < 1``           ``-sqrt(log d)``
``a`` shrinks as ``t^-q`` with    ``E`` has a bound, as ``d^-p``, ``exp(-d)`` and ``1/log d``,
``q > 1``, or as ``d^-p``         which no point attains
================================  ==============================================================

and nothing is said in between.  This is evidence along one path, over the distances it went.

*Edges*, such as that of ``log(x)`` at ``x = 0``.  A point of an edge is one where a value or a
derivative of first or second order is not finite, and beside which a function is not defined.  A
search that stops short of one is followed: the edge ``q*`` lies in a direction ``d`` in which the
energy decreases, where the last finite point is found by bisection.  How the energy tends to the
edge is read off ``E(q* - s d)`` at distances ``s`` that are halved: it falls without bound where
the differences do not shrink, and tends to a limit where they do, as those of ``s^p`` shrink by
``2^-p``.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from polycorner.minimisation.descent import statuses
from polycorner.minimisation.problem import Problem
from polycorner.minimisation.verdicts import Verdict
from polycorner.polyhedra.cones import null_space
from polycorner.polyhedra.polyhedron import Piece
from polycorner.polyhedra.strata import distances
from polycorner.printing import names, number
from polycorner.spaces.manifold import Array
from polycorner.tolerances import Tolerances

STAGES, STEPS = 240, 2  # descents in growing scales, and their steps
SPACED = 1.4  # ratio of successive distances of a trace
STRAIGHT, DOUBLINGS = 2.5, 5.0  # doublings of the distance needed, with a ray to go on and without
POWER = 0.15  # exponent of d with which energies fall towards a bound
STEADY = 1.5  # ratio up to which successive exponents are those of one power
# Exponents q of rates t^-q, which have a sum exactly for q > 1 (Bertrand's series).
DIVERGENT, CONVERGENT = 0.7, 1.5
HALVINGS = 12


@dataclass(frozen=True)
class EscapeOptions:
    """How far a failed search is followed, and what is then read off its trace.

    Attributes
    ----------
    beyond : float
        Distance, in scale units, up to which an energy without bound is followed.
    deep : float
        A fall by so many times the energy's size at the start is taken to be without bound.
    farther : float
        Times the distance to which the energy has to fall on along a ray.
    across : float
        Newton's step across a valley, relative to that along it.
    shortest : float
        Length at which looking ahead starts, relative to the point's size.
    shrinking, lasting : float
        Ratios of successive differences of the energy: below the first they have a sum, from the
        second on they do not shrink.
    """

    beyond: float = 1e30
    deep: float = 1e60
    farther: float = 1e6
    across: float = 1e-6
    shortest: float = 1e-18
    shrinking: float = 0.95
    lasting: float = 1 - 1e-6


OPTIONS = EscapeOptions()


# --------------------------------------------------------------- to infinity


@dataclass(frozen=True, eq=False)
class Escape:
    """Where a failed search ends.

    Attributes
    ----------
    verdict : Verdict or None
        UNBOUNDED, NOT_ATTAINED, DOMAIN_EDGE or NOT_CONVERGED; None for a stationary point that
        was reached.
    point : (n,) array
        That point, or one of the trace; of an edge the last one at which all is finite.
    note : str
        What was seen, in words.
    """

    verdict: Verdict | None
    point: Array
    note: str


@dataclass(frozen=True, eq=False)
class Trace:
    """Points ever lower and farther from the first, at distances that grow geometrically.

    ``gone`` are the distances in scale units, ``size`` is that of the energy at the start: its
    value or derivatives; ``last`` is the last point reached, ``lowest`` its energy; ``level`` and
    ``converged`` say whether a descent ended there, with a flat second order or a regular one.
    """

    points: Array
    gone: Array
    energies: Array
    size: float
    last: Array
    lowest: float
    level: bool
    converged: bool

    @property
    def verdict(self) -> Verdict | None:
        """None where a descent ended, NOT_CONVERGED otherwise."""
        return None if self.level or self.converged else Verdict.NOT_CONVERGED

    @property
    def rates(self) -> tuple[Array, Array]:
        """The rates ``a = -dE/dt`` and the middle logarithms ``t``, as far as they are resolved."""
        t, falls = np.log(self.gone), -np.diff(self.energies)
        seen = falls > 1e-13 * abs(self.energies[1:])
        count = len(falls) if seen.all() else int(seen.argmin())
        rates = falls[:count] / np.diff(t)[:count]
        return rates, (t[1:] + t[:-1])[:count] / 2


@np.errstate(all="ignore")
def escape(problem: Problem, piece: Piece, start: Array, tolerances: Tolerances) -> Escape:
    """Follow the energy downhill in scales that grow with the distance, and say where it goes."""
    reached, origin = problem.restore(piece, start)
    if not reached or not np.isfinite(problem.energy.value(origin)):
        return Escape(Verdict.NOT_CONVERGED, start, "")
    trace = _trace(problem, piece, origin)
    if not len(trace.gone):
        return Escape(trace.verdict, trace.last, "")
    far, low = number(trace.gone[-1], 2), number(trace.lowest, 6)
    if trace.converged:
        return Escape(None, trace.last, f"The descent ended {far} scale units from its start.")
    went = f"The energy fell to {low} over {far} scale units"
    if _is_attained_nowhere(problem, piece, trace, tolerances):
        return Escape(
            Verdict.NOT_ATTAINED,
            trace.last,
            f"{went}, by less and less each time that the distance was doubled: its decreases have "
            "a finite sum.",
        )
    far_on = _far_along(problem, piece, trace, tolerances) if len(trace.gone) > 1 else trace
    if _is_without_bound(trace) or _is_without_bound(far_on):
        shown = int((trace.gone <= tolerances.unbounded).sum())  # resolved well enough
        return Escape(
            Verdict.UNBOUNDED,
            trace.points[max(0, shown - 1)],
            f"{went}, and its decreases do not shrink as the distance is multiplied.",
        )
    return Escape(
        trace.verdict,
        trace.last,
        f"{went}; whether it has a bound beyond is not seen.",
    )


def _trace(problem: Problem, piece: Piece, origin: Array) -> Trace:
    q, status, energy = origin, statuses.STALLED, problem.energy.value(origin)
    size = max(float(abs(x[-1]).max()) for x in problem.evaluate(origin, 2))
    points: list[Array] = []
    gone: list[float] = []
    energies: list[float] = []
    for _ in range(STAGES):
        reach = max(1.0, gone[-1] if gone else 0.0)
        status, _, after, _ = problem.descend(piece, q, STEPS, problem.scales * reach)
        lower = problem.energy.value(after)
        if not np.isfinite(after).all() or not lower <= energy:
            break
        idle = np.array_equal(q, after)
        q, energy = after, lower
        far = float(abs((q - origin) / problem.scales).max())
        if far >= (SPACED * gone[-1] if gone else 1.0):
            points.append(q)
            gone.append(far)
            energies.append(energy)
        if (
            idle
            or status in {statuses.CONVERGED, statuses.LEVEL, statuses.UNEVEN}
            or far > OPTIONS.beyond
            or energy < -OPTIONS.deep * size
        ):
            break
    level, converged = status in {statuses.LEVEL, statuses.UNEVEN}, status == statuses.CONVERGED
    ended = np.array(points), np.array(gone), np.array(energies)
    return Trace(*ended, size, q, energy, level, converged)


def _slowing(trace: Trace) -> float:
    """Return the exponent with which the rates shrink in ``t``, over the later half of a trace.

    It is nan where the trace is not long enough.
    """
    rates, t = trace.rates
    if len(rates) < max(DOUBLINGS, len(trace.gone) - 1) or trace.gone[-1] < OPTIONS.beyond:
        return np.nan
    half = len(rates) // 2
    return float(-np.log(rates[-1] / rates[half]) / np.log(t[-1] / t[half]))


def _is_without_bound(trace: Trace) -> bool:
    """Whether the energy fell far below all bounds, or falls on where a trace is long enough."""
    return bool(trace.lowest < -OPTIONS.deep * trace.size or _slowing(trace) <= DIVERGENT)


def _is_attained_nowhere(
    problem: Problem, piece: Piece, trace: Trace, tolerances: Tolerances
) -> bool:
    """Whether the energy falls towards a bound, as a power of the distance or of its logarithm.

    Near a minimum in the distance the exponents would grow: a short trace is believed if they are
    steady, or if the energy falls on along a ray.
    """
    if _slowing(trace) >= CONVERGENT:
        return True
    rates, t = trace.rates
    doublings = np.log2(trace.gone[len(rates)] / trace.gone[0])
    if len(rates) < 4 or doublings < STRAIGHT:
        return False
    powers = (-np.diff(np.log(rates)) / np.diff(t))[-3:]
    if not (powers >= POWER).all():
        return False
    steady = doublings >= DOUBLINGS and powers.max() <= STEADY * powers.min()
    if steady and not _nears_wall(problem, piece, trace, tolerances.zero):
        return True
    far_on = _far_along(problem, piece, trace, tolerances)
    return bool(far_on.gone[-1] > OPTIONS.farther * trace.gone[-1])


def _nears_wall(problem: Problem, piece: Piece, trace: Trace, closed: float) -> bool:
    """Whether a gap closes by no less each time that the distance is multiplied."""
    values, gradients = problem.evaluate(trace.points[-3:], 1)
    kept = sorted(piece)
    away = np.array(
        [distances(f[:-1], df[:-1])[kept] for f, df in zip(values, gradients, strict=True)]
    )
    closing = -np.diff(away, axis=0) / np.diff(np.log(trace.gone[-3:]))[:, None]
    gaps = away[1] > closed
    return bool((gaps & (closing[1] > OPTIONS.across * away[1]) & (closing[1] > closing[0])).any())


def _far_along(problem: Problem, piece: Piece, trace: Trace, tolerances: Tolerances) -> Trace:
    """Return a trace with points of the ray that goes on from it, inside the set and not upward.

    Rounding of the points moves them across the ray, where the energy is curved.
    """
    last, miss = trace.points[-1], tolerances.feasible
    step = _straight_on(problem, piece, last, last - trace.points[-2], tolerances.zero)
    length = float(abs(step / problem.scales).max())
    if not length > 0:
        return trace
    ahead = 2.0 ** np.arange(np.log2(4 * OPTIONS.beyond / length))
    points = last + ahead[:, None] * step
    values, gradients = problem.evaluate(points, 1)
    curved = float(abs(problem.evaluate(last, 2)[2][-1]).max())
    count, energy = 0, float(trace.energies[-1])
    sizes = 4e-30 * np.square(points / problem.scales).sum(axis=1) * curved
    for size, point, slopes in zip(sizes, values, gradients, strict=True):
        noise = 1e-15 * abs(energy) + size
        lower = -np.inf < point[-1] <= energy + noise
        if not (lower and problem.holds(piece, point, slopes, miss)):
            break
        count, energy = count + 1, float(point[-1])
    gone = trace.gone[-1] + ahead[:count] * length
    return replace(
        trace,
        points=np.concatenate([trace.points, points[:count]]),
        gone=np.concatenate([trace.gone, gone]),
        energies=np.concatenate([trace.energies, values[:count, -1]]),
        lowest=min(energy, trace.lowest),
    )


def _straight_on(problem: Problem, piece: Piece, q: Array, step: Array, closed: float) -> Array:
    """Return a step without its parts across the contacts, and across a valley of the energy.

    Across a valley, Newton's step is far shorter than the step along it.
    """
    values, gradients, hessians = problem.evaluate(q, 2)
    m, u = problem.inequalities, step / problem.scales
    away = distances(values[:-1], gradients[:-1])
    held = [*(i for i in sorted(piece) if away[i] <= closed), *range(m, len(values) - 1)]
    curvatures, vectors = np.linalg.eigh(hessians[-1])
    short = abs(gradients[-1] @ vectors) <= OPTIONS.across * np.linalg.norm(u) * curvatures
    basis = null_space(np.vstack([gradients[held], vectors.T[short]]), 1e-8)
    return np.asarray(basis @ (basis.T @ u) * problem.scales)


# --------------------------------------------------------------- to the edge of a domain


@np.errstate(all="ignore")
def domain_edge(problem: Problem, piece: Piece, q: Array, tolerances: Tolerances) -> Escape | None:
    """Return the edge of a domain at which a search has ended, or None where there is none."""
    rows = [*sorted(piece), *range(problem.inequalities, problem.rows)]
    values, gradients, hessians = problem.evaluate(q, 2)
    if not np.isfinite(values[rows[:-1]]).all():
        return None
    if not np.isfinite(values[-1]):
        note = f"The search ended on the edge of the domain of {_named(problem, rows[-1:])}"
        return Escape(Verdict.DOMAIN_EDGE, q, f"{note}, where it has no finite value.")
    for derivative, which in ((gradients, "first"), (hessians, "second")):
        rough = [row for row in rows if not np.isfinite(derivative[row]).all()]
        if rough:
            edge = _is_beside(problem, rows, q, tolerances.zero / 10)
            return _at_edge(problem, q, rough, which) if edge else None
    for way in _ways_down(problem, rows, values, gradients, tolerances.zero):
        found = _ahead(problem, rows, q, way, tolerances)
        if found is not None:
            return found
    return None


def _at_edge(problem: Problem, q: Array, rows: list[int], which: str) -> Escape:
    note = (
        f"The search ended on the edge of the domain of {_named(problem, rows)}, where the value "
        f"is finite and the {which} derivatives are not."
    )
    return Escape(Verdict.DOMAIN_EDGE, q, note)


def _is_beside(problem: Problem, rows: list[int], q: Array, distance: float) -> bool:
    """Whether a function is not defined at a point beside ``q``."""
    steps = distance * np.maximum(abs(q), problem.scales) * np.eye(len(q))
    around = problem.evaluate(q + np.concatenate([steps, -steps]), 0)[0]
    return not bool(np.isfinite(around[:, rows]).all())


def _ways_down(
    problem: Problem, rows: list[int], values: Array, gradients: Array, closed: float
) -> Iterator[Array]:
    """Yield directions in which the energy decreases: freely, and along the contacts."""
    away = distances(values[:-1], gradients[:-1])
    contacts = [row for row in rows[:-1] if abs(away[row]) <= closed]
    for held in ([], contacts) if contacts else ([],):
        basis = null_space(gradients[held], 1e-8) if held else np.eye(problem.dimension)
        slope = basis @ (basis.T @ gradients[-1])
        size = float(np.linalg.norm(slope))
        if size > 0:
            yield -slope / size


def _ahead(
    problem: Problem, rows: list[int], q: Array, way: Array, tolerances: Tolerances
) -> Escape | None:
    """Return the edge that lies shortly ahead, if the energy decreases all the way."""
    step = way * problem.scales
    size = max(1.0, float(abs(q / problem.scales).max()))
    shortest = OPTIONS.shortest
    ahead = size * shortest * 2.0 ** np.arange(np.log2(tolerances.corner / shortest))
    level = float(problem.energy.value(q))
    beyond = _is_beyond(problem, rows, q + ahead[:, None] * step, level)
    if not beyond.any():
        return _pole(problem, rows, q, way, tolerances)
    first = int(beyond.argmax())
    inside, outside = (0.0 if first == 0 else float(ahead[first - 1])), float(ahead[first])
    for _ in range(80):
        middle = (inside + outside) / 2
        out = _is_beyond(problem, rows, q + middle * step, level)
        inside, outside = (inside, middle) if out else (middle, outside)
    there = problem.evaluate(q + outside * step, 0)[0]
    between = np.linspace(0.0, inside, 17)
    path, slopes = problem.evaluate(q + between[:, None] * step, 1)[:2]
    if not _stays(problem, rows, path, slopes, tolerances.zero):
        return _pole(problem, rows, q, way, tolerances)
    edge = q + inside * step
    text, attained = _approach(problem, edge, step, tolerances.corner)
    missing = [row for row in rows if not np.isfinite(there[row])]
    if not missing and attained:
        return None  # a jump, or rounding
    missing = missing or rows[-1:]  # a pole, beyond which the energy is finite again
    note = f"The search ran to the edge of the domain of {_named(problem, missing)}; {text}."
    return Escape(Verdict.DOMAIN_EDGE, edge if attained else q, note)


def _pole(
    problem: Problem, rows: list[int], q: Array, way: Array, tolerances: Tolerances
) -> Escape | None:
    """Return a pole of the energy ahead, on both sides of which it falls without bound.

    Of ``E = C t^-p`` at the distance ``t``, ``E'/E`` is ``p / t`` and ``E''/E'`` is
    ``(p + 1) / t``.
    """
    values, gradients, hessians = problem.evaluate(q, 2)
    slope, bend = float(gradients[-1] @ way), float(way @ hessians[-1] @ way)
    if not (slope < 0 and bend < 0 and values[-1] < 0):
        return None
    inverse = bend / slope - slope / values[-1]
    if not inverse > 1 / tolerances.corner:
        return None
    step = way * problem.scales
    between = np.linspace(0.0, 0.9 / inverse, 17)
    path, slopes = problem.evaluate(q + between[:, None] * step, 1)[:2]
    if not _stays(problem, rows, path, slopes, tolerances.zero):
        return None
    text, attained = _approach(problem, q + step / inverse, step, tolerances.corner)
    if attained:
        return None
    note = f"The search ran to the edge of the domain of {_named(problem, rows[-1:])}; {text}."
    return Escape(Verdict.DOMAIN_EDGE, q, note)


def _is_beyond(problem: Problem, rows: list[int], q: Array, level: float) -> NDArray[np.bool_]:
    """Whether a function has no value at points, or the energy is above a level."""
    values = problem.evaluate(q, 0)[0][..., rows]
    return np.asarray(~np.isfinite(values).all(axis=-1) | (values[..., -1] > level))


def _named(problem: Problem, rows: list[int]) -> str:
    return names(problem.functions[row].name for row in rows)


def _stays(problem: Problem, rows: list[int], values: Array, gradients: Array, miss: float) -> bool:
    """Whether points on the way to an edge lie in the set, ever lower."""
    piece = frozenset(row for row in rows if row < problem.inequalities)
    energies = values[:, -1]
    noise = 1e-14 * abs(energies[0])
    for point, slopes in zip(values, gradients, strict=True):
        if not problem.holds(piece, point, slopes, miss):
            return False
    return bool((np.diff(energies) <= noise).all())


def _approach(problem: Problem, edge: Array, step: Array, far: float) -> tuple[str, bool]:
    """Say how the energy behaves towards an edge; return whether its value there is finite."""
    near = far * 2.0 ** -np.arange(HALVINGS + 1)
    energies = problem.evaluate(edge - near[:, None] * step, 0)[0][:, -1]
    falls = -np.diff(energies)
    here = f"the energy decreases towards it, to {number(problem.energy.value(edge), 4)}"
    if not np.isfinite(falls).all() or not (falls[-4:] > 0).all():
        return here, True
    ratio = float((falls[-3:] / falls[-4:-1]).mean())
    if ratio >= OPTIONS.lasting:
        return (
            "towards it the energy falls without bound, by no less each time that the distance is "
            "halved"
        ), False
    if ratio >= OPTIONS.shrinking:
        return f"{here}, and whether it has a limit is not seen", False
    limit = float(energies[-1] - falls[-1] * ratio / (1 - ratio))
    return f"the energy decreases towards it and tends to about {number(limit, 4)}", True
