"""Samples of strata: shares against exact weights, reversibility, and that nothing is outside."""

import math
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polycorner import AnyOf, Manifold, Polyhedron, skeleton
from polycorner.dumbbells import DumbbellPair
from polycorner.measures import SampleOptions, Weighting, measure, sample
from polycorner.measures.estimates import series_mean
from polycorner.models import SphereCluster

M = Manifold.euclidean("x y")
x, y = M.symbols
PARABOLA = Polyhedron(M, {"parabola": y - x**2, "lid": 2 - y})
WIDE = SampleOptions(step=0.9, sideways=0.3, reach=0.7)
STARTS = [[0.0, 1.0], [0.5, 2.0], [1.0, 1.0], [0.0, 0.5]]
ROOT = math.sqrt(2)


def agree(estimate, exact, most=4.0):
    """Whether an estimate is within four of its standard deviations, which are small."""
    assert estimate.error < 0.1 * max(abs(exact), 0.1)
    return abs(estimate.value - exact) < most * estimate.error


def parabola(weighting, points=40_000, rng=1, options=WIDE):
    return sample(PARABOLA, STARTS, points, weighting=weighting, rng=rng, options=options)


class TestParabolaAndLid:
    def test_shares_of_strata(self):
        """Area 3.771236, lengths 5.124014 and 2.828427, two corners ([HC20])."""
        found = parabola(Weighting(gradients=False))
        sizes = {
            (): 8 * ROOT / 3,
            ("parabola",): 3 * ROOT + math.asinh(2 * ROOT) / 2,
            ("lid",): 2 * ROOT,
            ("parabola", "lid"): 2.0,
        }
        total = sum(sizes.values())
        for stratum, size in sizes.items():
            assert agree(found.fraction(stratum=stratum), size / total)

    def test_moments_on_strata(self):
        """On the area ``int y``; along the parabola, with ``delta(f)``, ``int x^2 dx``."""
        found = parabola(Weighting())
        height, away = found.points[..., 1], found.points[..., 0]
        inside, bowl = found.contacts == 0, found.positions == found.strata.index(("parabola",))
        area = 8 * ROOT / 3
        mean = 0.5 * (4 * 2 * ROOT - 2 * ROOT**5 / 5) / area
        assert agree(found.mean(inside * (height - mean) + 1.0), 1.0)
        assert agree(found.mean(bowl * (away**2 - 2 / 3) + 1.0), 1.0)

    def test_stickiness_and_energies(self):
        """With ``E = x`` along the lid ``int exp(-x)``; a sticky lid five times as often."""
        weighting = Weighting(stickiness={"lid": 5.0}, energy=x)
        found = parabola(weighting)
        grid = np.linspace(-ROOT, ROOT, 4001)
        area = np.trapezoid(np.exp(-grid) * (2 - grid**2), grid)
        line = 2 * math.sinh(ROOT)
        corners = 5 * 2 * math.cosh(ROOT) / (2 * ROOT)
        total = area + 6 * line + corners
        assert agree(found.fraction(contacts=0), area / total)
        assert agree(found.fraction(stratum=("lid",)), 5 * line / total)
        assert agree(found.fraction(contacts=2), corners / total)

    @pytest.mark.parametrize("options", [WIDE, SampleOptions(step=0.2, sideways=0.05, reach=0.2)])
    def test_the_chain_is_reversible(self, options):
        """``E f(q_t) g(q_t+1) = E g(q_t) f(q_t+1)``: detailed balance in equilibrium."""
        found = parabola(Weighting(stickiness=2.0), options=options)
        f = (found.contacts == 1) * np.exp(found.points[..., 0])
        g = (found.contacts != 2) * found.points[..., 1] ** 2
        flow = f[:, :-1] * g[:, 1:] - g[:, :-1] * f[:, 1:]
        one = series_mean(flow)
        assert abs(one.value) < 4 * one.error

    def test_moves_that_gain_are_undone_as_often(self):
        found = parabola(Weighting(), points=2000)
        assert abs(found.moves[1, 1] - found.moves[1, 2]) <= 2 * len(STARTS) + 2

    def test_the_same_seed_gives_the_same_bits(self):
        whole = parabola(Weighting(), points=600)
        parts = parabola(Weighting(), points=250).more(350)
        with ThreadPoolExecutor(2) as pool:
            other = parabola(Weighting(), points=250).more(350, executor=pool)
        for again in (parts, other):
            assert np.array_equal(whole.points, again.points)
            named = [
                [np.array(s.strata, dtype=object)[k] for k in s.positions[0]]
                for s in (whole, again)
            ]
            assert named[0] == named[1]
            assert np.array_equal(whole.moves[0] - again.moves[0], [0, 0, 0])
        assert not np.array_equal(whole.points, parabola(Weighting(), 600, rng=2).points)


class TestNeverOutside:
    @settings(max_examples=10)
    @given(
        st.lists(st.tuples(st.floats(0, 6.28), st.floats(0.2, 1.0)), min_size=1, max_size=5),
        st.integers(0, 2**32 - 1),
    )
    def test_points_are_in_discs_cut_by_lines(self, cuts, seed):
        parts = {f"c{k}": h - math.cos(a) * x - math.sin(a) * y for k, (a, h) in enumerate(cuts)}
        D = Polyhedron(M, {"disc": 1 - x**2 - y**2, **parts})
        options = SampleOptions(discarded=0)
        found = sample(D, [[0.0, 0.0]], 300, rng=seed, options=options)
        values = D.values(found.points[0])
        gradients = np.linalg.norm(D.gradients(found.points[0]), axis=-1)
        assert (values >= -1e-10 * gradients).all()
        for stratum, at in zip(found.strata, range(len(found.strata)), strict=True):
            held = np.isin(D.names, stratum)
            there = found.positions[0] == at
            assert (abs(values[there][:, held]) <= 1e-10 * gradients[there][:, held]).all()
            assert (values[there][:, ~held] > 0).all()


def test_equations_are_kept():
    """The area of a cap of the unit sphere to its rim, and the mean height, by Archimedes."""
    S = Manifold.sphere("x y z")
    D = Polyhedron(S, {"floor": S.symbols[2] - 0.2})
    found = sample(
        D, [[0.0, 0.6, 0.8]] * 2, 30_000, weighting=Weighting(gradients=False), rng=3,
        options=SampleOptions(step=0.6, sideways=0.3, reach=0.6),
    )  # fmt: skip
    area, rim = 2 * math.pi * 0.8, 2 * math.pi * math.sqrt(1 - 0.04)
    assert abs(np.linalg.norm(found.points, axis=-1) - 1).max() < 1e-10
    assert agree(found.fraction(contacts=1), rim / (area + rim))
    assert agree(found.mean((found.contacts == 0) * (found.points[..., 2] - 0.6) + 1.0), 1.0)


def test_edges_of_clusters_weigh_what_quadrature_says():
    """Five discs: the sum over edges to the sum over corners, both ways."""
    model = SphereCluster(5, 2)
    found = measure(skeleton(model.polyhedron, model.starts(), symmetry=model.symmetry))
    chains = sample(
        model.polyhedron, np.tile(model.starts(), (4, 1)), 10_000,
        weighting=Weighting(stickiness=30.0), contacts=(6, 7), rng=4,
        options=SampleOptions(step=0.25, sideways=0.05, reach=0.3, every=10),
    )  # fmt: skip
    assert agree(chains.ratio(6, 7), found.edges.sum() / found.corners.sum())


def test_effective_sizes_of_an_autoregressive_series():
    """``tau = (1 + a) / (1 - a)``."""
    noise = np.random.default_rng(5).normal(size=(4, 50_000))
    a = 0.8
    series = np.zeros_like(noise)
    for t in range(1, noise.shape[1]):
        series[:, t] = a * series[:, t - 1] + noise[:, t]
    found = series_mean(series)
    assert found.effective == pytest.approx(series.size * (1 - a) / (1 + a), rel=0.1)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"polyhedron": Polyhedron(M, AnyOf(x, y))}, "as each part of a union does"),
        ({"weighting": Weighting(stickiness=math.inf)}, "finite stickiness"),
        ({"starts": [[0.0, 3.0]]}, "points of the polyhedron"),
        ({"contacts": (1, 2)}, "1 to 2 contacts vanish"),
        ({"keep": ["lid"]}, "among them lid"),
        ({"points": 0}, "points"),
    ],
)
def test_refusals(change, words):
    given = {"polyhedron": PARABOLA, "starts": [[0.0, 1.0]], "points": 10}
    with pytest.raises(ValueError, match=words):
        sample(**(given | change))


def test_shares_of_contacts_of_two_dumbbells():
    """One contact each: shares by the chain, and by counting random placements in thin shells."""
    pair, reach = DumbbellPair(length=16, ball_radius=3, rod_radius=1.5), 0.05
    D, rng = pair.polyhedron, np.random.default_rng(7)
    placed = np.zeros((1_000_000, 6))
    placed[:, 3:] = rng.uniform([-23, -23, 0], [23, 23, 2 * math.pi], (len(placed), 3))
    values = D.values(placed)
    near = placed[values.min(axis=1) >= 0], values[values.min(axis=1) >= 0]
    touching = near[1] < reach
    balls = [k for k, name in enumerate(D.names) if name.isupper()]
    once = touching.sum(axis=1) == 1
    shares = touching[once].sum(axis=0) / once.sum()
    starts = near[0][once][:4]
    options = SampleOptions(step=0.4, sideways=0.2, reach=0.5, every=10)
    found = sample(
        D, [onto_contact(D, q) for q in starts], 8000, contacts=(1, 2), rng=8, options=options
    )
    single = found.contacts == 1
    at_balls = np.isin(found.positions, [
        k for k, s in enumerate(found.strata) if len(s) == 1 and D.names.index(s[0]) in balls
    ])  # fmt: skip
    ratio = series_mean(at_balls - shares[balls].sum() * single)
    counted = math.sqrt(0.25 / once.sum())
    assert abs(ratio.value) < 4 * math.hypot(ratio.error, counted * single.mean()) + 0.003


def onto_contact(D, q):
    """Move the second dumbbell until the nearest contact closes."""
    k = int(np.argmin(D.values(q)))
    for _ in range(20):
        slope = D.gradients(q)[k] * [0, 0, 0, 1, 1, 1]
        q = q - slope * D.values(q)[k] / (slope @ slope)
    return q
