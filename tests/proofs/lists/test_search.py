"""Searches: the same list however many threads work, and every stationary point of a lattice."""

import numpy as np
import pytest
import sympy
from proof_files import described, parts_of

from polycorner import Manifold, Polyhedron
from polycorner.proofs import stationary_points
from polycorner.proofs.lists.attempts import Screen, newton
from polycorner.proofs.lists.enumeration import begun
from polycorner.proofs.lists.search import CHUNKS, LEAST, StationarySearch

PLANE = Manifold.euclidean("x y")
X, Y = PLANE.symbols


def shubert(u):
    return sum(j * sympy.cos((j + 1) * u + j) for j in range(1, 6))


def walls(reach):
    return Polyhedron(PLANE, [reach - X, reach + X, reach - Y, reach + Y])


@pytest.fixture(scope="module")
def lattice():
    """A product of waves on a square, and its list."""
    problem = {"polyhedron": walls(3), "energy": shubert(X) * shubert(Y), "box": [(-3, 3)] * 2}
    return problem, stationary_points(**problem)


def extremes(reach, count=200_001):
    """Return local minima and maxima of the wave on an interval as values, ends included."""
    u = np.linspace(-reach, reach, count)
    f = sum(j * np.cos((j + 1) * u + j) for j in range(1, 6))
    padded = [np.concatenate([[end], f, [end]]) for end in (np.inf, -np.inf)]
    low = f[(padded[0][1:-1] < padded[0][:-2]) & (padded[0][1:-1] < padded[0][2:])]
    high = f[(padded[1][1:-1] > padded[1][:-2]) & (padded[1][1:-1] > padded[1][2:])]
    return low, high


def count_of_minima(reach):
    """Count minima of f(x) f(y): a minimum of one factor where the other is positive, and so on."""
    low, high = extremes(reach)
    apart = (low < 0).sum() * (high > 0).sum()
    return 2 * apart + (low > 0).sum() ** 2 + (high < 0).sum() ** 2


def test_minima_of_a_product_of_waves_are_counted_by_its_factors(lattice):
    _, found = lattice
    assert found.complete
    assert len(found.minima) == count_of_minima(3)


def test_shubert_has_760_minima_and_one_in_a_corner():
    found = stationary_points(walls(10), shubert(X) * shubert(Y), box=[(-10, 10)] * 2)
    assert found.complete
    assert len(found.minima) == count_of_minima(10) == 761
    (corner,) = [p for p in found.minima if len(p.active) == 2]
    assert np.allclose(corner.point, [-10, -10])
    assert sum(not p.active for p in found.minima) == 722  # 2 * 19^2 inside


@pytest.mark.parametrize("workers", [2, 8])
def test_the_number_of_workers_changes_nothing(lattice, workers, tmp_path):
    problem, alone = lattice
    assert alone.tally.boxes > CHUNKS * LEAST  # several chunks in a round
    found = stationary_points(**problem, workers=workers)
    assert found.tally == alone.tally
    assert parts_of(found.save(tmp_path / "a.zip")) == parts_of(alone.save(tmp_path / "b.zip"))
    for mine, other in zip(found, alone, strict=True):
        assert mine.lower.tolist() == other.lower.tolist()
        assert mine.multipliers == other.multipliers


def test_workers_are_counted(lattice):
    with pytest.raises(ValueError, match="workers: expected"):
        stationary_points(**lattice[0], workers=0)


def test_boxes_that_pass_the_screen_have_one_point_by_ball_arithmetic(lattice):
    problem, found = lattice
    setting = begun(StationarySearch, *problem.values(), None, 1e-6)
    inside = np.array([p.point for p in found if not p.active])
    radii = Screen(setting, (), inside).radii(np.ones(len(inside)))
    assert np.isfinite(radii).mean() > 0.9
    for q, reach in zip(inside, radii, strict=True):
        if np.isfinite(reach).all():
            region = setting.faces.region(q, (), 1e-12, reach)
            assert region is not None
            assert (region.upper - region.lower > 0.5 * reach).all()


def test_newton_finds_kkt_points_of_the_face_of_each_start():
    d = Polyhedron(PLANE, {"low": Y, "left": X + 1})
    setting = begun(StationarySearch, d, X**4 - X**2 + Y, [(-2, 2), (-1, 2)], None, 1e-6)
    starts = np.array([[0.9, 0.4], [0.0, 0.1], [-0.9, 0.2], [0.4, 0.1], [-0.9, 0.1]])
    active = np.array([[1, 0]] * 3 + [[0, 0], [1, 1]], dtype=bool)
    q, found = newton(setting.problem, starts, active, (0, 1))
    # on both sides no point is at rest (the multiplier of "left" is -2), inside the gradient is
    # not 0 either
    assert found.tolist() == [True, True, True, False, False]
    assert np.allclose(q[:3, 0], [0.5**0.5, 0, -(0.5**0.5)])
    assert np.allclose(q[:3, 1], 0)
    _, near = newton(setting.problem, starts, active, (0, 1), [1.0, 1.0, 0.05, 1.0, 1.0])
    assert near.tolist() == [True, True, False, False, False]
    _, fixed = newton(setting.problem, starts[:1], active[:1], (1,))
    assert fixed.tolist() == [True]  # along y alone every point of the side is at rest


def test_a_root_that_vanishes_at_a_point_outside_decides_that_it_is_outside():
    """At the origin the distance from it is 0, whose root no ball encloses, and below the limit."""
    d = Polyhedron(PLANE, {"far": sympy.sqrt(X**2 + Y**2) - 1, "near": 4 - X**2 - Y**2})
    found = stationary_points(d, Y**2 + X**2 + X**2 * Y, box=[(-3, 3)] * 2)
    assert not found.open_points
    assert all(np.linalg.norm(p.point) > 0.9 for p in found)


def test_what_is_saved_names_every_point_of_the_list(lattice, tmp_path):
    data = described(lattice[1].save(tmp_path / "list.zip"))
    assert len(data["points"]) == len(lattice[1])
