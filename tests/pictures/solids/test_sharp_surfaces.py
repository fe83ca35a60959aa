"""Surfaces made of smooth faces: closed, exact where faces are flat, second order where not."""

import math
from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from polycorner.pictures.solids.meshes import isosurface
from polycorner.pictures.solids.sharp_surfaces import sharp_surface

EVERYWHERE = [(-1.61, 1.67), (-1.59, 1.63), (-1.66, 1.62)]
AROUND = (True, True, True)


def planes(normals, offsets):
    """Return ``n_i . p - c_i`` with gradients."""
    rows, shifts = np.array(normals, dtype=float), np.array(offsets, dtype=float)

    def gaps(p, order):
        values = p @ rows.T - shifts
        return (values, np.broadcast_to(rows, (len(p), *rows.shape)))[: order + 1]

    return gaps


def balls(centres, radii):
    """Return distances to balls with gradients."""
    middle, radius = np.array(centres, dtype=float), np.array(radii, dtype=float)

    def gaps(p, order):
        apart = p[:, None] - middle
        away = np.linalg.norm(apart, axis=-1)
        return (away - radius, apart / np.maximum(away, 1e-300)[..., None])[: order + 1]

    return gaps


def rim(surface, axis, place):
    """Return the vertices of the surface at one end of an axis, in order."""
    vertices = np.asarray(surface.mesh.vertices)[surface.active.any(axis=1)]
    end = np.delete(vertices[abs(vertices[:, axis] - place) < 1e-9], axis, axis=1)
    return end[np.lexsort(np.round(end, 7).T)]


def assert_sharp(surface, gaps):
    """Every face lies on one function and looks away from where that is negative."""
    assert surface.watertight
    assert surface.unresolved == 0
    assert surface.mesh.volume > 0
    faces, labels = surface.mesh.faces[~surface.caps], surface.labels[~surface.caps]
    assert (surface.labels[surface.caps] == -1).all()
    assert surface.active[faces, labels[:, None]].all()
    vertices = np.asarray(surface.mesh.vertices)
    used = np.unique(faces)
    values, _ = gaps(vertices[used], 1)
    assert abs(values[surface.active[used]]).max() < 1e-9
    assert values.min() > -1e-6 * surface.spacing.max()
    _, slopes = gaps(vertices[faces].mean(axis=1), 1)
    normals = surface.mesh.face_normals[~surface.caps]
    outwards = (slopes[np.arange(len(faces)), labels] * normals).sum(axis=1)
    assert outwards.min() > 0


# ------------------------------------------------------------------------------------ flat faces


def test_the_outside_of_a_cube_is_exact():
    """Six planes in a torus, all three of whose seams are crossed."""
    side, half = np.array([2.9, 3.1, 3.3]), np.array([0.61, 0.72, 0.53])
    gaps = planes([*-np.eye(3), *np.eye(3)], [*-half, *-half])  # half - |x| in two halves
    surface = sharp_surface(gaps, [(-s / 2, s / 2) for s in side], (13, 17, 14), AROUND)
    assert_sharp(surface, gaps)
    cube = 8 * half.prod()
    assert surface.volume == pytest.approx(side.prod() - cube, rel=1e-12)
    assert surface.curved_volume == pytest.approx(surface.volume, rel=1e-12)
    assert surface.area == pytest.approx(8 * (half[[0, 1, 2]] * half[[1, 2, 0]]).sum(), rel=1e-12)
    assert surface.surface_error < 1e-12
    assert surface.edge_error < 1e-12
    corners = np.array(list(product(*([-h, h] for h in half))))
    assert surface.corner_error(corners) < 1e-12
    assert len(surface.corners) == 8
    ends = np.asarray(surface.mesh.vertices)[surface.creases]
    lengths = np.linalg.norm(np.diff(ends, axis=1), axis=-1)
    assert lengths.sum() == pytest.approx(8 * half.sum(), rel=1e-12)


def test_functions_may_change_roles_at_a_seam():
    """The same cube about a seam: each plane goes on as another one."""
    half = 0.6

    def gaps(p, order):
        wrapped = p - 3.0 * np.floor(p / 3.0 + 0.5)
        swap = (np.floor(p[:, 2] / 3.0 + 0.5) % 2).astype(int)
        rows = np.array([*-np.eye(3), *np.eye(3)])
        order_of = np.array([[0, 1, 2, 3, 4, 5], [3, 4, 5, 0, 1, 2]])[swap]
        values = np.take_along_axis(wrapped @ rows.T + half, order_of, axis=1)
        return (values, rows[order_of])[: order + 1]

    surface = sharp_surface(gaps, [(0.1, 3.1), (-1.4, 1.6), (-1.5, 1.5)], 14, AROUND)
    assert_sharp(surface, gaps)
    assert surface.volume == pytest.approx(27 - (2 * half) ** 3, rel=1e-12)
    corners = np.array(list(product([-half, half], repeat=3)))
    assert surface.corner_error(corners) < 1e-12
    for axis in range(3):
        ends = [rim(surface, axis, place) for place in surface.bounds[axis]]
        np.testing.assert_allclose(*ends, atol=1e-9)


# ---------------------------------------------------------------------------------- curved faces


def lens(apart):
    """Return the volume of what two unit balls share, the centres so far apart."""
    return math.pi * (4 + apart) * (2 - apart) ** 2 / 12


def test_two_balls_to_second_order_and_their_volume_to_a_higher_one():
    """The volume is closed; the circle in which they meet is known."""
    axis = np.array([2.0, 1.0, 2.0]) / 3
    gaps = balls([-0.4 * axis, 0.4 * axis], [1.0, 1.0])
    exact = 8 * math.pi / 3 - lens(0.8)
    cells = np.array([12, 17, 24, 34, 48])
    found = [sharp_surface(gaps, EVERYWHERE, int(n)) for n in cells]
    for surface in found:
        assert_sharp(surface, gaps)
        assert len(surface.corners) == 0
        circle = np.asarray(surface.mesh.vertices)[np.unique(surface.creases)]
        assert abs(circle @ axis).max() < 1e-9
        np.testing.assert_allclose(np.linalg.norm(circle, axis=1), math.sqrt(1 - 0.16), atol=1e-9)
        ends, counts = np.unique(surface.creases, return_counts=True)
        assert len(ends) > 10
        assert (counts == 2).all()

    def order(errors):
        return -np.polyfit(np.log(cells), np.log(errors), 1)[0]

    assert order([s.surface_error for s in found]) == pytest.approx(2, abs=0.35)
    assert order([s.edge_error for s in found]) == pytest.approx(2, abs=0.35)
    assert order([abs(s.volume / exact - 1) for s in found]) == pytest.approx(2, abs=0.35)
    assert order([abs(s.curved_volume / exact - 1) for s in found]) > 3


def test_creases_are_no_longer_cut_across():
    """What marching cubes alone leave at the crease, on the same grid."""
    gaps = balls([(-0.5, 0.02, 0), (0.5, 0, 0.03)], [1.0, 1.0])
    rough = isosurface(lambda p: gaps(p, 0)[0].min(axis=1), EVERYWHERE, 34).mesh
    missed = abs(gaps(rough.triangles_center, 0)[0].min(axis=1)).max()
    assert sharp_surface(gaps, EVERYWHERE, 34).surface_error < missed / 4


@pytest.mark.parametrize("count", [3, 4, 5, 6])
def test_any_number_of_faces_meets_in_one_vertex(count):
    """Balls about the vertices of a polygon: all meet in two points, their slopes of rank three."""
    angle = math.tau * (np.arange(count) + 0.31) / count
    centres = 0.54 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    gaps = balls(centres, np.full(count, 0.9))
    surface = sharp_surface(gaps, EVERYWHERE, 26)
    assert_sharp(surface, gaps)
    tips = np.array([(0, 0, -0.72), (0, 0, 0.72)])
    assert surface.corner_error(tips) < 1e-9
    assert len(surface.corners) == 2
    vertices = np.asarray(surface.mesh.vertices)
    for tip in tips:
        there = np.linalg.norm(vertices - tip, axis=1) < 1e-9
        assert there.sum() == 1
        assert surface.active[there].all()
    # Neighbours meet along circles, others in the tips alone.
    pairs = {tuple(np.flatnonzero(row)) for row in surface.active[surface.active.sum(axis=1) == 2]}
    neighbours = {(k, (k + 1) % count) for k in range(count)}
    assert pairs == {tuple(sorted(pair)) for pair in neighbours}


@given(st.integers(0, 2**32 - 1), st.integers(1, 5), st.integers(10, 22))
def test_any_balls_give_a_closed_surface_of_smooth_faces(seed, count, cells):
    rng = np.random.default_rng(seed)
    gaps = balls(rng.uniform(-0.8, 0.8, (count, 3)), rng.uniform(0.35, 0.7, count))
    rough = isosurface(lambda p: gaps(p, 0)[0].min(axis=1), EVERYWHERE, cells)
    surface = sharp_surface(gaps, EVERYWHERE, cells)
    assert surface.watertight
    assert surface.euler_characteristic == surface.mesh.euler_number == rough.mesh.euler_number
    assert surface.mesh.area_faces.min() > 0
    values, _ = gaps(np.asarray(surface.mesh.vertices), 1)
    assert abs(values.min(axis=1)).max() < 1e-6
    sides = np.linalg.norm(np.diff(surface.mesh.triangles[:, [0, 1, 2, 0]], axis=1), axis=-1)
    assert sides.max() < 4 * surface.spacing.max()


def test_the_surface_is_closed_whatever_the_slopes_are():
    """Slopes that are wrong, or none, spoil places but not the mesh."""
    true = balls([(-0.5, 0, 0), (0.5, 0, 0.1)], [0.9, 0.8])
    rng = np.random.default_rng(7)

    def wrong(p, order):
        values, slopes = true(p, 1)
        return (values, rng.normal(size=slopes.shape))[: order + 1]

    def none(p, order):
        values, slopes = true(p, 1)
        return (values, np.full_like(slopes, np.nan))[: order + 1]

    for gaps in (wrong, none):
        assert sharp_surface(gaps, EVERYWHERE, 10).watertight


def test_corners_are_looked_for_around_the_seam_and_in_given_units():
    gaps = balls([(0, 0, 0)], [1.0])
    surface = sharp_surface(gaps, EVERYWHERE, 12)
    vertex = np.asarray(surface.mesh.vertices)[3]
    assert surface.corner_error([]) == 0.0
    assert surface.corner_error([vertex]) == 0.0
    assert surface.corner_error([2 * vertex / np.linalg.norm(vertex)]) == pytest.approx(1, abs=0.1)
    # The farther of two, ten times as long along the last axis.
    high = np.array([0, 0, 2.0])
    assert surface.corner_error([vertex, high], (1, 1, 10)) == pytest.approx(10, rel=0.05)
