"""Where sharp bodies touch, and the forces there: they balance what acts on each body."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from polycorner import simulate
from polycorner.bodies import Arrangement, Mass, mass_of, polygon, polytope
from polycorner.motion import Solver, contact_forces

CUBE = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
SQUARE = [[-1, -1], [1, -1], [1, 1], [-1, 1]]
SLANT = 0.3  # rad


def on_a_slope(d):
    """A box of the size 2 at rest on a fixed slab that is tilted, and its place."""
    if d == 2:
        turn, box = SLANT, polygon(SQUARE)
        slab = polygon(np.array(SQUARE) * [5, 0.5]).moved([0, 0], turn)
        matrix = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    else:
        turn, box = Rotation.from_rotvec([0.2, SLANT, 0.4]), polytope(CUBE)
        slab = polytope(CUBE * [5, 5, 0.5]).moved([0, 0, 0], turn)
        matrix = turn.as_matrix()
    a = Arrangement({"box": box}, fixed={"slab": slab}, orientations="all")
    place = matrix[:, -1] * (1.5 + 1e-12) + matrix[:, 0] * 0.3
    return a, {"box": (place, turn)}, matrix


def wrench(path, index, name, about):
    """The force on a body and its torque about a point, from the rows of all contacts."""
    found = contact_forces(path, index)
    signs = [1.0 if name == one else -1.0 if name == two else 0.0 for one, two in found.between]
    forces = np.array(signs)[:, None] * found.forces
    levers = found.points - about
    turns = (
        np.cross(levers, forces)
        if found.points.shape[1] == 3
        else (levers[:, 0] * forces[:, 1] - levers[:, 1] * forces[:, 0])
    )
    return forces.sum(axis=0), turns.sum(axis=0)


@pytest.mark.parametrize("d", [2, 3])
def test_a_box_at_rest_on_a_slope_is_in_balance(d):
    a, placed, matrix = on_a_slope(d)
    pull = np.append(np.zeros(d - 1), -10.0)
    system = a.system(gravity=pull, friction=0.9)
    q = a.point(placed)
    path = simulate(system, system.state(q), 0.05, 1e-3, every=1)
    mass = mass_of(a.bodies["box"]).mass
    for index in (0, 10, -1):
        rows = path.contacts(index)
        assert len([row for row in rows if row.normal > 1e-9]) >= d
        force, torque = wrench(path, index, "box", path.q[index, 0, :d])
        np.testing.assert_allclose(force, -mass * pull, atol=1e-5)
        np.testing.assert_allclose(torque, 0, atol=1e-5)
        for row in rows:
            # On the plane of the slab, along its normal, and within Coulomb's cone.
            assert row.point @ matrix[:, -1] == pytest.approx(0.5, abs=1e-9)
            out = row.direction if row.between[0] == "box" else -row.direction
            np.testing.assert_allclose(out, matrix[:, -1], atol=1e-9)
            along = row.force - row.normal * row.direction
            assert np.linalg.norm(along) <= 0.9 * row.normal * (1 + 1e-6) + 1e-9
            assert row.direction @ row.force == pytest.approx(row.normal)
            # Inside of the face of the box that is down.
            local = (row.point - path.q[index, 0, :d]) @ matrix
            assert abs(local[:-1]).max() <= 1 + 1e-9


def test_a_falling_bar_is_stopped_across_an_edge_where_the_edges_cross():
    """Two bars lie across each other: an edge meets an edge, and Newton's law holds of both."""
    bar = polytope(CUBE * [2.0, 0.2, 0.2])
    tilt = Rotation.from_rotvec([np.pi / 4, 0, 0])
    a = Arrangement({"A": bar, "B": bar}, orientations="all")
    across = Rotation.from_rotvec([0, 0, np.pi / 2 - 0.2]) * tilt
    height = 2 * 0.2 * np.sqrt(2)
    q = a.point({"A": ([0, 0, 0], tilt), "B": ([0.3, 0.1, height + 1e-12], across)})
    # Both in one field, in which A is held by its weight alone: B presses it down.
    heavy = {"A": Mass(1e9, np.zeros(3), 1e9 * np.eye(3)), "B": mass_of(bar)}
    pull = np.array([0.0, 0.0, -10.0])
    forces = {"A": [0, 0, 1e10]}
    system = a.system(gravity=pull, masses=heavy, forces=forces, friction=0.5)
    path = simulate(system, system.state(q), 2e-3, 1e-3, every=1)
    (row,) = [row for row in path.contacts(1) if row.normal > 1e-6]
    assert ".e" in row.contact
    assert {*row.between} == {"A", "B"}
    # Edges along x and along the turned axis cross where both have the height of the edge.
    edge = 0.2 * np.sqrt(2)
    u = across.apply([1.0, 0, 0])
    point = np.array([0.3, 0.1, edge]) - 0.1 / u[1] * u
    np.testing.assert_allclose(row.point, point, atol=1e-4)
    upward = row.direction if row.between[0] == "B" else -row.direction
    np.testing.assert_allclose(upward, [0, 0, 1], atol=1e-6)
    force, torque = wrench(path, 1, "B", path.q[0, 0, 7:10])
    mass, inertia = heavy["B"].mass, heavy["B"].inertia
    gained = path.v[1, 0, 7:10] / 1e-3
    np.testing.assert_allclose(mass * (gained - pull), force, atol=1e-5)
    w, *v = path.q[0, 0, 10:14]
    rate = path.v[1, 0, 10:14]
    spin = 2 * (w * rate[1:] - rate[0] * np.array(v) - np.cross(rate[1:], v))
    matrix = across.as_matrix()
    np.testing.assert_allclose(matrix @ inertia @ matrix.T @ spin / 1e-3, torque, atol=1e-2)


@pytest.mark.parametrize("kinds", [False, True])
def test_repeated_boxes_bear_what_is_above(kinds):
    """A tower of three boxes on a fixed slab: each force is the weight of all above it."""
    box = polytope(CUBE)
    slab = polytope(CUBE * [5, 5, 0.5])
    names = {"box": box, "last": box} if kinds else {"box": box}
    a = Arrangement(names, fixed={"slab": slab}, orientations="all")
    count = {"box": 2, "last": 1} if kinds else 3
    system = a.system(gravity=[0, 0, -10.0], friction=0.5, count=count)
    places = [[0.1 * k, 0, 1.5 + 2 * k, 1, 0, 0, 0] for k in range(3)]
    start = {"box": places[:2], "last": places[2:]} if kinds else places
    path = simulate(system, system.state(start), 0.02, 1e-3, every=1, solver=Solver())
    bodies, mass = path.bodies, mass_of(box).mass
    for k, name in enumerate(bodies):
        force, torque = wrench(path, -1, name, np.array([0.1 * k, 0, 1.5 + 2 * k]))
        np.testing.assert_allclose(force, [0, 0, 10 * mass], atol=1e-3)
        np.testing.assert_allclose(torque, 0, atol=1e-3)
    for row in path.contacts(-1):
        level = (0.5, 2.5, 4.5)[max(bodies.index(n) for n in row.between if n in bodies)]
        assert row.point[2] == pytest.approx(level, abs=1e-6)
