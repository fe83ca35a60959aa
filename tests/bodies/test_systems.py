"""Motion of arrangements: inertia against samples, known motions, conservation laws."""

from itertools import product

import numpy as np
import pytest
import sympy
import trimesh
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from polycorner import simulate
from polycorner.bodies import (
    Arrangement,
    Cylinder,
    HalfSpace,
    Mass,
    capsule,
    compound,
    disc,
    mass_of,
    polygon,
    polytope,
    sphere,
)
from polycorner.motion import time_symbol

TRIANGLE = [[0, 0], [2, 0], [1, 1.5]]
SIMPLEX = [[0, 0, 0], [1, 0, 0], [0, 2, 0], [0.3, 0, 1]]
GROUND = {"ground": HalfSpace([0, 1], [0, 0])}
FLOOR = {"floor": HalfSpace([0, 0, 1], [0, 0, 0])}


def distance_from(part, points):
    """Distances of points from a part's hull, from its segments and half-spaces."""
    corners = part.points
    if len(corners) == 1:
        return np.linalg.norm(points - corners[0], axis=1)
    if len(corners) > 2:
        hull = ConvexHull(corners)
        outside = (points @ hull.equations[:, :-1].T + hull.equations[:, -1]).max(axis=1)
        if part.radius == 0:
            return np.maximum(outside, 0)
    found = []
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        along = end - start
        at = np.clip((points - start) @ along / (along @ along), 0, 1)
        found.append(np.linalg.norm(points - start - at[:, None] * along, axis=1))
    away = np.min(found, axis=0)
    return np.where(outside <= 0, 0, away) if len(corners) > 2 else away


@pytest.mark.parametrize(
    "body",
    [
        disc(0.7, at=[1, 1]),
        capsule([0, 0], [1, 2], 0.3),
        polygon(TRIANGLE),
        polygon(TRIANGLE, 0.4),
        sphere(0.5, at=[1, 0, 0]),
        capsule([0, 0, 0], [1, 2, 1], 0.3),
        polytope(SIMPLEX),
    ],
)
def test_mass_centre_and_inertia_are_those_of_samples(body):
    rng, count = np.random.default_rng(0), 400_000
    (part,) = body.parts.values()
    low, high = part.points.min(axis=0) - part.radius, part.points.max(axis=0) + part.radius
    points = low + (high - low) * rng.random((count, body.dimension))
    inside = points[distance_from(part, points) <= part.radius]
    volume = np.prod(high - low) * len(inside) / count
    away = inside - inside.mean(axis=0)
    second = volume * away.T @ away / len(inside)
    found = mass_of(body, density=2.0)
    assert found.mass == pytest.approx(2 * volume, rel=0.01)
    np.testing.assert_allclose(found.centre, inside.mean(axis=0), atol=0.01)
    trace = np.trace(second)
    expected = trace if body.dimension == 2 else trace * np.eye(3) - second
    np.testing.assert_allclose(found.inertia, 2 * expected, atol=0.015 * 2 * trace)


@pytest.mark.parametrize("seed", range(4))
def test_the_mass_of_a_rounded_polyhedron_is_the_limit_of_meshes(seed):
    """Of convex hulls of balls of triangles about its vertices, whose error is of second order."""
    rng = np.random.default_rng(seed)
    points = rng.standard_normal((7, 3)) * [2.0, 1.0, 0.5]
    points, radius = points[ConvexHull(points).vertices], rng.uniform(0.2, 1.0)

    def of_mesh(divisions):
        ball = radius * trimesh.creation.icosphere(divisions).vertices
        mesh = trimesh.convex.convex_hull((points[:, None] + ball).reshape(-1, 3))
        return np.hstack([mesh.volume, mesh.center_mass, mesh.moment_inertia.ravel()])

    coarse, fine = of_mesh(3), of_mesh(4)
    mass = mass_of(polytope(points, radius))
    found = np.hstack([mass.mass, mass.centre, mass.inertia.ravel()])
    assert found == pytest.approx(fine + (fine - coarse) / 3, abs=3e-4 * np.abs(fine).max())


def test_the_mass_of_a_rounded_box_is_exact():
    """By the formula of Steiner; one that is hardly more than a point is a ball."""
    a, b, c, r = 1.0, 2.0, 3.0, 0.4
    corners = np.array(list(product([0.0, a], [0.0, b], [0.0, c])))
    volume = a * b * c + 2 * r * (a * b + b * c + c * a) + np.pi * r**2 * (a + b + c)
    found = mass_of(polytope(corners, r))
    assert found.mass == pytest.approx(volume + 4 / 3 * np.pi * r**3, rel=1e-13)
    assert found.centre == pytest.approx([a / 2, b / 2, c / 2], abs=1e-13)
    dot = mass_of(polytope(1e-9 * corners, 1.0))
    assert dot.inertia == pytest.approx(2 / 5 * dot.mass * np.eye(3), abs=1e-7)


def test_a_compound_has_the_inertia_of_its_parts():
    ball = mass_of(sphere(0.5))
    dumbbell = mass_of(compound([sphere(0.5, at=[0, 0, z]) for z in (-1, 1)]))
    assert dumbbell.mass == pytest.approx(2 * ball.mass)
    across = 2 * (ball.inertia[0, 0] + ball.mass)
    np.testing.assert_allclose(
        dumbbell.inertia, np.diag([across, across, 2 * ball.inertia[2, 2]]), atol=1e-12
    )


def test_a_number_is_the_mass_of_a_uniform_body():
    """A capsule that falls and turns: its kinetic energy is that of the closed form."""
    a = Arrangement({"A": capsule([-1, 0], [1, 0], 0.5), "B": disc(0.3)}, orientations="all")
    area = 2.0 + np.pi / 4
    half = np.pi * 0.5**2 / 2  # a half disc, its centroid 4 r / (3 pi) from the flat side
    tip = 4 * 0.5 / (3 * np.pi)
    second = 2 * (2**2 + 1) / 12 + 2 * half * (0.5**2 / 2 - tip**2 + (1 + tip) ** 2)
    system = a.system(masses={"A": 3.0})
    state = system.state(a.point({"A": [0, 2], "B": [3, 0]}), [2.0, 0.0, 5.0, 0.0, 0.0, 0.0])
    kinetic, _ = system.energies(state)
    assert kinetic == pytest.approx(3.0 * (2.0**2 + second / area * 5.0**2) / 2, rel=1e-12)


def run(a, system, placed, v, t_end, dt=1e-3):
    return simulate(system, system.state(a.point(placed), v), t_end, dt)


def test_a_ball_rolls_down_a_slope():
    """At 5/7 of the acceleration of one that slides, and it turns about the right axis."""
    a = Arrangement({"A": sphere(0.5)}, FLOOR, orientations="all")
    system = a.system(gravity=[1.0, 0, -5.0], friction=0.4)
    path = run(a, system, {"A": [0, 0, 0.5]}, np.zeros(7), 1.0)
    np.testing.assert_allclose(path.v[-1, 0, :3], [5 / 7, 0, 0], atol=1e-9)
    turned = path.q[-1, 0, 3:]
    angle = 2 * np.arctan2(turned[2], turned[0])
    assert angle == pytest.approx(path.q[-1, 0, 0] / 0.5, abs=2e-3)


def test_a_block_slides_beyond_the_coefficient_of_friction_and_sticks_below():
    square = polygon([[-1, -0.2], [1, -0.2], [1, 0.2], [-1, 0.2]])
    a = Arrangement({"A": square}, GROUND, orientations="all")
    for push, expected in ((2.0, 0.0), (4.0, 1.0)):
        system = a.system(gravity=[push, -10.0], friction=0.3)
        path = run(a, system, {"A": [0, 0.2]}, np.zeros(3), 1.0)
        np.testing.assert_allclose(path.v[-1, 0], [expected, 0, 0], atol=1e-9)


def test_a_disc_slides_around_a_circle_as_a_pendulum_swings():
    a = Arrangement({"A": disc(0.2)}, {"ring": Cylinder(1.2)})
    system = a.system(gravity=[0.0, -1.0])
    start = [np.sin(0.01), -np.cos(0.01)]
    path = run(a, system, {"A": start}, np.zeros(2), np.pi, 1e-3)
    assert path.q[-1, 0, 0] == pytest.approx(-np.sin(0.01), rel=1e-3)


def test_a_disc_in_a_turning_circle_rolls_in_place():
    """At the bottom it turns with the wall and stays where it is."""
    a = Arrangement({"A": disc(0.2)}, {"ring": Cylinder(1.2, spin=2.0)}, orientations="all")
    system = a.system(gravity=[0.0, -10.0], friction=0.8)
    path = run(a, system, {"A": [0, -1.0]}, np.array([0, 0, 2.0 * 1.2 / 0.2]), 1.0)
    np.testing.assert_allclose(path.q[-1, 0, :2], [0, -1], atol=1e-6)
    assert path.v[-1, 0, 2] == pytest.approx(12.0)


def test_a_ball_in_a_turning_pipe_keeps_the_pipes_pace():
    """It is dragged along until it rolls: then nothing slips at the contact."""
    pipe = {"pipe": Cylinder(1.0, axis=[0, 0, 1], spin=1.5)}
    a = Arrangement({"A": sphere(0.2)}, pipe, orientations="all")
    system = a.system(gravity=[0, -10.0, 0], friction=0.8)
    path = run(a, system, {"A": [0, -0.8, 0]}, np.zeros(7), 3.0)
    q, v = path.q[-1, 0], path.v[-1, 0]
    turn = a.manifold.frame(q)[3:, 3:]
    body_omega = np.linalg.lstsq(turn, v[3:], rcond=None)[0]
    omega = Rotation.from_quat(q[[4, 5, 6, 3]]).apply(body_omega)
    down = q[:3] * [1, 1, 0] / 0.8
    slip = v[:3] + np.cross(omega, 0.2 * down) - np.cross([0, 0, 1.5], down)
    np.testing.assert_allclose(slip - (slip @ down) * down, 0, atol=1e-4)


def momenta(a, masses, q, v):
    """Linear and angular momentum, from centres of mass and angular velocities."""
    d = a.dimension
    linear, angular = np.zeros(d), np.zeros(1 if d == 2 else 3)
    h = 1e-6
    for p in a.placements:
        mass = masses[p.name]
        ends = [p.pose(q + side * h * v) for side in (1, -1)]
        centre, matrix = p.pose(q)
        moved = [origin + turn @ mass.centre for origin, turn in ends]
        velocity = (moved[0] - moved[1]) / (2 * h)
        spin = (ends[0][1] - ends[1][1]) / (2 * h) @ matrix.T
        place = centre + matrix @ mass.centre
        linear += mass.mass * velocity
        if d == 2:
            angular += mass.mass * np.cross([*place, 0], [*velocity, 0])[2:]
            angular += mass.inertia * spin[1, 0]
        else:
            omega = np.array([spin[2, 1], spin[0, 2], spin[1, 0]])
            angular += mass.mass * np.cross(place, velocity)
            angular += matrix @ mass.inertia @ matrix.T @ omega
    return np.concatenate([linear, angular])


PAIRS = {
    "discs": (disc(0.5), disc(0.8)),
    "capsules": (capsule([-1, 0], [1, 0], 0.3), capsule([-0.5, 0.2], [0.7, 0], 0.2)),
    "compounds": (compound([disc(0.3, at=[-1, 0]), disc(0.5, at=[1, 0])]), disc(0.4, at=[0.2, 0])),
    "balls": (sphere(0.5), sphere(0.8)),
    "capsules in space": (
        capsule([0, -0.8, -0.2], [0, 0.9, 0.3], 0.3),
        capsule([0.2, 0.1, -0.9], [-0.1, 0, 0.7], 0.2),
    ),
    "ball and capsule": (sphere(0.5), capsule([0.2, -0.6, 0], [0, 0.7, 0], 0.3)),
}


@pytest.mark.parametrize("friction", [0.0, 0.7])
@pytest.mark.parametrize("pair", PAIRS)
def test_collisions_keep_momentum_and_angular_momentum(pair, friction):
    one, two = PAIRS[pair]
    a = Arrangement({"A": one, "B": two}, orientations="all")
    system = a.system(friction=friction, restitution=0.0 if friction else 1.0)
    masses = {name: mass_of(body) for name, body in a.named.items()}
    d = a.dimension
    away = np.array([3.0, 0.3]) if d == 2 else np.array([3.0, 0.3, 0.2])
    q = a.point({"A": np.zeros(d), "B": away})
    v = np.zeros(a.manifold.size)
    for p in a.placements:
        spin = (
            [0.7]
            if d == 2
            else a.manifold.frame(q)[p.at.start + 3 : p.at.stop, :]
            @ (np.linspace(0.4, -0.8, a.manifold.dimension))
        )
        v[p.at.start + d : p.at.stop] = spin
        v[p.at.start] = 2.0 if p.name == "A" else -1.0
    path = simulate(system, system.state(q, v), 1.2, 1e-4)
    assert path.events
    before = momenta(a, masses, path.q[0, 0], path.v[0, 0])
    after = momenta(a, masses, path.q[-1, 0], path.v[-1, 0])
    np.testing.assert_allclose(after, before, atol=2e-3 * np.abs(before).max())
    kinetic = [path.kinetic[k] for k in (0, -1)]
    assert kinetic[1] < kinetic[0] + 1e-3
    if not friction:
        assert kinetic[1] == pytest.approx(kinetic[0], rel=2e-3)


def test_a_capsule_falls_on_another_and_lies_still():
    rod = capsule([-1, 0, 0], [1, 0, 0], 0.2)
    a = Arrangement({"A": rod}, FLOOR)
    system = a.system(gravity=[0, 0, -10.0])
    turn = Rotation.from_euler("y", 0.5)
    path = run(a, system, {"A": ([0, 0, 1.0], turn)}, np.zeros(6), 3.0)
    assert path.q[-1, 0, 2] == pytest.approx(0.2, abs=1e-6)
    assert path.q[-1, 0, 5] == pytest.approx(0.0, abs=1e-6)


def test_a_disc_rolls_on_a_shaken_floor():
    """In the axes of the floor, with two thirds of its acceleration; the balance is kept."""
    t = time_symbol()
    a = Arrangement({"A": disc(1.0)}, GROUND, orientations="all")
    shaken = [3 * sympy.cos(5 * t), -10 + 2 * sympy.sin(7 * t)]
    path = run(a, a.system(gravity=shaken, friction=0.9), {"A": ([0, 1], 0)}, np.zeros(3), 2.0)
    speed = 3 / 5 * np.sin(5 * path.times) * 2 / 3
    assert path.v[:, 0, 0] == pytest.approx(speed, abs=1e-4)
    assert path.v[:, 0, 2] == pytest.approx(-speed, abs=1e-4)
    assert path.audit < 1e-4
    assert np.ptp(path.potential) == pytest.approx(0.0, abs=1e-9)


BALLS = compound({"1": sphere(0.5), "2": sphere(0.8, at=[2.0, 0.5, 0.0])})


@pytest.mark.parametrize("body", [polygon(TRIANGLE), BALLS])
def test_weight_that_follows_the_time_acts_at_the_centre_of_mass(body):
    """Which flies as a point would; the body turns freely about it."""
    d, t = body.dimension, time_symbol()
    a = Arrangement({"A": body}, {"floor": HalfSpace(np.eye(d)[-1], -50 * np.eye(d)[-1])})
    system = a.system(gravity=[sympy.cos(3 * t), *[-t] * (d - 1)])
    spin = 2.0 if d == 2 else np.array([0.3, -0.5, 2.0])
    q = a.point({"A": np.zeros(d)})
    path = simulate(system, system.state(q, a.velocity(q, {"A": (np.zeros(d), spin)})), 1.0, 1e-3)
    moved = a.placed(path.q[-1, 0])["A"]
    start, end = mass_of(body).centre, mass_of(moved).centre
    carried = np.cross(spin, start)[:d] if d == 3 else spin * np.array([-start[1], start[0]])
    expected = start + carried + [(1 - np.cos(3.0)) / 9, *[-1 / 6] * (d - 1)]
    assert end == pytest.approx(expected, abs=1e-4)


UPRIGHT, TURNED = capsule([0, 0, -1], [0, 0, 1], 1), Mass(1, [0, 0, 0.2], [1, 1.2, 1])


def system(body=disc(1), **options):  # noqa: B008 - a value that does not change
    return lambda: Arrangement([body] * 2).system(**options)


def on_the_ground(**options):
    return lambda: Arrangement({"A": disc(1)}, GROUND).system(**options)


def masses(mass, centre, inertia):
    return lambda: Mass(mass, centre, inertia)


@pytest.mark.parametrize(
    ("make", "kind", "said"),
    [
        (system(friction=0.1), ValueError, "orientations"),
        (system(friction=-1), ValueError, "friction"),
        (system(gravity=[1, 2, 3]), ValueError, "gravity"),
        (system(gravity=3), TypeError, "gravity: expected 2"),
        (system(gravity=[True, 1]), TypeError, "gravity: exp"),
        (system(gravity=[0, sympy.Symbol("t")]), ValueError, "gravity: .* of time_symbol"),
        (system(gravity=[0, sympy.I * time_symbol()]), ValueError, "gravity: .* of real values"),
        (system(density=0), ValueError, "density"),
        (system(masses={"3": 1}), ValueError, "masses"),
        (system(masses={"1": "heavy"}), TypeError, r"masses\['1'\]: expected a number, or a Mass"),
        (system(masses={"1": None}), TypeError, r"masses\['1'\]: expected a number, or a Mass"),
        (system(masses={"1": True}), TypeError, r"masses\['1'\]: expected a number, or a Mass"),
        (system(masses={"1": -1}), ValueError, r"masses\['1'\]: "),
        (system(masses={"1": float("inf")}), ValueError, r"masses\['1'\]: "),
        (system(masses={"1": Mass(1, [0.1, 0], 1)}), ValueError, "masses: .* '1' that looks"),
        (system(UPRIGHT, masses={"2": TURNED}), ValueError, "masses: .* '2' that looks the same"),
        (on_the_ground(friction=-1, count=2), ValueError, "friction"),
        (on_the_ground(count=0), ValueError, "count"),
        (system(count=2), ValueError, "count: expected 1, or numbers by name"),
        (system(count={"1": "x", "2": 1}), TypeError, "count of '1': expected a whole number >= 1"),
        (system(count={"1": 0, "2": 1}), ValueError, "count of '1': expected a whole number >= 1"),
        (masses(0, [0, 0], 1), ValueError, "mass"),
        (masses(1, [0, 0], 0), ValueError, "inertia"),
        (masses(1, [0, 0, 0], [1, 1, 2.1]), ValueError, "inertia"),
        (masses(1, [0, 0, 0], [[1, 0.1, 0], [0, 1, 0], [0, 0, 1]]), ValueError, "inertia"),
        (masses(1, [0], 1), ValueError, "centre"),
    ],
)
def test_what_is_not_covered_is_refused(make, kind, said):
    with pytest.raises(kind, match=said):
        make()


@pytest.mark.parametrize("friction", [0.0, 0.4])
@pytest.mark.parametrize("d", [2, 3])
def test_repeated_bodies_move_as_if_they_were_listed(d, friction):
    """Three of a compound fall on each other, once as one system, once as three of a kind."""
    ends = [0.5 * np.eye(d)[0], -0.5 * np.eye(d)[0]]
    body = compound([*((disc if d == 2 else sphere)(0.3, at=e) for e in ends), capsule(*ends, 0.2)])
    ground, gravity = (GROUND, [0.0, -10.0]) if d == 2 else (FLOOR, [0.0, 0.0, -10.0])
    one = Arrangement({"A": body}, ground, orientations="all")
    three = Arrangement({"A": body, "B": body, "C": body}, ground, orientations="all")
    up = np.eye(d)[-1]
    places = [0.3 * up, 1.1 * up + 0.1 * np.eye(d)[0], 2.0 * up - 0.2 * np.eye(d)[0]]
    turns = [0.0, 0.3, -0.2]
    if d == 3:
        turns = [Rotation.from_rotvec([0.1 * a, 0.2, a]) for a in turns]
        turns[0] = None
    starts = [one.point({"A": (p, t)}) for p, t in zip(places, turns, strict=True)]
    listed = three.system(gravity=gravity, friction=friction)
    repeated = one.system(gravity=gravity, friction=friction, count=3)
    first = simulate(listed, listed.state(np.concatenate(starts)), 0.25, 5e-4)
    second = simulate(repeated, repeated.state(np.array(starts)), 0.25, 5e-4)
    assert any(len(bodies) == 2 for bodies, *_ in second.touching[-1])
    np.testing.assert_allclose(first.q[-1].reshape(3, -1), second.q[-1], atol=2e-3)


def test_coefficients_by_name():
    a = Arrangement({"A": disc(1)}, GROUND, orientations="all")
    system = a.system(friction={"between": 0.3}, restitution={"between": 0.5}, count=2)
    assert not system.friction
    assert [law.kind for law in system.between.friction] == ["rubbing"]
    assert system.between.restitution == 0.5
    with pytest.raises(ValueError, match="friction: expected names among A, ground, pairs"):
        a.system(friction={"A-wall": 0.3})
