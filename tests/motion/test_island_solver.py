"""What the compiled step is made of, and heaps: barriers of friction, bands, rest."""

from types import SimpleNamespace

import cvxpy as cp
import numpy as np
import pytest

from polycorner.dumbbells.drum import DumbbellDrum
from polycorner.dumbbells.dynamics.starts import bunch
from polycorner.motion.engine import compiled
from polycorner.motion.engine import driver as engine_room
from polycorner.motion.friction import CutDisc, Disc, Ellipse, Interval
from polycorner.motion.noise import Noise
from polycorner.motion.polygons import ConvexPolygon

SQUARE = ConvexPolygon([[0.5, 0.5], [-0.5, 0.5], [-0.5, -0.5], [0.5, -0.5]])
EDGES = {  # how far a force (load, x, y) is from the boundary: a product, from the definition
    Interval(lower=-0.2, upper=0.5): lambda n, x, _: (x + 0.2 * n) * (0.5 * n - x),
    Disc(0.4): lambda n, x, y: n**2 - (x**2 + y**2) / 0.4**2,
    Ellipse(0.5, 0.3): lambda n, x, y: n**2 - (x / 0.5) ** 2 - (y / 0.3) ** 2,
    CutDisc(0.5, 0.3): lambda n, x, y: (
        (n**2 - (x**2 + y**2) / 0.5**2) * (0.3 * n - x) * (0.3 * n + x)
    ),
    SQUARE: lambda n, x, y: (0.25 * n**2 - x**2) * (0.25 * n**2 - y**2),
}


def laid_out(shape):
    """One set as the compiled code reads it."""
    kind, numbers, vertices = shape.code
    vertices = np.asarray(vertices).reshape(-1, 2)
    return SimpleNamespace(
        kinds=[kind],
        sizes=np.array([[*numbers, 0, 0, 0, 0][:4]]),
        corner=[0, len(vertices)],
        vertices=vertices,
    )


@pytest.mark.parametrize("shape", EDGES, ids=lambda shape: type(shape).__name__)
def test_barriers_are_differentiated(monkeypatch, shape):
    """Slope and curvature of ``-log`` of the distance, against central differences."""
    for name in ("add_linear", "add_quadratic"):
        monkeypatch.setattr(compiled, name, getattr(compiled, name).py_func)
    scene, h = laid_out(shape), 1e-5
    at, out = np.array([1.3, 0.11, -0.07]), np.zeros(9)
    if isinstance(shape, Interval):
        at[2] = 0.0

    def slope(z):
        compiled.barrier.py_func(scene, 0, *z, out)
        return out[:3].copy()

    def value(z):
        return -np.log(EDGES[shape](*z))

    steps = h * np.eye(3)
    expected = [(value(at + d) - value(at - d)) / (2 * h) for d in steps]
    np.testing.assert_allclose(slope(at), expected, rtol=1e-6, atol=1e-8)
    curvature = np.array([(slope(at + d) - slope(at - d)) / (2 * h) for d in steps])
    slope(at)
    found = np.array([[out[3], out[4], out[5]], [out[4], out[6], out[7]], [out[5], out[7], out[8]]])
    if isinstance(shape, Interval):  # what it does not hold is not to vanish
        assert found[2, 2] == 1.0
        found[2, 2] = 0.0
    np.testing.assert_allclose(found, curvature, rtol=1e-6, atol=1e-7)


@pytest.mark.parametrize(("n", "width"), [(1, 0), (6, 5), (30, 7), (40, 0)])
def test_band_systems_are_solved(monkeypatch, n, width):
    monkeypatch.setattr(compiled, "never_inline", lambda: None)
    rng = np.random.default_rng(n)
    near = np.abs(np.subtract.outer(np.arange(n), np.arange(n))) <= width
    A = np.where(near, rng.normal(size=(n, n)), 0) + 3 * (width + 1) * np.eye(n)
    b = rng.normal(size=n)
    band = np.zeros(n * (2 * width + 1))
    for i, j in np.argwhere(near):
        band[i * (2 * width + 1) + width + j - i] = A[i, j]
    x = b.copy()
    assert compiled.solve_band.py_func(band, x, n, width, np.zeros(n, dtype=int))
    np.testing.assert_allclose(A @ x, b, atol=1e-10)


def test_a_matrix_without_a_pivot_is_refused(monkeypatch):
    monkeypatch.setattr(compiled, "never_inline", lambda: None)
    assert not compiled.solve_band.py_func(np.zeros(3), np.ones(3), 3, 0, np.zeros(3, dtype=int))


def test_chattering_heaps_are_solved():
    """Dumbbells that hold each other in many ways, their loads drawn anew twenty times a second."""
    drum = DumbbellDrum(count=12, floor=True)
    starts = bunch(drum, np.random.default_rng(3))
    engine = drum.engine(starts, noise=Noise(chatter=0.3, seed=1))
    engine.advance(4000)
    effort = engine.effort
    assert effort.islands > 1000
    assert effort.unconverged < 0.01 * effort.islands


def test_room_for_contacts_grows(monkeypatch):
    """Sleepers keep their contacts while others meet: both need room."""
    drum = DumbbellDrum(count=12, floor=True)
    starts = bunch(drum, np.random.default_rng(3))
    ample = drum.engine(starts)
    monkeypatch.setattr(engine_room, "CONTACTS_PER_BODY", 0)
    narrow = drum.engine(starts)
    assert narrow.capacity < ample.capacity
    for _ in range(300):  # a step done again starts from other impulses: equal to the tolerance
        ample.advance(1)
        narrow.advance(1)
        np.testing.assert_allclose(narrow.motion.q, ample.motion.q, atol=1e-4)
    assert narrow.capacity > 16


def spare(engine, before):
    """Return the largest share of the drum's friction without which a heap would still stay.

    From the definition, by Clarabel: are there forces in their sets that balance at rest?  The
    rows of contacts and the loads are the engine's, of the step that has just been done.
    """
    room, scene = engine.room, engine.scene
    k, count = scene.size, int(room.size[-1])
    p, share = cp.Variable((count, 2)), cp.Variable()
    sums = {i: room.mass[i] @ (room.free[i] - before[i]) for i in np.flatnonzero(room.awake)}
    rules = [share <= 1]
    for b in range(count):
        rows, owner = max(1, room.rows[b]), room.press_by[b]
        J, bodies = room.slant[b, :rows], [i for i in room.body[b] if i >= 0]
        for side, i in enumerate(bodies):
            if i in sums:
                sums[i] = sums[i] + J[:, k * side : k * side + k].T @ p[b, :rows]
        if room.rows[b] == 0:
            ends = [J[0, k * side : k * side + k] @ before[i] for side, i in enumerate(bodies)]
            opens = sum(ends) + room.offset[b, 0] > 1e-2
            rules.append(p[b, 0] == 0 if opens else p[b, 0] >= 0)
            continue
        drum = room.origin[b, 0] == 1
        shape = scene.shape[room.origin[b, 2], 0] if drum else scene.rub_shape[0]
        mu = scene.sizes[shape, 0 if scene.kinds[shape] == compiled.DISC else 1]
        load = (1 - share) * room.weight[b] if drum else p[owner, 0]
        rules.append(cp.norm(p[b, :rows]) <= mu * load)
    rules += [total == 0 for total in sums.values()]
    problem = cp.Problem(cp.Maximize(share), rules)
    problem.solve(solver=cp.CLARABEL)
    return share.value


def test_a_heap_stays_as_long_as_it_can():
    """Carried up by the drum, it slides when forces can balance no more, and not before.

    Friction is left to spare whenever it is asked and stays; within the solver's accuracy there is
    none when it goes.
    """
    drum = DumbbellDrum(count=8, floor=True)
    engine = drum.engine(bunch(drum, np.random.default_rng(3)))
    engine.advance(9500)
    left, slides = [], []
    while engine.time < 30:
        before, rested = engine.motion.v.copy(), engine.motion.rests.all()
        engine.advance(1)
        if rested and engine.room.awake.any():
            found = left if engine.motion.rests.all() else slides
            found.append(spare(engine, before))
    assert max(left) > 0.1
    assert min(left) > -1e-3
    assert len(slides) > 1
    assert max(map(abs, slides)) < 2e-3
