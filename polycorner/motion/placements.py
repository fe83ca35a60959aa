"""Checks of placements and velocities against the gaps and equations of a polyhedron."""

from collections.abc import Callable

import numpy as np

from polycorner.formulas.bundles import Bundle
from polycorner.motion.noise import OPTIONS
from polycorner.polyhedra.faces import project
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.polyhedra.quotients import Quotient
from polycorner.spaces.manifold import Array


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
    if gaps[worst] < -OPTIONS.overlap * min(polyhedron.manifold.scales):
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
