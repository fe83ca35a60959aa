"""Claim E7 for all sizes in a range at once: two dumbbells in the plane, all l and t, r = 3 mm.

The range is cut into cells.  In each of them ``G`` and ``delta`` are shown to be all the local
minima, for every ``l`` and ``t`` of the cell:

1.  :func:`~polycorner.proofs.stationary_points`, with the cell as its ``parameters``, leaves
    undecided boxes about one of the 16 labelled corners ``delta``, its images being covered by
    symmetry.  Everywhere else the placements in line, ``G``, are the only local minima.
2.  Near ``delta`` placements are described by ``(U, V, T, W)``: the centre of B lies ``u = p + U``
    across and ``v = l - s + V`` along the mean heading from that of A, with ``p = r + t`` and ``s^2
    = 4 r^2 - p^2``; the mean heading exceeds the one at which the nested pair rests by ``T``;
    headings differ from their mean by ``-W`` and ``W``.  For all sizes ``delta`` is the origin.
    The undecided boxes are enclosed in these coordinates, for all sizes of the cell.
3.  On this neighbourhood all functions but the contacts ``A2B1``, ``A2b``, ``aB1`` are positive
    (``apart``), so that ``D`` is where these three are not negative.
4.  The same search in the neighbourhood, for each part of the cell, proves that the origin is the
    only local minimum there.

In the formulas of the contacts and of the energy, terms that cancel at the origin are left out, as
intervals of sizes would not let them cancel.  With ``c = cos(2 T)``, ``k = sin(2 T)``, ``a = v0^2 -
p^2 + l^2``, ``b = 2 p v0``, ``h = sqrt(a^2 + b^2)`` and ``v0 = l - s`` the energy is, but for a
constant,

    4 E = (u^2 + v^2) - h c - da (a c + b k) / h - db (b c - a k) / h,

``da`` and ``db`` being the growth of ``v^2 - u^2 + l^2 cos(2 W)`` and ``2 u v`` from the origin.

Run ``python -m paper_checks.section6.range_of_sizes --help``.
"""

import argparse
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import sympy as sp

from polycorner import Manifold, Polyhedron, SmoothFunction
from polycorner.dumbbells import DumbbellPair, RelativePlacements
from polycorner.proofs import StationaryList, stationary_points
from polycorner.sweeps import Axis, SweepError, sweep
from polycorner.toolkit import BoxFunctions

BALL = 3.0
LENGTHS, RODS = (14.0, 18.0), (1.2, 1.8)
CELL = (0.2, 0.1)  # widths of a cell, in mm
PARTS = 2  # of a cell's sides, near the corner
RESOLUTION, FINE = 3e-3, 1e-5
TINY = 1e-9
NEAR = Manifold.euclidean("U V T W")
CHART = Manifold.euclidean("x y alpha beta l t")
Sides = dict[str, tuple[float, float]]


class Corner(NamedTuple):
    """The formulas near ``delta``: contacts, energy, and what is positive; and the coordinates."""

    contacts: dict[str, sp.Expr]
    energy: sp.Expr
    apart: dict[str, sp.Expr]
    coordinates: dict[str, sp.Expr]


def corner() -> Corner:
    """Return the formulas, in the symbols ``l``, ``t`` and the coordinates."""
    U, V, T, W = NEAR.symbols
    length, t = sp.symbols("l t")
    r = sp.Rational(BALL)
    p = r + t
    s = sp.sqrt(4 * r**2 - p**2)
    v0 = length - s
    u, v = p + U, v0 + V
    nearer = V + length * (1 - sp.cos(W))
    turned = (s - V) * sp.sin(W) - length * sp.sin(W) * (1 - sp.cos(W))
    across = U * sp.cos(W) - p * (1 - sp.cos(W))
    contacts = {
        "A2B1": 2 * p * U + U**2 - 2 * s * nearer + nearer**2,
        "A2b": across + turned,
        "aB1": across - turned,
    }
    a, b = v0**2 - p**2 + length**2, 2 * p * v0
    h = sp.sqrt(a**2 + b**2)
    c, k = sp.cos(2 * T), sp.sin(2 * T)
    outer = 2 * v0 * V + V**2, 2 * p * U + U**2
    da = outer[0] - outer[1] - length**2 * (1 - sp.cos(2 * W))
    db = 2 * (p * V + v0 * U + U * V)
    energy = outer[0] + outer[1] - h * c - da * (a * c + b * k) / h - db * (b * c - a * k) / h
    half, lean = length / 2, length * sp.sin(W)
    along = v * sp.cos(W) - half * sp.cos(2 * W)  # from the middle of a rod to the other's ball
    sides = {name: sign * u * sp.sin(W) for name, sign in (("A2", 1), ("B1", -1))}
    apart = {
        "A1B1": (u - lean) ** 2 + v**2 - 4 * r**2,
        "A2B2": (u + lean) ** 2 + v**2 - 4 * r**2,
        "A1B2": v + length * sp.cos(W) - 2 * r,
        **{f"{name} beside the rod": half - (along + side) for name, side in sides.items()},
        **{f"{name} beside the rod, too": half + along + side for name, side in sides.items()},
        "A1b": u * sp.sin(W) + v * sp.cos(W) + half * (sp.cos(2 * W) - 1) - p,
        "aB2": -u * sp.sin(W) + v * sp.cos(W) + half * (sp.cos(2 * W) - 1) - p,
        "B1 beside A": u * sp.cos(W) - lean * sp.cos(W) + v * sp.sin(W),
        "B2 beside A": u * sp.cos(W) + lean * sp.cos(W) + v * sp.sin(W),
    }
    x, y, alpha, beta = CHART.symbols[:4]
    mean = (alpha + beta) / 2 - sp.pi  # either dumbbell turned by half a turn
    coordinates = {
        "U": 2 * x * sp.cos(mean) - y * sp.sin(mean) - p,
        "V": 2 * x * sp.sin(mean) + y * sp.cos(mean) - v0,
        "T": mean + sp.atan(b / a) / 2,
        "W": (beta - alpha) / 2,
    }
    return Corner(contacts, energy / 4, apart, coordinates)


def everywhere(cell: Sides) -> StationaryList:
    """Search all placements for local minima, for all sizes of a cell."""
    largest = DumbbellPair(length=cell["l"][1], ball_radius=BALL, rod_radius=cell["t"][1])
    model = RelativePlacements(largest)
    return stationary_points(
        model.polyhedron, model.energy, box=model.box, symmetry=model.symmetry,
        parameters=cell, minima_only=True, resolution=RESOLUTION,
    )  # fmt: skip


def neighbourhood(undecided: np.ndarray, cell: Sides) -> np.ndarray:
    """Enclose boxes ``(k, 2, 4)`` in the coordinates near the corner; sides ``(2, 4)``."""
    functions = [SmoothFunction(k, f, CHART) for k, f in corner().coordinates.items()]
    sizes = np.broadcast_to(np.array([cell["l"], cell["t"]]).T, (len(undecided), 2, 2))
    boxes = np.concatenate([undecided, sizes], axis=2)
    low, high = BoxFunctions(functions, CHART).values(boxes[:, 0], boxes[:, 1])
    return np.array([low.min(axis=0), high.max(axis=0)])


def only_contacts(near: np.ndarray, cell: Sides) -> bool:
    """Whether all other functions are positive on a neighbourhood, for all sizes of a cell."""
    everything = NEAR * Manifold.euclidean("l t")
    functions = [SmoothFunction(k, f, everything) for k, f in corner().apart.items()]
    sides = np.concatenate([near, np.array([cell["l"], cell["t"]]).T], axis=1)
    low, _ = BoxFunctions(functions, everything).values(sides[:1], sides[1:])
    return bool((low > 0).all())


def nearby(near: np.ndarray, cell: Sides) -> StationaryList:
    """Search a neighbourhood of the corner for local minima, for all sizes of a cell."""
    formulas = corner()
    sizes = {name: sum(side) / 2 for name, side in cell.items()}
    contacts = [
        SmoothFunction(name, f, NEAR, parameters=sizes) for name, f in formulas.contacts.items()
    ]
    energy = SmoothFunction("trough", formulas.energy, NEAR, parameters=sizes)
    return stationary_points(
        Polyhedron(NEAR, contacts), energy, box=near.T.tolist(),
        parameters=cell, minima_only=True, resolution=FINE,
    )  # fmt: skip


def is_corner(found: StationaryList) -> bool:
    """Whether a list is complete, and has one minimum, which is at the origin for all sizes."""
    if not found.complete or len(found) != 1 or found.loci:
        return False
    (p,) = found
    return bool(p.is_minimum and (p.lower <= 0).all() and (p.upper >= 0).all())


def parts(cell: Sides) -> list[Sides]:
    """Cut a cell."""
    cuts = {name: np.linspace(*side, PARTS + 1).tolist() for name, side in cell.items()}
    return [{"l": a, "t": b} for a in pairwise(cuts["l"]) for b in pairwise(cuts["t"])]


def proved(length: float, rod: float, width: tuple[float, float] = CELL) -> dict[str, Any]:
    """Prove the statement for the cell that begins at ``length`` and ``rod``, in mm.

    Returns
    -------
    dict
        ``proved``; ``boxes`` and ``boxes_nearby`` of the two searches; ``reach`` of the
        neighbourhood, in mm or rad.
    """
    cell = {"l": (length, length + width[0]), "t": (rod, rod + width[1])}
    found = everywhere(cell)
    near = neighbourhood(found.undecided, cell)
    lines = all(
        abs(np.sin(end)) < TINY
        for place in found.loci
        for end in (*place.lower.values(), *place.upper.values())
    )
    alone = lines and not len(found) and not found.open_points and only_contacts(near, cell)
    locally = [nearby(near, part) for part in parts(cell)] if alone else []
    return {
        "proved": float(alone and all(map(is_corner, locally))),
        "boxes": float(found.tally.boxes),
        "boxes_nearby": float(sum(part.tally.boxes for part in locally)),
        "reach": abs(near).max(axis=0),
    }


def main() -> None:
    about = (
        "Prove in the plane: G and delta are all local minima (l 14 to 18, t 1.2 to 1.8, r 3 mm)."
    )
    parser = argparse.ArgumentParser(description=about)
    parser.add_argument("--store", help="a folder; the same command goes on where it stood")
    parser.add_argument("--workers", type=int, default=2, help="processes (default 2)")
    given = parser.parse_args()
    axes = {
        name: Axis(np.arange(low, high - 1e-9, width).round(9), unit="mm")
        for name, (low, high), width in (("length", LENGTHS, CELL[0]), ("rod", RODS, CELL[1]))
    }
    try:
        found = sweep(
            proved, axes, executor=given.workers, store=given.store,
            progress=lambda done, total, _: print(f"{done:g} of {total:g} cells", flush=True),
        )  # fmt: skip
    except (ValueError, SweepError) as error:
        parser.error(str(error))
    shown = found[["boxes", "boxes_nearby", "reach", "seconds"]].where(found["proved"] == 1)
    print(f"{int(found['proved'].sum())} of {found['proved'].size} cells are proved")
    print(f"{shown['boxes'].sum():.0f} boxes, near the corner {shown['boxes_nearby'].sum():.0f}")
    reach = ", ".join(f"{x:.3f}" for x in shown["reach"].max(("length", "rod")).values)
    print(f"neighbourhoods reach {reach} (U, V in mm; T, W in rad)")
    print(f"{shown['seconds'].sum():.0f} s of a processor")


if __name__ == "__main__":
    main()
