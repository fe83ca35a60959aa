"""Corners with too many contacts, at rational points: known minima, and points that are none.

Minima: more contacts than dimensions whose multipliers span (``over``), one of them open by 1e-13
(``open``), one more without a multiplier (``zero``), a coordinate that rattles (``rattle``), fewer
contacts and second order, perhaps with a redundant one (``second``).  No minima: a slope out of the
cone of gradients, far or by 1e-4 to 1e-10 (``descent``, ``cone``), a curved saddle with or without
contacts (``saddle``, ``edge``), a set that is empty by 1e-9 to 1e-15 (``empty``).
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import sympy
from scipy.optimize import linprog

from polycorner import Manifold, Polyhedron

MINIMA = ("over", "open", "zero", "rattle", "second")
OTHERS = ("descent", "cone", "saddle", "edge", "empty")


@dataclass(frozen=True)
class Corner:
    """A problem, the rational point it is about, and a start beside it."""

    kind: str
    polyhedron: Polyhedron
    energy: sympy.Expr
    point: tuple[sympy.Rational, ...]
    start: np.ndarray

    @property
    def is_minimum(self) -> bool:
        """Whether the point is a local minimum (a point beside it, where a contact is open)."""
        return self.kind in MINIMA


def corners(rng: np.random.Generator, count: int) -> Iterator[Corner]:
    """Yield corners of all kinds in turn."""
    kinds = MINIMA + OTHERS
    number = 0
    while number < count:
        corner = _Drawn(rng, kinds[number % len(kinds)]).corner()
        if corner is not None:
            number += 1
            yield corner


class _Drawn:
    """Coordinates, a point, and random forms about it."""

    def __init__(self, rng: np.random.Generator, kind: str) -> None:
        self.rng, self.kind = rng, kind
        self.n = int(rng.integers(3 if kind == "rattle" else 2, 6))
        self.core = self.n - (kind == "rattle")
        self.manifold = Manifold.euclidean(" ".join(f"x{i}" for i in range(self.n)))
        whole = rng.integers(-9, 10, self.n), rng.integers(1, 8, self.n)
        self.point = tuple(sympy.Rational(int(a), int(b)) for a, b in zip(*whole, strict=True))
        self.y = [x - a for x, a in zip(self.manifold.symbols, self.point, strict=True)]

    def rational(self, x: float) -> sympy.Rational:
        return sympy.Rational(round(64 * x), 64)

    def vector(self) -> list[sympy.Rational]:
        found = [self.rational(x) for x in self.rng.normal(size=self.core)]
        return found + [sympy.Integer(0)] * (self.n - self.core)

    def linear(self, g: list[sympy.Rational]) -> sympy.Expr:
        return sum(a * y for a, y in zip(g, self.y, strict=True))

    def bend(self, size: float) -> sympy.Expr:
        pairs = [(i, j) for i in range(self.core) for j in range(i, self.core)]
        return sum(
            self.rational(size * self.rng.normal()) * self.y[i] * self.y[j] for i, j in pairs
        )

    def corner(self) -> Corner | None:
        first = self.kind in {"second", "saddle", "edge"}
        found = self._second() if first else self._first()
        if found is None:
            return None
        functions, energy = found
        functions = {name: sympy.expand(f) for name, f in functions.items()}
        functions["far"] = 100 - sum(y * y for y in self.y)
        start = np.array([float(x) for x in self.point])
        start += self.rng.choice([0, 1e-12, 1e-10]) * self.rng.normal(size=self.n)
        polyhedron = Polyhedron(self.manifold, functions)
        return Corner(self.kind, polyhedron, sympy.expand(energy), self.point, start)

    def _first(self) -> tuple[dict[str, sympy.Expr], sympy.Expr] | None:
        """More gradients than dimensions, and a slope inside of their cone or beside it."""
        k = self.core + int(self.rng.integers(1, 4))
        gradients = [self.vector() for _ in range(k)]
        table = np.array(gradients, dtype=float)[:, : self.core]
        if np.linalg.matrix_rank(table) < self.core:
            return None
        weights = [sympy.Rational(int(w), 4) for w in self.rng.integers(1, 9, k)]
        slope = [
            sum(w * g[i] for w, g in zip(weights, gradients, strict=True)) for i in range(self.n)
        ]
        functions = {f"f{i}": self.linear(g) + self.bend(0.5) for i, g in enumerate(gradients)}
        if self.kind == "zero":
            functions["z"] = self.linear(self.vector()) + self.bend(0.5)
        elif self.kind == "open":
            functions["f0"] += sympy.Rational(int(self.rng.integers(1, 9)), 10**13)
        elif self.kind == "rattle":
            last = self.y[-1]
            functions["low"] = last + sympy.Rational(1, 3)
            functions["high"] = sympy.Rational(1, 2) - last + self.y[0] / 4
        elif self.kind == "empty":
            # The sum of all with their weights is -1e-9 or less, whatever the point.
            functions = {f"f{i}": self.linear(g) for i, g in enumerate(gradients)}
            functions["no"] = -self.linear(slope) - sympy.Rational(
                1, 10 ** int(self.rng.integers(9, 16))
            )
        elif self.kind in {"descent", "cone"}:
            inwards = self._inwards(table)
            if inwards is None:
                return None
            step = sympy.Rational(1, 10 ** int(self.rng.integers(4, 11)))
            step = step if self.kind == "cone" else sympy.Integer(1)
            size = sum(a * a for a in inwards)
            rate = sum(a * b for a, b in zip(slope, inwards, strict=False)) + step
            slope = [
                *(a - rate * b / size for a, b in zip(slope, inwards, strict=False)),
                *slope[self.core :],
            ]
        return functions, self.linear(slope) + self.bend(1.0)

    def _inwards(self, table: np.ndarray) -> list[sympy.Rational] | None:
        """Return a rational direction along which all functions grow, to first order."""
        k, n = table.shape
        found = linprog(
            np.append(np.zeros(n), -1.0), np.hstack([-table, np.ones((k, 1))]), np.zeros(k),
            bounds=[(-1, 1)] * n + [(0, 1)],
        )  # fmt: skip
        direction = [sympy.Rational(round(1024 * x), 1024) for x in found.x[:n]]
        rates = table @ np.array(direction, dtype=float)
        return direction if found.x[-1] > 1e-3 and rates.min() > 1e-4 else None

    def _second(self) -> tuple[dict[str, sympy.Expr], sympy.Expr] | None:
        """Fewer gradients than dimensions, and a Lagrangian that is convex or falls along one."""
        k = int(self.rng.integers(0 if self.kind != "edge" else 1, self.n))
        gradients = [self.vector() for _ in range(k)]
        root = self.rng.normal(size=(self.n, self.n))
        form = root @ root.T + 0.3 * np.eye(self.n)
        if self.kind != "second":
            table = np.array(gradients, dtype=float).reshape(k, self.n)
            rank = np.linalg.matrix_rank(table) if k else 0
            v = np.linalg.svd(np.vstack([table, np.zeros((1, self.n))]))[2][rank]
            form -= (v @ form @ v + self.rng.choice([0.05, 1.0])) * np.outer(v, v)
        y = self.y
        lagrangian = sum(
            self.rational(form[i, j]) * y[i] * y[j] / 2
            for i in range(self.n)
            for j in range(self.n)
        )
        if self.kind != "second":
            w = [sympy.Rational(round(4096 * x), 4096) for x in v]
            along = {x: a + b for x, a, b in zip(self.manifold.symbols, self.point, w, strict=True)}
            if not sympy.sympify(lagrangian).subs(along) < -sympy.Rational(1, 100):
                return None
        functions = {f"f{i}": self.linear(g) + self.bend(0.5) for i, g in enumerate(gradients)}
        weights = [sympy.Rational(int(x), 4) for x in self.rng.integers(1, 9, k)]
        energy = lagrangian + sum(w * f for w, f in zip(weights, functions.values(), strict=True))
        if self.kind == "second" and k and self.rng.random() < 0.5:
            functions["red"] = sum(functions.values()) + sum(x * x for x in y) / 8
        return functions, energy
