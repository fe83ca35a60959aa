"""Kernels whose values and derivatives are no numbers, infinite, huge or tiny, here and there.

Run as a program: the compiled descent is given such kernels, the compiled tests of boxes such
enclosures, and compiled formulas such coordinates; see ``checked_memory``.
"""

import ctypes
import random
import sys
import warnings

import numpy as np

HOSTILE = (np.nan, np.inf, -np.inf, 1e308, -1e308, 1e155, 5e-324, -1e-310, 0.0)
SHARES = (0.0, 0.02, 0.1, 0.5, 1.0)  # of the numbers that are hostile
POINTER = ctypes.POINTER(ctypes.c_double)
POINT = ctypes.CFUNCTYPE(None, *[POINTER] * 5)


def kernel(rng, n, rows):
    """Return a point routine of quadratic functions, some of whose numbers are replaced.

    The same ones at each point, or others each time.
    """
    size = 1 + n + n * n
    share, steady = rng.choice(SHARES), rng.random() < 0.7
    A = [[[rng.choice((-1, 0, 1, 2)) for _ in range(n)] for _ in range(n)] for _ in range(rows)]
    g = [[rng.choice((-1, 0, 0, 1)) for _ in range(n)] for _ in range(rows)]
    c = [rng.choice((0, 0, 1, 5)) for _ in range(rows)]

    def replaced():
        chosen = [k for k in range(rows * size) if rng.random() < share]
        return {k: rng.choice(HOSTILE) for k in chosen}

    fixed = replaced()

    def point(q, _, f, J, H):
        hostile = fixed if steady else replaced()
        for i in range(rows):
            slope = [sum((A[i][a][b] + A[i][b][a]) * q[b] for b in range(n)) for a in range(n)]
            value = c[i] + sum((g[i][a] + slope[a] / 2) * q[a] for a in range(n))
            f[i] = hostile.get(i * size, value)
            for a in range(n):
                J[i * n + a] = hostile.get(i * size + 1 + a, g[i][a] + slope[a])
                for b in range(n):
                    at = i * size + 1 + n + a * n + b
                    H[(i * n + a) * n + b] = hostile.get(at, A[i][a][b] + A[i][b][a])

    return POINT(point)


def descents(seed, count):
    """Give the entries of the compiled descent hostile problems."""
    from polycorner.minimisation.descent import intermediate as descent

    rng = random.Random(seed)
    limit = 30
    for _ in range(count):
        n, m, equations = rng.randint(1, 4), rng.randint(0, 3), rng.choice((0, 0, 1, 2))
        rows = m + equations + 1
        compiled = kernel(rng, n, rows)
        address = ctypes.cast(compiled, ctypes.c_void_p).value
        problem = descent.Laid.of(
            calls=[[address, address, n, rows, 0, 0, 0]],
            reads=range(n),
            outputs=range(rows),
            parameters=[0.0],
            scales=np.ones(n),
            inequalities=m,
            rows=rows,
            size=n + rows * (1 + n + n * n),
        )
        masks = [np.array([rng.random() < 0.8 for _ in range(m)], dtype=bool) for _ in range(2)]
        u = np.array([rng.choice((0.0, 0.0, 0.5, -1.0, rng.gauss(0, 1))) for _ in range(n)])
        status, iterations, _, _ = descent.descend(problem, masks[0], u, limit)
        assert 0 <= status < 6
        assert 0 <= iterations <= limit
        descent.restore(problem, masks[0], u)
        descent.on_face(problem, masks[1], u)


def boxes(seed, count):
    """Give the compiled tests of boxes hostile enclosures, directions, regions and motions."""
    from polycorner.proofs.lists import intermediate as lists

    rng = np.random.default_rng(seed)

    def numbers(*shape):
        usual = rng.choice([-1.0, 0.0, 0.3, 1.0], shape)
        return np.where(rng.random(shape) < share, rng.choice(HOSTILE, shape), usual)

    for _ in range(count):
        share = rng.choice(SHARES)
        n, m, k, count, items = *rng.integers(1, 4, 2), rng.integers(0, 3), 3, 5
        where = rng.integers(0, count, items)
        masks, active = rng.random((items, m)) < 0.5, rng.random((2, m)) < 0.5
        middle, width = numbers(count, m + k + 1, n), abs(numbers(count, m + k + 1, n))
        with np.errstate(all="ignore"):
            enclosures = middle - width, middle + width
        sign = rng.choice([-1.0, 0.0])
        _, v, weights = lists.directions(enclosures, where, masks, k, numbers(n), sign)
        assert v.shape == (items, n)
        assert weights.shape == (items, m + 1)
        sides = numbers(count, n), numbers(count, n)
        lists.covered(sides, where, masks, (numbers(2, n), numbers(2, n)), active)
        orders = np.array([rng.permutation(n) for _ in range(2)])
        motions = orders, numbers(2, n), numbers(2, n), numbers(2, n)
        domain = rng.choice([1.0, np.inf], n), numbers(n), numbers(n)
        lists.carried(sides, motions, numbers(n), domain, float(numbers(1)[0]))
        rows, curved = (count, m + 1, n), (count, m + 1, n, n)
        bounds = numbers(*rows), numbers(*rows), numbers(*curved), numbers(*curved)
        lists.bent(bounds, numbers(count, m, n), numbers(count, n))


def formulas(seed, count):
    """Give formulas hostile points, one by one, in rows and in lanes, and hostile boxes."""
    import sympy as sp

    from polycorner import Manifold, SmoothFunction
    from polycorner.formulas.families import Family
    from polycorner.intervals.boxes import BoxFunctions

    rng, plane = np.random.default_rng(seed), Manifold.euclidean("x y")
    x, y = plane.symbols
    root, angle = sp.Abs(x - y) ** sp.Rational(3, 2), sp.atan2(y, x)
    stated = (root, angle, sp.sin(x) / y, sp.log(x), sp.exp(x * y), sp.tan(x), sp.Abs(x) ** y)
    kernel = Family.of({f"f{k}": e for k, e in enumerate(stated)}, ["x", "y"], []).kernel
    boxes = BoxFunctions([SmoothFunction(f"f{k}", e, plane) for k, e in enumerate(stated)], plane)
    none = np.zeros(1)
    for rows in rng.integers(1, 100, count).tolist():
        q = rng.choice([*HOSTILE, 1.0, -0.3], (rows, 2))
        for order in range(3):
            results = kernel.over(q, none.ctypes.data, order)
            for at, *values in zip(q, *results, strict=True):
                one = kernel.at(at, none.ctypes.data, order)
                for value, same in zip(values, one, strict=True):
                    np.testing.assert_array_equal(value, same)
        sides = q, rng.choice([*HOSTILE, 1.0], (rows, 2))
        for enclosed in (boxes.values, boxes.gradients, boxes.hessians):
            assert all(len(bound) == rows for bound in enclosed(*sides))


if __name__ == "__main__":
    given = {"descents": descents, "boxes": boxes, "formulas": formulas}
    warnings.simplefilter("ignore")
    given[sys.argv[1]](*map(int, sys.argv[2:]))
