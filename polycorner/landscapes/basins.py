"""Basins: the shares of placements from which a descent ends in each minimum."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from math import isfinite
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polycorner import checks
from polycorner.kinds import checked
from polycorner.landscapes.barriers import Landscape
from polycorner.landscapes.steepest import steepest
from polycorner.minimisation.abundance import share_interval
from polycorner.minimisation.certificate import Certificate
from polycorner.minimisation.loci import Loci, Locus
from polycorner.minimisation.methods import minimise
from polycorner.minimisation.multistart import (
    Box,
    Ends,
    by_level,
    descend_from,
    modulo,
    start_points,
)
from polycorner.minimisation.problem import Problem, pose
from polycorner.minimisation.verdicts import Verdict
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.polyhedra.symmetry import Symmetry
from polycorner.printing import Printed, Sheet, Table, listed, names, number
from polycorner.progress import Progress, silent
from polycorner.signatures import shown
from polycorner.spaces.manifold import Array
from polycorner.tolerances import RANK_TOLERANCE, TOLERANCE, Tolerances
from polycorner.values import Checked, cached_property

if TYPE_CHECKING:
    from polycorner.minimisation.problem import Energy

Interval = tuple[float, float]
STRIDE = 0.2  # scale units
NOWHERE = -1  # the number of no minimum


@dataclass(frozen=True, eq=False, repr=False)
class Basins(Checked, Printed):
    """In which minima descents from many placements ended; see :func:`basins`.

    Attributes
    ----------
    minima : tuple of Certificate
        The minima of the landscape that was given, in its order, then those that it does not have;
        without a landscape, those that were found.  What was found is ordered by energy.
    known : int
        How many are the landscape's.
    names : tuple of str
        Their names, by default their numbers.
    points : (k, n) array
        The placements from which descents were done, as they were given or sampled.
    ends : (k,) array of int
        The number of the minimum in which each descent ended; -1 if in none.
    elsewhere : mapping from Verdict to int
        How many descents ended in no minimum, by the verdict on where they ended.
    interrupted : bool
        Whether the search was interrupted: placements were left, and loci not yet merged.
    """

    minima: tuple[Certificate, ...]
    known: int
    names: tuple[str, ...]
    points: Array
    ends: NDArray[np.int64]
    elsewhere: Mapping[Verdict, int]
    interrupted: bool = False

    @property
    def descents(self) -> int:
        """Number of descents."""
        return len(self.ends)

    @cached_property
    def counts(self) -> tuple[int, ...]:
        """How many descents ended in each minimum."""
        found = np.bincount(self.ends[self.ends != NOWHERE], minlength=len(self.minima))
        return tuple(found.tolist())

    @property
    def shares(self) -> tuple[float, ...]:
        """The share of descents that ended in each minimum; nan if there were none."""
        return tuple(count / self.descents if self.descents else np.nan for count in self.counts)

    @property
    def intervals(self) -> tuple[Interval, ...]:
        """Wilson's 95 % interval of each share, for placements that are independent draws."""
        return tuple(share_interval(count, self.descents) for count in self.counts)

    def __repr__(self) -> str:
        """Return the shares in one line."""
        shown = zip(self.names[:5], self.shares[:5], strict=True)
        shares = ", ".join(f"{name}: {share:.4g}" for name, share in shown)
        dots = ", ..." if len(self.minima) > 5 else ""
        return f"Basins({shares}{dots}; {self.descents} descents)"

    def _sheet(self) -> Sheet:
        rows = [
            (name, number(c.energy), *_shown(count, self.descents), names(c.active) or "-")
            for name, c, count in zip(self.names, self.minima, self.counts, strict=True)
        ]
        rows += [
            (verdict.name, "", *_shown(count, self.descents), "")
            for verdict, count in self.elsewhere.items()
        ]
        head = ("minimum", "energy", "share", "from", "to", "descents", "active")
        parts: list[Table | str] = [
            listed("", head, rows, len(rows), (1, 2, 3, 4, 5)),
            "Intervals: 95 % (Wilson).",
        ]
        more = len(self.minima) - self.known
        if self.known and more:
            parts.append(f"The last {more} of the minima are not among those of the landscape.")
        if self.interrupted:
            parts.append("Interrupted: placements are left.")
        return Sheet("Basins", tuple(parts))


def _shown(count: int, total: int) -> tuple[str, str, str, str]:
    low, high = share_interval(count, total)
    share = f"{count / total:.2%}" if total else "-"
    return share, f"{low:.2%}", f"{high:.2%}", str(count)


@shown
def basins(  # noqa: PLR0913 - all but two are options
    polyhedron: Polyhedron | Landscape,
    energy: "Energy | None" = None,
    *,
    starts: ArrayLike | int = 1000,
    box: Box | None = None,
    rng: np.random.Generator | int | None = None,
    stride: float = STRIDE,
    symmetry: Symmetry | None = None,
    executor: Any = None,
    progress: Progress = silent,
    tolerance: float = TOLERANCE,
    rank_tolerance: float = RANK_TOLERANCE,
) -> Basins:
    """Estimate the share of placements from which a descent ends in each minimum.

    The descent is a steepest one in scale units: by steps that are no longer than ``stride``, that
    end lower than they begin, and that no wall crosses that is thicker.  Near a stationary point
    :func:`~polycorner.minimise` takes over.

    Parameters
    ----------
    polyhedron : Polyhedron or Landscape
        The set ``D``; or a landscape, whose minima then have the numbers that they have there.
    energy : SmoothFunction or sympy.Expr, optional
        The energy ``E``; of a landscape, its own.
    starts : int or (k, n) array, optional
        A number of placements to sample independently from the part of ``box`` that lies in ``D``,
        uniformly: by lengths, angles, areas on spheres and the invariant measure of rotations.  Or
        placements, drawn from another distribution; error bars are those of independent draws.
        Where ``D`` has no interior, samples are moved onto it and no longer uniform.
    box : sequence of (low, high), optional
        Bounds for each coordinate of sampled placements; None stands for a whole circle, sphere or
        all rotations, and is the default for these.
    rng : Generator or int, optional
        Source of sampled placements; default a generator with seed 0.
    stride : float, optional
        Longest step of a descent, in scale units; infinite: all steps are those of
        :func:`~polycorner.minimise`.  These are fast, but may be long, and end in another minimum
        than the steepest descent from some placements near the edges of basins.
    symmetry : Symmetry, optional
        Symmetry of the polyhedron *and of the energy* up to which minima are identified.  Of minima
        of a landscape that are, the first one counts for all.
    executor : optional
        Where descents are computed, as for :func:`~polycorner.sweeps.sweep`; the result does not
        depend on it.  Default this process.
    progress : callable, optional
        Called after every descent; see :class:`~polycorner.progress.Progress`.
    tolerance, rank_tolerance : float, optional
        As for :func:`~polycorner.minima`.

    Returns
    -------
    Basins
        After an interruption (Ctrl-C), with the descents done so far.

    Raises
    ------
    TypeError, ValueError
        As for :func:`~polycorner.minima`, and for an energy beside a landscape, or none beside a
        polyhedron.

    Examples
    --------
    The parts of a line to the right and to the left of a wall have lengths of 1.9 and 0.9:

    >>> from polycorner import Manifold
    >>> M = Manifold.euclidean("x")
    >>> (x,) = M.symbols
    >>> D = Polyhedron(M, {"left": x + 1, "right": 2 - x, "wall": x**2 - 0.01})
    >>> found = basins(D, x**2 - x, starts=300, box=[(-1, 2)], rng=1)
    >>> [c.point.round(6).tolist() for c in found.minima], sum(found.counts)
    ([[0.5], [-0.1]], 300)
    >>> low, high = found.intervals[0]
    >>> low < 1.9 / 2.8 < high
    True
    """
    checks.real("stride", stride, above=0, infinite=True)
    tolerances = Tolerances.of(tolerance, rank_tolerance)
    problem = _problem(polyhedron, energy)
    points = start_points(problem, starts, box, rng)
    loci = modulo(problem, symmetry, points, tolerances)
    known = _placed(polyhedron, loci) if isinstance(polyhedron, Landscape) else []
    begin = partial(_descended, stride=stride) if isfinite(stride) else None
    ends = descend_from(points, loci, executor, progress, begin)
    if not ends.interrupted:
        _complete(known, loci)
    return _basins(points, known, ends)


@checked
def minimum_of(
    landscape: Landscape,
    start: ArrayLike,
    *,
    stride: float = STRIDE,
    symmetry: Symmetry | None = None,
) -> int | None:
    """Return the number of the minimum of a landscape in which a descent from a point ends.

    Parameters
    ----------
    landscape : Landscape
    start : (n,) array
        Where to start.  For many points, use :func:`basins`.
    stride, symmetry : optional
        As for :func:`basins`.

    Returns
    -------
    int or None
        None if the descent ends in no minimum, or in one that the landscape does not have.

    Raises
    ------
    TypeError, ValueError
        As for :func:`basins`.
    """
    q = landscape.problem.polyhedron.manifold.point(start, "start")
    found = basins(landscape, starts=q[None], stride=stride, symmetry=symmetry)
    end = int(found.ends[0])
    return end if NOWHERE < end < found.known else None


def _descended(problem: Problem, q: Array, stride: float) -> Array:
    """Return the end of a steepest descent; ``q`` if the set is not reached."""
    return [q, *steepest(problem, q, stride)][-1]


def _problem(polyhedron: Any, energy: Any) -> Problem:
    if not isinstance(polyhedron, Landscape):
        return pose(polyhedron, energy)
    if energy is not None:
        checks.refuse("energy", "None with a landscape, which has its own", energy)
    return polyhedron.problem


def _placed(landscape: Landscape, loci: Loci) -> list[Locus]:
    """Add the minima of a landscape to the loci; return the locus of each."""
    problem, limits = loci.quotient.problem, loci.quotient.tolerances
    places = []
    for k, minimum in enumerate(landscape.minima):
        # The point may be the middle of a box in which the minimum is enclosed.
        found = minimise(
            problem.polyhedron,
            problem.energy,
            minimum.point,
            tolerance=limits.zero,
            rank_tolerance=limits.rank,
        )
        locus = loci.add(found)
        if not found.is_minimum or not _within(minimum.energy, found.energy, locus.slack):
            low, high = minimum.energy
            msg = (
                f"landscape: expected minima; a descent from number {k}, with an energy between "
                f"{low:.9g} and {high:.9g}, ends at {found.energy:.9g}: {found.verdict.value}"
            )
            raise ValueError(msg)
        places.append(locus)
    return places


def _within(bounds: Interval, value: float, slack: float) -> bool:
    return bounds[0] - slack <= value <= bounds[1] + slack


def _complete(known: Sequence[Locus], loci: Loci) -> None:
    """Walk along the loci of a landscape where points on their levels were not met on them."""
    new = [locus for locus in loci.loci if locus.wide and locus not in known]
    for locus in dict.fromkeys(known):
        if locus.wide and any(abs(other.energy - locus.energy) <= locus.slack for other in new):
            loci.spread(locus)
    if new:
        loci.merge()


def _basins(points: Array, known: Sequence[Locus], ends: Ends) -> Basins:
    new = [locus for locus in ends.loci.loci if locus.certificate.is_minimum and locus not in known]
    every = [*known, *by_level(new)]
    numbers = np.full(ends.done, NOWHERE, dtype=np.int64)
    for k, locus in reversed([*enumerate(every)]):  # the first one of those that are identified
        numbers[locus.starts] = k
    return Basins(
        minima=tuple(locus.certificate for locus in every),
        known=len(known),
        names=tuple(map(str, range(len(every)))),
        points=points[: ends.done],
        ends=numbers,
        elsewhere=ends.elsewhere,
        interrupted=ends.interrupted,
    )
