"""Proofs of local minima: conditions, enclosures and what is left undecided."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from math import fsum
from typing import TYPE_CHECKING, Any

from polycorner.formulas.functions import SmoothFunction
from polycorner.intervals.balls import between, bounds, decimals, precision
from polycorner.intervals.enclosures import Formulas
from polycorner.intervals.tapes import Box
from polycorner.kinds import checked
from polycorner.minimisation import Certificate
from polycorner.printing import Printed, Sheet, Table, facts, titled, units
from polycorner.proofs.attempt import bits_for
from polycorner.proofs.parameter_boxes import Interval, ParameterCell, shown_box
from polycorner.proofs.statements import Status
from polycorner.values import Checked

if TYPE_CHECKING:
    import sympy

DOUBLE_DIGITS = 17  # of a floating-point number, which bounds over a box of parameters are
SHOWN_CELLS = 5  # undecided cells listed in a table
Bounds = tuple[Fraction, Fraction]


@dataclass(frozen=True, eq=False)
class Proof(Checked, Printed):
    """Result of the verification of a certificate in interval arithmetic.

    Attributes
    ----------
    certificate : Certificate
        The certificate to be proved.
    digits : int
        Significant digits of the enclosures.
    active : tuple of str
        The active inequalities of the proof; a certificate may have more, within its tolerance.
    symmetry : tuple of str
        Vector fields along which energy and active functions are constant; the minimum is strict
        modulo their flows.
    conditions : mapping from str to Status
        ``"proved"``, ``"failed"`` (proved to be violated) or ``"undecided"``; over a box of
        parameters also ``"failed in part"``.
    reasons : mapping from str to str
        The reason for each status.
    enclosures : mapping from str to (str, str)
        Lower and upper bounds of each coordinate, of ``energy`` and of every ``multiplier NAME``,
        in decimals rounded outwards; empty without an enclosure.  For a box of parameters, over
        all cells that are proved.
    box : mapping from str to (str, str)
        A box of coordinates and multipliers in which the KKT equations (on the section of the
        symmetries) have exactly one solution; empty for a box of parameters.
    parameters : mapping from str to (float, float)
        The box of parameters, or empty.
    cells : tuple of ParameterCell
        Its parts, each proved, failed or undecided.
    region : tuple of (Fraction, Fraction)
        Exact bounds of the coordinates, without parameters.
    """

    certificate: Certificate
    digits: int
    active: tuple[str, ...]
    symmetry: tuple[str, ...]
    conditions: Mapping[str, Status]
    reasons: Mapping[str, str]
    enclosures: Mapping[str, tuple[str, str]]
    box: Mapping[str, tuple[str, str]]
    parameters: "Mapping[str, Interval]" = field(default_factory=dict)
    cells: tuple[ParameterCell, ...] = ()
    region: tuple[Bounds, ...] = field(default=(), repr=False)

    @property
    def proved(self) -> bool:
        """Whether every condition is proved, for all parameters of the box."""
        return all(status is Status.PROVED for status in self.conditions.values())

    @property
    def proved_fraction(self) -> float:
        """The proved part of the box of parameters; 1 or 0 without one."""
        if not self.cells:
            return float(self.proved)
        return 1.0 if self.proved else self._share(Status.PROVED)

    @property
    def failed_fraction(self) -> float:
        """The part of the box of parameters on which a condition is violated; 1 or 0 without."""
        if not self.cells:
            return float(Status.FAILED in self.conditions.values())
        return self._share(Status.FAILED)

    def _share(self, status: Status) -> float:
        done = fsum(cell.volume for cell in self.cells if cell.status is status)
        return done / fsum(cell.volume for cell in self.cells)

    @property
    def failed(self) -> tuple[ParameterCell, ...]:
        """The cells on the whole of which a condition is violated."""
        return tuple(cell for cell in self.cells if cell.status is Status.FAILED)

    @property
    def undecided(self) -> tuple[ParameterCell, ...]:
        """The undecided cells."""
        return tuple(cell for cell in self.cells if cell.status is Status.UNDECIDED)

    @checked
    def enclose(self, expression: "SmoothFunction | sympy.Expr") -> tuple[str, str]:
        """Return decimal bounds of a function of the coordinates at the enclosed point.

        Over a box of parameters the bounds hold for all cells that are proved.

        Raises
        ------
        ValueError
            If no point is enclosed, or the function is not bounded on the enclosure.

        Examples
        --------
        >>> from polycorner import Manifold, Polyhedron, certify, prove
        >>> M = Manifold.euclidean("x")
        >>> (x,) = M.symbols
        >>> proof = prove(certify(Polyhedron(M, {"wall": x**2 - 2}), x, [2**0.5]), digits=9)
        >>> proof.enclose(x**2)
        ('1.99999999', '2.00000001')
        """
        manifold = self.certificate.problem.polyhedron.manifold
        f = expression
        if not isinstance(f, SmoothFunction):
            f = SmoothFunction.quantity("expression", f, manifold)
        formulas = Formulas([f], manifold)
        proved = [cell for cell in self.cells if cell.status is Status.PROVED]
        regions: list[Any] = [self.region] if self.region else []
        regions += [[cell.bounds[name] for name in manifold.names] for cell in proved]
        if not regions:
            msg = "enclose: expected a proof with an enclosed point; got one without"
            raise ValueError(msg)
        found: list[Fraction] = []
        with precision(bits_for(self.digits)):
            for region in regions:
                (value,) = formulas.values(Box([between(*side) for side in region]), [0])
                if not value.is_finite():
                    msg = f"{f.name}: expected a function that is bounded on the enclosure; got {f}"
                    raise ValueError(msg)
                found += bounds(value)
        digits = min(self.digits, DOUBLE_DIGITS) if self.cells else self.digits
        return decimals(min(found), max(found), digits)

    def __repr__(self) -> str:
        """Return whether it is proved, and the status of every condition if not."""
        left = ", ".join(f"{name} {status}" for name, status in self.conditions.items())
        return "Proof(proved)" if self.proved else f"Proof(not proved: {left})"

    def _sheet(self) -> Sheet:
        """Return tables of the conditions and the enclosures."""
        modulo = f", modulo {'; '.join(self.symmetry)}" if self.symmetry else ""
        verdict = f"strict local minimum{modulo}: proved" if self.proved else "not proved"
        manifold = self.certificate.problem.polyhedron.manifold
        periods = dict(zip(manifold.names, manifold.periods, strict=True))
        enclosures = tuple(
            (titled(name, periods.get(name, math.inf)), *sides)
            for name, sides in self.enclosures.items()
        )
        return Sheet(
            "Proof",
            (
                facts(
                    (
                        ("verdict", verdict),
                        ("active", ", ".join(self.active) or "none"),
                        *((k, f"{v}: {self.reasons[k]}") for k, v in self.conditions.items()),
                        *self._parameter_facts(),
                    )
                ),
                Table(("enclosed", "lower bound", "upper bound"), enclosures, (1, 2)),
                units(manifold.periods) if self.enclosures else "",
            ),
        )

    def _parameter_facts(self) -> Iterator[tuple[str, str]]:
        if not self.parameters:
            return
        shares = f"{100 * self.proved_fraction:.6g} % proved"
        if self.failed:
            shares += f", {100 * self.failed_fraction:.6g} % violated"
        yield "parameters", f"{shown_box(self.parameters)}: {shares}, {len(self.cells)} cells"
        for cell in self.undecided[:SHOWN_CELLS]:
            yield "undecided", f"{shown_box(cell.parameters)}: {cell.reason}"
        if len(self.undecided) > SHOWN_CELLS:
            yield "undecided", f"and {len(self.undecided) - SHOWN_CELLS} more cells"
