"""The verb that decides exactly whether a point lies in a set, and finds one that does."""

from collections.abc import Mapping, Sequence
from decimal import Decimal
from fractions import Fraction
from numbers import Rational, Real
from typing import TYPE_CHECKING, Any

import numpy as np

from polycorner import checks
from polycorner.intervals.balls import MOST_DIGITS, bits_for
from polycorner.minimisation.problem import pose
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.proofs.membership import Membership, Signs
from polycorner.proofs.repairs import Repair
from polycorner.proofs.witnesses import Point
from polycorner.spaces.manifold import Manifold
from polycorner.tolerances import DEFAULT

if TYPE_CHECKING:
    from polycorner.minimisation.problem import Energy
    from polycorner.spaces.manifold import Array

    Number = float | str | Decimal | Fraction

LONGEST = 20_000  # characters of a coordinate, and its decimal exponent


def exact_point(
    polyhedron: Polyhedron,
    point: "Sequence[Number] | Mapping[str, Number] | Array",
    energy: "Energy | None" = None,
    *,
    within: float = DEFAULT.same,
    digits: int = 30,
) -> Membership:
    """Decide exactly whether a point lies in a set, and find a point that does nearby.

    No tolerance is involved: every sign is proved in ball arithmetic or by exact algebra.  A point
    outside is moved as little as possible, measured by the largest change of a coordinate in scale
    units; with an energy, so that to first order as little energy as possible is lost, and then as
    little as possible.  Where no point is found, the box is searched for a proof that there is
    none.

    Parameters
    ----------
    polyhedron : Polyhedron
        The set ``D``.
    point : sequence or mapping from coordinate names
        The point: numbers, fractions, decimals or text such as ``"0.1"`` or ``"1/3"``, all taken
        exactly.  Vectors and quaternions are not normalised.
    energy : SmoothFunction or sympy.Expr, optional
        The energy ``E``.
    within : float, optional
        The largest change of a coordinate, in scale units.
    digits : int, optional
        Significant digits of values, 1 to 10000.  The repair is the smallest to first order, to
        about ten digits of itself or up to ``10**-digits`` scale units.

    Returns
    -------
    Membership
        Whether the point lies in the set, what it violates, and the point nearby.

    Raises
    ------
    TypeError, ValueError
        For arguments of the wrong kind or out of range.

    Examples
    --------
    >>> from polycorner import Manifold, Polyhedron, exact_point
    >>> M = Manifold.euclidean("x y")
    >>> x, y = M.symbols
    >>> D = Polyhedron(M, {"disc": 1 - x**2 - y**2})
    >>> exact_point(D, ["0.6", "0.8"]).inside, exact_point(D, [0.6, 0.8]).inside
    (True, False)
    """
    import sympy

    checks.instance("polyhedron", polyhedron, Polyhedron)
    given = _coordinates(polyhedron.manifold, point)
    reach = Fraction(checks.real("within", within, above=0))
    digits = checks.whole("digits", digits, least=1, most=MOST_DIGITS)
    problem = pose(polyhedron, sympy.Integer(0) if energy is None else energy)
    place = Signs(problem, bits_for(digits))
    return _judged(Repair(place, given, reach, digits, costly=energy is not None), digits)


def _judged(repair: Repair, digits: int) -> Membership:
    place, given, reach = repair.place, repair.given, repair.within
    signs = place.signs(given)
    inside, reasons = place.holds(signs), []
    point = [(x, x) for x in given]
    region = tuple(point) if inside else repair.run()
    empty = () if region else repair.empty()
    names = place.formulas.names
    if empty:
        inside = False
    if inside is None:
        some = ", ".join(names[i] for i in place.rows if i not in signs)
        reasons.append(f"the sign of {some} at the given point is not decided")
    if not (region or empty):
        reasons.append("no point of the set was found nearby, nor shown not to exist")
    energy = place.problem.rows - 1
    away = zip(region, given, place.scales, strict=bool(region))
    return Membership(
        names=place.polyhedron.manifold.names,
        given=given,
        inside=inside,
        violations=() if inside else repair.violations(signs, digits),
        region=region,
        moved=max(max(abs(a - x), abs(b - x)) / s for (a, b), x, s in away) if region else None,
        energy=place.value(region, energy, digits) if region and repair.costly else None,
        energy_given=place.value(point, energy, digits) if repair.costly else None,
        empty=empty,
        within=reach,
        reason="; ".join(reasons),
    )


def _coordinates(manifold: Manifold, point: Any) -> Point:
    """Return coordinates as exact fractions, or raise."""
    names = manifold.names
    if isinstance(point, Mapping):
        if set(point) != set(names):
            checks.refuse("point", f"the coordinates {', '.join(names)}", sorted(map(str, point)))
        point = [point[name] for name in names]
    several = isinstance(point, Sequence | np.ndarray) and not isinstance(point, str | bytes)
    if not several:
        checks.refuse("point", "a sequence or a mapping of coordinates", point, TypeError)
    if len(point) != len(names):
        checks.refuse("point", f"{len(names)} coordinates", f"{len(point)} of them")
    return tuple([_exactly(name, x) for name, x in zip(names, point, strict=True)])


def _exactly(name: str, x: object) -> Fraction:
    """Return a number of any kind, or in text, as a fraction."""
    expected = f"a finite number, or text such as '0.1' or '1/3', of at most {LONGEST} digits"
    if isinstance(x, bool | np.bool_) or not isinstance(x, str | Decimal | Real):
        checks.refuse(f"point: {name}", expected, x, TypeError)
    try:
        if isinstance(x, Rational):
            return Fraction(int(x.numerator), int(x.denominator))
        if isinstance(x, str) and "/" in x:
            return Fraction(x) if len(x) <= LONGEST and "e" not in x.lower() else Fraction("")
        number = Decimal(x) if isinstance(x, str | Decimal) else Decimal(float(x))
        if number.is_finite() and abs(number.adjusted()) <= LONGEST >= len(
            number.as_tuple().digits
        ):
            return Fraction(number)
    except (ValueError, ArithmeticError):
        pass
    return checks.refuse(f"point: {name}", expected, x)
