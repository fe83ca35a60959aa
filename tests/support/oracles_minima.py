"""Slow, independent truths that the minima are tested against."""

from itertools import combinations

import numpy as np
import sympy as sp


def quadratic_programme(B, g, A, b, equations):
    """Minimise ``g.d + d.B.d / 2`` with ``A d + b >= 0``, the last rows ``= 0``, face by face.

    Returns the minimiser, or None where no point satisfies the rows.
    """
    rows, n = A.shape
    best = None
    for size in range(rows - equations + 1):
        for chosen in combinations(range(rows - equations), size):
            held = [*chosen, *range(rows - equations, rows)]
            system = np.block([[B, -A[held].T], [A[held], np.zeros((len(held), len(held)))]])
            right = np.concatenate([-g, -b[held]])
            found = np.linalg.lstsq(system, right, rcond=1e-11)[0]
            d = found[:n]
            if abs(system @ found - right).max(initial=0) > 1e-8:
                continue
            if (A @ d + b)[: rows - equations].min(initial=0) < -1e-8:
                continue
            value = g @ d + d @ B @ d / 2
            if best is None or value < best[0]:
                best = value, d
    return None if best is None else best[1]


def plain_residuals(certificate, symbols, energy, functions, equations=None):
    """Recompute the residuals with NumPy alone from the SymPy expressions."""
    scales = np.array(certificate.problem.polyhedron.manifold.scales)
    values, rows = [], []
    for f in (functions | (equations or {})).values():
        value, row, _ = _derivatives(symbols, f, certificate.point)
        values.append(value)
        rows.append(row * scales)
    _, slope, hessian = _derivatives(symbols, energy, certificate.point)
    slope, hessian = slope * scales, hessian * np.outer(scales, scales)
    size = max(abs(slope).max(), abs(hessian).max())
    names = [*functions, *(equations or {})]
    missed = [0.0]
    for name, value, row in zip(names, values, rows, strict=True):
        distance = value / np.linalg.norm(row)
        missed.append(-distance if name in functions else abs(distance))
    product = [0.0]
    for name, value, row in zip(names, values, rows, strict=True):
        if name in certificate.multipliers:
            slope = slope - certificate.multipliers[name] * row
            product.append(abs(certificate.multipliers[name] * value))
    return max(missed), abs(slope).max() / size, max(product) / size


def _derivatives(symbols, f, point):
    parts = (f, [sp.diff(f, x) for x in symbols], sp.hessian(f, symbols).tolist())
    at = [sp.lambdify([symbols], part, "numpy")(point) for part in parts]
    return float(at[0]), np.array(at[1], dtype=float), np.array(at[2], dtype=float)


def feasible_around(polyhedron, point, radii, rng, count):
    """Return random points of the polyhedron within each radius, in scale units, of a point.

    Half of them are drawn in the ball, half in the cone that the closed gaps leave open, so that a
    narrow corner is not missed.
    """
    manifold = polyhedron.manifold
    scales, n = np.array(manifold.scales), manifold.dimension
    values, gradients = polyhedron.values(point), polyhedron.gradients(point) * scales
    closed = gradients[abs(values) <= 1e-6 * np.linalg.norm(gradients, axis=1)]
    batches = []
    for radius in radii:
        ball = rng.normal(size=(count // 2, n))
        openings = abs(rng.normal(size=(count // 2, len(closed)))) ** 2
        inward = rng.normal(size=(count // 2, n))
        if len(closed):
            inward += (openings - inward @ closed.T) @ np.linalg.pinv(closed).T
        steps = np.vstack([ball, inward])
        steps *= (
            radius * rng.random((count // 2 * 2, 1)) / np.linalg.norm(steps, axis=1, keepdims=True)
        )
        batches.append(point + steps * scales)
    around = np.vstack(batches)
    return around[polyhedron.contains(around)]


def least_on_cone(form, rows, count=200_001):
    """Return the least value of ``d.form.d`` on unit vectors of ``{rows d >= 0}``, by sampling.

    In the plane every direction of a fine circle is tried, in space those of a Fibonacci sphere.
    """
    n = len(form)
    if n == 2:
        angle = np.linspace(0, 2 * np.pi, count)
        d = np.column_stack([np.cos(angle), np.sin(angle)])
    else:
        k = np.arange(count) + 0.5
        z, turn = 1 - 2 * k / count, np.pi * (1 + 5**0.5) * k
        r = np.sqrt(1 - z**2)
        d = np.column_stack([r * np.cos(turn), r * np.sin(turn), z])
    d = d[(d @ np.asarray(rows).T >= 0).all(axis=1)]
    return np.einsum("ki,ij,kj->k", d, form, d).min()
