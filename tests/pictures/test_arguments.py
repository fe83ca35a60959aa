"""Wrong arguments of drawing functions: one table of call, exception and argument named."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from polycorner import Manifold, Polyhedron
from polycorner.models import SphereCluster, TorusDisks
from polycorner.pictures import (
    draw_cells,
    draw_clusters,
    draw_critical,
    draw_motion,
    draw_region,
    draw_solid,
    isosurface,
    write_mesh,
)

PLANE = Manifold.euclidean("x y")
X, Y = PLANE.symbols
QUADRANT, BOUNDS = Polyhedron(PLANE, [X, Y]), (-1, 1, -1, 1)
THREE = SphereCluster(3)
BALL = SimpleNamespace(
    vertices=np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]),
    faces=np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)]),
)
BOX = [(-2, 2)] * 3


def region(polyhedron=QUADRANT, bounds=BOUNDS, **more):
    return lambda _: draw_region(polyhedron, bounds, **more)


def clusters(model=THREE, points=None, **more):
    return lambda _: draw_clusters(model, THREE.stacked() if points is None else points, **more)


def motion(model=THREE, polyline=None, **more):
    line = np.stack([THREE.stacked()] * 3) if polyline is None else polyline
    return lambda _: draw_motion(model, line, **more)


def ball(p):
    return np.linalg.norm(p, axis=-1) - 1


def surface(function=ball, bounds=BOX, resolution=8, **more):
    return lambda _: isosurface(function, bounds, resolution, **more)


def file(name, **more):
    return lambda folder: write_mesh(isosurface(ball, BOX, 8).mesh, folder / name, **more)


WRONG = [
    (region(polyhedron="L"), TypeError, "polyhedron"),
    (region(Polyhedron(Manifold.euclidean("x y z"), [X])), ValueError, "polyhedron"),
    (region(Polyhedron(PLANE, [X], [Y])), ValueError, "polyhedron"),
    (region(bounds=(0, 1, 1, 0)), ValueError, "bounds"),
    (region(bounds=(0, 1)), ValueError, "bounds"),
    (region(bounds=(0, np.inf, 0, 1)), ValueError, "bounds"),
    (region(resolution=1), ValueError, "resolution"),
    (region(resolution=9.5), TypeError, "resolution"),
    (region(corners=[("A", (0, 0, 0))]), ValueError, "corners"),
    (region(corners=[(0, 0)]), TypeError, "corners"),
    (region(minima=[("A", "B")]), TypeError, "minima"),
    (region(minima=[("A", (0, np.nan))]), ValueError, "minima"),
    (region(edges=[[0, 1]]), ValueError, "edges"),
    (region(edges=[("a", [[0, 1]])]), ValueError, "edges"),
    (clusters(model=3), TypeError, "model"),
    (clusters(points=[[0.0]]), ValueError, "points"),
    (clusters(points=np.zeros((0, 9))), ValueError, "points"),
    (clusters(points=np.zeros((1, 3, 3))), ValueError, "points"),
    (clusters(points=[9 * [math.nan]]), ValueError, "points"),
    (clusters(points="abc"), TypeError, "points"),
    (clusters(labels=["a", "b"]), ValueError, "labels"),
    (clusters(singular=[1]), ValueError, "singular"),
    (motion(model=None), TypeError, "model"),
    (motion(polyline=THREE.stacked()), ValueError, "polyline"),
    (motion(polyline=[[1, 2]]), ValueError, "polyline"),
    (motion(frames=1), ValueError, "frames"),
    (motion(frames=2.5), TypeError, "frames"),
    (motion(frames=True), TypeError, "frames"),
    (lambda _: draw_critical(TorusDisks(2), []), ValueError, "configurations"),
    (lambda _: draw_cells(SimpleNamespace(parameters={})), TypeError, "proof"),
    (lambda _: draw_solid(BALL, points=[(0, 0, 1)], labels=["a", "b"]), ValueError, "labels"),
    (surface(bounds=[(-2, 2), (2, -2), (0, 1)]), ValueError, "bounds"),
    (surface(bounds=[(-2, 2), (-2, 2)]), ValueError, "bounds"),
    (surface(bounds=[(-2, 2), (-2, 0.5), (-2, 2)]), ValueError, "bounds"),
    (surface(bounds=[(-2, 2), (-2, 2), (0, 2)]), ValueError, "bounds"),
    (surface(resolution=3), ValueError, "resolution"),
    (surface(resolution=(8, 8)), ValueError, "resolution"),
    (surface(resolution=8.0), TypeError, "resolution"),
    (surface(periodic=(True,)), ValueError, "periodic"),
    (surface(lambda p: p[:, 0], periodic=(True, False, False)), ValueError, "periodic"),
    (surface(lambda p: ball(p) + 9), ValueError, "function"),
    (surface(lambda p: ball(p) - 9, periodic=(True, True, True)), ValueError, "function"),
    (surface(lambda p: p), ValueError, "function"),
    (surface(lambda p: ball(p) * np.nan), ValueError, "function"),
    (file("ball.stl"), ValueError, "path"),
    (file("ball.ply", points=[(0, 0, 0)]), ValueError, "path"),
    (file("ball.ply", curves=[("c", np.eye(3))]), ValueError, "path"),
    (file("ball.ply", facts={"volume": 1.0}), ValueError, "path"),
]


@pytest.mark.parametrize(("call", "error", "argument"), WRONG)
def test_wrong_arguments_are_named(call, error, argument, tmp_path):
    with pytest.raises(error, match=f"^{argument}: expected .*; .*"):
        call(tmp_path)
    assert not list(tmp_path.iterdir())
