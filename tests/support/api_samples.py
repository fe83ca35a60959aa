"""One small value of every public class, each made once in a process."""

import math
import tempfile
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import sympy

import polycorner as pc
from polycorner import (
    bodies,
    branches,
    dumbbells,
    files,
    landscapes,
    measures,
    models,
    motion,
    polyhedra,
    proofs,
    sweeps,
)
from polycorner.dumbbells import pictures as drum_pictures
from polycorner.dumbbells.dynamics.dyads import Steady
from polycorner.dumbbells.dynamics.singles import Mean
from polycorner.models.wells import holding
from polycorner.models.wells.wells import KINDS, Well

M = pc.Manifold.euclidean("x y")
X, Y = M.symbols
UNIT = [(0.0, 1.0)] * 2
STRETCH = sympy.Symbol("a")
square = cache(lambda: pc.Polyhedron(M, {"left": X, "bottom": Y, "right": 1 - X, "top": 1 - Y}))
energy = cache(lambda: pc.SmoothFunction("energy", STRETCH * X + Y, M, parameters={"a": 2.0}))
certificate = cache(lambda: pc.certify(square(), energy(), [0.0, 0.0]))
diagram = cache(lambda: branches.branches(certificate(), "a", (1.0, 3.0)))
FOOT = sympy.symbols("s r")
spring = cache(
    lambda: pc.SmoothFunction(
        "spring", (X - FOOT[0]) ** 2 + (Y - FOOT[1]) ** 2, M, parameters={"s": -0.5, "r": -0.5}
    )
)
pressed = cache(lambda: branches.branches(pc.certify(square(), spring(), [0, 0]), "s", (-0.8, 0.9)))
event_map = cache(lambda: branches.event_curves(pressed(), "r", (-0.8, 0.9)))
minima = cache(lambda: pc.minima(square(), energy(), starts=3, box=UNIT))
skeleton = cache(lambda: pc.skeleton(square(), [[0.5, 0.5]]))
strata_measures = cache(
    lambda: measures.measure(skeleton(), weighting=measures.Weighting(stickiness=2.0))
)
strata_sample = cache(lambda: measures.sample(square(), [[0.5, 0.5]], 20, rng=0))


@cache
def system():
    vx, vy = pc.velocities(M)
    return pc.System(square(), (vx**2 + vy**2) / 2, 9.81 * Y, friction=(friction(),))


friction = cache(
    lambda: pc.Friction("floor", (pc.velocities(M)[0],), motion.Interval(0.3), "bottom")
)
state = cache(lambda: system().state([0.5, 0.5]))
trajectory = cache(lambda: pc.simulate(system(), state(), 0.01, 0.001))


@cache
def pair_friction():
    (vx1, _), (vx2, _) = motion.pair_velocities(M)
    return motion.PairFriction({"touch": (vx1 - vx2,)}, motion.Interval(0.3))


@cache
def contact_family():
    (x1, y1), (x2, y2) = motion.pair_coordinates(M)
    gap = sympy.sqrt((x1 - x2) ** 2 + (y1 - y2) ** 2) - 0.1
    return motion.ContactFamily({"touch": gap}, 1.0, friction=(pair_friction(),))


drift = cache(lambda: pc.Drift(square(), {"x": 1}, potential=Y, noise=0.1))


@cache
def split():
    drift = pc.Drift(pc.Polyhedron(M, pc.AnyOf(Y + X, Y - X)), {"y": -1})
    return pc.simulate(drift, drift.state([0, 1]), 1.2, 0.1).splits[0]


@cache
def assembly():
    kinds = dict.fromkeys(("a", "b"), system())
    return motion.Assembly(kinds, dict.fromkeys(kinds, 1), {("a", "b"): contact_family()})


PLACES = {"a": [[0.2, 0.5]], "b": [[0.8, 0.5]]}
assembled = cache(lambda: assembly().state(PLACES))


@cache
def tie():
    (x1, y1), (x2, y2) = motion.pair_coordinates(M)
    return motion.Tie((0, 1), "rod", {"length": (x1 - x2) ** 2 + (y1 - y2) ** 2 - 1})


proof = cache(lambda: pc.prove(certificate(), digits=8))
corner_list = cache(lambda: proofs.corners(square(), box=UNIT))
stationary_list = cache(lambda: proofs.stationary_points(square(), energy(), box=UNIT))
paving = cache(
    lambda: landscapes.paved_barrier(certificate().problem, UNIT, [0.5, 0.5], max_boxes=9)
)
cell = cache(lambda: pc.prove(certificate(), digits=8, parameters={"a": (1.9, 2.1)}))
ridge = cache(lambda: pc.Polyhedron(M, {"sides": 4 - X**2, "bottom": Y, "top": 1 - Y}))
RIDGE = {"energy": (X**2 - 1) ** 2 + X / 4 + Y + Y**2, "box": {"x": (-3.0, 3.0), "y": (-1.0, 2.0)}}
landscape = cache(lambda: landscapes.landscape(ridge(), **RIDGE, region={"gate": 3 - X**2}))
nerve = cache(lambda: polyhedra.nerve(square(), Y))
locus = cache(lambda: proofs.StationaryLocus({"x": 0.0}, {"x": 1.0}, 0, np.array([0.5, 0.0])))


def mirrored(q):
    return np.stack([1 - q[..., 0], q[..., 1]], axis=-1)


element = cache(lambda: polyhedra.Element(mirrored, {"left": "right", "right": "left"}))
symmetry = cache(lambda: pc.Symmetry(elements=(element(),)))
pair = cache(lambda: dumbbells.DumbbellPair(16.0, 3.0, 1.5, 125.0))
atlas = cache(lambda: dumbbells.pair_atlas(pair(), rng=0))
pair_landscape = cache(lambda: dumbbells.pair_landscape(pair(), max_seconds=0.01))
drum = cache(lambda: dumbbells.DumbbellDrum(count=2))


PLACED = [[0.0, 0.0, 0.0], [0.0, 40.0, 0.0]]
run = cache(lambda: pc.simulate(drum(), drum().state(PLACED), 0.01, 0.001))
film = cache(lambda: drum_pictures.pair_film(pair(), [pair().nested("R")] * 2))
scene = cache(lambda: drum_pictures.pair_scene(pair(), pair().nested("R")))
minima_map = cache(
    lambda: dumbbells.minima_map(curvatures=[0.5], rods=[0.4, 0.5], lengths=[4.0, 6.0], starts=3)
)
pair_map = cache(lambda: dumbbells.pair_map([4.0], [0.5]))
spheres = cache(lambda: models.SphereCluster(4))
tetrahedron = cache(lambda: [0.5, 0.5, 0.5, 0.5, -0.5, -0.5, -0.5, 0.5, -0.5, -0.5, -0.5, 0.5])
disks = cache(lambda: models.TorusDisks(2))
critical = cache(lambda: disks().critical(0, starts=3))
packing = cache(lambda: models.PeriodicPacking.bidisperse(24).jam(0))


def ball(grid):
    return (grid**2).sum(axis=-1) - 1.0


def gaps(grid, order):
    value = ball(grid)[..., None]
    hessian = np.broadcast_to(2 * np.eye(3), (*grid.shape[:-1], 1, 3, 3))
    return (value, 2 * grid[..., None, :], hessian)[: order + 1]


AROUND = [(-1.5, 1.5)] * 3


@cache
def isosurface():
    from polycorner.pictures import isosurface as surface

    return surface(ball, AROUND, 8)


@cache
def sharp_surface():
    from polycorner.pictures import sharp_surface as surface

    return surface(gaps, AROUND, 8)


@cache
def comparison():
    wells = tuple(Well.of_depth(kind, 2.0, drag=1.0) for kind in KINDS)
    elastic = Well.of_depth(KINDS[-1], 2.0, drag=1.0, restitution=1.0)
    runs = tuple(
        holding.Escapes(well, 1.0, np.linspace(1, 50, 50), 1e3) for well in (*wells, elastic)
    )
    drags, losses = np.array([0.5, 1.0, 4.0]), np.array([0.0, 0.5, 1.0])
    times = np.arange(1.0, 10.0).reshape(3, 3)
    return holding.Comparison(wells, 1.0, drags, times, losses, times, runs)


@cache
def steady():
    one = Mean(8.0, 0.1, 4)
    means = dict.fromkeys(
        ("heading", "shift", "azimuth", "climb_rate", "early", "late", "drift"), one
    )
    counts = {"scatter": 1.0, "samples": 20.0, "held": 4, "count": 4, "minimiser": 8.0}
    return Steady(drum=dumbbells.DumbbellDrum(), chatter=0.4, **means, **counts, strata={})


def figure():
    from matplotlib.figure import Figure

    return Figure()


def axes():
    return figure().add_subplot(projection="3d")


def study(size, *, noise=0.0):
    return {"area": size**2 + noise}


folder = cache(lambda: Path(tempfile.mkdtemp(prefix="polycorner-calls-")))


def new(name):
    return folder() / name


@cache
def problem_file():
    from polycorner import files

    return files.save_problem(new("problem.toml"), square(), energy())


@cache
def arm():
    rod = bodies.RobotLink(
        bodies.capsule([0, 0, 0], [1, 0, 0], 0.1), bodies.Mass(1.0, [0.5, 0, 0], [0.01, 0.1, 0.1])
    )
    hinge = bodies.RobotJoint("base", "rod", lower=-1.0, upper=1.0)
    return bodies.Robot({"base": bodies.RobotLink(), "rod": rod}, {"hinge": hinge})


@cache
def mesh_file():
    path = new("corner.obj")
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    return path


@cache
def particle_file():
    path = new("some.xyz")
    path.write_text("1\nhydrogen\nH 0 0 0\n")
    return path


@cache
def particles():
    return files.read_particles(particle_file())


@cache
def urdf_file():
    path = new("arm.urdf")
    path.write_text(
        '<robot name="arm"><link name="a"/><link name="b"/><joint name="j" type="revolute">'
        '<parent link="a"/><child link="b"/><limit lower="-1" upper="1"/></joint></robot>'
    )
    return path


@cache
def study_file():
    path = new("study.toml")
    path.write_text('study = "area"\n[axes.size]\nvalues = [1.0]\n')
    return path


study_results = cache(lambda: sweeps.sweep(study, {"size": [1.0, 2.0]}))


@cache
def stored():
    sweeps.sweep(study, {"size": [1.0, 2.0]}, store=new("store"))
    return new("store")


@cache
def kept(kind):
    from polycorner import files

    value = {"certificate": certificate, "skeleton": skeleton, "trajectory": trajectory}
    if kind == "graph":
        return files.save_graph(skeleton(), new("kept.graphml"))
    return getattr(files, f"save_{kind}")(value[kind](), new(f"kept-{kind}.nc"))


hexagon = cache(
    lambda: bodies.polygon([[math.cos(t), math.sin(t)] for t in np.arange(6) * math.pi / 3])
)
arrangement = cache(
    lambda: bodies.Arrangement(
        {"a": bodies.disc(1.0), "b": bodies.disc(0.5)}, walls=bodies.box([-5, -5], [5, 5])
    )
)
guided = cache(
    lambda: replace(
        arrangement(), joints={"rail": bodies.Rail("world", "b", at=[3.0, 0.0], axis=[1.0, 0.0])}
    )
)
lying = cache(lambda: dumbbells.RigidDumbbells(drum()).state(PLACED))
keel = cache(lambda: dumbbells.Keel(0.12, 0.1, 0.3, 0.06, 0.2))
dyad = cache(lambda: dumbbells.dyad_minima(pair())[0])
solid = cache(lambda: drum_pictures.forbidden_solid(plane_pair(), 16))
plane_pair = cache(lambda: dumbbells.DumbbellPair(16.0, 3.0, 1.5))
