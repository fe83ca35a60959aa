"""Walks: they stay on their curve and end at the first event."""

import math

import numpy as np
import pytest
import sympy as sp
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from oracles_skeletons import arc_length, turned
from scipy.interpolate import CubicHermiteSpline
from skeleton_shapes import ball, half_space, space
from strategies import directions

from polycorner import AllOf, Manifold, Polyhedron, SmoothFunction, Symmetry
from polycorner.formulas.families import Family
from polycorner.polyhedra.faces import HeldPoint, projected
from polycorner.polyhedra.quotients import Quotient
from polycorner.skeletons import End
from polycorner.skeletons.walks import dips, follow, sign_change
from polycorner.tolerances import DEFAULT

PLANE, SPACE = Manifold.euclidean("x y"), Manifold.euclidean("x y z")
x, y, z = SPACE.symbols
TAU = math.tau


def quotient(D, *, symmetry=None, extent=100.0):
    equations = range(len(D.functions), len(D.functions) + len(D.equations))
    return Quotient(D, symmetry or Symmetry(), DEFAULT, extent, tuple(equations))


ELLIPSE = Family.of(
    {"ellipse": 1 - (x / sp.Symbol("a")) ** 2 - (y / sp.Symbol("b")) ** 2}, ("x", "y"), ("a", "b")
)


GATE = Family.of({"gate": 1 - 2 * sp.exp(-((x - sp.Symbol("c")) ** 2))}, ("x", "y"), ("c",))


def ellipse(a, b):
    function = SmoothFunction.member(ELLIPSE, "ellipse", PLANE, parameters=(a, b))
    return Polyhedron(PLANE, function)


def frame(D, q, held, **options):
    """Return a frame at a point, holding functions by name."""
    rows = [D.names.index(name) for name in held]
    return HeldPoint(quotient(D, **options), np.asarray(q, dtype=float), rows)


class TestStraight:
    @given(directions(3), st.floats(0.1, 20), st.floats(0.2, 1.0))
    def test_without_held_functions_a_walk_is_a_straight_line(self, v, distance, slope):
        """To a plane that it meets at an angle, wherever that falls between two steps."""
        normal = v * slope + math.sqrt(1 - slope**2) * _across(v)
        D = Polyhedron(space(3), half_space(normal, distance * slope, "wall"))
        walk = follow(frame(D, np.zeros(3), []), v)
        assert walk.end is End.CORNER
        np.testing.assert_allclose(walk.last.q, distance * v, atol=1e-8)
        assert walk.length == pytest.approx(distance, abs=1e-8)
        assert np.linalg.norm(walk.points @ _across(v), ord=np.inf) < 1e-9
        np.testing.assert_allclose(walk.tangent, v, atol=1e-9)
        assert (np.diff(walk.points @ v) >= 0).all()

    @given(st.lists(st.floats(0.1, 15), min_size=2, max_size=6, unique=True), st.randoms())
    def test_the_first_of_several_walls_is_met(self, walls, random):
        random.shuffle(walls)
        planes = [half_space([1, 0], w, f"wall{k}") for k, w in enumerate(walls)]
        walk = follow(frame(Polyhedron(space(2), planes), [0, 0], []), np.array([1.0, 0]))
        assert walk.last.q[0] == pytest.approx(min(walls), abs=1e-9)

    @given(st.floats(0.2, 10), st.floats(1e-3, 0.5), st.floats(-0.99, 0.99))
    def test_a_small_obstacle_on_the_way_is_not_jumped_over(self, distance, radius, off):
        """A disc that closes and opens again between two steps."""
        D = Polyhedron(space(2), ball((distance, off * radius), radius, "disc", inside=False))
        assume(np.hypot(distance, off * radius) > 1.1 * radius)
        walk = follow(frame(D, [0, 0], []), np.array([1.0, 0]))
        assert walk.end is End.CORNER
        exact = distance - radius * math.sqrt(1 - off**2)
        assert walk.last.q[0] == pytest.approx(exact, abs=1e-7)

    @given(st.floats(0.2, 10), st.floats(0.05, 2))
    @settings(max_examples=4 * settings.default.max_examples)
    def test_an_obstacle_that_is_only_touched_is_met(self, distance, radius):
        D = Polyhedron(space(2), ball((distance, radius), radius, "disc", inside=False))
        walk = follow(frame(D, [0, 0], []), np.array([1.0, 0]))
        assert walk.end is End.CORNER
        np.testing.assert_allclose(walk.last.q, [distance, 0], atol=1e-6)

    @given(st.floats(0.2, 5), st.floats(0.5, 2))
    def test_two_functions_that_touch_in_one_point_are_met(self, distance, steep):
        """Along the axis of ``|y| <= steep (x - distance)^2``."""
        bend = steep * (x - distance) ** 2
        D = Polyhedron(PLANE, {"top": bend - y, "bottom": bend + y})
        walk = follow(frame(D, [0, 0], []), np.array([1.0, 0]))
        assert walk.end is End.CORNER
        np.testing.assert_allclose(walk.last.q, [distance, 0], atol=1e-4)

    @given(st.floats(0.2, 10), st.floats(0.05, 2), st.floats(1e-6, 0.1))
    def test_an_obstacle_that_is_passed_by_is_not_met(self, distance, radius, gap):
        D = Polyhedron(space(2), ball((distance, radius + gap), radius, "disc", inside=False))
        assert follow(frame(D, [0, 0], [], extent=15), np.array([1.0, 0])).end is End.INFINITY

    @given(st.floats(2, 40))
    @settings(max_examples=2 * settings.default.max_examples)
    def test_an_obstacle_that_cannot_be_felt_from_afar_is_met(self, distance):
        """A ridge 1.7 wide whose slope is rounded to nothing a little away from it."""
        gate = SmoothFunction.member(GATE, "gate", PLANE, parameters=(distance,))
        walk = follow(frame(Polyhedron(PLANE, gate), [0, 0], [], extent=60), np.array([1.0, 0]))
        assert walk.end is End.CORNER
        assert walk.last.q[0] == pytest.approx(distance - math.sqrt(math.log(2)), abs=1e-7)


def _across(v):
    """Return a unit vector at right angles to ``v``."""
    other = np.eye(len(v))[np.argmin(abs(v))]
    other = other - (other @ v) * v
    return other / np.linalg.norm(other)


class TestAlongCurves:
    @given(st.floats(0.2, 5), st.floats(0, TAU), st.floats(0.3, math.pi - 0.3))
    def test_a_walk_on_a_circle_ends_at_a_line(self, radius, start, angle):
        """The angle walked is exact, though the polyline is inscribed."""
        normal = [-math.sin(start + angle), math.cos(start + angle)]
        D = Polyhedron(space(2), AllOf(ball((0, 0), radius, "rim"), half_space(normal, 0, "line")))
        q = radius * np.array([math.cos(start), math.sin(start)])
        walk = follow(frame(D, q, ["rim"]), np.array([-math.sin(start), math.cos(start)]))
        assert walk.end is End.CORNER
        assert turned(walk.points, (0, 0)) == pytest.approx(angle, abs=1e-8)
        np.testing.assert_allclose(np.linalg.norm(walk.points, axis=1), radius, rtol=1e-12)
        assert radius * angle * math.sin(0.125) / 0.125 <= walk.length <= radius * angle

    def test_steps_turn_by_at_most_a_quarter(self):
        D = Polyhedron(PLANE, {"bowl": y - 5 * x**2, "lid": 3 - y})
        walk = follow(frame(D, [-0.5, 1.25], ["bowl"]), np.array([1.0, 0]))
        slopes = np.arctan(10 * walk.points[:, 0])
        assert abs(np.diff(slopes)).max() <= 0.25 + 1e-9
        exact = arc_length(lambda t: (t, 5 * t**2), -0.5, math.sqrt(0.6))
        assert exact * math.sin(0.125) / 0.125 <= walk.length <= exact
        np.testing.assert_allclose(walk.last.q, [math.sqrt(0.6), 3], atol=1e-9)

    @given(st.floats(0.1, 5), st.floats(0.1, 1), st.floats(0, TAU))
    def test_a_closed_curve_is_walked_once_around(self, a, part, start):
        D = ellipse(a, a * part)
        q = np.array([a * math.cos(start), a * part * math.sin(start)])
        here = frame(D, q, ["ellipse"])
        walk = follow(
            here, _across(here.gradients[0] / np.linalg.norm(here.gradients[0])), home=True
        )
        assert walk.end is End.CLOSED
        np.testing.assert_allclose(walk.last.q, q, atol=1e-6)
        assert turned(walk.points, (0, 0)) == pytest.approx(TAU, abs=1e-6)
        exact = arc_length(lambda t: (a * sp.cos(t), a * part * sp.sin(t)), 0, TAU)
        assert exact * math.sin(0.125) / 0.125 <= walk.length <= exact * (1 + 1e-9)

    def test_a_helix_goes_on_and_on(self):
        """Around a cylinder the circle closes, the helix does not."""
        M = Manifold(("phi", "h"), periods=(TAU, math.inf))
        phi, h = M.symbols
        D = Polyhedron(M, {"ring": h, "lid": 1 - h})
        assert follow(frame(D, [0, 0], ["ring"]), np.array([1.0, 0]), home=True).end is End.CLOSED
        D = Polyhedron(M, {"helix": sp.sin(phi - h)})
        walk = follow(frame(D, [0, 0], ["helix"], extent=30), np.array([1.0, 1]), home=True)
        assert walk.end is End.INFINITY
        np.testing.assert_allclose(walk.points[:, 0], walk.points[:, 1], atol=1e-12)

    @given(st.floats(0.02, 0.3))
    def test_a_walk_stays_on_its_own_one_of_two_parallel_curves(self, width):
        r = 1 + width
        ring = (x**2 + y**2 - 1) * (sp.Float(r) ** 2 - x**2 - y**2)
        D = Polyhedron(PLANE, {"ring": ring})
        walk = follow(frame(D, [1, 0], ["ring"], extent=20), np.array([0, 1.0]), home=True)
        np.testing.assert_allclose(np.linalg.norm(walk.points, axis=1), 1, atol=1e-9)
        assert walk.end is End.CLOSED

    def test_a_walk_that_runs_out_of_the_chart_says_so(self):
        D = Polyhedron(PLANE, {"root": sp.sqrt(x) - y})
        walk = follow(frame(D, [1, 1], ["root"]), np.array([-1.0, -0.5]))
        assert walk.end is End.CHART
        assert np.linalg.norm(walk.last.q) < 1e-2

    def test_the_tip_of_a_cusp_ends_a_walk(self):
        D = Polyhedron(PLANE, {"cusp": x**3 - y**2})
        walk = follow(frame(D, [1, 1], ["cusp"]), np.array([-1.0, -1.5]))
        assert walk.end is End.CORNER
        np.testing.assert_allclose(walk.last.q, [0, 0], atol=1e-7)

    def test_dependent_gradients_end_a_walk(self):
        """Along ``x^3 = 0``, whose gradient vanishes everywhere."""
        D = Polyhedron(PLANE, {"flat": x**3})
        walk = follow(frame(D, [1e-4, 1], ["flat"]), np.array([0.0, 1]))
        assert walk.end is End.SINGULAR

    def test_the_extent_ends_a_walk(self):
        D = Polyhedron(PLANE, {"floor": y})
        walk = follow(frame(D, [0, 0], ["floor"]), np.array([1.0, 0]), extent=7.0)
        assert walk.end is End.INFINITY
        assert 7 < walk.length < 9


class TestSettling:
    @given(st.floats(0.7, 1.3), st.floats(0, math.tau))
    def test_the_nearest_point_of_a_circle(self, radius, angle):
        q = radius * np.array([math.cos(angle), math.sin(angle)])
        D = Polyhedron(space(2), ball((0, 0), 1, "rim"))
        found = projected(quotient(D), q, [0], 1.0)
        np.testing.assert_allclose(found.q, q / np.linalg.norm(q), atol=1e-12)

    def test_what_is_out_of_reach_is_not_found(self):
        D = Polyhedron(space(2), ball((0, 0), 1, "rim"))
        assert projected(quotient(D), np.array([3.0, 0]), [0], 0.5) is None
        assert projected(quotient(D), np.array([0.0, 0]), [0], 5.0) is None

    def test_no_correction_moves_along_the_orbit(self):
        """Two points of a line at a distance: both are moved by the same amount."""
        D = Polyhedron(PLANE, {"gap": (y - x) ** 2 - 1})
        shift = Symmetry(tangents=lambda _: np.array([[1.0, 1.0]]), invariants=np.diff)
        found = projected(quotient(D, symmetry=shift), np.array([0.2, 1.6]), [0], 1.0)
        np.testing.assert_allclose(found.q, [0.4, 1.4], atol=1e-12)

    def test_in_scale_units_the_correction_is_the_shortest(self):
        M = Manifold(("x", "y"), scales=(1.0, 10.0))
        D = Polyhedron(M, {"line": 1 - x - y})
        found = projected(quotient(D), np.zeros(2), [0], 5.0)
        np.testing.assert_allclose(found.q, [1 / 101, 100 / 101], atol=1e-12)


# ------------------------------------------------------------------------------------- sign changes

heights, slopes = st.floats(1e-3, 10), st.floats(0, 100)


@given(heights, heights, slopes, slopes, st.floats(1e-3, 1))
def test_a_dip_is_where_the_cubic_is_lowest(f0, f1, fall, rise, h):
    assume(fall > 1e-3)
    lowest = CubicHermiteSpline([0, h], [f0, f1], [-fall, rise])(np.linspace(0, h, 4001)).min()
    bound = 0.25 * min(f0, f1)
    assume(abs(lowest - bound) > 1e-4 * max(f0, f1, h * fall, h * rise))
    assert dips(f0, f1, -fall, rise, h) == (lowest < bound)


@given(
    st.floats(-1e3, 1e3),
    st.floats(1e-3, 1e3),
    st.floats(1e-3, 1 - 1e-3),
    st.floats(0, 1e3),
    st.sampled_from([0.0, 1e-320, 1e-200, 1e-17, 1.0, 1e150]),
)
@example(1.0, 1e-3, 1e-3, 1e3, 1e-200)  # the product of the slopes vanishes
def test_every_cubic_has_an_answer_without_a_warning(f0, fall, turn, bend, size):
    """The slope is ``(t - turn) (bend t + fall / turn)``; sizes from 0 to overflow follow."""
    p, q, r = bend, fall / turn - bend * turn, -fall
    f1 = f0 + r + q / 2 + p / 3
    lowest = f0 + turn * (r + turn * (q / 2 + turn * p / 3))
    assume(abs(lowest - 0.25 * min(f0, f1)) > 1e-6 * max(abs(f0), fall, bend, 1.0))
    exact = np.array([f0, f1, -fall, p + q + r])
    scaled = np.array([size * value for value in exact.tolist()])
    with np.errstate(all="raise"):
        assert dips(*exact, 1.0) == (lowest < 0.25 * min(f0, f1))
        assert dips(*scaled, 1.0) in {True, False}


@pytest.mark.parametrize(
    ("ends", "least"), [((-3e-16, -2e-16), 1.0), ((2e-16, 3e-16), 0.0), ((-1e-16, -1e-16), 1.0)]
)
def test_where_no_sign_changes_nothing_is_looked_for_outside(ends, least):
    tried = []

    def noise(s):
        tried.append(s)
        return ends[0] + s * (ends[1] - ends[0]), s

    assert sign_change(noise) == (least, least)
    assert all(0 <= s <= 1 for s in tried)
