"""Curves of events in the plane of two parameters, against closed forms and exact enumeration."""

from itertools import combinations

import numpy as np
import pytest
import sympy

from polycorner import Manifold, Polyhedron, SmoothFunction, certify, minimise
from polycorner.branches import EventMap, MeetingKind, branches, event_curves

LINE = Manifold.euclidean("x")
(x,) = LINE.symbols
a, b = sympy.symbols("a b")


def cusp(stop):
    """Events of ``x^4/4 + a x^2/2 + b x`` where ``x <= stop``."""
    known = {"a": -1.0, "b": 0.1}
    energy = SmoothFunction("energy", x**4 / 4 + a * x**2 / 2 + b * x, LINE, parameters=known)
    start = minimise(Polyhedron(LINE, {"stop": stop - x}), energy, [-1.0])
    return event_curves(branches(start, "b", (-2.0, 2.0)), "a", (-2.0, 1.0))


def curves(found, kind):
    return [curve for curve in found.curves if curve.kind.name == kind]


def meeting(found, kind):
    (one,) = [m for m in found.meetings if m.kind is kind]
    return one


def test_folds_form_a_cusp():
    """They lie where ``4 a^3 + 27 b^2 = 0``; three equilibria are inside."""
    found = cusp(5.0)
    assert found.closed
    assert len(curves(found, "FOLD")) == len(found.curves) == 2
    for curve in found.curves:
        s, r = curve.parameters.T
        np.testing.assert_allclose(4 * r**3 + 27 * s**2, 0, atol=1e-12)
        np.testing.assert_allclose(curve.points[:, 0] ** 2, -r / 3, atol=1e-7)
    np.testing.assert_allclose(meeting(found, MeetingKind.CUSP).parameters, 0, atol=1e-8)
    for s, r in np.random.default_rng(0).uniform([-2, -2], [2, 1], (40, 2)):
        assert found.minima(s, r) == (2 if 4 * r**3 + 27 * s**2 < 0 else 1)


def test_a_fold_ends_at_a_stop():
    """At ``x = c``, on the line ``c^3 + a c + b = 0``, which it touches in ``a = -3 c^2``."""
    c = 0.5
    found = cusp(c)
    assert found.closed
    assert sorted(curve.kind.name for curve in found.curves) == [
        "CORNER_LIMIT", "FOLD", "FOLD", "OPENS",
    ]  # fmt: skip
    ends = meeting(found, MeetingKind.FOLD_AT_CONTACT)
    np.testing.assert_allclose(ends.parameters, [2 * c**3, -3 * c**2], atol=1e-9)
    assert ends.functions == ("stop",)
    for kind, side in (("CORNER_LIMIT", -1), ("OPENS", 1)):
        (curve,) = curves(found, kind)
        s, r = curve.parameters.T
        np.testing.assert_allclose(s + c * r + c**3, 0, atol=1e-12)
        assert (side * (r + 3 * c**2) >= -1e-9).all()
    for s, r in np.random.default_rng(1).uniform([-2, -2], [2, 1], (60, 2)):
        roots = np.roots([1, 0, r, s])
        real = roots[abs(roots.imag) < 1e-9].real
        inside = sum((q < c) and (3 * q**2 + r > 0) for q in real)
        assert found.minima(s, r) == inside + (c**3 + r * c + s < 0)


class Orthant:
    """Minimise ``q'Kq/2 - (b + t c + r e)'q`` where ``q >= lower``."""

    def __init__(self, seed):
        rng = np.random.default_rng(seed)
        self.n = n = 3
        K = rng.normal(size=(n, n))
        self.K = K + K.T + np.eye(n)
        (self.b, self.c, self.e), self.lower = rng.normal(size=(3, n)), -rng.random(n)
        self.manifold = Manifold.euclidean(" ".join(f"x{i}" for i in range(n)))

    def equilibria(self, s, r):
        """Return triples of held coordinates, point and whether it is a minimum."""
        force = self.b + s * self.c + r * self.e
        for held in (c for k in range(self.n + 1) for c in combinations(range(self.n), k)):
            free = [i for i in range(self.n) if i not in held]
            q, block = self.lower.copy(), self.K[np.ix_(free, free)]
            q[free] = np.linalg.solve(block, force[free] - self.K[free][:, held] @ q[list(held)])
            pressed = (self.K @ q - force)[list(held)]
            if (q[free] > self.lower[free]).all() and (pressed > 0).all():
                yield held, q, bool((np.linalg.eigvalsh(block) > 0).all())

    def diagram(self, bounds):
        """Return the diagram from all equilibria at several values of ``s``."""
        q, (s, r) = sympy.Matrix(self.manifold.symbols), sympy.symbols("s r")
        energy = (q.T * sympy.Matrix(self.K) * q)[0] / 2
        energy -= sum((self.b[i] + s * self.c[i] + r * self.e[i]) * q[i] for i in range(self.n))
        d = Polyhedron(self.manifold, {f"g{i}": q[i] - self.lower[i] for i in range(self.n)})
        starts = []
        for value in np.linspace(*bounds, 9)[1:-1]:
            known = {"s": float(value), "r": 0.0}
            function = SmoothFunction("energy", energy, self.manifold, parameters=known)
            starts += [certify(d, function, p) for _, p, _ in self.equilibria(value, 0.0)]
        return branches(starts, "s", bounds)


@pytest.mark.parametrize("seed", [0, 2, 6, 8])
def test_linear_complementarity_problems(seed):
    """Equilibria left and right of every curve, and all minima, against trying all faces."""
    problem = Orthant(seed)
    found = event_curves(problem.diagram((-2.0, 2.0)), "r", (-2.0, 2.0))
    assert found.closed
    for curve in found.curves:
        names = [f"g{i}" for i in range(problem.n)]
        one, two = curve.parameters[[0, -1]]
        np.testing.assert_allclose(
            np.cross(np.c_[curve.parameters - one, np.zeros(len(curve.points))], [*two - one, 0]),
            0, atol=1e-9,
        )  # fmt: skip
        way = (two - one) / np.linalg.norm(two - one)
        sides = []
        for side in (1, -1):
            place = (0.37 * one + 0.63 * two) + side * 1e-6 * np.array([-way[1], way[0]])
            faces = [(held, low) for held, _, low in problem.equilibria(*place)]
            held = {names.index(name) for name in curve.active}
            (weak,) = [names.index(name) for name in curve.functions]
            pair = [tuple(sorted(held)), tuple(sorted(held | {weak}))]
            sides.append([low for face, low in faces if face in pair])
        assert curve.gain == sum(sides[0]) - sum(sides[1])
        counts = sorted(map(len, sides))
        assert counts == ([1, 1] if curve.kind.name == "OPENS" else [0, 2])
        assert curve.kind.name in {"OPENS", "CORNER_LIMIT"}
    for place in np.random.default_rng(seed).uniform(-2, 2, (50, 2)):
        exact = sum(low for _, _, low in problem.equilibria(*place))
        assert found.minima(*place) == exact


def test_a_truss_with_a_stop():
    """Two bars of length ``L0 = sqrt(1 + h^2)`` carry a weight ``P``; the hinge may meet a stop.

    At ``x = 0`` let ``L = sqrt(1 + y^2)``: then ``P = 2 y (L0/L - 1)``, which is greatest where
    ``L^3 = L0``; and ``E_xx = 0``, where the hinge evades to a side, if ``L0 - L = L/(L^2 - 1)``.
    """
    plane = Manifold.euclidean("x y")
    p, q = plane.symbols
    P, h = sympy.symbols("P h")
    rest, stop = sympy.sqrt(1 + h**2), 0.8
    bars = [sympy.sqrt((p + side) ** 2 + q**2) - rest for side in (1, -1)]
    energy = sum(bar**2 / 2 for bar in bars) + P * q
    load = SmoothFunction("energy", energy, plane, parameters={"P": 0.1, "h": 2.7})
    d = Polyhedron(plane, {"stop": q - stop})
    diagram = branches(minimise(d, load, [0.0, 2.6]), "P", (0.0, 4.0))
    found = event_curves(diagram, "h", (1.0, 3.0))
    assert found.closed
    assert {c.kind.name for c in found.curves} == {"BRANCH", "FOLD", "OPENS", "CORNER_LIMIT"}
    for curve in found.curves:
        (weight, h), (across, y) = curve.parameters.T, curve.points.T
        L0, L = np.sqrt(1 + h**2), np.hypot(1, y)
        symmetric = abs(across).max() < 1e-8
        if symmetric:
            np.testing.assert_allclose(weight, 2 * y * (L0 / L - 1), atol=1e-9)
        if curve.kind.name == "BRANCH":
            np.testing.assert_allclose(L0 - L, L / (L**2 - 1), atol=1e-9)
        elif curve.kind.name == "FOLD" and symmetric:
            np.testing.assert_allclose(L**3, L0, atol=1e-9)
        elif curve.functions == ("stop",):
            np.testing.assert_allclose(y, stop, atol=1e-12)
    ends = [m for m in found.meetings if m.kind is MeetingKind.FOLD_AT_CONTACT]
    (end,) = [m for m in ends if abs(m.point[0]) < 1e-8]
    assert np.hypot(1, end.parameters[1]) == pytest.approx((1 + stop**2) ** 1.5, abs=1e-8)
    # Folds and branch points cross where both hold: L^3 = L0 and L0 - L = L/(L^2 - 1).
    both = meeting(found, MeetingKind.FOLD_AT_BRANCH)
    np.testing.assert_allclose(both.parameters, [2.0, np.sqrt(7.0)], atol=1e-7)
    assert len(both.curves) == 4


PLANE = Manifold.euclidean("x y")
X, Y = PLANE.symbols
t, r = sympy.symbols("t r")
# Functions, energy, start, the parameter t there, kind, and where the events are: t - where(r) = 0.
FORMS = {
    "contacts exchanged": (
        {"a": Y - X, "b": Y + X - r, "c": Y - t}, Y + X / 10, (0, 0.1), -0.5,
        "EXCHANGE", lambda r: r / 2,
    ),
    "a triangle vanishes": (
        {"a": Y - X, "b": Y + X - r, "c": t - Y}, Y + X / 10, (0, 0.1), 0.5,
        "VANISHES", lambda r: r / 2,
    ),
    "a lens vanishes": (
        {"a": 1 + t - (X - 1 - r) ** 2 - Y**2, "b": 1 - (X + 1) ** 2 - Y**2}, Y, (0, -0.2), 0.5,
        "VANISHES", lambda r: (1 + r) ** 2 - 1,
    ),
    "a neck opens": (
        {"a": (X - 1 - r) ** 2 + Y**2 - 1 - t, "b": (X + 1) ** 2 + Y**2 - 1 - t}, Y, (0, 1), 0.5,
        "DEPENDENT", lambda r: (1 + r / 2) ** 2 - 1,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", FORMS)
def test_curves_on_which_no_curvature_vanishes(name):
    functions, energy, start, value, kind, where = FORMS[name]
    known = {"t": value, "r": 0.0}

    def made(name, expression):
        used = {str(s): known[str(s)] for s in (t, r) if sympy.sympify(expression).has(s)}
        return SmoothFunction(name, expression, PLANE, parameters=used)

    d = Polyhedron(PLANE, [made(name, f) for name, f in functions.items()])
    diagram = branches(minimise(d, made("energy", energy), start), "t", (-0.8, 0.8))
    found = event_curves(diagram, "r", (-0.3, 0.3))
    assert found.closed
    assert {curve.kind.name for curve in found.curves} == {kind}
    for curve in found.curves:
        np.testing.assert_allclose(curve.parameters[:, 0], where(curve.parameters[:, 1]), atol=1e-9)
    assert {meeting.kind for meeting in found.meetings} == {MeetingKind.END}
    exchanged = name == "contacts exchanged"
    for place in ((-0.2, 0.1), (0.2, 0.1), (0.1, 0.0), (-0.1, 0.0)):
        beyond = (place[0] > where(place[1])) == (value > 0)
        assert found.minima(*place) == (1 if beyond or exchanged else 0)


def test_a_closed_curve():
    """A wall that stands at ``1 - a^2 - b^2`` is touched inside of a circle."""
    known = {"a": 0.1, "b": 0.2}
    wall = SmoothFunction("wall", x - 1 + a**2 + b**2, LINE, parameters=known)
    spring = SmoothFunction("energy", x**2, LINE)
    diagram = branches(minimise(Polyhedron(LINE, wall), spring, [2.0]), "a", (-1.7, 1.8))
    found = event_curves(diagram, "b", (-1.5, 2.0))
    (curve,) = found.curves
    assert found.closed
    assert curve.kind.name == "OPENS"
    assert curve.meetings == (-1, -1)
    np.testing.assert_allclose((curve.parameters**2).sum(axis=1), 1, atol=1e-12)
    angles = np.unwrap(np.arctan2(*curve.parameters.T))
    assert abs(angles[-1] - angles[0]) > 0.8 * 2 * np.pi
    assert found.minima(0, 0) == found.minima(1.5, 1.5) == 1


def test_a_neck_closes_on_a_floor():
    """Two discs that overlap for ``t > 0`` meet at heights ``+-sqrt(t)``, a floor is at ``r``."""
    known = {"t": 0.4, "r": 0.2}
    formulas = {
        "a": ((X - 1) ** 2 + Y**2 - 1 - t, "t"),
        "b": ((X + 1) ** 2 + Y**2 - 1 - t, "t"),
        "floor": (Y - r, "r"),
    }
    walls = [
        SmoothFunction(name, formula, PLANE, parameters={used: known[used]})
        for name, (formula, used) in formulas.items()
    ]
    energy = SmoothFunction("energy", Y + X**2 / 10 + X / 20, PLANE)
    diagram = branches(minimise(Polyhedron(PLANE, walls), energy, [0, 1]), "t", (-0.8, 0.8))
    found = event_curves(diagram, "r", (-0.5, 0.5))
    assert found.closed
    end = meeting(found, MeetingKind.DEPENDENT)
    np.testing.assert_allclose(end.parameters, 0, atol=1e-9)
    assert len(end.curves) == 3
    for curve in (found.curves[k] for k in end.curves):
        s, low = curve.parameters.T
        np.testing.assert_allclose(s, 0 if curve.kind.name == "DEPENDENT" else low**2, atol=1e-9)
        assert (low * (1 if curve.kind.name == "EXCHANGE" else -1) > -1e-9).all()


@pytest.mark.parametrize("seed", [0, 3, 9, 15])
def test_minima_gained_around_a_loop_are_lost_again(seed):
    """Quartic energies in moving pentagons with curved sides; one with a cusp that turns fast."""
    s, r = sympy.symbols("s r")
    rng, known = np.random.default_rng(seed), {"s": 0.05, "r": 0.0}

    def made(name, expression):
        used = {str(v): known[str(v)] for v in (s, r) if expression.has(v)}
        return SmoothFunction(name, expression, PLANE, parameters=used)

    sides = []
    for k in range(5):
        angle = 2 * np.pi * (k + 0.3 * rng.random()) / 5
        side = 1 + 0.2 * rng.random() + 0.3 * rng.normal() * s + 0.3 * rng.normal() * r
        side -= np.cos(angle) * X + np.sin(angle) * Y + 0.1 * rng.normal() * X * Y
        sides.append(made(f"f{k}", side))
    powers = [X, Y, X**2, X * Y, Y**2, X**3, X**2 * Y, X * Y**2, Y**3, X**4, Y**4]
    energy = sum(c * p for c, p in zip(rng.normal(size=len(powers)), powers, strict=True))
    energy += s * (X * rng.normal() + Y * rng.normal())
    energy += r * (X * rng.normal() + Y * rng.normal() + X**2 * rng.normal() / 2)
    d, function = Polyhedron(PLANE, sides), made("energy", energy)
    starts = [minimise(d, function, q) for q in ([0, 0], [0.5, 0.5], [-0.5, 0.3])]
    found = event_curves(branches(starts, "s", (-1.0, 1.0)), "r", (-1.0, 1.0))
    assert found.closed
    for corner in rng.uniform(-1, 1, (40, 3, 2)).tolist():
        total = 0
        for one, two in zip(corner, corner[1:] + corner[:1], strict=True):
            there = EventMap(**{**vars(found), "known": (*one, 0)})
            total += there.minima(*two)
        assert total == 0
