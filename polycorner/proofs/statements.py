"""Claims of minima, their enclosed solutions, and the status of a condition."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

from polycorner.intervals.balls import bounds, decimals
from polycorner.minimisation import Problem
from polycorner.proofs.exact import ExactPoint, implied, recognised
from polycorner.proofs.invariance import Generator
from polycorner.proofs.kkt import KKTSystem
from polycorner.proofs.krawczyk import Enclosure
from polycorner.values import cached_property

if TYPE_CHECKING:
    from polycorner.intervals.balls import Ball


class Status(StrEnum):
    """Status of a condition in a proof.

    It is proved, or failed (proved to be violated, so that the enclosed point is no minimum), at
    the point or for all parameters of a cell; or undecided.  Over a box of parameters a condition
    that is violated on some cells, not on all, failed in part.
    """

    PROVED = "proved"
    FAILED = "failed"
    PARTLY = "failed in part"
    UNDECIDED = "undecided"


@dataclass(frozen=True)
class ConditionResult:
    """Status of a condition, and the reason."""

    status: Status
    reason: str


def proved(reason: str) -> ConditionResult:
    """Return the result of a condition that holds."""
    return ConditionResult(Status.PROVED, reason)


def failed(reason: str) -> ConditionResult:
    """Return the result of a condition that is violated."""
    return ConditionResult(Status.FAILED, reason)


def undecided(reason: str) -> ConditionResult:
    """Return the result of a condition that is open."""
    return ConditionResult(Status.UNDECIDED, reason)


@dataclass(frozen=True, eq=False)
class Claim:
    """The claim that a face carries a minimum: its KKT system, modulo symmetries.

    Attributes
    ----------
    problem : Problem
        The polyhedron and the energy.
    system : KKTSystem
        The KKT equations of the face.
    fields : tuple of Generator
        One for every gauge of the system.
    """

    problem: Problem
    system: KKTSystem
    fields: tuple[Generator, ...]

    @property
    def active(self) -> tuple[int, ...]:
        """Rows of the active inequalities."""
        return tuple(i for i in self.system.held if i < self.problem.inequalities)

    @property
    def others(self) -> tuple[int, ...]:
        """Rows of the inequalities and equations that the system does not hold."""
        return tuple(i for i in range(self.problem.rows - 1) if i not in self.system.held)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the active inequalities, then of the equations."""
        return self.named(self.system.held)

    @property
    def stated(self) -> tuple[str, ...]:
        """These names but those of equations that normalise vectors and quaternions."""
        return tuple(name for name in self.names if name not in self.problem.polyhedron.hidden)

    def named(self, rows: Sequence[int]) -> tuple[str, ...]:
        """Return the names of some rows."""
        d = self.problem.polyhedron
        names = (*d.names, *d.equation_names)
        return tuple(names[i] for i in rows)

    def implied(self, row: int) -> bool:
        """Whether a function vanishes wherever those of the system do."""
        if row not in self._implied:
            self._implied[row] = implied(self.system.formulas, self.system.held, row)
        return self._implied[row]

    @cached_property
    def _implied(self) -> dict[int, bool]:
        return {}


@dataclass(frozen=True, eq=False)
class Solved:
    """A claim and the enclosure of its solution, with the zeros that algebra shows there."""

    claim: Claim
    enclosure: Enclosure

    @cached_property
    def exactly(self) -> ExactPoint | None:
        """The solution, where it is recognised."""
        return recognised(self.enclosure)

    @cached_property
    def weak(self) -> tuple[int, ...]:
        """Positions of the inequalities held whose multipliers are shown to be 0."""
        n, k = self.claim.system.dimension, len(self.claim.active)
        values = self.enclosure.solution[n : n + k]
        open_ones = [i for i, value in enumerate(values) if value.contains(0)]
        if not open_ones or self.exactly is None:
            return ()
        unknowns = self.exactly.unknowns[n:]
        return tuple(i for i in open_ones if not unknowns[i])

    def vanishes(self, row: int) -> bool:
        """Whether a function that is defined at the solution is shown to be 0 there."""
        formulas = self.claim.system.formulas
        known = self.exactly is not None and self.exactly.vanishes(formulas, row)
        return known or self.claim.implied(row)


def shown(number: "Ball", digits: int = 3) -> str:
    """Return a ball as a short interval of decimals."""
    if not number.is_finite():
        return "(-inf, inf)"
    lower, upper = decimals(*bounds(number), digits)
    return f"[{lower}, {upper}]"
