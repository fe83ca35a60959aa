"""Problems with closed answers, posed with bodies as a user would pose them.

Each is a function that returns what was found and what is expected, with a tolerance; formulas are
derived beside it, from balances of forces, energy and momentum.
"""

import math
from itertools import pairwise

import numpy as np
import pytest
from posed import FLOOR, TABLE, G, Row, brick, check, cube, moved, stays
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from polycorner import simulate
from polycorner.bodies import (
    Arrangement,
    Cylinder,
    HalfSpace,
    Mass,
    box,
    capsule,
    disc,
    mass_of,
    polygon,
    sphere,
)
from polycorner.motion import EventKind


def leaning(length, r, angle, **given):
    """Return a ladder that leans on a wall at ``x = 3``, by an angle from the vertical."""
    wall = {"wall": HalfSpace([-1, 0], [3, 0])}
    ladder = {"L": capsule([0, -length / 2], [0, length / 2], r)}
    a = Arrangement(ladder, FLOOR | wall, orientations="all", **given)
    x, y = 3 - r - length / 2 * math.sin(angle), r + length / 2 * math.cos(angle)
    return a, a.point({"L": ([x, y], -angle)})


def a_ladder_on_a_smooth_wall():
    length, r, angle = 2.0, 0.02, 0.6
    a, q = leaning(length, r, angle)
    # Moments about the lower centre: N (L cos + r) = W L/2 sin, and the floor rubs by N.
    critical = length / 2 * math.sin(angle) / (length * math.cos(angle) + r)
    for share in (1.001, 0.999):
        held = stays(a, q, gravity=[0, -G], friction={"L.v1-floor": share * critical})
        yield Row(f"stays at {share}", held, share > 1)


def a_ladder_on_a_rough_wall():
    for mu in (0.2, 0.9):
        limit = math.atan(2 * mu / (1 - mu**2))  # of a thin one, from the vertical
        for share in (0.995, 1.005):
            a, q = leaning(2.0, 1e-3, share * limit)
            yield Row(f"{mu}, {share}", stays(a, q, gravity=[0, -G], friction=mu), share < 1)


def a_ladder_on_an_edge():
    length, r, angle, height = 2.0, 0.02, 0.5, 1.0
    along = np.array([math.sin(angle), math.cos(angle)])
    normal = np.array([-along[1], along[0]])
    touched = np.array([0, height]) + r * normal  # of the axis
    foot = touched - along * (touched[1] - r) / along[1]
    edge = {"box": polygon([[0, -1], [2, -1], [2, height], [0, height]])}
    ladder = {"L": capsule([0, -length / 2], [0, length / 2], r)}
    a = Arrangement(ladder, FLOOR, edge, orientations="all")
    q = a.point({"L": (foot + along * length / 2, -angle)})
    # Moments about the foot's centre, weight 1; the floor rubs by what the edge pushes sideways.
    push = length / 2 * math.sin(angle) / ((touched - foot) @ along + r * along[1])
    critical = push * along[1] / (1 - push * normal[1])
    for share in (1.001, 0.999):
        held = stays(a, q, gravity=[0, -G], friction={"L.v1-floor": share * critical})
        yield Row(f"stays at {share}", held, share > 1)


def a_smooth_ladder_leaves_the_wall():
    a, q = leaning(2.0, 0.02, 0.3)
    path = moved(a, q, 1.0, gravity=[0, -G])
    left = next(e.time for e in path.of_kind(EventKind.LOST) if e.contact == "L.v2-wall")
    angle = np.interp(left, path.times, path.q[:, 0, 2])
    # x = L/2 sin: its acceleration vanishes where cos = 2/3 of that at first, whatever the inertia.
    yield Row("cosine", math.cos(angle), 2 / 3 * math.cos(0.3), 1e-4)


def a_brick_tips_or_stays():
    a, b, r = 0.2, 0.5, 0.02
    tall = Arrangement({"B": brick(a, b, r)}, FLOOR, orientations="all")
    q = tall.point({"B": [0, b + r]})
    for share in (0.999, 1.001):
        slope = math.atan(share * a / (b + r))
        weight = [G * math.sin(slope), -G * math.cos(slope)]
        yield Row(f"stays at {share}", stays(tall, q, gravity=weight, friction=2.0), share < 1)


def a_brick_hangs_over():
    a, b, r = 1.0, 0.2, 0.02
    two = Arrangement({"low": brick(a, b, r), "up": brick(a, b, r)}, FLOOR, orientations="all")
    for share in (0.99, 1.01):
        q = two.point({"low": [0, b + r], "up": [a * share, 3 * (b + r)]})
        yield Row(f"stays at {share}", stays(two, q, gravity=[0, -G], friction=0.5), share < 1)


def a_plank_on_rollers():
    r, mass, roller, pull = 0.3, 2.0, 1.0, 0.5
    bodies = {"P": brick(2.0, 0.05, 0.05), "a": disc(r), "b": disc(r)}
    a = Arrangement(bodies, FLOOR, orientations="all")
    wheel = Mass(roller, [0, 0], roller * r**2 / 2)
    masses = {"P": Mass(mass, [0, 0], 1.0), "a": wheel, "b": wheel}
    q = a.point({"P": [0, 2 * r + 0.1], "a": [-1, r], "b": [1, r]})
    path = moved(a, q, 1.0, gravity=[pull, -G], friction=0.5, masses=masses)
    speeds = dict(zip(a.manifold.names, path.v[-1, 0], strict=True))
    # Lagrange with V = 2 v: T = V^2 (M/2 + 3 m/8), U = -g_x V (M + m).
    expected = pull * (mass + roller) / (mass + 0.75 * roller)
    yield Row("plank", speeds["xP"], expected, 1e-6)
    yield Row("roller", speeds["xa"], expected / 2, 1e-6)


def a_disc_climbs_a_step():
    r, h = 0.5, 0.1
    step = {"step": polygon([[0, -1], [3, -1], [3, h], [0, h]])}
    a = Arrangement({"D": disc(r)}, FLOOR, step, orientations="all")
    q = a.point({"D": [-math.sqrt(r**2 - (r - h) ** 2) - 0.05, r]})
    # Angular momentum about the edge: w' = w (1 - 2 h / 3 r); then 3/4 r^2 w'^2 = g h.
    least = math.sqrt(G * h / 0.75) / r / (1 - 2 * h / (3 * r))
    for share in (0.98, 1.02):
        w = share * least
        rolls = {"D": ([w * r, 0], -w)}
        path = moved(a, q, 3.0, moving=rolls, gravity=[0, -G], friction=2.0)
        yield Row(f"climbs at {share}", bool(path.q[-1, 0, 0] > 0), share > 1)


def a_ball_hits_another_off_centre():
    aside, speed = 0.6, 3.0
    normal = np.array([math.sqrt(4 - aside**2) / 2, aside / 2])
    struck = speed * normal[0] * normal  # along the line of centres
    listed = Arrangement([disc(1.0)] * 2).system(restitution=1.0)
    walls = box([-50, -50], [50, 50])
    repeated = Arrangement({"D": disc(1.0)}, walls).system(restitution={"between": 1.0}, count=2)
    starts = np.array([[-5, -aside], [0, 0]]), np.array([[speed, 0], [0, 0]])
    for name, system, (q, v) in (
        ("listed", listed, [x.ravel() for x in starts]),
        ("repeated", repeated, starts),
    ):
        found = simulate(system, system.state(q, v), 3.0, 1e-3).v[-1].reshape(2, 2)
        expected = np.array([[speed, 0] - struck, struck])
        yield Row(name, np.abs(found - expected).max(), 0.0, 1e-9)


def a_ball_hits_two_that_touch():
    three = Arrangement([disc(0.5)] * 3).system(restitution=1.0)
    state = three.state([-3, 0, 0, 0.5, 0, -0.5], [1, 0, 0, 0, 0, 0])
    v = simulate(three, state, 5.0, 1e-3).v[-1].reshape(3, 2)
    # Equal impulses J 30 degrees off the line: (1 - sqrt(3) J)^2 + 2 J^2 = 1.
    J = 2 * math.sqrt(3) / 5
    yield Row("cue", v[0, 0], 1 - math.sqrt(3) * J, 1e-6)
    yield Row("struck", np.abs(v[1] - [math.sqrt(3) / 2 * J, J / 2]).max(), 0.0, 1e-6)


def a_rod_is_struck():
    mass, inertia, ball, aside, speed = 3.0, 1.2, 0.5, 0.7, 2.0
    a = Arrangement({"rod": capsule([0, -1], [0, 1], 0.1), "ball": disc(0.2)})
    masses = {"rod": Mass(mass, [0, 0], inertia), "ball": Mass(ball, [0, 0], 0.01)}
    q = a.point({"rod": [0, 0], "ball": [-1, aside]})
    path = moved(a, q, 0.7, moving={"ball": [speed, 0]}, masses=masses, restitution=1.0)
    v = dict(zip(a.manifold.names, path.v[-1, 0], strict=True))
    J = 2 * speed / (1 / ball + 1 / mass + aside**2 / inertia)
    yield Row("rod", v["xrod"], J / mass, 1e-9)
    yield Row("its turning", v["thetarod"], -J * aside / inertia, 1e-9)
    yield Row("ball", v["xball"], speed - J / ball, 1e-9)


def a_rod_falls_on_a_smooth_floor():
    length, first, last = 2.0, 0.2, 1.2
    a = Arrangement({"R": capsule([0, -1], [0, 1], 1e-3)}, FLOOR)
    q = a.point({"R": ([0, 1e-3 + math.cos(first)], first)})
    inertia = length**2 / 12
    path = moved(a, q, 1.0, gravity=[0, -G], masses={"R": Mass(1.0, [0, 0], inertia)})
    k = int(np.searchsorted(path.q[:, 0, 2], last)) + 1
    fall, arm = math.cos(first) - math.cos(last), math.sin(last)
    w = np.interp(last, path.q[:k, 0, 2], path.v[:k, 0, 2])
    yield Row("rate", w, math.sqrt(2 * G * fall / (inertia + arm**2)), 1e-5)
    yield Row("its centre falls straight", np.abs(path.q[:, 0, 0]).max(), 0.0, 1e-9)


def a_domino_is_pushed_over():
    a, b, r = 0.1, 0.5, 0.02
    domino = brick(a, b, r)
    one = Arrangement({"D": domino}, FLOOR, orientations="all")
    mass, arm = mass_of(domino), math.hypot(a, b)
    about = float(mass.inertia) + mass.mass * (a**2 + (b + r) ** 2)
    least = math.sqrt(2 * mass.mass * G * (arm - b) / about)  # to stand on the rounded corner
    for share in (0.98, 1.02):
        w = -share * least
        q = one.point({"D": [0, b + r]})
        tips = {"D": ([-w * (b + r), -w * a], w)}
        path = moved(one, q, 3.0, moving=tips, gravity=[0, -G], friction=2.0)
        yield Row(f"falls at {share}", bool(path.q[-1, 0, 2] < -1), share > 1)


def dominoes_reach_each_other_or_not():
    row = Arrangement([brick(0.05, 0.4)] * 4, FLOOR, orientations="all")
    for gap in (0.5, 1.2):
        q = row.point({name: [gap * k, 0.42] for k, name in enumerate(row.named)})
        push = {"1": ([2.0, 0], -4.0)}
        angles = moved(row, q, 2.5, moving=push, gravity=[0, -G], friction=0.5).q[-1, 0, 2::3]
        yield Row(f"all fall, {gap} apart", bool((angles[1:] < -0.5).all()), gap < 0.84)


def three_cylinders_in_a_pyramid():
    a = Arrangement([disc(1.0)] * 3, FLOOR, orientations="all")
    q = a.point({"1": [-1, 1], "2": [1, 1], "3": [0, 1 + math.sqrt(3)]})
    # Rubbing F is the same at top and floor: F (1 + cos 30) = N sin 30, and the floor bears 3/2 W.
    top = math.tan(math.radians(15))
    for low, high, holds in ((1.01, 1.01, True), (0.99, 1.5, False), (1.5, 0.99, False)):
        mu = {f"{k}-floor": low * top / 3 for k in "12"} | {f"{k}-3": high * top for k in "12"}
        yield Row(f"{low}, {high}", stays(a, q, gravity=[0, -G], friction=mu), holds)


def two_balls_in_a_jar():
    width = 3.2
    walls = FLOOR | {"left": HalfSpace([1, 0], [0, 0]), "right": HalfSpace([-1, 0], [width, 0])}
    a = Arrangement([disc(1.0)] * 2, walls)
    x = width - 2
    y = math.sqrt(4 - x**2)
    path = moved(a, np.array([1, 1, 1 + x, 1 + y]), 0.1, gravity=[0, -G])
    force, weight = {name: f for _, name, f in path.touching[-1]}, math.pi * G
    yield Row("floor", force["1-floor"], 2 * weight, 1e-6)
    yield Row("wall", force["2-right"], weight * x / y, 1e-6)
    yield Row("each other", force["1-2"], weight * 2 / y, 1e-6)


def three_marbles_in_a_bowl():
    R, r = 1.0, 0.3
    a = Arrangement([sphere(r)] * 3, {"bowl": Cylinder(R, point=[0, 0, 0])})
    aside = 2 * r / math.sqrt(3)
    depth = math.sqrt((R - r) ** 2 - aside**2)
    turns = [math.tau * k / 3 for k in range(3)]
    q = np.ravel([[aside * math.cos(t), aside * math.sin(t), -depth] for t in turns])
    path = moved(a, q, 0.1, gravity=[0, 0, -G])
    force, weight = {name: f for _, name, f in path.touching[-1]}, 4 / 3 * math.pi * r**3 * G
    yield Row("stay", np.abs(path.q[-1, 0] - q).max(), 0.0, 1e-9)
    yield Row("bowl", force["1-bowl"], weight * (R - r) / depth, 1e-6)
    yield Row("each other", force["1-2"], weight * aside / depth / math.sqrt(3), 1e-6)


def a_bowling_ball():
    for unit, length, density in (("m, kg", 1.0, 1.0), ("mm, t", 1e3, 1.2e-9)):
        mu, speed, r, g = 0.2, 5 * length, 0.11 * length, G * length
        a = Arrangement({"B": sphere(r)}, TABLE, orientations="all")
        q, until = a.point({"B": [0, 0, r]}), 2 * speed / (7 * mu * g)
        laws = {"gravity": [0, 0, -g], "friction": mu, "density": density}
        path = moved(a, q, 2 * until, moving={"B": [speed, 0, 0]}, **laws)
        yield Row(unit, path.v[-1, 0, 0] / speed, 5 / 7, 1e-6)
        slid = np.interp(until, path.times, path.q[:, 0, 0])
        yield Row(f"{unit}, slid", slid * mu * g / speed**2, 12 / 49, 1e-5)


def a_capsule_rolls_sideways():
    rod = capsule([-1, 0, 0], [1, 0, 0], 0.3)
    a, mass = Arrangement({"C": rod}, TABLE, orientations="all"), mass_of(rod)
    path = moved(a, a.point({"C": [0, 0, 0.3]}), 0.5, gravity=[0, 1.0, -G], friction=0.5)
    share = mass.inertia[0, 0] / mass.mass / 0.3**2
    yield Row("acceleration", path.v[-1, 0, 1] / 0.5, 1 / (1 + share), 1e-5)


def balls_of_any_inertia_roll():
    for share in (2 / 5, 2 / 3):
        mass = Mass(2.0, [0, 0, 0], 0.5 * share * np.eye(3))
        a = Arrangement({"B": sphere(0.5)}, TABLE, orientations="all")
        laws = {"gravity": [1, 0, -5], "friction": 0.6, "masses": {"B": mass}}
        path = moved(a, a.point({"B": [0, 0, 0.5]}), 0.5, **laws)
        yield Row(f"{share}", path.v[-1, 0, 0] / 0.5, 1 / (1 + share), 1e-6)


def a_cube_slides_and_spins_to_rest():
    a, mu = Arrangement({"B": cube()}, TABLE, orientations="all"), 0.3
    q = a.point({"B": ([0, 0, 0.52], Rotation.from_euler("z", 0.4))})
    laws = {"gravity": [0, 0, -G], "friction": mu}
    v = np.array([2.0, 1.0, 0.0])
    path = moved(a, q, 1.0, moving={"B": v}, **laws)
    yield Row(
        "way", np.abs(path.q[-1, 0, :3] - q[:3] - v * math.sqrt(5) / (2 * mu * G)).max(), 0, 1e-5
    )
    q, w = a.point({"B": [0, 0, 0.52]}), 3.0
    path = moved(a, q, 0.5, moving={"B": ([0, 0, 0], [0, 0, w])}, **laws)
    mass = mass_of(cube())  # a quarter of the weight at each corner, sqrt(1/2) from the axis
    angle = w**2 * mass.inertia[2, 2] / (2 * mu * mass.mass * G * math.sqrt(0.5))
    yield Row("angle", 2 * math.atan2(path.q[-1, 0, 6], path.q[-1, 0, 3]), angle, 1e-4)


def boxes_bounce_flat():
    for name, body, walls, height in (
        ("in the plane", brick(0.5, 0.3), FLOOR, [0, 1.32]),
        ("in space", cube(), TABLE, [0, 0, 1.52]),
    ):
        a = Arrangement({"B": body}, walls, orientations="all")
        q, down = a.point({"B": height}), [*[0.0] * (len(height) - 1), -G]
        path = moved(a, q, 2 * math.sqrt(2 / G), gravity=down, restitution=1.0, friction=0.5)
        yield Row(name, np.abs(path.q[-1, 0] - q).max(), 0.0, 1e-8)


def a_disc_grips_when_it_bounces():
    a = Arrangement({"D": disc(0.5)}, FLOOR, orientations="all")
    v, w = 1.0, -4.0
    thrown = {"D": ([v, -2.0], w)}
    laws = {"gravity": [0, -G], "restitution": 0.8, "friction": 5.0}
    path = moved(a, a.point({"D": [0, 1]}), 0.5, moving=thrown, **laws)
    after = (v - 0.5 * 0.5 * w) / 1.5  # momentum about the contact; then it rolls
    yield Row("speed", path.v[-1, 0, 0], after, 1e-9)
    yield Row("turning", path.v[-1, 0, 2], -after / 0.5, 1e-9)


def a_marble_swings_in_a_bowl():
    R, r, e = 1.0, 0.1, 0.01
    a = Arrangement({"B": sphere(r)}, {"bowl": Cylinder(R, point=[0, 0, 0])}, orientations="all")
    q = a.point({"B": (R - r) * np.array([math.sin(e), 0, -math.cos(e)])})
    period = math.tau * math.sqrt(7 * (R - r) / (5 * G))  # rolling, of a small swing
    path = moved(a, q, 1.2 * period, gravity=[0, 0, -G], friction=1.0)
    x = path.q[:, 0, 0]
    zeros = [
        t - a * (u - t) / (b - a)
        for (t, a), (u, b) in pairwise(zip(path.times, x, strict=True))
        if a * b < 0
    ]
    yield Row("period", 2 * (zeros[1] - zeros[0]), period * (1 + e**2 / 16), 1e-4)


def a_pendulum_turns_with_the_stars():
    R, r, e, spin = 10.0, 0.1, 0.02, 0.05
    bowl = {"bowl": Cylinder(R, point=[0, 0, 0])}
    a = Arrangement({"B": sphere(r)}, bowl, turning=[0, 0, spin])
    q = (R - r) * np.array([math.sin(e), 0, -math.cos(e)])
    period = math.tau * math.sqrt((R - r) / G)
    rest = {"B": [0, -spin * q[0], 0]}  # in axes that do not turn
    path = moved(a, q, 5 * period, moving=rest, gravity=[0, 0, -G])
    x, y = path.q[-1, 0, :2]
    yield Row("azimuth", math.atan2(y, x), -5 * spin * period, 1e-4)


def a_body_turns_about_its_middle_axis():
    inertia, w = np.array([1.0, 2.0, 3.0]), np.array([0.01, 2.0, 0.01])
    far = {"far": HalfSpace([0, 0, 1], [0, 0, -50])}
    a = Arrangement({"B": capsule([-0.5, 0, 0], [0.5, 0, 0], 0.3)}, far, orientations="all")
    masses = {"B": Mass(1.0, [0, 0, 0], np.diag(inertia))}
    path = moved(a, a.point({"B": [0, 0, 0]}), 10.0, moving={"B": ([0, 0, 0], w)}, masses=masses)

    def euler(_, w):
        return np.cross(inertia * w, w) / inertia

    expected = solve_ivp(euler, (0, 10), w, rtol=1e-10, atol=1e-12).y[:, -1]
    q, rate = path.q[-1, 0, 3:], path.v[-1, 0, 3:]
    # w = 2 q* q' in the axes of the body
    found = 2 * (q[0] * rate[1:] - rate[0] * q[1:] - np.cross(q[1:], rate[1:]))
    yield Row("rates", np.abs(found - expected).max(), 0.0, 1e-5)


def a_top_precesses_on_a_smooth_table():
    lever, r, mass, across, along, tilt, spin = 0.1, 0.01, 0.2, 4e-4, 3e-4, 0.4, 400.0
    # Its origin is the centre of mass.  Steady where I_1 cos f^2 - I_3 w f + m g l = 0.
    terms = [across * math.cos(tilt), -along * spin, mass * G * lever]
    pace = float(np.roots(terms).real.min())
    turn = Rotation.from_euler("y", tilt)
    axis = turn.apply([0, 0, 1])
    top = Arrangement({"T": sphere(r, at=[0, 0, -lever])}, TABLE, orientations="all")
    q = top.point({"T": (np.array([0, 0, r]) + lever * axis, turn)})
    w = pace * np.array([0, 0, 1]) + (spin - pace * math.cos(tilt)) * axis
    masses = {"T": Mass(mass, [0, 0, 0], np.diag([across, across, along]))}
    laws = {"gravity": [0, 0, -G], "masses": masses, "dt": 1e-4}
    path = moved(top, q, 0.2, moving={"T": ([0, 0, 0], w)}, **laws)
    axes = Rotation.from_quat(path.q[:, 0, 3:], scalar_first=True).apply([0, 0, 1])
    yield Row("nods", np.ptp(axes[:, 2]), 0.0, 1e-6)
    yield Row("pace", np.unwrap(np.arctan2(axes[:, 1], axes[:, 0]))[-1] / 0.2, pace, 1e-4)


def a_silo_bears_a_part_of_its_grains():
    walls = FLOOR | {"left": HalfSpace([1, 0], [0, 0]), "right": HalfSpace([-1, 0], [4.4, 0])}
    a = Arrangement({"D": disc(0.5)}, walls, orientations="all")
    rng, count = np.random.default_rng(1), 24
    k = np.arange(count)
    x = 0.6 + 1.05 * (k % 4) + 0.1 * (k // 4 % 2) + rng.uniform(0, 0.02, count)
    q = np.column_stack([x, 0.55 + 1.1 * (k // 4), 0 * x])
    weight = count * mass_of(disc(0.5)).mass * 10
    for mu in (0.0, 0.5):
        silo = a.system(gravity=[0, -10.0], friction=mu, count=count)
        path = simulate(silo, silo.state(q), 4.0, 2e-3)
        bottom = [sum(f for _, name, f in t if name == "D-floor") for t in path.touching[-20:]]
        share = float(np.mean(bottom)) / weight
        yield Row(f"all of it, {mu}", abs(share - 1) < 1e-3, mu == 0)
        yield Row(f"no more than it, {mu}", share < 1 + 1e-3, True)


def scaled_scenes_move_alike():
    found = {}
    for name, length, density, second in (
        ("m", 1, 1, 1),
        ("um", 1e-6, 1, 1),
        ("dense", 1, 1e9, 1),
        ("light", 1, 1e-9, 1),
        ("fast", 1, 1, 1e-3),
    ):
        bodies = {"P": brick(0.3 * length, 0.2 * length, 0.02 * length), "D": disc(0.25 * length)}
        walls = box([0, 0], [2 * length, 4 * length])
        a = Arrangement(bodies, walls, orientations="all")
        q = a.point({"P": ([0.5 * length, 0.8 * length], 0.3), "D": [1.2 * length, length]})
        laws = {"gravity": [0, -G * length / second**2], "friction": 0.3, "restitution": 0.4}
        path = moved(a, q, second, density=density, dt=1e-3 * second, **laws)
        found[name] = path.q[-1, 0] / np.tile([length, length, 1], 2)
    for name, q in found.items():
        yield Row(name, np.abs(q - found["m"]).max(), 0.0, 1e-8)


PROBLEMS = [
    a_ladder_on_a_smooth_wall,
    a_ladder_on_a_rough_wall,
    a_ladder_on_an_edge,
    a_smooth_ladder_leaves_the_wall,
    a_brick_tips_or_stays,
    a_brick_hangs_over,
    a_plank_on_rollers,
    a_disc_climbs_a_step,
    a_ball_hits_another_off_centre,
    a_ball_hits_two_that_touch,
    a_rod_is_struck,
    a_rod_falls_on_a_smooth_floor,
    a_domino_is_pushed_over,
    dominoes_reach_each_other_or_not,
    three_cylinders_in_a_pyramid,
    two_balls_in_a_jar,
    three_marbles_in_a_bowl,
    a_bowling_ball,
    a_capsule_rolls_sideways,
    balls_of_any_inertia_roll,
    a_cube_slides_and_spins_to_rest,
    boxes_bounce_flat,
    a_disc_grips_when_it_bounces,
    a_marble_swings_in_a_bowl,
    a_pendulum_turns_with_the_stars,
    a_body_turns_about_its_middle_axis,
    a_top_precesses_on_a_smooth_table,
    a_silo_bears_a_part_of_its_grains,
    scaled_scenes_move_alike,
]


@pytest.mark.parametrize("problem", PROBLEMS, ids=lambda problem: problem.__name__)
def test_a_problem_has_its_answer(problem, subtests):
    check(problem, subtests)
