"""The solid of forbidden placements has the volume and shape that follow from the definition."""

import math

import numpy as np
import oracles
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import qmc
from strategies import pairs

from examples import ex05_solid
from polycorner.models import DumbbellPair
from polycorner.pictures.meshes import components_of_complement, isosurface
from polycorner.pictures.solids import (
    forbidden_solid,
    relative_gap,
    relative_placements,
)

TAU = math.tau
PAIR = DumbbellPair(16, 3, 1.5)
few = settings(max_examples=max(5, settings.default.max_examples // 5), deadline=None)

# ------------------------------------------------------------------------------- volume by slices


def slice_area(pair, heading, lines):
    """Return the area forbidden at one relative heading, from the lengths of parallel lines.

    A rod meets the other one where B lies in the parallelogram of their half axes; balls on rods
    widen its sides to rectangles, balls on balls put discs on its corners.  Each line meets each
    of these convex pieces in an interval.
    """
    r, p = pair.ball_radius, pair.ball_radius + pair.rod_radius
    a = pair.length / 2 * np.array([0.0, 1.0])
    b = pair.length / 2 * np.array([math.sin(heading), math.cos(heading)])
    corners = np.array([a + b, a - b, -a - b, b - a])
    pieces = [corners]
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        across = p / pair.length * np.array([start[1] - end[1], end[0] - start[0]])
        pieces.append(np.array([start + across, end + across, end - across, start - across]))
    reach = corners[:, 0].max() + 2 * r
    x = (2 * (np.arange(lines) + 0.5) / lines - 1) * reach
    low, high = [], []
    for centre in corners:
        half = np.sqrt(np.maximum(4 * r * r - (x - centre[0]) ** 2, 0))
        low.append(centre[1] - half)
        high.append(centre[1] + half)
    for polygon in pieces:
        least, most = np.full(lines, np.inf), np.full(lines, -np.inf)
        for start, end in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
            if start[0] != end[0]:
                t = (x - start[0]) / (end[0] - start[0])
                y = np.where((t >= 0) & (t <= 1), start[1] + t * (end[1] - start[1]), np.nan)
                least, most = np.fmin(least, y), np.fmax(most, y)
        empty = least > most
        low.append(np.where(empty, 0, least))
        high.append(np.where(empty, 0, most))
    low, high = np.array(low), np.array(high)
    order = np.argsort(low, axis=0)
    low, high = np.take_along_axis(low, order, 0), np.take_along_axis(high, order, 0)
    covered = np.vstack([np.full(lines, -np.inf), np.maximum.accumulate(high, axis=0)[:-1]])
    return float(np.maximum(high - np.maximum(low, covered), 0).sum() * 2 * reach / lines)


def sliced_volume(pair, lines=4000, nodes=48):
    """Return the forbidden volume over a whole turn; four quarters are congruent."""
    places, weights = np.polynomial.legendre.leggauss(nodes)
    areas = [slice_area(pair, (z + 1) * math.pi / 4, lines) for z in places]
    return math.pi * float(weights @ np.array(areas))


def sampled_volume(pair, bounds, mean_heading, power, repeats, seed):
    """Return the forbidden volume and its standard error from scrambled points.

    Distances are those of the definition; B lies at ``+`` and A at ``-`` half the placement.
    """
    low, high = np.array(bounds).T
    rng, found = np.random.default_rng(seed), []
    turn = 1 if pair.is_plane else 1 / (pair.drum_radius - pair.ball_radius)
    for _ in range(repeats):
        points = low + (high - low) * qmc.Sobol(3, rng=rng).random_base2(power)
        half = points / 2 * np.array([turn, 1.0, 1.0])
        q = np.hstack([-half, half])
        q[:, [2, 5]] += mean_heading
        inside = (oracles.gaps(pair, q) < 0).any(axis=1)
        found.append(inside.mean() * (high - low).prod())
    return float(np.mean(found)), float(np.std(found, ddof=1) / math.sqrt(repeats))


def test_the_two_independent_volumes_agree():
    """Slices rest on an argument about shapes, samples on distances alone."""
    bounds = [(-22.5, 22.5), (-22.5, 22.5), (0, TAU)]
    value, error = sampled_volume(PAIR, bounds, 0.0, 11, 12, 1)
    assert error < 3e-3 * value
    assert abs(sliced_volume(PAIR) - value) < 4 * error


def test_volume_converges_to_the_sliced_one_to_second_order():
    """Root mean square over random shifts of the grid, against which edges fall by chance."""
    exact = sliced_volume(PAIR)
    rng, gap = np.random.default_rng(2), relative_gap(PAIR)
    cells, errors = (14, 20, 28, 40), []
    for n in cells:
        found = []
        for shift in rng.random((6, 3)):
            step = 44.4 / (n - 1)
            x, y = (-22.2 - step * shift[:2]).tolist()
            box = ((x, x + n * step), (y, y + n * step), (shift[2], shift[2] + TAU))
            found.append(isosurface(gap, box, n, (False, False, True)).volume)
        errors.append(math.sqrt(np.mean((np.array(found) / exact - 1) ** 2)))
    slope = np.polyfit(np.log(cells), np.log(errors), 1)[0]
    assert slope == pytest.approx(-2, abs=0.3)
    assert errors[-1] < 3e-3


def test_volume_of_a_section_in_a_narrow_drum():
    pair = DumbbellPair(16, 3, 1.5, 18)
    heading = 0.4
    solid = forbidden_solid(pair, 40, mean_heading=heading)
    value, error = sampled_volume(pair, solid.bounds, heading, 11, 8, 3)
    fine = forbidden_solid(pair, 80, mean_heading=heading)
    assert fine.mesh.is_watertight
    # Second order: what is left on the finer grid is a third of what refining changed.
    left = abs(fine.volume - solid.volume) / 3
    assert left < 2e-3 * value
    assert abs(fine.volume - value) < 4 * error + 2 * left


def test_sections_tend_to_the_plane_with_the_square_of_the_curvature():
    radii = np.array([100.0, 200.0, 400.0])
    plane = forbidden_solid(PAIR, 32, mean_heading=0.3)
    differences = [
        forbidden_solid(DumbbellPair(16, 3, 1.5, float(R)), 32, mean_heading=0.3).volume
        - plane.volume
        for R in radii
    ]
    assert min(differences) > 0
    order = oracles.observed_order(differences, 1 / (radii - PAIR.ball_radius), 1e-9)
    assert order == pytest.approx(2, abs=0.1)


# ------------------------------------------------------------------------------- shape and topology


@few
@given(pairs(plane=True))
def test_in_the_plane_the_solid_is_a_ring_and_what_is_allowed_is_connected(pair):
    """Moving B away from the parallelogram it is nearest to never shortens a distance to it."""
    solid = forbidden_solid(pair, 32)
    assert solid.mesh.is_watertight
    assert solid.mesh.is_winding_consistent
    assert solid.mesh.area_faces.min() > 0
    assert solid.euler_characteristic == 0
    assert solid.mesh.euler_number == 2
    assert components_of_complement(solid) == 1
    assert solid.volume == pytest.approx(sliced_volume(pair, 400, 16), rel=0.03)


@few
@given(pairs(plane=False), st.floats(-3, 3))
def test_sections_in_any_drum_are_closed(pair, heading):
    """No dumbbells touch beyond the reach assumed: the region never meets the box."""
    solid = forbidden_solid(pair, 20, mean_heading=heading)
    assert solid.mesh.is_watertight
    assert solid.mesh.is_winding_consistent
    assert solid.periodic[1:] == (False, True)
    side = math.pi * pair.centre_radius
    assert solid.bounds[0, 1] == pytest.approx(side) if solid.periodic[0] else True
    assert solid.bounds[0, 1] < side * (1 + 1e-12)


def test_half_a_turn_is_half_of_a_whole_one():
    """The same grid, cut in two: exchanging the balls of B adds half a turn."""
    whole, half = forbidden_solid(PAIR, 24), forbidden_solid(PAIR, 24, period=math.pi)
    assert half.inside.shape == (25, 25, 13)
    assert half.volume == pytest.approx(whole.volume / 2, rel=1e-9)
    assert half.area == pytest.approx(whole.area / 2, rel=1e-9)
    assert half.euler_characteristic == 0
    moved = forbidden_solid(PAIR, 24, period=math.pi, start=-math.pi / 3)
    assert moved.bounds[2].tolist() == pytest.approx([-math.pi / 3, 2 * math.pi / 3])
    assert moved.volume == pytest.approx(half.volume, rel=1e-9)


def test_caps_are_the_slice_at_the_cut():
    solid = forbidden_solid(PAIR, (60, 60, 8), start=0.7)
    caps = solid.mesh.area_faces[solid.caps].sum() / 2
    assert caps == pytest.approx(slice_area(PAIR, 0.7, 4000), rel=2e-3)


def test_edges_and_corners_lie_on_the_mesh():
    """Known edges are on the true surface: the mesh around them is no further than a cell."""
    solid = forbidden_solid(PAIR, 48, period=math.pi)
    lever = np.array([1.0, 1.0, PAIR.length / 2])
    vertices = solid.mesh.vertices * lever
    cell = np.linalg.norm(solid.spacing * lever)
    corners, _ = ex05_solid.corners()
    points = np.concatenate([corners, *(points[::9] for _, points in ex05_solid.edges())])
    for point in points:
        assert np.linalg.norm(vertices - point * lever, axis=1).min() < cell


# ------------------------------------------------------------------------------------- placements


@pytest.mark.parametrize("drum", [math.inf, 60.0])
def test_relative_placements_are_differences(drum):
    pair = DumbbellPair(16, 3, 1.5, drum)
    points = np.random.default_rng(4).uniform(-3, 3, (5, 2, 3))
    q = relative_placements(pair, points, mean_heading=0.7)
    assert q.shape == (5, 2, 6)
    unit = 1.0 if pair.is_plane else pair.drum_radius - pair.ball_radius
    np.testing.assert_allclose((q[..., 3:] - q[..., :3]) * [unit, 1, 1], points)
    np.testing.assert_allclose(
        (q[..., 3:] + q[..., :3]) / 2, np.broadcast_to([0, 0, 0.7], points.shape), atol=1e-15
    )
    least = oracles.gaps(pair, q).min(axis=-1)
    np.testing.assert_allclose(relative_gap(pair, mean_heading=0.7)(points), least, atol=1e-9)


def test_in_the_plane_the_first_dumbbell_is_the_frame():
    points = np.random.default_rng(5).uniform(-20, 20, (50, 3))
    q = relative_placements(PAIR, points)
    assert not q[:, :3].any()
    np.testing.assert_array_equal(q[:, 3:], points)


@pytest.mark.parametrize(
    ("drum", "options", "message"),
    [
        (math.inf, {"period": 3.0}, "period: expected pi or 2 pi; got 3"),
        (
            60.0,
            {"period": math.pi, "mean_heading": 0.0},
            "period: expected 2 pi at fixed mean heading",
        ),
        (60.0, {}, "mean_heading: expected an angle in radians for a pair in a drum; got None"),
    ],
)
def test_wrong_use_is_named(drum, options, message):
    with pytest.raises(ValueError, match=message):
        forbidden_solid(DumbbellPair(16, 3, 1.5, drum), 8, **options)


def test_the_example_gives_what_it_says():
    result = ex05_solid.main(resolution=40)
    assert result.volume == pytest.approx(sliced_volume(PAIR) / 2, rel=4e-3)
    assert (result.euler_characteristic, result.allowed_components) == (0, 1)
    assert result.edge_error < 1e-12
