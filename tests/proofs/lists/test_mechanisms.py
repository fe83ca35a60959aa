"""All equilibria of small mechanisms, each counted twice."""

import math
from fractions import Fraction as Q

import numpy as np
import pytest
import sympy as sp

from benchmarks.trials.planar import Energy, PlanarProblem, disc, line
from polycorner import Manifold, Polyhedron, skeleton, stratum_at
from polycorner.models import Pinball
from polycorner.polyhedra import LocalType
from polycorner.proofs import stationary_points

# ---------------------------------------------------------------------------- a ladder in a corner


def ladder(lean):
    """A rod of length 2 over a floor, at a wall; the board leans to the wall by ``x lean``."""
    M = Manifold(("x", "y", "t"), (math.inf, math.inf, math.tau))
    x, y, t = M.symbols
    across, up = sp.cos(t), sp.sin(t)
    walls = {"a wall": x + across, "b wall": x - across, "a floor": y + up, "b floor": y - up}
    return Polyhedron(M, walls), y + lean * x


def of_ladder(lean):
    """Return the equilibria by hand, with ``(x, y)`` and the index, for one of the two headings.

    The energy of a rod with one end at the wall and the other one on the floor is
    ``sin(s) + lean cos(s)``, greatest at ``tan(s) = 1 / lean``; so is that of a rod that stands in
    the corner, on an end.  At rest are, besides these two, the rods along the floor and the wall.
    """
    s = math.atan2(1, lean)
    return [(1, 0, 0), (0, 1, 0), (math.cos(s), math.sin(s), 1), (math.cos(s), math.sin(s), 1)]


@pytest.mark.parametrize("lean", [sp.Rational(1, 3), sp.Integer(1), sp.Integer(2)])
def test_a_ladder_in_a_corner_has_four_equilibria(lean):
    found = stationary_points(*ladder(lean), box=[(-0.25, 3), (-0.25, 3), None])
    assert found.complete
    mine = sorted((*p.point[:2].round(9), p.index) for p in found)
    np.testing.assert_allclose(mine, sorted(2 * of_ladder(float(lean))), atol=1e-8)
    headings = sorted(p.point[2] % math.pi for p in found if p.index)
    assert headings[0] == pytest.approx(math.atan2(1, float(lean)))
    assert headings[-1] == pytest.approx(math.pi - math.atan2(1, float(lean)))


def test_a_ladder_that_does_not_lean_may_lie_anywhere_on_the_floor():
    found = stationary_points(*ladder(0), box=[(-0.25, 3), (-0.25, 3), None], max_boxes=3000)
    assert not found.complete
    lower, upper = found.undecided[:, 0], found.undecided[:, 1]
    for x in (1.0, 1.7, 2.9):
        assert ((lower <= [x, 0, 0]) & (upper >= [x, 0, 0])).all(axis=1).any()


# ---------------------------------------------------------------------------------- beads on wires


@pytest.mark.parametrize("speed", [sp.Rational(1, 2), sp.Integer(2), sp.Integer(5)])
def test_a_bead_on_a_turning_hoop(speed):
    """With ``E = y - speed x^2 / 2`` on the unit circle: top and bottom; and ``y = -1/speed``."""
    M = Manifold.euclidean("x y")
    x, y = M.symbols
    hoop = Polyhedron(M, [], {"hoop": 1 - x**2 - y**2})
    found = stationary_points(hoop, y - speed * x**2 / 2, box=[(-2, 2), (-2, 2)])
    a = float(speed)
    aside = [(s * math.sqrt(1 - 1 / a**2), -1 / a, 0) for s in (1, -1)] if a > 1 else []
    expected = [(0, 1, 1), (0, -1, 1 if aside else 0), *aside]
    assert found.complete
    np.testing.assert_allclose(
        sorted((*p.point.round(9), p.index) for p in found), sorted(expected), atol=1e-8
    )


@pytest.mark.parametrize("lean", [0, 1])
def test_a_bead_on_a_wavy_wire_with_a_stop(lean):
    """On ``y = x^4 - 3 x^2 + x / 2`` and ``x <= 1/2``: a cubic, and the stop."""
    M = Manifold.euclidean("x y")
    x, y = M.symbols
    wire = x**4 - 3 * x**2 + x / 2
    d = Polyhedron(M, {"stop": sp.Rational(1, 2) - x}, {"wire": y - wire})
    found = stationary_points(d, y + lean * x, box=[(-3, 3), (-4, 40)])
    height = sp.Poly(wire + lean * x, x)
    slopes = [float(r) for r in height.diff().nroots() if r < 0.5]
    ends = [0.5] if height.diff().eval(0.5) < 0 else []
    assert found.complete
    np.testing.assert_allclose(sorted(p.point[0] for p in found), sorted(slopes + ends), atol=1e-8)
    assert [p.point[0] for p in found if p.active] == pytest.approx(ends)
    indices = [p.index for p in found if not p.active]
    assert indices.count(0) == sum(bool(height.diff().diff().eval(r) > 0) for r in slopes)


# ---------------------------------------------------------------------------------------- pinball


def exactly(wall):
    """Return the function of a wall as that of a line or circle with the same signs."""
    (x, y), (u, v) = (tuple(map(Q, pair)) for pair in (wall.point, wall.normal))
    if not wall.bend:
        return line(u, v, -u * x - v * y)
    radius = Q(1 / wall.bend).limit_denominator(10**6)
    # the circle's highest or lowest point is given, where the normal points to the free side
    return disc(x, y - v * radius, abs(radius), inside=radius < 0)


def of_board(board, lean):
    """Return the equilibria: where the height is critical along a wall, and corners."""
    branches = board.polyhedron.signs_to_pieces([0] * len(board.walls))
    identity = ((Q(1), Q(0)), (Q(0), Q(1)))
    terms = (((Q(0), lean), (Q(1),)), ((Q(1),), (Q(0), Q(1))))
    height = Energy(terms, identity, (Q(0), Q(0)), ())
    curves = tuple(map(exactly, board.walls))
    return PlanarProblem(height, curves, tuple(map(frozenset, branches))).places()


SMALL = Pinball(
    pins=[(1.2, 6.9, 0.3), (2.4, 4.6, 0.4), (3.0, 4.4, 0.4), (0.5, 3.9, 0.6)],
    wedges=[((0.8, 2.9), (2.2, 1.4), (0.8, 1.6)), ((3.2, 2.4), (1.8, 1.5), (3.0, 1.0))],
    cups=[(6.0, 4.7, 0.6, 0.75)],
)


@pytest.mark.parametrize("board", [SMALL, Pinball()], ids=["small", "large"])
@pytest.mark.parametrize("lean", [Q(1, 50), Q(-1, 3)])
def test_all_places_of_rest_on_a_pinball_table(board, lean):
    x, y = board.manifold.symbols
    height = y + sp.Rational(lean.numerator, lean.denominator) * x
    found = stationary_points(board.polyhedron, height, box=[(-0.1, 6.1), (-0.1, 8.1)])
    expected = of_board(board, lean)
    assert found.complete
    mine = sorted((*p.point.round(6), p.index) for p in found)
    theirs = sorted((*np.round(np.array(p.point, dtype=float), 6), p.index) for p in expected)
    np.testing.assert_allclose(mine, theirs, atol=2e-6)
    assert len(found) > 8


def test_places_of_rest_and_tips_add_up_to_the_euler_characteristic():
    """At the tip of an obstacle nothing rests, but what is lower is connected through it."""
    board = Pinball()
    d, (x, y) = board.polyhedron, board.manifold.symbols
    found = stationary_points(d, y + x / 50, box=[(-0.1, 6.1), (-0.1, 8.1)])
    # every obstacle that is free all around is met from its highest corner or from its top
    atlas = skeleton(d, [(a, b + radius) for a, b, radius in board.pins])
    tips = 0
    for corner in atlas.corners:
        if stratum_at(d, corner.point).local_type is LocalType.UNION:
            rows = d.gradients(corner.point)[[d.names.index(name) for name in corner.active]]
            # both sides of the obstacle go down from its corner
            tips += bool((np.linalg.solve(rows.T, [1 / 50, 1]) > 0).all())
    assert sum((-1) ** p.index for p in found) - tips == atlas.euler_characteristic == 1 - 8


def test_a_table_that_does_not_lean_has_a_floor_of_them():
    board = Pinball(pins=[(3, 4, 1)], wedges=(), cups=())
    found = stationary_points(
        board.polyhedron, board.energy, box=[(-0.1, 6.1), (-0.1, 8.1)], max_boxes=3000
    )
    assert not found.complete
    (top,) = found
    np.testing.assert_allclose(top.point, [3, 5], atol=1e-9)
    assert top.index == 1
