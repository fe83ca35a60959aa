"""One small value of every public class, each made once in a process."""

import math
import tempfile
from functools import cache
from pathlib import Path

import numpy as np
import sympy

import polycorner as pc
from polycorner import bodies, dumbbells, models, motion, polyhedra, proofs, sweeps
from polycorner.dumbbells import pictures as drum_pictures
from polycorner.dumbbells.dynamics.singles import Mean
from polycorner.dumbbells.dynamics.steady import Steady
from polycorner.models.wells import holding
from polycorner.models.wells.wells import KINDS, Well

M = pc.Manifold.euclidean("x y")
X, Y = M.symbols
UNIT = [(0.0, 1.0)] * 2
STRETCH = sympy.Symbol("a")


@cache
def square():
    return pc.Polyhedron(M, {"left": X, "bottom": Y, "right": 1 - X, "top": 1 - Y})


@cache
def energy():
    return pc.SmoothFunction("energy", STRETCH * X + Y, M, parameters={"a": 2.0})


@cache
def certificate():
    return pc.certify(square(), energy(), [0.0, 0.0])


@cache
def minima():
    return pc.minima(square(), energy(), starts=3, box=UNIT)


@cache
def skeleton():
    return pc.skeleton(square(), [[0.5, 0.5]])


@cache
def system():
    vx, vy = pc.velocities(M)
    return pc.System(square(), (vx**2 + vy**2) / 2, 9.81 * Y, friction=(friction(),))


@cache
def friction():
    return pc.Friction("floor", (pc.velocities(M)[0],), motion.Interval(0.3), "bottom")


@cache
def state():
    return system().state([0.5, 0.5])


@cache
def trajectory():
    return pc.simulate(system(), state(), 0.01, 0.001)


@cache
def pair_friction():
    (vx1, _), (vx2, _) = motion.pair_velocities(M)
    return motion.PairFriction({"touch": (vx1 - vx2,)}, motion.Interval(0.3))


@cache
def contact_family():
    (x1, y1), (x2, y2) = motion.pair_coordinates(M)
    gap = sympy.sqrt((x1 - x2) ** 2 + (y1 - y2) ** 2) - 0.1
    return motion.ContactFamily({"touch": gap}, 1.0, friction=(pair_friction(),))


@cache
def proof():
    return pc.prove(certificate(), digits=8)


@cache
def corner_list():
    return proofs.corners(square(), box=UNIT)


@cache
def stationary_list():
    return proofs.stationary_points(square(), energy(), box=UNIT)


@cache
def cell():
    return pc.prove(certificate(), digits=8, parameters={"a": (1.9, 2.1)})


@cache
def nerve():
    return polyhedra.nerve(square(), Y)


@cache
def locus():
    return proofs.StationaryLocus({"x": 0.0}, {"x": 1.0}, 0, np.array([0.5, 0.0]))


def mirrored(q):
    return np.stack([1 - q[..., 0], q[..., 1]], axis=-1)


@cache
def element():
    return polyhedra.Element(mirrored, {"left": "right", "right": "left"})


@cache
def symmetry():
    return pc.Symmetry(elements=(element(),))


@cache
def pair():
    return dumbbells.DumbbellPair(16.0, 3.0, 1.5, 125.0)


@cache
def atlas():
    return dumbbells.pair_atlas(pair(), rng=0)


@cache
def drum():
    return dumbbells.DumbbellDrum(count=2)


PLACED = [[0.0, 0.0, 0.0], [0.0, 40.0, 0.0]]


@cache
def run():
    return pc.simulate(drum(), drum().state(PLACED), 0.01, 0.001)


@cache
def film():
    return drum_pictures.pair_film(pair(), [pair().nested("R")] * 2)


@cache
def scene():
    return drum_pictures.pair_scene(pair(), pair().nested("R"))


@cache
def minima_map():
    return dumbbells.minima_map(curvatures=[0.5], rods=[0.5], lengths=[4.0, 6.0], starts=3)


@cache
def pair_map():
    return dumbbells.pair_map([4.0], [0.5])


@cache
def spheres():
    return models.SphereCluster(4)


@cache
def tetrahedron():
    return [0.5, 0.5, 0.5, 0.5, -0.5, -0.5, -0.5, 0.5, -0.5, -0.5, -0.5, 0.5]


@cache
def disks():
    return models.TorusDisks(2)


@cache
def critical():
    return disks().critical(0, starts=3)


@cache
def packing():
    return models.PeriodicPacking.bidisperse(24).jam(0)


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


@cache
def folder():
    return Path(tempfile.mkdtemp(prefix="polycorner-calls-"))


def new(name):
    return folder() / name


@cache
def study_file():
    path = new("study.toml")
    path.write_text('study = "area"\n[axes.size]\nvalues = [1.0]\n')
    return path


@cache
def study_results():
    return sweeps.sweep(study, {"size": [1.0, 2.0]})


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


@cache
def hexagon():
    return bodies.polygon([[math.cos(t), math.sin(t)] for t in np.arange(6) * math.pi / 3])


@cache
def arrangement():
    return bodies.Arrangement(
        {"a": bodies.disc(1.0), "b": bodies.disc(0.5)}, walls=bodies.box([-5, -5], [5, 5])
    )


@cache
def lying():
    return dumbbells.RigidDumbbells(drum()).state(PLACED)


@cache
def keel():
    return dumbbells.Keel(0.12, 0.1, 0.3, 0.06, 0.2)


@cache
def dyad():
    return dumbbells.dyad_minima(pair())[0]


@cache
def solid():
    return drum_pictures.forbidden_solid(plane_pair(), 16)


@cache
def plane_pair():
    return dumbbells.DumbbellPair(16.0, 3.0, 1.5)
