"""Values that no argument means, or few do: made anew for every call."""

from pathlib import Path

import numpy as np
import sympy

import polycorner

LINE = polycorner.Manifold.euclidean("t")


def masked():
    return np.ma.array([0.25, 0.5], mask=[True, False])


def structured():
    return np.array([(0.25, 0.5)], dtype=[("a", float), ("b", float)])


NEVER = {  # whatever the argument, taken silently these are wrong
    "1+2j": lambda: 0.25 + 2j,
    "complex array": lambda: np.array([0.25 + 1j, 0.5]),
    "complex list": lambda: [0.25 + 1j, 0.5],
    "masked array": masked,
    "structured array": structured,
    "datetimes": lambda: np.array(["2020-01-01", "2020-01-02"], dtype="datetime64[D]"),
    "sympy.zoo": lambda: sympy.zoo,
    "sympy.nan": lambda: sympy.nan,
    "sympy.I": lambda: sympy.I,
}
HOSTILE = {
    **NEVER,
    "None": lambda: None,
    "True": lambda: True,
    "'False'": lambda: "False",
    "''": str,
    "'x'": lambda: "x",
    "long text": lambda: "x" * 5000,
    "b''": bytes,
    "0": lambda: 0,
    "-1": lambda: -1,
    "0.5": lambda: 0.5,
    "nan": lambda: float("nan"),
    "inf": lambda: float("inf"),
    "-inf": lambda: float("-inf"),
    "1e308": lambda: 1e308,
    "10**400": lambda: 10**400,
    "object array": lambda: np.array([0.25, None], dtype=object),
    "empty array": lambda: np.empty(0),
    "five numbers": lambda: [0.1] * 5,
    "matrix": lambda: [[0.1] * 5] * 3,
    "nan array": lambda: np.array([np.nan, 0.5]),
    "array of text": lambda: np.array(["a", "b"]),
    "ragged": lambda: [[0.1, 0.2], [0.3]],
    "()": tuple,
    "{}": dict,
    "{'x': None}": lambda: {"x": None},
    "{3: 'a'}": lambda: {3: "a"},
    "set": lambda: {0.25, 0.5},
    "generator": lambda: (0.5 for _ in range(2)),
    "class": lambda: int,
    "lambda": lambda: lambda *_: None,
    "symbol of elsewhere": lambda: sympy.Symbol("elsewhere"),
    "no such file": lambda: Path("/nowhere/at/all"),
    "folder": Path.cwd,
    "object": object,
    "other polyhedron": lambda: polycorner.Polyhedron(LINE, {"t": LINE.symbols[0]}),
}
