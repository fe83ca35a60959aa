"""Hock and Schittkowski, nos. 1 to 50: energy, inequalities, equations."""

from math import pi

from sympy import cos, exp, log, sin, sqrt

from benchmarks.trials.statements import Collection

STATEMENTS = Collection()
problem = STATEMENTS.add
free = None


def rosenbrock(x1, x2):
    return 100 * (x2 - x1**2) ** 2 + (1 - x1) ** 2


@problem((-2, 1), 0, lower=(free, -1.5))
def hs1(x1, x2):
    return rosenbrock(x1, x2), [], []


@problem((-2, 1), 0.0504261879, lower=(free, 1.5))
def hs2(x1, x2):
    return rosenbrock(x1, x2), [], []


@problem((10, 1), 0, lower=(free, 0))
def hs3(x1, x2):
    return x2 + 1e-5 * (x2 - x1) ** 2, [], []


@problem((1.125, 0.125), 8 / 3, lower=(1, 0))
def hs4(x1, x2):
    return (x1 + 1) ** 3 / 3 + x2, [], []


@problem((0, 0), -(3**0.5) / 2 - pi / 3, lower=(-1.5, -3), upper=(4, 3))
def hs5(x1, x2):
    return sin(x1 + x2) + (x1 - x2) ** 2 - 1.5 * x1 + 2.5 * x2 + 1, [], []


@problem((-1.2, 1), 0)
def hs6(x1, x2):
    return (1 - x1) ** 2, [], [10 * (x2 - x1**2)]


@problem((2, 2), -(3**0.5))
def hs7(x1, x2):
    return log(1 + x1**2) - x2, [], [(1 + x1**2) ** 2 + x2**2 - 4]


@problem((2, 1), -1)
def hs8(x1, x2):
    return -1, [], [x1**2 + x2**2 - 25, x1 * x2 - 9]


@problem((0, 0), -0.5)
def hs9(x1, x2):
    return sin(pi * x1 / 12) * cos(pi * x2 / 16), [], [4 * x1 - 3 * x2]


@problem((-10, 10), -1)
def hs10(x1, x2):
    return x1 - x2, [-3 * x1**2 + 2 * x1 * x2 - x2**2 + 1], []


@problem((4.9, 0.1), -8.498464223)
def hs11(x1, x2):
    return (x1 - 5) ** 2 + x2**2 - 25, [x2 - x1**2], []


@problem((0, 0), -30)
def hs12(x1, x2):
    return x1**2 / 2 + x2**2 - x1 * x2 - 7 * x1 - 7 * x2, [25 - 4 * x1**2 - x2**2], []


@problem((-2, -2), 1, lower=0)
def hs13(x1, x2):
    return (x1 - 2) ** 2 + x2**2, [(1 - x1) ** 3 - x2], []


@problem((2, 2), 9 - 2.875 * 7**0.5)
def hs14(x1, x2):
    return (x1 - 2) ** 2 + (x2 - 1) ** 2, [1 - x1**2 / 4 - x2**2], [x1 - 2 * x2 + 1]


@problem((-2, 1), 306.5, upper=(0.5, free))
def hs15(x1, x2):
    return rosenbrock(x1, x2), [x1 * x2 - 1, x1 + x2**2], []


@problem((-2, 1), 0.25, lower=(-0.5, free), upper=(0.5, 1))
def hs16(x1, x2):
    return rosenbrock(x1, x2), [x1 + x2**2, x1**2 + x2], []


@problem((-2, 1), 1, lower=(-0.5, free), upper=(0.5, 1))
def hs17(x1, x2):
    return rosenbrock(x1, x2), [x2**2 - x1, x1**2 - x2], []


@problem((2, 2), 5, lower=(2, 0), upper=50)
def hs18(x1, x2):
    return 0.01 * x1**2 + x2**2, [x1 * x2 - 25, x1**2 + x2**2 - 25], []


@problem((20.1, 5.84), -6961.81381, lower=(13, 0), upper=100)
def hs19(x1, x2):
    outer = (x1 - 5) ** 2 + (x2 - 5) ** 2 - 100
    inner = 82.81 - (x2 - 5) ** 2 - (x1 - 6) ** 2
    return (x1 - 10) ** 3 + (x2 - 20) ** 3, [outer, inner], []


@problem((-2, 1), 81.5 - 25 * 3**0.5, lower=(-0.5, free), upper=(0.5, free))
def hs20(x1, x2):
    return rosenbrock(x1, x2), [x1 + x2**2, x1**2 + x2, x1**2 + x2**2 - 1], []


@problem((-1, -1), -99.96, lower=(2, -50), upper=50)
def hs21(x1, x2):
    return 0.01 * x1**2 + x2**2 - 100, [10 * x1 - x2 - 10], []


@problem((2, 2), 1)
def hs22(x1, x2):
    return (x1 - 2) ** 2 + (x2 - 1) ** 2, [2 - x1 - x2, x2 - x1**2], []


@problem((3, 1), 2, lower=-50, upper=50)
def hs23(x1, x2):
    g = [x1 + x2 - 1, x1**2 + x2**2 - 1, 9 * x1**2 + x2**2 - 9, x1**2 - x2, x2**2 - x1]
    return x1**2 + x2**2, g, []


@problem((1, 0.5), -1, lower=0)
def hs24(x1, x2):
    energy = ((x1 - 3) ** 2 - 9) * x2**3 / (27 * sqrt(3))
    return energy, [x1 / sqrt(3) - x2, x1 + sqrt(3) * x2, 6 - x1 - sqrt(3) * x2], []


@problem((100, 12.5, 3), 0, lower=(0.1, 0, 0), upper=(100, 25.6, 5))
def hs25(x1, x2, x3):
    shares = [0.01 * i for i in range(1, 100)]
    curve = [(-50 * log(share)) ** (2 / 3) + 25 for share in shares]
    misfits = [exp(-((u - x2) ** x3) / x1) - t for u, t in zip(curve, shares, strict=True)]
    return sum(misfit**2 for misfit in misfits), [], []


@problem((-2.6, 2, 2), 0)
def hs26(x1, x2, x3):
    return (x1 - x2) ** 2 + (x2 - x3) ** 4, [], [(1 + x2**2) * x1 + x3**4 - 3]


@problem((2, 2, 2), 0.04)
def hs27(x1, x2, x3):
    return 0.01 * (x1 - 1) ** 2 + (x2 - x1**2) ** 2, [], [x1 + x3**2 + 1]


@problem((-4, 1, 1), 0)
def hs28(x1, x2, x3):
    return (x1 + x2) ** 2 + (x2 + x3) ** 2, [], [x1 + 2 * x2 + 3 * x3 - 1]


@problem((1, 1, 1), -16 * 2**0.5)
def hs29(x1, x2, x3):
    return -x1 * x2 * x3, [48 - x1**2 - 2 * x2**2 - 4 * x3**2], []


@problem((1, 1, 1), 1, lower=(1, -10, -10), upper=10)
def hs30(x1, x2, x3):
    return x1**2 + x2**2 + x3**2, [x1**2 + x2**2 - 1], []


@problem((1, 1, 1), 6, lower=(-10, 1, -10), upper=(10, 10, 1))
def hs31(x1, x2, x3):
    return 9 * x1**2 + x2**2 + 9 * x3**2, [x1 * x2 - 1], []


@problem((0.1, 0.7, 0.2), 1, lower=0)
def hs32(x1, x2, x3):
    energy = (x1 + 3 * x2 + x3) ** 2 + 4 * (x1 - x2) ** 2
    return energy, [6 * x2 + 4 * x3 - x1**3 - 3], [1 - x1 - x2 - x3]


@problem((0, 0, 3), 2**0.5 - 6, lower=0, upper=(free, free, 5))
def hs33(x1, x2, x3):
    g = [x3**2 - x2**2 - x1**2, x1**2 + x2**2 + x3**2 - 4]
    return (x1 - 1) * (x1 - 2) * (x1 - 3) + x3, g, []


@problem((0, 1.05, 2.9), -0.834032445, lower=0, upper=(100, 100, 10))
def hs34(x1, x2, x3):
    return -x1, [x2 - exp(x1), x3 - exp(x2)], []


@problem((0.5, 0.5, 0.5), 1 / 9, lower=0)
def hs35(x1, x2, x3):
    linear = 9 - 8 * x1 - 6 * x2 - 4 * x3
    square = 2 * x1**2 + 2 * x2**2 + x3**2 + 2 * x1 * x2 + 2 * x1 * x3
    return linear + square, [3 - x1 - x2 - 2 * x3], []


@problem((10, 10, 10), -3300, lower=0, upper=(20, 11, 42))
def hs36(x1, x2, x3):
    return -x1 * x2 * x3, [72 - x1 - 2 * x2 - 2 * x3], []


@problem((10, 10, 10), -3456, lower=0, upper=42)
def hs37(x1, x2, x3):
    girth = x1 + 2 * x2 + 2 * x3
    return -x1 * x2 * x3, [72 - girth, girth], []


@problem((-3, -1, -3, -1), 0, lower=-10, upper=10)
def hs38(x1, x2, x3, x4):
    pairs = rosenbrock(x1, x2) + 90 * (x4 - x3**2) ** 2 + (1 - x3) ** 2
    return pairs + 10.1 * ((x2 - 1) ** 2 + (x4 - 1) ** 2) + 19.8 * (x2 - 1) * (x4 - 1), [], []


@problem((2, 2, 2, 2), -1)
def hs39(x1, x2, x3, x4):
    return -x1, [], [x2 - x1**3 - x3**2, x1**2 - x2 - x4**2]


@problem((0.8, 0.8, 0.8, 0.8), -0.25)
def hs40(x1, x2, x3, x4):
    return -x1 * x2 * x3 * x4, [], [x1**3 + x2**2 - 1, x1**2 * x4 - x3, x4**2 - x2]


@problem((2, 2, 2, 2), 52 / 27, lower=0, upper=(1, 1, 1, 2))
def hs41(x1, x2, x3, x4):
    return 2 - x1 * x2 * x3, [], [x1 + 2 * x2 + 2 * x3 - x4]


@problem((1, 1, 1, 1), 28 - 10 * 2**0.5)
def hs42(x1, x2, x3, x4):
    energy = (x1 - 1) ** 2 + (x2 - 2) ** 2 + (x3 - 3) ** 2 + (x4 - 4) ** 2
    return energy, [], [x1 - 2, x3**2 + x4**2 - 2]


@problem((0, 0, 0, 0), -44)
def hs43(x1, x2, x3, x4):
    energy = x1**2 + x2**2 + 2 * x3**2 + x4**2 - 5 * x1 - 5 * x2 - 21 * x3 + 7 * x4
    g = [
        8 - x1**2 - x2**2 - x3**2 - x4**2 - x1 + x2 - x3 + x4,
        10 - x1**2 - 2 * x2**2 - x3**2 - 2 * x4**2 + x1 + x4,
        5 - 2 * x1**2 - x2**2 - x3**2 - 2 * x1 + x2 + x4,
    ]
    return energy, g, []


@problem((0, 0, 0, 0), -15, lower=0)
def hs44(x1, x2, x3, x4):
    g = [
        8 - x1 - 2 * x2,
        12 - 4 * x1 - x2,
        12 - 3 * x1 - 4 * x2,
        8 - 2 * x3 - x4,
        8 - x3 - 2 * x4,
        5 - x3 - x4,
    ]
    return x1 - x2 - x3 - x1 * x3 + x1 * x4 + x2 * x3 - x2 * x4, g, []


@problem((2, 2, 2, 2, 2), 1, lower=0, upper=(1, 2, 3, 4, 5))
def hs45(x1, x2, x3, x4, x5):
    return 2 - x1 * x2 * x3 * x4 * x5 / 120, [], []


def steep(x1, x2, x3, x4, x5):
    return (x1 - x2) ** 2 + (x3 - 1) ** 2 + (x4 - 1) ** 4 + (x5 - 1) ** 6


@problem((2**0.5 / 2, 1.75, 0.5, 2, 2), 0)
def hs46(x1, x2, x3, x4, x5):
    h = [x1**2 * x4 + sin(x4 - x5) - 1, x2 + x3**4 * x4**2 - 2]
    return steep(x1, x2, x3, x4, x5), [], h


@problem((2, 2**0.5, -1, 2 - 2**0.5, 0.5), -0.02671418)
def hs47(x1, x2, x3, x4, x5):
    energy = (x1 - x2) ** 2 + (x2 - x3) ** 3 + (x3 - x4) ** 4 + (x4 - x5) ** 4
    return energy, [], [x1 + x2**2 + x3**3 - 3, x2 - x3**2 + x4 - 1, x1 * x5 - 1]


@problem((3, 5, -3, 2, -2), 0)
def hs48(x1, x2, x3, x4, x5):
    h = [x1 + x2 + x3 + x4 + x5 - 5, x3 - 2 * (x4 + x5) + 3]
    return (x1 - 1) ** 2 + (x2 - x3) ** 2 + (x4 - x5) ** 2, [], h


@problem((10, 7, 2, -3, 0.8), 0)
def hs49(x1, x2, x3, x4, x5):
    return steep(x1, x2, x3, x4, x5), [], [x1 + x2 + x3 + 4 * x4 - 7, x3 + 5 * x5 - 6]


@problem((35, -31, 11, 5, -5), 0)
def hs50(x1, x2, x3, x4, x5):
    energy = (x1 - x2) ** 2 + (x2 - x3) ** 2 + (x3 - x4) ** 4 + (x4 - x5) ** 2
    return (
        energy,
        [],
        [x1 + 2 * x2 + 3 * x3 - 6, x2 + 2 * x3 + 3 * x4 - 6, x3 + 2 * x4 + 3 * x5 - 6],
    )
