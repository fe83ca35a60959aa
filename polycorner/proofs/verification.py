"""Verification of certificates in interval arithmetic.

Theorem ([NW] thm 12.6; existence by [Krawczyk]).  Let ``q*`` be a point where

1. ``f_i = 0`` for active inequalities ``A``, ``h_j = 0`` for equations ``B``, and
   ``dE = sum lam_i df_i + sum mu_j dh_j``;
2. ``lam_i > 0`` for every ``i`` in ``A``, or exactly 0: then ``i`` is weakly active;
3. the gradients of these functions and equations are independent;
4. ``q*`` is in the set and near ``q*`` the set is part of ``{f_i >= 0 for i in A, h_j = 0 for j in
   B}``: every other inequality is positive there or exactly 0, every other equation holds
   exactly and, in a tree with unions, every branch that holds near ``q*`` asks for all of ``A``;
5. the Hessian of ``E - sum lam_i f_i - sum mu_j h_j`` is positive definite on the vectors that
   all these gradients annihilate; or it is positive on the critical cone, the vectors that those
   of strong functions and equations annihilate and along which no weakly active function
   decreases: those of ``A``, and in a set without unions or symmetries all that are exactly 0.

Then ``q*`` is a strict local minimum of ``E`` on the larger set, hence on the set.  Redundant and
weakly active contacts and dependent equations are those that ``A`` and ``B`` leave out; that they
are exactly 0 is shown by algebra (:mod:`~polycorner.proofs.exact`).

Modulo symmetry.  Let vector fields ``xi_k`` annihilate ``E``, the active functions and the
equations identically, and let ``n_k`` be normals with the matrix ``n_k xi_l`` regular.  Then 1 is
solved together with ``n_k (q - q0) = 0``, whose multipliers are zero by invariance, and in 3 and 5
the ``n_k`` join the gradients.  The conclusion holds on the section ``n_k (q - q0) = 0``; the flows
of the ``xi_k`` carry every nearby point to the section without changing ``E``, active functions or
equations.  So ``q*`` is a local minimum on the whole set, and nearby points of the same energy are
its images under these flows.  Fields are found, or checked, by exact algebra
(:mod:`~polycorner.proofs.invariance`); nothing is assumed of them.

The statement proved concerns the functions as given: SymPy expressions with exact numbers, pi and
e, in which parameters and floating-point constants stand for the dyadic fractions they represent.
It is a statement in one chart: coordinates of circles are taken as real numbers.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from fractions import Fraction

from polycorner import checks
from polycorner.intervals.balls import (
    MOST_DIGITS,
    balls,
    between,
    bounds,
    decimals,
    exact,
    precision,
)
from polycorner.intervals.enclosures import Formulas, Undecided
from polycorner.intervals.tapes import Box
from polycorner.kinds import checked
from polycorner.minimisation import Certificate, Verdict
from polycorner.polyhedra.symmetry import Symmetry
from polycorner.progress import Progress, silent
from polycorner.proofs.attempt import Attempt, Posed, attempt, pose_claim
from polycorner.proofs.bounded import SUBJECT
from polycorner.proofs.bounded_search import SIMPLE, bounded_minimum
from polycorner.proofs.files import ProvedFace
from polycorner.proofs.hypotheses import SYMMETRIC, ConditionResult, Status
from polycorner.proofs.invariance import Generator, generators
from polycorner.proofs.kkt import FIRST_BITS, Enclosure, widened
from polycorner.proofs.parameter_boxes import (
    CELL_BITS,
    Interval,
    ParameterCell,
    check_domain,
    check_parameters,
    check_unchanged,
    cover,
    summary,
    undecided_cell,
)
from polycorner.proofs.proof import DOUBLE_DIGITS, Bounds, Proof
from polycorner.proofs.rattlers import Rattlers, reads
from polycorner.proofs.witnesses import Gauge

SHOWN_DIGITS = 3  # of what the given point violates
MOST_CELLS = 10_000_000
LARGE = 20  # coordinates from which on faces of a corner with too many contacts are tried last
MANY = (
    "more contacts close than a choice of them shows; such corners are proved for given parameters"
)
ROOM, ROOM_DIGITS = "room", 6
BOX_DIGITS = 3  # digits beyond those of the enclosures, for the box that contains them


@checked
def prove(
    certificate: Certificate,
    *,
    digits: int = 30,
    parameters: Mapping[str, Interval] | None = None,
    symmetry: Symmetry | None = None,
    max_cells: int = 5000,
    progress: Progress = silent,
) -> Proof:
    """Prove in interval arithmetic that a certificate's point is a strict local minimum.

    Or, at a corner with more contacts than enclosures can show to close, that there is a local
    minimum in a tiny box; :attr:`Proof.statement` says which of both is proved.

    Parameters
    ----------
    certificate : Certificate
        The claim; the exact minimum is sought within ``1e-3`` scale units of its point, or
        ``1e-3 (tolerance / 1e-8)**(3/8)`` for a certificate with another tolerance.
    digits : int, optional
        Significant digits of the enclosures, 1 to 10000; default 30.
    parameters : mapping from str to (float, float), optional
        A box of parameters of the functions, for all of which the minimum is to be proved.  Only
        the named parameters vary: one computed from them beforehand stays as it is.
    symmetry : Symmetry, optional
        Symmetry modulo which the minimum is strict.  Its ``fields`` are checked by exact algebra;
        translations are found without being declared.
    max_cells : int, optional
        Largest number of cells into which a box of parameters is divided.
    progress : callable, optional
        Called with the decided fraction of the box of parameters, 1, and the number of cells in
        words; see :class:`~polycorner.progress.Progress`.

    Returns
    -------
    Proof
        Its conditions tell what is proved, what is violated and what remains undecided.

    Notes
    -----
    The working precision belongs to the process: proofs in several threads take turns, proofs in
    several processes run side by side.  The result does not depend on either.

    Without parameters, the precision is doubled up to three times while a condition is undecided:
    from the digits asked for and 64 binary digits more to about ten times as many.

    Raises
    ------
    TypeError, ValueError
        For arguments of the wrong kind, a problem that was changed after certification, or a
        function that is not available in ball arithmetic.

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
    checks.whole("digits", digits, least=1, most=MOST_DIGITS)
    checks.whole("max_cells", max_cells, least=1, most=MOST_CELLS)
    problem = certificate.problem
    d = problem.polyhedron
    fields = generators(d.manifold, symmetry.fields if symmetry else ())
    sides, values = check_parameters(problem, parameters)
    functions = (*d.functions, *d.equations, problem.energy)
    with precision(FIRST_BITS):
        formulas = Formulas(functions, d.manifold)
        check_unchanged(certificate, formulas)
        if not sides:
            found = _at_once(certificate, fields, formulas, digits)
            return replace(found, outside=_outside(certificate, formulas))
        tried = attempt(certificate, fields, formulas, DOUBLE_DIGITS)
        moving = Formulas(functions, d.manifold, tuple(sides))
        check_domain(moving, sides)
        posed = pose_claim(certificate, tried.face, fields, moving, values)
        if not (certificate.analysis.independent or tried.settled):
            posed = Undecided(SUBJECT, MANY)
    if isinstance(posed, Undecided):
        cells: tuple[ParameterCell, ...] = (undecided_cell(sides, posed),)
    else:
        cells = cover(
            posed.claim, posed.start, values, sides, max_cells=max_cells, progress=progress
        )
    return _many(certificate, replace(tried, posed=posed), sides, cells, digits)


def _at_once(
    certificate: Certificate, fields: Sequence[Generator], formulas: Formulas, digits: int
) -> Proof:
    """Return the proof for the parameters of the problem: the strict statement where it is shown.

    Where gradients are dependent it rarely is, and the other one costs less; where no multipliers
    carry the energy's slope neither is.
    """
    many = not certificate.analysis.independent
    found = _bounded(certificate, fields, formulas, digits) if many else None
    if isinstance(found, Proof) and certificate.problem.dimension > LARGE:
        return found
    hopeless = many and certificate.verdict is Verdict.NOT_STATIONARY
    brief = hopeless or isinstance(found, Proof)
    tried = attempt(certificate, fields, formulas, digits, brief=brief)
    if not many and not tried.settled:
        found = _bounded(certificate, fields, formulas, digits)
    if isinstance(found, Proof) and not tried.proved:
        return found
    if isinstance(found, Undecided) and not tried.settled:
        other = {SUBJECT: ConditionResult(Status.UNDECIDED, found.reason)}
        tried = replace(tried, found={**tried.found, **other})
    proof = _one(certificate, tried, digits)
    return _with_room(proof, tried, formulas) if tried.proved else proof


def _outside(certificate: Certificate, formulas: Formulas) -> dict[str, str]:
    """Return what the certificate's point violates, taken exactly, in the best branch."""
    d, m = certificate.problem.polyhedron, certificate.problem.inequalities
    point = Box(balls(certificate.point))
    values = formulas.values(point, range(m + len(d.equations)))
    broken = [i for i, value in enumerate(values) if (value < 0 if i < m else value != 0)]
    signs = [-1 if i in broken else 1 for i in range(m)]
    if broken and broken[-1] < m and d.signs_to_pieces(signs):
        return {}  # another branch holds
    (kept, *_) = d.selections([float(value.mid()) for value in values[:m]])
    broken = [i for i in broken if i >= m or i in kept]
    return {formulas.names[i]: values[i].str(SHOWN_DIGITS, radius=False) for i in broken}


def _with_room(proof: Proof, tried: Attempt, formulas: Formulas) -> Proof:
    """Return a proof with the room of the coordinates that nothing in it reads."""
    problem = proof.certificate.problem
    read = frozenset().union(*(reads(formulas, i) for i in (*tried.face, problem.rows - 1)))
    loose = [j for j in range(problem.dimension) if j not in read]
    if not loose:
        return proof
    with precision(tried.bits):
        hull = [between(*side) for side in proof.region]
        centre, sides = Rattlers(problem, formulas, loose).placed(hull)
    return proof if sides is None else _roomy(proof, centre, sides)


def _roomy(proof: Proof, centre: Sequence[Fraction], sides: Mapping[int, Fraction]) -> Proof:
    manifold, scales = (
        proof.certificate.problem.polyhedron.manifold,
        proof.certificate.problem.scales,
    )
    room = {}
    for j, side in sides.items():
        half = side * Fraction(float(scales[j]))
        ends = centre[j] - half, centre[j] + half
        room[manifold.names[j]] = decimals(*ends, ROOM_DIGITS, inwards=True)
    words = "; ".join(f"{name} from {a} to {b}" for name, (a, b) in room.items())
    return replace(
        proof,
        conditions={**proof.conditions, ROOM: Status.PROVED},
        reasons={**proof.reasons, ROOM: f"the others are a minimum with any values of {words}"},
        room=room,
    )


def _one(certificate: Certificate, tried: Attempt, digits: int) -> Proof:
    """Return the proof for the parameters of the problem."""
    d, posed, enclosure = certificate.problem.polyhedron, tried.posed, tried.enclosure
    if isinstance(posed, Undecided) or isinstance(enclosure, Undecided):
        return _proof(certificate, tried, digits, tried.found)
    with precision(tried.bits):
        values = [bounds(x) for x in enclosure.solution]
        energy = bounds(enclosure.linear.energy)
    named = _named(posed, values)
    hidden = {f"multiplier {name}" for name in d.hidden}
    sides = {name: named[name] for name in d.manifold.names} | {"energy": energy} | named
    sides = {name: side for name, side in sides.items() if name not in hidden}
    box = _named(posed, _uniqueness_box(enclosure))
    return replace(
        _proof(certificate, tried, digits, tried.found),
        enclosures={name: decimals(*side, digits) for name, side in sides.items()},
        box={
            name: decimals(*side, digits + BOX_DIGITS, inwards=True) for name, side in box.items()
        },
        region=tuple(values[: d.manifold.size]),
        face=_face(posed, values[: d.manifold.size]),
    )


def _face(posed: Posed, sides: Sequence[Bounds]) -> ProvedFace:
    """Return a face and its point: the simplest numbers, where they may be the coordinates."""
    system = posed.claim.system
    middle = [(lower + upper) / 2 for lower, upper in sides]
    simple = [x.limit_denominator(SIMPLE) for x in middle]
    exactly = all(a <= x <= b for x, (a, b) in zip(simple, sides, strict=True))
    normals = ([Fraction(x) for x in gauge] for gauge in system.gauges)
    gauges = [Gauge(f, tuple(n)) for f, n in zip(posed.claim.fields, normals, strict=True)]
    return ProvedFace(system.held, tuple(simple if exactly else middle), tuple(gauges))


def _bounded(
    certificate: Certificate, fields: Sequence[Generator], formulas: Formulas, digits: int
) -> Proof | Undecided:
    """Return the proof of a minimum between two energies, or why there is none."""
    problem, tolerances = certificate.problem, certificate.tolerances
    found = bounded_minimum(problem, formulas, certificate.point, fields, tolerances, digits)
    if isinstance(found, Undecided):
        return found
    names, rows = problem.polyhedron.manifold.names, problem.polyhedron.names
    conditions = found.conditions(rows)
    region = found.region(found.radius, problem)
    sides = dict(zip(names, region, strict=True)) | {"energy": found.energy}
    alone = found.region(found.alone[1], problem) if found.alone else ()
    proof = Proof(
        certificate,
        digits,
        tuple(rows[i] for i in found.witness.supports),
        tuple(str(gauge.field) for gauge in found.witness.gauges),
        conditions=dict.fromkeys(conditions, Status.PROVED),
        reasons=conditions,
        enclosures={name: decimals(*side, digits) for name, side in sides.items()},
        box={
            name: decimals(*side, digits + BOX_DIGITS, inwards=True)
            for name, side in zip(names, alone, strict=False)
        },
        region=region,
        minimum=found,
    )
    room = {j: found.witness.room[j] for j in found.rattling}
    return _roomy(proof, found.witness.centre, room) if room else proof


def _uniqueness_box(enclosure: Enclosure) -> list[Bounds]:
    """Return a box of the unknowns in which the solution is the only one."""
    with precision(CELL_BITS):
        radii_of = widened(enclosure)
    middle = [exact(x.mid()) for x in enclosure.predictor.centre]
    radii = [exact(w.rad()) for w in radii_of]
    return [(m - r, m + r) for m, r in zip(middle, radii, strict=True)]


def _named(posed: Posed, unknowns: list[Bounds]) -> dict[str, Bounds]:
    """Return the bounds of the coordinates and the multipliers by name."""
    coordinates = posed.claim.problem.polyhedron.manifold.names
    names = (*coordinates, *(f"multiplier {name}" for name in posed.claim.names))
    return dict(zip(names, unknowns, strict=False))


def _proof(
    certificate: Certificate, tried: Attempt, digits: int, found: Mapping[str, ConditionResult]
) -> Proof:
    """Return a proof without enclosures; a declared symmetry that does not hold is a condition."""
    names, posed = certificate.problem.polyhedron.names, tried.posed
    symmetry: tuple[str, ...] = ()
    if not isinstance(posed, Undecided):
        symmetry = tuple(map(str, posed.claim.fields))
        found = dict(found) | ({} if posed.refused is None else {SYMMETRIC: posed.refused})
    return Proof(
        certificate,
        digits,
        tuple(names[i] for i in tried.face if i < len(names)),
        symmetry,
        conditions={name: finding.status for name, finding in found.items()},
        reasons={name: finding.reason for name, finding in found.items()},
        enclosures={},
        box={},
    )


def _many(
    certificate: Certificate,
    tried: Attempt,
    sides: dict[str, Interval],
    cells: tuple[ParameterCell, ...],
    digits: int,
) -> Proof:
    """Return the proof for a box of parameters."""
    posed = tried.posed
    refused = None if isinstance(posed, Undecided) else posed.refused
    if not isinstance(posed, Undecided) and refused and refused.status is Status.FAILED:
        # It was seen to fail at the certificate's parameters only.
        partly = replace(refused, status=Status.PARTLY)
        tried = replace(tried, posed=replace(posed, refused=partly))
    proved = [cell.bounds for cell in cells if cell.status is Status.PROVED]
    hulls = {
        name: (Fraction(min(b[name][0] for b in proved)), Fraction(max(b[name][1] for b in proved)))
        for name in (proved[0] if proved else ())
    }
    return replace(
        _proof(certificate, tried, digits, summary(cells)),
        enclosures={
            name: decimals(*side, min(digits, DOUBLE_DIGITS)) for name, side in hulls.items()
        },
        parameters=sides,
        cells=cells,
        face=None if isinstance(posed, Undecided) else _face(posed, ()),
    )
