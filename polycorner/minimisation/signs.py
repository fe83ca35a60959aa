"""Signs near the origin of polynomials in free variables and in variables that are not negative.

Known sufficient and necessary conditions, tried in turn ([Vasilev], [AGV] ch. 17 for weights and
Newton diagrams):

- if every monomial that no other divides has a positive coefficient and even exponents in the free
  variables, each other monomial is small beside one of these: the polynomial is not negative, and
  positive off 0 exactly if each variable has a power of its own among them;
- for weights of the variables, the form of lowest weighted degree decides by its values on the
  box ``max |w_i| = 1`` if it is positive there, or negative somewhere; branch and bound tells;
- where a form of lowest degree ``K`` vanishes on a ray ``e`` and is curved across it, ``r`` is
  positive near the ray exactly if the least value over ``y`` of ``r(t (e + y)) / t^K`` is, a
  series in ``t``.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from math import lcm

import numpy as np
from numpy.typing import NDArray

from polycorner.minimisation.jets import Ring, ring
from polycorner.polyhedra.cones import null_space
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT
from polycorner.values import Value

MAX_BOXES = 20_000  # of one pass
DEPTH = 30  # halvings of a box
APART = 0.05  # distance of zeros that are told apart
SIMPLE = 0.05  # of the largest coefficient across a ray: one that gives the order of a zero
EDGES = 24  # of Newton's diagram tried, at most


def least_on_box(
    exponents: NDArray[np.int64], values: Array, half: int
) -> tuple[float, Array, list[Array]]:
    """Return the sign of the least value on ``max |w| = 1`` as a number, where, and zeros.

    The number is 0 where branch and bound cannot tell; the zeros are then the middles of the boxes
    that are left.
    """
    m = exponents.shape[1]
    limit = DEFAULT.level * abs(values).sum()
    middles, widths = _sides(m, half)
    best, where = np.inf, np.ones(m)
    for _ in range(DEPTH * max(1, m - 1)):
        terms = np.prod(middles[:, None, :] ** exponents, axis=2)
        heights = terms @ values
        if heights.min() < best:
            best, where = float(heights.min()), middles[int(heights.argmin())]
        if best < -limit:
            return -1.0, where, []
        reach = np.prod((abs(middles) + widths)[:, None, :] ** exponents, axis=2)
        left = heights - (reach - abs(terms)) @ abs(values) <= limit
        if not left.any():
            return 1.0, where, []
        middles, widths = middles[left], widths[left]
        if len(middles) > MAX_BOXES or widths.max() < 2.0**-DEPTH:
            break
        middles, widths = _halved(middles, widths)
    return 0.0, where, distinct(middles)


def _sides(m: int, half: int) -> tuple[Array, Array]:
    middles, widths = [], []
    for i in range(m):
        for side in (1.0, -1.0):
            if side < 0 and i < half:
                continue
            middle, width = np.zeros(m), np.ones(m)
            middle[:half], width[:half] = 0.5, 0.5
            middle[i], width[i] = side, 0.0
            middles.append(middle)
            widths.append(width)
    return np.array(middles), np.array(widths)


def _halved(middles: Array, widths: Array) -> tuple[Array, Array]:
    rows = np.arange(len(widths))
    axis = widths.argmax(axis=1)
    widths = widths.copy()
    widths[rows, axis] /= 2
    move = np.zeros_like(widths)
    move[rows, axis] = widths[rows, axis]
    return np.vstack([middles - move, middles + move]), np.vstack([widths, widths])


def distinct(points: Array | list[Array]) -> list[Array]:
    """Return one unit direction for each cluster of points, opposite ones as one."""
    found: list[Array] = []
    left = np.array(points)
    left /= np.linalg.norm(left, axis=1)[:, None]
    while len(left):
        ray = left[0]
        found.append(ray)
        apart = np.minimum(abs(left - ray).max(axis=1), abs(left + ray).max(axis=1))
        left = left[apart > APART]
        if len(found) > 2 * len(ray) + 4:
            return []
    return found


class Sign(Enum):
    """Sign of a polynomial near 0, off 0."""

    POSITIVE = "positive"
    ZERO = "not negative, and zero on a set through the point"
    NEGATIVE = "negative somewhere"
    UNKNOWN = "undecided"


@dataclass(frozen=True, eq=False)
class Signed(Value):
    """A sign, the (weighted) degree and the direction that decided, and zeros.

    Attributes
    ----------
    sign : Sign
    degree : int
        Degree of the terms that decide; 0 if none does.
    direction : (m,) array
        Where these terms are negative, or least.
    weights : tuple of int
        The curve ``(t^a_1 w_1, ..., t^a_m w_m)`` was followed.
    zeros : (r, m) array
        Directions in which the polynomial vanishes to its order.
    """

    sign: Sign
    degree: int
    direction: Array
    weights: tuple[int, ...]
    zeros: Array


def signed(sign: Sign, degree: int, direction: Array, weights: tuple[int, ...] = ()) -> Signed:
    """Return a result without zeros."""
    m = len(direction)
    return Signed(sign, degree, direction, weights or (1,) * m, np.empty((0, m)))


def sign_near_zero(domain: Ring, coefficients: Array, half: int) -> Signed:
    """Return the sign of a polynomial near 0, its first ``half`` variables not negative.

    Coefficients that count as zero are zero.
    """
    m = domain.variables
    found = _by_monomials(domain, coefficients, half)
    if found is not None:
        return found
    zeros: list[Array] = []
    for weights in _weights(domain, coefficients, half):
        degrees = domain.exponents @ np.array(weights)
        lowest = int(degrees[coefficients != 0].min())
        chosen = (degrees == lowest) & (coefficients != 0)
        least, where, zeros = least_on_box(domain.exponents[chosen], coefficients[chosen], half)
        if least > 0:
            return signed(Sign.POSITIVE, lowest, where, weights)
        if least < 0:
            return signed(Sign.NEGATIVE, lowest, where, weights)
        if set(weights) == {1} and not half and m > 1:
            return _along_rays(domain, coefficients, lowest, zeros)
    return signed(Sign.UNKNOWN, 0, np.zeros(m))


def _by_monomials(domain: Ring, coefficients: Array, half: int) -> Signed | None:
    """Decide by the monomials that no other divides; None if they do not."""
    present = domain.exponents[coefficients != 0]
    values = coefficients[coefficients != 0]
    divides = (present[:, None] <= present[None]).all(axis=2)
    np.fill_diagonal(divides, val=False)
    least = ~divides.any(axis=0)
    powers, factors = present[least], values[least]
    if (factors < 0).any() or (powers[:, half:] % 2).any():
        return None
    m = domain.variables
    own = [((powers > 0).sum(axis=1) == 1) & (powers[:, i] > 0) for i in range(m)]
    degree = int(powers.sum(axis=1).max(initial=0))
    zeros = np.eye(m)[[not which.any() for which in own]]
    opposite = -zeros[zeros[:, :half].sum(axis=1) == 0]
    sign = Sign.ZERO if len(zeros) else Sign.POSITIVE
    direction = np.eye(m)[int(np.argmax([powers[which].sum() for which in own]))]
    return Signed(sign, degree, direction, (1,) * m, np.vstack([zeros, opposite]))


def _weights(domain: Ring, coefficients: Array, half: int) -> Iterator[tuple[int, ...]]:
    """Yield weights: equal ones, then those that give the pure powers one degree."""
    m = domain.variables
    yield (2,) * half + (1,) * (m - half) if half and m > half else (1,) * m
    if half and m > half:
        yield (1,) * m
    present = domain.exponents[coefficients != 0]
    powers = []
    for i in range(m):
        own = present[(present.sum(axis=1) == present[:, i]), i]
        powers.append(int(own.min()) if len(own) else domain.order + 1)
    common = lcm(*powers)
    yield tuple(common // power for power in powers)
    for row in present[(present > 0).sum(axis=1) > 1][:EDGES]:
        # The edge of Newton's diagram between a mixed monomial and the pure powers.
        for i in np.flatnonzero(row).tolist():
            left = powers[i] - int(row[i])
            others = [int(e) for j, e in enumerate(row) if j != i]
            if m == 2 and left > 0 and others[0] > 0:
                pair = [left, left]
                pair[i] = others[0]
                yield tuple(pair)


def _along_rays(domain: Ring, coefficients: Array, degree: int, rays: list[Array]) -> Signed:
    """Decide a polynomial whose form of lowest degree is positive off some lines."""
    m = domain.variables
    unknown = signed(Sign.UNKNOWN, 0, np.zeros(m))
    if not rays:
        return unknown
    rays = distinct([_refined(domain, coefficients, degree, ray) for ray in rays])
    results = [_along_ray(domain, coefficients, degree, ray) for ray in rays]
    for result in results:
        if result is not None and result.sign is Sign.NEGATIVE:
            return result
    if any(result is None for result in results):
        return _in_coordinates_of(rays, domain, coefficients) or unknown
    known = [result for result in results if result is not None]
    zeros = [r.direction for r in known if r.sign is Sign.ZERO]
    if zeros:
        both = np.array(zeros + [-z for z in zeros])
        return Signed(Sign.ZERO, degree, zeros[0], (1,) * m, both)
    return max(known, key=lambda r: r.degree)


def _along_ray(domain: Ring, coefficients: Array, degree: int, ray: Array) -> Signed | None:
    """Return the sign near a line; None where the form is not curved across it."""
    m, rest = domain.variables, domain.order - degree
    axes = np.column_stack([ray, null_space(ray[None, :], 1e-9)])
    turned = substituted(domain, coefficients, axes)
    blown = ring(m, domain.order)
    g = np.zeros(blown.size)
    for e, c in zip(domain.exponents, turned, strict=True):
        power = (int(e.sum()) - degree, *e[1:].tolist())
        if c and power[0] >= 0 and sum(power) <= blown.order:
            g[blown.index[power]] = c
    size = abs(turned[domain.degrees == degree]).max()
    g[abs(g) <= DEFAULT.level * size * (blown.exponents[:, 0] == 0) * (blown.degrees <= 1)] = 0.0
    series = _least_across(blown, g, rest, size)
    if series is None:
        return None
    for k in range(1, rest + 1):
        if abs(series[k]) > DEFAULT.level * size:
            sign = Sign.NEGATIVE if k % 2 or series[k] < 0 else Sign.POSITIVE
            return signed(sign, degree + k, -ray if series[k] > 0 and k % 2 else ray)
    return signed(Sign.ZERO, degree, ray)


def _refined(domain: Ring, coefficients: Array, degree: int, ray: Array) -> Array:
    """Return the zero ray of a form near a given one, by Newton's method for its minimum.

    In two variables, where the form is ``q(t)`` on a line across the ray, the zero of ``q`` of
    order ``k`` is that of its derivative of order ``k - 1``, which is simple.
    """
    if domain.variables == 2:
        return _refined_in_plane(domain, coefficients, degree, ray)
    form = np.where(domain.degrees == degree, coefficients, 0.0)
    slopes = [domain.derivative(form, i) for i in range(domain.variables)]
    bends = [[domain.derivative(s, j) for j in range(domain.variables)] for s in slopes]
    for _ in range(6):
        powers = np.prod(ray**domain.exponents, axis=1)
        across = null_space(ray[None, :], 1e-9)
        pull = across.T @ (np.array(slopes) @ powers)
        bend = across.T @ (np.array(bends) @ powers) @ across
        step = across @ np.linalg.lstsq(bend, pull, rcond=1e-6)[0]
        if not np.linalg.norm(step) < 0.1:
            break
        ray = (ray - step) / np.linalg.norm(ray - step)
    return ray


def _refined_in_plane(domain: Ring, coefficients: Array, degree: int, ray: Array) -> Array:
    form = np.where(domain.degrees == degree, coefficients, 0.0)
    for _ in range(5):
        across = np.array([-ray[1], ray[0]])
        turned = substituted(domain, form, np.column_stack([ray, across]))
        q = np.array([turned[domain.index[degree - j, j]] for j in range(degree + 1)])
        k = int((abs(q) > SIMPLE * abs(q).max()).argmax())
        if k < 1:
            break
        ray = ray - q[k - 1] / (k * q[k]) * across
        ray = ray / np.linalg.norm(ray)
    return ray


def _least_across(blown: Ring, g: Array, order: int, size: float) -> Array | None:
    """Return ``min_y g(t, y)`` as a series in ``t``; None unless ``g`` is curved in ``y`` at 0."""
    m = blown.variables
    bend = np.array(
        [
            [
                g[blown.index[tuple(a + b)]] * (2.0 if i == j else 1.0)
                for j, b in enumerate(_unit(m))
            ]
            for i, a in enumerate(_unit(m))
        ]
    )
    if np.linalg.eigvalsh(bend)[0] <= 1e-5 * size:
        return None
    line = ring(1, order)
    y = np.zeros((m - 1, 2, line.size))
    slopes = [blown.derivative(g, i + 1) for i in range(m - 1)]
    t = line.variable(0)
    for _ in range(order + 1):
        pull = np.array([_evaluated(blown, s, [t, *y], line)[0] for s in slopes])
        y[:, 0] -= np.linalg.solve(bend, pull)
    return np.asarray(_evaluated(blown, g, [t, *y], line)[0])


def _unit(m: int) -> list[Array]:
    return list(np.eye(m, dtype=np.int64)[1:])


def _evaluated(domain: Ring, coefficients: Array, w: list[Array], line: Ring) -> Array:
    """Return a polynomial of series."""
    total = line.constant(0.0)
    products: dict[tuple[int, ...], Array] = {(0,) * domain.variables: line.constant(1.0)}
    for e, c in zip(domain.exponents.tolist(), coefficients, strict=True):
        key = tuple(e)
        if key not in products:
            i = next(i for i, power in enumerate(e) if power)
            lower = tuple(power - (j == i) for j, power in enumerate(e))
            products[key] = line.mul(products[lower], w[i])
        if c:
            total = total + c * products[key]
    return total


def substituted(domain: Ring, coefficients: Array, axes: Array) -> Array:
    """Return the coefficients of ``p(axes w)``."""
    w = [
        sum((a * domain.variable(j) for j, a in enumerate(row)), np.zeros((2, domain.size)))
        for row in axes
    ]
    return np.asarray(_evaluated(domain, coefficients, w, domain)[0])


def _in_coordinates_of(rays: list[Array], domain: Ring, coefficients: Array) -> Signed | None:
    """Decide in coordinates whose axes are the given rays, completed; None if that fails."""
    m = domain.variables
    if len(rays) > m:
        return None
    given = np.array(rays)
    axes = np.vstack([given, null_space(given, 1e-6).T]).T
    if axes.shape[1] != m or np.linalg.cond(axes) > 1e3:
        return None
    turned = substituted(domain, coefficients, axes)
    turned[abs(turned) <= 1e-7 * abs(turned).max()] = 0.0
    found = _by_monomials(domain, turned, 0)
    if found is None:
        for weights in list(_weights(domain, turned, 0))[1:]:
            degrees = domain.exponents @ np.array(weights)
            lowest = int(degrees[turned != 0].min())
            chosen = (degrees == lowest) & (turned != 0)
            least, where, _ = least_on_box(domain.exponents[chosen], turned[chosen], 0)
            if least:
                sign = Sign.POSITIVE if least > 0 else Sign.NEGATIVE
                return signed(sign, lowest, axes @ where, weights)
        return None
    return Signed(
        found.sign, found.degree, axes @ found.direction, found.weights, found.zeros @ axes.T
    )
