"""Motion of sharp polygons and polyhedra, against what is known or computed in another way."""

import signal

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation
from scipy.stats import chisquare

from polycorner import simulate
from polycorner.bodies import (
    Arrangement,
    HalfSpace,
    capsule,
    compound,
    disc,
    mass_of,
    polygon,
    polytope,
    sphere,
)
from polycorner.files import load_trajectory, save_trajectory
from polycorner.motion import Checkpoint, Consistency, Solver, accelerations
from tests.support.boxes import brick, can_stand, deepest, loads, voussoir

G = 10.0
D = (2, 3)


def on_the_floor(body, count, *, tilt=0.0, **options):
    """Bodies like one on a floor, with weight; ``tilt`` turns the weight, as on a slope."""
    d = body.dimension
    up, along = np.eye(d)[-1], np.eye(d)[0]
    a = Arrangement({"A": body}, {"floor": HalfSpace(up, 0 * up)}, orientations="all")
    pull = G * (np.sin(tilt) * along - np.cos(tilt) * up)
    return a, a.system(gravity=pull, count=count, **options)


def upright(a, places, angles=None):
    """Placements of bodies, turned about the vertical in space and upright in the plane."""
    angles = np.zeros(len(places)) if angles is None else angles
    return np.array(
        [
            a.point({"A": (p, angle if a.dimension == 2 else Rotation.from_euler("z", angle))})
            for p, angle in zip(np.asarray(places, dtype=float), angles, strict=True)
        ]
    )


def pile(d, count, offset):
    """Places of unit boxes on each other, each set off from those below."""
    k = np.arange(count)
    across = [offset * np.cos(k), offset * np.sin(2 * k)][: d - 1]
    return np.column_stack([*across, k + 0.5])


@pytest.mark.parametrize("offset", [0.0, 0.1])
@pytest.mark.parametrize(("d", "count"), [(2, 10), (3, 4)])
def test_a_stack_stands_and_presses_as_it_weighs(d, count, offset):
    a, system = on_the_floor(brick(*[1.0] * d), count, friction=0.5)
    start = upright(a, pile(d, count, offset), None if d == 2 else 7 * offset * np.arange(count))
    path = simulate(system, system.state(start), 0.3, 1e-3)
    assert path.q[-1] == pytest.approx(start, abs=1e-6)
    expected = {(k - 1, k) if k else (0,): G * (count - k) for k in range(count)}
    assert loads(path) == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("d", D)
def test_a_block_slides_on_another_above_the_angle_of_friction(d):
    mu, angle = 0.4, np.arctan(0.4)
    floor = {f"A.v{i + 1}-floor": 5.0 for i in range(2**d)}
    body = brick(*[1.0] * (d - 1), 0.3)
    for tilt, moves in ((angle - 0.02, 0.0), (angle + 0.02, np.sin(0.02) / np.cos(angle))):
        a, system = on_the_floor(body, 2, tilt=tilt, friction={**floor, "between": mu})
        start = upright(a, [[*[0.0] * (d - 1), 0.15], [*[0.1] * (d - 1), 0.45]])
        path = simulate(system, system.state(start), 0.5, 1e-3)
        assert path.q[-1, 0] == pytest.approx(start[0], abs=1e-7)
        assert path.q[-1, 1, 0] - 0.1 == pytest.approx(G * moves * 0.5**2 / 2, abs=1e-4)


@pytest.mark.parametrize("d", D)
def test_a_block_tips_over_the_edge_of_another_as_a_pendulum(d):
    """Its centre is beyond the edge by ``x``: it turns about it until friction gives way."""
    x, height = 0.1, 0.3
    a, system = on_the_floor(brick(*[1.0] * (d - 1), height), 2, friction=20.0)
    start = upright(a, [[*[0.0] * (d - 1), height / 2], [0.5 + x, *[0.0] * (d - 2), 1.5 * height]])
    path = simulate(system, system.state(start), 0.3, 5e-4)
    inertia = (1 + height**2) / 12 + x**2 + height**2 / 4

    def pendulum(_, y):
        arm = x * np.cos(y[0]) + height / 2 * np.sin(y[0])
        return [y[1], G * arm / inertia]

    angle = solve_ivp(pendulum, (0, 0.3), [0.0, 0.0], rtol=1e-9).y[0, -1]
    found = path.q[-1, 1]
    turned = -found[2] if d == 2 else 2 * np.arctan2(found[5], found[3])
    assert turned == pytest.approx(angle, rel=2e-3)
    assert deepest(a, path.q[::100]) > -1e-5


@pytest.mark.parametrize("d", D)
def test_a_block_slides_over_the_seam_of_two_others(d):
    """Which are equally high: no plane between sides says anything."""
    a, system = on_the_floor(brick(*[1.0] * d), 3)
    rest = [0.0] * (d - 2)
    start = upright(a, [[0, *rest, 0.5], [1, *rest, 0.5], [0.2, *rest, 1.5]])
    v = np.zeros(start.shape)
    v[2, 0] = 1.0
    path = simulate(system, system.state(start, v), 0.9, 1e-3)
    assert path.v[:, 2, 0] == pytest.approx(np.ones(len(path.v)), abs=1e-4)
    # In space it hops a little where corners pass corners, all at once.
    hop = 1e-6 if d == 2 else 1e-3
    assert path.q[:, 2, d - 1] == pytest.approx(np.full(len(path.q), 1.5), abs=hop)


def test_bars_across_each_other_press_where_edges_cross():
    a, system = on_the_floor(brick(4.0, 1.0, 1.0), 2, friction=0.3)
    start = upright(a, [[0, 0, 0.5], [0, 0, 1.5]], [0.0, np.pi / 2])
    path = simulate(system, system.state(start), 0.2, 1e-3)
    pressed = [(name, force) for bodies, name, force in path.touching[-1] if bodies == (0, 1)]
    assert {name.count(".e") for name, _ in pressed} == {2}
    assert [force for _, force in pressed] == pytest.approx([4 * G / 4] * 4, rel=0.1)


def dominoes(count, h):
    """A chain of dominoes of which the first is pushed; the system, start and path."""
    width, height, way = 0.2, 1.0, 0.45
    a, system = on_the_floor(brick(width, height), count, friction=0.4)
    start = upright(a, [[way * i, height / 2] for i in range(count)])
    angle, omega, pivot = -0.2, -2.0, np.array([width / 2, 0.0])
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    arm = turn @ [-width / 2, height / 2]
    start[0] = [*(pivot + arm), angle]
    v = np.zeros((count, 3))
    v[0] = [-omega * arm[1], omega * arm[0], omega]
    return a, simulate(system, system.state(start, v), 1.5, h)


def test_a_chain_of_dominoes_falls():
    """One after the other, at times that do not depend on the step; energy never grows."""
    times = []
    for h in (2e-3, 1e-3):
        a, path = dominoes(6, h)
        times.append([min(e.time for e in path.events if e.bodies == (i, i + 1)) for i in range(5)])
        assert np.diff(path.kinetic + path.potential).max() < 1e-5
        assert deepest(a, path.q[::75]) > -1e-4
    assert np.diff(times[0]).min() > 0.1
    assert times[0] == pytest.approx(times[1], abs=2e-3)


def test_an_arch_stands_if_a_line_of_thrust_fits_into_it():
    """The least thickness by linear programmes; that of many wedges is 0.1075 of the radius."""
    count, mu = 8, 0.9

    def least(count):
        low, high = 0.02, 0.3
        while high - low > 1e-4:
            middle = (low + high) / 2
            low, high = (low, middle) if can_stand(middle, count, mu) else (middle, high)
        return high

    assert least(60) == pytest.approx(0.1075, abs=3e-4)
    for share in (0.94, 1.06):
        body, radius = voussoir(share * least(count), count)
        _, system = on_the_floor(body, count, friction=mu)
        angles = np.pi * (np.arange(count) + 0.5) / count
        start = np.column_stack([radius * np.cos(angles), radius * np.sin(angles), angles])
        path = simulate(system, system.state(start), 0.5, 1e-3)
        assert (abs(path.q[-1] - start).max() < 1e-5) == (share > 1)
        if share < 1:
            assert abs(path.q[-1] - start).max() > 0.02


def some_hull(rng, d):
    points = rng.standard_normal((7, d))
    points = points[ConvexHull(points).vertices]
    return (polygon if d == 2 else polytope)(points - points.mean(axis=0))


def momenta(a, q, v):
    """Linear and angular momentum of bodies like one, from the motion of four of their points."""
    p, mass, h = a.placements[0], mass_of(a.named["A"]), 1e-6
    total = 0.0
    for x, rate in zip(q, v, strict=True):
        poses = [p.pose(a.manifold.placed(x + side * h * rate)) for side in (1, -1)]
        places = [origin + turn @ mass.centre for origin, turn in poses]
        velocity, (place, turn) = (places[0] - places[1]) / (2 * h), p.pose(x)
        spin = (poses[0][1] - poses[1][1]) / (2 * h) @ turn.T
        place = place + turn @ mass.centre
        linear = mass.mass * velocity
        if a.dimension == 2:
            angular = [np.linalg.det([place, linear]) + mass.inertia * spin[1, 0]]
        else:
            omega = np.array([spin[2, 1], spin[0, 2], spin[1, 0]])
            angular = np.cross(place, linear) + turn @ mass.inertia @ turn.T @ omega
        total = total + np.append(linear, angular)
    return total


def meeting(a, rng):
    """Placements and velocities of two bodies that turn and fly towards each other."""
    d, size = a.dimension, a.named["A"].size
    q, v = [], []
    for x, speed in ((0.0, 1.5), (2.2 * size, -1.5)):
        turn = rng.uniform(0, 6) if d == 2 else Rotation.random(random_state=rng)
        aside = x * rng.uniform(-0.2, 0.2, d - 1)
        q.append(a.point({"A": (np.array([x, *aside]), turn)}))
        spin = rng.normal() if d == 2 else rng.normal(size=3)
        v.append(a.velocity(q[-1], {"A": (np.array([speed, *[0.0] * (d - 1)]), spin)}))
    return np.array(q), np.array(v)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("d", D)
def test_collisions_keep_momentum_and_elastic_ones_energy(d, seed):
    rng = np.random.default_rng(seed)
    low = {"low": HalfSpace(np.eye(d)[-1], -50 * np.eye(d)[-1])}
    a = Arrangement({"A": some_hull(rng, d)}, low, orientations="all")
    elastic = a.system(count=2, restitution={"between": 1.0})
    rough = a.system(count=2, friction={"between": 0.6})
    q, v = meeting(a, rng)
    for system in (elastic, rough):
        path = simulate(system, system.state(q, v), 1.5, 1e-3)
        assert path.events
        before, after = (momenta(a, path.q[k], path.v[k]) for k in (0, -1))
        assert after == pytest.approx(before, abs=1e-3)
        assert deepest(a, path.q[::50]) > -1e-4
        lost = path.kinetic[0] - path.kinetic[-1]
        assert abs(lost) < 1e-3 if system is elastic else lost > 1e-3


def test_sharp_hulls_are_the_limit_of_rounded_ones():
    """Of the same width: what a collision does differs by the radius."""
    ends = []
    for r in (0.0, 0.02, 0.04):
        half = 0.5 - r
        square = polygon(half * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]), r)
        low = {"low": HalfSpace([0, 1], [0, -50])}
        a = Arrangement({"A": square}, low, orientations="all")
        system = a.system(count=2, friction={"between": 0.3}, masses={"A": mass_of(brick(1, 1))})
        q = np.array([[0, 0, 0.3], [1.6, 0.3, 0.9]])
        v = np.array([[1.0, 0, 0.5], [-1.0, 0, 0.2]])
        ends.append(simulate(system, system.state(q, v), 1.0, 1e-3).q[-1])
    sharp, near, far = ends
    assert 0.3 < abs(near - sharp).max() / abs(far - sharp).max() < 0.7
    assert abs(near - sharp).max() < 0.05


@pytest.mark.parametrize(("d", "count"), [(2, 8), (3, 4)])
def test_nothing_overlaps_in_a_heap_and_energy_never_grows(d, count):
    """Bodies that tumble into a corner; the polyhedron of listed ones contains all instants."""
    rng = np.random.default_rng(d)
    body = some_hull(rng, d)
    eye, far = np.eye(d), 1.3 * body.size
    walls = {
        f"{side}{c}": HalfSpace(side * eye[c], -side * far * eye[c])
        for c in range(d - 1)
        for side in (1, -1)
    }
    walls["floor"] = HalfSpace(eye[-1], 0 * eye[-1])
    a = Arrangement({"A": body}, walls, orientations="all")
    system = a.system(gravity=-G * eye[-1], friction=0.4, count=count)
    size, places = body.size, []
    for k in range(count):
        turn = rng.uniform(0, 6) if d == 2 else Rotation.random(random_state=rng)
        across = rng.uniform(-0.3, 0.3, d - 1)
        places.append(a.point({"A": (np.array([*across, (1.1 + 2.1 * k) * size]), turn)}))
    path = simulate(system, system.state(np.array(places)), 1.5, 2e-3)
    energy = path.kinetic + path.potential
    assert np.diff(energy).max() < 1e-3 * energy[0]
    listed = Arrangement([body] * count, walls, orientations="all")
    some = path.q[::50].reshape(len(path.q[::50]), -1)
    if d == 2:
        assert all(listed.polyhedron.contains(q, tolerance=1e-3) for q in some)
    assert deepest(a, path.q[::50]) > -1e-3


def test_parts_of_compound_bodies_touch_each_other():
    """Two tables, each a plate with legs; one stands on the other."""
    plate, leg = [1.0, 0.1], [0.1, 0.5]
    parts = {"top": brick(*plate).moved([0, 0.55])}
    parts |= {f"leg{k}": brick(*leg).moved([x, 0.25]) for k, x in enumerate((-0.4, 0.4))}
    table = compound(parts)
    a, system = on_the_floor(table, 2, friction=0.5)
    start = upright(a, [[0, 0], [0.05, 0.6]])
    path = simulate(system, system.state(start), 0.2, 1e-3)
    weight = G * mass_of(table).mass
    assert path.q[-1] == pytest.approx(start, abs=1e-6)
    assert loads(path) == pytest.approx({(0,): 2 * weight, (0, 1): weight}, rel=1e-3)


@pytest.mark.parametrize("d", D)
def test_listed_bodies_move_as_if_one_were_repeated(d):
    """One slides on another, turned a little; and so where the lower one is fixed."""
    body, tilt = brick(*[1.0] * d), 0.3 * (d == 3)
    a, repeated = on_the_floor(body, 2, friction=0.5)
    pull = -G * np.eye(d)[-1]
    two = Arrangement({"A1": body, "A2": body}, a.walls, orientations="all")
    listed = two.system(gravity=pull, friction=0.5)
    start = upright(a, [[*[0.0] * (d - 1), 0.5], [0.2, *[0.1] * (d - 2), 1.5]], [0.0, tilt])
    v = np.zeros(start.shape)
    v[1, 0] = 0.5
    first = simulate(repeated, repeated.state(start, v), 0.6, 1e-3)
    second = simulate(listed, listed.state(start.ravel(), v.ravel()), 0.6, 1e-3)
    flat = second.q.reshape(first.q.shape)
    assert flat == pytest.approx(first.q, abs=1e-6)
    assert start[1, 0] + 0.5**2 / (2 * 0.5 * G) == pytest.approx(flat[-1, 1, 0], abs=1e-4)
    fixed = Arrangement(
        {"A2": body},
        fixed={"A1": body.moved([*[0.0] * (d - 1), 0.5])},
        orientations="all",
        walls=a.walls,
    )
    alone = fixed.system(gravity=pull, friction=0.5)
    third = simulate(alone, alone.state(start[1], v[1]), 0.6, 1e-3)
    assert third.q[-1].ravel() == pytest.approx(flat[-1, 1], abs=1e-6)


@pytest.mark.parametrize("d", D)
def test_sharp_bodies_and_round_ones_lie_on_each_other(d):
    """A ball on a box beside a smaller box: all are at rest, and press as they weigh."""
    level = [0.0] * (d - 2)
    ball = disc(0.2) if d == 2 else sphere(0.2)
    bodies = {"A": brick(2.0, *[2.0] * (d - 2), 1.0), "B": brick(*[0.5] * d), "C": ball}
    floor = {"floor": HalfSpace(np.eye(d)[-1], 0 * np.eye(d)[-1])}
    a = Arrangement(bodies, floor, orientations="all")
    system = a.system(gravity=-G * np.eye(d)[-1], friction=0.4)
    places = {"A": [0, *level, 0.5], "B": [0.4, *level, 1.25], "C": [-0.5, *level, 1.2]}
    flat = 0.0 if d == 2 else Rotation.identity()
    q = a.point({name: (place, flat) for name, place in places.items()})
    path = simulate(system, system.state(q), 0.1, 1e-3)
    assert path.q[-1].ravel() == pytest.approx(q, abs=1e-7)
    pressed = {}
    for _, contact, force in path.touching[-1]:
        pair = frozenset(part.partition(".")[0] for part in contact.split("-"))
        pressed[pair] = pressed.get(pair, 0.0) + force
    weight = {name: G * mass_of(body).mass for name, body in bodies.items()}
    assert pressed[frozenset("AB")] == pytest.approx(weight["B"], rel=1e-4)
    assert pressed[frozenset("AC")] == pytest.approx(weight["C"], rel=1e-4)
    assert pressed[frozenset(["A", "floor"])] == pytest.approx(sum(weight.values()), rel=1e-4)


def test_dice_come_to_rest_on_their_faces():
    """Six at a time, in any orientation; what is up is not far from even (chi squared)."""
    a, counts = None, np.zeros(6)
    eye, far = np.eye(3), 3.5
    walls = {
        f"{c}{sign}": HalfSpace(sign * eye[c], -sign * far * eye[c])
        for c in (0, 1)
        for sign in (1, -1)
    }
    walls["floor"] = HalfSpace(eye[2], 0 * eye[2])
    a = Arrangement({"A": brick(1.0, 1.0, 1.0)}, walls, orientations="all")
    system = a.system(gravity=-G * eye[2], friction=0.3, restitution=0.3, count=6)
    for seed in range(3):
        rng, q, v = np.random.default_rng(seed), [], []
        for k in range(6):
            place = np.array([(k % 3 - 1) * 1.8, (k // 3 - 0.5) * 1.8, 2.0])
            q.append(a.point({"A": (place, Rotation.random(random_state=rng))}))
            v.append(a.velocity(q[-1], {"A": (rng.normal(size=3), 4 * rng.normal(size=3))}))
        path = simulate(system, system.state(np.array(q), np.array(v)), 3.0, 2e-3)
        assert np.diff(path.kinetic + path.potential).max() < 1e-4
        assert deepest(a, path.q[::150]) > -1e-4
        for up in Rotation.from_quat(path.q[-1][:, [4, 5, 6, 3]]).as_matrix()[:, 2, :]:
            axis = int(np.argmax(abs(up)))
            assert abs(up[axis]) == pytest.approx(1.0, abs=1e-6)
            counts[2 * axis + int(up[axis] > 0)] += 1
    assert chisquare(counts).pvalue > 1e-3


def test_painleves_rod_stops_at_once():
    """Where no acceleration fits ([Genot]): a step has impulses, and finds the jam.

    A rod slides on its end, so that friction turns it into the floor, beside another that lies:
    the end stops within a step, and energy does not grow.
    """
    length, width, mu, angle = 2.0, 0.02, 3.0, 1.0
    a, system = on_the_floor(brick(length, width), 2, friction=mu)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    low = (turn @ a.named["A"].markers.T).T
    end = low[low[:, 1].argmin()]
    start = np.array([[0.0, -end[1], angle], [9.0, width / 2, 0.0]])
    v = np.array([[-3.0, 0, 0], [0, 0, 0]])
    alone = a.system(gravity=[0, -G], friction=mu)
    found = accelerations(alone, alone.state(start[0], v[0]))
    assert found.consistency is Consistency.INCONSISTENT
    path = simulate(system, system.state(start, v), 0.01, 1e-3)
    assert path.converged
    assert np.diff(path.kinetic + path.potential).max() < 1e-6
    arm = [-end[1], end[0]]
    assert path.v[2, 0, :2] + path.v[2, 0, 2] * np.array(arm) == pytest.approx([0, 0], abs=0.05)


def test_a_body_of_sharp_and_rounded_parts_moves_repeated_as_listed():
    """Hammers, of which one falls on the other: a sharp head, and a handle with round ends."""
    head, stick = brick(0.6, 0.4).moved([0, 1.0]), capsule([0, 0], [0, 1.0], 0.08)
    hammer = compound({"head": head, "stick": stick})
    a, repeated = on_the_floor(hammer, 2, friction=0.4)
    two = Arrangement({"A1": hammer, "A2": hammer}, a.walls, orientations="all")
    listed = two.system(gravity=[0, -G], friction=0.4)
    start = np.array([[0, 0.3, -1.3], [0.1, 1.6, 0.9]])
    first = simulate(repeated, repeated.state(start), 0.8, 1e-3)
    second = simulate(listed, listed.state(start.ravel()), 0.8, 1e-3)
    assert any(len(e.bodies) == 2 for e in first.events)
    assert second.q.reshape(first.q.shape) == pytest.approx(first.q, abs=1e-5)


@pytest.mark.parametrize("d", D)
def test_a_fast_body_does_not_pass_through_a_thin_one(d):
    """Though it goes a hundred times its thickness in a step."""
    body = brick(0.02, *[1.0] * (d - 1))
    low = {"low": HalfSpace(np.eye(d)[-1], -50 * np.eye(d)[-1])}
    a = Arrangement({"A": body}, low, orientations="all")
    system = a.system(count=2)
    start = upright(a, [[0.0] * d, [-1.23, *[0.0] * (d - 1)]])
    v = np.zeros(start.shape)
    v[1, 0] = 200.0
    path = simulate(system, system.state(start, v), 0.05, 1e-2)
    assert path.v[-1, :, 0].sum() == pytest.approx(200.0, rel=1e-6)
    assert path.q[-1, 1, 0] < path.q[-1, 0, 0]


def test_threads_change_no_bit():
    _, path = dominoes(4, 2e-3)
    system = path.system
    start = system.state(path.q[0], path.v[0])
    one, two = (simulate(system, start, 0.5, 2e-3, solver=Solver(threads=n)).q for n in (1, 2))
    assert np.array_equal(one, two)


def falling(restitution=0.0):
    """Two bricks, one repeated and both listed, and where one falls on the other."""
    body = brick(1.0, 0.5)
    a, repeated = on_the_floor(body, 2, friction=0.4, restitution=restitution)
    two = Arrangement({"A1": body, "A2": body}, a.walls, orientations="all")
    listed = two.system(gravity=[0, -G], friction=0.4, restitution=restitution)
    start = np.array([[0, 0.25, 0], [0.4, 1.2, 0.3]])
    return (repeated, start), (listed, start.ravel())


def test_motions_of_sharp_bodies_are_saved_read_and_resumed(tmp_path):
    """The state alone decides which plane is chosen: a run that was stopped ends as another."""
    others = falling(restitution=0.1)
    for k, ((system, q), (other, _)) in enumerate(zip(falling(), others, strict=True)):
        whole = simulate(system, system.state(q), 0.4, 1e-3, every=50)
        file = save_trajectory(whole, tmp_path / f"{k}.nc")
        assert np.array_equal(load_trajectory(file, system).q, whole.q)
        with pytest.raises(ValueError, match=r"restitution|hulls|between"):
            load_trajectory(file, other)
        saved = Checkpoint(tmp_path / f"run {k}", seconds=0.0)

        pressed = []

        def stop(done, *_, pressed=pressed):
            if done > 0.2 and not pressed:
                pressed.append(signal.raise_signal(signal.SIGINT))

        options = {"every": 50, "checkpoint": saved}
        part = simulate(system, system.state(q), 0.4, 1e-3, progress=stop, **options)
        assert not part.finished
        again = simulate(system, system.state(q), 0.4, 1e-3, **options)
        assert np.array_equal(again.q, whole.q)


def many_sided(count):
    angles = 2 * np.pi * np.arange(count) / count
    return polygon(np.column_stack([np.cos(angles), np.sin(angles)]))


def test_what_is_refused_is_refused_at_once():
    with pytest.raises(
        ValueError, match=r"^bodies: expected at most 64 vertices of 'A1', .* got 65"
    ):
        on_the_floor(many_sided(65), 2)
    with pytest.raises(NotImplementedError, match=r"^rolling: expected 0 between sharp polygons"):
        on_the_floor(brick(1, 1), 2, rolling={"between": 0.1})
    walls = {"low": HalfSpace([0, 1], [0, 0])}
    listed = Arrangement([brick(1, 1)] * 2, walls, orientations="all").system()
    with pytest.raises(NotImplementedError, match=r"^system: .* none of two sharp hulls"):
        accelerations(listed, listed.state([0, 0.5, 0, 1, 0.5, 0]))
    with pytest.raises(NotImplementedError, match=r"^rolling: expected 0 between sharp polygons"):
        Arrangement([brick(1, 1)] * 2, {"low": HalfSpace([0, 1], [0, 0])}).system(rolling=0.1)
