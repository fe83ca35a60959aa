"""Systems of one and of many bodies: contacts, arguments, and behaviour as values."""

import copy
import math
import multiprocessing
import pickle
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace

import numpy as np
import pytest
import sympy
from discs import (
    BETWEEN,
    DISCS,
    DISTANCE,
    KINETIC,
    SLOPE,
    SPINNING,
    START,
    VX,
    VY,
    G,
    M,
    X,
    Y,
    rubbing_discs,
)
from kept_files import same_motion as same

from polycorner import AnyOf, Manifold, Polyhedron
from polycorner.bodies import Arrangement, HalfSpace, capsule
from polycorner.dumbbells import DumbbellDrum
from polycorner.files import load_trajectory, save_trajectory
from polycorner.motion import (
    Checkpoint,
    ContactFamily,
    ConvexPolygon,
    CutDisc,
    Disc,
    Ellipse,
    EventKind,
    Friction,
    Interval,
    MechanicalSystem,
    Noise,
    PairFriction,
    Solver,
    System,
    pair_coordinates,
    simulate,
    velocities,
)

TRAY = Polyhedron(M, {"floor": Y - 1, "left": X - 1, "right": 4 - X})


# ------------------------------------------------------------------------------------- many bodies


def test_three_discs_rest_on_each_other_with_the_forces_of_statics():
    discs = System(TRAY, KINETIC, G * Y, count=3, between=replace(BETWEEN, restitution=0.0))
    top = 1 + math.sqrt(4 - 1.5**2)
    path = simulate(discs, discs.state([[1, 1], [4, 1], [2.5, top]]), 1.0, 1e-3)
    assert path.converged
    force = {(bodies, name): load for bodies, name, load in path.touching[-1]}
    rise = (top - 1) / 2
    assert force[(0, 2), "discs"] == pytest.approx(G / 2 / rise, rel=1e-6)
    assert force[(1, 2), "discs"] == pytest.approx(G / 2 / rise, rel=1e-6)
    assert force[(0,), "floor"] == pytest.approx(1.5 * G, rel=1e-6)
    assert force[(1,), "right"] == pytest.approx(G / 2 / rise * 0.75, rel=1e-6)


@pytest.mark.parametrize("e", [0.0, 0.5, 1.0])
def test_discs_collide_like_points_along_the_line_of_their_centres(e):
    free = System(
        Polyhedron(M, {"floor": Y + 100}), KINETIC, count=2, between=replace(BETWEEN, restitution=e)
    )
    path = simulate(free, free.state([[0, 0], [3, 0]], [[1, 0.5], [-1, 0.5]]), 2.0, 1e-3)
    np.testing.assert_allclose(path.v[-1], [[-e, 0.5], [e, 0.5]], atol=1e-9)
    assert path.kinetic[-1] == pytest.approx(path.kinetic[0] - (1 - e**2))
    assert abs(path.audit) < 1e-9


def test_bodies_without_contacts_between_them_move_as_if_alone():
    alone = System(SLOPE, KINETIC, G * Y)
    many = replace(alone, count=3)
    q = np.array([[2.0, 3.0], [2.0, 3.0], [5.0, 1.0]])
    path = simulate(many, many.state(q), 1.0, 1e-3)
    one = simulate(alone, alone.state(q[0]), 1.0, 1e-3)
    np.testing.assert_array_equal(path.q[:, 0], path.q[:, 1])
    np.testing.assert_array_equal(path.q[:, 0], one.q[:, 0])


def test_a_line_of_balls_is_a_system_of_one_coordinate_a_body():
    line = Manifold.euclidean("x")
    (x,), (v,) = line.symbols, velocities(line)
    (a,), (b,) = pair_coordinates(line)
    import sympy

    between = ContactFamily({"balls": sympy.Abs(b - a) - 1}, reach=1.0, restitution=1.0)
    balls = System(Polyhedron(line, {"wall": x + 100}), v**2 / 2, count=3, between=between)
    path = simulate(balls, balls.state([[0], [2], [4]], [[1], [0], [0]]), 4.0, 1e-3)
    np.testing.assert_allclose(path.v[-1, :, 0], [0, 0, 1], atol=1e-9)


def test_a_body_that_passes_the_limit_leaves():
    slide = System(SLOPE, KINETIC, G * Y, exits={"x": 3.0})
    path = simulate(slide, slide.state([2.0, 0.8], [4.0, -0.4]), 1.0, 1e-3)
    (event,) = path.of_kind(EventKind.EXIT)
    assert event.time == pytest.approx(0.25, abs=0.02)
    assert not path.present[-1, 0]
    assert path.work["left"][-1] < 0


def test_a_disc_that_turns_rubs_against_those_below():
    discs = rubbing_discs(Interval(0.5))
    far = [[1.0, 1.0, 0.0], [3.0, 1.0, 0.0], [2.0, 1 + math.sqrt(3), 0.0]]
    start = discs.state(far, [[0, 0, 0], [0, 0, 0], [0, 0, 6.0]])
    path = simulate(discs, start, 0.2, 5e-4, solver=Solver(1e-9))
    assert path.converged
    assert abs(path.v[-1, 2, 2]) < 6.0
    assert path.dissipated["rubbing"][-1] > 0
    assert path.audit < 1e-6


def test_bodies_on_a_belt_are_carried_and_at_rest():
    grip = Friction("grip", (VX - 0.3,), Interval(0.5), "floor")
    flat = Polyhedron(M, {"floor": Y - 1})
    blocks = System(flat, KINETIC, G * Y, friction=(grip,), count=2, substrate={"x": 0.3})
    start = blocks.state([[1.5, 1.0], [5.0, 1.0]])
    assert start.sticking.all()
    path = simulate(blocks, start, 1.0, 1e-3)
    assert path.rests[-1].all()
    np.testing.assert_allclose(path.q[-1], [[1.8, 1.0], [5.3, 1.0]], atol=1e-12)


def test_a_trajectory_of_many_bodies_is_read_back_from_its_file(tmp_path):
    path = simulate(DISCS, DISCS.state(START), 0.5, 1e-3)
    read = load_trajectory(save_trajectory(path, tmp_path / "discs.nc"), DISCS)
    same(read, path)
    other = replace(DISCS, between=replace(BETWEEN, gaps={"others": DISTANCE - 2}))
    with pytest.raises(ValueError, match="is of another system"):
        load_trajectory(tmp_path / "discs.nc", other)


# --------------------------------------------------------------------------------------- arguments


def floor(**changes):
    given = {"name": "floor", "slip": (VX,), "static": Interval(0.5), "load": "floor"} | changes
    return Friction(**given)


def family(**changes):
    return ContactFamily(**({"gaps": {"discs": DISTANCE - 2}, "reach": 2.0} | changes))


def rubbing(slip=None, **changes):
    return PairFriction(**({"slip": slip or {"discs": VX}, "static": Interval(0.3)} | changes))


def system(**changes):
    given = {"polyhedron": SLOPE, "kinetic": KINETIC, "potential": G * Y} | changes
    return System(**given)


def run(**changes):
    given = {"system": DISCS, "state": DISCS.state(START), "t_end": 0.1, "dt": 1e-3} | changes
    return simulate(**given)


UNION = Polyhedron(M, AnyOf(X, Y))
WRONG = [
    (lambda: floor(slip=(VX, VY)), ValueError, "slip"),
    (lambda: floor(static=0.5), TypeError, "static"),
    (lambda: floor(dynamic=Interval(0.6)), ValueError, "dynamic"),
    (lambda: floor(dynamic=Disc(0.1)), ValueError, "dynamic"),
    (lambda: family(gaps={}), ValueError, "gaps"),
    (lambda: family(gaps=[DISTANCE]), TypeError, "gaps"),
    (lambda: family(reach=0.0), ValueError, "reach"),
    (lambda: family(restitution=1.5), ValueError, "restitution"),
    (lambda: family(friction=[Interval(0.3)]), TypeError, "friction"),
    (lambda: family(friction=[rubbing({"other": VX})]), ValueError, "slip"),
    (lambda: family(friction=[rubbing(), rubbing({"discs": ()})]), ValueError, "slip"),
    (
        lambda: family(gaps={"discs": DISTANCE, "far": DISTANCE}, friction=[rubbing()]),
        ValueError,
        "slip",
    ),
    (lambda: rubbing(VX), TypeError, "slip"),
    (lambda: rubbing(static=0.3), TypeError, "static"),
    (lambda: rubbing(static=Disc(1)), ValueError, "slip"),
    (lambda: rubbing(static=Interval(lower=0, upper=1)), ValueError, "static"),
    (lambda: rubbing(dynamic=Interval(lower=0, upper=0.1)), ValueError, "dynamic"),
    (lambda: rubbing(dynamic=Interval(2)), ValueError, "dynamic"),
    (lambda: rubbing(dynamic=Disc(0.1)), ValueError, "dynamic"),
    (lambda: system(polyhedron=M), TypeError, "polyhedron"),
    (lambda: system(polyhedron=UNION), ValueError, "polyhedron"),
    (lambda: system(kinetic=VX), ValueError, "kinetic"),
    (lambda: system(potential=VX), ValueError, "potential"),
    (lambda: system(forces={"z": X}), ValueError, "forces"),
    (lambda: system(friction=("floor",)), TypeError, "friction"),
    (lambda: system(friction=(floor(load="roof"),)), ValueError, "load"),
    (lambda: system(friction=(floor(slip=(VX**2,)),)), ValueError, "slip"),
    (lambda: system(restitution=2.0), ValueError, "restitution"),
    (lambda: system(restitution={"roof": 0.5}), ValueError, "restitution"),
    (lambda: system(count=0), ValueError, "count"),
    (lambda: system(count=2, between="discs"), TypeError, "between"),
    (lambda: system(count=2, between=family(position=("z",))), ValueError, "position"),
    (lambda: system(substrate={"z": 1.0}), ValueError, "substrate"),
    (lambda: system(substrate={"x": 1.0, "y": 0.0}), ValueError, "substrate"),
    (
        lambda: system(count=2, between=family(position="y"), substrate={"x": 1.0}),
        ValueError,
        "substrate",
    ),
    (lambda: system(exits={"x": math.nan}), ValueError, "exits"),
    (lambda: DISCS.state(START[:2]), ValueError, "q"),
    (lambda: DISCS.state(START[0]), ValueError, "q"),
    (lambda: DISCS.state(START, START[:2]), ValueError, "v"),
    (lambda: DISCS.state(START - np.array([1, 0])), ValueError, "q"),
    (lambda: DISCS.state(np.tile(START[0], (4, 1))), ValueError, "q"),
    (lambda: run(system=SLOPE), TypeError, "system"),
    (lambda: run(state=START), TypeError, "state"),
    (lambda: run(state=replace(DISCS, count=2).state(START[:2])), ValueError, "state"),
    (lambda: run(t_end=-1.0), ValueError, "t_end"),
    (lambda: run(t_end=math.inf), ValueError, "t_end"),
    (lambda: run(t_end="soon"), TypeError, "t_end"),
    (lambda: run(dt=0.0), ValueError, "dt"),
    (lambda: run(dt=True), TypeError, "dt"),
    (lambda: run(dt=1e-300), ValueError, "dt"),
    (lambda: run(noise={}), TypeError, "noise"),
    (lambda: run(solver="x"), TypeError, "solver"),
    (lambda: DISCS.state(START, time=math.nan), ValueError, "time"),
    (lambda: run(every=0), ValueError, "every"),
    (lambda: run(every=1.5), TypeError, "every"),
    (lambda: run(noise=Noise(kicks={"z": 1.0})), ValueError, "kicks"),
    (lambda: Noise(chatter=-1.0), ValueError, "chatter"),
    (lambda: Noise(correlation_time=0.0), ValueError, "correlation_time"),
    (lambda: Noise(kicks={"x": -1.0}), ValueError, "kicks"),
    (lambda: Noise(seed=2**63), ValueError, "seed"),
    (lambda: Noise(seed=1.0), TypeError, "seed"),
    (lambda: Solver(tolerance=0.0), ValueError, "tolerance"),
    (lambda: Solver(sweeps=0), ValueError, "sweeps"),
    (lambda: Solver(crowd_sweeps=-1), ValueError, "crowd_sweeps"),
    (lambda: Solver(threads=0), ValueError, "threads"),
]


@pytest.mark.parametrize(("call", "kind", "argument"), WRONG)
def test_an_error_names_the_argument(call, kind, argument):
    with pytest.raises(kind, match=rf"^{argument}: expected "):
        call()


def test_an_overlap_names_the_bodies_and_the_contact():
    with pytest.raises(ValueError, match=r"bodies 1 and 3 overlap by 1\.5 at contact 'discs'"):
        DISCS.state([[1.2, 1.5], [3.5, 1.2], [1.2, 5.0], [4.0, 1.2]])


# ------------------------------------------------------------------------------------------ values


def trajectory():
    return simulate(DISCS, DISCS.state(START), 0.2, 1e-3, noise=Noise(kicks={"x": 0.1}, seed=3))


VALUES = {
    "System": lambda: DISCS,
    "rubbing": lambda: rubbing_discs(Interval(0.3)),
    "State": lambda: DISCS.state(START),
    "Friction": floor,
    "ContactFamily": lambda: BETWEEN,
    "Interval": lambda: Interval(lower=-0.1, upper=0.3),
    "CutDisc": lambda: CutDisc(0.5, 0.3),
    "Ellipse": lambda: Ellipse(0.5, 0.3),
    "ConvexPolygon": lambda: ConvexPolygon([(0.3, 0), (0, 0.2), (-0.3, 0), (0, -0.2)]),
    "Noise": lambda: Noise(chatter=0.1, kicks={"x": 0.1}),
    "Solver": lambda: Solver(1e-6),
    "Checkpoint": lambda: Checkpoint("state"),
    "DumbbellDrum": lambda: DumbbellDrum(count=2),
    "drum state": lambda: DumbbellDrum().state([[0.0, 0.0, 0.1]]),
    "Trajectory": trajectory,
}


def told(value):
    """What makes two values the same: descriptions, numbers, text."""
    if isinstance(value, MechanicalSystem):
        return repr(value.described())
    parts = sorted(vars(value).items())
    return repr([(k, told(v) if isinstance(v, MechanicalSystem) else v) for k, v in parts])


@pytest.fixture(scope="module")
def spawned():
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        yield pool


@pytest.mark.parametrize("name", VALUES)
def test_values_are_copied_pickled_and_sent_to_a_process(spawned, name):
    value = VALUES[name]()
    expected = told(copy.deepcopy(value))
    assert told(pickle.loads(pickle.dumps(value))) == expected
    assert told(spawned.submit(copy.copy, value).result()) == expected


def test_slips_that_are_shared_are_described_by_name_and_told_apart():
    """What is written of them is the same; what was compiled is not."""
    told = []
    for half in (1.0, 1.0, 1.0 + 1e-9):
        rod = capsule([0, 0, -half], [0, 0, half], 0.3)
        floor = {"floor": HalfSpace([0, 0, 1], [0, 0, 0])}
        a = Arrangement({"A": rod}, floor, orientations="all")
        told.append(a.system(friction={"between": 0.3}, count=2).described())
    (rubbing,) = told[0]["friction between bodies"]
    assert rubbing["static"] == "Disc(mu=0.3)"
    assert rubbing["A1-A2"] == ["A1-A2 s0", "A1-A2 s1"]
    assert told[0] == told[1]
    assert told[0]["friction between bodies"] == told[2]["friction between bodies"]
    assert told[0]["formulas"] != told[2]["formulas"]


def test_long_formulas_are_described_by_their_length_and_told_apart():
    line = Manifold.euclidean("x")
    (x,), (v,) = line.symbols, velocities(line)
    told = []
    for last in (1.0, 1.0, 1.0 + 1e-9):
        waves = [sympy.cos(k * x + sympy.Rational(k, 7)) for k in range(2, 500)]
        potential = sympy.Add(last * sympy.cos(x), *waves)
        told.append(System(Polyhedron(line, [x + 9]), v**2 / 2, potential).described())
    assert told[0]["potential"].startswith("a formula of length")
    assert told[0] == told[1]
    assert told[0]["potential"] == told[2]["potential"]
    assert told[0]["formulas"] != told[2]["formulas"]


def test_a_system_moves_in_another_process_as_it_does_here(spawned):
    state = DISCS.state(START)
    there = spawned.submit(simulate, DISCS, state, 0.2, 1e-3).result()
    same(there, simulate(DISCS, state, 0.2, 1e-3))


def test_arrays_are_read_only():
    path, state = trajectory(), DISCS.state(START)
    again = pickle.loads(pickle.dumps(path))
    arrays = [state.q, state.v, state.sticking, DISCS.restitutions]
    for one in (path, again):
        arrays += [one.times, one.q, one.v, one.rests, one.present, one.kinetic, one.potential]
        arrays += [*one.dissipated.values(), *one.work.values()]
    for array in arrays:
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0


def test_the_callers_arrays_stay_their_own():
    q = START.copy()
    state = DISCS.state(q)
    q[:] = 0
    np.testing.assert_array_equal(state.q, START)
    assert SPINNING.dimension == 3


@pytest.mark.parametrize(("count", "tolerance"), [(1, 1e-8), (2, 1e-8), (3, 1e-4)])
def test_piles_are_solved_to_four_digits_unless_asked_for_more(count, tolerance):
    """Both a system of SymPy formulas and one with formulas of its own."""
    discs = replace(rubbing_discs(Interval(0.5)), count=count)
    assert discs.solver.tolerance == DumbbellDrum(count=count).solver.tolerance == tolerance
