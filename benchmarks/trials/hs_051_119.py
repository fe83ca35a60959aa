"""Hock and Schittkowski, nos. 51 to 119: energy, inequalities, equations."""

from itertools import accumulate, pairwise
from math import prod

import sympy
from sympy import Piecewise, cos, erf, exp, log, sin, sqrt

from benchmarks.trials import hs_data as data
from benchmarks.trials.statements import Collection

STATEMENTS = Collection()
problem = STATEMENTS.add
free = None


def weighted(rows, x):
    """Return the linear forms whose coefficients are the rows."""
    return [sum(c * xi for c, xi in zip(row, x, strict=True)) for row in rows]


def monomials(terms, x):
    """Return a sum of coefficients times powers; a term is (coefficient, *exponents)."""
    return sum(c * prod(xi**p for xi, p in zip(x, ps, strict=True)) for c, *ps in terms)


def between(low, value, high):
    return [value - low, high - value]


def chain(x1, x2, x3, x4, x5):
    return [x1 + 3 * x2, x3 + x4 - 2 * x5, x2 - x5]


@problem((2.5, 0.5, 2, -1, 0.5), 0)
def hs51(x1, x2, x3, x4, x5):
    energy = (x1 - x2) ** 2 + (x2 + x3 - 2) ** 2 + (x4 - 1) ** 2 + (x5 - 1) ** 2
    return energy, [], [x1 + 3 * x2 - 4, x3 + x4 - 2 * x5, x2 - x5]


@problem((2, 2, 2, 2, 2), 1859 / 349)
def hs52(x1, x2, x3, x4, x5):
    energy = (4 * x1 - x2) ** 2 + (x2 + x3 - 2) ** 2 + (x4 - 1) ** 2 + (x5 - 1) ** 2
    return energy, [], chain(x1, x2, x3, x4, x5)


@problem((2, 2, 2, 2, 2), 176 / 43, lower=-10, upper=10)
def hs53(x1, x2, x3, x4, x5):
    energy = (x1 - x2) ** 2 + (x2 + x3 - 2) ** 2 + (x4 - 1) ** 2 + (x5 - 1) ** 2
    return energy, [], chain(x1, x2, x3, x4, x5)


@problem(
    (6e3, 1.5, 4e6, 2, 3e-3, 5e7),
    -0.9080748196,
    lower=(0, -10, 0, 0, -1, 0),
    upper=(2e4, 10, 1e7, 20, 1, 2e8),
)
def hs54(x1, x2, x3, x4, x5, x6):
    u, v = (x1 - 1e4) / 8e3, x2 - 1
    pair = (u**2 + 0.4 * u * v + v**2) / 0.96
    rest = ((x3 - 2e6) / 7e6) ** 2 + ((x4 - 10) / 50) ** 2
    rest += ((x5 - 1e-3) / 0.05) ** 2 + ((x6 - 1e8) / 5e8) ** 2
    return -exp(-(pair + rest) / 2), [], [x1 + 4e3 * x2 - 1.76e4]


@problem((1, 2, 0, 0, 0, 2), 19 / 3, lower=0, upper=(1, free, free, 1, free, free))
def hs55(x1, x2, x3, x4, x5, x6):
    h = [
        x1 + 2 * x2 + 5 * x5 - 6,
        x1 + x2 + x3 - 3,
        x4 + x5 + x6 - 2,
        x1 + x4 - 1,
        x2 + x5 - 2,
        x3 + x6 - 2,
    ]
    return x1 + 2 * x2 + 4 * x5 + exp(x1 * x4), [], h


@problem((1, 1, 1, *[0.50973968] * 3, 0.98511078), -3.456)
def hs56(x1, x2, x3, x4, x5, x6, x7):
    h = [x1 - 4.2 * sin(x4) ** 2, x2 - 4.2 * sin(x5) ** 2, x3 - 4.2 * sin(x6) ** 2]
    return -x1 * x2 * x3, [], [*h, x1 + 2 * x2 + 2 * x3 - 7.2 * sin(x7) ** 2]


@problem((0.42, 5), 0.02845966972, lower=(0.4, -4))
def hs57(x1, x2):
    curve = [x1 + (0.49 - x1) * exp(-x2 * (a - 8)) for a in data.TIMES_57]
    misfit = sum((b - c) ** 2 for b, c in zip(data.VALUES_57, curve, strict=True))
    return misfit, [0.49 * x2 - x1 * x2 - 0.09], []


@problem((90, 10), -7.802789472, lower=0, upper=(75, 65))
def hs59(x1, x2):
    powers = monomials(data.POWERS_59, (x1, x2))
    energy = powers + 28.106 / (x2 + 1) + 2.8673 * exp(0.0005 * x1 * x2)
    return energy, [x1 * x2 - 700, x2 - x1**2 / 125, (x2 - 50) ** 2 - 5 * (x1 - 55)], []


@problem((2, 2, 2), 0.03256820025, lower=-10, upper=10)
def hs60(x1, x2, x3):
    energy = (x1 - 1) ** 2 + (x1 - x2) ** 2 + (x2 - x3) ** 4
    return energy, [], [x1 * (1 + x2**2) + x3**4 - 4 - 3 * sqrt(2)]


@problem((0, 0, 0), -143.6461422)
def hs61(x1, x2, x3):
    energy = 4 * x1**2 + 2 * x2**2 + 2 * x3**2 - 33 * x1 + 16 * x2 - 24 * x3
    return energy, [], [3 * x1 - 2 * x2**2 - 7, 4 * x1 - x3**2 - 11]


@problem((0.7, 0.2, 0.1), -26272.51448, lower=0, upper=1)
def hs62(x1, x2, x3):
    first = 255 * log((x1 + x2 + x3 + 0.03) / (0.09 * x1 + x2 + x3 + 0.03))
    second = 280 * log((x2 + x3 + 0.03) / (0.07 * x2 + x3 + 0.03))
    third = 290 * log((x3 + 0.03) / (0.13 * x3 + 0.03))
    return -32.174 * (first + second + third), [], [x1 + x2 + x3 - 1]


@problem((2, 2, 2), 961.7151721, lower=0)
def hs63(x1, x2, x3):
    energy = 1000 - x1**2 - 2 * x2**2 - x3**2 - x1 * x2 - x1 * x3
    return energy, [], [8 * x1 + 14 * x2 + 7 * x3 - 56, x1**2 + x2**2 + x3**2 - 25]


@problem((1, 1, 1), 6299.842428, lower=1e-5)
def hs64(x1, x2, x3):
    energy = 5 * x1 + 5e4 / x1 + 20 * x2 + 7.2e4 / x2 + 10 * x3 + 1.44e5 / x3
    return energy, [1 - 4 / x1 - 32 / x2 - 120 / x3], []


@problem((-5, 5, 0), 0.9535288567, lower=(-4.5, -4.5, -5), upper=(4.5, 4.5, 5))
def hs65(x1, x2, x3):
    energy = (x1 - x2) ** 2 + (x1 + x2 - 10) ** 2 / 9 + (x3 - 5) ** 2
    return energy, [48 - x1**2 - x2**2 - x3**2], []


@problem((0, 1.05, 2.9), 0.5181632741, lower=0, upper=(100, 100, 10))
def hs66(x1, x2, x3):
    return 0.2 * x3 - 0.8 * x1, [x2 - exp(x1), x3 - exp(x2)], []


def control_chart(a, b, n, x1, x2, x3, x4):
    """Return the cost of a control chart, nos. 68 and 69, with the normal integral."""

    def integral(t):
        return (1 + erf(t / sqrt(2))) / 2

    grown = exp(x1) - 1
    energy = (a * n - (b * grown - x3) / (grown + x4) * x4) / x1
    seen = integral(-x2 + sqrt(n)) + integral(-x2 - sqrt(n))
    return energy, [], [x3 - 2 * integral(-x2), x4 - seen]


@problem((1, 1, 1, 1), -0.920425026, lower=(1e-4, 0, 0, 0), upper=(100, 100, 2, 2))
def hs68(x1, x2, x3, x4):
    return control_chart(1e-4, 1, 24, x1, x2, x3, x4)


@problem((1, 1, 1, 1), -956.71288, lower=(1e-4, 0, 0, 0), upper=(100, 100, 2, 2))
def hs69(x1, x2, x3, x4):
    return control_chart(0.1, 1e3, 4, x1, x2, x3, x4)


@problem((2, 4, 0.04, 2), 0.007498464, lower=1e-5, upper=(100, 100, 1, 100))
def hs70(x1, x2, x3, x4):
    b = x3 + (1 - x3) * x4

    def shape(x, c, rate):
        size = rate**x * sqrt(x / 6.2832) / (1 + 1 / (12 * x))
        return size * (c / 7.658) ** (x - 1) * exp(x - rate * c * x / 7.658)

    curve = [x3 * shape(x2, c, b) + (1 - x3) * shape(x1, c, b / x4) for c in data.TIMES_70]
    energy = sum((y - yc) ** 2 for y, yc in zip(data.VALUES_70, curve, strict=True))
    return energy, [b], []


@problem((1, 5, 5, 1), 17.0140173, lower=1, upper=5)
def hs71(x1, x2, x3, x4):
    h = [x1**2 + x2**2 + x3**2 + x4**2 - 40]
    return x1 * x4 * (x1 + x2 + x3) + x3, [x1 * x2 * x3 * x4 - 25], h


@problem((1, 1, 1, 1), 727.67937, lower=0.001, upper=(4e5, 3e5, 2e5, 1e5))
def hs72(x1, x2, x3, x4):
    g = [
        0.0401 - 4 / x1 - 2.25 / x2 - 1 / x3 - 0.25 / x4,
        0.010085 - 0.16 / x1 - 0.36 / x2 - 0.64 / x3 - 0.64 / x4,
    ]
    return 1 + x1 + x2 + x3 + x4, g, []


@problem((1, 1, 1, 1), 29.89437816, lower=0)
def hs73(x1, x2, x3, x4):
    spread = sqrt(0.28 * x1**2 + 0.19 * x2**2 + 20.5 * x3**2 + 0.62 * x4**2)
    g = [
        2.3 * x1 + 5.6 * x2 + 11.1 * x3 + 1.3 * x4 - 5,
        12 * x1 + 11.9 * x2 + 41.8 * x3 + 52.1 * x4 - 21 - 1.645 * spread,
    ]
    return 24.55 * x1 + 26.75 * x2 + 39 * x3 + 40.5 * x4, g, [x1 + x2 + x3 + x4 - 1]


def power_flow(a, x1, x2, x3, x4):
    """Return nos. 74 and 75, which differ in the largest angle."""
    energy = 3 * x1 + 1e-6 * x1**3 + 2 * x2 + 2e-6 / 3 * x2**3
    h = [
        1000 * sin(-x3 - 0.25) + 1000 * sin(-x4 - 0.25) + 894.8 - x1,
        1000 * sin(x3 - 0.25) + 1000 * sin(x3 - x4 - 0.25) + 894.8 - x2,
        1000 * sin(x4 - 0.25) + 1000 * sin(x4 - x3 - 0.25) + 1294.8,
    ]
    return energy, [x4 - x3 + a, x3 - x4 + a], h


@problem((0, 0, 0, 0), 5126.4981, lower=(0, 0, -0.55, -0.55), upper=(1200, 1200, 0.55, 0.55))
def hs74(x1, x2, x3, x4):
    return power_flow(0.55, x1, x2, x3, x4)


@problem((0, 0, 0, 0), 5174.4129, lower=(0, 0, -0.48, -0.48), upper=(1200, 1200, 0.48, 0.48))
def hs75(x1, x2, x3, x4):
    return power_flow(0.48, x1, x2, x3, x4)


@problem((0.5, 0.5, 0.5, 0.5), -4.681818181, lower=0)
def hs76(x1, x2, x3, x4):
    square = x1**2 + x2**2 / 2 + x3**2 + x4**2 / 2 - x1 * x3 + x3 * x4
    g = [5 - x1 - 2 * x2 - x3 - x4, 4 - 3 * x1 - x2 - 2 * x3 + x4, x2 + 4 * x3 - 1.5]
    return square - x1 - 3 * x2 + x3 - x4, g, []


@problem((2, 2, 2, 2, 2), 0.24150513)
def hs77(x1, x2, x3, x4, x5):
    energy = (x1 - 1) ** 2 + (x1 - x2) ** 2 + (x3 - 1) ** 2 + (x4 - 1) ** 4 + (x5 - 1) ** 6
    h = [x1**2 * x4 + sin(x4 - x5) - 2 * sqrt(2), x2 + x3**4 * x4**2 - 8 - sqrt(2)]
    return energy, [], h


def on_sphere(x1, x2, x3, x4, x5):
    square = x1**2 + x2**2 + x3**2 + x4**2 + x5**2
    return [square - 10, x2 * x3 - 5 * x4 * x5, x1**3 + x2**3 + 1]


@problem((-2, 1.5, 2, -1, -1), -2.91970041)
def hs78(*x):
    return prod(x), [], on_sphere(*x)


@problem((2, 2, 2, 2, 2), 0.0787768209)
def hs79(x1, x2, x3, x4, x5):
    energy = (x1 - 1) ** 2 + (x1 - x2) ** 2 + (x2 - x3) ** 2 + (x3 - x4) ** 4 + (x4 - x5) ** 4
    h = [x1 + x2**2 + x3**3 - 2 - 3 * sqrt(2), x2 - x3**2 + x4 + 2 - 2 * sqrt(2), x1 * x5 - 2]
    return energy, [], h


WIDTHS = (2.3, 2.3, 3.2, 3.2, 3.2)


@problem((-2, 2, 2, -1, -1), 0.0539498478, lower=[-w for w in WIDTHS], upper=WIDTHS)
def hs80(*x):
    return exp(prod(x)), [], on_sphere(*x)


@problem((-2, 2, 2, -1, -1), 0.0539498478, lower=[-w for w in WIDTHS], upper=WIDTHS)
def hs81(*x):
    return exp(prod(x)) - (x[0] ** 3 + x[1] ** 3 + 1) ** 2 / 2, [], on_sphere(*x)


@problem((78, 33, 27, 27, 27), -30665.53867, lower=(78, 33, 27, 27, 27), upper=(102, *[45] * 4))
def hs83(x1, x2, x3, x4, x5):
    a = (None, *data.CONSTANTS_83)
    g = [
        *between(0, a[1] + a[2] * x2 * x5 + a[3] * x1 * x4 - a[4] * x3 * x5, 92),
        *between(0, a[5] + a[6] * x2 * x5 + a[7] * x1 * x2 + a[8] * x3**2 - 90, 20),
        *between(0, a[9] + a[10] * x3 * x5 + a[11] * x1 * x3 + a[12] * x3 * x4 - 20, 5),
    ]
    return 5.3578547 * x3**2 + 0.8356891 * x1 * x5 + 37.293239 * x1 - 40792.141, g, []


@problem(
    (2.52, 2, 37.5, 9.25, 6.8),
    -5280335.13306,
    lower=(0, 1.2, 20, 9, 6.5),
    upper=(1000, 2.4, 60, 9.3, 7),
)
def hs84(x1, x2, x3, x4, x5):
    energy, *loads = weighted(data.ROWS_84, (x1, x1 * x2, x1 * x3, x1 * x4, x1 * x5))
    limits = (294000, 294000, 277200)
    g = [g for load, limit in zip(loads, limits, strict=True) for g in between(0, load, limit)]
    return 24345 - energy, g, []


@problem(
    (900, 80, 115, 267, 27),
    -2.215604688,
    lower=(704.4148, 68.6, 0, 193, 25),
    upper=(906.3855, 288.88, 134.75, 287.0966, 84.1988),
)
def hs85(x1, x2, x3, x4, x5):
    y1 = x2 + x3 + 41.6
    y2 = 12.5 / (0.024 * x4 - 4.62) + 12
    y3 = (3.535e-4 * x1**2 + 0.5311 * x1 + 0.08705 * y2 * x1) / (
        0.052 * x1 + 78 + 2.377e-3 * y2 * x1
    )
    y4 = 19 * y3
    c4 = 0.04782 * (x1 - y3) + 0.1956 * (x1 - y3) ** 2 / x2 + 0.6376 * y4 + 1.594 * y3
    y5 = (x1 - y3 - y4) * (0.95 - c4 / (100 * x2))
    y6 = x1 - y5 - y4 - y3
    c8 = (y5 + y4) * 0.995
    y7, y8 = c8 / y1, c8 / 3798
    y9 = 96.82 / (y7 - 0.0663 * y7 / y8 - 0.3153) + 0.321 * y1
    y10 = 1.29 * y5 + 1.258 * y4 + 2.29 * y3 + 1.71 * y6
    y11 = 1.71 * x1 - 0.452 * y4 + 0.58 * y3
    c12 = 0.9995 * y10 + 1998
    y12 = 12.3 / 752.3 * x1 + 1.75 * y2 * 0.995 * x1 / c12
    y13 = c12 - 1.75 * y2
    y14 = 3623 + 64.4 * x2 + 58.4 * x3 + 146312 / (y9 + x5)
    y15 = y13 / (0.9995 * y10 + 60.8 * x2 + 48 * x4 - 0.1121 * y14 - 5095)
    y16 = 148000 - 331000 * y15 + 40 * y13 - 61 * y15 * y13
    y17 = 14130000 - 1328 * y10 - 531 * y11 + (2324 * y10 - 28740000 * y2) / c12
    c15, c16, c17 = y13 / y15 - y13 / 0.52, 1.104 - 0.72 * y15, y9 + x5
    energy = -5.843e-7 * y17 + 1.17e-4 * y14 + 2.358e-5 * y13 + 1.502e-6 * y16 + 0.0321 * y12
    energy += 0.00423 * y5 + 1e-4 * c15 / c16 + 37.48 * y2 / c12 - 0.1365
    g = [1.5 * x2 - x3, y4 - 0.28 / 0.72 * y5, 21 - 3496 * y2 / c12, 62212 / c17 - 110.6 - y1]
    ys = (y1, y2, y3, y4, y5, y6, y7, y8, y9, y10, y11, y12, y13, y14, y15, y16, y17)
    for low, y, high in zip(data.LOW_85, ys, data.HIGH_85, strict=True):
        g += between(low, y, high)
    return energy, g, []


def colville(x):
    """Return the quadratic form of nos. 86 and 117."""
    return sum(xi * row for xi, row in zip(x, weighted(data.C_86, x), strict=True))


@problem((0, 0, 0, 0, 1), -32.34867897, lower=0)
def hs86(*x):
    cubes = sum(d * xi**3 for d, xi in zip(data.D_86, x, strict=True))
    g = [a - b for a, b in zip(weighted(data.A_86, x), data.B_86, strict=True)]
    return weighted([data.E_86], x)[0] + colville(x) + cubes, g, []


@problem(
    (390, 1000, 419.5, 340.5, 198.175, 0.5),
    8927.5977,
    lower=(0, 0, 340, 340, -1000, 0),
    upper=(400, 1000, 420, 420, 10000, 0.5236),
)
def hs87(x1, x2, x3, x4, x5, x6):
    a, b, c, d, e = 131.078, 1.48477, 0.90798, cos(1.47588), sin(1.47588)
    first = Piecewise((30 * x1, x1 < 300), (31 * x1, True))
    second = Piecewise((28 * x2, x2 < 100), (29 * x2, x2 < 200), (30 * x2, True))
    h = [
        300 - x1 - x3 * x4 * cos(b - x6) / a + c * d * x3**2 / a,
        -x2 - x3 * x4 * cos(b + x6) / a + c * d * x4**2 / a,
        -x5 - x3 * x4 * sin(b + x6) / a + c * e * x4**2 / a,
        200 - x3 * x4 * sin(b - x6) / a + c * e * x3**2 / a,
    ]
    return first + second, [], h


@problem((5.54, 4.4, 12.02, 11.82, 0.702, 0.852), 135.075961, lower=0)
def hs93(x1, x2, x3, x4, x5, x6):
    p, q = x1 * x4 * (x1 + x2 + x3), x2 * x3 * (x1 + 1.57 * x2 + x4)
    energy = 0.0204 * p + 0.0187 * q + 0.0607 * p * x5**2 + 0.0437 * q * x6**2
    g = [
        0.001 * x1 * x2 * x3 * x4 * x5 * x6 - 2.07,
        1 - 0.00062 * p * x5**2 - 0.00058 * q * x6**2,
    ]
    return energy, g, []


LIMITS_95 = {"lower": 0, "upper": (0.31, 0.046, 0.068, 0.042, 0.028, 0.0134)}


def resistances(b, x):
    """Return nos. 95 to 98, which differ in the right-hand sides."""
    x1, _, x3, x4, x5, x6 = x
    linear = weighted(data.LINEAR_95, x)
    products = [
        -169 * x1 * x3 - 3580 * x3 * x5 - 3810 * x4 * x5 - 18500 * x4 * x6 - 24300 * x5 * x6,
        -139 * x1 * x3 - 2450 * x4 * x5 - 16600 * x4 * x6 - 17200 * x5 * x6,
        26000 * x4 * x5,
        -14000 * x1 * x6,
    ]
    energy = weighted([(4.3, 31.8, 63.3, 15.8, 68.5, 4.7)], x)[0]
    return energy, [f + p - c for f, p, c in zip(linear, products, b, strict=True)], []


@problem((0,) * 6, 0.015619514, **LIMITS_95)
def hs95(*x):
    return resistances((4.97, -1.88, -29.08, -78.02), x)


@problem((0,) * 6, 0.015619514, **LIMITS_95)
def hs96(*x):
    return resistances((4.97, -1.88, -69.08, -118.02), x)


@problem((0,) * 6, 3.1358091, **LIMITS_95)
def hs97(*x):
    return resistances((32.97, 25.12, -29.08, -78.02), x)


@problem((0,) * 6, 3.1358091, **LIMITS_95)
def hs98(*x):
    return resistances((32.97, 25.12, -124.08, -173.02), x)


@problem((0.5,) * 7, -831079891.5, lower=0, upper=1.58)
def hs99(*x):
    a, t = data.THRUSTS_99, data.TIMES_99
    dt = [after - before for before, after in pairwise(t)]
    lift = [ai * sin(xi) - 32 for ai, xi in zip(a, x, strict=True)]
    speeds = [0, *accumulate(f * d for f, d in zip(lift, dt, strict=True))]
    height = sum(f * d**2 / 2 + v * d for f, d, v in zip(lift, dt, speeds[:-1], strict=True))
    distance = sum(ai * d * cos(xi) for ai, d, xi in zip(a, dt, x, strict=True))
    return -(distance**2), [], [height - 1e5, speeds[-1] - 1e3]


@problem((1, 2, 0, 4, 0, 1, 1), 680.6300573)
def hs100(x1, x2, x3, x4, x5, x6, x7):
    energy = (x1 - 10) ** 2 + 5 * (x2 - 12) ** 2 + x3**4 + 3 * (x4 - 11) ** 2 + 10 * x5**6
    energy += 7 * x6**2 + x7**4 - 4 * x6 * x7 - 10 * x6 - 8 * x7
    g = [
        127 - 2 * x1**2 - 3 * x2**4 - x3 - 4 * x4**2 - 5 * x5,
        282 - 7 * x1 - 3 * x2 - 10 * x3**2 - x4 + x5,
        196 - 23 * x1 - x2**2 - 6 * x6**2 + 8 * x7,
        -4 * x1**2 - x2**2 + 3 * x1 * x2 - 2 * x3**2 - 5 * x6 + 11 * x7,
    ]
    return energy, g, []


LIMITS_101 = {"lower": (*[0.1] * 6, 0.01), "upper": 10}


def geometric(a, x):
    """Return nos. 101 to 103, which differ in one exponent."""
    (c, *powers, _), *others = data.COST_101
    cost = monomials([(c, *powers, a), *others], x)
    return cost, [*(1 - monomials(g, x) for g in data.LIMITS_101), *between(100, cost, 3000)], []


@problem((6,) * 7, 1809.76476, **LIMITS_101)
def hs101(*x):
    return geometric(-0.25, x)


@problem((6,) * 7, 911.880571, **LIMITS_101)
def hs102(*x):
    return geometric(0.125, x)


@problem((6,) * 7, 543.667958, **LIMITS_101)
def hs103(*x):
    return geometric(0.5, x)


@problem((6, 3, 0.4, 0.2, 6, 6, 1, 0.5), 3.9511634396, lower=0.1, upper=10)
def hs104(x1, x2, x3, x4, x5, x6, x7, x8):
    energy = 0.4 * (x1 / x7) ** 0.67 + 0.4 * (x2 / x8) ** 0.67 + 10 - x1 - x2
    g = [
        1 - 0.0588 * x5 * x7 - 0.1 * x1,
        1 - 0.0588 * x6 * x8 - 0.1 * x1 - 0.1 * x2,
        1 - 4 * x3 / x5 - 2 / (x3**0.71 * x5) - 0.0588 * x7 / x3**1.3,
        1 - 4 * x4 / x6 - 2 / (x4**0.71 * x6) - 0.0588 * x8 / x4**1.3,
        *between(1, energy, 4.2),
    ]
    return energy, g, []


@problem(
    (0.1, 0.2, 100, 125, 175, 11.2, 13.2, 15.8),
    1136.307304,
    lower=(0.001, 0.001, 100, 130, 170, 5, 5, 5),
    upper=(0.499, 0.499, 180, 210, 240, 25, 25, 25),
)
def hs105(x1, x2, x3, x4, x5, x6, x7, x8):
    parts = ((x1, x3, x6), (x2, x4, x7), (1 - x1 - x2, x5, x8))

    def density(y):
        return sum(w / s * exp(-((y - m) ** 2) / (2 * s**2)) for w, m, s in parts)

    root = sqrt(2 * sympy.pi)
    energy = -sum(count * log(density(y) / root) for y, count in data.WEIGHTS_105.items())
    return energy, [1 - x1 - x2], []


@problem(
    (5000, 5000, 5000, 200, 350, 150, 225, 425),
    7049.24802,
    lower=(100, 1000, 1000, 10, 10, 10, 10, 10),
    upper=(10000, 10000, 10000, 1000, 1000, 1000, 1000, 1000),
)
def hs106(x1, x2, x3, x4, x5, x6, x7, x8):
    g = [
        1 - 0.0025 * (x4 + x6),
        1 - 0.0025 * (x5 + x7 - x4),
        1 - 0.01 * (x8 - x5),
        x1 * x6 - 833.33252 * x4 - 100 * x1 + 83333.333,
        x2 * x7 - 1250 * x5 - x2 * x4 + 1250 * x4,
        x3 * x8 - 1250000 - x3 * x5 + 2500 * x5,
    ]
    return x1 + x2 + x3, g, []


@problem(
    (0.8, 0.8, 0.2, 0.2, 1.0454, 1.0454, 1.0454, 0, 0),
    5055.011803,
    lower=(0, 0, free, free, *[0.90909] * 3, free, free),
    upper=(free, free, free, free, *[1.0909] * 3, free, free),
)
def hs107(x1, x2, x3, x4, x5, x6, x7, x8, x9):
    ratio = 48.4 / 50.176
    c, d = ratio * sin(0.25), ratio * cos(0.25)
    y1, y2, y3, y4, y5, y6 = sin(x8), cos(x8), sin(x9), cos(x9), sin(x8 - x9), cos(x8 - x9)
    h = [
        0.4 - x1 + 2 * c * x5**2 - x5 * x6 * (d * y1 + c * y2) - x5 * x7 * (d * y3 + c * y4),
        0.4 - x2 + 2 * c * x6**2 + x5 * x6 * (d * y1 - c * y2) + x6 * x7 * (d * y5 - c * y6),
        0.8 + 2 * c * x7**2 + x5 * x7 * (d * y3 - c * y4) - x6 * x7 * (d * y5 + c * y6),
        0.2 - x3 + 2 * d * x5**2 + x5 * x6 * (c * y1 - d * y2) + x5 * x7 * (c * y3 - d * y4),
        0.2 - x4 + 2 * d * x6**2 - x5 * x6 * (c * y1 + d * y2) - x6 * x7 * (c * y5 + d * y6),
        -0.337 + 2 * d * x7**2 - x5 * x7 * (c * y3 + d * y4) + x6 * x7 * (c * y5 - d * y6),
    ]
    return 3000 * x1 + 1000 * x1**3 + 2000 * x2 + 666.667 * x2**3, [], h


@problem((1,) * 9, -(3**0.5) / 2, lower=(*[free] * 8, 0))
def hs108(x1, x2, x3, x4, x5, x6, x7, x8, x9):
    g = [
        1 - x3**2 - x4**2,
        1 - x9**2,
        1 - x5**2 - x6**2,
        1 - x1**2 - (x2 - x9) ** 2,
        1 - (x1 - x5) ** 2 - (x2 - x6) ** 2,
        1 - (x1 - x7) ** 2 - (x2 - x8) ** 2,
        1 - (x3 - x5) ** 2 - (x4 - x6) ** 2,
        1 - (x3 - x7) ** 2 - (x4 - x8) ** 2,
        1 - x7**2 - (x8 - x9) ** 2,
        x1 * x4 - x2 * x3,
        x3 * x9,
        -x5 * x9,
        x5 * x8 - x6 * x7,
    ]
    return -(x1 * x4 - x2 * x3 + x3 * x9 - x5 * x9 + x5 * x8 - x6 * x7) / 2, g, []


@problem(
    (0,) * 9,
    5362.06928,
    lower=(0, 0, -0.55, -0.55, 196, 196, 196, -400, -400),
    upper=(free, free, 0.55, 0.55, 252, 252, 252, 800, 800),
)
def hs109(x1, x2, x3, x4, x5, x6, x7, x8, x9):
    a, b, c = 50.176, sin(0.25), cos(0.25)
    loss = 2 * c - 0.7533e-3 * a
    p, q, r = x5 * x6, x5 * x7, x6 * x7
    h = [
        p * sin(-x3 - 0.25) + q * sin(-x4 - 0.25) + 2 * b * x5**2 - a * x1 + 400 * a,
        p * sin(x3 - 0.25) + r * sin(x3 - x4 - 0.25) + 2 * b * x6**2 - a * x2 + 400 * a,
        q * sin(x4 - 0.25) + r * sin(x4 - x3 - 0.25) + 2 * b * x7**2 + 881.779 * a,
        a * x8 + p * cos(-x3 - 0.25) + q * cos(-x4 - 0.25) - 200 * a - loss * x5**2,
        a * x9 + p * cos(x3 - 0.25) + r * cos(x3 - x4 - 0.25) - 200 * a - loss * x6**2,
        q * cos(x4 - 0.25) + r * cos(x4 - x3 - 0.25) - 22.938 * a - loss * x7**2,
    ]
    g = [x4 - x3 + 0.55, x3 - x4 + 0.55, 2.25e6 - x1**2 - x8**2, 2.25e6 - x2**2 - x9**2]
    return 3 * x1 + 1e-6 * x1**3 + 2 * x2 + 0.522074e-6 * x2**3, g, h


@problem((9,) * 10, -45.77846971, lower=2.001, upper=9.999)
def hs110(*x):
    return sum(log(xi - 2) ** 2 + log(10 - xi) ** 2 for xi in x) - prod(x) ** 0.2, [], []


def balances(y1, y2, y3, y4, y5, y6, y7, y8, y9, y10):
    """Return the element balances of nos. 111 and 112."""
    return [
        y1 + 2 * y2 + 2 * y3 + y6 + y10 - 2,
        y4 + 2 * y5 + y6 + y7 - 1,
        y3 + y7 + y8 + 2 * y9 + y10 - 1,
    ]


@problem((-2.3,) * 10, -47.76109026, lower=-100, upper=100)
def hs111(*x):
    total = log(sum(map(exp, x)))
    energy = sum(exp(xi) * (c + xi - total) for c, xi in zip(data.C_112, x, strict=True))
    return energy, [], balances(*map(exp, x))


@problem((0.1,) * 10, -47.76109026, lower=1e-6)
def hs112(*x):
    total = sum(x)
    return (
        sum(xi * (c + log(xi / total)) for c, xi in zip(data.C_112, x, strict=True)),
        [],
        balances(*x),
    )


@problem((2, 3, 5, 5, 1, 2, 7, 3, 6, 10), 24.3062091)
def hs113(x1, x2, x3, x4, x5, x6, x7, x8, x9, x10):
    energy = x1**2 + x2**2 + x1 * x2 - 14 * x1 - 16 * x2 + (x3 - 10) ** 2 + 4 * (x4 - 5) ** 2
    energy += (x5 - 3) ** 2 + 2 * (x6 - 1) ** 2 + 5 * x7**2 + 7 * (x8 - 11) ** 2
    energy += 2 * (x9 - 10) ** 2 + (x10 - 7) ** 2 + 45
    g = [
        105 - 4 * x1 - 5 * x2 + 3 * x7 - 9 * x8,
        -10 * x1 + 8 * x2 + 17 * x7 - 2 * x8,
        8 * x1 - 2 * x2 - 5 * x9 + 2 * x10 + 12,
        120 - 3 * (x1 - 2) ** 2 - 4 * (x2 - 3) ** 2 - 2 * x3**2 + 7 * x4,
        40 - 5 * x1**2 - 8 * x2 - (x3 - 6) ** 2 + 2 * x4,
        30 - (x1 - 8) ** 2 / 2 - 2 * (x2 - 4) ** 2 - 3 * x5**2 + x6,
        -(x1**2) - 2 * (x2 - 2) ** 2 + 2 * x1 * x2 - 14 * x5 + 6 * x6,
        3 * x1 - 6 * x2 - 12 * (x9 - 8) ** 2 + 7 * x10,
    ]
    return energy, g, []


@problem(
    (1745, 12000, 110, 3048, 1974, 89.2, 92.8, 8, 3.6, 145),
    -1768.80696,
    lower=(*[1e-5] * 5, 85, 90, 3, 1.2, 145),
    upper=(2000, 16000, 120, 5000, 2000, 93, 95, 12, 4, 162),
)
def hs114(x1, x2, x3, x4, x5, x6, x7, x8, x9, x10):
    a, b = 0.99, 0.9
    g1 = 35.82 - 0.222 * x10 - b * x9
    g2 = -133 + 3 * x7 - a * x10
    g5 = 1.12 * x1 + 0.13167 * x1 * x8 - 0.00667 * x1 * x8**2 - a * x4
    g6 = 57.425 + 1.098 * x8 - 0.038 * x8**2 + 0.325 * x6 - a * x7
    slack = 1 / a - a
    g = [g1, g2, x9 * (1 / b - b) - g1, slack * x10 - g2]
    g += [g5, g6, slack * x4 - g5, slack * x7 - g6]
    h = [1.22 * x4 - x1 - x5, 98000 * x3 / (x4 * x9 + 1000 * x3) - x6, (x2 + x5) / x1 - x8]
    return 5.04 * x1 + 0.035 * x2 + 10 * x3 + 3.36 * x5 - 0.063 * x4 * x7, g, h


@problem(
    (0.5, 0.8, 0.9, 0.1, 0.14, 0.5, 489, 80, 650, 450, 150, 150, 150),
    97.588409,
    lower=(0.1, 0.1, 0.1, 1e-4, 0.1, 0.1, 0.1, 0.1, 500, 0.1, 1, 1e-4, 1e-4),
    upper=(1, 1, 1, 0.1, 0.9, 0.9, 1000, 1000, 1000, 500, 150, 150, 150),
)
def hs116(x1, x2, x3, x4, x5, x6, x7, x8, x9, x10, x11, x12, x13):
    a, b, c, d, e, f = 0.002, 1.262626, 1.231059, 0.03475, 0.975, 0.00975
    total = x11 + x12 + x13
    g = [
        x3 - x2,
        x2 - x1,
        1 - a * x7 + a * x8,
        *between(50, total, 250),
        x13 - b * x10 + c * x3 * x10,
        x5 - d * x2 - e * x2 * x5 + f * x2**2,
        x6 - d * x3 - e * x3 * x6 + f * x3**2,
        x4 - d * x1 - e * x1 * x4 + f * x1**2,
        x12 - b * x9 + c * x2 * x9,
        x11 - b * x8 + c * x1 * x8,
        x5 * x7 - x1 * x8 - x4 * x7 + x4 * x8,
        1 - a * (x2 * x9 + x5 * x8 - x1 * x8 - x6 * x9) - x5 - x6,
        x2 * x9 - x3 * x10 - x6 * x9 - 500 * x2 + 500 * x6 + x2 * x10,
        x2 - 0.9 - a * (x2 * x10 - x3 * x10),
    ]
    return total, g, []


@problem((*[0.001] * 6, 60, *[0.001] * 8), 32.34867897, lower=0)
def hs117(*x):
    duals, y = x[:10], x[10:]
    cubes = sum(d * yi**3 for d, yi in zip(data.D_86, y, strict=True))
    pull = weighted(zip(*data.A_86, strict=True), duals)
    forms = weighted(data.C_86, y)
    slopes = [3 * d * yi**2 + e for d, e, yi in zip(data.D_86, data.E_86, y, strict=True)]
    g = [2 * f + s - p for f, s, p in zip(forms, slopes, pull, strict=True)]
    return colville(y) + 2 * cubes - weighted([data.B_86], duals)[0], g, []


@problem(
    (20, 55, 15, *(20, 60, 20) * 4),
    664.82045,
    lower=(8, 43, 3, *[0] * 12),
    upper=(21, 57, 16, *(90, 120, 60) * 4),
)
def hs118(*x):
    g = []
    for i in range(3, 15):
        g += between(0, x[i] - x[i - 3] + 7, 14 if i % 3 == 1 else 13)
    for i, demand in zip(range(0, 15, 3), (60, 50, 70, 85, 100), strict=True):
        g.append(sum(x[i : i + 3]) - demand)
    costs = [(2.3, 1e-4), (1.7, 1e-4), (2.2, 1.5e-4)] * 5
    return sum(c * xi + q * xi**2 for (c, q), xi in zip(costs, x, strict=True)), g, []


@problem((10,) * 16, 244.899698, lower=0, upper=5)
def hs119(*x):
    sizes = [xi**2 + xi + 1 for xi in x]
    energy = sum(sizes[i - 1] * sizes[j - 1] for i, row in data.PAIRS_119.items() for j in row)
    h = [f - c for f, c in zip(weighted(data.B_119, x), data.C_119, strict=True)]
    return energy, [], h
