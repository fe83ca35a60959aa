"""Problems on the edge of being minima, whose strict minima near a given point are known exactly.

They are written in coordinates ``u`` about the point, with numbers ``s`` from 1e-2 down to 1e-40
where a sign decides, and handed out in coordinates ``q`` with ``u = A (q - c)``, or bent where the
minimum is at ``u = 0``.  ``A`` is unimodular; ``c`` is rational or not.

>>> import numpy as np
>>> trials = list(problems(np.random.default_rng(0), 60))
>>> len({trial.name for trial in trials}) > 20, any(t.truth for t in trials)
(True, True)
"""

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
import sympy as sp
from sympy import Abs, Max, Min, Rational, cos, exp, sin

from polycorner import AllOf, AnyOf, Manifold, Polyhedron

Point = tuple[Any, ...]
U = sp.symbols("u1 u2 u3", real=True)
U1, U2, U3 = U
HERE: Point = (0, 0)
Q = sp.symbols("q1 q2 q3", real=True)


class Trial(NamedTuple):
    """A problem and its answer.

    Attributes
    ----------
    name : str
        What it tries.
    polyhedron : Polyhedron
        The set.
    energy : sympy.Expr
        The energy.
    point : array
        A point within 1e-4 of ``c``, to be certified and proved.
    truth : tuple of tuple of sympy numbers
        The strict local minima within 1e-3 of the point, exactly; empty for none.
    """

    name: str
    polyhedron: Polyhedron
    energy: Any
    point: Any
    truth: tuple[Point, ...]


class Case(NamedTuple):
    """A problem in the coordinates ``u``: inequalities, energy, strict minima near 0, equations."""

    parts: Any
    energy: Any
    minima: tuple[Point, ...]
    equations: tuple[Any, ...] = ()


Draw = Callable[[np.random.Generator], Case]


def _small(rng: np.random.Generator, largest: int = 2) -> Any:
    """Return a positive number, from ``10^-largest`` down to 1e-40."""
    return Rational(int(rng.integers(1, 10)), 10 ** int(rng.integers(largest + 1, 41)))


def _sign(rng: np.random.Generator) -> int:
    return int(rng.choice([-1, 1]))


def _here(true: Any) -> tuple[Point, ...]:
    return (HERE,) if true else ()


# ------------------------------------------------------------------- small multipliers, curvatures


def faint_multiplier(rng: np.random.Generator) -> Case:
    sign = _sign(rng)
    return Case([U1], sign * _small(rng) * U1 + U2**2, _here(sign > 0))


def faint_pull(rng: np.random.Generator) -> Case:
    s = _small(rng, 4)
    return Case([U1], -s * U1 + U1**2 + U2**2, ((s / 2, 0),))


def two_faint_multipliers(rng: np.random.Generator) -> Case:
    signs = _sign(rng), _sign(rng)
    energy = signs[0] * _small(rng) * U1 + signs[1] * _small(rng) * U2
    return Case([U1, U2], energy, _here(min(signs) > 0))


def faint_curvature(rng: np.random.Generator) -> Case:
    sign = _sign(rng)
    return Case([U1], U1 + sign * _small(rng) * U2**2, _here(sign > 0))


def curved_face(rng: np.random.Generator) -> Case:
    sign, bend = _sign(rng), int(rng.integers(1, 4))
    return Case([U1 - bend * U2**2], U1 + (sign * _small(rng) - bend) * U2**2, _here(sign > 0))


def saddle(rng: np.random.Generator) -> Case:
    return Case([U1 + 5], U1**2 - _small(rng) * U2**2, ())


def faint_bowl(rng: np.random.Generator) -> Case:
    s = _small(rng)
    return Case([U1 + 5], U1**2 + 2 * U1 * U2 + (1 + s) * U2**2, _here(true=True))


# --------------------------------------------------------------------------------- higher orders


def higher_order(rng: np.random.Generator) -> Case:
    power, sign, s = int(rng.integers(3, 7)), _sign(rng), _small(rng)
    size = [Rational(1), s][rng.integers(2)]
    return Case([U1], U1 + sign * size * U2**power, _here(sign > 0 and power % 2 == 0))


def cubic_beside(rng: np.random.Generator) -> Case:
    sign, s = _sign(rng), _small(rng, 5)
    other = (0, 2 * s / 3)  # where s u^2 - u^3 has its other critical point
    return Case([U1], U1 + sign * s * U2**2 - sign * U2**3, (HERE if sign > 0 else other,))


def double_well(rng: np.random.Generator) -> Case:
    s = _small(rng, 5)
    return Case([U1], U1 - 2 * s**2 * U2**2 + U2**4, ((0, s), (0, -s)))


# --------------------------------------------------------------------- parallel contacts and cusps


def nearly_parallel(rng: np.random.Generator) -> Case:
    s, weights = _small(rng, 1), (int(rng.integers(1, 4)), _sign(rng))
    f, g = U1, U1 + s * U2
    return Case([f, g], weights[0] * f + weights[1] * g, _here(weights[1] > 0))


def narrow_wedge(rng: np.random.Generator) -> Case:
    sign = _sign(rng)
    return Case([U2, _small(rng, 1) * U1 - U2], sign * U1, _here(sign > 0))


def cusp(rng: np.random.Generator) -> Case:
    sign = _sign(rng)
    power = int(rng.integers(2, 4))
    tips = {2: [U2 - U1**2, -U2 - U1**2], 3: [U2 + U1**3, U1**3 - U2]}
    return Case(tips[power], sign * U1 + 2 * U2, _here(power == 2 or sign > 0))


def near_cusp(rng: np.random.Generator) -> Case:
    """Two parabolas that cross under a small angle: a wedge with a tip at 0."""
    s, sign = _small(rng, 5), _sign(rng)
    far = -s / 2  # the other tip, where -2 u^2 - s u = 0
    tip = HERE if sign < 0 else (far, 0)
    return Case([U2 - U1**2, -U2 - U1**2 - s * U1], sign * U1, (tip,))


# ----------------------------------------------------------------- weak, redundant and equal zeros


def redundant(rng: np.random.Generator) -> Case:
    spare = [2 * U1, U1 + U2**2, U1 * (1 + U2**2), 3 * U1 + U1**2]
    chosen = [spare[i] for i in rng.choice(4, int(rng.integers(1, 4)), replace=False)]
    return Case([U1, *chosen], U1 + _sign(rng) * _small(rng) * U1 + U2**2, _here(true=True))


def not_redundant(rng: np.random.Generator) -> Case:
    s, sign = _small(rng), _sign(rng)
    return Case([U1, U1 - U2**2], U1 - (1 - sign * s) * U2**2, _here(sign > 0))


def weak(rng: np.random.Generator) -> Case:
    s, sign = _small(rng), _sign(rng)
    spare = [U2, U2 - U1**2, U2 + U1, U2 - U1][rng.integers(4)]
    return Case([U1, spare], U1 + [s, Rational(1)][rng.integers(2)] * sign * U2**2, _here(sign > 0))


def weak_or_not(rng: np.random.Generator) -> Case:
    s, sign = _small(rng, 4), _sign(rng)
    return Case([U1, U2], U1 + sign * s * U2 + U2**2, (HERE if sign > 0 else (0, s / 2),))


def copositive(rng: np.random.Generator) -> Case:
    """``u1^2 + c u1 u2 + u2^2`` on a quadrant: a strict minimum for c > -2."""
    s, sign = _small(rng), _sign(rng)
    factor = [4, 2, -2 + sign * s][rng.integers(3)]
    return Case([U1, U2], U1**2 + factor * U1 * U2 + U2**2, _here(factor > -2))


def not_strict(rng: np.random.Generator) -> Case:
    energies = [U1 * U2, U1 * (1 + U2**2), (U1 - U2**2) ** 2, U1**2 * (1 + U2**2)]
    return Case([U1, U2], energies[rng.integers(4)], ())


def zeros_that_nearly_meet(rng: np.random.Generator) -> Case:
    s, sign = _small(rng, 4), _sign(rng)
    return Case([U1, U1 + sign * s], U1 + U2**2, (HERE if sign > 0 else (s, 0),))


def dependent_equations(rng: np.random.Generator) -> Case:
    sign, twice = _sign(rng), [2 * U1, U1 * (1 + U2**2), U1 + U1**3][rng.integers(3)]
    energy = U1 + sign * [_small(rng), Rational(1)][rng.integers(2)] * U2**2
    return Case([U2 + 3], energy, _here(sign > 0), (U1, twice))


def curved_equation(rng: np.random.Generator) -> Case:
    sign, s = _sign(rng), _small(rng)
    return Case([U2 + 3], -U1 + (1 + sign * s) * U2**2, _here(sign > 0), (U1 - U2**2,))


# ------------------------------------------------------------------------------- unions and kinks


def union_nearly_open(rng: np.random.Generator) -> Case:
    s, sign = _small(rng, 4), _sign(rng)
    return Case(AnyOf(U1, U1 + sign * s), U1 + U2**2, ((-s, 0) if sign > 0 else HERE,))


def union_of_equals(rng: np.random.Generator) -> Case:
    other = [2 * U1, U1 - U2**2, U1 + U2**2][rng.integers(3)]
    factor = Rational(int(rng.choice([1, 3])), 2)  # of the curvature against that of the union
    energy = U1 + factor * U2**2
    return Case(AnyOf(U1, other), energy, _here(other != U1 + U2**2 or factor > 1))


def union_with_another_wall(rng: np.random.Generator) -> Case:
    energy = [U1 + U2**2, U1**2 + U2**2][rng.integers(2)]
    return Case(AnyOf(U1, U2), energy, _here(energy == U1**2 + U2**2))


def union_of_two_walls(rng: np.random.Generator) -> Case:
    s = _small(rng, 4)
    return Case(AnyOf(U1 - s, U2 - s), U1**2 + U2**2, ((s, 0), (0, s)))


def nested_union(rng: np.random.Generator) -> Case:
    s, sign = _small(rng, 4), _sign(rng)
    tree = AllOf(U1, AnyOf(U2 + sign * s, -U2 + sign * s))
    at = (HERE,) if sign > 0 else ((0, s), (0, -s))
    return Case(tree, U1 + U2**2, at)


def energy_kink(rng: np.random.Generator) -> Case:
    """Bend the energy in a kink of either sign, on either side of 0 or in it."""
    s, pull = _small(rng, 4) * int(rng.integers(-1, 2)), _sign(rng)
    bent = U1**2 + U2**2 + pull * Max(0, U1 - s)
    if s > 0:
        return Case([U1 + 5], bent, _here(true=True))
    return Case([U1 + 5], bent, ((s, 0),) if pull > 0 else ())


def face_kink(rng: np.random.Generator) -> Case:
    s, sign = _small(rng, 4), _sign(rng)
    return Case([U1 - sign * Abs(U2 - s)], U1 + U2**2, ((0, s),) if sign > 0 else ())


def smallest_of(rng: np.random.Generator) -> Case:
    s, sign = _small(rng, 4), _sign(rng)
    return Case([Min(U1, U1 + sign * s)], U1 + U2**2, (HERE if sign > 0 else (s, 0),))


CASES: tuple[Draw, ...] = (
    faint_multiplier, faint_pull, two_faint_multipliers, faint_curvature, curved_face, saddle,
    faint_bowl, higher_order, cubic_beside, double_well, nearly_parallel, narrow_wedge, cusp,
    near_cusp, redundant, not_redundant, weak, weak_or_not, copositive, not_strict,
    zeros_that_nearly_meet, dependent_equations, curved_equation, union_nearly_open,
    union_of_equals, union_with_another_wall, union_of_two_walls, nested_union, energy_kink,
    face_kink, smallest_of,
)  # fmt: skip

CENTRES = (
    (0, 0, 0), (1, -2, 3), (Rational(3, 4), Rational(-5, 2), 0),
    (Rational(1, 3), Rational(-2, 7), 1), (sp.sqrt(2), 1 - sp.sqrt(3), 0), (sp.pi / 3, 0, sp.E),
)  # fmt: skip


def problems(rng: np.random.Generator, count: int) -> Iterator[Trial]:
    """Return ``count`` trials, the kinds one after the other."""
    for k in range(count):
        draw = CASES[k % len(CASES)]
        yield trial(draw, rng)


def trial(draw: Draw, rng: np.random.Generator) -> Trial:
    """Return one problem of a kind in random coordinates."""
    case = draw(rng)
    n = int(rng.integers(2, 4))
    energy = case.energy + (U3**2 if n > 2 else 0)  # a third coordinate at rest at 0
    turn = _unimodular(rng, n)
    centre = sp.Matrix(CENTRES[rng.integers(len(CENTRES))][:n])
    away = sp.Matrix(Q[:n]) - centre
    straight = turn * away
    if all(not any(m) for m in case.minima) and rng.integers(2):
        straight[0] += _bend(rng, away[1])
    inserted = dict(zip(U, straight, strict=False))
    back = turn.inv()
    truth = tuple(tuple(centre + back * sp.Matrix([*m, *[0] * (n - len(m))])) for m in case.minima)
    manifold = Manifold(tuple(q.name for q in Q[:n]))
    parts = _inserted(case.parts, inserted)
    equations = [h.subs(inserted, simultaneous=True) for h in case.equations]
    size = float(rng.choice([0.0, 0.0, 1e-13, 1e-10]))
    point = np.array([float(c) for c in centre]) + size * rng.standard_normal(n)
    polyhedron = Polyhedron(manifold, parts, equations)
    return Trial(
        draw.__name__.replace("_", " "),
        polyhedron,
        energy.subs(inserted, simultaneous=True),
        point,
        truth,
    )


def _inserted(parts: Any, values: dict[Any, Any]) -> Any:
    if isinstance(parts, AllOf | AnyOf):
        return type(parts)(*(_inserted(part, values) for part in parts.parts))
    if isinstance(parts, list):
        return [_inserted(part, values) for part in parts]
    return parts.subs(values, simultaneous=True)


def _bend(rng: np.random.Generator, t: Any) -> Any:
    """Return a function without value and slope at 0."""
    return [t**2, 1 - cos(t), exp(t) - 1 - t, t * sin(t)][rng.integers(4)] / 2


def _unimodular(rng: np.random.Generator, n: int) -> Any:
    """Return a product of a lower and an upper triangular matrix of whole numbers."""
    if not rng.integers(3):
        return sp.eye(n)
    drawn = rng.integers(-2, 3, (n, n))
    lower = sp.Matrix(n, n, lambda i, j: int(drawn[i, j]) if i > j else int(i == j))
    upper = sp.Matrix(n, n, lambda i, j: int(drawn[i, j]) if i < j else int(i == j))
    return lower * upper
