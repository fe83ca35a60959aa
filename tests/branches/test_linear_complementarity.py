"""Quadratic energies over orthants that a force moves along: every equilibrium is known.

On each face the stationary point solves linear equations, so that all equilibria at a value of the
parameter are found by trying all faces.
"""

from itertools import combinations

import numpy as np
import pytest
import sympy

from polycorner import Manifold, Polyhedron, SmoothFunction, certify
from polycorner.branches import branches

t = sympy.Symbol("t")
VALUES = np.linspace(-1.5, 1.5, 7)


class Problem:
    """Minimise ``q'Kq/2 - (b + t c)'q`` where ``q >= lower``; ``K`` need not be definite."""

    def __init__(self, seed):
        rng = np.random.default_rng(seed)
        n = self.n = 3 + seed % 2
        K = rng.normal(size=(n, n))
        self.K, (self.b, self.c), self.lower = K + K.T, rng.normal(size=(2, n)), -rng.random(n)
        self.manifold = Manifold.euclidean(" ".join(f"x{i}" for i in range(n)))

    def equilibria(self, value):
        """Return pairs of held coordinates and a point, for all equilibria."""
        force, found = self.b + value * self.c, []
        for held in (c for r in range(self.n + 1) for c in combinations(range(self.n), r)):
            free = [i for i in range(self.n) if i not in held]
            q = self.lower.copy()
            pull = force[free] - self.K[np.ix_(free, held)] @ q[list(held)]
            q[free] = np.linalg.solve(self.K[np.ix_(free, free)], pull)
            pressed = (self.K @ q - force)[list(held)]
            if (q[free] > self.lower[free]).all() and (pressed > 0).all():
                found.append((tuple(f"g{i}" for i in held), q))
        return found

    def certificate(self, value, q):
        x = sympy.Matrix(self.manifold.symbols)
        energy = (x.T * sympy.Matrix(self.K) * x)[0] / 2
        energy -= sum((self.b[i] + t * self.c[i]) * x[i] for i in range(self.n))
        known = {"t": float(value)}
        d = Polyhedron(self.manifold, {f"g{i}": x[i] - self.lower[i] for i in range(self.n)})
        return certify(d, SmoothFunction("energy", energy, self.manifold, parameters=known), q)


@pytest.mark.parametrize("seed", range(6))
def test_all_arcs_are_equilibria_and_no_start_is_lost(seed):
    problem, seen = Problem(seed), []
    for value in VALUES:
        for held, q in problem.equilibria(value):
            if any(v == value and h == held for v, h in seen):
                continue
            d = branches(problem.certificate(value, q), "t", (-2.0, 2.0))
            assert d.closed
            for arc in d.arcs:
                for v in VALUES[(VALUES > arc.parameters[0]) & (VALUES < arc.parameters[-1])]:
                    matching = [p for h, p in problem.equilibria(v) if h == arc.active]
                    assert len(matching) == 1
                    np.testing.assert_allclose(arc.at(v), matching[0], atol=1e-8)
                    seen.append((v, arc.active))
            assert (value, held) in seen
            for event in d.events:
                indices = [d.arcs[k].index for k in event.arcs]
                if event.kind.name == "CORNER_LIMIT":
                    assert abs(indices[0] - indices[1]) == 1
                elif event.kind.name in {"OPENS", "CLOSES"}:
                    assert indices[0] == indices[1]
                else:
                    assert event.kind.name == "END"
