"""What an analysis of the optimality conditions at a point has found."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Literal, TypeVar

import numpy as np

from polycorner.minimisation.conditions import Curvature, Multipliers
from polycorner.minimisation.degeneracy import Decision
from polycorner.minimisation.problem import Problem
from polycorner.minimisation.verdicts import Entrapment, Verdict
from polycorner.polyhedra.cones import null_space, rank
from polycorner.polyhedra.strata import distances
from polycorner.spaces.manifold import Array
from polycorner.tolerances import Tolerances
from polycorner.values import Value, cached_property

T = TypeVar("T")
Higher = Literal["series", "followed", "none"]  # how orders beyond the second are seen
OPEN = 10  # a product of multiplier and gap beyond so many tolerances is not rounding


@dataclass(frozen=True, eq=False)
class Local(Value):
    """Derivatives at a point, in scaled coordinates, and the tolerances in force there."""

    problem: Problem
    point: Array
    values: Array
    gradients: Array
    hessians: Array
    tolerances: Tolerances
    higher: Higher = "series"

    @cached_property
    def reference(self) -> float:
        """The size of the energy: its largest first or second derivative in scaled coordinates."""
        return float(max(abs(self.gradients[-1]).max(), abs(self.hessians[-1]).max())) or 1.0

    @property
    def small(self) -> float:
        """The size up to which a first derivative counts as zero."""
        return self.tolerances.stationary * self.reference

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
    blind : tuple of int
        Positions of functions whose gradients vanish; the analysis is without them.
    curvature : Curvature
        The second-order condition.
    reference : float
        The size of the energy; see :attr:`Local.reference`.
    small_curvature : float
        Curvature that counts as zero.
    decision : Decision or None
        What higher orders decide where the second order vanishes.
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
    blind: tuple[int, ...]
    curvature: Curvature
    reference: float
    small_curvature: float
    decision: Decision | None
    local: Local
    obstacle: str = ""

    @property
    def signature(self) -> tuple[int, int, int]:
        """The lemma's ``(p, q, r)``."""
        values = self.curvature.values
        free = int((abs(values) <= self.small_curvature).sum())
        return len(self.strong_positions), len(values) - free, free

    @property
    def flat_verified(self) -> bool:
        """Whether the energy is constant wherever the second order vanishes."""
        if not self.curvature.flat.shape[1]:
            return True
        followed = self.decision.followed if self.decision is not None else None
        return followed is not None and followed.holds

    @property
    def flat_change(self) -> float:
        """Its largest relative change there; infinite where directions were not followed."""
        if not self.curvature.flat.shape[1]:
            return 0.0
        followed = self.decision.followed if self.decision is not None else None
        return followed.change if followed is not None and followed.followed else np.inf

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

    def stated(self, by_name: Mapping[str, T]) -> dict[str, T]:
        """Return the entries but those of the equations that normalise vectors."""
        return self.local.problem.stated(by_name)

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
        if rank(slopes, local.tolerances.rank) > len(held):
            held.append(row)
            yield names[row], Entrapment.HALF_U
    inner = curved
    if held:
        inner = curved @ null_space(local.gradients[held] @ curved, local.tolerances.rank)
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
