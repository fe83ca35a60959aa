"""Appendix B and section 8: cells counted by a formula, strata by sampling, balls by hand."""

from math import comb, cos, hypot, sin

import numpy as np
import pytest
from hypothesis import settings

from paper_checks.appendixB import near as strata_near
from paper_checks.appendixB import polyhedra
from paper_checks.framework.claims import Verdict
from paper_checks.section8 import conclusion
from polycorner import stratum_at
from polycorner.models import Pinball


def generic_regions(planes, n):
    """Return the number of open parts into which generic hyperplanes cut a space (Schläfli)."""
    return 2 * sum(comb(planes - 1, i) for i in range(n)) if planes else 1


def generic_cells(planes, n):
    """Return their number of cells: on every intersection the others are generic again."""
    on_flats = [
        comb(planes, k) * generic_regions(planes - k, n - k) for k in range(min(planes, n - 1) + 1)
    ]
    return sum(on_flats) + (planes >= n)


@pytest.mark.parametrize("n", [2, 3, 4])
@pytest.mark.parametrize("planes", [1, 2, 3, 4, 5])
def test_cells_of_generic_planes(n, planes):
    rows = np.random.default_rng(10 * n + planes).normal(size=(planes, n))
    cells = list(strata_near._cells(rows))
    assert len(set(cells)) == len(cells) == generic_cells(planes, n)


def test_two_sides_of_one_plane_have_opposite_signs():
    rows = np.array([[1.0, 2.0], [-2.0, -4.0], [0.0, 1.0]])
    cells = set(strata_near._cells(rows))
    assert len(cells) == 9
    assert all(one == -other for one, other, _ in cells)


def test_strata_around_points_are_those_of_points_near_them():
    """Of linear sets: along random directions, into every cell sooner or later."""
    rng = np.random.default_rng(0)
    for spot in strata_near.spots():
        D = spot.example.polyhedron
        if D.dimension > 3 or spot.example.name == "the region of the figure":
            continue
        point = next(p for p in spot.example.points if stratum_at(D, p) == spot.stratum)
        met = set()
        size = max(100, settings.default.max_examples), D.dimension
        for direction in rng.normal(size=size) * rng.integers(0, 2, size=size):
            near = point + 1e-3 * direction
            if D.contains(near, tolerance=1e-12):
                met.add(stratum_at(D, near).dimension)
        assert met <= spot.nearby
        assert spot.stratum.dimension in met


def test_a_point_of_the_boundary_that_no_higher_stratum_is_near_is_what_refutes():
    far_end = [s for s in strata_near.spots() if "attached" in s.example.name][-1]
    assert (far_end.stratum.dimension, far_end.nearby) == (0, {0, 1})
    assert polyhedra.boundary_is_all_lower_strata().verdict is Verdict.CORRECTED


# ----------------------------------------------------------------------------------------- balls


@pytest.fixture
def slope(monkeypatch):
    """Put a wedge with a side of 30 degrees and nothing else on the board."""
    board = Pinball(pins=(), wedges=(((1, 1), (5, 1), (1, 1 + 4 * np.tan(np.pi / 6))),), cups=())
    monkeypatch.setattr(conclusion, "BOARD", board)
    return board


@pytest.mark.usefixtures("slope")
def test_a_free_ball_falls_straight_down():
    way = conclusion.STEP * conclusion.STEPS
    assert conclusion._run(np.array([3.0, 7.0])) == pytest.approx([3.0, 7.0 - way])


def test_a_ball_on_a_slope_slides_along_it(slope):
    angle, way = np.pi / 6, conclusion.STEP * conclusion.STEPS
    start = np.array([2.0, 1 + 3 * np.tan(angle)])
    assert slope.polyhedron.contains(start, tolerance=1e-9)
    moved = conclusion._run(start + np.array([0, 1e-9])) - start
    assert hypot(*moved) == pytest.approx(way, rel=1e-3)
    assert moved == pytest.approx([way * cos(angle), -way * sin(angle)], rel=1e-3)


@pytest.mark.usefixtures("slope")
def test_a_ball_on_the_floor_stays():
    start = np.array([0.5, 0.0])
    assert conclusion._run(start) == pytest.approx(start, abs=1e-8)


@pytest.mark.usefixtures("slope")
def test_ways_part_at_the_upper_tip_of_the_wedge_only():
    conclusion.corners.cache_clear()
    tips = conclusion.corners(conclusion.CONCAVE)
    conclusion.corners.cache_clear()
    assert len(tips) == 3
    (parting,) = [tip for tip in tips if conclusion._part(tip)]
    assert parting == pytest.approx([1, 1 + 4 * np.tan(np.pi / 6)])
