"""Pressures of a few hard bodies, as weights of contacts over free volumes, in closed form.

Where a wall recedes, ``d log Z / dL`` is the weight of all contacts with it, of ``f = L - ...``,
over ``Z``, since ``dZ / dL = int delta(f)``; and where bodies grow, that of contacts between them.
"""

import math

import numpy as np
import pytest

from polycorner import AnyOf, Manifold, Polyhedron, skeleton
from polycorner.measures import SampleOptions, measure, sample, volume
from polycorner.measures.estimates import ratio_of_means


def agree(estimate, exact, part=0.1):
    assert estimate.error < part * abs(exact)
    return abs(estimate.value - exact) < 4 * estimate.error


def slope(f, at, h=1e-5):
    return (f(at + h) - f(at - h)) / (2 * h)


def on(found, *contacts):
    """Where one of some contacts is the only one."""
    return np.isin(found.positions, [found.strata.index((name,)) for name in contacts])


def test_pressure_of_hard_rods_on_a_line():
    """``d log Z / dL = N / (L - N s)``: what contacts with the wall weigh over what is free."""
    count, length, size = 3, 2.0, 0.3
    line = Manifold.euclidean([f"x{k}" for k in range(count)])
    places = [size / 2, *line.symbols, length - size / 2]
    gaps = {"left": places[1] - places[0], "right": places[-1] - places[-2]}
    gaps |= {f"{k}": places[k + 1] - places[k] - size for k in range(1, count)}
    found = sample(
        Polyhedron(line, gaps), [[0.4, 1.0, 1.6]] * 4, 20_000, contacts=(0, 1), rng=9,
        options=SampleOptions(step=0.25, sideways=0.1, reach=0.3),
    )  # fmt: skip
    wall = found.strata.index(("right",))
    pressure = ratio_of_means(found.positions == wall, found.contacts == 0)
    assert agree(pressure, count / (length - count * size))


def discs_in_a_box(width, height, size):
    """``log Z`` of two discs, by the distribution of their difference, closer than the box is."""
    a, b = width - size, height - size
    overlap = math.pi * size**2 * a * b - 4 / 3 * size**3 * (a + b) + size**4 / 2
    return math.log(a**2 * b**2 - overlap)


def test_two_hard_discs_in_a_box():
    """On the wall, and as the discs grow: all of the weight of their contact, and of the walls."""
    width, height, size = 1.4, 1.1, 0.4
    plane = Manifold.euclidean("x1 y1 x2 y2")
    x1, y1, x2, y2 = plane.symbols
    r = size / 2
    D = Polyhedron(
        plane,
        {"pair": (x2 - x1) ** 2 + (y2 - y1) ** 2 - size**2}
        | {f"low {s}": s - r for s in plane.symbols}
        | {f"right {s}": width - r - s for s in (x1, x2)}
        | {f"top {s}": height - r - s for s in (y1, y2)},
    )
    found = sample(
        D, [[0.3, 0.3, 1.0, 0.8]] * 4, 30_000, contacts=(0, 1), rng=2,
        options=SampleOptions(step=0.35, sideways=0.1, reach=0.3),
    )  # fmt: skip
    inside = found.contacts == 0
    pressure = ratio_of_means(on(found, "right x1", "right x2"), inside)
    assert agree(pressure, slope(lambda w: discs_in_a_box(w, height, size), width))
    # The pair's gap shrinks by 2 size with the size, every wall's by 1 / 2.
    walls = [name for name in D.names if name != "pair"]
    grown = 2 * size * on(found, "pair") + on(found, *walls) / 2
    share = ratio_of_means(grown, inside)
    assert agree(share, -slope(lambda s: discs_in_a_box(width, height, s), size))


def cell(length, size):
    """The area of a square cell outside a disc about its centre that may reach beyond its sides."""
    half = length / 2
    beyond = max(
        0.0,
        size**2 * math.acos(min(1.0, half / size)) - half * math.sqrt(max(0.0, size**2 - half**2)),
    )
    return length**2 - math.pi * size**2 + 4 * beyond


@pytest.mark.parametrize("size", [0.4, 0.6])
def test_two_hard_discs_on_a_torus(size):
    """``P V / T = 2 + size^2 Z_pair / Z``: the virial, with the contact's edges by quadrature.

    The place of one disc about the other is in a cell, by whose sides the large one is cut.
    """
    plane = Manifold.euclidean("x y")
    x, y = plane.symbols
    sides = {"left": x + 1 / 2, "right": 1 / 2 - x, "low": y + 1 / 2, "high": 1 / 2 - y}
    D = Polyhedron(plane, {"pair": x**2 + y**2 - size**2} | sides)
    starts = [[0.48, 0.48], [0.48, -0.48], [-0.48, 0.48], [-0.48, -0.48]]
    found = measure(skeleton(D, starts))
    edges = found.skeleton.edges
    pair = sum(z for e, z in zip(edges, found.edges, strict=True) if e.active == ("pair",))
    virial = 2 + size**2 * pair / cell(1.0, size)
    # Z(V) = V cell(sqrt(V))
    exact = slope(lambda v: math.log(v * cell(math.sqrt(v), size)), 1.0)
    assert virial == pytest.approx(exact, rel=1e-8)
    (free,) = volume(D, [(-0.5, 0.5)] * 2, points=2**14, rng=4)
    assert agree(free.volume, cell(1.0, size), 0.01)


def squares(length, side):
    """Two hard squares in a box: they overlap where both differences are less than the side."""
    free = length - side
    return free**4 - (free**2 - (free - side) ** 2) ** 2


def test_two_hard_squares_in_a_box():
    """The volume, and the pressure as that of the stratum at a wall, of a union of four cases."""
    length, side = 1.0, 0.3
    free = length - side

    def apart(x1, y1, x2, y2):
        return AnyOf(x2 - x1 - side, x1 - x2 - side, y2 - y1 - side, y1 - y2 - side)

    S = Manifold.euclidean("x1 y1 x2 y2")
    (whole,) = volume(Polyhedron(S, apart(*S.symbols)), [(0, free)] * 4, points=2**13, rng=6)
    assert agree(whole.volume, squares(length, side))
    W = Manifold.euclidean("y1 x2 y2")
    wall = Polyhedron(W, apart(free, *W.symbols))
    (at_wall,) = volume(wall, [(0, free)] * 3, points=2**13, rng=7)
    # Two walls recede, each met by two squares.
    exact = slope(lambda a: squares(a, side), length)
    assert abs(4 * at_wall.volume.value - exact) < 4 * 4 * at_wall.volume.error < 0.1 * exact
