"""
On the sphere and among rotations
=================================

A region of the sphere with its skeleton and the minima of an energy on it, and a body that turns
over while it turns freely.

The region is a triangle between great circles without a cap: its edges are arcs, their lengths
angles.  The energy has its minima on an edge and in two corners.  The body turns about the
axis of its intermediate moment of inertia, nearly; by Jacobi's solution it turns over with half the
period of an elliptic function, ``2 K(m) / rate``.

Run it to draw the figure: ``python examples/ex17_turning.py [FOLDER]``.
"""

import math
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import sympy as sp
from scipy.special import ellipk

from polycorner import Manifold, Minima, Polyhedron, Skeleton, minima, skeleton
from polycorner.motion import System, Trajectory, rotational_energy, simulate
from polycorner.skeletons import traced

SPHERE, TURN = Manifold.sphere("u"), Manifold.rotation("a")
TILT = sp.Rational(1, 4)
CAP = sp.Rational(19, 20)
MOMENTS = np.array([1.0, 2.0, 3.0])
SPIN = np.array([0.02, 1.0, 0.0])  # in the axes of the body, rad/s
COLOURS = ("#009E73", "#E69F00", "#D55E00")  # inside, on edges, in corners


@dataclass(frozen=True)
class Result:
    """The skeleton, the minima, and the motion of the body.

    ``flips`` are the times between turns, in s, and ``period`` is that of the exact solution;
    ``drift`` is the largest relative change of the energy.
    """

    parts: Skeleton
    wells: Minima
    path: Trajectory
    flips: np.ndarray
    period: float
    drift: float


def main() -> Result:
    region, energy = triangle()
    path = turned()
    spin, at = spins(path)[:, 1], path.times
    before = np.flatnonzero(spin[:-1] * spin[1:] < 0)
    crossings = at[before] + (at[1] - at[0]) * spin[before] / (spin[before] - spin[before + 1])
    kinetic = spins(path) ** 2 @ MOMENTS / 2
    return Result(
        parts=skeleton(region, [SPHERE.wrap([1.0, 1.0, 0.2])]),
        wells=minima(region, energy, starts=60),
        path=path,
        flips=np.diff(crossings),
        period=jacobi(),
        drift=float(abs(kinetic / kinetic[0] - 1).max()),
    )


def triangle() -> tuple[Polyhedron, sp.Expr]:
    """Return a spherical triangle without a cap around its middle, and an energy."""
    x, y, z = SPHERE.symbols
    middle = (x + y + z) / sp.sqrt(3)
    walls = {"x": x + TILT, "y": y + TILT, "z": z + TILT, "cap": CAP - middle}
    return Polyhedron(SPHERE, walls), x / 2 - 2 * x**2 - 3 * y**2 - 2 * z**2


def turned() -> Trajectory:
    """Let the body turn freely, from the identity."""
    body = System(Polyhedron(TURN, {}), rotational_energy(TURN, MOMENTS))
    start = np.array([1.0, 0.0, 0.0, 0.0])
    state = body.state(start, TURN.frame(start) @ SPIN)
    return simulate(body, state, 80.0, 0.01, every=5)


def spins(path: Trajectory) -> np.ndarray:
    """Return angular velocities in the axes of the body, ``(T, 3)``."""
    frames = TURN.frame(path.q[:, 0])
    return 4 * np.einsum("tni,tn->ti", frames, path.v[:, 0])


def jacobi() -> float:
    """Return the time between turns ([LL] sec. 37), where ``L^2 < 2 E J_2``."""
    c, b, a = MOMENTS
    energy, momentum = MOMENTS @ SPIN**2, ((MOMENTS * SPIN) ** 2).sum()
    rate = math.sqrt((b - c) * (energy * a - momentum) / (a * b * c))
    modulus = (a - b) * (momentum - energy * c) / ((b - c) * (energy * a - momentum))
    return float(2 * ellipk(modulus) / rate)


def draw(result: Result, path: Path) -> Path:
    """Draw the region with energy, edges and minima, and the angular velocity against time."""
    from matplotlib.figure import Figure

    from polycorner.pictures import save

    figure = Figure(figsize=(10, 4.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    _sphere(left, result)
    for k, label in enumerate(("least", "intermediate", "largest")):
        right.plot(result.path.times, spins(result.path)[:, k], label=label)
    right.set(xlabel="time (s)", ylabel="angular velocity (rad/s)", ylim=(-1.5, 1.15))
    right.set_title(f"turns over every {result.period:.4f} s")
    right.legend(loc="lower center", ncols=3, title="about the axis of the moment that is")
    return save(figure, path)


def _sphere(axes: Any, result: Result) -> None:
    """Draw the sphere as it is seen along its diagonal."""
    region, energy = triangle()
    across = np.array([[-1, 1, 0], [-1, -1, 2]]) / np.sqrt([[2], [6]])
    a, b = np.meshgrid(*[np.linspace(-1, 1, 801)] * 2)
    front = a**2 + b**2 < 1
    depth = np.sqrt(np.where(front, 1 - a**2 - b**2, 1))
    flat = np.where(front, [a, b], 0)
    points = np.moveaxis(np.tensordot(across.T, flat, 1), 0, -1) + depth[..., None] / 3**0.5
    points = SPHERE.onto(points)
    height = sp.lambdify(SPHERE.symbols, energy)(*np.moveaxis(points, -1, 0))
    height = np.where(front & region.contains(points), height, np.nan)
    axes.contourf(a, b, front, levels=[0.5, 1], colors=["0.93"])
    axes.contourf(a, b, height, levels=24, cmap="Blues_r")
    axes.contour(a, b, height, levels=12, colors="white", linewidths=0.5, linestyles="-")
    for edge in result.parts.edges:
        axes.plot(*(across @ traced(result.parts, edge).T), color="black", linewidth=1.4)
    for corner in result.parts.corners:
        axes.plot(*(across @ corner.point), "o", color="black", markersize=4)
    for c in result.wells:
        label = ("well inside", "on an edge", "in a corner")[len(c.active)]
        axes.plot(*(across @ c.point), "o", color=COLOURS[len(c.active)], markersize=9)
        axes.annotate(label, across @ c.point, (8, 8), textcoords="offset points")
    axes.set(aspect="equal", xlim=(-1.1, 1.3), ylim=(-1.05, 1.2))
    axes.set_axis_off()
    axes.set_title(f"{len(result.wells)} minima on a part of the sphere")


if __name__ == "__main__":
    result = main()
    print(result.parts)
    print(result.wells)
    print(f"turned over after {result.flips.round(4)} s, by Jacobi {result.period:.4f} s")
    print(f"relative change of the energy {result.drift:.1e}")
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    print(f"wrote {draw(result, folder / 'ex17_turning.png')}")
