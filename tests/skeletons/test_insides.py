"""Corners inside faces, to which no edge leads, from the definition."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polycorner import Manifold, Polyhedron, Symmetry, skeleton
from polycorner.models import SphereCluster
from polycorner.polyhedra.faces import projected
from polycorner.polyhedra.quotients import Quotient
from polycorner.polyhedra.symmetry import Element
from polycorner.skeletons import Completeness, examine_faces
from polycorner.skeletons.insides import Start, touching_points
from polycorner.tolerances import DEFAULT

SPACE = Manifold.euclidean("x y z")
x, y, z = SPACE.symbols
WALLS = {"floor": z, "lid": 1 / 4 - z, "front": 1 + y, "back": 1 - y}
few = settings(max_examples=settings.default.max_examples // 8)


def across(D, at=(-1.0, -1.0, 0.0)):
    """Return what a walk along the diagonal of the floor finds."""
    start = Start(np.array(at), np.array([1.0, 1.0, 0.0]) / np.sqrt(2), (0,))
    return list(touching_points(Quotient(D, Symmetry(), DEFAULT, 100.0).near([start.q]), [start]))


@given(st.floats(-0.6, 0.6), st.floats(-0.2, 0.2), st.floats(0.3, 2.0), st.floats(-0.5, 0.5))
@few
def test_a_bowl_that_touches_the_floor(along, aside, steep, mixed):
    """The floor is where ``z = 0``, and ``bowl = Q(x - a, y - b) - z`` with a definite form."""
    a, b = along - aside, along + aside
    form = steep * (x - a) ** 2 + (y - b) ** 2 + mixed * (x - a) * (y - b)
    sides = {"left": 1 + x, "right": 1 - x}
    ((walk, row, q),) = across(Polyhedron(SPACE, {**WALLS, **sides, "bowl": form - z}))
    assert (walk, row) == (0, 6)
    assert q == pytest.approx([a, b, 0], abs=1e-7)
    for height in (1e-3, -1e-3):
        assert not across(Polyhedron(SPACE, {**WALLS, **sides, "bowl": form + height - z}))


def mirrored(q):
    return q * np.array([-1.0, 1.0, 1.0])


def test_modulo_relabellings_one_corner_of_two_inside_a_face():
    """Two bowls that a mirror exchanges; the mirror exchanges the names of two walls as well.

    From a corner the search does not descend across faces.
    """
    bowls = (x**2 - 1 / 4) ** 2 + (y - 1 / 5) ** 2 - z
    D = Polyhedron(SPACE, {**WALLS, "left": 1 + x, "right": 1 - x, "bowls": bowls})
    mirror = Element(mirrored, {"left": "right", "right": "left"})
    box = skeleton(D, [(1.0, 1.0, 0.0)], symmetry=Symmetry(elements=[mirror]))
    assert (len(box.corners), box.complete) == (4, Completeness.EXHAUSTED)
    found = examine_faces(box)
    assert (len(found.corners), found.complete) == (5, Completeness.EXHAUSTED)
    corner = found.corners[-1]
    assert (corner.active, corner.singular, corner.edges) == (("floor", "bowls"), True, ())
    assert abs(corner.point) == pytest.approx([1 / 2, 1 / 5, 0], abs=1e-9)
    with ThreadPoolExecutor(1) as pool:
        assert len(examine_faces(found, executor=pool).corners) == 5


def test_no_face_of_seven_spheres_has_a_corner_inside():
    """All five clusters are known, and edges lead to all of them."""
    seven = SphereCluster(7)
    found = skeleton(seven.polyhedron, seven.starts(), symmetry=seven.symmetry)
    counted = []
    again = examine_faces(found, progress=lambda done, every, _: counted.append((done, every)))
    sizes = [(len(a.corners), len(a.edges), len(a.faces)) for a in (found, again)]
    assert sizes[0] == sizes[1] == (5, 16, 51)
    assert counted == [(51, 51)]


def packed_without_two():
    """Return a sphere and ten of the twelve around it in a hexagonal close packing."""
    ring = [(np.cos(a), np.sin(a), 0.0) for a in np.arange(6) * np.pi / 3]
    hollows = np.pi / 6 + np.arange(3) * 2 * np.pi / 3
    above = [(np.cos(a) / np.sqrt(3), np.sin(a) / np.sqrt(3), np.sqrt(2 / 3)) for a in hollows]
    below = [(u, v, -w) for u, v, w in above]
    return np.array([(0.0, 0.0, 0.0), *ring[1:3], *ring[4:], *above, *below])


def test_a_cluster_of_eleven_spheres_inside_faces_only():
    """All but two of its 26 contacts carry a stress, which is definite on both flexes.

    Without a stressed contact, points of a face come back to the cluster.
    """
    eleven, q = SphereCluster(11), packed_without_two().ravel()
    quotient = Quotient(eleven.polyhedron, eleven.symmetry, DEFAULT, 100.0).near([q])
    point = quotient.at(q)
    active = sorted(point.active())
    gradients = point.gradients[active]
    assert (len(active), np.linalg.matrix_rank(gradients, 1e-9)) == (26, 25)
    stress = np.linalg.svd(gradients.T)[2][-1]
    flexes = np.linalg.svd(np.vstack([gradients, point.orbit]))[2][-2:]
    hessians = eleven.polyhedron.hessians(q)[active]
    form = flexes @ np.einsum("i,ijk->jk", stress, hessians) @ flexes.T
    assert np.linalg.det(form) > 0
    stress *= np.sign(np.trace(form))
    alone = skeleton(eleven.polyhedron, [q], symmetry=eleven.symmetry)
    assert (len(alone.corners), len(alone.edges)) == (1, 0)
    row = active[int(np.argmax(stress))]
    held = tuple(i for i in active if i != row)
    away = projected(quotient, q + 0.3 * flexes[0], held, 0.3)
    aside = away.tangent(q - away.q + 0.2 * flexes[1])
    ((_, touching, there),) = touching_points(quotient, [Start(away.q, aside, held)])
    assert touching == row
    assert eleven.distances(there) == pytest.approx(eleven.distances(q), abs=1e-7)


def test_only_a_finished_search_has_faces_to_examine():
    box = {**WALLS, "left": 1 + x, "right": 1 - x}
    part = skeleton(Polyhedron(SPACE, box), [(0.9, 0.9, 0.1)], budget=1)
    with pytest.raises(ValueError, match="skeleton: expected the result of a finished search"):
        examine_faces(part)


def test_the_face_of_a_plane_set_is_examined_too():
    """No function is held there, and nothing touches zero inside beside the isolated point."""
    plane = Manifold.euclidean("u v")
    u, v = plane.symbols
    triangle = {"left": u, "low": v, "slope": 1 - u - v}
    pit = (u - 0.2) ** 2 + (v - 0.3) ** 2
    for walls in (triangle, {**triangle, "hole": pit - 0.01}):
        atlas = skeleton(Polyhedron(plane, walls), [[0.05, 0.9]])
        examined = examine_faces(atlas)
        assert len(examined.corners) == len(atlas.corners) == 3
        assert examined.complete is Completeness.EXHAUSTED
