"""Generated problems whose equilibria over a parameter are known by construction.

A *form* has coordinates ``y``, functions and an energy over ``sigma``, and arcs and events that
closed formulas give.  Forms in coordinates of their own are added: arcs of the sum are pairs of
arcs.  The sum is hidden behind

- ``y = Phi(q, t)``, invertible for each ``t``, on lines and circles, in other units;
- ``tau = T(t)``, ascending;
- factors of the functions that are positive, and an energy that is scaled and shifted with ``t``;
- functions, and unions of functions, that do not vanish near the arcs.

None of these changes arcs, active sets, indices or kinds of events.  A symmetry of the form is
hidden, too, or one of its coordinates stays odd: then its change of sign is one of the energy.

>>> posed = [problem(0, number) for number in range(3 * len(FORMS))]
>>> len({p.kind for p in posed}) == len(FORMS), sum(len(p.events) for p in posed) > 100
(True, True)
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np
import sympy
from scipy.optimize import fsolve

from polycorner import AllOf, AnyOf, Manifold, Polyhedron, SmoothFunction

Rng = np.random.Generator
REACH = 1.6  # of |sigma| in the interval |tau| <= 1
SIGMA, TIME = sympy.symbols("sigma t")


@dataclass(frozen=True)
class KnownArc:
    """An arc between two values of ``tau``: active functions, the place at each, the index."""

    active: frozenset[str]
    low: float
    high: float
    place: Callable[[float], tuple[float, ...]]
    index: int


@dataclass(frozen=True)
class KnownEvent:
    """An event: kinds that are true, the value of ``tau``, numbers of its arcs."""

    kinds: frozenset[str]
    at: float
    arcs: tuple[int, ...]


@dataclass(frozen=True)
class Form:
    """A problem over ``sigma``; functions in one tuple form a union."""

    names: tuple[str, ...]
    functions: tuple[tuple[tuple[str, Any], ...], ...]
    energy: Any
    arcs: tuple[KnownArc, ...]
    events: tuple[KnownEvent, ...] = ()
    equations: tuple[tuple[str, Any], ...] = ()
    added: bool = True  # whether others may be added without degenerating it


def arc(
    place: Callable[[float], Any], low: float, high: float, index: int = 0, *active: str
) -> Any:
    """Return an arc; places of one coordinate may be numbers."""

    def tupled(s: float) -> tuple[float, ...]:
        return tuple(np.atleast_1d(place(s)).tolist())

    return KnownArc(frozenset(active), low, high, tupled, index)


def event(*kinds: str, at: float = 0.0, arcs: Sequence[int]) -> KnownEvent:
    """Return an event."""
    return KnownEvent(frozenset(kinds), at, tuple(arcs))


def walls(*pairs: tuple[str, Any]) -> tuple[tuple[tuple[str, Any], ...], ...]:
    """Return inequalities that all hold."""
    return tuple((pair,) for pair in pairs)


x, y, s = sympy.Symbol("x"), sympy.Symbol("y"), SIGMA


def regular(rng: Rng) -> Form:
    """Return an equilibrium that moves, of either index."""
    a, b, sign = rng.uniform(-0.4, 0.4), rng.uniform(-0.3, 0.3), rng.choice([-1, 1])
    place = arc(lambda v: a + b * v, -REACH, REACH, int(sign < 0))
    return Form(("x",), (), sign * rng.uniform(0.5, 2) * (x - a - b * s) ** 2 / 2, (place,))


def held(rng: Rng) -> Form:
    """Return a contact that stays closed."""
    force = rng.uniform(0.3, 2) + rng.uniform(-0.15, 0.15) * s + rng.uniform(-1, 1) * x
    stays = arc(lambda _: 0.0, -REACH, REACH, 0, "held")
    return Form(("x",), walls(("held", x)), x * force, (stays,))


def bound(rng: Rng) -> Form:
    """Return a coordinate that an equation fixes."""
    energy = rng.uniform(-2, 2) * x + rng.uniform(-2, 2) * x**2 + x * s
    fixed = (arc(lambda _: 0.0, -REACH, REACH),)
    return Form(("x",), (), energy, fixed, equations=(("bound", x),))


def steep(rng: Rng) -> Form:
    """Return an equilibrium that moves as a cubic root, infinitely fast once."""
    k = rng.uniform(0.1, 0.4)
    return Form(("x",), (), x**4 / 4 - k * s * x, (arc(lambda v: np.cbrt(k * v), -REACH, REACH),))


def opens(rng: Rng) -> Form:
    """Return a contact that opens."""
    k = rng.uniform(0.2, 0.5)
    arcs = arc(lambda _: 0.0, -REACH, 0, 0, "wall"), arc(lambda v: k * v, 0, REACH)
    return Form(
        ("x",), walls(("wall", x)), (x - k * s) ** 2 / 2, arcs, (event("OPENS", arcs=(0, 1)),)
    )


def grazes(rng: Rng) -> Form:
    """Return a contact that hardly closes and opens again, or hardly does not."""
    k, eps = rng.uniform(0.1, 0.3), 10.0 ** rng.uniform(-5, -2)
    closes = rng.random() < 0.5
    level = -eps if closes else eps
    energy = (x - k * s**2 - level) ** 2 / 2
    if not closes:
        free = arc(lambda v: k * v**2 + eps, -REACH, REACH)
        return Form(("x",), walls(("wall", x)), energy, (free,))
    r = float(np.sqrt(eps / k))
    free = [arc(lambda v: k * v**2 - eps, *ends) for ends in ((-REACH, -r), (r, REACH))]
    arcs = (free[0], arc(lambda _: 0.0, -r, r, 0, "wall"), free[1])
    events = (event("CLOSES", at=-r, arcs=(0, 1)), event("OPENS", at=r, arcs=(1, 2)))
    return Form(("x",), walls(("wall", x)), energy, arcs, events)


def corner_limit(rng: Rng) -> Form:
    """Return two equilibria, one at a wall, that meet there."""
    k = rng.uniform(0.2, 0.5)
    arcs = arc(lambda _: 0.0, 0, REACH, 0, "wall"), arc(lambda v: k * v, 0, REACH, 1)
    limit = event("CORNER_LIMIT", arcs=(0, 1))
    return Form(("x",), walls(("wall", x)), -(x**2) / 2 + k * s * x, arcs, (limit,))


def fold(rng: Rng) -> Form:
    """Return a fold."""
    k = rng.uniform(0.1, 0.5)
    arcs = [arc(lambda v, g=g: g * np.sqrt(max(k * v, 0)), 0, REACH, int(g < 0)) for g in (1, -1)]
    return Form(("x",), (), x**3 / 3 - k * s * x, tuple(arcs), (event("FOLD", arcs=(0, 1)),))


def loop(rng: Rng) -> Form:
    """Return a closed curve between two folds."""
    r, k = rng.uniform(0.2, 0.45), rng.uniform(0.3, 1)
    arcs = [
        arc(lambda v, g=g: g * k * np.sqrt(max(r * r - v * v, 0)), -r, r, int(g < 0))
        for g in (1, -1)
    ]
    ends = tuple(event("FOLD", at=v, arcs=(0, 1)) for v in (-r, r))
    return Form(("x",), (), x**3 / 3 - k * k * (r * r - s * s) * x, tuple(arcs), ends)


def pitchfork(rng: Rng) -> Form:
    """Return a branch point of a symmetry, of either sign."""
    k, sign = rng.uniform(0.1, 0.45), rng.choice([-1, 1])
    one, two = (0, 1) if sign > 0 else (1, 0)
    arcs = (
        arc(lambda _: 0.0, -REACH, 0, one), arc(lambda _: 0.0, 0, REACH, two),
        *(arc(lambda v, g=g: g * np.sqrt(max(k * v, 0)), 0, REACH, one) for g in (1, -1)),
    )  # fmt: skip
    energy = int(sign) * (x**4 / 4 - k * s * x**2 / 2)
    return Form(("x",), (), energy, arcs, (event("BRANCH", arcs=range(4)),))


def transcritical(rng: Rng) -> Form:
    """Return two curves that cross, with different slopes."""
    k, m = rng.uniform(0.15, 0.3), rng.uniform(-0.3, 0.1)
    energy = x**3 / 3 - (k + m) * s * x**2 / 2 + k * m * s**2 * x
    arcs = (
        arc(lambda v: k * v, -REACH, 0, 1), arc(lambda v: k * v, 0, REACH, 0),
        arc(lambda v: m * v, -REACH, 0, 0), arc(lambda v: m * v, 0, REACH, 1),
    )  # fmt: skip
    return Form(("x",), (), energy, arcs, (event("BRANCH", arcs=range(4)),))


def threefold(rng: Rng) -> Form:
    """Return a branch point with the symmetry of a triangle: ``sigma z = conj(z)^2``."""
    k, turns = rng.uniform(0.2, 0.5), [np.exp(2j * np.pi * i / 3) for i in range(3)]
    energy = -k * s * (x**2 + y**2) / 2 + x**3 / 3 - x * y**2
    arcs = [
        arc(lambda v, z=z: (k * v * z.real, k * v * z.imag), *ends, 1 if z else 2 * (ends[0] == 0))
        for z in (0j, *turns) for ends in ((-REACH, 0.0), (0.0, REACH))
    ]  # fmt: skip
    crossing = event("BRANCH", arcs=range(8))
    return Form(("x", "y"), (), energy, tuple(arcs), (crossing,))


def fourfold(rng: Rng) -> Form:
    """Return a branch point with the symmetry of a square, eight curves beside the trivial one.

    On the axes ``a r^2 = k sigma``, on the diagonals ``(a + b) r^2 = 2 k sigma``.
    """
    k, a = rng.uniform(0.1, 0.3), rng.uniform(0.6, 1.5)
    b = a * rng.choice([rng.uniform(-0.5, 0.7), rng.uniform(1.4, 3)])
    energy = -k * s * (x**2 + y**2) / 2 + a * (x**4 + y**4) / 4 + b * x**2 * y**2 / 2
    arcs = [arc(lambda _: (0.0, 0.0), -REACH, 0, 0), arc(lambda _: (0.0, 0.0), 0, REACH, 2)]
    for i in range(8):
        one, two = np.cos(np.pi * i / 4), np.sin(np.pi * i / 4)
        scale = k / a if i % 2 == 0 else 2 * k / (a + b)

        def place(v: float, one: float = one, two: float = two, scale: float = scale) -> Any:
            r = np.sqrt(max(scale * v, 0))
            return r * one, r * two

        arcs.append(arc(place, 0, REACH, int((b < a) == (i % 2 == 0))))
    return Form(("x", "y"), (), energy, tuple(arcs), (event("BRANCH", arcs=range(10)),))


def _simplex(rng: Rng, count: int, common: Any) -> tuple[list[Any], list[Any]]:
    """Return ``count`` functions whose sum is ``common``, and the coordinates they need."""
    ys = [sympy.Symbol(f"y{i}") for i in range(count - 1)]
    weights = rng.dirichlet(np.full(count, 3.0)).tolist()
    return ys, [
        e + w * common for e, w in zip([*ys, -sum(ys)], weights, strict=True)
    ]  # fmt: skip


def dependent(rng: Rng) -> Form:
    """Return gradients of one to three functions that become dependent: a point, a neck, a hole.

    Where ``sigma + Q(x) = 0``, ``Q = sum a_i e_i x_i^2`` with signs ``e``, all functions vanish;
    their multipliers are ``L w_i`` with the weights ``w`` and ``2 L a_0 e_0 x_0 = k``.
    """
    count, free = int(rng.integers(1, 4)), int(rng.integers(1, 3))
    xs = [sympy.Symbol(f"x{i}") for i in range(free)]
    a, e = rng.uniform(1.5, 3, free), rng.choice([-1, 1], free)
    ys, functions = _simplex(
        rng, count, s + sum(float(c) * v**2 for c, v in zip(a * e, xs, strict=True))
    )
    least = float(2 * a[0] * np.sqrt(REACH / a[0]))  # k over 2 a x is then above one half
    k = rng.uniform(1, 2) * least
    bends = rng.uniform(-0.5, 0.5, free)
    energy = k * xs[0] + sum(float(c) * v**2 for c, v in zip(bends[1:], xs[1:], strict=True))
    names = [f"g{i}" for i in range(count)]
    sign = float(e[0])

    def place(v: float) -> tuple[float, ...]:
        first = sign * np.sqrt(max(-sign * v / a[0], 0.0))
        # The functions vanish although they have unequal shares of a sum that is zero.
        return (first, *[0.0] * (free - 1), *[0.0] * (count - 1))

    low, high = (-REACH, 0.0) if sign > 0 else (0.0, REACH)
    curve = arc(place, low, high, int((e[1:] > 0).sum()), *names)
    kind = "VANISHES" if (e < 0).all() else "DEPENDENT"
    return Form(
        tuple(v.name for v in (*xs, *ys)), walls(*zip(names, functions, strict=True)), energy,
        (curve,), (event(kind, arcs=(0,)),), added=False,
    )  # fmt: skip


def simplex(rng: Rng) -> Form:
    """Return a simplex that shrinks to a point, with the energy's minimum in a corner."""
    n, k = int(rng.integers(1, 5)), rng.uniform(0.2, 0.5)
    vs = [sympy.Symbol(f"y{i}") for i in range(n)]
    e = rng.uniform(-1, 1, n)
    names = [f"g{i}" for i in range(n + 1)]
    functions = [*vs, k * s - sum(vs)]
    low, j = min((float(e.min()), int(e.argmin())), (0.0, n))
    assert np.abs(np.delete(np.append(e, 0.0), j) - low).min() > 0.1

    def place(v: float) -> tuple[float, ...]:
        return tuple(k * v if i == j else 0.0 for i in range(n))

    curve = arc(place, 0, REACH, 0, *(name for i, name in enumerate(names) if i != j))
    energy = sum(float(c) * v for c, v in zip(e, vs, strict=True))
    return Form(
        tuple(v.name for v in vs), walls(*zip(names, functions, strict=True)), energy,
        (curve,), (event("VANISHES", arcs=(0,)),), added=False,
    )  # fmt: skip


def exchange(rng: Rng) -> Form:
    """Return a corner at which one contact is exchanged for another."""
    n, k = int(rng.integers(1, 4)), rng.uniform(0.2, 0.5)
    vs = [sympy.Symbol(f"y{i}") for i in range(n)]
    e, p = rng.uniform(0.3, 1, n), rng.uniform(0.5, 1, n)
    signs = rng.choice([-1, 1], n)
    signs[0] = 1
    ratios = np.where(signs > 0, e / p, np.inf)
    j = int(ratios.argmin())
    assert np.ptp(np.sort(ratios)[:2]) > 0.1 if n > 1 else True
    names = [f"g{i}" for i in range(n + 1)]
    last = k * s + sum(float(c) * v for c, v in zip(signs * p, vs, strict=True))

    def place(v: float) -> tuple[float, ...]:
        return tuple(-k * v / p[j] if i == j else 0.0 for i in range(n))

    arcs = (
        arc(place, -REACH, 0, 0, *(name for i, name in enumerate(names) if i != j)),
        arc(lambda _: np.zeros(n), 0, REACH, 0, *names[:n]),
    )
    energy = sum(float(c) * v for c, v in zip(e, vs, strict=True))
    return Form(
        tuple(v.name for v in vs), walls(*zip(names, [*vs, last], strict=True)), energy,
        arcs, (event("EXCHANGE", arcs=(0, 1)),),
    )  # fmt: skip


def reentrant(rng: Rng) -> Form:
    """Return a wall that ends where another piece of a union begins."""
    k, force = rng.uniform(0.2, 0.5), rng.uniform(0.3, 2)
    curve = arc(lambda v: (k * v, 0.0), -REACH, 0, 0, "floor")
    return Form(
        ("x", "y"), ((("floor", y), ("beyond", x)),), force * y + (x - k * s) ** 2 / 2,
        (curve,), (event("RE_ENTRANT", arcs=(0,)),),
    )  # fmt: skip


def several(rng: Rng) -> Form:
    """Return several weak contacts: ``H x - sigma g = lam``, ``x, lam >= 0``, ``x lam = 0``."""
    n = int(rng.integers(2, 4))
    vs = [sympy.Symbol(f"x{i}") for i in range(n)]
    h = rng.uniform(-1, 1, (n, n))
    h = h + h.T + np.diag(rng.uniform(0, 3, n))
    g = rng.uniform(0.1, 0.4, n) * rng.choice([-1, 1], n)
    arcs = []
    for open_, side in product(product([False, True], repeat=n), (-1, 1)):
        d = np.array(open_)
        part = h[np.ix_(d, d)]
        assert abs(np.linalg.eigvalsh(part)).min(initial=1) > 0.2
        rate = np.zeros(n)
        rate[d] = np.linalg.solve(part, side * g[d])
        strict = np.where(d, rate, h @ rate - side * g)
        assert abs(strict).min() > 0.03
        if (strict > 0).all():
            assert rate.max() < 0.6
            low, high = (0.0, REACH) if side > 0 else (-REACH, 0.0)
            names = [f"c{i}" for i in range(n) if not d[i]]
            index = int((np.linalg.eigvalsh(part) < 0).sum())
            arcs.append(arc(lambda v, rate=rate: abs(v) * rate, low, high, index, *names))
    assert arcs
    before, after = ([a for a in arcs if (a.high > 0) == late] for late in (False, True))
    kind = "BRANCH"
    if len(arcs) == 2 and len(before) == 1:
        kept = len(before[0].active) - len(after[0].active)
        kind = "OPENS" if kept > 0 else "CLOSES" if kept < 0 else "EXCHANGE"
    elif len(arcs) == 2:
        kind = "CORNER_LIMIT"
    energy = sum(float(h[i, j]) * vs[i] * vs[j] / 2 for i in range(n) for j in range(n)) - s * sum(
        float(c) * v for c, v in zip(g, vs, strict=True)
    )
    return Form(
        tuple(v.name for v in vs), walls(*((f"c{i}", v) for i, v in enumerate(vs))), energy,
        tuple(arcs), (event(kind, arcs=range(len(arcs))),),
    )  # fmt: skip


FORMS = (
    regular, opens, grazes, corner_limit, fold, loop, pitchfork, transcritical, steep, dependent,
    simplex, exchange, reentrant, several, threefold, fourfold,
)  # fmt: skip
PLAIN = (regular, held, bound)
SWAPPED = {"OPENS": "CLOSES", "CLOSES": "OPENS"}


def turned(form: Form, sign: int, at: float) -> Form:
    """Return a form with ``sigma = sign (tau - at)``."""

    def there(v: float) -> float:
        return at + sign * v

    arcs = []
    for a in form.arcs:
        low, high = sorted((there(a.low), there(a.high)))
        low, high = max(low, -1.0), min(high, 1.0)
        arcs.append(replace(
            a, low=low, high=high, place=lambda v, a=a: a.place(sign * (v - at))
        ))  # fmt: skip
    events = [
        replace(
            e, at=there(e.at),
            kinds=frozenset(SWAPPED.get(k, k) if sign < 0 else k for k in e.kinds),
        )
        for e in form.events
    ]  # fmt: skip
    assert all(abs(e.at) < 0.95 for e in events)
    tau = sign * (sympy.Symbol("tau") - at)

    def moved(pairs: Any) -> Any:
        return tuple((name, sympy.sympify(f).subs(SIGMA, tau)) for name, f in pairs)

    return replace(
        form, arcs=tuple(arcs), events=tuple(events), energy=form.energy.subs(SIGMA, tau),
        functions=tuple(moved(union) for union in form.functions), equations=moved(form.equations),
    )  # fmt: skip


def renamed(form: Form, mark: str) -> Form:
    """Return a form whose coordinates and functions have a mark in their names."""
    to = {sympy.Symbol(n): sympy.Symbol(n + mark) for n in form.names}

    def new(pairs: Any) -> Any:
        return tuple((name + mark, f.subs(to)) for name, f in pairs)

    return replace(
        form, names=tuple(n + mark for n in form.names), energy=form.energy.subs(to),
        functions=tuple(new(union) for union in form.functions), equations=new(form.equations),
        arcs=tuple(replace(a, active=frozenset(n + mark for n in a.active)) for a in form.arcs),
    )  # fmt: skip


def added(one: Form, two: Form) -> Form:
    """Return the sum of two forms with coordinates of their own and no event at the same value."""
    pairs: dict[tuple[int, int], int] = {}
    arcs = []
    for (i, a), (j, b) in product(enumerate(one.arcs), enumerate(two.arcs)):
        low, high = max(a.low, b.low), min(a.high, b.high)
        if low < high:
            pairs[i, j] = len(arcs)
            arcs.append(KnownArc(
                a.active | b.active, low, high,
                lambda v, a=a, b=b: (*a.place(v), *b.place(v)), a.index + b.index,
            ))  # fmt: skip
    events = [
        replace(e, arcs=tuple(pairs[i, j] for i in e.arcs))
        for e in one.events for j, b in enumerate(two.arcs) if b.low < e.at < b.high
    ] + [
        replace(e, arcs=tuple(pairs[i, j] for j in e.arcs))
        for e in two.events for i, a in enumerate(one.arcs) if a.low < e.at < a.high
    ]  # fmt: skip
    return Form(
        one.names + two.names, one.functions + two.functions, one.energy + two.energy,
        tuple(arcs), tuple(events), one.equations + two.equations, one.added and two.added,
    )  # fmt: skip


@dataclass(frozen=True)
class Posed:
    """A problem and its answer.

    Attributes
    ----------
    kind : str
    polyhedron, energy, interval
        The problem, with the parameter ``t``.
    start : (n,) array
        A point on the first arc, at its middle.
    arcs, events
        Those connected with the start, over ``tau``; ends of the interval are not listed.
    unhide : callable
        From ``(q, t)`` to ``(y, tau)``.
    """

    kind: str
    polyhedron: Polyhedron
    energy: SmoothFunction
    interval: tuple[float, float]
    start: Any
    arcs: tuple[KnownArc, ...]
    events: tuple[KnownEvent, ...]
    unhide: Callable[[Any, float], tuple[Any, float]]


def connected(form: Form, first: int) -> tuple[list[KnownArc], list[KnownEvent]]:
    """Return the arcs that events connect with one, this one first, and the events."""
    reached, events = [first], []
    for k in reached:
        for e in form.events:
            if k in e.arcs and e not in events:
                events.append(e)
                reached += [j for j in e.arcs if j not in reached]
    number = {k: j for j, k in enumerate(reached)}
    return [form.arcs[k] for k in reached], [
        replace(e, arcs=tuple(number[k] for k in e.arcs)) for e in events
    ]


def hidden(  # noqa: PLR0915 - one change after the other
    kind: str, form: Form, rng: Rng, odd: int = -1
) -> Posed:
    """Return a form behind changes of coordinates, of the parameter and of units.

    One coordinate may stay odd in itself, and all others even.
    """
    n = len(form.names)
    circles = rng.random(n) < 0.25
    length = np.where(circles, 1.0, 10.0 ** rng.uniform(-3, 3, n))
    qs = sympy.symbols(f"q0:{n}")
    wide = 10.0 ** rng.uniform(-3, 3)
    middle = wide * rng.uniform(-3, 3)
    p = (TIME - float(middle)) / float(wide)
    tau = p + float(rng.uniform(-0.3, 0.3)) * (p**3 - p)
    # A triangular map, then a few turns in coordinate planes.
    ps = [
        2 * sympy.sin(q) if c else q / float(u) for q, c, u in zip(qs, circles, length, strict=True)
    ]
    even = [p**2 if i == odd else p for i, p in enumerate(ps)]
    rs: list[Any] = []
    for i, v in enumerate(ps):
        a, b, c, d = rng.uniform(-0.3, 0.3, 4).tolist()
        before = even[int(rng.integers(i))] if i else 0
        bent = 0 if circles[i] else abs(a) * v**3 / 3
        moved = b * sympy.sin(before) + c * before**2 + d * tau
        rs.append(v + bent + (v * moved if i == odd else moved))
    for _ in range(min(n - 1, 2)):
        i, j = rng.choice(n, 2, replace=False)
        c, d = np.cos(v := rng.uniform(-1, 1)), np.sin(v)
        if odd in (i, j):
            continue
        rs[i], rs[j] = float(c) * rs[i] - float(d) * rs[j], float(d) * rs[i] + float(c) * rs[j]
    phi = sympy.lambdify([qs, TIME], [*rs, tau], "numpy")
    to = {sympy.Symbol(name): r for name, r in zip(form.names, rs, strict=True)}
    to[sympy.Symbol("tau")] = tau

    def unhide(q: Any, t: float) -> tuple[Any, float]:
        *place, at = phi(q, t)
        return np.array(place), at

    def hide(place: Any, v: float) -> tuple[Any, float]:
        t = middle + wide * float(fsolve(lambda w: unhide(q0, middle + wide * w[0])[1] - v, v)[0])
        found, _, ok, _ = fsolve(
            lambda w: unhide(w * length, t)[0] - place, np.zeros(n), full_output=True, xtol=1e-13
        )
        assert ok == 1
        assert (abs(found[circles]) < 1.2).all()
        assert abs(found).max() < 3
        return found * length, t

    q0 = np.zeros(n)
    arcs, events = connected(form, int(rng.integers(len(form.arcs))))
    for a in arcs:  # on circles they stay on the side where the map is one to one
        for v in np.linspace(a.low, a.high, 7):
            hide(a.place(v), v)
    manifold = Manifold(
        tuple(q.name for q in qs),
        tuple(2 * np.pi if c else np.inf for c in circles),
        tuple(float(u) for u in length * rng.uniform(0.3, 3, n)),
    )
    start = hide(arcs[0].place(v := (arcs[0].low + arcs[0].high) / 2), v)

    def function(name: str, expression: Any) -> SmoothFunction:
        own = {"t": start[1]} if expression.has(TIME) else {}
        return SmoothFunction(name, expression, manifold, parameters=own)

    def scaled(pair: tuple[str, Any]) -> SmoothFunction:
        size = float(10.0 ** rng.uniform(-3, 3))
        if rng.random() < 0.3:
            size *= 1 + sympy.sin(even[int(rng.integers(n))]) / 3
        return function(pair[0], size * pair[1].subs(to))

    parts: list[Any] = [
        AnyOf(*map(scaled, union)) if len(union) > 1 else scaled(union[0])
        for union in form.functions
    ]
    parts += [function(f"side{i}", sympy.cos(qs[i]) - 0.1) for i in np.flatnonzero(circles)]
    for i in range(int(rng.integers(0, 3))):
        far = function(f"far{i}", 9 + ps[int(rng.integers(n))] * rng.choice([-1.0, 1.0]))
        if rng.random() < 0.3 and odd < 0:
            far = AnyOf(far, function(f"off{i}", sympy.cos(ps[0]) - 7))
        parts.append(far)
    if not parts:
        parts.append(function("far", 9 + ps[0]))
    rng.shuffle(parts)
    equations = [scaled(pair) for pair in form.equations]
    size = float(10.0 ** rng.uniform(-3, 3))
    energy = function(
        "energy", size * (form.energy.subs(to) * (1 + tau / 4) + float(rng.uniform(-1, 1)) * tau)
    )
    return Posed(
        kind, Polyhedron(manifold, AllOf(*parts), equations), energy,
        (middle - wide, middle + wide), start[0], tuple(arcs), tuple(events), unhide,
    )  # fmt: skip


def drawn(first: Callable[[Rng], Form], rng: Rng, *, mirror: bool = False) -> Posed:
    """Return a form with others added, hidden; its first coordinate may stay odd."""
    at = rng.uniform(-0.45, 0.45)
    form = turned(renamed(first(rng), "_0"), int(rng.choice([-1, 1])), at)
    if form.added:
        others = [rng.choice(PLAIN) for _ in range(int(rng.integers(0, 4)))]
        if rng.random() < 0.4:
            more = [opens, corner_limit, fold, exchange]
            others.append(
                rng.choice(more if mirror else [*more[:3], pitchfork, exchange, reentrant])
            )
        for i, other in enumerate(others):
            sign = int(rng.choice([-1, 1]))
            more = turned(renamed(other(rng), f"_{i + 1}"), sign, rng.uniform(-0.45, 0.45))
            form = added(form, more)
    assert form.arcs
    assert len(form.names) <= 6
    values = sorted({e.at for e in form.events})
    assert np.diff(values).min(initial=1) > 1e-5
    return hidden(first.__name__, form, rng, 0 if mirror else -1)


def problem(seed: int, number: int, *, mirror: bool = False) -> Posed:
    """Return a problem by its number; the kinds come one after the other.

    With a mirror all are pitchforks, and a change of the first coordinate's sign is a symmetry of
    the energy and of all functions that vanish on an arc.
    """
    rng = np.random.default_rng([seed, number])
    while True:
        try:
            return drawn(pitchfork if mirror else FORMS[number % len(FORMS)], rng, mirror=mirror)
        except AssertionError:  # near a degeneration, or beyond the map's reach
            continue
