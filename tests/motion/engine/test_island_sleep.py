"""Piles of boxes that come to rest sleep, and wake: statics, cones, motions without sleep."""

import itertools
import math

import numpy as np
import pytest
import sympy
from scipy.spatial.transform import Rotation

from polycorner import simulate
from polycorner.bodies import (
    Arrangement,
    HalfSpace,
    Prescribed,
    Slider,
    disc,
    polygon,
    polytope,
)
from polycorner.motion import Noise, time_symbol
from polycorner.motion.simulation import start

G, MU, DT = 10.0, 0.4, 2e-3
FLAT = polygon([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])


def boxes(dimension, count, slope=0.0, friction=MU, body=FLAT):
    """Return unit boxes on a floor, under a gravity that is inclined, as an arrangement, system."""
    up, along = np.eye(dimension)[[-1, 0]]
    if dimension == 3:
        body = polytope([*itertools.product([-0.5, 0.5], repeat=3)])
    a = Arrangement({"A": body}, {"floor": HalfSpace(up, 0 * up)}, orientations="all")
    pull = [
        G * (-sympy.cos(slope) * u + sympy.sin(slope) * w) for u, w in zip(up, along, strict=True)
    ]
    return a, a.system(gravity=pull, friction=friction, count=count)


def standing(a, places):
    """Return boxes that are not turned, with their centres at these places."""
    turn = 0.0 if a.dimension == 2 else Rotation.identity()
    return np.array([a.point({"A": (place, turn)}) for place in places])


def tower(a, count):
    """Return boxes on each other, every other one moved a little to the side."""
    side = np.eye(a.dimension)[0]
    return standing(a, [0.1 * (k % 2) * side + (0.5 + k) * up_of(a) for k in range(count)])


def up_of(a):
    return np.eye(a.dimension)[-1]


def asleep(engine):
    return bool(engine.motion.asleep.all())


@pytest.mark.parametrize(("dimension", "count"), [(2, 10), (3, 4)])
def test_a_tower_sleeps_and_its_forces_are_in_the_cone(dimension, count):
    """Each body's weight is borne by forces with ``n >= 0`` and ``|t| <= mu n``."""
    a, system = boxes(dimension, count)
    engine = start(system, system.state(tower(a, count)), DT)
    engine.advance(100)
    assert asleep(engine)
    assert not engine.motion.v.any()
    path = simulate(system, system.state(tower(a, count)), 0.2, DT)
    total = {f"A {k + 1}": np.zeros(dimension) for k in range(count)}
    for row in path.contacts(-1):
        (one, two), force = row.between, np.array(row.force)
        assert row.normal >= 0
        assert np.linalg.norm(force) <= math.hypot(1, MU) * row.normal * (1 + 1e-6)
        total[one] += force
        if two in total:
            total[two] -= force
    weight = 10 * system.state(tower(a, count)).q.size  # of any size: the scale of the error
    for force in total.values():
        assert np.allclose(force[:-1], 0, atol=1e-4 * weight)
        assert force[-1] > 0


def test_rest_has_the_same_bits_with_and_without_sleep():
    """From where a tower sleeps, the solved steps of one that never may are rest as well."""
    a, system = boxes(2, 10)
    sleeps, wakes = (start(system, system.state(tower(a, 10)), DT) for _ in range(2))
    sleeps.advance(100)
    assert asleep(sleeps)
    wakes.load({name: array.copy() for name, array in sleeps.save().items()})
    for _ in range(30):
        wakes.motion.asleep[:] = wakes.motion.pile[:] = 0
        wakes.advance(1)
    sleeps.advance(30)
    assert wakes.effort.islands > sleeps.effort.islands
    assert np.array_equal(sleeps.motion.q, wakes.motion.q)
    assert np.array_equal(sleeps.motion.v, wakes.motion.v)


def test_boxes_that_fall_sleep_where_they_lie():
    """They are tilted and overlap by less than a thousandth when they lie still for good."""
    rng = np.random.default_rng(3)
    a, system = boxes(2, 4)
    places = [(1.2 * (k % 2), 0.8 + 1.5 * (k // 2)) for k in range(4)]
    q = np.array([a.point({"A": (place, rng.uniform(-0.3, 0.3))}) for place in places])
    engine = start(system, system.state(q), DT)
    engine.advance(1500)
    assert asleep(engine)
    lies = engine.motion.q.copy()
    engine.advance(500)
    assert np.array_equal(engine.motion.q, lies)


def test_trajectories_with_and_without_sleep_agree_to_the_accuracy_of_the_solver():
    """Beside the same boxes under a weight that depends on the time by nothing: no pile sleeps.

    All bits are the same until the first boxes are stopped, in the step before they sleep.
    """
    paths, n = [], 6
    for nothing in (0, 1e-300 * time_symbol()):
        a = Arrangement({"A": FLAT}, {"floor": HalfSpace([0, 1], [0, 0])}, orientations="all")
        system = a.system(gravity=[0, -G + nothing], friction=MU, count=n)
        places = [(1.2 * (k % 3), 0.8 + 1.5 * (k // 3)) for k in range(n)]
        turns = np.random.default_rng(5).uniform(-0.2, 0.2, n)
        q = np.array([a.point({"A": x}) for x in zip(places, turns, strict=True)])
        engine = start(system, system.state(q), DT)
        piles, path = [], []
        for _ in range(600):
            engine.advance(1)
            piles.append(engine.motion.pile.any())
            path.append(engine.motion.q.copy())
        paths.append((np.array(path), np.array(piles)))
    (sleeps, piles), (wakes, never) = paths
    assert piles[-1]
    assert not never.any()
    awake = int(np.argmax(piles)) - 1
    assert np.array_equal(sleeps[:awake], wakes[:awake])
    assert abs(sleeps - wakes).max() < system.solver.tolerance * G * DT * len(piles) * DT


def test_sleepers_that_are_checked_in_every_step_sleep_as_those_that_are_not():
    """Boxes fall on sleeping ones, and off them; impulses at rest may differ in the last bits."""
    rng = np.random.default_rng(1)
    a, system = boxes(2, 6)
    places = [(1.3 * (k % 2), 0.8 + 1.5 * (k // 2)) for k in range(6)]
    turns = rng.uniform(-0.3, 0.3, 6)
    q = np.array([a.point({"A": x}) for x in zip(places, turns, strict=True)])
    checked, trusted = (start(system, system.state(q), DT) for _ in range(2))
    slept = 0
    for _ in range(700):
        checked.motion.check_due[:] = 0
        checked.advance(1)
        trusted.advance(1)
        slept += (trusted.motion.asleep > (trusted.motion.pile > 0)).any()
        far = abs(checked.motion.q - trusted.motion.q).max()
        assert far <= system.solver.tolerance * G * DT * trusted.time
    assert slept > 100


@pytest.mark.parametrize(("tangent", "moves"), [(0.9 * MU, False), (1.1 * MU, True)])
def test_a_tower_slides_on_a_slope_beyond_the_angle_of_friction(tangent, moves):
    a, system = boxes(2, 3, math.atan(tangent))
    engine = start(system, system.state(standing(a, [(0, 0.5), (1, 0.5), (2, 0.5)])), DT)
    engine.advance(100)
    assert asleep(engine) != moves
    far, t = engine.motion.q[:, 0] - [0, 1, 2], 100 * DT
    pull = G * math.cos(math.atan(tangent)) * (tangent - MU)
    assert np.allclose(far, max(0.0, pull) * t * t / 2, atol=1e-3)


@pytest.mark.parametrize(("overhang", "falls"), [(0.49, False), (0.51, True)])
def test_a_box_topples_if_its_centre_is_beyond_the_one_below(overhang, falls):
    a, system = boxes(2, 2)
    engine = start(system, system.state(standing(a, [(0, 0.5), (overhang, 1.5)])), DT)
    engine.advance(50)
    assert asleep(engine) != falls
    engine.advance(1000)
    assert (engine.motion.q[1, 1] < 1.4) == falls


def test_discs_that_begin_to_roll_are_not_stopped():
    """By ``G sin(slope) 2 / 3``, in the first step by a thousandth of what stops a pile."""
    slope = 1e-4
    a, system = boxes(2, 2, slope, body=disc(0.5))
    engine = start(system, system.state(standing(a, [(0, 0.5), (3, 0.5)])), DT)
    engine.advance(500)
    assert not engine.motion.rests.any()
    far = G * math.sin(slope) / 3 * (500 * DT) ** 2
    assert engine.motion.q[:, 0] == pytest.approx([far, 3 + far], rel=1e-2)


def test_a_tower_on_ice_goes_on():
    """Nothing resists, however slow it is, and forces within it leave its momentum as it is."""
    a, system = boxes(2, 3, friction={"floor": 0.0, "between": MU})
    slow = 5e-3 * G * DT
    v = np.tile([slow, 0.0, 0.0], (3, 1))
    engine = start(system, system.state(tower(a, 3), v), DT)
    engine.advance(300)
    assert engine.motion.v[:, 0] == pytest.approx(slow, rel=0.1)
    assert engine.motion.v[:, 0].mean() == pytest.approx(slow, rel=1e-9)
    assert not asleep(engine)


def test_a_tower_on_a_tray_that_is_tilted_slides_when_friction_is_used_up():
    """It stands until ``tan(angle) = MU``, and is then as far as the equation of motion says."""
    rate, t = 0.5, time_symbol()
    a, system = boxes(2, 2, rate * t)
    engine = start(system, system.state(tower(a, 2)), DT)
    stands = math.atan(MU) / rate
    engine.advance(int(stands / DT) - 2)
    assert abs(engine.motion.q[:, 0] - [0, 0.1]).max() < 1e-6
    steps = 100
    engine.advance(steps)
    slides = engine.time - stands
    # To third order in the time: sin - MU cos grows by rate / cos of the angle of friction.
    far = G * rate * math.hypot(1, MU) * slides**3 / 6
    assert engine.motion.q[0, 0] == pytest.approx(far, rel=0.1)


def test_a_pile_wakes_when_a_piston_begins_to_move():
    t = time_symbol()
    begins, speed = 0.1, 0.5
    piston = polygon([[-0.1, -0.4], [0.1, -0.4], [0.1, 0.4], [-0.1, 0.4]])
    floor = {"floor": HalfSpace([0, 1], [0, 0])}
    a = Arrangement({"P": piston, "A": FLAT}, floor, orientations="all")
    system = a.system(
        gravity=[0, -G],
        friction=MU,
        count={"P": 1, "A": 2},
        joints={"rail": Slider("world", "P", axis=[1, 0], at=[-0.65, 0.5])},
        drives={"p": Prescribed("rail", speed * sympy.Max(0, t - begins))},
    )
    one = Arrangement({"A": FLAT}, floor, orientations="all")
    state = system.state({"P": [[-0.65, 0.5, 0]], "A": standing(one, [(0, 0.5), (0, 1.5)])})
    engine = start(system, state, DT)
    engine.advance(40)
    assert engine.motion.asleep[1:].all()
    assert engine.motion.pile.any()
    engine.advance(200)
    face = -0.65 + speed * (engine.time - begins) + 0.1
    assert engine.motion.q[1, 0] > face + 0.5 - 1e-3
    assert face > -0.4


def test_noise_wakes_a_pile_that_goes_on_with_it():
    a, system = boxes(2, 3)
    path = simulate(system, system.state(tower(a, 3)), 0.2, DT)
    engine = start(path.system, path.last, DT)
    assert asleep(engine)
    assert engine.motion.pile.any()
    kicked = start(path.system, path.last, DT, noise=Noise(kicks={"xA": 5.0}, seed=1))
    assert not kicked.motion.pile.any()
    kicked.advance(200)
    assert not kicked.motion.pile.any()
    assert abs(kicked.motion.q - path.last.q).max() > 1e-3


def test_noise_moves_a_single_sleeper_from_the_first_step_with_it():
    """Alone, it is checked again when something touches it, which may be never."""
    a, system = boxes(2, 1)
    path = simulate(system, system.state(standing(a, [(0, 0.5)])), 0.2, DT)
    kicked = start(path.system, path.last, DT, noise=Noise(kicks={"xA": 5.0}, seed=1))
    assert kicked.motion.asleep.all()
    kicked.advance(2)
    assert abs(kicked.motion.v).max() > 0


def test_what_hits_a_pile_wakes_all_of_it():
    """A box that flies against the upper of two pushes it off; the lower one goes along."""
    a, system = boxes(2, 4)
    q = standing(a, [(0, 0.5), (0, 1.5), (0, 2.5), (-3, 2.5)])
    v = np.zeros((4, 3))
    v[3] = 6, 2, 0
    engine = start(system, system.state(q, v), DT)
    engine.advance(100)
    assert engine.motion.asleep.tolist() == [1, 1, 1, 0]
    engine.advance(300)
    assert (engine.motion.q[:3, 0] > 1e-3).any()
    engine.advance(3000)
    assert asleep(engine)


def test_a_pile_that_was_saved_asleep_is_hit_in_the_same_way():
    a, system = boxes(2, 4)
    q = standing(a, [(0, 0.5), (0, 1.5), (0, 2.5), (-3, 2.5)])
    v = np.zeros((4, 3))
    v[3] = 6, 2, 0
    whole, again = (start(system, system.state(q, v), DT) for _ in range(2))
    whole.advance(100)
    again.load({name: array.copy() for name, array in whole.save().items()})
    assert again.motion.asleep[:3].all()
    for engine in (whole, again):
        engine.advance(200)
    assert not whole.motion.asleep[:3].all()
    assert np.array_equal(whole.motion.q, again.motion.q)
    assert np.array_equal(whole.motion.v, again.motion.v)


def test_a_pile_wakes_with_what_it_lies_on():
    """A support that is woken and moved leaves what lay on it without support."""
    a, system = boxes(2, 3)
    engine = start(system, system.state(tower(a, 3)), DT)
    engine.advance(30)
    assert asleep(engine)
    saved = {name: array.copy() for name, array in engine.save().items()}
    saved["v"][0] = 3.0, 0.0, 0.0
    saved["asleep"][0] = saved["rests"][0] = 0
    engine.load(saved)
    engine.advance(2)
    assert not engine.motion.asleep.any()


def test_states_saved_before_there_were_piles_are_awake():
    a, system = boxes(2, 3)
    engine = start(system, system.state(tower(a, 3)), DT)
    engine.advance(30)
    saved = {n: array.copy() for n, array in engine.save().items() if n != "pile"}
    engine.load(saved)
    assert not engine.motion.asleep.any()
    engine.advance(5)
    assert asleep(engine)
