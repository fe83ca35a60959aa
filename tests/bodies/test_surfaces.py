"""Outlines and triangles of parts against areas, volumes and distances."""

import numpy as np
import pytest
from hulls import distance

from polycorner.bodies import capsule, disc, mass_of, polygon, polytope, sphere
from polycorner.bodies.surfaces import flat, outline, surface

CORNERS = [[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-2, 1)]
SOLIDS = {
    "ball": sphere(0.7, [1, 0, 0]),
    "capsule": capsule([-1, 0, 0.5], [1, 0.3, 0], 0.4),
    "sharp": polytope(CORNERS),
    "rounded": polytope(CORNERS, 0.3),
}
FLAT = [disc(0.7), capsule([0, 0], [1, 1], 0.3), polygon([[0, 0], [2, 0], [0, 1]])]


def sides(part):
    vertices, faces, normals = surface(part)
    return vertices[faces], normals[faces]


@pytest.mark.parametrize("name", SOLIDS)
def test_triangles_enclose_the_volume_and_look_outwards(name):
    (part,) = SOLIDS[name].parts.values()
    corners, normals = sides(part)
    # The divergence theorem, with a sign for each triangle.
    volume = np.einsum("fi,fi->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
    exact = mass_of(SOLIDS[name], 1.0).mass
    assert 0.97 * exact < volume <= exact * (1 + 1e-9)
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (np.einsum("fi,fki->fk", across, normals) > 0).all()


@pytest.mark.parametrize("name", SOLIDS)
def test_normals_lead_back_to_the_hull(name):
    (part,) = SOLIDS[name].parts.values()
    vertices, _, normals = surface(part)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1)
    for vertex, normal in zip(vertices[::7], normals[::7], strict=True):
        assert distance(vertex[None], part.points) == pytest.approx(part.radius, rel=0.01)
        inner = vertex - part.radius * normal
        apart = np.linalg.norm(part.points - inner, axis=1).min()
        assert apart == pytest.approx(0, abs=1e-9) or not part.radius


@pytest.mark.parametrize("body", FLAT)
def test_a_flat_part_has_its_area(body):
    (part,) = body.parts.values()
    vertices, faces, _ = flat(part)
    corners = vertices[faces][..., :2]
    one, two = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    areas = (one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]) / 2
    assert (areas > 0).all()
    assert areas.sum() == pytest.approx(mass_of(body, 1.0).mass, rel=0.01)


def test_a_wider_outline_is_that_much_further_out():
    (part,) = polygon([[0, 0], [2, 0], [0, 1]]).parts.values()
    gaps = [distance(p[None], part.points) for p in outline(part, 0.1)]
    np.testing.assert_allclose(gaps, 0.1, rtol=0.01)
