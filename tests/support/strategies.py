"""Generated inputs, named after what they are in the domain."""

import math
from fractions import Fraction

import numpy as np
from hypothesis import strategies as st

from polycorner import AllOf, AnyOf, Manifold, SmoothFunction
from polycorner.dumbbells import DumbbellPair
from polycorner.formulas.bundles import Bundle
from polycorner.formulas.families import Family

TAU = math.tau


def reals(reach=10.0):
    """Return finite numbers up to ``reach`` in size, without subnormal ones."""
    return st.floats(-reach, reach, allow_subnormal=False)


def vectors(n, reach=10.0):
    """Return vectors of ``n`` numbers."""
    return st.lists(reals(reach), min_size=n, max_size=n).map(np.array)


def directions(n):
    """Return vectors of length one, none of them nearly zero."""
    return (
        vectors(n, 1.0)
        .filter(lambda v: np.linalg.norm(v) > 0.1)
        .map(lambda v: v / np.linalg.norm(v))
    )


@st.composite
def manifolds(draw, max_dimension=4):
    """Return products of lines and circles with scales."""
    n = draw(st.integers(1, max_dimension))
    periods = st.sampled_from([math.inf, 1.0, math.pi, TAU, 360.0])
    scales = st.floats(1e-3, 1e3)
    return Manifold(
        tuple(f"q{i}" for i in range(n)),
        tuple(draw(periods) for _ in range(n)),
        tuple(draw(scales) for _ in range(n)),
    )


# ----------------------------------------------------------------------------------- expressions


def together(expressions, coordinates, parameters=None):
    """Return expressions by name as functions on a space, compiled and evaluated together."""
    space, numbers = Manifold.euclidean(coordinates), parameters or {}
    family = Family.of(expressions, space.names, numbers)
    values = tuple(numbers.values())
    functions = [SmoothFunction.member(family, f, space, parameters=values) for f in expressions]
    return Bundle(space, functions)


@st.composite
def rational_terms(draw, depth=4, variables=3):
    """Return nested ``(op, a, b)`` over ``("var", i)`` and ``("const", fraction)``."""
    if depth == 0 or draw(st.integers(0, 4)) == 0:
        if draw(st.booleans()):
            return ("var", draw(st.integers(0, variables - 1)))
        return ("const", draw(st.sampled_from([Fraction(k, 2) for k in range(-4, 5)])))
    op = draw(st.sampled_from(["add", "sub", "mul", "div", "neg"]))
    inner = rational_terms(depth=depth - 1, variables=variables)
    return (op, draw(inner)) if op == "neg" else (op, draw(inner), draw(inner))


def smooth_expressions(symbols):
    """Return SymPy expressions that are smooth on all of space, over every supported function."""
    import sympy as sp

    third = sp.Rational(2, 3)
    one = [
        sp.sin,
        sp.cos,
        sp.atan,
        sp.tanh,
        sp.erf,
        lambda e: sp.tan(sp.tanh(e)),
        lambda e: sp.exp(sp.sin(e)),
        lambda e: sp.sinh(sp.cos(e)),
        lambda e: sp.cosh(sp.sin(e)),
        lambda e: sp.asin(sp.tanh(e) / 2),
        lambda e: sp.acos(sp.sin(e) / 2),
        lambda e: sp.sqrt(1 + e**2),
        lambda e: sp.log(2 + e**2),
        lambda e: (1 + e**2) ** third,
        lambda e: (1 + e**2) ** (-third),
        lambda e: e**2,
        lambda e: e**3,
    ]
    two = [
        lambda a, b: a + b,
        lambda a, b: a - b,
        lambda a, b: a * b,
        lambda a, b: a / (2 + b**2),
        lambda a, b: sp.atan2(a, 2 + b**2),
        lambda a, b: (2 + sp.sin(a)) ** sp.cos(b),
    ]
    leaves = st.sampled_from([*symbols, sp.Integer(2), sp.Rational(1, 3), sp.pi, sp.Float(0.7)])

    def extend(inner):
        return st.builds(lambda f, e: f(e), st.sampled_from(one), inner) | st.builds(
            lambda f, a, b: f(a, b), st.sampled_from(two), inner, inner
        )

    # SymPy writes atan2 of two numbers with logarithms of complex numbers, which are not compiled.
    return st.recursive(leaves, extend, max_leaves=5).filter(lambda e: not e.has(sp.I))


# ------------------------------------------------------------------------------------------ trees


def trees(leaves):
    """Return and/or trees over the positions ``0 .. leaves - 1``; no group is empty."""

    def groups(inner):
        return st.tuples(
            st.sampled_from(["all", "any"]), st.lists(inner, min_size=1, max_size=3).map(tuple)
        )

    return groups(st.recursive(st.integers(0, leaves - 1), groups, max_leaves=8))


def group(tree, functions):
    """Return a tree written with ``AllOf`` and ``AnyOf`` of the given functions."""
    if isinstance(tree, int):
        return functions[tree]
    word, children = tree
    return {"all": AllOf, "any": AnyOf}[word](*(group(child, functions) for child in children))


def leaves_of(tree):
    """Return the positions in a tree in the order in which they first occur."""
    if isinstance(tree, int):
        return [tree]
    return list(dict.fromkeys(leaf for child in tree[1] for leaf in leaves_of(child)))


# -------------------------------------------------------------------------------------- dumbbells


@st.composite
def pairs(draw, *, plane=None, least_length=2.0, least_drum=1.05, weighted=False):
    """Return dumbbell pairs: in the plane, in a drum, or (by default) in either.

    ``least_length`` is in ball radii; ``least_drum`` is ``2 rho / l`` of the tightest drum.
    """
    r = draw(st.floats(0.5, 4.0))
    t = r * draw(st.floats(0.1, 0.9))
    length = r * draw(st.floats(least_length, 10.0))
    if draw(st.booleans()) if plane is None else plane:
        radius = math.inf
    else:
        radius = r + length / 2 * draw(st.floats(least_drum, 30.0))
    return DumbbellPair(length, r, t, radius, draw(st.floats(0, 3)) if weighted else 0.0)


@st.composite
def placements(draw, pair, reach=1.5):
    """Return placements of two dumbbells within reach of each other.

    Headings are general, parallel, nearly parallel, crossing at right angles, or end to end.
    """
    side = 1.0 if pair.is_plane else 1 / pair.centre_radius
    length = pair.length
    first, second = draw(reals(3.0)), draw(reals(3.0))
    across, along = draw(reals(reach)) * length, draw(reals(reach)) * length
    kind = draw(st.sampled_from(["general", "parallel", "nearly", "crossing", "in line"]))
    if kind == "parallel":
        second = first
    elif kind == "nearly":
        second = first + draw(st.sampled_from([1e-3, 1e-5, 1e-7, 1e-9, 1e-11, -1e-8]))
    elif kind == "crossing":
        second = first + math.pi / 2
        across, along = across / 4, along / 4
    elif kind == "in line":
        second = first
        across, along = along * math.sin(first), along * math.cos(first)
    turned, lifted = draw(reals(1.0)) * length, draw(reals(10.0)) * length
    return np.array(
        [side * turned, lifted, first, side * (turned + across), lifted + along, second]
    )


@st.composite
def placed_pairs(draw, **options):
    """Return a pair and a placement of it."""
    pair = draw(pairs(**options))
    return pair, draw(placements(pair))
