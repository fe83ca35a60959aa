"""Unions in first-order motion: pieces, edges that are left, and corners with continuations."""

import math
from statistics import NormalDist

import numpy as np
import pytest
import sympy as sp

from polycorner import AllOf, AnyOf, Drift, Manifold, Polyhedron, System, simulate, velocities
from polycorner.formulas import SmoothFunction
from polycorner.models import Pinball
from polycorner.motion import Checkpoint, EventKind, Noise

PLANE = Manifold.euclidean("x y")
X, Y = PLANE.symbols


def named(**given):
    return [SmoothFunction(name, e, PLANE) for name, e in given.items()]


ROOF = Polyhedron(PLANE, AnyOf(*named(right=Y + X, left=Y - X)))  # outside of y < -|x|


def test_a_point_slides_down_a_roof_on_the_side_where_it_falls():
    drift = Drift(ROOF, {"y": -1})
    for x in (0.3, -0.3):
        path = simulate(drift, drift.state([x, 1.0]), 2.0, 0.01)
        # it meets the roof at y = -|x|, and slides with (1, -1) / 2
        slid = (2.0 - (1.0 + abs(x))) / 2
        assert path.q[-1, 0] == pytest.approx(
            [x + math.copysign(slid, x), -abs(x) - slid], abs=1e-6
        )
        assert not path.splits


def test_a_point_leaves_an_edge_where_the_next_side_opens_and_the_order_is_two():
    """Along a step's tread and over its edge, under a wish that turns: u = (1, -t)."""
    from polycorner.motion import time_symbol

    D = Polyhedron(PLANE, AnyOf(*named(tread=Y, beyond=X)))  # outside of the quadrant x, y < 0
    drift, errors = Drift(D, {"x": 1, "y": -time_symbol()}), []
    for n in (13, 27, 55):
        path = simulate(drift, drift.state([-0.5, 0.0]), 1.0, 1.0 / n)
        exact = [0.5, -(1.0 - 0.25) / 2]
        errors.append(np.abs(path.q[-1, 0] - exact).max())
    assert errors[-1] < 1e-6 or errors[-1] < errors[0] / 10
    assert path.effort.parts == 1


def test_at_a_corner_the_motion_splits_and_goes_on_in_each_piece():
    drift = Drift(ROOF, {"x": 0.3, "y": -2.0})
    path = simulate(drift, drift.state([-0.3, 2.0]), 3.0, 0.01)
    (split,) = path.splits
    assert split.time == pytest.approx(1.0, abs=1e-6)
    assert split.q == pytest.approx([0.0, 0.0], abs=1e-6)
    assert set(split.pieces) == {("left",), ("right",)}
    (event,) = path.of_kind(EventKind.SPLIT)
    assert (event.time, event.bodies) == (split.time, (0,))
    # in each the wish is projected onto its side of the roof
    u = np.array([0.3, -2.0])
    sides = {"right": np.array([1.0, -1.0]), "left": np.array([1.0, 1.0])}
    for piece, state in zip(split.pieces, split.states, strict=True):
        end = simulate(drift, state, 3.0, 0.01).q[-1, 0]
        side = sides[piece[0]] / math.sqrt(2)
        assert end == pytest.approx(2.0 * (u @ side) * side, abs=1e-6)


def test_the_piece_that_is_taken_is_the_nearest():
    for x in (0.3, -0.3):
        drift = Drift(ROOF, {"x": x, "y": -1.0})
        (split,) = simulate(drift, drift.state([-x, 1.0]), 1.5, 0.01).splits
        assert split.pieces[split.taken] == (("left",) if x < 0 else ("right",))


def test_a_corner_that_one_piece_admits_is_none():
    """A wish that goes along one side beyond the corner has one continuation."""
    drift = Drift(ROOF, {"x": 1.0, "y": 1.0})
    path = simulate(drift, drift.state([-1.0, -1.0 + 2.0 - 0.0]), 1.0, 0.1)
    assert not path.splits


def test_splits_of_an_interrupted_run_are_kept(tmp_path):
    class StopError(Exception):
        pass

    def stop(done, *_):
        if done > 1.5:
            raise StopError

    drift = Drift(ROOF, {"x": 0.3, "y": -2.0}, count=2)
    start = drift.state([[-0.3, 2.0], [0.5, 1.0]])
    saves = Checkpoint(tmp_path / "run", seconds=0)
    with pytest.raises(StopError):
        simulate(drift, start, 2.0, 0.01, every=10, checkpoint=saves, progress=stop)
    path = simulate(drift, start, 2.0, 0.01, every=10, checkpoint=saves)
    whole = simulate(drift, start, 2.0, 0.01, every=10)
    (here,), (there,) = path.splits, whole.splits
    assert (here.time, here.body, here.pieces, here.taken) == (
        there.time,
        there.body,
        there.pieces,
        there.taken,
    )
    assert all((a.q == b.q).all() for a, b in zip(here.states, there.states, strict=True))


def test_a_system_takes_a_union_as_one_contact():
    """A ball bounces off the side of a roof that it meets, along the normal of that side."""
    vx, vy = velocities(PLANE)
    roof = SmoothFunction.quantity("roof", sp.Max(Y + X, Y - X), PLANE)
    ball = System(Polyhedron(PLANE, [roof]), (vx**2 + vy**2) / 2, restitution=1.0)
    for x in (0.3, -0.3):
        path = simulate(ball, ball.state([x, 1.0], [0.0, -1.0]), 2.0, 0.01)
        # it meets the roof at |x|, and goes off sideways
        assert path.q[-1, 0] == pytest.approx([x + math.copysign(0.7, x), -0.3], abs=1e-9)


def test_pieces_with_several_functions_hold_together():
    """Two rooms and a door: a union of boxes that overlap in it."""
    left = AllOf(*named(l0=X, l1=1 - X, l2=Y, l3=1 - Y))
    right = AllOf(*named(r0=X - 0.9, r1=2 - X, r2=Y - 0.4, r3=0.6 - Y))
    D = Polyhedron(PLANE, AnyOf(left, right))
    drift = Drift(D, {"x": 1.0, "y": 0.5})
    path = simulate(drift, drift.state([0.2, 0.3]), 4.0, 0.01)
    assert D.implicit(path.q[:, 0]).min() > -1e-9
    assert path.q[-1, 0] == pytest.approx([1.0, 1.0], abs=1e-6) or path.q[-1, 0] == pytest.approx(
        [2.0, 0.6], abs=1e-6
    )
    through = simulate(drift, drift.state([0.2, 0.1]), 4.0, 0.01)
    assert through.q[-1, 0] == pytest.approx([2.0, 0.6], abs=1e-6)


# -------------------------------------------------------------------------------------- pinball


def galton(rows=2):
    """Roofs in a triangle: each edge is above the tip of a roof of the next row."""
    wedges = [
        ((4 + 2 * j - i, 7 - 2 * i), (4 + 2 * j - i - 1, 6 - 2 * i), (4 + 2 * j - i + 1, 6 - 2 * i))
        for i in range(rows)
        for j in range(i + 1)
    ]
    return Pinball(width=8, height=8, pins=(), wedges=wedges, cups=(), tilt=math.pi / 2)


def continued(drift, state, t_end, dt):
    """Yield the ends of all continuations of a motion."""
    path = simulate(drift, state, t_end, dt)
    if not path.splits:
        yield path.q[-1, 0]
        return
    for after in path.splits[0].states:
        yield from continued(drift, after, t_end, dt)


def test_a_galton_board_has_all_its_continuations():
    board = galton()
    drift = Drift(board.polyhedron, potential=board.energy)
    ends = sorted(
        round(float(x), 6) for x, y in continued(drift, drift.state([4.0, 7.5]), 30.0, 0.05)
    )
    # two rows: the pockets 2, 4 and 6 by one, two and one ways
    assert ends == [2.0, 4.0, 4.0, 6.0]


def test_a_ball_that_falls_beside_a_tip_diffuses_past_it():
    """It goes to the right with the probability that its way down has led it there: Phi(x / sd)."""
    count, noise, x, fall = 1500, 0.005, 0.1, 1.5
    start = np.full((count, 2), [4.0 + x, 6.0 + fall])
    board = Pinball(
        width=8, height=8, pins=(), cups=(), tilt=math.pi / 2, wedges=[((4, 6), (3, 5), (5, 5))]
    )
    drift = Drift(board.polyhedron, potential=board.energy, noise=noise, count=count)
    path = simulate(drift, drift.state(start), 5.0, 0.02, noise=Noise(seed=11))
    share = np.mean(path.q[-1, :, 0] > 4)
    exact = NormalDist().cdf(x / math.sqrt(2 * noise * fall))
    assert share == pytest.approx(exact, abs=4 * math.sqrt(exact * (1 - exact) / count) + 0.01)
