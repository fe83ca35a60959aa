"""Checks of placements and velocities against the gaps and equations of a polyhedron."""

from collections.abc import Callable

import numpy as np

from polycorner.formulas.bundles import Bundle
from polycorner.formulas.families import Family
from polycorner.motion.bodies import MovingBodies
from polycorner.motion.noise import OPTIONS
from polycorner.polyhedra.faces import project
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.polyhedra.quotients import Quotient
from polycorner.spaces.manifold import Array, Manifold


def gap_unit(manifold: Manifold) -> float:
    """Return the least scale of coordinates that are lengths, by which gaps are scaled.

    Coordinates in radians, of unit vectors and of quaternions have no length, whatever the unit of
    the others: were theirs the least scale, a motion would depend on whether it is written in
    metres or millimetres.  If there are no others, it is the least of all.
    """
    turned = {name for factor in manifold.factors for name in factor.names}
    each = zip(manifold.names, manifold.units, manifold.scales, strict=True)
    lengths = [scale for name, unit, scale in each if unit != "rad" and name not in turned]
    return min(lengths or manifold.scales)


def check_contacts(polyhedron: Polyhedron, q: Array, who: Callable[[str, int], str]) -> None:
    """Raise ValueError if a contact overlaps, naming the worst.

    Parameters
    ----------
    polyhedron : Polyhedron
    q : (n,) or (N, n) array
        Placement of one body, or of several.
    who : function
        Returns what overlaps at a contact of a body, in words.
    """
    if not polyhedron.functions:
        return
    gaps = polyhedron.values(q)
    worst = tuple(map(int, np.unravel_index(int(np.argmin(gaps)), gaps.shape)))
    if gaps[worst] < -OPTIONS.overlap * gap_unit(polyhedron.manifold):
        contact = polyhedron.names[worst[-1]]
        subject = who(contact, worst[0] if len(worst) > 1 else 0)
        at = "" if repr(contact) in subject else f" at contact {contact!r}"
        msg = f"q: expected a placement without overlap; {subject} by {-gaps[worst]:.6g}{at}"
        raise ValueError(msg)


def check_equations(polyhedron: Polyhedron, q: Array, called: Callable[[int], str]) -> None:
    """Raise ValueError if an equation does not hold, or is singular, naming the first.

    A body may be off by what it may overlap, measured by Newton's step onto the equation.
    """
    if not polyhedron.equations:
        return
    values, slopes = polyhedron.equation_values(q), _slopes(polyhedron, q)
    sizes = np.linalg.norm(slopes, axis=-1)
    for at in np.ndindex(values.shape):
        name, value = repr(polyhedron.equation_names[at[-1]]) + _which(at, called), values[at]
        if not sizes[at] > 0:
            msg = (
                f"q: expected a gradient of equation {name} that is not zero, for "
                f"it is the direction of its force; got zero"
            )
            raise ValueError(msg)
        if not abs(value) <= OPTIONS.overlap * sizes[at]:
            msg = f"q: expected equation {name} to hold; its value is {value:.6g}"
            raise ValueError(msg)


def check_velocities(
    polyhedron: Polyhedron, q: Array, v: Array, called: Callable[[int], str]
) -> None:
    """Raise ValueError if velocities are not along an equation, naming the first."""
    if not polyhedron.equations:
        return
    speeds = v / polyhedron.manifold.scale_array
    slopes = _slopes(polyhedron, q)
    rates = (slopes @ speeds[..., None])[..., 0]
    most = np.linalg.norm(slopes, axis=-1) * np.linalg.norm(speeds, axis=-1)[..., None]
    for at in np.ndindex(rates.shape):
        if abs(rates[at]) > OPTIONS.overlap * most[at]:
            msg = (
                f"v: expected velocities along equation {polyhedron.equation_names[at[-1]]!r}"
                f"{_which(at, called)}; they change it at the rate {rates[at]:.6g}"
            )
            raise ValueError(msg)


def check_followed(
    family: Family, scales: Array, q: Array, v: Array, time: float, called: Callable[[int], str]
) -> None:
    """Raise ValueError where equations with the time fail or velocities do not follow them.

    The variables of ``family`` are the coordinates of a body, then the time; ``q`` and ``v`` are
    ``(n,)`` or ``(N, n)``.
    """
    points = np.concatenate([q, np.full((*q.shape[:-1], 1), time)], axis=-1)
    values, slopes = family.evaluate(points, order=1)
    rows, pace = slopes[..., :-1] * scales, slopes[..., -1]
    sizes = np.linalg.norm(rows, axis=-1)
    rates = (rows @ (v / scales)[..., None])[..., 0] + pace
    most = sizes * np.linalg.norm(v / scales, axis=-1)[..., None] + abs(pace)
    for at in np.ndindex(values.shape):
        name = repr(family.names[at[-1]]) + _which(at, called)
        if not abs(values[at]) <= OPTIONS.overlap * sizes[at]:
            msg = (
                f"q: expected equation {name} to hold at the time {time:g}; its value is "
                f"{values[at]:.6g}"
            )
            raise ValueError(msg)
        if abs(rates[at]) > OPTIONS.overlap * most[at]:
            msg = (
                f"v: expected velocities that follow equation {name} at the time {time:g}; they "
                f"are off by the rate {rates[at]:.6g}"
            )
            raise ValueError(msg)


def check_ties(bodies: MovingBodies, q: Array, v: Array, time: float) -> None:
    """Raise ValueError if a limit or equation of a tie does not hold, or not at the velocities.

    Parameters
    ----------
    bodies : MovingBodies
    q, v : (N, k) array
    time : float
    """
    ties, most = bodies.ties, OPTIONS.overlap
    for which, (values, slopes) in ties.evaluate("rows", q, None, time, 1):
        limits = ties.forms[ties.form[which[0]]].limits
        for t, value, slope in zip(which, values, slopes, strict=True):
            ends = [i for i in ties.bodies[t] if i >= 0]
            units, speeds = np.ones(2 * q.shape[1]), np.zeros(2 * q.shape[1])
            units[: len(ends) * q.shape[1]] = bodies.units[ends].ravel()
            speeds[: len(ends) * q.shape[1]] = (v[ends] * bodies.units[ends]).ravel()
            across = slope[:, :-1] / units
            sizes = np.linalg.norm(across, axis=1)
            rates, fast = across @ speeds + slope[:, -1], sizes * np.linalg.norm(speeds)
            who = " and ".join(bodies.called(i).removeprefix("body ") for i in ends)
            for o, (x, size) in enumerate(zip(value.tolist(), sizes.tolist(), strict=True)):
                name = f"{ties.names[ties.row_starts[t] + o]!r}"
                name += f" of {'body' if len(ends) == 1 else 'bodies'} {who}"
                if o < limits and not x >= -most * size:
                    msg = f"q: expected limit {name} not to be passed; its value is {x:.6g}"
                    raise ValueError(msg)
                if o >= limits and not (size > 0 and abs(x) <= most * size):
                    wrong = f"its value is {x:.6g}" if size > 0 else "its gradient is zero"
                    msg = f"q: expected equation {name} to hold; {wrong}"
                    raise ValueError(msg)
                if o >= limits and abs(rates[o]) > most * max(fast[o], abs(slope[o, -1])):
                    msg = (
                        f"v: expected velocities at which equation {name} continues to hold; it "
                        f"changes at the rate {rates[o]:.6g}"
                    )
                    raise ValueError(msg)


def bends(polyhedron: Polyhedron, q: Array) -> tuple[Array, Array] | None:
    """Return the gradients ``(k, n)`` and Hessians ``(k, n, n)`` of the equations, if any."""
    if not polyhedron.equations:
        return None
    _, gradients, hessians = Bundle(polyhedron.manifold, polyhedron.equations).evaluate(q, 2)
    return gradients, hessians


def onto_equations(polyhedron: Polyhedron, q: Array) -> Array:
    """Return the place ``(n,)`` on the equations to which Gauss and Newton's steps lead."""
    m = len(polyhedron.functions)
    equations = range(m, m + len(polyhedron.equations))
    return project(Quotient(polyhedron), q, equations).point.q if equations else q


def _slopes(polyhedron: Polyhedron, q: Array) -> Array:
    """Return the gradients of the equations in scaled coordinates, ``(..., k, n)``."""
    gradients = polyhedron.bundle.evaluate(polyhedron.manifold.points(q), 1)[1]
    found = gradients[..., len(polyhedron.functions) :, :] * polyhedron.manifold.scale_array
    return np.asarray(found)


def _which(at: tuple[int, ...], called: Callable[[int], str]) -> str:
    return f" of {called(at[0])}" if len(at) > 1 else ""
