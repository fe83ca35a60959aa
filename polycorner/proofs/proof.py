"""Proofs: a certificate's claim, established in interval arithmetic.

Theorem ([NW] thm 12.6; existence by [Krawczyk]).  Let ``q*`` be a point where

1. ``f_i = 0`` for the active inequalities ``A``, ``h_j = 0`` for the equations, and
   ``dE = sum lam_i df_i + sum mu_j dh_j``;
2. ``lam_i > 0`` for every ``i`` in ``A``;
3. the gradients of the active functions and equations are independent;
4. near ``q*`` the set is ``{f_i >= 0 for i in A, h = 0}``: every other inequality is positive
   there or, in a tree with unions, does not change what the tree says;
5. the Hessian of ``E - sum lam_i f_i - sum mu_j h_j`` is positive definite on the vectors that
   all these gradients annihilate.

Then ``q*`` is a strict local minimum of ``E`` on the set.

Modulo symmetry.  Let vector fields ``xi_k`` annihilate ``E``, the active functions and the
equations identically, and let ``n_k`` be normals with the matrix ``n_k xi_l`` regular.  Then 1 is
solved together with ``n_k (q - q0) = 0``, whose multipliers are zero by invariance, and in 3 and 5
the ``n_k`` join the gradients.  The conclusion holds on the section ``n_k (q - q0) = 0``; the flows
of the ``xi_k`` carry every nearby point to the section without changing ``E``, active functions or
equations.  So ``q*`` is a local minimum on the whole set, and nearby points of the same energy are
its images under these flows.  Fields are found, or checked, by exact algebra
(:mod:`~polycorner.proofs.invariance`); nothing about them is assumed.

What is proved is a statement about the functions as they stand: SymPy expressions with exact
numbers, pi and e themselves, and parameters and floating-point constants the dyadic fractions that
they are.  It is a statement in one chart: coordinates of circles are taken as real numbers.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from math import fsum
from typing import TYPE_CHECKING, Any

from polycorner.formulas.functions import SmoothFunction
from polycorner.intervals.balls import between, bounds, decimals, exact, precision
from polycorner.intervals.enclosures import Formulas, Undecided
from polycorner.intervals.tapes import Box
from polycorner.minimisation import Certificate
from polycorner.printing import Printed, Sheet
from polycorner.proofs.arguments import check_domain, check_parameters, check_unchanged, check_whole
from polycorner.proofs.attempt import Attempt, attempt, bits_for
from polycorner.proofs.claims import Posed, pose_claim
from polycorner.proofs.findings import SYMMETRIC, Finding, Status, findings, nowhere, unfounded
from polycorner.proofs.invariance import declared
from polycorner.proofs.krawczyk import Enclosure, widened
from polycorner.proofs.parameter_boxes import (
    CELL_BITS,
    ParameterCell,
    cover,
    summary,
    undecided_cell,
)

if TYPE_CHECKING:
    import sympy

    from polycorner.proofs.arguments import Interval
    from polycorner.proofs.parameter_boxes import Progress

MOST_DIGITS, MOST_CELLS = 10_000, 10_000_000
DOUBLE_DIGITS = 17
Bounds = tuple[Fraction, Fraction]
BOX_DIGITS = 3  # more than those of the enclosures, for the box that contains them


@dataclass(frozen=True, eq=False)
class Proof(Printed):
    """What interval arithmetic says about a certificate; see the module for the theorem.

    Attributes
    ----------
    certificate : Certificate
        The claim.
    digits : int
        Significant digits of the enclosures.
    active : tuple of str
        The active inequalities of the proof; a certificate may list more, within its tolerance.
    symmetry : tuple of str
        Vector fields along which nothing changes, modulo which the minimum is strict.
    conditions : mapping from str to Status
        ``"proved"``, ``"failed"`` (proved to be violated) or ``"undecided"``.
    reasons : mapping from str to str
        Why, for each condition.
    enclosures : mapping from str to (str, str)
        Lower and upper bounds of each coordinate, of ``energy`` and of every ``multiplier NAME``,
        in decimals rounded outwards; empty without an enclosure.  For a box of parameters, over
        all cells that are proved.
    box : mapping from str to (str, str)
        In this box of coordinates and multipliers the KKT equations (on the section of the
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
        """Whether every condition is proved, for all parameters asked for."""
        return all(status is Status.PROVED for status in self.conditions.values())

    @property
    def proved_fraction(self) -> float:
        """The proved part of the box of parameters; 1 or 0 without one."""
        if not self.cells:
            return float(self.proved)
        done = fsum(cell.volume for cell in self.cells if cell.status is Status.PROVED)
        return 1.0 if self.proved else done / fsum(cell.volume for cell in self.cells)

    @property
    def undecided(self) -> tuple[ParameterCell, ...]:
        """The cells that are left undecided."""
        return tuple(cell for cell in self.cells if cell.status is Status.UNDECIDED)

    def enclose(self, expression: "SmoothFunction | sympy.Expr") -> tuple[str, str]:
        """Return decimal bounds of a function of the coordinates at the enclosed point.

        Over a box of parameters the bounds hold for all cells that are proved.

        Raises
        ------
        ValueError
            If nothing is enclosed, or the function is not bounded on the enclosure.

        Examples
        --------
        >>> from polycorner import Manifold, Polyhedron, certify
        >>> M = Manifold.euclidean("x")
        >>> (x,) = M.symbols
        >>> prove(certify(Polyhedron(M, {"wall": x**2 - 2}), x, [2**0.5]), digits=9).enclose(x**2)
        ('1.99999999', '2.00000001')
        """
        manifold = self.certificate.problem.polyhedron.manifold
        f = expression
        if not isinstance(f, SmoothFunction):
            f = SmoothFunction("expression", f, manifold)
        formulas = Formulas([f], manifold)
        proved = [cell for cell in self.cells if cell.status is Status.PROVED]
        regions: list[Any] = [self.region] if self.region else []
        regions += [[cell.bounds[name] for name in manifold.names] for cell in proved]
        if not regions:
            msg = "enclose: expected a proof with an enclosed point; this one has none"
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
        """Return whether it is proved, and which conditions are not."""
        from polycorner.proofs.report import proof_line

        return proof_line(self)

    def _sheet(self) -> Sheet:
        from polycorner.proofs.report import proof_sheet

        return proof_sheet(self)


def prove(
    certificate: Certificate,
    *,
    digits: int = 30,
    parameters: "Mapping[str, Interval] | None" = None,
    symmetry: Iterable[Any] = (),
    max_cells: int = 5000,
    progress: "Progress | None" = None,
) -> Proof:
    """Establish in interval arithmetic that a certificate's point is a strict local minimum.

    Parameters
    ----------
    certificate : Certificate
        The claim; the exact point is looked for within ``1e-3`` scale units of its point.
    digits : int, optional
        Significant digits of the enclosures, 1 to 10000; default 30.
    parameters : mapping from str to (float, float), optional
        Prove it for a whole box of these parameters of the functions at once.  A parameter keeps
        its meaning as it stands in the formulas: where one is computed from another beforehand,
        only the one that is named moves.
    symmetry : iterable of vector fields, optional
        Fields along which nothing changes, besides translations, which are found without being
        declared.  Each is a mapping from coordinate names to components, or a sequence of ``n``;
        components are numbers, SymPy expressions or SmoothFunctions.  They are checked.
    max_cells : int, optional
        Into how many cells a box of parameters may be cut.
    progress : callable, optional
        Called with the decided fraction of the box of parameters.

    Returns
    -------
    Proof
        Always; its conditions say what is proved, what is violated and what remains undecided.

    Raises
    ------
    TypeError, ValueError
        For arguments of the wrong kind, a problem that was changed after certification, or a
        function that ball arithmetic does not know.

    Examples
    --------
    >>> from polycorner import Manifold, Polyhedron, minimise
    >>> M = Manifold.euclidean("x y")
    >>> x, y = M.symbols
    >>> D = Polyhedron(M, {"bowl": y - x**2, "lid": 2 - y})
    >>> p = prove(minimise(D, x + y, [1.0, 1.5]), digits=8)
    >>> p.proved, p.enclosures["multiplier bowl"]
    (True, ('1.0000000', '1.0000000'))
    """
    if not isinstance(certificate, Certificate):
        msg = f"certificate: expected a Certificate; got {type(certificate).__name__}"
        raise TypeError(msg)
    check_whole("digits", digits, MOST_DIGITS)
    check_whole("max_cells", max_cells, MOST_CELLS)
    problem = certificate.problem
    d = problem.polyhedron
    fields = declared(d.manifold, symmetry)
    sides, values = check_parameters(problem, parameters)
    functions = (*d.functions, *d.equations, problem.energy)
    formulas = Formulas(functions, d.manifold)
    check_unchanged(certificate, formulas)
    tried = attempt(certificate, fields, formulas, DOUBLE_DIGITS if sides else digits)
    if not sides:
        return _one(certificate, tried, digits)
    moving = Formulas(functions, d.manifold, tuple(sides))
    check_domain(moving, sides)
    posed = pose_claim(certificate, tried.face, fields, moving, values)
    if isinstance(posed, Undecided):
        cells: tuple[ParameterCell, ...] = (undecided_cell(sides, posed),)
    else:
        cells = cover(
            posed.claim, posed.start, values, sides, max_cells=max_cells, progress=progress
        )
    return _many(certificate, replace(tried, posed=posed), sides, cells, digits)


def _one(certificate: Certificate, tried: Attempt, digits: int) -> Proof:
    """Return the proof at one point."""
    d = certificate.problem.polyhedron
    active = tuple(d.names[i] for i in tried.face)
    posed, enclosure = tried.posed, tried.enclosure
    if isinstance(posed, Undecided):
        return _proof(certificate, digits, active, (), nowhere(posed))
    symmetry = tuple(map(str, posed.claim.fields))
    if isinstance(enclosure, Undecided):
        found = unfounded(posed.claim, enclosure)
        return _proof(certificate, digits, active, symmetry, _refused(found, posed))
    with precision(tried.bits):
        found = _refused(findings(posed.claim, enclosure), posed)
        values = [bounds(x) for x in enclosure.solution]
        energy = bounds(enclosure.linear.energy)
    named = _named(posed, values)
    sides = {name: named[name] for name in d.manifold.names} | {"energy": energy} | named
    box = _named(posed, _alone(enclosure))
    return replace(
        _proof(certificate, digits, active, symmetry, found),
        enclosures={name: decimals(*side, digits) for name, side in sides.items()},
        box={
            name: decimals(*side, digits + BOX_DIGITS, inwards=True) for name, side in box.items()
        },
        region=tuple(values[: d.dimension]),
    )


def _alone(enclosure: Enclosure) -> list[Bounds]:
    """Return a box of the unknowns in which the solution is the only one."""
    with precision(CELL_BITS):
        room = widened(enclosure)
    middle = [exact(x.mid()) for x in enclosure.predictor.centre]
    radii = [exact(w.rad()) for w in room]
    return [(m - r, m + r) for m, r in zip(middle, radii, strict=True)]


def _named(posed: Posed, unknowns: list[Bounds]) -> dict[str, Bounds]:
    """Return what belongs to the coordinates and the multipliers, by name."""
    coordinates = posed.claim.problem.polyhedron.manifold.names
    names = (*coordinates, *(f"multiplier {name}" for name in posed.claim.names))
    return dict(zip(names, unknowns, strict=False))


def _refused(found: dict[str, Finding], posed: Posed) -> dict[str, Finding]:
    """Add what is wrong with a declared symmetry."""
    return found if posed.refused is None else found | {SYMMETRIC: posed.refused}


def _proof(
    certificate: Certificate,
    digits: int,
    active: tuple[str, ...],
    symmetry: tuple[str, ...],
    found: Mapping[str, Finding],
) -> Proof:
    return Proof(
        certificate,
        digits,
        active,
        symmetry,
        conditions={name: finding.status for name, finding in found.items()},
        reasons={name: finding.reason for name, finding in found.items()},
        enclosures={},
        box={},
    )


def _many(
    certificate: Certificate,
    tried: Attempt,
    sides: "dict[str, Interval]",
    cells: tuple[ParameterCell, ...],
    digits: int,
) -> Proof:
    """Return the proof for a box of parameters."""
    found, posed = summary(cells), tried.posed
    symmetry: tuple[str, ...] = ()
    if not isinstance(posed, Undecided):
        found, symmetry = _refused(found, posed), tuple(map(str, posed.claim.fields))
    active = tuple(certificate.problem.polyhedron.names[i] for i in tried.face)
    proved = [cell.bounds for cell in cells if cell.status is Status.PROVED]
    hulls = {
        name: (Fraction(min(b[name][0] for b in proved)), Fraction(max(b[name][1] for b in proved)))
        for name in (proved[0] if proved else ())
    }
    return replace(
        _proof(certificate, digits, active, symmetry, found),
        enclosures={
            name: decimals(*side, min(digits, DOUBLE_DIGITS)) for name, side in hulls.items()
        },
        parameters=sides,
        cells=cells,
    )
