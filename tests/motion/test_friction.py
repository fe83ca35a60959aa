"""Friction sets: support, projection and gauge against the definitions of the sets."""

import itertools
import math

import mpmath
import numpy as np
import oracles
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st
from strategies import directions, reals, vectors

from polycorner.motion.friction import (
    CUT_DISC,
    DISC,
    ELLIPSE,
    INTERVAL,
    POLYGON,
    ConvexPolygon,
    ConvexSet,
    CutDisc,
    Disc,
    Ellipse,
    Interval,
    from_support,
)

# ------------------------------------------------------------------------------------ generators

coefficients = st.floats(0.01, 2.0)
slight = coefficients | st.just(0.0)


@st.composite
def polygons(draw):
    """Return polygons around 0, with three to nine corners on an ellipse that holds it."""
    angles = sorted(draw(st.sets(st.integers(0, 35), min_size=0, max_size=6)) | {0, 13, 24})
    wide, high = draw(coefficients), draw(coefficients)
    shift = np.array([wide, high]) * draw(st.floats(-0.2, 0.2))
    turned = np.array(angles) * math.tau / 36
    corners = np.stack([wide * np.cos(turned), high * np.sin(turned)], axis=-1) + shift
    return ConvexPolygon(corners)


intervals = st.builds(Interval, slight) | st.builds(
    lambda a, b: Interval(lower=-a, upper=b), slight, slight
)
flat_sets = (
    st.builds(Disc, slight)
    | st.builds(Ellipse, slight, slight)
    | st.builds(CutDisc, slight, slight)
    | polygons()
)
convex_sets = intervals | flat_sets


def with_vectors(count, sets=convex_sets, reach=4.0):
    """Return a set and vectors of its dimension."""
    return sets.flatmap(
        lambda c: st.tuples(st.just(c), *[vectors(c.dimension, reach) for _ in range(count)])
    )


# --------------------------------------------------------------- definitions, written once more


def excess(c, p):
    """By how much a point fails the inequalities that define a set; not positive inside."""
    match c:
        case Interval():
            return max(p[0] - c.upper, c.lower - p[0])
        case Disc():
            return math.hypot(*p) - c.mu
        case CutDisc():
            return max(math.hypot(*p) - c.mu, abs(p[0]) - c.width)
        case Ellipse():
            if min(c.mu_1, c.mu_2) == 0:
                return max(abs(p[0]) - c.mu_1, abs(p[1]) - c.mu_2)
            return (math.hypot(p[0] / c.mu_1, p[1] / c.mu_2) - 1) * min(c.mu_1, c.mu_2)
        case _:
            sides = itertools.pairwise([*c.vertices, c.vertices[0]])
            return max(
                ((b[1] - a[1]) * (p[0] - a[0]) - (b[0] - a[0]) * (p[1] - a[1])) / math.dist(a, b)
                for a, b in sides
            )


def boundary(c, count=360):
    """Points of a set, its boundary densely and its corners exactly."""
    t = math.tau / count * np.arange(count)
    circle = np.stack([np.cos(t), np.sin(t)], axis=-1)
    match c:
        case Interval():
            return np.array([[c.lower], [0.0], [c.upper]])
        case Disc():
            return c.mu * circle
        case Ellipse():
            return circle * [c.mu_1, c.mu_2]
        case CutDisc():
            w = min(c.width, c.mu)
            top = math.sqrt(c.mu**2 - w**2)
            arcs = c.mu * circle[abs(c.mu * circle[:, 0]) <= w]
            edges = [(x, y) for x in (-w, w) for y in np.linspace(-top, top, count // 4)]
            return np.array([*arcs, *edges])
        case _:
            corners = np.array(c.vertices)
            part = np.linspace(0, 1, 20)[:, None, None]
            return ((1 - part) * corners + part * np.roll(corners, -1, axis=0)).reshape(-1, 2)


def size(c):
    return float(abs(boundary(c)).max())


def scaled(c, a):
    """The set ``a C``."""
    match c:
        case Interval():
            return Interval(lower=a * c.lower, upper=a * c.upper)
        case Disc():
            return Disc(a * c.mu)
        case Ellipse():
            return Ellipse(a * c.mu_1, a * c.mu_2)
        case CutDisc():
            return CutDisc(a * c.mu, a * c.width)
        case _:
            return ConvexPolygon(a * np.array(c.vertices))


def has_interior(c):
    """Whether 0 is an inner point."""
    return excess(c, np.zeros(c.dimension)) < -1e-3


# ------------------------------------------------------------------------------------ projection


@given(with_vectors(1))
def test_the_projection_is_in_the_set_and_keeps_the_points_of_the_set(case):
    c, p = case
    x = c.project(p)
    assert excess(c, x) <= 1e-14
    if excess(c, p) < -1e-14:
        assert (x == p).all()
    np.testing.assert_allclose(c.project(x), x, atol=1e-14)


@given(with_vectors(1))
def test_from_the_projection_the_set_is_behind(case):
    """The variational inequality ``(p - x).(y - x) <= 0`` for all ``y`` in ``C``."""
    c, p = case
    x = c.project(p)
    assert ((boundary(c) - x) @ (p - x)).max() <= 1e-14 * (1 + abs(p).max()) ** 2


@given(with_vectors(1))
def test_no_point_of_the_boundary_is_nearer_than_the_projection(case):
    c, p = case
    nearest = np.linalg.norm(boundary(c) - p, axis=-1).min()
    assert np.linalg.norm(c.project(p) - p) <= nearest + 1e-14


@given(with_vectors(1, reach=1e3))
def test_what_the_projection_takes_away_is_the_proximal_point_of_the_support(case):
    """Moreau: ``p = x + u``, ``x`` in ``C``, and ``h(u) = u.x`` of the ``u`` left over."""
    c, p = case
    x = c.project(p)
    u = p - x
    assert c.support(u) == pytest.approx(u @ x, abs=1e-13 * (1 + abs(p).max()))


@given(with_vectors(2))
def test_the_proximal_point_of_the_support_is_best(case):
    """The left-over ``u`` minimises ``h(u) + |u - p|^2 / 2``, here against any other."""
    c, p, other = case
    u = p - c.project(p)

    def cost(v):
        return c.support(v) + (v - p) @ (v - p) / 2

    assert cost(u) <= cost(other) + 1e-13 * (1 + p @ p)
    assert cost(u) <= cost(u + 1e-3 * other) + 1e-13 * (1 + p @ p)


@given(with_vectors(2))
def test_projections_do_not_move_apart(case):
    c, p, q = case
    moved = c.project(p) - c.project(q)
    assert moved @ moved <= moved @ (p - q) + 1e-14 * (1 + abs(p - q).max())  # firmly


@given(with_vectors(1), st.floats(1e-3, 1e3))
def test_projection_onto_a_multiple_of_the_set(case, a):
    c, z = case
    np.testing.assert_allclose(
        scaled(c, a).project(z), a * c.project(z / a), atol=1e-12 * (1 + abs(z).max())
    )


@given(flat_sets, directions(2), st.floats(3, 15))
def test_projections_of_far_points_are_what_the_support_reaches(c, u, exponent):
    """Far out along ``u`` the nearest point is, to first order, the farthest along ``u``."""
    far = 10.0**exponent
    x = c.project(far * u)
    assert x @ u >= c.support(u) - 2 * size(c) ** 2 / far - 1e-14
    assert excess(c, x) <= 1e-14


def ellipse_foot(a, b, p):
    """The nearest point of an ellipse from Lagrange's condition, in 60 digits, by bisection."""
    with mpmath.workdps(60):
        a, b, x, y = (mpmath.mpf(float(value)) for value in (a, b, *p))

        def gauge(t):
            return (a * x / (t + a * a)) ** 2 + (b * y / (t + b * b)) ** 2

        low, high = mpmath.mpf(0), (a + b) * (abs(x) + abs(y)) + 1
        for _ in range(200):
            middle = (low + high) / 2
            low, high = (middle, high) if gauge(middle) > 1 else (low, middle)
        return np.array([float(a * a * x / (low + a * a)), float(b * b * y / (low + b * b))])


@given(st.floats(1e-3, 10.0), st.floats(1e-3, 10.0), directions(2), st.floats(1e-9, 1e4))
@example(1.0, 1e-3, np.array([0.999, 0.0447]), 1e-6)
def test_projection_onto_an_ellipse_to_the_last_digits(a, b, u, beyond):
    c = Ellipse(a, b)
    p = u / c.gauge(u) * (1 + beyond)
    foot = ellipse_foot(a, b, p)
    np.testing.assert_allclose(c.project(p), foot, atol=2e-15 * (max(a, b) + abs(p).max()))


@pytest.mark.parametrize(
    ("p", "nearest"),
    [
        ((0.1, 0.2), (0.1, 0.2)),  # inside
        ((0.3, 0.4), (0.3, 0.4)),  # the corner itself
        ((0.6, 0.8), (0.3, 0.4)),  # on the ray through the corner, where arc and corner meet
        ((0.0, 2.0), (0.0, 0.5)),  # arc
        ((0.7, 2.4), (0.14, 0.48)),  # arc
        ((2.0, 0.1), (0.3, 0.1)),  # straight edge
        ((2.0, 0.4), (0.3, 0.4)),  # where edge and corner meet
        ((2.0, 1.0), (0.3, 0.4)),  # corner
        ((0.4, 0.2), (0.3, 0.2)),  # in the disc, outside the strip
    ],
)
@pytest.mark.parametrize("signs", list(itertools.product([1, -1], [1, -1])))
def test_the_cases_of_the_cut_disc(p, nearest, signs):
    c = CutDisc(0.5, 0.3)
    np.testing.assert_allclose(
        c.project(np.multiply(p, signs)), np.multiply(nearest, signs), atol=1e-15
    )


def conic_projection(c, p):
    """The projection as a conic programme, by a solver that knows nothing of this package."""
    import cvxpy as cp

    x = cp.Variable(c.dimension)
    match c:
        case Interval():
            rules = [x >= c.lower, x <= c.upper]
        case Disc():
            rules = [cp.norm2(x) <= c.mu]
        case Ellipse():
            rules = [cp.norm2(cp.multiply([1 / c.mu_1, 1 / c.mu_2], x)) <= 1]
        case CutDisc():
            rules = [cp.norm2(x) <= c.mu, cp.abs(x[0]) <= c.width]
        case _:
            weights = cp.Variable(len(c.vertices), nonneg=True)
            rules = [cp.sum(weights) == 1, x == np.array(c.vertices).T @ weights]
    cp.Problem(cp.Minimize(cp.sum_squares(x - p)), rules).solve(solver=cp.CLARABEL)
    return x.value


@pytest.mark.parametrize(
    "c",
    [
        Interval(lower=-0.1, upper=0.4),
        Disc(0.3),
        Ellipse(0.2, 0.7),
        CutDisc(0.6, 0.2),
        ConvexPolygon([(0.3, -0.1), (0.2, 0.4), (-0.2, 0.3), (-0.4, -0.3)]),
    ],
)
def test_projection_agrees_with_a_conic_solver(c):
    rng = np.random.default_rng(7)
    for p in rng.normal(size=(8, c.dimension)):
        x, conic = c.project(p), conic_projection(c, p)
        assert (x - p) @ (x - p) == pytest.approx((conic - p) @ (conic - p), abs=1e-7)
        np.testing.assert_allclose(x, conic, atol=3e-4)  # the root of that


# ------------------------------------------------------------------------------ support and gauge


@given(with_vectors(1))
def test_the_support_is_the_most_that_a_point_of_the_set_reaches(case):
    c, s = case
    reached = (boundary(c) @ s).max()
    fine = 2 * (math.pi / 360) ** 2 * size(c) * np.linalg.norm(s)  # between points of the sample
    assert reached - 1e-14 <= c.support(s) <= reached + fine + 1e-14


@given(with_vectors(2), st.floats(0, 10))
def test_the_support_is_sublinear(case, a):
    c, s, t = case
    assert c.support(s + t) <= c.support(s) + c.support(t) + 1e-13
    assert c.support(a * s) == pytest.approx(a * c.support(s), abs=1e-12)
    assert c.support(0 * s) == 0


@given(with_vectors(1))
def test_the_gauge_is_the_multiple_of_the_set_that_just_holds_a_point(case):
    c, p = case
    assume(has_interior(c) and abs(p).max() > 1e-3)
    t = c.gauge(p)
    assert excess(c, p / (t * (1 + 1e-12))) <= 0
    assert excess(c, p / (t * (1 - 1e-9))) > 0


@given(with_vectors(2))
def test_support_and_gauge_are_polar(case):
    c, s, p = case
    assume(has_interior(c))
    assert s @ p <= c.support(s) * c.gauge(p) * (1 + 1e-14) + 1e-14


@given(with_vectors(1, sets=convex_sets.filter(has_interior)))
def test_the_gauge_is_the_best_ratio_of_power_to_support(case):
    """``gauge(p) = max_s s.p / h(s)``, attained where ``p - project(p)`` of a larger ``p`` is."""
    c, p = case
    assume(abs(p).max() > 1e-3)
    t = np.linspace(0, math.tau, 2000)
    around = np.stack([np.cos(t), np.sin(t)], axis=-1) if c.dimension == 2 else [[1.0], [-1.0]]
    best = max(s @ p / c.support(s) for s in np.asarray(around))
    assert best <= c.gauge(p) * (1 + 1e-13)
    u = (far := 1.001 * p / c.gauge(p)) - c.project(far)
    assert u @ p / c.support(u) == pytest.approx(c.gauge(p), rel=2e-3)


@pytest.mark.parametrize("flat", [Disc(0), Ellipse(0, 0), CutDisc(0, 1), CutDisc(0, 0)])
def test_without_friction_there_is_no_force(flat):
    assert flat.support([3.0, -4.0]) == 0
    assert flat.project([3.0, -4.0]).tolist() == [0, 0]
    assert flat.gauge([3.0, -4.0]) == math.inf
    assert flat.gauge([0.0, 0.0]) == 0
    assert flat.contains([0.0, 0.0])
    assert not flat.contains([0.0, 1e-300])


@pytest.mark.parametrize("segment", [Ellipse(0, 0.5), CutDisc(0.5, 0)])
def test_sets_may_be_segments(segment):
    assert segment.project([2.0, 0.3]).tolist() == [0, 0.3]
    assert segment.project([2.0, -3.0]).tolist() == [0, -0.5]
    assert segment.support([2.0, -3.0]) == 1.5
    assert segment.gauge([0.0, 0.25]) == 0.5
    assert segment.gauge([1e-9, 0.25]) == math.inf


def test_a_one_sided_interval():
    c = Interval(lower=0, upper=0.5)
    assert (c.lower, c.upper) == (0, 0.5)
    assert math.copysign(1, c.lower) == 1
    assert c.gauge([-0.1]) == math.inf
    assert c.support([-3.0]) == 0
    assert c.project([-3.0]).tolist() == [0]


@given(with_vectors(1), st.floats(0, 1))
def test_containing_means_being_near_enough(case, tolerance):
    c, p = case
    outside = np.hypot.reduce(p - boundary(c), axis=-1).min()
    distance = outside if excess(c, p) > 0 else 0.0
    margin = 3e-2 * size(c) + 1e-12  # between points of the sample
    assert c.contains(p, tolerance) or distance > tolerance
    assert not c.contains(p, tolerance) or distance <= tolerance + margin
    assert c.contains(c.project(p), 1e-14)


@given(with_vectors(3))
def test_batches_are_answered_row_by_row(case):
    c, *rows = case
    batch = np.array([rows, rows[::-1]])
    assert c.project(batch).shape == batch.shape
    for verb in (c.project, c.support, c.gauge, c.contains):
        expected = [[verb(p) for p in line] for line in batch]
        np.testing.assert_array_equal(verb(batch), expected)
    empty = np.empty((0, c.dimension))
    assert c.project(empty).shape == empty.shape
    assert c.support(empty).shape == (0,)


# -------------------------------------------------------------------------------------- inclusion


@given(st.tuples(intervals, intervals) | st.tuples(flat_sets, flat_sets))
def test_a_set_is_within_another_exactly_if_its_points_are(pair):
    inner, outer = pair
    worst = max(excess(outer, p) for p in boundary(inner, 720))
    if worst > 1e-11:
        assert not inner.within(outer)
    if worst < -1e-4 * size(inner):
        assert inner.within(outer)


@given(convex_sets, st.floats(0, 1), st.floats(1e-6, 1))
def test_a_set_is_within_itself_and_its_multiples(c, shrunk, grown):
    assert c.within(c)
    if not isinstance(c, ConvexPolygon) or shrunk > 1e-3:
        assert scaled(c, shrunk).within(c)
    if size(c) > 0:
        assert not scaled(c, 1 + grown).within(c)


@given(coefficients, coefficients)
def test_a_cut_disc_is_what_disc_and_strip_share(mu, width):
    assume(mu == width or abs(mu - width) > 1e-9)
    cut = CutDisc(mu, width)
    assert cut.within(Disc(mu))
    assert Disc(min(mu, width)).within(cut)
    assert Disc(mu).within(cut) == (width >= mu)
    assert cut.within(Ellipse(width, mu)) == (width >= mu)


def test_an_ellipse_that_passes_through_the_corners_of_a_cut_disc():
    """Its top then leaves the cut disc out, unless it is at least ``mu`` high."""
    cut = CutDisc(0.5, 0.3)
    wide = 0.3 / math.sqrt(1 - (0.4 / 0.5) ** 2)
    assert cut.within(Ellipse(wide, 0.5))
    assert not cut.within(Ellipse(wide * 0.999, 0.5))
    assert not cut.within(Ellipse(10, 0.499))


# --------------------------------------------------------------------------------------- polygons


@given(polygons(), st.randoms(use_true_random=False))
def test_a_polygon_does_not_depend_on_the_order_of_its_corners(c, random):
    shuffled = list(c.vertices)
    random.shuffle(shuffled)
    middle = np.mean(c.vertices[:2], axis=0)
    assert ConvexPolygon(shuffled) == c
    assert hash(ConvexPolygon(shuffled)) == hash(c)
    assert ConvexPolygon([*shuffled, shuffled[0]]) == c
    assert len(ConvexPolygon([*shuffled, middle]).vertices) == len(c.vertices)


@given(polygons())
def test_vertices_go_round_counterclockwise(c):
    corners = np.array(c.vertices)
    sides = np.roll(corners, -1, axis=0) - corners
    ahead = np.roll(sides, -1, axis=0)
    turns = sides[:, 0] * ahead[:, 1] - sides[:, 1] * ahead[:, 0]
    assert (turns > 0).all()
    angles = np.arctan2(turns, (sides * ahead).sum(axis=-1))
    assert angles.sum() == pytest.approx(math.tau)  # once


smooth_sets = st.builds(Disc, coefficients) | st.builds(Ellipse, coefficients, coefficients)


@given(flat_sets.filter(has_interior), st.integers(5, 200))
def test_the_polygon_around_a_support_function_is_as_near_as_it_says(c, count):
    outer = from_support(c.support, directions=count)
    assert c.within(outer)
    farthest = max(np.linalg.norm(v - c.project(v)) for v in np.array(outer.vertices))
    assert farthest <= outer.error + 1e-9 * size(c)
    heights = [
        outer.support([math.cos(t), math.sin(t)]) for t in math.tau / count * np.arange(count)
    ]
    exact = [c.support([math.cos(t), math.sin(t)]) for t in math.tau / count * np.arange(count)]
    np.testing.assert_allclose(heights, exact, atol=1e-9 * size(c))


@given(smooth_sets.filter(lambda c: not isinstance(c, Ellipse) or 0.2 < c.mu_1 / c.mu_2 < 5))
def test_the_polygon_around_a_smooth_set_errs_by_the_square_of_the_spacing(c):
    counts = [64, 128, 256, 512]
    polygons = [from_support(c.support, directions=n) for n in counts]
    true = [max(np.linalg.norm(v - c.project(v)) for v in np.array(p.vertices)) for p in polygons]
    for errors in (true, [p.error for p in polygons]):
        order = oracles.observed_order(errors, [1 / n for n in counts], 1e-12)
        assert order == pytest.approx(2, abs=0.2)


def test_the_polygon_around_a_disc_is_regular():
    """Its vertices are at ``mu / cos(pi / N)``, and the stated bound is four times as far."""
    n, mu = 60, 0.3
    c = from_support(lambda _: mu, directions=n)
    assert np.allclose(np.linalg.norm(c.vertices, axis=1), mu / math.cos(math.pi / n), rtol=1e-13)
    bound = 2 * mu * math.tan(math.pi / n) * math.sin(math.pi / n)
    assert c.error == pytest.approx(bound, rel=1e-9)


def test_a_square_seen_along_its_normals_is_found_again():
    square = ConvexPolygon([(0.2, 0.2), (-0.2, 0.2), (-0.2, -0.2), (0.2, -0.2)])
    outer = from_support(square.support, directions=64)
    np.testing.assert_allclose(outer.vertices, square.vertices, atol=1e-15)
    assert outer.error <= 1e-15


# ---------------------------------------------------------------------------------- plain numbers


@given(convex_sets)
def test_the_code_says_all(c):
    kind, numbers, corners = c.code
    assert corners.ndim == 2
    assert corners.shape[1] == 2
    assert len(numbers) == 4
    makers = {
        INTERVAL: lambda: Interval(lower=numbers[0], upper=numbers[1]),
        DISC: lambda: Disc(numbers[0]),
        ELLIPSE: lambda: Ellipse(numbers[0], numbers[1]),
        CUT_DISC: lambda: CutDisc(numbers[0], numbers[1]),
        POLYGON: lambda: ConvexPolygon(corners),
    }
    again = makers[kind]()
    assert type(again) is type(c)
    for p in boundary(c, 12) * 1.7:
        np.testing.assert_array_equal(again.project(p), c.project(p))


def test_kinds_are_numbered_as_compiled_code_knows_them():
    assert [INTERVAL, DISC, ELLIPSE, CUT_DISC, POLYGON] == [0, 1, 2, 3, 4]
    sets = [Interval(1), Disc(1), Ellipse(1, 1), CutDisc(1, 1), from_support(lambda _: 1.0)]
    assert [c.code[0] for c in sets] == [0, 1, 2, 3, 4]


def test_a_strip_wider_than_the_disc_is_coded_as_wide_as_the_disc():
    assert CutDisc(0.3, 7.0).code[1][:2] == (0.3, 0.3)


def test_sets_are_values():
    assert Interval(0.3) == Interval(lower=-0.3, upper=0.3)
    assert len({Disc(0.3), Disc(0.3), Disc(0.4)}) == 2
    assert Disc(1) == Disc(1.0)
    assert repr(Interval(0.3)) == "Interval(lower=-0.3, upper=0.3)"
    with pytest.raises(AttributeError):
        Disc(0.3).mu = 0.4


# ------------------------------------------------------------------------------------- wrong use


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: Disc(-0.1), "mu: expected a finite number, at least 0; got -0.1"),
        (lambda: Disc(math.inf), "mu: expected a finite number, at least 0; got inf"),
        (lambda: Disc(math.nan), "mu: expected a finite number, at least 0; got nan"),
        (lambda: Disc([0.1, 0.2]), "mu: expected a finite number, at least 0; got [0.1, 0.2]"),
        (lambda: Disc("rough"), "mu: expected real numbers; got dtype <U5"),
        (lambda: Disc(True), "mu: expected real numbers; got dtype bool"),
        (lambda: Ellipse(0.1, -1), "mu_2: expected a finite number, at least 0; got -1"),
        (lambda: CutDisc(0.1, -1), "width: expected a finite number, at least 0; got -1"),
        (
            Interval,
            (
                "Interval: expected either mu or both lower and upper; got mu=None, lower=None, "
                "upper=None"
            ),
        ),
        (
            lambda: Interval(0.3, upper=0.4),
            (
                "Interval: expected either mu or both lower and upper; got mu=0.3, lower=None, "
                "upper=0.4"
            ),
        ),
        (
            lambda: Interval(lower=0.1, upper=0.4),
            "lower: expected a finite number, at most 0; got 0.1",
        ),
        (
            lambda: Interval(lower=-0.1, upper=-0.05),
            "upper: expected a finite number, at least 0; got -0.05",
        ),
        (lambda: Disc(0.3).project([1.0]), "p: expected shape (..., 2); got shape (1,)"),
        (lambda: Disc(0.3).gauge(1.0), "p: expected shape (..., 2); got shape ()"),
        (lambda: Interval(0.3).support([1.0, 2.0]), "s: expected shape (..., 1); got shape (2,)"),
        (lambda: Disc(0.3).support(["a", "b"]), "s: expected real numbers; got dtype <U1"),
        (
            lambda: Disc(0.3).contains([0.0, 0.0], -1e-9),
            "tolerance: expected a finite number, at least 0; got -1e-09",
        ),
        (lambda: Disc(0.3).within(0.4), "other: expected a friction set; got float"),
        (
            lambda: Disc(0.3).within(Interval(0.3)),
            "other: expected a set of dimension 2; got dimension 1",
        ),
        (
            lambda: ConvexPolygon([(1, 0), (0, 1)]),
            "vertices: expected at least three points, shape (k, 2); got shape (2, 2)",
        ),
        (
            lambda: ConvexPolygon([(1, 0), (0, 0), (-2, 0)]),
            "vertices: expected a polygon with an area; got points on a line",
        ),
        (
            lambda: ConvexPolygon([(1, -1), (1, 1), (0.5, 0.1), (-1, 1), (-1, -1)]),
            "vertices: expected the vertices of a convex polygon; got [0.5, 0.1] in its interior",
        ),
        (
            lambda: ConvexPolygon([(1, 0), (2, 0), (1, 1)]),
            "vertices: expected a polygon that contains 0; got one that leaves it out",
        ),
        (
            lambda: from_support(lambda _: 1.0, directions=4),
            "directions: expected a whole number >= 5; got 4",
        ),
        (
            lambda: from_support(lambda u: -u[0]),
            "h: expected a finite number, at least 0; got np.float64(-1.0)",
        ),
        (
            lambda: from_support(lambda u: 2.0 if u[0] == 1 else 1.0, directions=8),
            (
                "h: expected the support function of a convex set; got values at the directions "
                "number -1, 0, 1 of 8 that no convex set has"
            ),
        ),
        (
            lambda: from_support(lambda _: 0.0),
            "h: expected a polygon with an area; got points on a line",
        ),
    ],
)
def test_wrong_use_is_refused_in_a_sentence(call, message):
    with pytest.raises((ValueError, TypeError)) as caught:
        call()
    assert str(caught.value) == message


def test_nan_forces_are_refused():
    with pytest.raises(ValueError, match="p: expected finite"):
        Disc(0.3).project([math.nan, 0.0])


def test_a_set_with_zero_on_its_edge_pushes_one_way_only():
    c = ConvexPolygon([(-1, 0), (1, 0), (0, 1)])
    assert c.support([0.0, -1.0]) == 0
    assert c.gauge([0.0, -1e-9]) == math.inf
    assert c.gauge([0.5, 0.0]) == 0.5
    np.testing.assert_allclose(c.project([0.2, -3.0]), [0.2, 0.0], atol=1e-15)


def test_the_base_class_is_abstract():
    with pytest.raises(TypeError):
        ConvexSet()


@given(reals(5.0))
def test_in_one_direction_all_is_clipping(p):
    c = Interval(lower=-0.5, upper=1.5)
    assert c.project([p]).item() == min(max(p, -0.5), 1.5)
    assert c.gauge([p]) == max(p / 1.5, -p / 0.5)
