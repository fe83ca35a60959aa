"""Equations of motion and slips that share formulas, against SymPy."""

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st

from polycorner import (
    Friction,
    Manifold,
    Polyhedron,
    SmoothFunction,
    System,
    simulate,
    velocities,
)
from polycorner.formulas import Family
from polycorner.motion import Disc, Interval, motions
from polycorner.motion.formulation import moment

PLACE = Manifold.euclidean("x y z")
Q, V = PLACE.symbols, velocities(PLACE)


def lagrange(kinetic, potential, forces, q, v):
    """``M`` and ``F`` from ``d/dt dT/dv = dT/dq - dV/dq + Q`` along a path ``q(t)``."""
    t = sympy.Symbol("t")
    path = [sympy.Function(x.name)(t) for x in Q]
    rates, second = [p.diff(t) for p in path], sympy.symbols("ax ay az")
    moving = dict(zip(V, rates, strict=True)) | dict(zip(Q, path, strict=True))
    here = dict(zip(path, q.tolist(), strict=True))
    there = dict(zip(rates, v.tolist(), strict=True))
    rows = []
    for x, rate, force in zip(Q, V, forces, strict=True):
        left = kinetic.diff(rate).subs(moving).diff(t)
        right = (kinetic.diff(x) - potential.diff(x) + force).subs(moving)
        whole = (left - right).subs({p.diff(t, 2): a for p, a in zip(path, second, strict=True)})
        rows.append(whole.subs(there).subs(here))
    mass = sympy.Matrix(rows).jacobian(second)
    force = -sympy.Matrix(rows).subs(dict.fromkeys(second, 0))
    return np.array(mass, dtype=float), np.array(force, dtype=float).ravel()


@settings(max_examples=4)
@given(st.integers(0, 2**32 - 1))
def test_the_equations_are_those_of_lagrange(seed):
    rng = np.random.default_rng(seed)
    x, y, z = Q
    some = [sympy.sin(x * y), x**2, sympy.exp(-(z**2)), sympy.cos(y + 2 * z), x * z]
    a = rng.integers(-2, 3, (3, 3)).tolist()
    turned = [
        sum(a[i][j] * some[(i + j) % len(some)] * V[j] for j in range(3)) + V[i] for i in range(3)
    ]
    kinetic = sum(u**2 for u in turned) / 2 + sum(v**2 for v in V)
    potential = some[0] * some[3] + sympy.Piecewise((x**2, x > 0), (x**3, True))
    forces = [-V[0] * some[1], 0, V[1] * V[2]]
    by_name = {s.name: f for s, f in zip(Q, forces, strict=True)}
    system = System(Polyhedron(PLACE, [x + 100]), kinetic, potential, by_name)
    q, v = rng.normal(size=(2, 3))
    found = moment(system.formulation, system.parameters, q, v)
    mass, force = lagrange(kinetic, potential, forces, q, v)
    np.testing.assert_allclose(found.mass, mass, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(found.force, force, rtol=1e-9, atol=1e-9)


def test_a_kinetic_energy_that_is_quadratic_in_disguise_is_accepted():
    disguised = (V[0] + 1) ** 2 / 2 - V[0] - sympy.Rational(1, 2) + V[1] ** 2 / 2 + V[2] ** 2 / 2
    system = System(Polyhedron(PLACE, [Q[2]]), disguised)
    found = moment(system.formulation, system.parameters, np.ones(3), np.ones(3))
    np.testing.assert_array_equal(found.mass, np.eye(3))
    for wrong in (disguised + V[0], disguised + 1, disguised + V[0] ** 3, sympy.cos(V[0])):
        with pytest.raises(ValueError, match="kinetic: expected a quadratic form in x_dot, y_dot"):
            System(Polyhedron(PLACE, [Q[2]]), wrong)


FLOOR, SPACE = Polyhedron(PLACE, {"floor": Q[2], "wall": Q[1]}), motions(PLACE)
RUBS = Family.of({"s0": sympy.Symbol("a", real=True), "s1": sympy.Symbol("b", real=True)}, "ab")


def puck(*slips):
    """A particle that slides along a wall on a floor."""
    (floor, wall) = slips
    friction = [
        Friction("on floor", floor, Disc(0.3), "floor"),
        Friction("at wall", wall, Interval(0.2), "wall"),
    ]
    energies = sum(v**2 for v in V) / 2, 10 * Q[2] + 3 * Q[1]
    return System(FLOOR, *energies, friction=friction)


def component(name, reads):
    return SmoothFunction.member(RUBS, name, SPACE, reads=reads)


def test_slips_that_share_formulas_move_bodies_as_those_that_are_written_out():
    flat = [component(name, ["x_dot", "y_dot"]) for name in ("s0", "s1")]
    shared = puck(flat, [component("s0", ["x_dot", "z_dot"])])
    written, mixed = puck(V[:2], V[:1]), puck(flat, V[:1])
    paths = [
        simulate(s, s.state([0, 0, 0], [2.0, 0, 0]), 1.0, 1e-3) for s in (shared, written, mixed)
    ]
    assert paths[0].v[-1, 0, 0] == 0.0  # it stops after 2 / 3.6 s
    for path in paths[1:]:
        np.testing.assert_array_equal(path.q, paths[0].q)
        assert path.dissipated.keys() == paths[0].dissipated.keys()


def test_functions_that_are_no_slips_are_refused():
    x, vx = Q[0], V[0]
    with pytest.raises(
        ValueError, match="slip: expected functions of x, y, z, x_dot, y_dot, z_dot"
    ):
        puck(V[:2], [SmoothFunction("place", x, PLACE)])
    with pytest.raises(ValueError, match=r"slip: expected an affine function .* got 'square'"):
        puck(V[:2], [SmoothFunction("square", x * vx**2, SPACE)])
    affine = SmoothFunction("affine", x * vx + x**2, SPACE)
    assert puck(V[:2], [affine]).friction[1].slip == (affine,)
