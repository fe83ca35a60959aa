"""Thin rods that turn and fly pass through nothing: oracles are straight flights, in samples."""

import numpy as np
import pytest

from polycorner import simulate
from polycorner.bodies import Arrangement, HalfSpace, capsule, polygon
from polycorner.motion import EventKind
from tests.support.rods import distance

RADIUS, HALF = 0.01, 1.0
ROD = capsule([-HALF, 0], [HALF, 0], RADIUS)
INSTANTS = 20_001


def two(count):
    """Two rods in the plane: repeated, listed, or of two kinds."""
    if count == "repeated":
        return Arrangement({"A": ROD}, orientations="all").system(count=2, restitution=0.5)
    listed = Arrangement({"A": ROD, "B": ROD}, orientations="all")
    return listed.system(count={"A": 1, "B": 1} if count == "kinds" else 1, restitution=0.5)


def start(system, q, v=None):
    v = np.zeros((2, 3)) if v is None else np.asarray(v, dtype=float)
    q = np.asarray(q, dtype=float)
    return (
        system.state(q, v) if system.bodies.shape == (2, 3) else system.state(q.ravel(), v.ravel())
    )


def flights(seed, number, duration):
    """Fast rods that fly towards each other and turn, and when they meet first, or None."""
    rng = np.random.default_rng(seed)
    while number:
        q = np.column_stack([rng.uniform(-2, 2, (2, 2)), rng.uniform(-3, 3, 2)])
        v = np.column_stack([-q[:, :2] * rng.uniform(1, 6), rng.uniform(-40, 40, 2)])
        v[:, :2] += rng.normal(scale=2, size=(2, 2))
        t = np.linspace(0, duration, INSTANTS)[:, None]
        gap = distance(*(q[k] + t * v[k] for k in range(2)), HALF) - 2 * RADIUS
        met = np.flatnonzero(gap < 0)
        # What nearly touches meets or misses by what is between two samples.
        if gap[0] < 0.05 or (not len(met) and gap.min() < 2e-3):
            continue
        number -= 1
        yield q, v, float(t[met[0], 0]) if len(met) else None


@pytest.mark.parametrize("count", ["repeated", "listed", "kinds"])
@pytest.mark.parametrize("dt", [0.2, 0.05])
def test_rods_meet_or_miss_whatever_the_step(count, dt):
    system, duration = two(count), 0.4
    hits = 0
    for q, v, met in flights(3, 25, duration):
        path = simulate(system, start(system, q, v), duration, dt)
        first = next((e for e in path.events if e.kind is not EventKind.LOST), None)
        if first is not None and first.kind is EventKind.FAILED:
            continue
        assert (first is None) == (met is None)
        if met is not None:
            hits += 1
            assert first.time == pytest.approx(met, abs=1e-4)
    assert hits > 10


@pytest.mark.parametrize("dt", [0.02, 0.1])
def test_a_rod_that_spins_meets_a_wall_whatever_the_step(dt):
    """It does so when an end is below the wall for the first time."""
    wall = {"floor": HalfSpace([0, 1], [0, 0])}
    system = Arrangement({"A": ROD}, wall, orientations="all").system(restitution=0.5)
    rng, duration = np.random.default_rng(5), 0.3
    t = np.linspace(0, duration, INSTANTS)
    for _ in range(20):
        q = np.array([0.0, rng.uniform(1.05, 1.3), rng.uniform(-3, 3)])
        v = np.array([0.0, rng.uniform(-1, 0.5), rng.uniform(-40, 40)])
        low = q[1] + t * v[1] - HALF * abs(np.sin(q[2] + t * v[2])) - RADIUS
        if abs(low.min()) < 1e-3:
            continue
        path = simulate(system, system.state(q, v), duration, dt)
        first = next((e.time for e in path.events), None)
        if low.min() > 0:
            assert first is None
        else:
            assert first == pytest.approx(t[np.flatnonzero(low < 0)[0]], abs=1e-4)


def between_segments(p, q, r, s):
    """Distance of segments in space, from the definition: the least over a grid, refined."""
    u, v, w = q - p, s - r, p - r
    best = np.inf
    for a in (0.0, 1.0):
        x = p + a * u
        t = np.clip((x - r) @ v / (v @ v), 0, 1)
        best = min(best, np.linalg.norm(x - r - t * v))
        y = r + a * v
        t = np.clip((y - p) @ u / (u @ u), 0, 1)
        best = min(best, np.linalg.norm(y - p - t * u))
    A = np.array([[u @ u, -u @ v], [-u @ v, v @ v]])
    if np.linalg.det(A) > 1e-12:
        a, b = np.linalg.solve(A, [-u @ w, v @ w])
        if 0 <= a <= 1 and 0 <= b <= 1:
            best = min(best, np.linalg.norm(w + a * u - b * v))
    return best


def test_rods_in_space_touch_nowhere_in_a_step_without_events():
    rod = capsule([0, 0, -HALF], [0, 0, HALF], RADIUS)
    system = Arrangement({"A": rod}).system(count=2, restitution=1.0)
    rng, dt, steps = np.random.default_rng(11), 0.02, 12
    met = 0
    for _ in range(12):
        x = rng.uniform(-0.7, 0.7, (2, 3))
        axes = rng.normal(size=(2, 3))
        axes /= np.linalg.norm(axes, axis=1)[:, None]
        turn = np.cross(rng.normal(scale=10, size=(2, 3)), axes)
        q = np.column_stack([x, axes])
        v = np.column_stack([-x * rng.uniform(5, 20), turn])
        try:
            state = system.state(q, v)
        except ValueError:
            continue
        path = simulate(system, state, steps * dt, dt, every=1)
        met += len(path.events) > 0
        times = np.array([e.time for e in path.events])
        for k in range(steps):
            # The way to the next midpoint counts as well: there a contact is met before it.
            if ((times > (k - 1) * dt) & (times < (k + 2) * dt)).any():
                continue
            middle = path.q[k] + dt / 2 * path.v[k]
            for a in np.linspace(0, 1, 40):
                for begin, end in ((path.q[k], middle), (middle, path.q[k + 1])):
                    now = begin + a * (end - begin)
                    ends = [
                        now[i, :3] + side * HALF * now[i, 3:] for i in (0, 1) for side in (-1, 1)
                    ]
                    assert between_segments(*ends) > 2 * RADIUS * (1 - 1e-3)
    assert met > 2


@pytest.mark.parametrize("count", ["repeated", "listed", "kinds"])
def test_rods_that_cross_are_refused_as_contains_refuses_them(count):
    system = two(count)
    listed = Arrangement({"A": ROD, "B": ROD}, orientations="all").polyhedron
    rng = np.random.default_rng(2)
    refused = 0
    for _ in range(40):
        q = rng.uniform(-1, 1, (2, 3)) * [1, 1, 3]
        gap = distance(q[0], q[1], HALF) - 2 * RADIUS
        assert listed.contains(q.ravel()) == (gap >= 0)
        if gap < 0:
            refused += 1
            with pytest.raises(ValueError, match=r"without overlap; bodies .* (cross|overlap)"):
                start(system, q)
        else:
            start(system, q)
    assert refused > 10


def test_rods_that_cross_a_fixed_body_or_a_rounded_polygon_are_refused():
    square = polygon([[-1, -1], [1, -1], [1, 1], [-1, 1]], 0.1)
    bar = {"bar": capsule([-5, 0], [5, 0], 0.1)}
    system = Arrangement({"A": ROD}, fixed=bar, orientations="all").system()
    with pytest.raises(ValueError, match="cross each other"):
        system.state([0.0, 0.0, 1.5])
    system.state([0.0, 2.0, 1.5])
    long = capsule([-3, 0], [3, 0], 0.1)
    both = Arrangement({"A": long, "B": square}, orientations="all").system()
    with pytest.raises(ValueError, match="without overlap"):
        both.state([0.0, 0.0, 0.3, 0.0, 0.0, 0.0])


def test_rods_that_cross_an_image_are_refused():
    box = Arrangement({"A": ROD}, orientations="all", period=[5.0, 5.0]).system(count=2)
    with pytest.raises(ValueError, match="cross each other"):
        box.state([[0.1, 2.5, 0.0], [4.9, 2.6, 1.5]])
    box.state([[1.1, 2.5, 0.0], [4.0, 2.6, 1.5]])
