"""Proofs as values: what is proved, with its evidence, in words, tables and files."""

import math
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from math import fsum
from pathlib import Path
from typing import TYPE_CHECKING, Any

from polycorner import checks
from polycorner.formulas.functions import SmoothFunction
from polycorner.intervals.balls import (
    between,
    bits_for,
    bounds,
    decimals,
    precision,
)
from polycorner.intervals.enclosures import Formulas, Undecided
from polycorner.intervals.tapes import Box
from polycorner.kinds import checked
from polycorner.minimisation import Certificate
from polycorner.printing import Printed, Sheet, Table, facts, titled, units
from polycorner.proofs.bounded import BoundedMinimum
from polycorner.proofs.bounded_search import bounded_minimum
from polycorner.proofs.files import ProvedFace, UncheckedError, save_cells, save_face, save_minimum
from polycorner.proofs.hypotheses import Status
from polycorner.proofs.parameter_boxes import (
    CHECK_BITS,
    Interval,
    ParameterCell,
    shown_box,
)
from polycorner.values import Checked

if TYPE_CHECKING:
    import sympy

DOUBLE_DIGITS = 17  # of a floating-point number, which bounds over a box of parameters are
SHOWN_CELLS = 5  # undecided cells listed in a table
SHOWN_FUNCTIONS = 3  # of those that the given point violates
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
        symmetries) have exactly one solution; with the second statement, of coordinates within
        which every stationary point lies in the enclosure.  Empty for a box of parameters.
    parameters : mapping from str to (float, float)
        The box of parameters, or empty.
    cells : tuple of ParameterCell
        Its parts, each proved, failed or undecided.
    region : tuple of (Fraction, Fraction)
        Exact bounds of the coordinates, without parameters.
    minimum : BoundedMinimum or None
        What a second statement says, where the first, that the point solves the KKT equations and
        is a strict minimum, is not shown: see :attr:`statement`.
    room : mapping from str to (str, str)
        Bounds of the coordinates that rattle, which neither the energy nor the active functions
        read, in decimals rounded inwards.  With any values of them in this box the others are a
        minimum as proved.
    outside : mapping from str to str
        Functions that are negative at the certificate's point itself, as the exact number that its
        floating-point coordinates are, and equations that do not vanish there, with their values;
        empty where it lies in the set.  What is proved concerns a point beside it;
        :func:`~polycorner.proofs.exact_point` repairs such points.
    face : ProvedFace or None
        What the first statement is saved with.
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
    minimum: BoundedMinimum | None = field(default=None, repr=False)
    room: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    outside: Mapping[str, str] = field(default_factory=dict, repr=False)
    face: ProvedFace | None = field(default=None, repr=False)

    @property
    def statement(self) -> str:
        """What is proved if all conditions are, in words.

        A *strict local minimum*, at the enclosed point; or, where contacts are more than enclosures
        can show to close, *a local minimum in the enclosed box, with an energy between the bounds*:
        that there is one, perhaps not only one (:mod:`polycorner.proofs.bounded`).
        """
        modulo = f", modulo {'; '.join(self.symmetry)}" if self.symmetry else ""
        if self.minimum is None:
            return f"strict local minimum{modulo}"
        names = self.certificate.problem.polyhedron.manifold.names
        loose = ", ".join(names[j] for j in self.minimum.rattling)
        free = f", for all values of {loose} in their room" if loose else ""
        if self.minimum.strict:
            return f"strict local minimum{modulo}{free}"
        return (
            f"a local minimum in the enclosed box, with an energy between the bounds{modulo}{free}"
        )

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

    @checked
    def save(self, path: str | os.PathLike[str]) -> Path:
        """Save what is proved, with its evidence, for an independent checker; return the path.

        The checker is run first.  It does less algebra than :func:`prove`: where it does not follow
        the proof of a strict minimum, one of a minimum between two energies is sought.

        See :mod:`polycorner.proofs.files` and :mod:`polycorner.proofs.checker`.

        Raises
        ------
        ValueError
            If a condition is not proved, if the checker follows neither proof, or if the name does
            not end in ``.zip``.
        OSError
            If the file could not be written.
        """
        if not self.proved:
            checks.refuse("save", "a proof of which all conditions are proved", self)
        problem, bits = self.certificate.problem, bits_for(self.digits)
        with precision(bits):
            manifold, free = problem.polyhedron.manifold, tuple(self.parameters)
            formulas = Formulas(problem.functions, manifold, free)
            try:
                if self.minimum is not None:
                    return save_minimum(path, problem, formulas, self.minimum.witness, bits)
                assert self.face is not None
                if free:
                    some = self.face, self.parameters, self.cells
                    return save_cells(path, problem, formulas, *some, CHECK_BITS)
                return save_face(path, problem, formulas, self.face, bits)
            except UncheckedError as error:
                found = None if free else self._between(formulas)
                if found is None:
                    msg = f"save: expected a proof that the checker follows; it says: {error}"
                    raise ValueError(msg) from None
                return save_minimum(path, problem, formulas, found.witness, bits)

    def _between(self, formulas: Formulas) -> BoundedMinimum | None:
        """Return a minimum between two energies at the same point, if one is found."""
        c = self.certificate
        fields = [gauge.field for gauge in (self.face.gauges if self.face else ())]
        found = bounded_minimum(c.problem, formulas, c.point, fields, c.tolerances, self.digits)
        return None if self.minimum or isinstance(found, Undecided) else found

    def __repr__(self) -> str:
        """Return whether it is proved, and the status of every condition if not."""
        left = ", ".join(f"{name} {status}" for name, status in self.conditions.items())
        return "Proof(proved)" if self.proved else f"Proof(not proved: {left})"

    def _sheet(self) -> Sheet:
        """Return tables of the conditions and the enclosures."""
        verdict = f"{self.statement}: proved" if self.proved else "not proved"
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
                        *self._outside_facts(),
                        ("active", ", ".join(self.active) or "none"),
                        *((k, f"{v}: {self.reasons[k]}") for k, v in self.conditions.items()),
                        *self._parameter_facts(),
                    )
                ),
                Table(("enclosed", "lower bound", "upper bound"), enclosures, (1, 2)),
                units(manifold.periods) if self.enclosures else "",
            ),
        )

    def _outside_facts(self) -> Iterator[tuple[str, str]]:
        worst = sorted(self.outside.items(), key=lambda item: -abs(float(item[1])))
        if worst:
            most = ", ".join(f"{name} is {value}" for name, value in worst[:SHOWN_FUNCTIONS])
            more = f" and {len(worst) - SHOWN_FUNCTIONS} more" if worst[SHOWN_FUNCTIONS:] else ""
            yield "starting point", f"rounded to doubles, it is not in the set: {most}{more}"

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
