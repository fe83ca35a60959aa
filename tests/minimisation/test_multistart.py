"""All minima of an energy: functions and regions whose minima can be counted in another way."""

import itertools
import math
from fractions import Fraction

import numpy as np
import pytest
import sympy as sp
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from oracles_search import flooded, minima_on_interval, orbit_count

from polycorner import AllOf, AnyOf, Manifold, Polyhedron, Symmetry, Verdict
from polycorner.minimisation import minima, richness
from polycorner.minimisation.loci import Locus
from polycorner.minimisation.multistart import by_level
from polycorner.models import Pinball
from polycorner.polyhedra import Element

PLANE, SPACE = Manifold.euclidean("x y"), Manifold.euclidean("x y z")
X, Y, Z = SPACE.symbols
HALF_PLANE = Polyhedron(PLANE, {"wall": X + 3})
SQUARE = [(-2, 2), (-2, 2)]


# ------------------------------------------------------------------------ counted another way


@given(
    st.lists(
        st.tuples(st.floats(-1, 1), st.floats(-1.8, -0.2), st.floats(0.2, 1.8)),
        min_size=1,
        max_size=2,
    )
)
@settings(max_examples=8)
def test_double_wells_between_walls_have_the_minima_of_their_factors(wells):
    """A sum over the coordinates is at a minimum where every summand is."""
    space = Manifold.euclidean([f"x{i}" for i in range(len(wells))])
    factors, energy, walls, axes = [], 0, {}, []
    for x, (tilt, low, high) in zip(space.symbols, wells, strict=True):
        found, margin = minima_on_interval(np.polynomial.Polynomial([1, tilt, -2, 0, 1]), low, high)
        assume(margin > 0.05)
        factors.append(found)
        energy += (x**2 - 1) ** 2 + tilt * x
        walls |= {f"{x} low": x - low, f"{x} high": high - x}
        near = [np.clip(m + d, low, high) for m in found for d in (-0.02, 0.02)]
        axes.append(np.unique([*near, *np.linspace(low, high, 5)]))
    expected = np.array(list(itertools.product(*factors)))
    starts = np.array(list(itertools.product(*axes)))
    found = minima(Polyhedron(space, walls), energy, starts=starts)
    assert len(found) == len(expected)
    assert found.descents == len(starts) == sum(found.counts) + sum(found.elsewhere.values())
    for certificate in found:
        assert abs(expected - certificate.point).max(axis=1).min() < 1e-8


def every_pool_is_found(polyhedron, energy, size, drawn, cell, deep):
    """Assert that minima are the pools of a flooded grid, as far as the grid tells them apart.

    A pool too small for random starts gets one of its own.  Returns how many are deep.
    """
    axes = [np.arange(0, a + cell / 2, cell) for a in size]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    height = sp.lambdify([X, Y], energy)(points[..., 0], points[..., 1])
    pools = flooded(np.where(polyhedron.implicit(points) >= 0, height, np.inf))
    places = np.array([points[at] for at, _ in pools])
    below = places[np.array([depth > deep for _, depth in pools])]
    found = minima(polyhedron, energy, starts=np.concatenate([drawn, below]))
    met = np.array([certificate.point for certificate in found])
    apart = abs(met[:, None] - places[None]).max(axis=-1)
    assert apart.min(axis=1).max() < 4 * cell
    assert abs(met[:, None] - below[None]).max(axis=-1).min(axis=0).max() < 4 * cell
    assert not found.elsewhere
    return len(below)


@pytest.mark.parametrize("seed", range(4))
def test_pockets_between_pins_are_the_pools_of_a_flood(seed):
    rng = np.random.default_rng(seed)
    pins = [(*rng.uniform(0, 2, 2), rng.uniform(0.1, 0.4)) for _ in range(8)]
    outside = [(X - a) ** 2 + (Y - b) ** 2 - r**2 for a, b, r in pins]
    board = Polyhedron(PLANE, [X, 2 - X, Y, 2 - Y, *outside])
    drawn = rng.uniform(0, 2, (500, 2))
    drawn = drawn[board.contains(drawn)]
    assert every_pool_is_found(board, Y + 0.3 * X, (2, 2), drawn, 0.01, 0.1) >= 2


def test_pockets_of_the_pinball_board_are_the_pools_of_a_flood():
    """Leaning a little to the left, so that nothing is level."""
    board = Pinball()
    drawn = board.starts(np.random.default_rng(0), 300)
    size = board.width, board.height
    assert every_pool_is_found(board.polyhedron, Y + X / 20, size, drawn, 0.025, 0.15) >= 5


# ------------------------------------------------------------------------------- symmetries


def moved(map_of_points):
    return Element(lambda q: np.asarray(map_of_points(q), dtype=float), {})


FLIPS = {i: moved(lambda q, i=i: q * np.where(np.arange(3) == i, -1, 1)) for i in range(3)}
CYCLES = [moved(lambda q, k=k: np.roll(q, k)) for k in (1, 2)]
INVERSION = moved(lambda q: -q)
GROUPS = {
    "trivial": [],
    "one mirror": [FLIPS[0]],
    "inversion": [INVERSION],
    "cycles": CYCLES,
    "cycles and inversion": [
        INVERSION,
        *CYCLES,
        *[moved(lambda q, k=k: -np.roll(q, k)) for k in (1, 2)],
    ],
    "all mirrors": [
        moved(lambda q, s=s: q * s) for s in itertools.product((1, -1), repeat=3) if min(s) < 0
    ],
}
WELLS = sum((x**2 - 1) ** 2 for x in (X, Y, Z))
CUBE = Polyhedron(SPACE, {f"{x}{s}": 2 - s * x for x in (X, Y, Z) for s in (1, -1)})
GRID = np.array(list(itertools.product((-1.6, -0.5, 0.4, 1.3), repeat=3)))


@pytest.mark.parametrize("name", GROUPS)
def test_copies_count_once_up_to_a_finite_group(name):
    group = GROUPS[name]
    corners = np.array(list(itertools.product((-1, 1), repeat=3)))
    orbits = orbit_count(corners, [element.apply for element in group])
    found = minima(CUBE, WELLS, starts=GRID, symmetry=Symmetry(elements=group))
    assert len(found) == orbits
    assert sum(found.counts) == len(GRID)
    assert [c.verdict for c in found] == [Verdict.STRICT_MINIMUM] * orbits

    def relabel(p, q, tolerance):
        near = [abs(g.apply(p) - q).max() <= tolerance for g in [moved(lambda q: q), *group]]
        return [{}] * sum(near)

    assert (
        minima(CUBE, WELLS, starts=GRID, symmetry=Symmetry(relabel=relabel)).counts == found.counts
    )


TURN = Symmetry(
    tangents=lambda q: np.array([[-q[1], q[0]]]), invariants=lambda q: np.array([np.hypot(*q)])
)
TURN_FIELD = Symmetry(fields=[{"x": -Y, "y": X}], invariants=TURN.invariants)
RINGS = ((X**2 + Y**2 - 1) * (X**2 + Y**2 - 4)) ** 2 + (X**2 + Y**2) / 10


@pytest.mark.parametrize(
    "symmetry", [None, TURN, TURN_FIELD], ids=["as a locus", "as an orbit", "by a field"]
)
def test_a_ring_is_one_minimum_with_and_without_its_symmetry(symmetry):
    found = minima(HALF_PLANE, RINGS, starts=80, box=SQUARE, rng=1, symmetry=symmetry)
    assert [round(float(np.hypot(*c.point)), 1) for c in found] == [1.0, 2.0]
    assert [c.verdict for c in found] == [Verdict.MINIMUM_ALONG_LOCUS] * 2
    assert [len(points) == 1 for points in found.points] == [symmetry is not None] * 2
    assert sum(found.counts) == 80


# ------------------------------------------------------------------------------------- loci


def turn(angle):
    c, s = math.cos(angle), math.sin(angle)
    return moved(lambda q: (c * q[0] - s * q[1], s * q[0] + c * q[1]))


@pytest.mark.parametrize("pieces", range(1, 6))
def test_a_ring_cut_into_arcs_is_as_many_minima_as_there_are_arcs(pieces):
    """``Re (x + i y)^k >= 0`` cuts k arcs out of the circle; turning by ``2 pi / k`` joins them."""
    cut = sp.re(sp.expand((X + sp.I * Y) ** pieces))
    sectors = Polyhedron(PLANE, {"cut": cut, "hole": X**2 + Y**2 - sp.Rational(1, 4)})
    ring = (X**2 + Y**2 - 1) ** 2
    found = minima(sectors, ring, starts=120, box=SQUARE, rng=2)
    assert len(found) == pieces
    turns = [turn(2 * math.pi * k / pieces) for k in range(1, pieces)]
    assert (
        len(minima(sectors, ring, starts=120, box=SQUARE, symmetry=Symmetry(elements=turns))) == 1
    )


def box(left, right, low, high):
    return AllOf(X - left, right - X, Y - low, high - Y, Z)


FLOORS = {
    "around a pillar": (AllOf(box(-2, 2, -2, 2), X**2 + Y**2 - 1), 1),
    "around a corner": (AnyOf(box(-2, -1, -2, 2), box(-2, 2, -2, -1), box(1, 2, -2, 2)), 1),
    "two rooms": (AnyOf(box(-2, -1, -2, 2), box(1, 2, -2, 2)), 2),
    "a thin wall": (AllOf(box(-2, 2, -2, 2), AnyOf(X - 0.05, -X - 0.05)), 2),
}


@pytest.mark.parametrize("name", FLOORS)
def test_a_floor_is_one_minimum_for_each_room(name):
    tree, rooms = FLOORS[name]
    found = minima(Polyhedron(SPACE, tree), Z, starts=150, box=[*SQUARE, (0, 1)], rng=3)
    assert len(found) == rooms
    assert sum(found.counts) == 150
    assert [c.signature for c in found] == [(1, 0, 2)] * rooms
    assert [len(c.active) for c in found] == [1] * rooms  # in the middle of a floor, not at a wall


def test_a_long_floor_is_one_minimum_however_far_apart_starts_are():
    found = minima(
        Polyhedron(PLANE, {"floor": Y}), Y, starts=[[0.0, 1.0], [1500.0, 1.0], [-900.0, 3.0]]
    )
    assert found.counts == (3,)


# ------------------------------------------------------------------------------ what is said


def test_what_is_no_minimum_is_counted_by_its_verdict():
    slope = minima(HALF_PLANE, X + Y, starts=20, box=SQUARE)
    assert (len(slope), slope.elsewhere, slope.others) == (0, {Verdict.UNBOUNDED: 20}, ())
    empty = minima(Polyhedron(PLANE, {"never": -1 - X**2}), Y, starts=[[0.0, 0.0], [1.0, 1.0]])
    assert empty.elsewhere == {Verdict.INFEASIBLE: 2}
    flat = minima(HALF_PLANE, X**18 + Y**2, starts=30, box=SQUARE)
    assert flat.elsewhere == {Verdict.UNDECIDED: 30}
    assert [c.verdict for c in flat.others] == [Verdict.UNDECIDED]
    for found in (slope, empty, flat):
        assert found.completeness == (
            f"0 minima from {found.starts} starts; {found.starts} ended in no minimum."
        )


def test_the_statement_names_a_symmetry_only_where_one_was_given():
    bowl, start = X**2 + Y**2, [[0.5, 0.5]]
    assert minima(HALF_PLANE, bowl, starts=start).completeness.startswith("1 minimum from 1 start.")
    given = minima(HALF_PLANE, bowl, starts=start, symmetry=Symmetry())
    assert given.completeness.startswith("1 minimum, up to the symmetry, from 1 start.")


def test_two_lines_of_minima_that_cross_are_one_locus():
    u, v = X - 0.2, Y - 0.1
    starts = [[0.9, 0.3], [0.3, -0.7], [-0.6, 0.15], [0.25, 0.8], [-0.7, -0.2]]
    found = minima(Polyhedron(PLANE, {"far": Y + 50}), (u * v) ** 2, starts=starts)
    assert [c.verdict for c in found] == [Verdict.MINIMUM_ALONG_LOCUS]
    assert found.counts == (5,)


def test_minima_are_a_sequence_the_lowest_first():
    found = minima(HALF_PLANE, (X**2 - 1) ** 2 + X / 4 + Y**2, starts=50, box=SQUARE)
    assert [c.energy for c in found] == sorted(c.energy for c in found)
    assert (len(found), found[0], list(found[1:])) == (2, found.certificates[0], [found[1]])
    assert found[1] in found
    assert all(c.holds() for c in found)
    assert repr(found).startswith("Minima(2 from 50 starts; energies -0.25")


def test_the_statement_says_what_is_estimated_and_assumed():
    found = minima(HALF_PLANE, (X**2 - 1) ** 2 + Y**2, starts=60, box=SQUARE)
    head = ["energy", "starts", "(p,", "q,", "r)", "verdict", "active", "x", "y"]
    assert str(found).splitlines()[1].split() == head
    text = " ".join(str(found).split())
    assert text.endswith(found.completeness)
    for part in (
        "2 minima from 60 starts.",
        "Estimated coverage 100.00% (Good-Turing); estimated number of minima 2, ",
        "independent draws from one distribution",
        f"a share of less than {found.richness.overlooked:.2g}",
    ):
        assert part in text
    assert found.richness.draws == 60


def test_rare_minima_are_expected_where_some_were_met_only_once():
    """A comb of wells of which a few starts can meet only some, most of them once."""
    wells = sp.cos(20 * X) + Y**2
    found = minima(HALF_PLANE, wells, starts=12, box=SQUARE, rng=0)
    assert found.richness.singles > 2
    assert found.richness.estimate > len(found) > 5
    assert found.richness.coverage < 0.8


# ---------------------------------------------------------------------------------- the run


def test_a_search_can_be_repeated():
    runs = [
        minima(HALF_PLANE, RINGS, starts=30, box=SQUARE, rng=rng)
        for rng in (7, np.random.default_rng(7), 8)
    ]
    first, again, other = (np.concatenate(run.points) for run in runs)
    np.testing.assert_array_equal(first, again)
    assert runs[0].counts == runs[1].counts
    assert not np.array_equal(first, other)


def test_the_order_of_the_starts_does_not_matter():
    starts = np.random.default_rng(0).uniform(-2, 2, (60, 2))
    one, two = (minima(HALF_PLANE, RINGS, starts=s) for s in (starts, starts[::-1]))
    assert one.counts == two.counts


@given(st.integers(1, 9))
@settings(max_examples=9)
def test_an_interrupted_search_returns_what_it_found(stop):
    starts = np.random.default_rng(0).uniform(-2, 2, (10, 2))
    told = []

    def progress(done, total, note):
        told.append((done, total, note))
        if done == stop:
            raise KeyboardInterrupt

    cut = minima(HALF_PLANE, WELLS.subs(Z, 1), starts=starts, progress=progress)
    assert cut.interrupted
    assert (cut.descents, cut.starts) == (stop, 10)
    assert told == [(k, 10, n) for k, (_, _, n) in enumerate(told, 1)]
    assert told[-1][2] == f"{len(cut)} minima"
    assert f"(interrupted, {10 - stop} left)" in cut.completeness
    whole = minima(HALF_PLANE, WELLS.subs(Z, 1), starts=starts[:stop])
    assert not whole.interrupted
    assert cut.counts == whole.counts


def test_points_are_drawn_where_the_inequalities_hold():
    """On a thin ring of a torus, of which a third is walled off."""
    torus = Manifold(("a", "b"), (math.tau, 360.0), (1.0, 57.0))
    a, b = torus.symbols
    turn = 2 * sp.pi * (b - 10) / 360
    parts = {"open": sp.cos(a) + sp.Rational(1, 2), "near": sp.cos(turn)}
    ring = Polyhedron(torus, parts, {"level": sp.sin(turn)})
    found = minima(ring, sp.cos(2 * a), starts=40, rng=0)
    assert sum(found.counts) == 40
    exact = [-math.pi / 2, math.pi / 2]
    assert sorted(c.point[0] for c in found) == pytest.approx(exact, abs=1e-8)
    assert all(c.point[1] == pytest.approx(10) for c in found)


@given(st.permutations(range(6)), st.lists(st.floats(-1, 1), min_size=6, max_size=6))
def test_rounding_does_not_order_minima_of_equal_energy(order, noise):
    loci = [
        Locus(None, k // 2 + 1e-12 * noise[k], 1e-9, False, [], [], np.zeros((0, 1))) for k in order
    ]
    expected = sorted(range(6), key=lambda position: order[position] // 2)
    assert by_level(loci) == [loci[position] for position in expected]


# ---------------------------------------------------------------------------------------- abundance

abundances = st.lists(st.integers(1, 30), min_size=1, max_size=12)


def compositions(total, parts):
    """Yield every way to spread ``total`` draws over ``parts`` kinds, in order."""
    if parts == 1:
        yield (total,)
        return
    for first in range(total + 1):
        for rest in compositions(total - first, parts - 1):
            yield (first, *rest)


def samples(shares, draws):
    """Yield every sample of a population, as its positive counts, with its exact probability."""
    for counts in compositions(draws, len(shares)):
        weight = Fraction(math.factorial(draws))
        for share, count in zip(shares, counts, strict=True):
            weight *= share**count / math.factorial(count)
        yield counts, weight


def expectation(shares, draws, figure):
    return float(sum(float(w) * figure(counts) for counts, w in samples(shares, draws)))


def estimated(counts):
    return richness([c for c in counts if c])


EVEN = [Fraction(1, 5)] * 5
UNEVEN = [Fraction(k, 15) for k in (8, 3, 2, 1, 1)]
populations = pytest.mark.parametrize("shares", [EVEN, UNEVEN], ids=["even", "uneven"])


@given(abundances)
def test_the_estimate_is_the_formula(counts):
    n, f1, f2 = sum(counts), counts.count(1), counts.count(2)
    exact = len(counts) + Fraction(n - 1, n) * Fraction(f1 * (f1 - 1), 2 * (f2 + 1))
    found = richness(counts)
    assert found.estimate == pytest.approx(float(exact), rel=1e-14)
    assert found.coverage == pytest.approx(float(1 - Fraction(f1, n)), rel=1e-14)
    assert (found.observed, found.draws, found.singles, found.doubles) == (len(counts), n, f1, f2)


@given(abundances)
def test_what_was_seen_is_there(counts):
    found = richness(counts)
    low, high = found.interval
    assert len(counts) <= low <= high
    assert len(counts) <= found.estimate <= high
    assert found.unseen >= 0
    assert found.variance >= 0
    assert richness(counts[::-1]) == found


@given(st.lists(st.integers(20, 1000), min_size=1, max_size=8))
def test_kinds_that_were_all_met_often_are_all_there_are(counts):
    found = richness(counts)
    assert found.estimate == len(counts)
    assert found.coverage == 1
    assert found.interval == pytest.approx((len(counts), len(counts)), abs=1e-3)


@populations
def test_coverage_is_that_of_one_draw_less(shares):
    """The expectation of ``1 - f1/n`` is the share expected to be met in ``n - 1`` draws."""
    n = 10
    met = 1 - sum(float(p * (1 - p) ** (n - 1)) for p in shares)
    computed = expectation(shares, n, lambda counts: estimated(counts).coverage)
    assert computed == pytest.approx(met, rel=1e-12)


def test_the_estimate_is_nearly_unbiased_for_an_even_population():
    errors = [
        abs(expectation(EVEN, n, lambda counts: estimated(counts).estimate) - 5)
        for n in (8, 12, 16, 24)
    ]
    assert errors == sorted(errors, reverse=True)
    assert errors[-1] < 0.03


def test_the_estimate_is_between_what_is_seen_and_what_there_is_for_an_uneven_population():
    for n in (8, 12, 16):
        seen, claimed = (
            expectation(UNEVEN, n, lambda counts, what=what: getattr(estimated(counts), what))
            for what in ("observed", "estimate")
        )
        assert seen + 0.3 * (5 - seen) < claimed < 5


@populations
def test_the_variance_is_of_the_right_size(shares):
    n = 12
    mean = expectation(shares, n, lambda counts: estimated(counts).estimate)
    exact = expectation(shares, n, lambda counts: (estimated(counts).estimate - mean) ** 2)
    claimed = expectation(shares, n, lambda counts: estimated(counts).variance)
    assert 0.5 < claimed / exact < 3


def test_the_interval_contains_the_truth_as_often_as_it_says_once_there_are_draws_enough():
    def contains(counts):
        low, high = estimated(counts).interval
        return low <= 5 <= high

    assert expectation(EVEN, 24, contains) > 0.95
    assert expectation(EVEN, 12, contains) < 0.9  # which is why the level is called nominal


@given(st.integers(1, 5000))
def test_what_may_be_overlooked_is_missed_once_in_twenty(n):
    share = richness([n]).overlooked
    assert (1 - share) ** n == pytest.approx(0.05, rel=1e-9)
    if n > 100:
        assert share == pytest.approx(3 / n, rel=0.02)


def test_nothing_is_known_without_draws():
    found = richness([])
    assert (found.observed, found.estimate, found.coverage, found.overlooked) == (0, 0, 0, 1)
    assert found.interval == (0, math.inf)


def test_numpy_counts_are_counts():
    assert richness(np.array([4, 1, 1])) == richness([4, 1, 1])
