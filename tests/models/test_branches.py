"""Mechanical problems whose equilibria over a parameter have closed forms."""

import copy
import pickle

import numpy as np
import pytest
import sympy
from elsewhere import called
from numpy.polynomial import Polynomial
from scipy.optimize import brentq
from sympy import cos, sin, sqrt

from polycorner import Manifold, Polyhedron, SmoothFunction, minimise, stationary_on
from polycorner.branches import branches
from polycorner.formulas import Family
from polycorner.models import Pinball, SphereCluster, TorusDisks, Tutorial
from polycorner.models.wells.wells import Well


def problem(manifold, functions, energy, parameter, value, equations=()):
    """Return a polyhedron and an energy with a parameter at a value."""

    def function(name, expression):
        known = {parameter: value} if sympy.sympify(expression).has(P) else {}
        return SmoothFunction(name, expression, manifold, parameters=known)

    held = [function(*pair) for pair in functions.items()]
    return Polyhedron(manifold, held, list(equations)), function("energy", energy)


P = sympy.Symbol("P")


def told(diagram):
    """Return kinds and values of the events but the ends of the interval."""
    return [(e.kind.name, e.parameter) for e in diagram.events if e.kind.name != "END"]


def assert_events(diagram, expected):
    assert diagram.closed
    assert [kind for kind, _ in told(diagram)] == [kind for kind, _ in expected]
    np.testing.assert_allclose([v for _, v in told(diagram)], [v for _, v in expected], atol=1e-8)


def test_shallow_truss_with_a_stop():
    """Two bars of stiffness 1 and half span 1 are pressed down by P.

    With the length ``L`` of a bar at the height ``y`` the load is ``P = 2 y (L0/L - 1)``, whose
    largest value is at ``L^3 = L0``.  A stop in the part where the height falls with the load
    catches the truss: the unstable equilibrium and the one on the stop meet there.
    """
    rest, stop = np.sqrt(1 + 0.2**2), 0.03
    load = lambda y: 2 * y * (rest / np.hypot(1, y) - 1)  # noqa: E731 - a formula
    M = Manifold.euclidean("y")
    (y,) = M.symbols
    energy = (sqrt(1 + y**2) - rest) ** 2 + P * y
    D, E = problem(M, {"stop": y - stop}, energy, "P", 0.0)
    # Both in units of a tenth of the bars' strain energy at most.
    d = branches(minimise(D, E, [0.19]), "P", (-0.001, 0.01))
    top = np.sqrt(rest ** (2 / 3) - 1)
    assert_events(d, [("CORNER_LIMIT", load(stop)), ("FOLD", load(top))])
    assert sorted((arc.index, arc.active) for arc in d.arcs) == [(0, ()), (0, ("stop",)), (1, ())]


def arch(u0, b, c, s):
    """Return a shallow arch over a wedge: amplitudes ``u`` and ``v`` of its first two modes."""
    M = Manifold.euclidean("u v")
    u, v = M.symbols
    energy = (u - u0) ** 2 / 2 + 8 * v**2 + b / 4 * (u**2 + 4 * v**2 - u0**2) ** 2 + P * u
    return M, {"left": u - s + c * v, "right": u - s - c * v}, energy


def equilibria_of_the_arch(value, u0, b, c, s):
    """Return all equilibria ``(u, v, active)``, from the definition."""
    slope_u = lambda u, v: u - u0 + b * (u * u + 4 * v * v - u0 * u0) * u + value  # noqa: E731
    slope_v = lambda u, v: 16 * v + 4 * b * (u * u + 4 * v * v - u0 * u0) * v  # noqa: E731
    found = []
    u = Polynomial([0, 1])
    found += [(r, 0.0, ()) for r in (u - u0 + b * (u**2 - u0**2) * u + value).roots()]
    # Else 16 + 4 b (...) = 0, and the first slope is u - u0 - 4 u + P.
    on = (value - u0) / 3
    v2 = (u0 * u0 - 4 / b - on * on) / 4
    found += [(on, g * np.sqrt(v2), ()) for g in (1, -1) if v2 > 0]
    for g, name in ((1, "left"), (-1, "right")):  # u = s - g c v
        v = Polynomial([0, 1])
        u = s - g * c * v
        along = -g * c * slope_u(u, v) + slope_v(u, v)
        for r in along.roots():
            if abs(r.imag) < 1e-12 and slope_u(u(r.real), r.real) > 0:
                found.append((u(r.real), r.real, (name,)))
    corner = np.linalg.solve([[1, 1], [c, -c]], [slope_u(s, 0), slope_v(s, 0)])
    if (corner > 0).all():
        found.append((s, 0.0, ("left", "right")))
    real = [(np.real(x), np.real(y), a) for x, y, a in found if abs(np.imag(x)) < 1e-12]
    gaps = lambda x, y: (x - s + c * y, x - s - c * y)  # noqa: E731
    return [(x, y, a) for x, y, a in real if min(gaps(x, y)) > -1e-9]


def test_arch_on_a_wedge():
    """The arch buckles to either side and leans on a face of the wedge.

    The antisymmetric mode appears at ``u^2 = u0^2 - 4/b``, with ``P = u0 + 3 u`` afterwards.
    """
    known = (3.0, 1.0, 1.0, -0.4)
    u0, b, c, s = known
    M, functions, energy = arch(*known)
    D, E = problem(M, functions, energy, "P", 1.0)
    d = branches(minimise(D, E, [u0, 0.0]), "P", (-9.0, 20.0))
    assert d.closed
    radius = np.sqrt(u0**2 - 4 / b)
    assert ("BRANCH", pytest.approx(u0 + 3 * radius, abs=1e-8)) in told(d)
    # On the wedge u - s = c |v|, with u^2 + 4 v^2 = radius^2.
    touch = (Polynomial([0, 1]) ** 2 + 4 / c**2 * Polynomial([-s, 1]) ** 2 - radius**2).roots()
    where = u0 + 3 * max(touch)
    touching = [e for e in d.events if e.functions in {("left",), ("right",)}]
    assert [e.parameter for e in touching if abs(e.parameter - where) < 1e-7] != []
    for value in np.linspace(-8.9, 19.9, 15):
        expected = equilibria_of_the_arch(value, *known)
        found = [(*q.point, tuple(sorted(q.active))) for q in d.at(value)]
        for x, y, active in found:
            assert any(np.hypot(x - p, y - q) < 1e-6 and active == a for p, q, a in expected)
        assert len(found) == len(expected)


def test_ladder_between_walls():
    """A ladder leans against a wall without friction, its foot on a spring.

    With the foot at ``x = l cos(a)`` its weight is ``W = 2 k l (sin a - x0/l tan a)``, which is
    largest where ``cos^3 a = x0/l``; at ``W = 0`` it also rests on the floor.
    """
    length, k, rest = 2.0, 1.5, 0.5
    M = Manifold.euclidean("x y")
    x, y = M.symbols
    energy = P * y / 2 + k / 2 * (x - rest) ** 2
    rod = SmoothFunction("rod", x**2 + y**2 - length**2, M)
    D, E = problem(M, {"wall": x, "floor": y}, energy, "P", 1.0, [rod])
    a = brentq(lambda a: 2 * k * (length * np.sin(a) - rest * np.tan(a)) - 1.0, 1.0, 1.5)
    start = stationary_on(D, E, [length * np.cos(a), length * np.sin(a)], [])
    d = branches(start, "P", (-1.0, 6.0))
    steep = np.arccos((rest / length) ** (1 / 3))
    most = 2 * k * (length * np.sin(steep) - rest * np.tan(steep))
    assert_events(d, [("CORNER_LIMIT", 0.0), ("FOLD", most)])
    assert sorted((arc.index, arc.active) for arc in d.arcs) == [(0, ()), (0, ("floor",)), (1, ())]


def test_rod_in_a_groove():
    """A rod in a groove balances on both ends, where it is not stable.

    Between planes of the slopes ``A`` and ``B``, with parts of lengths ``p`` and ``q`` beside its
    centre of mass, ``tan(theta) = (p cot A - q cot B) / (p + q)``.  When it comes to lie on a
    plane, that equilibrium and the stable one, with an end in the vertex, meet.
    """
    A, B, half = 0.5, 0.7, 1.0
    M = Manifold(("x", "y", "theta"), periods=(np.inf, np.inf, 2 * np.pi))
    x, y, theta = M.symbols
    ends = {
        "l": (x - (half + P) * cos(theta), y - (half + P) * sin(theta)),
        "r": (x + (half - P) * cos(theta), y + (half - P) * sin(theta)),
    }
    planes = {"A": sin(A), "B": -sin(B)}
    functions = {
        f"{end} on {plane}": u * slope + v * (cos(A) if plane == "A" else cos(B))
        for end, (u, v) in ends.items() for plane, slope in planes.items()
    }  # fmt: skip
    D, E = problem(M, functions, y, "P", 0.0)
    tilt = np.arctan((1 / np.tan(A) - 1 / np.tan(B)) / 2)
    # The ends' distances from the vertex along the planes, by the sine rule.
    left = 2 * half * np.sin(B - tilt) / np.sin(A + B)
    place = [-left * np.cos(A) + half * np.cos(tilt), left * np.sin(A) + half * np.sin(tilt), tilt]
    start = stationary_on(D, E, place, ["l on A", "r on B"])
    d = branches(start, "P", (-0.95, 0.95))
    cots = 1 / np.tan(A) + 1 / np.tan(B)
    lie = [
        -half * (2 * np.tan(A) + 1 / np.tan(A) - 1 / np.tan(B)) / cots,
        half * (2 * np.tan(B) + 1 / np.tan(B) - 1 / np.tan(A)) / cots,
    ]
    assert_events(d, [("CORNER_LIMIT", v) for v in lie if abs(v) < 0.95])
    for arc in d.arcs:
        assert arc.index == 3 - len(arc.active)
        p, q = half + arc.parameters, half - arc.parameters
        if arc.index:
            turned = np.arctan((p / np.tan(A) - q / np.tan(B)) / (2 * half))
            np.testing.assert_allclose(arc.points[:, 2], turned, atol=1e-9)


@pytest.mark.parametrize(
    ("least", "springs"),
    [
        (1 + 1 / np.sqrt(2), [(0.3, 0.4), (1.9, 2.0)]),
        (1 + 1 / (np.sqrt(6) - np.sqrt(2)), [(0.3, 0.4), (2.4, 0.85), (0.8, 2.3)]),
    ],
)
def test_hard_discs_in_a_box_that_shrinks(least, springs):
    """Discs of diameter 1 on springs are jammed in the smallest square that holds them."""
    count = len(springs)
    M = Manifold.euclidean([f"{c}{i}" for i in range(count) for c in "xy"])
    q = np.reshape(M.symbols, (count, 2))
    functions = {}
    for i in range(count):
        for c, u in zip("xy", q[i], strict=True):
            functions |= {f"low {c}{i}": u - 0.5, f"high {c}{i}": P - 0.5 - u}
        for j in range(i):
            functions[f"{j}{i}"] = sqrt(sum((q[i] - q[j]) ** 2)) - 1
    energy = sum((u - at) ** 2 for u, at in zip(M.symbols, np.ravel(springs), strict=True))
    D, E = problem(M, functions, energy, "P", 2.3)
    d = branches(minimise(D, E, np.clip(np.ravel(springs), 0.5, 1.8)), "P", (1.2, 2.4))
    assert d.closed
    (jammed,) = [v for kind, v in told(d) if kind == "VANISHES"]
    assert jammed == pytest.approx(least, abs=1e-9)
    assert min(arc.parameters[0] for arc in d.arcs) == pytest.approx(least, abs=1e-9)


def test_beam_of_a_thousand_nodes_on_a_floor():
    """A beam with weights 1 at nodes one apart is lifted at its end: node ``j`` leaves at j/2 + 1.

    There the moment over the next one vanishes: ``P (j + 1) = 1 + ... + (j + 1)``.
    """
    count, lifted = 1000, 4
    names = [f"w{i}" for i in range(count)]
    M = Manifold.euclidean(names, scale=50.0)
    bent = Family.of({"bent": sympy.sympify("(a - 2*b + c)**2 / 2")}, ["a", "b", "c"])
    alone = Family.of({"height": sympy.Symbol("a")}, ["a"])
    force = (lifted + 1.5) / 2
    terms = [
        *(SmoothFunction.member(bent, "bent", M, reads=names[i : i + 3]) for i in range(count - 2)),
        *(SmoothFunction.member(alone, "height", M, reads=[name]) for name in names),
        SmoothFunction("pull", -P * M.symbols[0], M, parameters={"P": force}, variables=["w0"]),
    ]
    floor = [SmoothFunction.member(alone, "height", M, reads=[n], label=f"on {n}") for n in names]
    moments = np.array([force * k - k * (k + 1) / 2 for k in range(count)])
    w = np.zeros(count)
    for k in range(lifted - 1, -1, -1):
        w[k] = 2 * w[k + 1] - w[k + 2] + moments[k + 1]
    held = [f.name for f in floor[lifted:]]
    start = stationary_on(Polyhedron(M, floor), SmoothFunction.sum("energy", terms), w, held)
    assert start.problem.is_sparse
    d = branches(start, "P", (force - 0.6, force + 0.6))
    assert_events(d, [("OPENS", j / 2 + 1) for j in (lifted - 1, lifted)])
    assert all(arc.stable for arc in d.arcs)


# ------------------------------------------------------------------------------------------- values

MODELS = (Pinball(), SphereCluster(4), TorusDisks(2), Tutorial(), Well(0.0, 1.0))


@pytest.mark.parametrize("model", MODELS, ids=lambda model: type(model).__name__)
def test_a_model_survives_pickling_after_it_was_used(model):
    points = np.random.default_rng(0).normal(size=(3, model.polyhedron.dimension))
    values = model.polyhedron.values(points)
    for again in (pickle.loads(pickle.dumps(model)), copy.deepcopy(model)):
        assert again == model
        np.testing.assert_array_equal(again.polyhedron.values(points), values)


def test_a_spawned_process_computes_the_same():
    model = TorusDisks(3, "hexagonal")
    q = model.starts(np.random.default_rng(0), 4)
    np.testing.assert_array_equal(called(model.radius, q), model.radius(q))
