"""Limits on velocities ``f(q, v, t) >= 0`` and nonholonomic equations ``f(q, v, t) = 0``.

They are ideal: the force is along ``df/dv``, of a limit in its direction and only where ``f = 0``.
"""

from collections.abc import Callable, Collection, Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from polycorner.checks import names, real, refuse
from polycorner.formulas.expressions import as_expression
from polycorner.formulas.families import Family
from polycorner.motion.bodies import BodyLimits
from polycorner.motion.contacts import velocities
from polycorner.motion.formulation import TIME, degree
from polycorner.motion.noise import OPTIONS
from polycorner.spaces.manifold import Array, Manifold
from polycorner.tolerances import DEFAULT

if TYPE_CHECKING:
    import sympy

DRAWS = 64  # random states at which a limit is looked at
WORK = ("applied", "drive", "left", "noise", "substrate")  # names under which other work is booked


def compiled_limits(
    manifold: Manifold,
    limits: "Mapping[str, sympy.Expr]",
    nonholonomic: "Mapping[str, sympy.Expr]",
    taken: Collection[str],
) -> BodyLimits | None:
    """Return the compiled limits and nonholonomic equations of a body, None if there are none.

    Parameters
    ----------
    manifold : Manifold
    limits, nonholonomic : mapping from str to sympy.Expr
        ``f >= 0`` and ``f = 0``, functions of coordinates, velocities and the time.
    taken : collection of str
        Names of contacts and of equations, which limits cannot have.

    Raises
    ------
    ValueError
        For symbols that the system does not have, formulas without velocities, limits that are not
        concave in the velocities, equations that are not affine in them, and names that are taken.
    """
    if not limits and not nonholonomic:
        return None
    variables = (*manifold.names, *(s.name for s in velocities(manifold)), TIME)
    for argument, formulas in (("limits", limits), ("nonholonomic", nonholonomic)):
        for name, f in formulas.items():
            if name in (*taken, *WORK) or (formulas is nonholonomic and name in limits):
                refuse(argument, "names that nothing else has", name)
            if unknown := sorted({s.name for s in f.free_symbols} - {*variables}):
                expected = f"a formula in {', '.join(variables)} for {name!r}"
                refuse(argument, expected, unknown[0])
            _check_shape(argument, manifold, name, f, affine=formulas is nonholonomic)
    every = {**limits, **nonholonomic}
    timed = any(s.name == TIME for f in every.values() for s in f.free_symbols)
    curved = any(degree(f, velocities(manifold)) > 1 for f in limits.values())
    return BodyLimits(Family.of(every, variables), len(nonholonomic), timed, curved)


def _check_shape(
    argument: str, manifold: Manifold, name: str, f: "sympy.Expr", *, affine: bool
) -> None:
    """Raise ValueError unless a formula depends on velocities, and is affine or concave in them."""
    speeds = velocities(manifold)
    if not f.free_symbols & {*speeds}:
        expected = f"a formula in the velocities {', '.join(map(str, speeds))} for {name!r}"
        refuse(argument, f"{expected} (of places alone, it is one of the polyhedron)", f)
    if degree(f, speeds) <= 1:
        return
    curved = _curvatures(manifold, f)
    most = DEFAULT.alike * np.abs(curved).max(initial=0.0)
    if affine and (abs(curved) > most).any():
        refuse(argument, f"an affine function of the velocities for {name!r}", f)
    if (curved > most).any():
        refuse(argument, f"a function that is concave in the velocities for {name!r}", f)


def _curvatures(manifold: Manifold, f: "sympy.Expr") -> Array:
    """Return the curvatures of a formula by the velocities at random states where it has some."""
    k = manifold.size
    family = Family.of({"f": f}, (*manifold.names, *(s.name for s in velocities(manifold)), TIME))
    draws = np.random.default_rng(0).normal(size=(DRAWS, 2 * k + 1))
    draws[:, :k] *= manifold.scale_array
    draws[:, k : 2 * k] *= manifold.scale_array
    with np.errstate(all="ignore"):
        *_, bends = family.evaluate(draws, order=2)
    bends = bends[:, 0, k : 2 * k, k : 2 * k]
    bends = bends * np.outer(manifold.scale_array, manifold.scale_array)
    known = np.isfinite(bends).all(axis=(1, 2))
    return np.asarray(np.linalg.eigvalsh(bends[known]), dtype=np.float64)


def rate_limits(
    rates: "Mapping[str, sympy.Expr]", bounds: Mapping[str, Any]
) -> "dict[str, sympy.Expr]":
    """Return the limits ``|rate| <= bound`` of joints, called ``"joint.rate"``.

    Each is one function, ``(c - r^2 / c) / 2``, which is concave in the velocities.
    """
    names("rates", bounds, rates)
    found = {}
    for name, bound in bounds.items():
        c = as_expression("rates", real("rates", bound, above=0))
        found[f"{name}.rate"] = (c - rates[name] ** 2 / c) / 2
    return found


def check_limited(
    limits: BodyLimits | None,
    scales: Array,
    q: Array,
    v: Array,
    time: float,
    called: Callable[[int], str],
) -> None:
    """Raise ValueError where velocities are beyond a limit, or off an equation, naming the first.

    Parameters
    ----------
    limits : BodyLimits or None
    scales : (n,) array
        Of the coordinates.
    q, v : (n,) or (N, n) array
        Of one body, or of several.
    time : float
    called : function
        Returns what the body of a number is called.
    """
    if limits is None:
        return
    points = np.concatenate([q, v, np.full((*q.shape[:-1], 1), time)], axis=-1)
    values, slopes = limits.rows.evaluate(points, order=1)
    rows = slopes[..., q.shape[-1] : -1]
    sizes = np.linalg.norm(rows * scales, axis=-1)
    along = (rows * v[..., None, :]).sum(axis=-1)
    most = sizes * np.linalg.norm(v / scales, axis=-1)[..., None] + abs(values - along)
    first = len(limits.names) - limits.equations
    for at in np.ndindex(values.shape):
        whose = f" of {called(at[0])}" if len(at) > 1 else ""
        name, value = f"{limits.names[at[-1]]!r}{whose}", values[at]
        if at[-1] >= first and not sizes[at] > 0:
            msg = (
                f"v: expected a gradient of equation {name} by the velocities that is not zero, "
                "for it is the direction of its force; got zero"
            )
            raise ValueError(msg)
        if at[-1] >= first and not abs(value) <= OPTIONS.overlap * most[at]:
            msg = f"v: expected velocities with which equation {name} holds; it is {value:.6g}"
            raise ValueError(msg)
        if at[-1] < first and not value >= -OPTIONS.overlap * most[at]:
            msg = f"v: expected velocities within the limit {name}; its value is {value:.6g}"
            raise ValueError(msg)


def described_limits(
    limits: "Mapping[str, sympy.Expr]",
    nonholonomic: "Mapping[str, sympy.Expr]",
    text: Callable[[Any], str],
) -> Iterator[tuple[str, str]]:
    """Yield limits and equations with what they are called, as text."""
    for name, f in limits.items():
        yield f"limit {name}", text(f)
    for name, f in nonholonomic.items():
        yield f"nonholonomic {name}", text(f)
