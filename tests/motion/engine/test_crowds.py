"""Islands of thousands of bodies: a few sweeps, by any number of threads."""

from functools import cache
from typing import get_type_hints

import numpy as np
import pytest
import sympy
from scipy.spatial import cKDTree

from polycorner import Friction, Manifold, Polyhedron, System, velocities
from polycorner.bodies import Arrangement, HalfSpace, Mass, disc, sphere
from polycorner.motion import ContactFamily, Disc, pair_coordinates
from polycorner.motion.checkpoints import Checkpoint
from polycorner.motion.engine.arrays import (
    CONTACTS,
    OWN,
    RESIDUAL,
    LimitWork,
    TieWork,
    Work,
    declarations,
)
from polycorner.motion.engine.crowds import CROWD, PERIOD
from polycorner.motion.noise import OPTIONS, Solver
from polycorner.motion.simulation import simulate, start
from tests.motion.engine.inclusion import residuals, response

SIDE, MU, DT = 22, 0.3, 5e-3
TRAY = {
    "floor": HalfSpace([0, 1], [0, 0]),
    "left": HalfSpace([1, 0.2], [0, 0]),
    "right": HalfSpace([-1, 0.2], [2.2 * SIDE, 0]),
}


@cache
def discs(gravity, friction, count, rolling=0.0):
    """Return the system of discs in a tray."""
    arrangement = Arrangement({"D": disc(1.0)}, TRAY, orientations="all")
    laws = {"friction": friction, "rolling": rolling}
    return arrangement.system(gravity=[0, -gravity], count=count, **laws)


def heap(friction=MU, rolling=0.0, **settings):
    """Return the engine of discs that fall on each other."""
    system = discs(10.0, friction, SIDE**2, rolling)
    rows, columns = np.divmod(np.arange(SIDE**2), SIDE)
    places = np.stack([1.6 + 2.01 * columns + rows % 2, 1.01 + 1.75 * rows], axis=-1)
    state = system.state(np.column_stack([places, 0 * rows]))
    return start(system, state, DT, solver=Solver(tolerance=1e-4, **settings))


def crowds(engine):
    """Return the blocks of every crowd of the last step."""
    starts = engine.work.island.start
    roots = np.flatnonzero(np.diff(starts) > CROWD)
    return [engine.work.block.order[starts[i] : starts[i + 1]] for i in roots]


def listed_pairs(engine):
    """Return the pairs of bodies with contacts in the list between steps."""
    motion = engine.motion
    ranks = np.stack(divmod(motion.keys[: motion.counts[CONTACTS]], SIDE**2))
    return set(map(tuple, np.sort(motion.body_of_rank[ranks], axis=0).T.tolist()))


def test_threads_share_no_array_in_which_something_is_in_the_making():
    """Items write to rows of their own; all else is a thread's own or told.

    Of the rows of bodies some hold the matrix of an island, and are a thread's own as well.
    """
    rows = {"N", "N+1", "U", "F", "R", "B", "C", "P", "V"}
    whole = {
        f"{part}.{name}"
        for part, record in get_type_hints(Work).items()
        for name, d in declarations(record).items()
        if part not in OWN and d.shape.split()[0] not in rows
    }
    serial = {"neighbours.status", "neighbours.travel", "manner.near", "pair.sort_keys"}
    serial |= {"crowd.strips", "crowd.strip_cursor", "crowd.strip_start"}
    serial |= {f"tie.{name}" for name in TieWork._fields}
    serial |= {f"limit.{name}" for name in LimitWork._fields if name != "landing"}
    names = ("finite", "signals", "told", "times", "worst", "gained", "sunk")
    told = {f"shared.{name}" for name in names}
    assert whole == serial | told | {"manner.located", "manner.remedy"}


@pytest.mark.parametrize(("sweeps", "rolling"), [(0, 0.0), (6, 0.0), (6, 0.1)])
def test_any_number_of_threads_makes_the_same_motion(sweeps, rolling):
    steps = 60 if sweeps else 10  # before there is a single island
    single, several = (heap(rolling=rolling, crowd_sweeps=sweeps, threads=n) for n in (1, 3))
    for engine in (single, several):
        engine.advance(steps)
    if sweeps:
        assert crowds(single)
        assert single.work.crowd.strips[0] > 4
    else:
        assert (np.diff(single.work.island.start) > 0).sum() > 4
    for name, array in single.save().items():
        np.testing.assert_array_equal(several.save()[name], array, err_msg=name)


def test_a_run_goes_on_with_another_number_of_threads(tmp_path):
    system, state = discs(10.0, MU, 9), np.zeros((9, 3))
    state[:, 0], state[:, 1] = 2.0 + 2.5 * np.arange(9), 1.5
    begun = system.state(state)

    def stop(done, _total, _note):
        if done > 0.2:
            raise KeyboardInterrupt

    whole = simulate(system, begun, 0.5, 1e-2, solver=Solver(threads=2))
    with pytest.raises(KeyboardInterrupt):
        simulate(system, begun, 0.5, 1e-2, checkpoint=Checkpoint(tmp_path), progress=stop, every=1)
    rest = simulate(
        system, begun, 0.5, 1e-2, solver=Solver(threads=2), checkpoint=Checkpoint(tmp_path), every=1
    )
    np.testing.assert_array_equal(rest.q[-1], whole.q[-1])


def test_contacts_are_listed_in_the_order_of_ranks_which_are_an_order_in_space():
    engine = heap(crowd_sweeps=6)
    engine.advance(PERIOD + 1)  # ranks were renewed in the last step
    motion, bodies = engine.motion, np.arange(SIDE**2)
    np.testing.assert_array_equal(motion.body_of_rank[motion.rank], bodies)
    # Columns across the longer extent, and up in each of them; in the step bodies moved a little.
    x, y = motion.q[motion.body_of_rank, :2].T
    back, down = np.diff(x) < -0.01, np.diff(y) < -0.01
    assert x.max() - x.min() > y.max() - y.min()
    assert down.sum() < np.ptp(x)  # no more than there are columns
    assert (np.diff(x)[back] > -2.1).all()
    assert (np.diff(motion.keys[: motion.counts[CONTACTS]]) > 0).all()
    assert cKDTree(motion.q[:, :2]).query_pairs(2.0) <= listed_pairs(engine)
    touching = {bodies for bodies, name, _ in engine.touching() if len(bodies) == 2}
    assert touching
    assert touching <= cKDTree(motion.q[:, :2]).query_pairs(2.0 + 1e-3)


def test_a_crowd_goes_on_from_where_it_was_saved_with_the_ranks_of_then():
    whole, part = (heap(crowd_sweeps=6) for _ in range(2))
    whole.advance(PERIOD + 40)
    part.advance(PERIOD - 20)
    resumed = heap(crowd_sweeps=6)
    resumed.load({name: array.copy() for name, array in part.save().items()})
    resumed.advance(60)
    assert (resumed.motion.rank != part.motion.rank).any()
    for name, array in whole.save().items():
        np.testing.assert_array_equal(resumed.save()[name], array, err_msg=name)


def test_a_step_with_new_ranks_starts_from_the_impulses_of_the_step_before():
    """The same contacts are known from before, and a few sweeps solve it as well as other steps."""
    engine, left = heap(crowd_sweeps=6), []
    engine.advance(PERIOD - 3)
    for _ in range(6):
        ranks, pairs = engine.motion.body_of_rank.copy(), listed_pairs(engine)
        engine.motion.sums[RESIDUAL] = 0.0
        engine.advance(1)
        left.append(engine.effort.residual)
        renewed = (engine.motion.body_of_rank != ranks).any()
        assert renewed == (engine.steps == PERIOD + 1)
        work = engine.work
        known = work.pair.before[: work.neighbours.status[2]] >= 0
        met = [
            (i, j) in pairs for i, j in work.pair.contact[: work.neighbours.status[2], :2].tolist()
        ]
        np.testing.assert_array_equal(known, met)
    assert left[3] < 2.0 * max(left[:3] + left[4:])


@pytest.mark.parametrize("friction", [MU, 0.0])
def test_a_few_sweeps_leave_admissible_impulses_and_a_residual_that_is_told(friction):
    engine, met = heap(friction, crowd_sweeps=6), 0
    for _ in range(80):
        engine.motion.sums[RESIDUAL] = 0.0  # the residual, of all steps before
        engine.advance(1)
        work, blocks = engine.work, crowds(engine)
        if len(blocks) != 1:
            continue
        (blocks,) = blocks
        found, v = residuals(work, blocks, friction)
        bodies = np.unique(work.block.bodies[blocks])
        moved = bodies[(bodies >= 0) & ~engine.motion.rests[bodies].astype(bool)]
        np.testing.assert_allclose(work.velocity.new[moved], v[moved], atol=1e-9 * abs(v).max())
        normal, rubs = work.block.impulse[blocks, 0], work.block.pressing[blocks] >= 0
        limit = friction * work.block.impulse[work.block.pressing[blocks[rubs]], 0]
        assert (normal[~rubs] >= 0).all()
        assert (abs(normal[rubs]) <= limit * (1 + 1e-12)).all()
        speed = abs(work.block.free[blocks] + work.block.offset[blocks])
        speed[work.block.rows[blocks] < 2, 1] = 0.0
        assert engine.effort.residual == pytest.approx(found.max() / speed.max(), rel=1e-6)
        met += 1
    assert met > 20


def test_more_sweeps_come_nearer_to_the_solution():
    """Without friction a step is a convex problem, to which sweeps converge."""
    begun = heap(friction=0.0, crowd_sweeps=20)
    begun.advance(60)
    left = []
    for sweeps in (10, 1000, 10000):
        engine = heap(friction=0.0, crowd_sweeps=sweeps)
        engine.load({name: array.copy() for name, array in begun.save().items()})
        engine.motion.sums[RESIDUAL] = 0.0
        engine.advance(1)
        assert crowds(engine)
        left.append(engine.effort.residual)
    assert left[1] < 0.1 * left[0]
    assert left[2] < 1e-10


def swept_plainly(work, blocks, sweeps):
    """Return the impulses after Gauss-Seidel sweeps from none, each contact solved in its turn."""
    v, p, K = work.velocity.free.copy(), np.zeros(len(blocks)), work.velocity.free.shape[1]
    sides = [
        [
            (i, work.block.jacobian[b, 0, side * K : side * K + K], response(work, b, side, i)[0])
            for side, i in enumerate(work.block.bodies[b])
            if i >= 0
        ]
        for b in blocks
    ]
    for _ in range(sweeps):
        for k, b in enumerate(blocks):
            u = work.block.offset[b, 0] + sum(row @ v[i] for i, row, _ in sides[k])
            new = max(0.0, p[k] - u / sum(row @ answer for _, row, answer in sides[k]))
            for i, _, answer in sides[k]:
                v[i] += (new - p[k]) * answer
            p[k] = new
    return p


def dual_energy(work, blocks, impulse):
    """Return ``p' W p / 2 + p' c``, which the impulses of a frictionless step minimise."""
    work.block.impulse[blocks, 0], K = impulse, work.velocity.free.shape[1]
    v = residuals(work, blocks, 0.0)[1]
    sides = work.block.jacobian[blocks, 0].reshape(len(blocks), 2, K)
    rows = np.einsum("bsk,bsk->bs", sides, v[work.block.bodies[blocks]])
    after = np.where(work.block.bodies[blocks] >= 0, rows, 0.0).sum(axis=1)
    return impulse @ (0.5 * (after + work.block.free[blocks, 0]) + work.block.offset[blocks, 0])


def test_sweeps_come_nearer_to_the_solution_than_if_each_contact_were_solved():
    """Frictionless discs that lie on each other, from no impulses: over-relaxation reaches on."""
    begun = heap(friction=0.0, crowd_sweeps=20)
    begun.advance(60)
    saved = {name: array.copy() for name, array in begun.save().items()}
    saved["normal"][:] = saved["pair_impulse"][:] = 0.0
    found = []
    for sweeps in (20, 2000):
        engine = heap(friction=0.0, crowd_sweeps=sweeps)
        engine.load({name: array.copy() for name, array in saved.items()})
        engine.advance(1)
        (blocks,) = crowds(engine)
        blocks = np.sort(blocks[engine.work.block.rows[blocks] == 0])
        found.append(engine.work.block.impulse[blocks, 0].copy())
    few, least, plain = (
        dual_energy(engine.work, blocks, p)
        for p in (*found, swept_plainly(engine.work, blocks, 20))
    )
    assert 0.0 < few - least < 0.7 * (plain - least)


def test_surroundings_that_are_far_press_on_no_body():
    """What a body remembers of a contact is forgotten where there is none, and kept elsewhere."""
    engine = heap(crowd_sweeps=6)
    engine.advance(60)
    motion = engine.motion
    for array in (motion.normal, motion.pressed, motion.friction, motion.sticks):
        array[:] = 1
    engine.advance(1)
    apart = (engine.work.mid.gap.reshape(SIDE**2, -1) > 0.5).all(axis=1)
    assert 0.5 * SIDE**2 < apart.sum() < SIDE**2 - 10
    for array in (motion.normal, motion.pressed, motion.friction, motion.sticks):
        assert not array.reshape(SIDE**2, -1)[apart].any()
    assert motion.normal.reshape(SIDE**2, -1)[~apart].any()
    assert motion.sticks.reshape(SIDE**2, -1)[~apart].any()


def test_discs_that_overlap_are_moved_apart_and_keep_their_velocities():
    """A lattice that flies, pressed together across: nothing acts on it but the correction."""
    count, width = 800, 4
    system = discs(0.0, 0.0, count)
    rows, columns = np.divmod(np.arange(count), width)
    places = np.column_stack([10 + 2.0 * columns, 10 + 2.0 * rows, 0 * rows])
    velocity = np.broadcast_to([0.5, 0.0, 0.0], places.shape)
    engine = start(system, system.state(places, velocity), DT, solver=Solver(crowd_sweeps=3))
    engine.motion.q[:, 0] = 10 + 0.99 * (places[:, 0] - 10)
    engine.advance(1)
    assert crowds(engine)
    engine.advance(300)
    near = cKDTree(engine.motion.q[:, :2]).query_pairs(2.0, output_type="ndarray")
    apart = np.linalg.norm(np.diff(engine.motion.q[near, :2], axis=1)[:, 0], axis=1)
    assert 2.0 - apart.min() < 1.1 * OPTIONS.crowd_overlap * engine.model.gap_unit
    np.testing.assert_array_equal(engine.motion.v, velocity)


def test_friction_of_two_rows_obeys_its_law_in_a_crowd():
    """Discs pushed together, and on along a table, on which each slides in any direction.

    The friction of each is the point of its disc of forces that is nearest to ``p - rho u``, for
    any ``rho > 0``, and the impulses are those by which velocities changed.
    """
    side, mu, weight = 24, 0.4, 10.0
    M = Manifold.euclidean("x y")
    (x1, y1), (x2, y2) = pair_coordinates(M)
    table = System(
        Polyhedron(M, {"wall": M.symbols[0]}),
        sum(v**2 for v in velocities(M)) / 2,
        0.0,
        friction=[Friction("table", list(velocities(M)), Disc(mu), load=[weight])],
        count=side**2,
        between=ContactFamily({"discs": sympy.sqrt((x2 - x1) ** 2 + (y2 - y1) ** 2) - 2}, reach=2),
    )
    rows, columns = np.divmod(np.arange(side**2), side)
    places = np.column_stack([50 + 2.0 * columns + rows % 2, 50 + np.sqrt(3) * rows])
    pushed = [0.2, 0.1] - 0.5 * (places - places.mean(axis=0)) / side
    solver = Solver(tolerance=1e-4, crowd_sweeps=200)
    engine = start(table, table.state(places, pushed), DT, solver=solver)
    engine.advance(5)
    (blocks,) = crowds(engine)
    work, motion = engine.work, engine.motion
    rubs = blocks[work.block.rows[blocks] == 2]
    assert len(rubs) == side**2
    p, u = work.block.impulse[rubs], motion.v[work.block.bodies[rubs, 0]]
    nearest, limit = p - u, mu * weight * DT
    far = np.linalg.norm(nearest, axis=1, keepdims=True)
    nearest = np.where(far > limit, limit * nearest / far, nearest)
    assert (far > limit).any()
    assert abs(nearest - p).max() < 1e-3 * abs(pushed).max()
    others = blocks[work.block.rows[blocks] == 0]
    v = work.velocity.free.copy()
    for b in others:
        for i, row in zip(
            work.block.bodies[b], work.block.jacobian[b, 0].reshape(2, -1), strict=True
        ):
            v[i] += work.block.impulse[b, 0] * row
    v[work.block.bodies[rubs, 0], :2] += p
    moved = ~motion.rests.astype(bool)  # others have exactly the velocity of rest
    assert moved.sum() > 50
    np.testing.assert_allclose(work.velocity.new[moved], v[moved], atol=1e-12)


def pile_in_space(body, **settings):
    """Return system and state of a cube of bodies that touch, all of which spin."""
    floor, n = {"floor": HalfSpace([0, 0, 1], [0, 0, 0])}, 7
    centres = 2 * np.stack(np.meshgrid(*[np.arange(n)] * 3), axis=-1).reshape(-1, 3) + [0, 0, 1]
    placed = np.column_stack([centres, np.tile([1.0, 0, 0, 0], (n**3, 1))])
    piled = Arrangement({"B": body}, floor, orientations="all")
    system = piled.system(gravity=[0, 0, -10.0], friction=MU, count=n**3, **settings)
    return system, system.state(placed, np.tile([0, 0, 0, 0, 0, 0, 0.5], (n**3, 1)))


def test_balls_in_space_are_swept():
    engine = start(*pile_in_space(sphere(1.0)), DT, solver=Solver(tolerance=1e-4, crowd_sweeps=20))
    engine.advance(20)
    assert crowds(engine)
    norms = np.linalg.norm(engine.motion.q[:, 3:], axis=1)
    np.testing.assert_allclose(norms, 1.0, atol=1e-4)
    assert engine.motion.q[:, 2].min() > 1 - 5 * OPTIONS.crowd_overlap


def test_other_bodies_in_space_are_not_swept():
    """Their mass matrix turns with them within a step, which sweeps ignore."""
    top = {"B": Mass(1.0, [0, 0, 0], [1.0, 1.0, 0.5])}
    pile = pile_in_space(sphere(1.0), masses=top)
    with pytest.raises(NotImplementedError, match="solver: expected crowd_sweeps=0 for bodies"):
        start(*pile, DT, solver=Solver(crowd_sweeps=20))
    start(*pile, DT, solver=Solver())
