"""Entry points of the compiled descent, which are given the addresses of records."""

import numpy as np

from polycorner.formulas.intermediate import intermediate_code
from polycorner.formulas.records import RecordType, reader
from polycorner.minimisation.descent import newton, records, sqp
from polycorner.minimisation.descent.feasibility import project
from polycorner.minimisation.descent.jit import compiled

RESTORATIONS = np.int64(100)  # linearisations with which a point is restored

problem_at, descend_at, restore_at, face_at = (
    reader(RecordType(f"descent.{name}", getattr(records, name).declared))
    for name in ("PROBLEM", "DESCEND", "RESTORE", "ON_FACE")
)


@compiled
def arrays(p):
    """Return the arrays of a problem."""
    return p.calls, p.reads, p.outputs, p.parameters, p.scales


@compiled
def descend(problem, call):
    """Move ``u`` inside a piece, see ``sqp.descend``; return status and iterations."""
    p, c = problem_at(problem), descend_at(call)
    status, iterations, u, lam = sqp.descend(
        arrays(p), c.use, p.inequalities, p.rows, c.u, p.size, c.limit
    )
    for j in range(u.size):
        c.u[j] = u[j]
    for i in range(lam.size):
        c.multipliers[i] = lam[i]
    return float(status), float(iterations)


@compiled
def restore(problem, call):
    """Project ``u`` onto a piece; return success."""
    p, c = problem_at(problem), restore_at(call)
    rows, n = p.rows, c.u.size
    F, J, H = np.zeros(rows), np.zeros((rows, n)), np.zeros((rows, n, n))
    reached = project(arrays(p), c.use, p.inequalities, c.u, F, J, H, p.size, RESTORATIONS)
    return 1.0 if reached else 0.0, 0.0


@compiled
def on_face(problem, call):
    """Apply Newton's method on a face to ``u``, see ``newton.polish``; return the last step."""
    p, c = problem_at(problem), face_at(call)
    rows, n = p.rows, c.u.size
    F, J, H = np.zeros(rows), np.zeros((rows, n)), np.zeros((rows, n, n))
    held = np.zeros((0, n))
    _, step = newton.polish(arrays(p), c.on, p.inequalities, held, c.u, F, J, H, p.size)
    return step, 0.0


def made() -> str:
    """Return the entry points as intermediate code."""
    functions = {"descend": descend, "restore": restore, "on_face": on_face}
    return intermediate_code(functions, arguments=2)
