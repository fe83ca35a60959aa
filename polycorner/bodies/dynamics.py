"""The mechanical system of an arrangement: inertia, weight, contacts and friction."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from polycorner import checks
from polycorner.bodies.frames import Frame
from polycorner.bodies.masses import Mass, mass_of
from polycorner.bodies.pairs import Member, Touch
from polycorner.bodies.poses import Placement
from polycorner.bodies.slips import slip, slip_at_wall
from polycorner.bodies.walls import Wall
from polycorner.checks import refuse
from polycorner.motion.contacts import Friction, velocities
from polycorner.motion.friction import Disc, Interval
from polycorner.motion.rotations import rotational_energy
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.spaces.manifold import Array

if TYPE_CHECKING:
    import sympy

AtWall = tuple[str, Wall, Member, Array]  # label of the gap, wall, part, point
Law = Callable[[], "tuple[sympy.Expr, ...]"]


def masses_of(placements: tuple[Placement, ...], density: float, given: Any) -> dict[str, Mass]:
    """Return the mass of every body: a given one, or that of a uniform body."""
    given = checks.mapping("masses", given)
    checks.names("masses", given, [p.name for p in placements])
    found = {}
    for p in placements:
        mass = given[p.name] if p.name in given else mass_of(p.body, density)
        checks.instance("masses", mass, Mass, "Mass(1.0, [0.0, 0.0], 0.5)")
        if len(mass.centre) != p.body.dimension:
            refuse("masses", f"a centre of {p.body.dimension} numbers for {p.name!r}", mass.centre)
        found[p.name] = mass
    return found


def energies(
    placements: tuple[Placement, ...], masses: Mapping[str, Mass], gravity: ArrayLike
) -> "tuple[sympy.Expr, sympy.Expr]":
    """Return kinetic and potential energy as formulas.

    The kinetic energy is that of the centre of mass and of the rotation about it.
    """
    import sympy

    d = placements[0].body.dimension
    pull = checks.numbers("gravity", gravity, f"{d} numbers")
    if pull.shape != (d,) or not np.isfinite(pull).all():
        refuse("gravity", f"{d} finite numbers", gravity)
    kinetic = potential = sympy.S.Zero
    for p in placements:
        mass = masses[p.name]
        rates = velocities(p.manifold)
        centre = p.frame.point(p.name, p.frame.local(mass.centre.tolist(), p.body.axis), d)[:d]
        moving = [
            sum(sympy.diff(c, q) * v for q, v in zip(p.manifold.symbols, rates, strict=True))
            for c in centre
        ]
        kinetic += mass.mass * sum(v**2 for v in moving) / 2 + _rotation(p, mass, rates)
        potential -= mass.mass * sum(g * c for g, c in zip(pull.tolist(), centre, strict=True))
    return kinetic, potential


def _rotation(p: Placement, mass: Mass, rates: "tuple[sympy.Symbol, ...]") -> "sympy.Expr":
    """Return the energy of the rotation about the centre of mass."""
    import sympy

    if p.frame is Frame.TURNED:
        return mass.inertia * rates[-1] ** 2 / 2
    if p.frame is Frame.ROTATED:
        return rotational_energy(p.manifold, mass.inertia)
    if p.frame is Frame.AXIAL:
        # Without spin the axis u turns with |u'|, about an axis across.
        along = p.axis @ mass.inertia @ p.axis
        across = (np.trace(mass.inertia) - along) / 2
        return across * sum(v**2 for v in rates[3:]) / 2
    return sympy.S.Zero


def friction_of(
    placements: tuple[Placement, ...], touches: list[Touch], walls: list[AtWall], given: Any
) -> tuple[Friction, ...]:
    """Return dry friction at the contacts with a positive coefficient."""
    named = {p.name: p for p in placements}
    laws: dict[str, tuple[Law, list[Member]]] = {
        t.gap.name: (partial(slip, named, t), [t.one, t.two]) for t in touches
    }
    for label, wall, member, point in walls:
        laws[label] = (partial(slip_at_wall, named, wall, member, point), [member])
    by_name = given if isinstance(given, Mapping) else dict.fromkeys(laws, given)
    checks.names("friction", by_name, laws)
    coefficients = {k: checks.real("friction", mu, least=0) for k, mu in by_name.items()}
    found = []
    for label, mu in coefficients.items():
        law, members = laws[label]
        if mu == 0:
            continue
        for member in members:
            if member.frame in {Frame.SHIFTED, Frame.AXIAL}:
                missing = "coordinates of all rotations (orientations='all')"
                refuse("friction", f"{missing}, those of {member.body!r} too", mu)
        shape = Interval(mu) if placements[0].body.dimension == 2 else Disc(mu)
        found.append(Friction(f"{label} slips", law(), shape, label))
    return tuple(found)


def smooth(polyhedron: Polyhedron) -> Polyhedron:
    """Return the polyhedron, or raise where motion would need a union."""
    if polyhedron.is_union:
        msg = (
            "bodies: expected rounded bodies (radius > 0) for motion; two sharp polygons or "
            "polyhedra are apart in one of several ways, which is not covered"
        )
        raise NotImplementedError(msg)
    return polyhedron
