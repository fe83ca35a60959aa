"""Lagrange's equations from energies, differentiated as programs ([Lanczos] ch. 5).

With a kinetic energy ``T = v . M(q) v / 2``, momenta ``p = dT/dv``, a potential ``V(q)`` and
applied forces ``Q(q, v)`` they are ``M v' = F``, where

    M = dp/dv,    F = Q - dV/dq + dT/dq - sum_j v_j dp/dq_j.

SymPy would take seconds to differentiate the energy of two bodies that turn in space.
"""

from dataclasses import dataclass

from polycorner.formulas.adjoints import Reverse
from polycorner.formulas.families import Family
from polycorner.formulas.programs import Program
from polycorner.formulas.translate import compile_expressions


@dataclass(frozen=True, eq=False)
class EquationsOfMotion(Family):
    """Upper triangle of ``M`` row by row, ``F`` (k), applied forces (k), known loads.

    Variables are ``k`` coordinates and then the velocities; formulas are those of ``T``, ``V``, the
    applied forces and the loads, in this order.
    """

    def program(self) -> Program:
        """Return the straight-line program of the values."""
        k = len(self.variables) // 2
        definitions, written = self.formulas()
        symbols = self.variables, self.parameters
        given = compile_expressions([*written.values()], *symbols, definitions, [*written])
        g, (kinetic, potential, *rest) = given.graph.copy(), given.outputs
        row, zero = Reverse(g).row, g.const(0)
        along, rise = row(kinetic), row(potential)
        changes = [row(along.get(k + i, zero)) for i in range(k)]
        mass = [changes[i].get(k + j, zero) for i in range(k) for j in range(i, k)]
        forces = []
        for i, change in enumerate(changes):
            total = g.add(g.sub(rest[i], rise.get(i, zero)), along.get(i, zero))
            for j in range(k):
                total = g.sub(total, g.mul(g.node("var", k + j), change.get(j, zero)))
            forces.append(total)
        outputs = (*mass, *forces, *rest)
        return Program(g, outputs, len(self.variables), len(self.parameters))
