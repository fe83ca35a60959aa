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
from polycorner.dumbbells import DumbbellPair
from polycorner.dumbbells.pictures.placements import (
    forbidden_solid,
    relative_gap,
    relative_gaps,
    relative_placements,
)
from polycorner.pictures.solids.meshes import components_of_complement, isosurface

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


@pytest.mark.parametrize(("rod", "drum"), [(1.5, 14), (0.3, 11.2)])
def test_volume_of_a_section_in_a_narrow_drum(rod, drum):
    """In the narrower one rods cross at different heights and meet on faces of their own."""
    pair = DumbbellPair(16, 3, rod, drum)
    heading = 0.4
    solid = forbidden_solid(pair, 40, mean_heading=heading)
    value, error = sampled_volume(pair, solid.bounds, heading, 13, 6, 3)
    assert solid.watertight
    assert solid.unresolved == 0
    assert error < 3e-3 * value
    assert abs(solid.curved_volume - value) < 4 * error + 5e-4 * value
    assert ("ab" in faces_of(pair, solid)) == (drum < 12)


def faces_of(pair, solid):
    """Return the contacts that have faces."""
    return {pair.polyhedron.names[label] for label in np.unique(solid.labels[solid.labels >= 0])}


def test_the_solid_is_sharp():
    """Volume, edges and corners against closed forms; gaps as they are defined."""
    exact = sliced_volume(PAIR, 16000, 64) / 2
    corners, _ = ex05_solid.corners()
    cells, surface, edge = (20, 28, 40, 56), [], []
    lever = np.array([1.0, 1.0, PAIR.length / 2])
    for n in cells:
        solid = forbidden_solid(PAIR, n, period=math.pi)
        assert solid.watertight
        assert solid.unresolved == 0
        assert solid.corner_error(corners, lever) < 1e-9
        assert len(solid.corners) == len(corners)
        surface.append(solid.surface_error)
        edge.append(solid.edge_error)
    assert -np.polyfit(np.log(cells), np.log(surface), 1)[0] == pytest.approx(2, abs=0.4)
    # Where the grid cuts the edges is chance, so that few grids tell the order roughly.
    assert -np.polyfit(np.log(cells), np.log(edge), 1)[0] > 1.4
    assert solid.curved_volume == pytest.approx(exact, rel=2e-5)
    assert solid.volume == pytest.approx(exact, rel=4e-3)
    ends = np.asarray(solid.mesh.vertices)[np.unique(solid.creases)]
    gaps = np.sort(oracles.gaps(PAIR, relative_placements(PAIR, ends)), axis=-1)
    assert abs(gaps[:, :2]).max() < 1e-8
    # Every point of a known edge is near one that the mesh has: a vertex, or between two.
    middles = np.asarray(solid.mesh.vertices)[solid.creases].mean(axis=1)
    known = np.concatenate([points for _, points in ex05_solid.edges(721)])
    found = np.concatenate([ends, middles]) * lever
    away = np.linalg.norm(known[:, None] * lever - found, axis=-1).min(axis=1)
    assert away.max() < np.linalg.norm(solid.spacing * lever)


def test_faces_are_those_of_the_atlas():
    """In the plane rods never meet first, and short ones are never touched."""
    contacts = faces_of(PAIR, forbidden_solid(PAIR, 24))
    assert contacts == set(PAIR.polyhedron.names) - {"ab"}
    short = DumbbellPair(7, 3, 1.5)
    assert faces_of(short, forbidden_solid(short, 24)) == set(PAIR.polyhedron.names[:4])


def test_gradients_are_those_of_the_gaps():
    rng = np.random.default_rng(8)
    for pair, heading in ((PAIR, None), (PAIR, 0.4), (DumbbellPair(16, 3, 1.5, 25), 0.4)):
        gaps = relative_gaps(pair, mean_heading=heading)
        points = rng.uniform(-1, 1, (40, 3)) * np.array([20, 20, 3])
        values, slopes = gaps(points, 1)
        step, way = 1e-6, rng.normal(size=(40, 3))
        change = (gaps(points + step * way, 0)[0] - gaps(points - step * way, 0)[0]) / (2 * step)
        smooth = abs(change - np.einsum("nmk,nk->nm", slopes, way)) < 1e-4
        assert smooth.mean() > 0.99  # but where a crossing ends between the two points
        least = relative_gap(pair, mean_heading=heading)(points)
        np.testing.assert_allclose(values.min(axis=1), least, atol=1e-12)


def test_sections_tend_to_the_plane_with_the_square_of_the_curvature():
    radii = np.array([100.0, 200.0, 400.0])

    def volume(pair):
        return forbidden_solid(pair, 32, mean_heading=0.3).curved_volume

    differences = [volume(DumbbellPair(16, 3, 1.5, float(R))) - volume(PAIR) for R in radii]
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
    np.testing.assert_array_equal(half.inside[..., :12], whole.inside[..., 6:18])
    assert half.curved_volume == pytest.approx(whole.curved_volume / 2, rel=1e-4)
    assert half.area == pytest.approx(whole.area / 2, rel=1e-3)
    assert half.euler_characteristic == 0


@pytest.mark.parametrize("start", [-math.pi / 3, 0.0])
def test_the_seam_may_lie_anywhere(start):
    """Also where it runs along edges and through corners."""
    half = forbidden_solid(PAIR, 32, period=math.pi)
    moved = forbidden_solid(PAIR, 32, period=math.pi, start=start)
    assert moved.bounds[2].tolist() == pytest.approx([start, start + math.pi])
    assert moved.watertight
    assert moved.unresolved == 0
    assert moved.curved_volume == pytest.approx(half.curved_volume, rel=2e-4)
    corners, _ = ex05_solid.corners()
    assert moved.corner_error(corners, (1.0, 1.0, PAIR.length / 2)) < 1e-9
    vertices = np.asarray(moved.mesh.vertices)[moved.active.any(axis=1)]
    low, high = (vertices[vertices[:, 2] == z][:, :2] for z in moved.bounds[2])
    assert len(low) == len(high) > 20
    assert np.linalg.norm(low[:, None] - high, axis=-1).min(axis=1).max() < 1e-9


def test_caps_are_the_slice_at_the_cut():
    solid = forbidden_solid(PAIR, (60, 60, 8), start=0.7)
    caps = solid.mesh.area_faces[solid.caps].sum() / 2
    assert caps == pytest.approx(slice_area(PAIR, 0.7, 4000), rel=2e-3)


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


def test_the_example_gives_what_it_says():
    result = ex05_solid.main(resolution=40)
    assert result.volume == pytest.approx(sliced_volume(PAIR) / 2, rel=5e-5)
    assert (result.euler_characteristic, result.allowed_components) == (0, 1)
    assert result.edge_error < 1e-12
    assert result.corner_error < 1e-9
