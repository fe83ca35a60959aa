"""Explanations of verdicts: the optimality conditions at a point in a few sentences.

The sentences follow the conditions of [NW] ch. 12 in their order: does the point lie in the set;
do multipliers of the right sign exist; is the second order positive on the critical cone.  Each
names the function, coordinate or direction that decides, with its number.
"""

from collections.abc import Iterator

import numpy as np

from polycorner.minimisation.conditions import MAX_RAYS
from polycorner.minimisation.descent.statuses import NEARLY_FLAT
from polycorner.minimisation.findings import (
    Analysis,
    FaceSize,
    implied_functions,
    least_curvature,
    oriented,
    steepest_descent,
)
from polycorner.minimisation.verdicts import SEARCHES, Entrapment, Verdict
from polycorner.polyhedra.cones import null_space, rank
from polycorner.polyhedra.strata import Stratum
from polycorner.printing import angle_unit, number
from polycorner.spaces.manifold import Array

DIGITS = 6


def explanation(
    a: Analysis,
    stratum: Stratum,
    verdict: Verdict,
    search: Verdict | None,
    unit: str | None,
    note: str = "",
) -> str:
    """Explain why a point is or is not a minimum, with one or two sentences a line.

    ``search`` says how the search for the point failed, if it did, and ``note`` what it saw;
    ``unit`` is that of the inequalities.
    """
    lines = [_headline(verdict, search), note, _position(a, stratum, unit)]
    if search in SEARCHES and a.verdict not in {Verdict.OUTSIDE, Verdict.NOT_STATIONARY}:
        return "\n".join(line for line in lines if line)
    if a.obstacle:
        lines.append(f"The conditions of first and second order do not apply: {a.obstacle}.")
    elif a.verdict is not Verdict.OUTSIDE:
        lines += _first_order(a, unit)
        lines += _dependence(a)
        if a.stationary:
            lines += [*_second_order(a), *_entrapment(a)]
    return "\n".join(line for line in lines if line)


def sparse_explanation(a: Analysis, verdict: Verdict, note: str) -> str:
    """Explain a verdict on a large polyhedron in a few sentences of numbers."""
    assert isinstance(a.second, FaceSize)
    problem, first, unmoved = a.local.problem, a.multipliers, a.second.unmoved
    words = verdict.value
    lines = [
        f"{words[0].upper()}{words[1:]}.",
        (
            f"Of {problem.inequalities} inequalities {len(a.active)} are active; with "
            f"{len(problem.polyhedron.equations)} equations their gradients have rank "
            f"{a.rank}. {len(unmoved)} of {problem.dimension} coordinates are read by no "
            "function with a positive multiplier."
        ),
    ]
    if a.obstacle:
        lines.append(f"{a.obstacle[0].upper()}{a.obstacle[1:]}.")
    elif len(a.active):
        values = first.values[: len(a.active)]
        lines.append(
            f"Multipliers of unit gradients lie between {values.min():.3g} and {values.max():.3g}; "
            f"the gradient of the energy is met up to {first.residual:.1e}."
        )
    return "\n".join([*lines, note] if note else lines)


def _headline(verdict: Verdict, search: Verdict | None) -> str:
    words = verdict.value
    why = f" (the search: {search.value})" if search and search is not verdict else ""
    return f"{words[0].upper()}{words[1:]}{why}."


# --------------------------------------------------------------- position


def _position(a: Analysis, stratum: Stratum, unit: str | None) -> str:
    if a.verdict is Verdict.OUTSIDE:
        return _missed(a, unit)
    pieces = stratum.pieces
    if len(pieces) > 1:
        shown = "; ".join(", ".join(piece) for piece in pieces)
        return (
            f"It lies in the polyhedron, where {len(pieces)} branches of the union meet "
            f"({shown}); the following concerns the branch that decides, {_names(a.names)}."
        )
    dimension = stratum.dimension
    if dimension == a.local.problem.polyhedron.dimension and not a.names:
        return "It lies in the interior of the polyhedron: no inequality is active."
    active = f"active: {_names(a.names)}" if a.names else "no inequality is active"
    return f"It lies in the polyhedron, on a face of dimension {dimension}; {active}."


def _missed(a: Analysis, unit: str | None) -> str:
    """Name the most violated constraint and the size of its violation."""
    d, local = a.local.problem.polyhedron, a.local
    away = local.away
    m = a.local.problem.inequalities
    if np.isnan(away).any():
        return f"{(d.names + d.equation_names)[int(np.isnan(away).argmax())]} is not finite there."
    short = float(d.implicit_of(away[:m])) if m else np.inf
    off = abs(away[m:])
    if len(off) and off.max() >= -short:
        worst = m + int(off.argmax())
        violated = f"the equation {d.equation_names[worst - m]}"
    else:
        worst = int(np.flatnonzero(away[:m] == short)[0])
        violated = f"the inequality {d.names[worst]}"
    slope, bend = abs(local.gradients[worst]).max(), abs(local.hessians[worst]).max()
    # The slope of a parabola with this value and bend is the root, but for a factor.
    vanishing = slope <= 1e-3 * np.sqrt(abs(local.values[worst]) * bend)
    size = (
        "and its gradient vanishes there: no small step changes it to first order"
        if vanishing
        else f"to first order {number(abs(away[worst]), DIGITS)} scale units from zero (tolerance "
        f"{local.tolerances.zero:g})"
    )
    text = (
        f"The largest violation is that of {violated}: its function is "
        f"{_with(local.values[worst], unit)}, {size}."
    )
    failing = [d.names[i] for i in np.flatnonzero(away[:m] < -local.tolerances.zero) if i != worst]
    failing += [
        d.equation_names[j] for j in np.flatnonzero(off > local.tolerances.zero) if m + j != worst
    ]
    return f"{text} Also violated: {_names(failing)}." if failing and not d.is_union else text


# --------------------------------------------------------------- first order


def _first_order(a: Analysis, unit: str | None) -> Iterator[str]:
    relative = number(a.multipliers.residual / a.reference, 2)
    if a.stationary:
        yield (
            f"The first-order conditions hold, up to {relative} of the energy's own size: "
            + (f"dE is {shares}." if (shares := _combination(a)) else "dE vanishes.")
        )
        yield _complementarity(a)
        return
    for i in a.open_positions:
        name = a.names[i]
        gap, force = float(a.local.values[a.active[i]]), a.named_multipliers[name]
        yield (
            f"{name} is active within the tolerance, but its gap is {_with(gap, unit)} and its "
            f"multiplier {number(force, DIGITS)}: closing it would change the energy by "
            f"{number(-gap * force, DIGITS)}, more than rounding does."
        )
    if a.multipliers.exist:
        return
    if a.verdict is Verdict.NO_MULTIPLIER:
        yield (
            f"The gradients of {_names(tuple(a.stated(dict.fromkeys(a.held_names))))} are "
            "dependent and leave no inward direction, as at a cusp; no multipliers exist, and "
            "the conditions are inconclusive."
        )
        return
    yield from _slopes(a, unit)


def _combination(a: Analysis) -> str:
    shown = a.stated(a.named_multipliers)
    terms = (f"{number(value, DIGITS)} d({name})" for name, value in shown.items())
    return " + ".join(terms).replace("+ -", "- ")


def _complementarity(a: Analysis) -> str:
    names = a.local.problem.polyhedron.names
    if not a.active:
        return ""
    if not a.weak:
        return "Every active function has a positive multiplier (strict complementarity)."
    weak = _names([names[i] for i in a.weak])
    return f"Weakly active, with multiplier zero: {weak}."


def _slopes(a: Analysis, unit: str | None) -> Iterator[str]:
    """List the contacts whose opening lowers the energy, and the direction of steepest descent."""
    per = f"per {unit}" if unit else "per unit of its gap"
    if a.independent:
        values = a.multipliers.values[: len(a.active)]
        for i in sorted(np.flatnonzero(values < -a.local.small), key=values.__getitem__):
            name = a.names[i]
            others = ", all other contacts kept closed," if len(a.gradients) > 1 else ""
            yield (
                f"Opening {name}{others} lowers the energy at the rate "
                f"{number(-a.named_multipliers[name], DIGITS)} {per}: its multiplier is negative."
            )
        yield _slope_along(a)
    rate, direction = steepest_descent(a)
    if rate <= a.local.small:
        yield (
            "The active gradients are so nearly dependent that only excessively large multipliers "
            "would balance the gradient of the energy."
        )
        return
    yield (
        f"The energy decreases fastest in the feasible direction {_direction(a, direction)}, at "
        f"the rate {number(rate, DIGITS)} per scale unit."
    )


def _slope_along(a: Analysis) -> str:
    if a.multipliers.residual <= a.local.small or not len(a.gradients):
        return ""
    basis = null_space(a.gradients, a.local.tolerances.rank)
    slope = basis @ (basis.T @ a.local.gradients[-1])
    rate = float(np.linalg.norm(slope))
    return (
        "Along the face, all of its contacts kept closed, the energy decreases in the direction "
        f"{_direction(a, -slope / rate)} at the rate {number(rate, DIGITS)} per scale unit."
    )


def _dependence(a: Analysis) -> Iterator[str]:
    if a.blind:
        vanishing = _names([a.held_names[i] for i in a.blind])
        yield (
            f"At the point the gradient vanishes of {vanishing}: to first order that says nothing "
            "about the set, and the following leaves it out."
        )
    if a.independent or len(a.blind) == len(a.gradients):
        return
    names = tuple(a.stated(dict.fromkeys(a.held_names)))
    size = rank(a.gradients, a.local.tolerances.rank) + len(names) - len(a.held_names)
    text = f"The {len(names)} gradients of {_names(names)} are dependent, of rank {size}"
    if not a.multipliers.exist:
        yield f"{text}."
    elif a.multipliers.unique:
        yield f"{text}, and yet the multipliers are unique."
    else:
        ranges = (
            f"{name} from {number(low, DIGITS)} to {number(high, DIGITS)}"
            for name, (low, high) in a.stated(a.named_ranges).items()
        )
        yield f"{text}, so the multipliers are one choice of several: {'; '.join(ranges)}."
    implied = implied_functions(a)
    if implied:
        every = "; ".join(a.names[i] for i in implied)
        yield f"Redundant to first order, each implied by the others: {every}."


# --------------------------------------------------------------- second order


def _second_order(a: Analysis) -> Iterator[str]:
    if not a.curvature.decided:
        yield (
            f"{len(a.weak)} functions are weakly active, and the critical cone has more extreme "
            f"rays than the {MAX_RAYS} up to which the second order is decided."
        )
        return
    found = least_curvature(a)
    if found is None:
        yield "The critical cone is the origin: the first order alone decides."
        return
    least, direction = found
    where = f"in the direction {_direction(a, direction)}"
    if least < -a.small_curvature:
        yield (
            f"Stationary to first order, the energy decreases to second order {where}: "
            f"the curvature there is {number(least, DIGITS)} per squared scale unit."
        )
        if a.verdict is Verdict.UNDECIDED:
            yield _higher(a)
        if not a.multipliers.unique:
            yield "Another choice of the multipliers may still prove a minimum."
    elif a.curvature.flat.shape[1]:
        yield f"The second order vanishes, or nearly so, {where}."
        yield _higher(a)
        yield _across(a)
    else:
        yield (
            "The second order holds: on the critical cone the least curvature is "
            f"{number(least, DIGITS)} per squared scale unit, {where}."
        )


def _across(a: Analysis) -> str:
    """State the least curvature across the directions in which the second order vanishes."""
    values, vectors = a.curvature.values, a.curvature.vectors
    held = np.flatnonzero(values > NEARLY_FLAT * a.small_curvature)
    if a.weak or not len(held):
        return ""
    first = held[0]
    return (
        f"Across them the least curvature is {number(values[first], DIGITS)} per squared scale "
        f"unit, in the direction {_direction(a, oriented(vectors[:, first]))}."
    )


def _higher(a: Analysis) -> str:
    """State what higher orders decide, and where."""
    d = a.decision
    if d is None:
        return ""
    if d.verdict is Verdict.UNDECIDED:
        return f"Higher orders decide nothing: {d.reason}."
    where = f"the curve on the face with the tangent {_direction(a, oriented(d.direction))}"
    if d.verdict is Verdict.MINIMUM_ALONG_LOCUS and d.followed is not None:
        far = d.followed.reach
        text = f"The energy is constant along {where}: {d.reason}"
        if not np.isfinite(far):
            return f"{text}."
        series = f" The series has the degree {d.order}." if d.order else ""
        return (
            f"{text}.{series} Over {number(far, 3)} scale units the "
            f"energy changes by {number(d.followed.change, 2)} of its own size."
        )
    words = "decreases along" if d.verdict is Verdict.SADDLE else "grows, most slowly along"
    return (
        f"Expanded to degree {d.order} where the second order vanishes, the energy {words} "
        f"{where}: terms of degree {d.degree} decide."
    )


def _entrapment(a: Analysis) -> Iterator[str]:
    kinds = a.entrapment
    if not kinds:
        return
    groups: dict[str, list[str]] = {}
    for direction, kind in kinds.items():
        vague = kind is Entrapment.FREE and not a.flat_verified
        decided = a.decision is not None and a.decision.verdict is not Verdict.UNDECIDED
        word = "of higher order" if decided else "undecided"
        groups.setdefault(word if vague else kind.value, []).append(direction)
    shown = "; ".join(f"{kind}: {', '.join(which)}" for kind, which in groups.items())
    yield f"Entrapment by direction: {shown}."


# --------------------------------------------------------------- words


def _names(names: "tuple[str, ...] | list[str]") -> str:
    return ", ".join(names) or "none"


def _with(value: float, unit: str | None) -> str:
    return f"{number(value, DIGITS)} {unit or ''}".rstrip()


def _direction(a: Analysis, direction: Array) -> str:
    """Return the components of a unit direction that can be seen, in the coordinates themselves."""
    manifold = a.local.problem.polyhedron.manifold
    words = []
    rows = zip(manifold.names, manifold.periods, manifold.scales, direction, strict=True)
    for name, period, scale, x in rows:
        if abs(x) > 1e-6:
            words.append(f"d{name} = {number(scale * x, DIGITS)} {angle_unit(period)}".rstrip())
    return f"({', '.join(words)})"
