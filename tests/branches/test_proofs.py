"""Proofs of diagrams, against closed forms, exact enumeration and diagrams that are wrong."""

from dataclasses import replace
from fractions import Fraction
from itertools import combinations
from math import pi, sin, sqrt

import numpy as np
import pytest
import sympy

from polycorner import Manifold, Polyhedron, SmoothFunction, Symmetry, certify, minimise
from polycorner.branches import BranchProofOptions, branches, prove_branches
from polycorner.files import load_diagram, save_diagram
from polycorner.minimisation.methods import stationary_on
from polycorner.polyhedra import AnyOf, Element
from tests.branches.test_normal_forms import CASES, diagram

t = sympy.Symbol("t")
M1 = Manifold.euclidean("x")
(x1,) = M1.symbols
CROSSINGS = {"transcritical"}
BOX = [(-3, 3), (-3, 3)]
BRIEF = BranchProofOptions(max_boxes=300)


def followed(case):
    functions, energy, start, value, *_ = CASES[case]
    return diagram(functions, energy, start, value)


@pytest.mark.parametrize("case", sorted(CASES.keys() - CROSSINGS))
def test_normal_forms_are_complete(case):
    kind, where = CASES[case][4:6]
    p = prove_branches(followed(case), box=BOX)
    assert p.proved
    assert p.complete
    assert p.word == "complete"
    ((low, high),) = [
        bounds
        for bounds, event in zip(p.parameters, p.diagram.events, strict=True)
        if event.kind.name == kind
    ]
    assert low <= where <= high < low + 1e-9


@pytest.mark.parametrize("case", sorted(CROSSINGS))
def test_crossing_curves_are_followed(case):
    p = prove_branches(followed(case), box=BOX)
    assert (p.proved, p.complete, p.word) == (False, False, "followed")
    for event, reason in zip(p.diagram.events, p.events, strict=True):
        assert bool(reason) == (event.kind.name == "BRANCH")
    assert all(p.arcs)  # none is shown to reach the crossing
    assert "not proved" in str(p)


def changed(d, k, **values):
    arcs = list(d.arcs)
    arcs[k] = replace(arcs[k], **values)
    return replace(d, arcs=tuple(arcs))


def renamed(d, kind):
    events = [replace(e, kind=type(e.kind)[kind]) if len(e.arcs) > 1 else e for e in d.events]
    return replace(d, events=tuple(events))


def without(d, k):
    """Remove an arc and its other end, and renumber."""
    gone = d.arcs[k].events[1]
    events = [
        replace(e, arcs=tuple(j - (j > k) for j in e.arcs if j != k))
        for j, e in enumerate(d.events) if j != gone
    ]  # fmt: skip
    arcs = [
        replace(arc, events=tuple(e - (e > gone) for e in arc.events))
        for j, arc in enumerate(d.arcs) if j != k
    ]  # fmt: skip
    return replace(d, arcs=tuple(arcs), events=tuple(events))


WRONG = {
    "an arc is missing": lambda d: without(d, 0),
    "another kind": lambda d: renamed(d, "FOLD"),
    "also another kind": lambda d: renamed(d, "OPENS"),
    "another energy": lambda d: changed(d, 0, energies=d.arcs[0].energies + 1e-3),
    "another index": lambda d: changed(d, 0, index=2),
    "another point": lambda d: changed(
        d,
        1,
        points=d.arcs[1].points + np.outer(np.linspace(0, 1, len(d.arcs[1].points)), [0, 1e-2]),
    ),
    "another face": lambda d: changed(d, 0, active=d.arcs[1].active),
    "the other face": lambda d: changed(d, 1, active=d.arcs[0].active),
    "an arc twice": lambda d: replace(
        d, arcs=(d.arcs[0], replace(d.arcs[0], events=d.arcs[1].events))
    ),
    "an event elsewhere": lambda d: replace(
        d, events=tuple(replace(e, parameter=e.parameter + 1e-3) for e in d.events)
    ),
    "not closed": lambda d: replace(d, closed=False),
}


@pytest.mark.parametrize("change", WRONG)
def test_wrong_diagrams_are_not_proved(change):
    d = followed("corner limit")
    assert prove_branches(d).proved
    p = prove_branches(WRONG[change](d), box=BOX)
    assert not p.proved
    assert not p.complete


def test_saved_diagrams_are_proved_again(tmp_path):
    path = save_diagram(followed("fold"), tmp_path / "fold.json")
    assert prove_branches(load_diagram(path), box=BOX).complete


def test_what_is_not_enclosed_is_refused():
    d = Polyhedron(M1, AnyOf(x1 - 1, -x1))
    energy = SmoothFunction("energy", (x1 - t) ** 2, M1, parameters={"t": 2.0})
    found = branches(certify(d, energy, [2.0]), "t", (1.5, 3.0))
    with pytest.raises(ValueError, match="diagram: expected one of an intersection"):
        prove_branches(found)
    with pytest.raises(ValueError, match="gain"):
        BranchProofOptions(gain=1.0)


def test_a_wrong_multiplier_is_not_proved():
    d = followed("corner limit")
    (k,) = [k for k, arc in enumerate(d.arcs) if arc.active]
    wrong = {name: 1.01 * values for name, values in d.arcs[k].multipliers.items()}
    assert not prove_branches(changed(d, k, multipliers=wrong)).proved


def test_curves_that_are_not_connected_have_to_be_followed_for_completeness():
    """A double well that is tilted a little has three equilibria throughout."""
    well = (x1**2 - 1) ** 2 / 4 + t * x1 / 10
    energy = SmoothFunction("energy", well, M1, parameters={"t": 0.0})
    d = Polyhedron(M1, {"far": x1 + 10})
    starts = [certify(d, energy, [q]) for q in (-1.0, 0.0, 1.0)]
    one = prove_branches(branches(starts[:1], "t", (-1, 1)), box=[(-3, 3)], options=BRIEF)
    assert one.proved
    assert not one.complete
    assert len(one.open_boxes)
    # The others lie in the boxes that are left open.
    for start in starts[1:]:
        assert any((lo[0] <= start.point[0] <= hi[0]) for lo, hi in one.open_boxes)
    assert prove_branches(branches(starts, "t", (-1, 1)), box=[(-3, 3)]).complete
    # The two on the left are enough where the third is not searched.
    left = branches(starts[:2], "t", (-1, 1))
    assert prove_branches(left, box=[(-3, 0.5)]).complete


def test_a_bar_meets_a_stop_and_turns_back():
    """The bar of the page, with a moment ``m``.

    Free it stands at ``P = (x - m) / sin x``: it meets the stop at 0.8, and the curve on the left
    turns back where ``tan x = x - m``.
    """
    P, m = sympy.Symbol("P"), sympy.Rational(1, 10)

    def energy(value):
        formula = x1**2 / 2 + P * sympy.cos(x1) - m * x1
        return SmoothFunction("energy", formula, M1, parameters={"P": value})

    d = Polyhedron(M1, {"stop": sympy.Rational(4, 5) - x1, "wall": x1 + 2})
    starts = [minimise(d, energy(0.5), [0.1]), minimise(d, energy(1.4), [-1.2])]
    found = branches(starts, "P", (0.2, 1.5))
    p = prove_branches(found, box=[(-2, 1)])
    assert p.complete
    where = {e.kind.name: b for e, b in zip(found.events, p.parameters, strict=True)}
    met, turned = 0.7 / sin(0.8), float(sympy.nsolve(sympy.tan(x1) - x1 + m, x1, -0.6))
    for kind, value in (("CLOSES", met), ("FOLD", (turned - 0.1) / sin(turned))):
        low, high = where[kind]
        assert low - 1e-12 <= value <= high + 1e-12


def test_on_a_circle_and_with_several_parameters():
    """A pendulum in a field that turns: ``theta = a`` is the minimum and ``a + pi`` the maximum."""
    M = Manifold(("theta",), (2 * pi,))
    (theta,), (a, b) = M.symbols, sympy.symbols("a b")
    energy = SmoothFunction(
        "energy", -(1 + b) * sympy.cos(theta - a), M, parameters={"a": 0.0, "b": 0.0}
    )
    d = Polyhedron(M, {})
    starts = [certify(d, energy, [0.0]), stationary_on(d, energy, [3.0], ())]
    found = branches(starts, {"a": 1.0, "b": 0.5}, (0.0, 2.0))
    p = prove_branches(found, box=[None])
    assert p.complete
    assert len(found.arcs) == 2
    assert not prove_branches(
        branches(starts[:1], {"a": 1.0, "b": 0.5}, (0.0, 2.0)), box=[None], options=BRIEF
    ).complete


def test_with_an_equation():
    """On the unit circle, right of a wall that moves, under a weight: the lowest point is held."""
    M = Manifold.euclidean("x y")
    x, y = M.symbols
    wall = SmoothFunction("wall", x - t, M, parameters={"t": -0.5})
    d = Polyhedron(M, [wall], {"circle": x**2 + y**2 - 1})
    starts = [stationary_on(d, y, [0, s], ()) for s in (-1, 1)]
    found = branches(starts, "t", (-0.5, 0.5))
    p = prove_branches(found, box=[(-2, 2), (-2, 2)])
    # The upper corner is no equilibrium, the lower one is where the wall pushes; both points stay.
    kinds = sorted(e.kind.name for e in found.events if e.kind.name != "END")
    assert p.proved
    assert kinds == ["CLOSES", "CORNER_LIMIT"]
    for event, (low, high) in zip(found.events, p.parameters, strict=True):
        assert event.kind.name == "END" or low <= 0 <= high


def test_the_corner_of_two_dumbbells():
    """Two multipliers vanish at once at ``2 r sqrt(1 - r^2/l^2) - r``, by symmetry."""
    M = Manifold.euclidean("x y alpha beta")
    x, y, a, b = M.symbols
    h, r, (s, c) = 8, 3, (sympy.sin, sympy.cos)
    inner = (-2 * x + h * (s(a) + s(b)), -y + h * (c(a) + c(b)))

    def function(name, e):
        known = {"t": 2.85} if sympy.sympify(e).has(t) else {}
        return SmoothFunction(name, e, M, parameters=known)

    d = Polyhedron(
        M,
        [
            function("balls", inner[0] ** 2 + inner[1] ** 2 - 4 * r**2),
            function("A on b", (2 * x - h * s(a)) * c(b) - (y - h * c(a)) * s(b) - (r + t)),
            function("B on a", (2 * x - h * s(b)) * c(a) - (y - h * c(b)) * s(a) - (r + t)),
        ],
    )
    energy = function("energy", 2 * x**2 + h**2 * (s(a) ** 2 + s(b) ** 2))
    corner = stationary_on(d, energy, [1.5, 15.5, -0.19, -0.19], ("balls", "A on b", "B on a"))
    found = branches(corner, "t", (2.7, 2.95))
    swap = Symmetry(
        elements=[Element(lambda q: np.asarray(q)[..., [0, 1, 3, 2]],
                          {"A on b": "B on a", "B on a": "A on b"})]
    )  # fmt: skip
    p = prove_branches(found, symmetry=swap)
    assert p.proved
    (k,) = [k for k, e in enumerate(found.events) if e.kind.name == "CORNER_LIMIT"]
    low, high = p.parameters[k]
    assert low - 1e-15 <= 6 * sqrt(1 - (3 / 16) ** 2) - 3 <= high + 1e-15
    assert not prove_branches(found).proved


class Complementarity:
    """Minimise ``q'Kq/2 - (b + t c)'q`` where ``q >= 0``, with whole numbers, in the plane."""

    def __init__(self, seed):
        rng = np.random.default_rng(seed)
        K = rng.integers(-99, 100, (2, 2))  # so many that nothing vanishes by chance
        self.K = (K + K.T).tolist()
        self.b, self.c = rng.integers(-99, 100, (2, 2)).tolist()

    def equilibria(self, value):
        """Return faces and points of all strict equilibria at a rational value of ``t``."""
        K, f = self.K, [b + value * c for b, c in zip(self.b, self.c, strict=True)]
        found = []
        for held in (h for size in range(3) for h in combinations(range(2), size)):
            free = [i for i in range(2) if i not in held]
            q = [Fraction(0)] * 2
            if len(free) == 1:
                (i,) = free
                if not K[i][i]:
                    continue
                q[i] = Fraction(f[i]) / K[i][i]
            elif len(free) == 2:
                det = K[0][0] * K[1][1] - K[0][1] ** 2
                if not det:
                    continue
                q = [
                    Fraction(f[0] * K[1][1] - f[1] * K[0][1]) / det,
                    Fraction(f[1] * K[0][0] - f[0] * K[0][1]) / det,
                ]
            pull = [sum(K[i][j] * q[j] for j in range(2)) - f[i] for i in range(2)]
            if all(q[i] > 0 for i in free) and all(pull[i] > 0 for i in held):
                found.append((tuple(f"g{i}" for i in held), q))
        return found

    def start(self, value, q):
        M = Manifold.euclidean("x y")
        z = sympy.Matrix(M.symbols)
        energy = (z.T * sympy.Matrix(self.K) * z)[0] / 2
        energy -= sum((self.b[i] + t * self.c[i]) * z[i] for i in range(2))
        d = Polyhedron(M, {f"g{i}": z[i] for i in range(2)})
        known = {"t": float(value)}
        return certify(
            d, SmoothFunction("energy", energy, M, parameters=known), [float(v) for v in q]
        )


@pytest.mark.parametrize("seed", [0, 1, 2, 4, 5, 7])  # the others have no equilibria
def test_complementarity_problems_against_exact_enumeration(seed):
    problem = Complementarity(seed)
    values = [Fraction(2 * k + 1, 8) for k in range(-8, 8)]
    starts = [problem.start(v, q) for v in values for _, q in problem.equilibria(v)]
    box = [(-1, 5), (-1, 5)]
    found = branches(starts, "t", (-2.0, 2.0))
    p = prove_branches(found, box=box)
    assert p.proved
    for v in values:
        exact = problem.equilibria(v)
        there = [arc for arc in found.arcs if arc.parameters[0] < v < arc.parameters[-1]]
        assert sorted(arc.active for arc in there) == sorted(held for held, _ in exact)
    assert p.complete
    one = branches(starts[:1], "t", (-2.0, 2.0))
    if len(one.arcs) < len(found.arcs):
        assert not prove_branches(one, box=box, options=BRIEF).complete
