"""Multi-start search for all local minima, each reported once up to a symmetry."""

from collections import Counter
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from polycorner import checks
from polycorner.minimisation.loci import Loci, Locus, Quotient, check_symmetry
from polycorner.minimisation.methods import minimise
from polycorner.minimisation.outcomes import Minima
from polycorner.minimisation.problem import pose
from polycorner.minimisation.sampling import Box, start_points
from polycorner.minimisation.verdicts import Verdict
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.polyhedra.symmetry import Symmetry
from polycorner.progress import Progress, silent
from polycorner.tolerances import RANK_TOLERANCE, TOLERANCE, Tolerances

if TYPE_CHECKING:
    from polycorner.minimisation.problem import Energy

CHECKED = 3  # starts at which a symmetry is checked


def minima(  # noqa: PLR0913 - all but two are options
    polyhedron: Polyhedron,
    energy: "Energy",
    *,
    starts: ArrayLike | int = 1000,
    box: Box | None = None,
    rng: np.random.Generator | int | None = None,
    symmetry: Symmetry | None = None,
    progress: Progress = silent,
    tolerance: float = TOLERANCE,
    rank_tolerance: float = RANK_TOLERANCE,
) -> Minima:
    """Find the local minima of an energy on a polyhedron by descent from many starts.

    Every start descends by :func:`~polycorner.minimisation.methods.minimise`; the basin of a
    minimum is the set of starts from which this descent reaches it, which need not be the basin of
    a motion.  :mod:`~polycorner.minimisation.loci` identifies minima up to the symmetry: a
    connected locus of minima at one energy is one entry.  One representative of each is certified,
    of a locus one with the fewest active functions.

    Parameters
    ----------
    polyhedron : Polyhedron
        The set ``D``.
    energy : SmoothFunction or sympy.Expr
        The energy ``E``, on the same manifold.
    starts : (k, n) array or int, optional
        Start points, such as a model's ``starts(rng, k)``; those outside ``D`` are first projected
        onto it.  Or a number of points to sample independently and uniformly from the part of
        ``box`` in which the inequalities hold.
    box : sequence of (low, high), optional
        Bounds for each coordinate of sampled points; None stands for a whole circle, sphere or
        all rotations, and is the default for these.
    rng : Generator or int, optional
        Source of sampled points; default a generator with seed 0.
    symmetry : Symmetry, optional
        Symmetry of the polyhedron *and of the energy* up to which minima are identified.
    progress : callable, optional
        Called after every start with the number of starts done, their total, and the number of
        minima in words; see :class:`~polycorner.progress.Progress`.
    tolerance, rank_tolerance : float, optional
        See :class:`~polycorner.minimisation.certificate.Certificate`.  Two points are one up to the
        distance ``1e-6 (tolerance / 1e-8)^(3/4)``, in scale units.

    Returns
    -------
    Minima
        After an interruption (Ctrl-C), with what was found so far.

    Raises
    ------
    TypeError, ValueError
        For arguments of a wrong kind or shape, a symmetry that changes the energy, a box that
        misses the polyhedron, or starts where the energy is not finite.

    Examples
    --------
    >>> from polycorner import Manifold, Polyhedron
    >>> M = Manifold.euclidean("x y")
    >>> x, y = M.symbols
    >>> D = Polyhedron(M, {"wall": x + 2, "floor": y})
    >>> found = minima(D, (x**2 - 1) ** 2 + x / 4 + y, starts=100, box=[(-2, 2), (0, 1)])
    >>> [c.point.round(3).tolist() for c in found], sum(found.counts)
    ([[-1.03, 0.0], [0.967, 0.0]], 100)
    """
    tolerances = Tolerances.of(tolerance, rank_tolerance)
    problem = pose(polyhedron, energy)
    if symmetry is not None:
        checks.instance("symmetry", symmetry, Symmetry)
    if not callable(progress):
        checks.refuse("progress", "a function (done, total, note)", progress, TypeError)
    points = start_points(problem, starts, box, rng)
    quotient = Quotient(problem, symmetry or Symmetry(), tolerances)
    check_symmetry(quotient, points[:CHECKED])
    loci, failures = Loci(quotient), Counter[Verdict]()
    interrupted = False
    try:
        for done, q in enumerate(points, 1):
            found = minimise(
                polyhedron,
                problem.energy,
                q,
                tolerance=tolerance,
                rank_tolerance=rank_tolerance,
            )
            if found.search is not None and found.verdict is found.search:
                failures[found.search] += 1
            else:
                loci.add(found)
            count = sum(map(_is_minimum, loci.loci))
            progress(done, len(points), f"{count} minima")
        loci.merge()
    except KeyboardInterrupt:
        interrupted = True
    outcome = _outcome(loci.loci, failures, len(points), interrupted=interrupted)
    return replace(outcome, modulo=symmetry is not None)


def _is_minimum(locus: Locus) -> bool:
    return locus.certificate.is_minimum


def _outcome(
    loci: list[Locus], failures: Counter[Verdict], starts: int, *, interrupted: bool
) -> Minima:
    ordered = _by_level(loci)
    kept = [locus for locus in ordered if _is_minimum(locus)]
    others = [locus for locus in ordered if not _is_minimum(locus)]
    for locus in others:
        failures[locus.certificate.verdict] += locus.count
    return Minima(
        certificates=tuple(locus.certificate for locus in kept),
        counts=tuple(locus.count for locus in kept),
        points=tuple(np.array(locus.points) for locus in kept),
        elsewhere=dict(failures.most_common()),
        others=tuple(locus.certificate for locus in others),
        descents=sum(locus.count for locus in kept) + failures.total(),
        starts=starts,
        interrupted=interrupted,
    )


def _by_level(loci: list[Locus]) -> list[Locus]:
    """Return loci by energy, those of equal energy in the order in which they were found.

    Rounding errors of equal energies, as of mirror images, thus do not decide the order.
    """
    levels: dict[int, int] = {}
    level, last = 0, -np.inf
    for k in sorted(range(len(loci)), key=lambda k: loci[k].energy):
        level += loci[k].energy - last > loci[k].slack
        levels[k], last = level, loci[k].energy
    return [loci[k] for k in sorted(levels, key=lambda k: (levels[k], k))]
