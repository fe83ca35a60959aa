"""Meshes are closed, as large as they should be, and have the right number of holes."""

import math
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from oracles import observed_order
from scipy.interpolate import RegularGridInterpolator

from polycorner.pictures.solids.meshes import components_of_complement, isosurface, write_mesh

TAU = math.tau
EVERYWHERE = [(-1.31, 1.37), (-1.29, 1.33), (-1.36, 1.32)]
WHOLE_TURNS = [(0.1, 0.1 + TAU), (0.2, 0.2 + TAU), (-0.3, -0.3 + TAU)]


def ball(p):
    return np.linalg.norm(p, axis=-1) - 1


def shell(p):
    return abs(np.linalg.norm(p, axis=-1) - 0.8) - 0.2


def ring(p):
    return np.hypot(np.hypot(p[:, 0], p[:, 1]) - 0.8, p[:, 2]) - 0.3


def wavy_rod(p):
    return np.hypot(p[:, 0], p[:, 1]) - 1 + 0.2 * np.cos(p[:, 2])  # not exactly 2 pi periodic


def layer(p):
    return abs(p[:, 2] - 0.3 * np.sin(p[:, 0]) * np.cos(p[:, 1])) - 0.5


def schwarz(p):
    return np.cos(p).sum(axis=-1)


def gyroid(p):
    return (np.sin(p) * np.cos(np.roll(p, 1, axis=-1))).sum(axis=-1)


def grown(mesh):
    """Return the volume enclosed by a mesh from its faces, by the divergence theorem."""
    a, b, c = np.moveaxis(np.asarray(mesh.vertices)[np.asarray(mesh.faces)], 1, 0)
    return float((a * np.cross(b, c)).sum() / 6)


def assert_sound(surface):
    mesh = surface.mesh
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert surface.volume == pytest.approx(grown(mesh))
    assert surface.volume > 0
    sides = np.linalg.norm(np.diff(mesh.triangles[:, [0, 1, 2, 0]], axis=1), axis=-1)
    assert sides.min() > 1e-4 * surface.spacing.min()
    assert mesh.area_faces.min() > 0
    assert len(np.unique(mesh.faces)) == len(mesh.vertices)
    places = (mesh.vertices - surface.bounds[:, 0]) / surface.spacing
    on_nodes = (abs(places - np.round(places)) < 1e-6).all(axis=1)
    assert not on_nodes[mesh.faces[~surface.caps]].any()


def mesh_end(surface, place):
    """Return the vertices at one end of the last axis, in order."""
    vertices = np.asarray(surface.mesh.vertices)
    end = vertices[vertices[:, 2] == place, :2]
    return end[np.lexsort(end.T)]


# --------------------------------------------------------------------- surfaces inside the box


@pytest.mark.parametrize(
    ("function", "volume", "area", "euler", "pieces"),
    [
        (ball, 4 * np.pi / 3, 4 * np.pi, 2, 1),
        (shell, 4 * np.pi / 3 * (1 - 0.6**3), 4 * np.pi * (1 + 0.6**2), 4, 2),
        (ring, 2 * np.pi**2 * 0.8 * 0.3**2, 4 * np.pi**2 * 0.8 * 0.3, 0, 1),
    ],
)
def test_known_solids_to_second_order(function, volume, area, euler, pieces):
    cells = (16, 24, 36, 54)
    surfaces = [isosurface(function, EVERYWHERE, n) for n in cells]
    for surface in surfaces:
        assert_sound(surface)
        assert surface.euler_characteristic == surface.mesh.euler_number == euler
        assert components_of_complement(surface) == pieces
        assert not surface.caps.any()
    steps = 1 / np.array(cells)
    volumes = [abs(surface.volume - volume) for surface in surfaces]
    areas = [abs(surface.area - area) for surface in surfaces]
    assert observed_order(volumes, steps, 1e-12) == pytest.approx(2, abs=0.15)
    assert observed_order(areas, steps, 1e-12) == pytest.approx(2, abs=0.15)


def test_vertices_lie_on_the_surface_and_normals_point_out_of_it():
    surface = isosurface(ring, EVERYWHERE, 24)
    # Up to the thousandth of an edge that vertices keep from the grid's nodes.
    assert abs(ring(surface.mesh.vertices)).max() < 1e-3 * surface.spacing.max()
    middles, normals = surface.mesh.triangles_center, surface.mesh.face_normals
    slope = ring(middles + 1e-6 * normals) - ring(middles - 1e-6 * normals)
    assert (slope > 0).all()


def test_sharp_edges_keep_the_order():
    """A cube askew, the least of smooth functions: volume still second order, on average.

    Where edges fall between grid lines is chance, so errors are compared over random shifts.
    """
    rng = np.random.default_rng(5)
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    cells, errors = (10, 15, 22, 33), []
    for n in cells:
        shifts = rng.uniform(-0.5, 0.5, (12, 3)) * 2.6 / n

        def cube(p, shift):
            return abs((p - shift) @ axes).max(axis=-1) - 0.6

        volumes = [isosurface(lambda p, s=s: cube(p, s), EVERYWHERE, n).volume for s in shifts]
        errors.append(math.sqrt(np.mean((np.array(volumes) - 1.2**3) ** 2)))
    slope = np.polyfit(np.log(cells), np.log(errors), 1)[0]
    assert slope == pytest.approx(-2, abs=0.3)


# ---------------------------------------------------------------------------------- periodic axes


def test_a_rod_through_the_seam_is_a_torus_and_its_chart_a_ball():
    """Volume of a solid of revolution; caps are discs of the radius at the seam."""
    start = 0.4
    bounds = [*EVERYWHERE[:2], (start, start + TAU)]
    cells, volumes = (16, 32, 64), []
    for n in cells:
        surface = isosurface(wavy_rod, bounds, n, (False, False, True))
        assert_sound(surface)
        assert surface.euler_characteristic == 0
        assert surface.mesh.euler_number == 2
        assert components_of_complement(surface) == 1
        caps = surface.mesh.triangles[surface.caps]
        assert set(np.unique(caps[..., 2])) == {start, start + TAU}
        rims = [mesh_end(surface, place) for place in (start, start + TAU)]
        np.testing.assert_array_equal(*rims)
        ends = surface.mesh.area_faces[surface.caps].sum()
        assert ends == pytest.approx(2 * np.pi * (1 - 0.2 * np.cos(start)) ** 2, rel=10 / n**2)
        assert surface.area == pytest.approx(surface.mesh.area - ends)
        volumes.append(abs(surface.volume - np.pi * TAU * (1 + 0.2**2 / 2)))
    assert observed_order(volumes, 1 / np.array(cells), 1e-12) == pytest.approx(2, abs=0.15)


def test_a_layer_across_two_seams_has_two_tori_and_two_sides():
    bounds = [*WHOLE_TURNS[:2], (-1.5, 1.6)]
    surface = isosurface(layer, bounds, (20, 17, 15), (True, True, False))
    assert_sound(surface)
    assert surface.euler_characteristic == 0
    assert surface.mesh.euler_number == 2
    assert components_of_complement(surface) == 2
    assert surface.volume == pytest.approx(TAU**2, rel=2e-3)


@pytest.mark.parametrize(("function", "euler"), [(schwarz, -4), (gyroid, -8)])
@pytest.mark.parametrize("cells", [12, 17, (14, 20, 11)])
def test_triply_periodic_surfaces_have_their_genus(function, euler, cells):
    """A surface in a torus has twice the Euler characteristic of the region on either side.

    One side of the first shrinks to the edges of a cubic lattice (1 vertex, 3 edges per cell),
    of the second to a net with three edges at each of 8 vertices.  Both halve the cell.
    """
    surface = isosurface(function, WHOLE_TURNS, cells, (True, True, True))
    assert_sound(surface)
    assert surface.euler_characteristic == euler
    assert components_of_complement(surface) == 1
    assert surface.volume == pytest.approx(TAU**3 / 2, rel=2e-3)


@given(
    st.integers(0, 2**32 - 1),
    st.tuples(st.booleans(), st.booleans(), st.booleans()),
    st.sampled_from([(-1.0, 1.0), (-2.0, -1.0, 0.0, 1.0, 2.0), None]),
)
def test_any_values_give_a_closed_surface(seed, periodic, levels):
    """Noise has every ambiguous cell there is; few levels, every tie."""
    rng, n = np.random.default_rng(seed), 6
    shape = (n + 1,) * 3
    values = rng.normal(size=shape) if levels is None else rng.choice(levels, size=shape)
    for axis, wraps in enumerate(periodic):
        along = np.moveaxis(values, axis, 0)
        if not wraps:
            along[0] = along[-1] = 1.0
    for axis, wraps in enumerate(periodic):
        along = np.moveaxis(values, axis, 0)
        if wraps:
            along[-1] = along[0]
    between = RegularGridInterpolator([np.arange(n + 1.0)] * 3, values)
    surface = isosurface(between, [(0, n)] * 3, n, periodic)
    assert_sound(surface)
    assert surface.euler_characteristic % 2 == 0
    if not any(periodic):
        assert surface.euler_characteristic == surface.mesh.euler_number
    assert (surface.inside == (values < 0)).all()


# ------------------------------------------------------------------------------- the complement


def flooded(outside, periodic):
    """Return the number of pieces by filling one after the other."""
    left, pieces = {tuple(i) for i in np.argwhere(outside).tolist()}, 0
    while left:
        pieces += 1
        front = [left.pop()]
        while front:
            here = front.pop()
            for axis in range(3):
                for step in (-1, 1):
                    there = list(here)
                    there[axis] += step
                    if periodic[axis]:
                        there[axis] %= outside.shape[axis]
                    if tuple(there) in left:
                        left.remove(tuple(there))
                        front.append(tuple(there))
    return pieces


@given(
    st.integers(0, 2**32 - 1),
    st.floats(0.1, 0.9),
    st.tuples(st.booleans(), st.booleans(), st.booleans()),
)
def test_pieces_of_the_complement_are_those_a_flood_finds(seed, share, periodic):
    inside = np.random.default_rng(seed).random((4, 5, 6)) < share
    closed = np.pad(inside, [(0, int(wraps)) for wraps in periodic], mode="wrap")
    surface = replace(isosurface(ball, EVERYWHERE, 8), inside=closed, periodic=periodic)
    assert components_of_complement(surface) == flooded(~inside, periodic)


# ----------------------------------------------------------------------------------- wrong uses


def test_values_are_asked_for_in_slabs(monkeypatch):
    """No call sees more points than a slab holds, and slabs make no difference."""
    whole = isosurface(ball, EVERYWHERE, 20)
    monkeypatch.setattr("polycorner.pictures.solids.grids.SLAB", 1000)
    sizes = []

    def counted(p):
        sizes.append(len(p))
        return ball(p)

    surface = isosurface(counted, EVERYWHERE, 20)
    assert max(sizes[:10]) <= 1000
    assert (surface.inside == whole.inside).all()
    assert surface.volume == whole.volume


# ---------------------------------------------------------------------------------------- files


def test_a_scene_comes_back_from_a_glb(tmp_path):
    mesh = isosurface(ring, EVERYWHERE, 20).mesh
    angle = np.linspace(0, TAU, 50)
    circle = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    broken = circle.copy()
    broken[[20, 30]] = np.nan
    curves = [("whole", circle), ("broken", broken), ("nothing", broken[[20]])]
    path = tmp_path / "new" / "ring.glb"
    points = [(0, 0, 1), (0, 1, 0)]
    facts = {"volume": 1.5, "closed": True}
    options = {"curves": curves, "points": points, "scale": (1, 1, 2), "facts": facts}
    assert write_mesh(mesh, path, **options) == path
    scene = trimesh.load_scene(path)
    assert {key: scene.metadata[key] for key in facts} == facts
    assert set(scene.geometry) == {
        "solid",
        "whole 1",
        *(f"broken {k}" for k in (1, 2, 3)),
        "points",
    }
    assert scene.geometry["solid"].volume == pytest.approx(2 * mesh.volume, rel=1e-5)
    assert len(scene.geometry["solid"].faces) == len(mesh.faces)
    chord = 2 * math.sin(TAU / 49 / 2)
    names = ("whole 1", "broken 1", "broken 2", "broken 3")
    lengths = [scene.geometry[name].length / chord for name in names]
    np.testing.assert_allclose(lengths, [49, 19, 8, 18], rtol=1e-5)
    np.testing.assert_allclose(scene.geometry["points"].vertices, [(0, 0, 2), (0, 1, 0)])


def test_a_mesh_comes_back_from_a_ply(tmp_path):
    mesh = isosurface(ball, EVERYWHERE, 12).mesh
    found = trimesh.load_mesh(write_mesh(mesh, tmp_path / "ball.ply"))
    assert found.volume == pytest.approx(mesh.volume, rel=1e-6)
    assert found.is_watertight
