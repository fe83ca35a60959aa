"""Problems of saved lists, read back into formulas, and what the library finds of them."""

import operator

import numpy as np
import sympy as sp

from polycorner import AllOf, AnyOf, Manifold, Polyhedron, SmoothFunction
from polycorner.polyhedra.symmetry import Element, Symmetry
from polycorner.proofs import corners, stationary_points

OPERATIONS = {
    "add": operator.add,
    "sub": operator.sub,
    "mul": operator.mul,
    "div": operator.truediv,
    "pow": operator.pow,
    "neg": operator.neg,
    "square": lambda x: x**2,
    "cos": sp.cos,
    "sin": sp.sin,
}


def number(text):
    return sp.sympify(text.replace(" ", "*"))


def formulas(data, symbols):
    """Return inequalities, equations and energy."""
    values = []
    for op, *args in data["nodes"]:
        if op == "const":
            values.append(number(args[0]))
        elif op == "var":
            values.append(symbols[args[0]])
        else:
            values.append(OPERATIONS[op](*(values[a] for a in args)))
    return [values[a] for a in data["outputs"]]


def moves(data, periods):
    """Return the symmetries of a file."""

    def element(g):
        pairs = zip(g["shifts"], periods, strict=True)
        shift = [float(number(s)) * p if p < np.inf else 0.0 for s, p in pairs]
        return Element(lambda q: np.array(g["signs"]) * q[g["order"]] + shift, {})

    return Symmetry(elements=[element(g) for g in data["symmetries"]])


def solved(data):
    """Return the list of the problem that a file states, searched for anew."""
    names, chosen = data["coordinates"], data["parameters"]
    periods = [np.inf if p is None else float(number(p)) for p in data["periods"]]
    ends = ([float.fromhex(x) for x in data["domain"][side]] for side in ("lower", "upper"))
    box = [
        None if b - a >= period else (a, b) if a < b else a
        for a, b, period in zip(*ends, periods, strict=True)
    ]
    sides = {names[i]: box[i] for i in chosen}
    kept = [i for i in range(len(names)) if i not in chosen]
    manifold = Manifold(
        tuple(names[i] for i in kept), tuple(periods[i] for i in kept), (1.0,) * len(kept)
    )
    every = formulas(data, sp.symbols(names))

    def function(name, formula):
        read = {str(s) for s in formula.free_symbols}
        own = {k: sum(side) / 2 for k, side in sides.items() if k in read}
        return SmoothFunction(name, formula, manifold, parameters=own)

    f = [function(f"f{i}", sp.sympify(row)) for i, row in enumerate(every)]
    m, k = data["inequalities"], data["equations"]
    whole = function("whole", 1 + manifold.symbols[0] ** 2)
    pieces = [AllOf(*([f[i] for i in branch] or [whole])) for branch in data["branches"]]
    equations = {f"h{i}": h.expression for i, h in enumerate(f[m : m + k])}
    polyhedron = Polyhedron(
        manifold, [pieces[0] if len(pieces) == 1 else AnyOf(*pieces)], equations
    )
    more = {"box": [box[i] for i in kept], "symmetry": moves(data, periods)}
    if "corner-list" in data["format"][0]:
        return corners(polyhedron, **more)
    more |= {"parameters": sides} if sides else {}
    more |= {"max_boxes": 20_000}
    return stationary_points(polyhedron, f[-1], minima_only=data["minima_only"], **more)
