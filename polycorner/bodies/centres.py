"""Arrangements described about the centres of mass of their bodies, in which motion is computed.

The origin of a body is put at its centre of mass ``c``: its points and the anchors of joints and
springs move by ``-c``, a force ``F`` at the old origin has the torque ``-R c x F`` as well, and
formulas in the coordinates ``x`` of the old one, and in ``x'``, are those in ``X - R c`` and
``X' - (R c)'`` (:mod:`polycorner.motion.charts`).
"""

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from polycorner.bodies.drives import Damper, Motor, Prescribed
from polycorner.bodies.dynamics import masses_of, renamed
from polycorner.bodies.frames import Frame
from polycorner.bodies.joints import Joint
from polycorner.bodies.masses import Mass
from polycorner.bodies.poses import Placement
from polycorner.bodies.ties import names_of
from polycorner.formulas.expressions import as_expression
from polycorner.motion.charts import Chart, Offset
from polycorner.motion.contacts import PAIR, velocities
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT

if TYPE_CHECKING:
    import sympy


def chart_of(arrangement: Any, options: Mapping[str, Any], system: Any) -> Chart | None:
    """Return the coordinates in which a system of an arrangement is moved, if they are others.

    Parameters
    ----------
    arrangement : Arrangement
    options : mapping from str to object
        All arguments of its ``system``.
    system : System or Assembly
        What they give.

    Returns
    -------
    Chart or None
        None where all bodies that turn do so about their centres of mass, or are described by
        coordinates that do not show their spin; and where coordinates of origins are more than
        coordinates, as a body leaves by one (``exits``) or one is prescribed.  With friction discs
        and balls about their origins keep these: slips are linear in them, so that what rolls does
        so exactly at every instant.
    """
    masses = masses_of(arrangement.placements, options["density"], options["masses"] or {})
    centres = {
        p.name: mass.centre
        for p in arrangement.placements
        for mass in [masses[p.name]]
        if p.frame in {Frame.TURNED, Frame.ROTATED}
        and np.abs(mass.centre).max() > DEFAULT.alike * p.body.size
        and not (p.is_round and system.bodies.rubbing)
    }
    d = arrangement.dimension
    places = {x for p in arrangement.placements if p.name in centres for x in p.manifold.names[:d]}
    followed = {
        drive.of for drive in (options["drives"] or {}).values() if type(drive) is Prescribed
    }
    if not centres or options["exits"] or places & followed:
        return None
    offsets, start = [], 0
    for p in arrangement.placements:
        count = options["count"]
        n = count[p.name] if isinstance(count, Mapping) else count
        if p.name in centres:
            own = start + p.manifold.size * np.arange(n)[:, None] + np.arange(p.manifold.size)
            offsets.append(Offset(own[:, :d], own[:, d:], centres[p.name]))
        start += p.manifold.size * n
    return Chart(partial(_described, arrangement, options, masses, centres), tuple(offsets))


def _described(
    arrangement: Any,
    options: Mapping[str, Any],
    masses: Mapping[str, Mass],
    centres: Mapping[str, Array],
) -> Any:
    """Return the system of an arrangement whose bodies have their origins at given points."""
    placements, count = arrangement.placements, options["count"]
    several = isinstance(count, Mapping) or count > 1
    number = count if isinstance(count, Mapping) else {p.name: count for p in placements}
    known = {name: kind for name, (_, kind) in names_of(placements, number).items()}
    known |= {p.name: p.name for p in placements}
    by_name = {name: centres[kind] for name, kind in known.items() if kind in centres}
    elsewhere = _substitution([p for p in placements if p.name in centres], centres, several)
    bodies = {
        name: body.moved(-centres[name]) if name in centres else body
        for name, body in arrangement.named.items()
    }
    one = replace(arrangement, bodies=bodies, joints=_anchored(arrangement.joints, by_name))
    # With the coordinates of before, also where a body is one of revolution about its new origin.
    vars(one).pop("placements", None)
    vars(one).update(scale=arrangement.scale, frames={p.name: p.frame for p in placements})
    given = dict(options)
    given["masses"] = {
        name: replace(mass, centre=0 * mass.centre) if name in centres else mass
        for name, mass in masses.items()
    }
    given["joints"] = _anchored(options["joints"] or {}, by_name)
    given["drives"] = {
        name: replace(drive, torque=_written(drive.torque, elsewhere))
        if isinstance(drive, Motor) and drive.torque is not None
        else drive
        for name, drive in _anchored(options["drives"] or {}, by_name).items()
    }
    forces = dict(options["forces"] or {})
    for p in placements:
        if p.name in forces:
            forces[p.name] = [_written(part, elsewhere) for part in forces[p.name]]
            if p.name in centres:
                forces[p.name] = _carried(p, centres[p.name], forces[p.name])
    given["forces"] = forces
    for name in ("limits", "nonholonomic"):
        formulas = options[name] or {}
        given[name] = {end: _written(e, elsewhere) for end, e in formulas.items()}
    return one.system(**given)


def _anchored(held: Mapping[str, Any], centres: Mapping[str, Array]) -> dict[str, Any]:
    """Return joints and drives with anchors from other origins of the bodies."""
    found = dict(held)
    for name, one in held.items():
        if isinstance(one, Joint) or (isinstance(one, Damper) and one.child is not None):
            moved: dict[str, Any] = {
                end: (0.0 if (at := getattr(one, end)) is None else np.asarray(at)) - centres[body]
                for end, body in (("at", one.parent), ("on", one.child))
                if body is not None and body in centres
            }
            found[name] = replace(one, **moved)
    return found


def _arm(p: Placement, name: str, centre: Array) -> "list[sympy.Expr]":
    """Return the way from the origin of a body to a point, in the axes of space."""
    d = p.body.dimension
    return [*p.frame.vector(name, centre.tolist(), d)[:d]]


def _substitution(
    placements: list[Placement], centres: Mapping[str, Array], several: bool
) -> "dict[sympy.Expr, sympy.Expr]":
    """Return what coordinates and velocities of origins are in those of centres of mass.

    Repeated bodies have further coordinates, by which formulas of pairs know them.
    """
    import sympy

    found: dict[sympy.Expr, sympy.Expr] = {}
    for p in placements:
        d = p.body.dimension
        for name in (p.name, *(f"{p.name}{k}" for k in PAIR if several)):
            manifold = renamed(p, name)
            q, v = manifold.symbols, velocities(manifold)
            for i, arm in enumerate(_arm(p, name, centres[p.name])):
                turned = zip(q[d:], v[d:], strict=True)
                rate = sum(sympy.diff(arm, a) * speed for a, speed in turned)
                found |= {q[i]: q[i] - arm, v[i]: v[i] - rate}
    return found


def _written(formula: Any, elsewhere: "Mapping[sympy.Expr, sympy.Expr]") -> "sympy.Expr":
    """Return a formula in other coordinates."""
    return as_expression("formula", formula).xreplace(dict(elsewhere))


def _carried(p: Placement, centre: Array, force: "list[sympy.Expr]") -> "list[sympy.Expr]":
    """Return a force at the origin of a body, and a torque, as those at its centre of mass."""
    import sympy

    d = p.body.dimension
    arm = [*_arm(p, p.name, centre), 0][:3]
    pull, torque = [*force[:d], 0][:3], force[d:] or [sympy.S.Zero] * (1 if d == 2 else 3)
    lever = sympy.Matrix(arm).cross(sympy.Matrix(pull))
    return [*force[:d], *(t - x for t, x in zip(torque, lever[-len(torque) :], strict=True))]
