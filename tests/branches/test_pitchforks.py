"""Pitchforks: branch points that are known in closed form, their equations, and what is refused."""

import copy
from math import acos, pi, sin, sqrt

import numpy as np
import pytest
import sympy
from flint import arb
from proof_files import described, parts_of, rewritten, verdict

from polycorner import Manifold, Polyhedron, SmoothFunction, Symmetry, minimise, stationary_on
from polycorner.branches import BranchProofOptions, branches, prove_branches
from polycorner.branches.mirrors import Image, Mirror
from polycorner.branches.pitchforks import Divided
from polycorner.branches.tubes import CurveSystem, Setting
from polycorner.intervals.enclosures import Formulas
from polycorner.polyhedra import Element
from tests.branches.test_normal_forms import CASES, diagram
from tests.branches.test_proofs import WRONG

t = sympy.Symbol("t")
LINE, PLANE, SPACE = (Manifold.euclidean(names) for names in ("x", "x y", "x y z"))


def posed(manifold, functions, energy, value):
    def function(name, e):
        known = {"t": value} if sympy.sympify(e).has(t) else {}
        return SmoothFunction(name, e, manifold, parameters=known)

    d = Polyhedron(manifold, [function(name, e) for name, e in functions.items()])
    return d, function("energy", energy)


def bounds(proof, kind="BRANCH"):
    pairs = zip(proof.parameters, proof.diagram.events, strict=True)
    return [where for where, event in pairs if event.kind.name == kind]


def bar():
    """Return the diagram of a rigid bar with a spring and a stop on one side."""
    (x,) = LINE.symbols
    functions = {"stop": sympy.Rational(4, 5) - x, "wall": x + 2}
    d, energy = posed(LINE, functions, x**2 / 2 + t * sympy.cos(x), 0.5)
    return branches(minimise(d, energy, [0.1]), "t", (0.2, 1.5))


def test_a_bar_buckles_beside_a_stop():
    """It buckles at 1, and meets the stop where ``t = 0.8 / sin 0.8``; only one side has a stop."""
    proof = prove_branches(bar(), box=[(-2, 1)])
    assert proof.complete
    for kind, exact in (("BRANCH", 1.0), ("CLOSES", 0.8 / sin(0.8))):
        ((low, high),) = bounds(proof, kind)
        assert low - 1e-15 <= exact <= high + 1e-15
        assert high - low < 1e-12


def test_a_bead_on_a_hoop_that_turns():
    """Above ``t = w^2 R / g = 1`` it rests where ``cos theta = 1 / t``."""
    circle = Manifold(("theta",), (2 * pi,))
    (theta,) = circle.symbols
    d, energy = posed(circle, {}, -sympy.cos(theta) - t * sympy.sin(theta) ** 2 / 2, 0.3)
    starts = [stationary_on(d, energy, [q], ()) for q in (0.0, 3.0)]
    found = branches(starts, "t", (0.2, 3.0))
    proof = prove_branches(found, box=[None])
    assert proof.complete
    ((low, high),) = bounds(proof)
    assert low <= 1 <= high
    places = sorted(c.point[0] for c in found.at(2.0))
    np.testing.assert_allclose(places[-3:-1], [0, acos(0.5)], atol=1e-9)


def strut(limit=2):
    """Return a strut of two links with springs at its joints, from the first to the second load."""
    a, b = PLANE.symbols
    functions = {"a low": a + limit, "a high": limit - a, "b low": b + limit, "b high": limit - b}
    energy = (a**2 + (b - a) ** 2) / 2 + t * (sympy.cos(a) + sympy.cos(b))
    d, energy = posed(PLANE, functions, energy, 0.2)
    return branches(minimise(d, energy, [0, 0]), "t", (0.1, 3.2))


def test_a_strut_buckles_at_the_eigenvalues_of_its_stiffness():
    proof = prove_branches(strut())
    assert proof.proved
    loads = np.linalg.eigvalsh([[2, -1], [-1, 1]])
    np.testing.assert_allclose(loads, [(3 - sqrt(5)) / 2, (3 + sqrt(5)) / 2])
    for (low, high), load in zip(bounds(proof), loads, strict=True):
        assert low - 1e-14 <= load <= high + 1e-14


def groove():
    """Return a ball that presses both sides of a groove, by a weight that slides across it.

    The mirror exchanges the sides and takes ``z`` to ``-z``.
    """
    x, y, z = SPACE.symbols
    energy = y + z**4 / 4 - t * z**2 / 2 + x * z / 4
    d, energy = posed(SPACE, {"left": y + x + 1, "right": y - x + 1}, energy, -0.5)
    return branches(stationary_on(d, energy, [0, -1, 0], ("left", "right")), "t", (-1.0, 1.0))


def swapped(sign):
    """Return where two coordinates cease to be equal; the sum moves with the parameter."""
    x, y = PLANE.symbols
    u, v = x - y, x + y
    energy = sign * (u**4 / 4 - t * u**2 / 2) + v**2 / 2 + v * t / 3 + u**2 * v / 20
    d, energy = posed(PLANE, {"far": v + 10}, energy, -0.5)
    return branches(stationary_on(d, energy, [0.08, 0.08], ()), "t", (-0.6, 0.1))


def constrained(equations, value):
    """Return where ``z`` leaves 0 on a curve: at -2 with the first equations, else at -1/2.

    On the curve ``x + y = 2 z^2, x - y = 2 z`` or ``x + y = z^2, x - y = z`` the energy is
    ``-(t + 2) z^2 / 2 + ...`` or ``-(t + 1/2) z^2 / 2 + ...``.
    """
    x, y, z = SPACE.symbols
    formula = z**4 / 4 - t * z**2 / 2 + x * y + (x + y) ** 2
    energy = SmoothFunction("energy", formula, SPACE, parameters={"t": value})
    d = Polyhedron(SPACE, {}, equations)
    return branches(stationary_on(d, energy, [0, 0, 0], ()), "t", (value, value + 1.5))


def exchanged():
    """Return a curve of two equations that the mirror exchanges."""
    x, y, z = SPACE.symbols
    return constrained({"one": x - z - z**2, "two": y + z - z**2}, -3.0)


def turned():
    """Return a curve of two equations, of which the mirror changes the sign of one."""
    x, y, z = SPACE.symbols
    return constrained({"odd": x - y - z, "even": x + y - z**2}, -1.0)


MADE = {
    "exchanged": exchanged,
    "turned": turned,
    "bar": bar,
    "groove": groove,
    "swap": lambda: swapped(1),
    "unstable": lambda: swapped(-1),
}


@pytest.mark.parametrize("name", MADE)
def test_symmetries_are_found_and_pitchforks_verified(name, tmp_path):
    proof = prove_branches(MADE[name]())
    assert proof.proved
    ((low, high),) = bounds(proof)
    exact = {"bar": 1.0, "groove": 0.0, "exchanged": -2.0, "turned": -0.5}
    assert low - 1e-15 <= exact.get(name, low) <= high + 1e-15
    fine, line = verdict(proof.save(tmp_path / "proof.zip"))
    assert fine, line
    assert "branch between" in line


def test_a_symmetry_that_is_given_is_used():
    x, _ = PLANE.symbols
    _, formula, start, value, *_ = CASES["pitchfork"]
    d, energy = posed(PLANE, {"a": 5 - x, "b": 5 + x}, formula, value)
    mirror = Symmetry(elements=[Element(lambda q: q * [-1, 1], {"a": "b", "b": "a"})])
    none = BranchProofOptions(most_images=1)  # that moves least, the identity for most of them
    found = branches(minimise(d, energy, start), "t", (-1.0, 1.0))
    assert prove_branches(found, symmetry=mirror, options=none).proved


def test_what_has_no_symmetry_is_declined():
    """Two curves cross at 0, where ``x^3 + x^4 = t x``: a pitchfork only to lowest order."""
    (x,) = LINE.symbols
    d, energy = posed(LINE, {"far": x + 3}, x**4 / 4 + x**5 / 5 - t * x**2 / 2, -0.5)
    found = branches(minimise(d, energy, [0.0]), "t", (-0.5, 0.1))
    proof = prove_branches(found)
    assert not proof.proved
    (reason,) = [
        r for r, e in zip(proof.events, found.events, strict=True) if e.kind.name == "BRANCH"
    ]
    assert reason == "the branch point: no symmetry of the formulas shows a pitchfork"


@pytest.mark.parametrize(
    "change", ["an arc is missing", "another kind", "another index", "an event elsewhere"]
)
def test_wrong_pitchforks_are_not_proved(change):
    functions, energy, start, value, *_ = CASES["pitchfork"]
    d = diagram(functions, energy, start, value)
    assert not prove_branches(WRONG[change](d)).proved


def test_an_arm_instead_of_the_other_is_not_proved():
    """The two arms are images of each other, but they are two."""
    functions, energy, start, value, *_ = CASES["pitchfork"]
    d = diagram(functions, energy, start, value)
    arms = [k for k, arc in enumerate(d.arcs) if abs(arc.points[:, 0]).max() > 0.1]
    assert len(arms) == 2
    arcs = list(d.arcs)
    arcs[arms[0]] = copy.copy(d.arcs[arms[1]])
    assert not prove_branches(type(d)(**(vars(d) | {"arcs": tuple(arcs)}))).proved


def test_forged_symmetries_and_arms_are_refused(tmp_path):
    path = prove_branches(bar()).save(tmp_path / "bar.zip")
    data, parts = described(path), parts_of(path)
    mirror = {"order": [0], "signs": [-1], "functions": [-1, -1], "equations": []}
    assert data["symmetries"] == [mirror]
    for symmetries in (
        [],
        [mirror | {"signs": [1]}],
        [mirror | {"functions": [0, -1]}],
        [mirror | {"functions": [1, 0]}],
        [mirror | {"functions": [-1]}],
        [mirror | {"functions": [-2, -1]}],
        [mirror | {"functions": [True, -1]}],
        [mirror | {"equations": [[0, 1]]}],
    ):
        told = data | {"symmetries": symmetries}
        assert not verdict(rewritten(tmp_path / "forged.zip", told, parts))[0], symmetries
    (number,) = [k for k, e in enumerate(data["events"]) if e["kind"] == "branch"]
    there = [k for k, arc in enumerate(data["arcs"]) if number in arc["events"]]
    assert len(there) == 4
    for one in there:
        told = copy.deepcopy(data)
        side = told["arcs"][one]["events"].index(number)
        told["arcs"][one]["zeros"][side] = [told["inequalities"] + 3]
        assert not verdict(rewritten(tmp_path / "forged.zip", told, parts))[0]
        for two in there:
            if one != two:
                told = copy.deepcopy(data)
                told["arcs"][one]["points"] = data["arcs"][two]["points"]
                assert not verdict(rewritten(tmp_path / "forged.zip", told, parts))[0]
    energy = copy.deepcopy(data)
    (cosine,) = [k for k, node in enumerate(energy["nodes"]) if node[0] == "cos"]
    energy["nodes"][cosine][0] = "sin"
    assert not verdict(rewritten(tmp_path / "forged.zip", energy, parts))[0]


def test_signs_of_equations_are_checked(tmp_path):
    path = prove_branches(turned()).save(tmp_path / "turned.zip")
    data, parts = described(path), parts_of(path)
    (mirror,) = data["symmetries"]
    assert sorted(mirror["equations"]) == [[0, -1], [1, 1]]
    for equations in ([], [[0, 1], [1, 1]], [[0, -1]], [[0, -1], [0, -1]], [[1, 1], [0, -1]]):
        told = data | {"symmetries": [mirror | {"equations": equations}]}
        assert not verdict(rewritten(tmp_path / "forged.zip", told, parts))[0], equations


# ------------------------------------------------------------------------------------ the equations


class TestDividedEquations:
    """Equations, derivatives and the change with ``e^2 / 2``, against SymPy's quotients."""

    x, y, z = SPACE.symbols
    energy = (
        (x**2 + y * z) ** 2 / 4 + sympy.exp(z - y) * x + sympy.exp(y - z) * -x + t * x * (y - z)
    )
    energy += sympy.cos(x * (y - z)) + (y + z) * t
    functions = (y + 2 * z + x * z, z + 2 * y - x * y)  # exchanged by x -> -x, y <-> z
    weights = (0.5, 0.5, 2.0)
    mirror = Mirror.of(Image((0, 2, 1), (-1, 1, 1), (1, 0)), (0, 1), 4)
    at = (0.75, 0.5, -0.25, 0.25, 0.3125, -0.125, 1.0)  # adapted coordinates

    def divided(self, eps):
        known = {"t": 0.0}
        functions = [
            SmoothFunction(f"f{k}", f, SPACE, parameters=known if f.has(t) else {})
            for k, f in enumerate((*self.functions, self.energy))
        ]
        setting = Setting(
            Formulas(functions, SPACE, ("t", "pin")), 2, (), (0,), (1,), self.weights, (1.0,) * 4
        )
        system = CurveSystem(setting, (0, 1)).coordinate(0)
        return Divided(system, self.mirror, 0, arb(0, eps))

    def quotients(self):
        """Return the divided equations in SymPy, of symbols ``y`` and ``e``."""
        e, ys = sympy.Symbol("e"), sympy.symbols("y:7")
        a, b, c, d, m, k, m0 = ys
        # x is odd; y and z have halves, so do the multipliers
        place = {self.x: e * a, self.y: b + e * c, self.z: b - e * c, t: d}
        mu = (m + e * k, m - e * k, m0)
        signed = [s * w * v for s, w, v in zip((-1, -1, 1), self.weights, mu, strict=True)]
        every = (*self.functions, self.energy)
        F = [
            sum(w * sympy.diff(f, q) for w, f in zip(signed, every, strict=True)).subs(place)
            for q in (self.x, self.y, self.z)
        ]
        G = [f.subs(place) for f in self.functions]
        half = sympy.Rational(1, 2)
        return [
            F[0] / e, (F[1] + F[2]) * half, (F[1] - F[2]) * half / e,
            (G[0] + G[1]) * half, (G[0] - G[1]) * half / e, sum(mu) - 1, a - 1,
        ], ys, e  # fmt: skip

    def values(self, formulas, ys, e, eps):
        point = dict(zip(ys, map(sympy.Rational, self.at), strict=True))
        return [float(sympy.N(f.subs(point).subs(e, eps), 30)) for f in formulas]

    def test_the_symmetry_is_one(self):
        moved = {self.x: -self.x, self.y: self.z, self.z: self.y}
        some = [f.subs(moved, simultaneous=True) for f in (*self.functions, self.energy)]
        pairs = zip(some, (*self.functions[::-1], self.energy), strict=True)
        assert all(sympy.expand(a - b) == 0 for a, b in pairs)

    @pytest.mark.parametrize("eps", [0.0625, 0.001])
    def test_they_enclose_quotients(self, eps):
        formulas, ys, e = self.quotients()
        there = self.divided(eps).at([arb(v) for v in self.at])
        exact = self.values(formulas, ys, e, sympy.Rational(eps))
        for k, value in enumerate(exact):
            found = there.residual[k]
            assert found.overlaps(arb(value, 1e-12)), k
            assert found.rad() < 30 * eps**2 + 1e-12
            for c, y in enumerate(ys):
                (slope,) = self.values([sympy.diff(formulas[k], y)], ys, e, sympy.Rational(eps))
                assert there.jacobian[k][c].overlaps(arb(slope, 1e-11)), (k, c)
                assert there.jacobian[k][c].rad() < 60 * eps

    def test_they_change_with_half_the_square(self):
        formulas, ys, e = self.quotients()
        eps = sympy.Rational(1, 64)
        found = self.divided(float(eps)).change([arb(v) for v in self.at])
        for k in range(6):
            slope = self.values([sympy.diff(formulas[k], e) / e], ys, e, eps / 2)[0]
            assert found[k].overlaps(arb(slope, 1e-9)), k
