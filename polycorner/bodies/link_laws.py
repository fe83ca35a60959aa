"""Energies, forces and friction of links, as formulas of joint coordinates and velocities."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from polycorner import checks
from polycorner.bodies.chains import LinkStep, Moving, clean, crossed, dot, times
from polycorner.bodies.holds import Angle, Position
from polycorner.bodies.links import RobotJoint
from polycorner.bodies.masses import Mass
from polycorner.bodies.rigid_motions import number, spin
from polycorner.checks import refuse
from polycorner.formulas.expressions import as_expression
from polycorner.motion.contacts import Friction, time_symbol
from polycorner.motion.friction import Interval

if TYPE_CHECKING:
    import sympy


Rates = Mapping[str, "sympy.Symbol"]


def forces(
    joints: Mapping[str, RobotJoint],
    coordinates: "Sequence[sympy.Symbol]",
    rates: Rates,
    torques: "Mapping[str, sympy.Expr]",
) -> "dict[str, sympy.Expr]":
    """Return the forces of damping and of drives, which reach as far as the effort of the joint."""
    import sympy

    found: dict[str, sympy.Expr] = {}
    for name, joint in joints.items():
        if not joint.moves:
            continue
        other, rate, _ = joint.driven_by(name)
        force = -number(joint.damping * rate**2) * rates[other]
        if name in torques:
            drive = as_expression(f"torques[{name!r}]", torques[name])
            known = {s.name for s in (*coordinates, *rates.values(), time_symbol())}
            if unknown := sorted({s.name for s in drive.free_symbols} - known):
                what = "a formula in coordinates, velocities and time_symbol()"
                refuse(f"torques[{name!r}]", what, unknown[0])
            if math.isfinite(joint.effort):
                most = number(joint.effort)
                drive = sympy.Max(-most, sympy.Min(most, drive))
            force += drive
        if force != 0:
            found[other] = found.get(other, sympy.S.Zero) + force
    return found


def followed(
    joints: Mapping[str, RobotJoint], free: Sequence[str], motions: Any
) -> "dict[str, sympy.Expr]":
    """Return the equations of joints that move as functions of the time say."""
    import sympy

    given = checks.mapping("motions", {} if motions is None else motions)
    checks.names("motions", given, free)
    found = {}
    for name, motion in given.items():
        wished = as_expression(f"motions[{name!r}]", motion)
        if wished.free_symbols - {time_symbol()}:
            refuse(f"motions[{name!r}]", "a formula in the time, time_symbol()", motion)
        q = sympy.Symbol(name, real=True)
        turn = Angle(sympy.cos(q / 2), sympy.sin(q / 2), q)
        one = turn if joints[name].kind == "continuous" else Position(q)
        found[name] = one.away(wished)
    return found


def joint_friction(joints: Mapping[str, RobotJoint], rates: Rates) -> Iterator[Friction]:
    """Yield the dry friction of joints."""
    import sympy

    for name, joint in joints.items():
        if joint.moves and joint.friction:
            other, rate, _ = joint.driven_by(name)
            load = sympy.S.One * number(joint.friction * abs(rate))
            yield Friction(f"{name} rubs", (rates[other] * sympy.S.One,), Interval(1.0), (load,))


def joined(masses: Sequence[Mass]) -> Mass:
    """Return the mass of several as one."""
    total = math.fsum(m.mass for m in masses)
    centre = np.sum([m.mass * m.centre for m in masses], axis=0) / total
    inertia = np.zeros((3, 3))
    for m in masses:
        across = spin(m.centre - centre, 3)
        inertia += m.inertia + m.mass * across @ across.T
    return Mass(total, centre, inertia)


def kinetic(motion: Moving, mass: Mass) -> "sympy.Expr":
    """Return the kinetic energy of a mass that moves with a link."""
    centre, omega = [number(x) for x in clean(mass.centre).tolist()], motion.spin
    speed = [v + w for v, w in zip(motion.velocity, crossed(omega, centre), strict=True)]
    inertia = [[number(x) for x in row] for row in mass.inertia.tolist()]
    turning = dot(omega, times(inertia, omega))
    return (number(mass.mass) * sum(v**2 for v in speed) + turning) / 2


def along_norm(step: LinkStep, masses: Sequence[Mass], rates: Rates) -> "sympy.Expr":
    """Return what makes the masses of a quaternion regular, zero where it keeps its length."""
    import sympy

    mean = math.fsum(float(np.trace(mass.inertia)) for mass in masses) / 3
    quaternion = [sympy.Symbol(name, real=True) for name in step.reads[3:]]
    along = dot(quaternion, [rates[name] for name in step.reads[3:]])
    return 2 * number(mean) * along**2
