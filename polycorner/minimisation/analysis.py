"""Analysis of the optimality conditions at a point, over all pieces of the polyhedron there."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from polycorner.minimisation.conditions import (
    Curvature,
    Multipliers,
    find_curvature,
    find_multipliers,
)
from polycorner.minimisation.problem import Problem
from polycorner.minimisation.smoothness import obstacle
from polycorner.minimisation.verdicts import Entrapment, Verdict
from polycorner.polyhedra.cones import Rows, inward_direction, null_space, rank
from polycorner.polyhedra.polyhedron import Piece
from polycorner.polyhedra.strata import distances, local_pieces
from polycorner.spaces.manifold import Array
from polycorner.values import Value

# Distances to which flat directions are followed, in scale units.
PROBES = np.array([0.003, 0.03, -0.003, -0.03])
OPEN = 10  # a product of multiplier and gap beyond so many tolerances is not rounding
# Where several pieces meet, the first of these verdicts that any of them has decides.
DECISIVE = (
    Verdict.NOT_STATIONARY,
    Verdict.SADDLE,
    Verdict.NO_MULTIPLIER,
    Verdict.UNDECIDED,
    Verdict.MINIMUM_ALONG_LOCUS,
    Verdict.WEAK_MINIMUM,
    Verdict.STRICT_MINIMUM,
)
PROBE_NOISE = 1e-12  # relative change of the energy that counts as rounding


@dataclass(frozen=True, eq=False)
class Local(Value):
    """Derivatives at a point, in scaled coordinates, and the tolerances in force there."""

    problem: Problem
    point: Array
    values: Array
    gradients: Array
    hessians: Array
    tolerance: float
    rank_tolerance: float

    @cached_property
    def reference(self) -> float:
        """The size of the energy: its largest first or second derivative in scaled coordinates."""
        return float(max(abs(self.gradients[-1]).max(), abs(self.hessians[-1]).max())) or 1.0

    @property
    def small(self) -> float:
        """The size up to which a first derivative counts as zero."""
        return self.tolerance * self.reference

    @property
    def sections(self) -> range:
        """Rows of the equations."""
        return range(self.problem.inequalities, len(self.values) - 1)


@dataclass(frozen=True, eq=False)
class Analysis(Value):
    """First and second order at a point, in scaled coordinates.

    Attributes
    ----------
    verdict : Verdict
        What the conditions imply.
    active : tuple of int
        Rows of the active inequalities of the piece that decides.
    gradients : (k + e, n) array
        Gradients of the active inequalities, then of the equations.
    multipliers : Multipliers
        Of unit gradients.
    independent : bool
        Whether the gradients are linearly independent (LICQ).
    strong_positions : tuple of int
        Positions in ``active`` of an independent set of functions with positive multipliers.
    weak : tuple of int
        Rows with zero multipliers.
    curvature : Curvature
        The second-order condition.
    reference : float
        The size of the energy; see :attr:`Local.reference`.
    small_curvature : float
        Curvature that counts as zero.
    flat_verified : bool
        Whether the energy is constant along every direction in which the second order vanishes.
    flat_change : float
        Its largest relative change there; infinite where a direction could not be followed.
    local : Local
        The derivatives all this was computed from.
    obstacle : str
        Why the functions are not twice differentiable at the point; empty if they are.
    """

    verdict: Verdict
    active: tuple[int, ...]
    gradients: Array
    multipliers: Multipliers
    independent: bool
    strong_positions: tuple[int, ...]
    weak: tuple[int, ...]
    curvature: Curvature
    reference: float
    small_curvature: float
    flat_verified: bool
    flat_change: float
    local: Local
    obstacle: str = ""

    @property
    def signature(self) -> tuple[int, int, int]:
        """The lemma's ``(p, q, r)``."""
        values = self.curvature.values
        free = int((abs(values) <= self.small_curvature).sum())
        return len(self.strong_positions), len(values) - free, free

    @cached_property
    def entrapment(self) -> dict[str, Entrapment]:
        """The kind of entrapment in every direction."""
        return dict(_entrapment(self))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the active inequalities."""
        return tuple(self.local.problem.polyhedron.names[i] for i in self.active)

    @property
    def held_names(self) -> tuple[str, ...]:
        """Names of the active inequalities, then of the equations."""
        return self.names + self.local.problem.polyhedron.equation_names

    def by_name(self, values: Array) -> dict[str, float]:
        """Return multipliers of unit gradients as multipliers ``dE/df`` of the functions."""
        sizes = np.linalg.norm(self.gradients, axis=1)
        safe = np.where(sizes > 0, sizes, 1.0)
        return dict(zip(self.held_names, (values / safe).tolist(), strict=True))

    @property
    def named_multipliers(self) -> dict[str, float]:
        """``dE/df`` for each active function and equation."""
        return self.by_name(self.multipliers.values)

    @property
    def named_ranges(self) -> dict[str, tuple[float, float]]:
        """The least and the largest value of each multiplier."""
        lower, upper = map(self.by_name, (self.multipliers.lower, self.multipliers.upper))
        return {name: (lower[name], upper[name]) for name in lower}

    @property
    def open_positions(self) -> list[int]:
        """Positions of active functions whose gap is too large for their multiplier."""
        if not self.multipliers.exist:
            return []
        k = len(self.active)
        away = distances(self.local.values[list(self.active)], self.gradients[:k])
        product = abs(self.multipliers.values[:k] * away)
        return np.flatnonzero(product > OPEN * self.local.small).tolist()

    @property
    def stationary(self) -> bool:
        """Whether the first-order conditions hold, complementarity included."""
        return self.multipliers.exist and not self.open_positions


def analyse(problem: Problem, q: Array, tolerance: float, rank_tolerance: float) -> Analysis:
    """Analyse every piece of the polyhedron at ``q``; return the least favourable analysis.

    Where several pieces meet, a point is a minimum of the union exactly when it is a minimum of
    each of them.
    """
    values, gradients, hessians = problem.evaluate(q, 2)
    local = Local(problem, q, values, gradients, hessians, tolerance, rank_tolerance)
    pieces = local_pieces(problem.polyhedron, values[:-1], gradients[:-1], tolerance)
    if not pieces or not np.isfinite(values[-1]):
        return _without_conditions(local, Verdict.OUTSIDE, "")
    reason = obstacle(problem, q, gradients, hessians, frozenset().union(*pieces))
    if reason:
        return _without_conditions(local, Verdict.NOT_SMOOTH, reason)
    analyses = [_analyse_piece(local, piece) for piece in pieces]
    return min(analyses, key=lambda a: DECISIVE.index(a.verdict))


def _without_conditions(local: Local, verdict: Verdict, reason: str) -> Analysis:
    """Return the analysis of a point at which the conditions cannot be applied."""
    known = (np.where(np.isfinite(x), x, 0.0) for x in (local.gradients, local.hessians))
    gradients, hessians = known
    finite = replace(local, gradients=gradients, hessians=hessians)
    found = _analyse_piece(finite, frozenset())
    return replace(found, verdict=verdict, obstacle=reason, local=local)


def _analyse_piece(local: Local, piece: Piece) -> Analysis:
    active = tuple(sorted(piece))
    k, small = len(active), local.small
    gradients = local.gradients[[*active, *local.sections]]
    rows = Rows(gradients, local.rank_tolerance)
    slope = local.gradients[-1]
    most = 0.1 * float(np.linalg.norm(slope)) / local.rank_tolerance + small
    multipliers = find_multipliers(rows, k, slope, small, most)
    values = multipliers.values[:k]
    strong = [*np.flatnonzero(abs(values) > small).tolist(), *range(k, len(gradients))]
    weak = [active[i] for i in np.flatnonzero(abs(values) <= small)]
    face = rows if len(strong) == len(gradients) else Rows(gradients[strong], local.rank_tolerance)
    hessian = _lagrangian_hessian(local, active, gradients, multipliers)
    small_curvature = local.tolerance * max(local.reference, float(abs(hessian).max()))
    curvature = find_curvature(hessian, face.null_space, local.gradients[weak], small_curvature)
    away = distances(local.values[list(active)], gradients[:k])
    verdict = _verdict(local, rows, away, multipliers, curvature, small_curvature)
    change = 0.0
    if verdict is Verdict.UNDECIDED and curvature.least >= -small_curvature:
        held = frozenset(active[i] for i in strong if i < k)
        change = _flat_change(local, held, curvature.flat, piece)
        verdict = Verdict.MINIMUM_ALONG_LOCUS if change <= PROBE_NOISE else verdict
    elif verdict is Verdict.STRICT_MINIMUM and weak:
        verdict = Verdict.WEAK_MINIMUM
    return Analysis(
        verdict=verdict,
        active=active,
        gradients=gradients,
        multipliers=multipliers,
        independent=rows.independent,
        strong_positions=_independent_positions(rows, np.flatnonzero(values > small), k, local),
        weak=tuple(weak),
        curvature=curvature,
        reference=local.reference,
        small_curvature=small_curvature,
        flat_verified=not curvature.flat.shape[1] or change <= PROBE_NOISE,
        flat_change=change,
        local=local,
    )


def _lagrangian_hessian(
    local: Local, active: tuple[int, ...], rows: Array, multipliers: Multipliers
) -> Array:
    sizes = np.sqrt(np.einsum("ij,ij->i", rows, rows))
    numbers = [*active, *local.sections]
    result: Array = local.hessians[-1].copy()
    for row, value, size in zip(numbers, multipliers.values, sizes, strict=True):
        if size > 0:
            result -= value / size * local.hessians[row]
    return result


def _verdict(
    local: Local,
    rows: Rows,
    away: Array,
    multipliers: Multipliers,
    curvature: Curvature,
    small_curvature: float,
) -> Verdict:
    """Return the verdict before flat directions and weakly active functions are considered."""
    if not multipliers.complementary(away, OPEN * local.small):
        return Verdict.NOT_STATIONARY  # the gap is not rounding: closing it would change the energy
    if not multipliers.exist:
        k = len(away)
        regular = rows.independent
        if not regular and k:
            _, rate = inward_direction(rows.units[:k], rows.units[k:])
            regular = rate > local.rank_tolerance
        return Verdict.NOT_STATIONARY if regular else Verdict.NO_MULTIPLIER
    if curvature.decided and curvature.least < -small_curvature:
        # Other multipliers may prove a minimum where they are not unique.
        return Verdict.SADDLE if multipliers.unique else Verdict.UNDECIDED
    if not curvature.decided or curvature.flat.shape[1]:
        return Verdict.UNDECIDED
    return Verdict.STRICT_MINIMUM


def _flat_change(local: Local, face: Piece, flat: Array, piece: Piece) -> float:
    """Return the relative change of the energy along flat directions and generic mixtures."""
    if not flat.shape[1]:
        return np.inf
    left, singular, _ = np.linalg.svd(flat, full_matrices=False)
    held = left[:, singular > 1e-6 * singular[0]].T
    directions = flat.T
    if flat.shape[1] > 1:
        # Weights without rational relations: no polynomial of low degree vanishes on all mixtures.
        powers = np.sqrt([[2.0], [3.0], [5.0]]) ** np.arange(flat.shape[1])
        mixed = powers @ flat.T
        directions = np.vstack([directions, mixed / np.linalg.norm(mixed, axis=1)[:, None]])
    change = local.problem.probe(face, piece, local.point, directions, held, PROBES)
    return change / (abs(float(local.values[-1])) + local.reference)


def _independent_positions(
    rows: Rows, positive: NDArray[np.int64], k: int, local: Local
) -> tuple[int, ...]:
    """Return positions of strongly active functions with independent gradients, greedily."""
    candidates = positive.tolist()
    if rows.independent:
        return tuple(candidates)
    chosen: list[int] = []
    sections = list(range(k, len(rows.units)))
    reached = rank(rows.units[sections], local.rank_tolerance)
    for i in candidates:
        if rank(rows.units[[*chosen, i, *sections]], local.rank_tolerance) > reached:
            chosen.append(i)
            reached += 1
    return tuple(chosen)


def _entrapment(a: Analysis) -> Iterator[tuple[str, Entrapment]]:
    local, multipliers, curvature, small = a.local, a.multipliers, a.curvature, a.small_curvature
    names = local.problem.polyhedron.names
    for position in a.strong_positions:
        yield names[a.active[position]], Entrapment.HALF_V
    for position, row in enumerate(a.active):
        if multipliers.values[position] < -local.small:
            yield names[row], Entrapment.NONE
    if multipliers.residual > local.small:
        return  # not stationary on the face: its curvature there is no entrapment
    curved = curvature.vectors[:, curvature.values > small]
    held: list[int] = []
    for row in a.weak:
        slopes = local.gradients[[*held, row]] @ curved
        if rank(slopes, 1e-6) > len(held):
            held.append(row)
            yield names[row], Entrapment.HALF_U
    inner = curved @ null_space(local.gradients[held] @ curved, 1e-6) if held else curved
    others = (
        (inner, Entrapment.U),
        (curvature.vectors[:, abs(curvature.values) <= small], Entrapment.FREE),
        (curvature.vectors[:, curvature.values < -small], Entrapment.NONE),
    )
    taken = dict.fromkeys((names[row] for row in a.active), 1)
    for vectors, kind in others:
        for vector in vectors.T:
            label = _direction_name(vector, local.problem.polyhedron.manifold.names)
            taken[label] = taken.get(label, 0) + 1
            yield label if taken[label] == 1 else f"{label} ({taken[label]})", kind


def _direction_name(vector: Array, names: tuple[str, ...]) -> str:
    """Name a direction after the coordinates that change by at least half the largest change."""
    top = abs(vector).max()
    large = [i for i in range(len(vector)) if abs(vector[i]) >= 0.5 * top]
    sign = np.sign(vector[large[0]])
    words = [("+" if vector[i] * sign > 0 else "-") + names[i] for i in large]
    return "".join(words).removeprefix("+")
