"""Checks of placements and velocities against the gaps and equations of a polyhedron."""

import numpy as np

from polycorner.formulas.bundles import Bundle
from polycorner.motion.noise import OPTIONS
from polycorner.polyhedra.faces import project
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.polyhedra.quotients import Quotient
from polycorner.spaces.manifold import Array


def check_contacts(polyhedron: Polyhedron, q: Array, label: str = "") -> None:
    """Raise ValueError if a contact overlaps, naming the worst.

    Parameters
    ----------
    polyhedron : Polyhedron
    q : (n,) or (N, n) array
        Placement of one body, or of several.
    label : str, optional
        What bodies of this kind are called.
    """
    if not polyhedron.functions:
        return
    gaps = polyhedron.values(q)
    worst = tuple(map(int, np.unravel_index(int(np.argmin(gaps)), gaps.shape)))
    if gaps[worst] < -OPTIONS.overlap * min(polyhedron.manifold.scales):
        msg = (
            f"q: expected a placement without overlap; contact {polyhedron.names[worst[-1]]!r}"
            f"{_which(worst, label)} overlaps by {-gaps[worst]:.6g}"
        )
        raise ValueError(msg)


def check_equations(polyhedron: Polyhedron, q: Array, label: str = "") -> None:
    """Raise ValueError if an equation does not hold, or is singular, naming the first.

    A body may be off by what it may overlap, measured by Newton's step onto the equation.
    """
    if not polyhedron.equations:
        return
    values, slopes = polyhedron.equation_values(q), _slopes(polyhedron, q)
    sizes = np.linalg.norm(slopes, axis=-1)
    for at in np.ndindex(values.shape):
        name, value = polyhedron.equation_names[at[-1]], values[at]
        if not sizes[at] > 0:
            msg = (
                f"q: expected a gradient of equation {name!r}{_which(at, label)} that is not zero, "
                f"for it is the direction of its force; got zero"
            )
            raise ValueError(msg)
        if not abs(value) <= OPTIONS.overlap * sizes[at]:
            where = _which(at, label)
            msg = f"q: expected equation {name!r}{where} to hold; its value is {value:.6g}"
            raise ValueError(msg)


def check_velocities(polyhedron: Polyhedron, q: Array, v: Array, label: str = "") -> None:
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
                f"{_which(at, label)}; they change it at the rate {rates[at]:.6g}"
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


def _which(at: tuple[int, ...], label: str) -> str:
    if label:
        return f" of {label} {at[0] + 1}"
    return f" of body {at[0]}" if len(at) > 1 else ""
