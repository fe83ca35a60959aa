"""Disks on a torus: distances, the polyhedron of placements, and its densest points."""

import math
from itertools import product

import numpy as np
import pytest
from disk_oracles import BASES, LATTICES, least_distance
from hypothesis import given
from hypothesis import strategies as st

from polycorner import minimise
from polycorner.models.disks.disks import TorusDisks


@st.composite
def placements(draw, reach=0.5):
    """Return a model and a point of it, coordinates up to ``reach`` and often on the cut."""
    model = TorusDisks(draw(st.integers(1, 5)), draw(st.sampled_from(LATTICES)))
    coordinate = st.floats(-reach, reach) | st.sampled_from([0.5, 0.4999999, -0.4999999, 0.0])
    centres = [draw(coordinate) for _ in range(2 * model.count)]
    return model, np.array([*centres, draw(st.floats(0, 0.5))])


@given(placements(reach=3.0))
def test_radius_is_half_the_least_distance_over_all_images(placed):
    model, q = placed
    assert model.radius(q) == pytest.approx(least_distance(q[:-1], model.lattice) / 2, abs=1e-12)


@given(placements(reach=0.6))
def test_polyhedron_is_where_no_disks_overlap(placed):
    """In the chart, and a little over its cut, the least function is what distances leave."""
    model, q = placed
    room = least_distance(q[:-1], model.lattice) - 2 * q[-1]
    assert model.polyhedron.implicit(q) == pytest.approx(room, abs=1e-12)


@pytest.mark.parametrize("lattice", LATTICES)
@pytest.mark.parametrize("image", list(product((-1, 0, 1), repeat=2)))
def test_every_image_can_be_the_nearest(lattice, image):
    """Two disks on opposite sides of the chart meet across its cut."""
    v = np.array(image)
    near = np.array([0.01, 0.02])
    q = np.concatenate([0.45 * v, -0.45 * v + near, [0.0]])
    apart = np.linalg.norm((0.1 * v + near) @ BASES[lattice])
    polyhedron = TorusDisks(2, lattice).polyhedron
    values = dict(zip(polyhedron.names, polyhedron.values(q), strict=True))
    assert min(values, key=values.get) == f"1-2({image[0]},{image[1]})"
    assert min(values.values()) == pytest.approx(apart, abs=1e-12)


@given(placements(), st.integers(0, 2**32 - 1))
def test_radius_is_invariant(placed, seed):
    model, q = placed
    rng = np.random.default_rng(seed)
    centres = q[:-1].reshape(-1, 2)
    turned = centres[rng.permutation(model.count)] @ rng.choice(model.point_group).T
    moved = np.append((turned + rng.random(2)).ravel(), 0.0)
    assert model.radius(moved) == pytest.approx(model.radius(q), abs=1e-12)


@pytest.mark.parametrize(("lattice", "order"), [("square", 8), ("hexagonal", 12)])
def test_point_group_is_all_isometries_that_fix_the_origin(lattice, order):
    group = TorusDisks(2, lattice).point_group
    assert len(group) == order
    rng = np.random.default_rng(1)
    for g in group:
        u = rng.normal(size=2)
        assert np.linalg.norm(g @ u @ BASES[lattice]) == pytest.approx(
            np.linalg.norm(u @ BASES[lattice])
        )
    products = {tuple((g @ h).ravel()) for g in group for h in group}
    assert products == {tuple(g.ravel()) for g in group}


@pytest.mark.parametrize("lattice", LATTICES)
def test_starts_do_not_overlap(lattice):
    model = TorusDisks(4, lattice)
    points = model.starts(np.random.default_rng(0), 20)
    assert points.shape == (20, 9)
    assert model.polyhedron.contains(points).all()
    np.testing.assert_array_equal(points, model.starts(np.random.default_rng(0), 20))


def test_segment_joins_a_disk_to_the_named_image():
    model = TorusDisks(2, "hexagonal")
    ends = model.segment([0.1, 0.2, 0.3, -0.1, 0.1], "1-2(-1,1)")
    b = BASES["hexagonal"]
    np.testing.assert_allclose(ends, [0.1 * b[0] + 0.2 * b[1], -0.7 * b[0] + 0.9 * b[1]])


@pytest.mark.parametrize(
    ("count", "lattice", "radius"),
    [
        (3, "square", (math.sqrt(6) - math.sqrt(2)) / 4),  # [DGKX]
        (4, "square", (math.sqrt(6) - math.sqrt(2)) / 4),  # [DGKX]
        (5, "square", math.sqrt(5) / 10),  # [DGKX]
        (5, "hexagonal", 0.198071747848315),  # [HDC]
    ],
)
def test_descent_finds_the_densest_packing(count, lattice, radius):
    """The polyhedron and its energy, given to the general solver, are the packing problem."""
    model = TorusDisks(count, lattice)
    starts = model.starts(np.random.default_rng(2), 6)
    packings = [minimise(model.polyhedron, model.energy, q) for q in starts]
    reached = [model.radius(p.point) for p in packings if p.is_minimum]
    assert max(reached) == pytest.approx(radius, abs=1e-8)


@pytest.mark.parametrize(
    ("call", "argument", "kind"),
    [
        (lambda _: TorusDisks(2.0), "count", TypeError),
        (lambda _: TorusDisks(True), "count", TypeError),
        (lambda _: TorusDisks(0), "count", ValueError),
        (lambda _: TorusDisks(2, "cubic"), "lattice", ValueError),
        (lambda model: model.critical("dice"), "rng", TypeError),
        (lambda model: model.critical(0, starts=1.5), "starts", TypeError),
        (lambda model: model.critical(0, starts=0), "starts", ValueError),
        (lambda model: model.starts(np.random.default_rng(0), 0), "count", ValueError),
        (lambda model: model.segment(np.zeros(5), "1-3(0,0)"), "contact", ValueError),
        (lambda model: model.radius(np.zeros(4)), "q", ValueError),
    ],
)
def test_the_error_names_the_argument(call, argument, kind):
    with pytest.raises(kind, match=rf"^{argument}: expected [^\n]+; got [^\n]+$"):
        call(TorusDisks(2))
