"""Why a point is, or is not, a local minimum: a certificate in a few sentences.

The sentences follow the conditions of [NW] ch. 12 in their order: does the point lie in the set;
do multipliers of the right sign exist; what does the second order say on the critical cone.  Each
names the function, coordinate or direction that decides, and the number.
"""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from polycorner.minimisation.analysis import PROBES
from polycorner.minimisation.conditions import MAX_WEAK, NEARLY_FLAT
from polycorner.minimisation.evidence import (
    implied_functions,
    least_curvature,
    oriented,
    steepest_descent,
)
from polycorner.minimisation.verdicts import Entrapment, Verdict
from polycorner.polyhedra.cones import null_space, rank
from polycorner.polyhedra.strata import distances
from polycorner.printing import angle_unit, number

if TYPE_CHECKING:
    from polycorner.minimisation.certificate import Certificate
    from polycorner.spaces.manifold import Array

DIGITS = 6
SEEN = 1e-6  # a component of a unit direction below this is not told


def explanation(c: "Certificate", unit: str | None) -> str:
    """Return why the point of a certificate is or is not a minimum, a sentence or two a line."""
    lines = [_headline(c), _place(c, unit)]
    if c.analysis.verdict is not Verdict.OUTSIDE:
        lines += _first_order(c, unit)
        lines += _dependence(c)
        if _stationary(c):
            lines += [*_second_order(c), *_entrapment(c)]
    return "\n".join(line for line in lines if line)


def _headline(c: "Certificate") -> str:
    words = c.verdict.value
    searched = c.search is not None and c.search is not c.verdict
    told = f" (the search: {c.search.value})" if searched and c.search is not None else ""
    return f"{words[0].upper()}{words[1:]}{told}."


# --------------------------------------------------------------- where the point is


def _place(c: "Certificate", unit: str | None) -> str:
    if c.analysis.verdict is Verdict.OUTSIDE:
        return _missed(c, unit)
    pieces = c.stratum.pieces
    if len(pieces) > 1:
        shown = "; ".join(", ".join(piece) for piece in pieces)
        return (
            f"It lies in the polyhedron, where {len(pieces)} branches of the union meet "
            f"({shown}); what follows is said of the branch that decides, {_names(c.active)}."
        )
    dimension = c.stratum.dimension
    if dimension == c.problem.dimension and not c.active:
        return "It lies in the interior of the polyhedron: no inequality is active."
    active = f"active: {_names(c.active)}" if c.active else "no inequality is active"
    return f"It lies in the polyhedron, on a face of dimension {dimension}; {active}."


def _missed(c: "Certificate", unit: str | None) -> str:
    """Name the constraint by which the polyhedron is missed, and by how much."""
    d, local = c.problem.polyhedron, c.analysis.local
    if not np.isfinite(local.values[-1]):
        return "The energy is not finite there."
    away = distances(local.values[:-1], local.gradients[:-1])
    m = c.problem.inequalities
    if np.isnan(away).any():
        return f"{(d.names + d.equation_names)[int(np.isnan(away).argmax())]} is not finite there."
    short = float(d.implicit_of(away[:m])) if m else np.inf
    off = abs(away[m:])
    if len(off) and off.max() >= -short:
        worst = m + int(off.argmax())
        words = f"the equation {d.equation_names[worst - m]} is not met: it is"
    else:
        worst = int(abs(away[:m] - short).argmin())
        words = f"the inequality {d.names[worst]} fails: its function is"
    told = (
        f"Farthest from holding, {words} {_with(local.values[worst], unit)}, to first order "
        f"{number(abs(away[worst]), DIGITS)} scale units from zero (tolerance {c.tolerance:g})."
    )
    failing = [d.names[i] for i in np.flatnonzero(away[:m] < -c.tolerance) if i != worst]
    failing += [d.equation_names[j] for j in np.flatnonzero(off > c.tolerance) if m + j != worst]
    return f"{told} Also violated: {_names(failing)}." if failing and not d.is_union else told


# --------------------------------------------------------------- first order


def _stationary(c: "Certificate") -> bool:
    return c.analysis.multipliers.exist and not _open(c)


def _open(c: "Certificate") -> list[int]:
    """Return positions of active functions whose gap is not zero enough for their multiplier."""
    a = c.analysis
    if not a.multipliers.exist:
        return []
    k = len(a.active)
    away = distances(a.local.values[list(a.active)], a.gradients[:k])
    return np.flatnonzero(abs(a.multipliers.values[:k] * away) > 10 * a.local.small).tolist()


def _first_order(c: "Certificate", unit: str | None) -> Iterator[str]:
    a = c.analysis
    relative = number(a.multipliers.residual / a.reference, 2)
    if _stationary(c):
        yield (
            f"The first order holds, up to {relative} of the energy's own size: "
            + (f"dE is {_combination(c)}." if c.multipliers else "dE vanishes.")
        )
        yield _complementarity(c)
        return
    for i in _open(c):
        name = c.active[i]
        gap, force = float(a.local.values[a.active[i]]), c.multipliers[name]
        yield (
            f"{name} counts as closed, but its gap is {_with(gap, unit)} and its multiplier "
            f"{number(force, DIGITS)}: to close it altogether would change the energy by "
            f"{number(-gap * force, DIGITS)}, which is too much to be rounding."
        )
    if a.multipliers.exist:
        return
    if a.verdict is Verdict.NO_MULTIPLIER:
        yield (
            f"The gradients of {_names([*c.active, *c.problem.polyhedron.equation_names])} are "
            "dependent and leave no inward direction, as at a cusp; no multipliers exist, and "
            "these conditions decide nothing here."
        )
        return
    yield from _slopes(c, unit)


def _combination(c: "Certificate") -> str:
    terms = (f"{number(value, DIGITS)} d({name})" for name, value in c.multipliers.items())
    return " + ".join(terms).replace("+ -", "- ")


def _complementarity(c: "Certificate") -> str:
    a, names = c.analysis, c.problem.polyhedron.names
    if not a.active:
        return ""
    if not a.weak:
        return "Every active function has a positive multiplier (strict complementarity)."
    weak = _names([names[i] for i in a.weak])
    return f"Weakly active, with multiplier zero: {weak}."


def _slopes(c: "Certificate", unit: str | None) -> Iterator[str]:
    """Say which contacts the energy pulls open, and where it falls fastest."""
    a = c.analysis
    per = f"per {unit}" if unit else "per unit of its gap"
    if a.independent:
        values = a.multipliers.values[: len(a.active)]
        for i in sorted(np.flatnonzero(values < -a.local.small), key=values.__getitem__):
            name = c.active[i]
            others = ", all others kept as they are," if len(a.gradients) > 1 else ""
            yield (
                f"Leaving {name}{others} lowers the energy at the rate "
                f"{number(-c.multipliers[name], DIGITS)} {per}: its multiplier is negative."
            )
        yield _slope_along(c)
    rate, direction = steepest_descent(a)
    if rate <= a.local.small:
        yield (
            "The active gradients are so nearly dependent that only multipliers of an "
            "unreasonable size would balance the energy's slope."
        )
        return
    yield (
        f"The energy falls fastest in the allowed direction {_direction(c, direction)}, at the "
        f"rate {number(rate, DIGITS)} per scale unit."
    )


def _slope_along(c: "Certificate") -> str:
    a = c.analysis
    if a.multipliers.residual <= a.local.small or not len(a.gradients):
        return ""
    basis = null_space(a.gradients, c.rank_tolerance)
    slope = basis @ (basis.T @ a.local.gradients[-1])
    rate = float(np.linalg.norm(slope))
    return (
        f"Along the face, all of its functions kept at zero, it falls in the direction "
        f"{_direction(c, -slope / rate)} at the rate {number(rate, DIGITS)} per scale unit."
    )


def _dependence(c: "Certificate") -> Iterator[str]:
    a = c.analysis
    if a.independent:
        return
    names = [*c.active, *c.problem.polyhedron.equation_names]
    size = rank(a.gradients, c.rank_tolerance)
    told = f"The {len(names)} gradients of {_names(names)} are dependent, of rank {size}"
    if not a.multipliers.exist:
        yield f"{told}."
    elif c.multipliers_unique:
        yield f"{told}, and yet the multipliers are unique."
    else:
        ranges = (
            f"{name} from {number(low, DIGITS)} to {number(high, DIGITS)}"
            for name, (low, high) in c.multiplier_ranges.items()
        )
        yield f"{told}, so that the multipliers are one choice of several: {'; '.join(ranges)}."
    implied = implied_functions(a)
    if implied:
        every = "; ".join(c.active[i] for i in implied)
        yield f"Redundant to first order, each implied by the others: {every}."


# --------------------------------------------------------------- second order


def _second_order(c: "Certificate") -> Iterator[str]:
    a = c.analysis
    if not a.curvature.decided:
        yield (
            f"{len(a.weak)} functions are weakly active, more than the {MAX_WEAK} for which the "
            "second order is decided."
        )
        return
    found = least_curvature(a)
    if found is None:
        yield "No direction is left to the second order: the first order decides alone."
        return
    least, direction = found
    where = f"in the direction {_direction(c, direction)}"
    if least < -a.small_curvature:
        yield (
            f"Where the first order leaves the energy as it is, it falls to second order {where}: "
            f"the curvature there is {number(least, DIGITS)} per squared scale unit."
        )
        if not c.multipliers_unique:
            yield "Another choice of the multipliers might still show a minimum."
    elif a.curvature.flat.shape[1]:
        yield f"The second order vanishes, or nearly so, {where}."
        yield _followed(c)
        yield _across(c)
    else:
        yield (
            "The second order holds: on the critical cone the least curvature is "
            f"{number(least, DIGITS)} per squared scale unit, {where}."
        )


def _across(c: "Certificate") -> str:
    """Say what holds the point across the directions in which the second order vanishes."""
    a = c.analysis
    values, vectors = a.curvature.values, a.curvature.vectors
    held = np.flatnonzero(values > NEARLY_FLAT * a.small_curvature)
    if a.weak or not len(held):
        return ""
    first = held[0]
    return (
        f"Across them the least curvature is {number(values[first], DIGITS)} per squared scale "
        f"unit, in the direction {_direction(c, oriented(vectors[:, first]))}."
    )


def _followed(c: "Certificate") -> str:
    a = c.analysis
    if not np.isfinite(a.flat_change):
        return "It was not followed, so that nothing is decided."
    told = (
        f"Followed both ways along the face by up to {abs(PROBES).max():g} scale units, such "
        f"directions change the energy by {number(a.flat_change, 2)} of its own size: "
    )
    return told + ("they are free." if a.flat_verified else "nothing is decided.")


def _entrapment(c: "Certificate") -> Iterator[str]:
    kinds = c.entrapment
    if not kinds:
        return
    groups: dict[str, list[str]] = {}
    for direction, kind in kinds.items():
        vague = kind is Entrapment.FREE and not c.analysis.flat_verified
        groups.setdefault("undecided" if vague else kind.value, []).append(direction)
    shown = "; ".join(f"{kind}: {', '.join(which)}" for kind, which in groups.items())
    yield f"Entrapment by direction: {shown}."


# --------------------------------------------------------------- words


def _names(names: "tuple[str, ...] | list[str]") -> str:
    return ", ".join(names) or "none"


def _with(value: float, unit: str | None) -> str:
    return f"{number(value, DIGITS)} {unit or ''}".rstrip()


def _direction(c: "Certificate", direction: "Array") -> str:
    """Return a direction of length one in scaled coordinates, in the coordinates themselves."""
    manifold = c.problem.polyhedron.manifold
    words = []
    rows = zip(manifold.names, manifold.periods, manifold.scales, direction, strict=True)
    for name, period, scale, x in rows:
        if abs(x) > SEEN:
            words.append(f"d{name} = {number(scale * x, DIGITS)} {angle_unit(period)}".rstrip())
    return f"({', '.join(words)})"
