"""Faces with tips: chains of lemons, horns, cusps between curves that touch, counted by hand."""

import math

import numpy as np
import pytest
import sympy as sp
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from skeleton_shapes import check_incidence, counts

from polycorner import Manifold, Polyhedron, skeleton
from polycorner.skeletons import Completeness

PLANE, SPACE = Manifold.euclidean("x y"), Manifold.euclidean("x y z")
x, y, z = SPACE.symbols
few = settings(max_examples=1, phases=[Phase.generate])
turns = st.floats(0, math.tau)


def found(D, starts, **options):
    """Return the whole skeleton."""
    atlas = skeleton(D, starts, **options)
    assert atlas.complete is Completeness.EXHAUSTED
    assert atlas.notes == ()
    check_incidence(atlas)
    return atlas


def turned(a, b):
    """Return three perpendicular coordinates."""
    first = sp.Matrix([[math.cos(a), -math.sin(a), 0], [math.sin(a), math.cos(a), 0], [0, 0, 1]])
    other = sp.Matrix([[1, 0, 0], [0, math.cos(b), -math.sin(b)], [0, math.sin(b), math.cos(b)]])
    return first * other * sp.Matrix([x, y, z])


class TestRevolution:
    """Where a profile ``r = |p(z)|`` meets the axis, its surface of revolution has a tip."""

    @pytest.mark.parametrize(
        "zeros",
        [(0.0,), (-0.6, 0.5), (-0.7, -0.1, 0.6)],
        ids=["one", "two", "three"],
    )
    @given(turns, turns, st.integers(0, 99))
    @few
    def test_every_piece_of_a_chain_is_one_face(self, zeros, a, b, seed):
        """Spheres, one more than tips, each of which meets the next in a tip."""
        u, v, w = turned(a, b)
        profile = math.prod(w - zero for zero in zeros)
        D = Polyhedron(SPACE, {"chain": profile**2 - u**2 - v**2, "low": 1 + w, "high": 1 - w})
        heights = [(p + q) / 2 for p, q in zip((-1, *zeros), (*zeros, 1), strict=True)]
        axis = np.array(sp.Matrix([w]).jacobian([x, y, z]), dtype=float)[0]
        atlas = found(D, [h * axis for h in heights], rng=seed)
        k = len(zeros)
        assert counts(atlas) == (k, 2, k + 3)
        assert atlas.components[3] == k + 1
        assert atlas.euler_characteristic == 2 * (k + 1) - k
        around = sorted(sorted(f.boundary) for f in atlas.faces if f.active == ("chain",))
        assert [len(curves) for curves in around] == [2] * (k + 1)
        assert sum(curve == () for curves in around for curve in curves) == 2 * k

    def test_a_lemon_between_planes_that_touch_it(self):
        D = Polyhedron(SPACE, {"lemon": (1 - z**2) ** 2 - x**2 - y**2, "low": 1 + z, "high": 1 - z})
        atlas = found(D, [[0, 0, 0.2]])
        assert (counts(atlas), atlas.euler_characteristic) == ((2, 0, 1), 2)
        assert atlas.faces[0].boundary == ((), ())

    def test_a_torus_pinched_to_a_point(self):
        """A sphere of which two points are one."""
        rho = sp.sqrt(x**2 + y**2)
        D = Polyhedron(SPACE, {"ring": (1 - x / rho) / 8 - (rho - 1) ** 2 - z**2})
        atlas = found(D, [[-1.0, 0.1, 0.1]])
        assert (counts(atlas), atlas.euler_characteristic) == ((1, 0, 1), 1)
        assert atlas.faces[0].boundary == ((), ())


def radial(triples):
    """Return the region outside discs, given by radius and centre, within some half planes."""
    return {f"disc{k}": (x - a) ** 2 + (y - b) ** 2 - r**2 for k, (r, a, b) in enumerate(triples)}


def touching(r, s, t):
    """Return three discs that touch each other, two of them with centres on the first axis."""
    a, b, c = s + t, r + t, r + s
    p = (b**2 + c**2 - a**2) / (2 * c)
    return [(r, 0.0, 0.0), (s, c, 0.0), (t, p, math.sqrt(b**2 - p**2))]


class TestCusps:
    @pytest.mark.parametrize("cut", [False, True], ids=["open", "cut"])
    @given(st.tuples(*[st.floats(0.5, 2)] * 3), turns, st.integers(0, 99))
    @few
    def test_the_gap_between_three_discs(self, cut, radii, angle, seed):
        """With lines through the centres the corners have gradients of full rank."""
        discs = touching(*radii)
        turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
        centres = [turn @ disc[1:] for disc in discs]
        parts = radial([(disc[0], *c) for disc, c in zip(discs, centres, strict=True)])
        if cut:
            for k in range(3):
                p, q = centres[k], centres[(k + 1) % 3]
                n = np.array([p[1] - q[1], q[0] - p[0]])
                parts[f"line{k}"] = n[0] * (x - p[0]) + n[1] * (y - p[1])
        # The incircle of the centres goes through the three points where discs touch.
        sides = [sum(radii) - r for r in radii]
        start = sum(side * c for side, c in zip(sides, centres, strict=True)) / sum(sides)
        atlas = found(Polyhedron(PLANE, parts), [start], rng=seed)
        inner = [face for face in atlas.faces if face.euler_characteristic == 1]
        assert len(atlas.corners) == 3
        assert [len(face.boundary[0]) for face in inner] == [3]
        if cut:
            assert (counts(atlas), atlas.euler_characteristic) == ((3, 3, 1), 1)
        else:
            assert counts(atlas)[:2] == (3, 6)
            assert atlas.euler_characteristic is None  # the other face has no end

    @pytest.mark.parametrize("power", [2, 3])
    @given(turns, st.floats(0.5, 2), st.integers(0, 99))
    @few
    def test_a_curve_that_touches_a_line_at_a_third(self, power, angle, bend, seed):
        a, b = math.cos(angle), math.sin(angle)
        u, v = a * x + b * y, a * y - b * x
        D = Polyhedron(PLANE, {"curve": bend * u**power - v, "floor": v, "wall": 1 - u, "end": u})
        start = 0.9 * np.array([a, b]) + 0.1 * bend * np.array([-b, a])
        atlas = skeleton(D, [start], rng=seed)
        assert atlas.complete is Completeness.EXHAUSTED
        assert (counts(atlas), atlas.euler_characteristic) == ((3, 3, 1), 1)

    def test_discs_that_touch_a_square_at_its_sides_and_each_other(self):
        D = Polyhedron(PLANE, {
            "one": (x + 1) ** 2 + y**2 - 1, "two": (x - 1) ** 2 + y**2 - 1,
            "left": x + 1, "right": 1 - x, "low": y + 1, "high": 1 - y,
        })  # fmt: skip
        atlas = found(D, [[0, 0.5]])
        assert (counts(atlas), atlas.euler_characteristic) == ((5, 6, 2), 1)

    def test_what_is_missing_beside_an_edge_is_said(self):
        """In four dimensions links are not sampled: faces at cusps of full rank are missing."""
        R4 = Manifold.euclidean("x y s t")
        u, v, s, t = R4.symbols
        sides = {"curve": u**2 - v, "floor": v, "wall": 1 - u, "end": u}
        square = {"s0": s, "s1": 1 - s, "t0": t, "t1": 1 - t}
        atlas = skeleton(Polyhedron(R4, {**sides, **square}), [[0.9, 0.1, 0.5, 0.5]])
        assert counts(atlas)[:2] == (12, 24)
        assert atlas.complete is Completeness.GAPS
        assert len(atlas.notes) == 4  # a triangle times a square has 19 faces
