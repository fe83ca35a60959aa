"""Figures of disks on a torus, of critical configurations and of jammed packings."""

import math
from collections.abc import Sequence
from itertools import product
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection, LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon

from polycorner import checks
from polycorner.checks import refuse, whole
from polycorner.kinds import checked
from polycorner.models.disks.configurations import CriticalConfiguration
from polycorner.models.disks.disks import TorusDisks
from polycorner.models.packings.jammed import JammedPacking
from polycorner.spaces.manifold import Array

# Colours that stay apart for colour-blind readers (Okabe and Ito), by index.
INDICES = ("#0072B2", "#009E73", "#E69F00", "#D55E00", "#CC79A7")
RATTLER, FORCE, OUTSIDE = "#C9C9C9", "#1A1A1A", 0.2
THINNEST, THICKEST = 0.8, 4.0
REACH = 0.74  # half the side of a picture, in lattice vectors


@checked
def draw_critical(
    model: TorusDisks, configurations: Sequence[CriticalConfiguration], *, columns: int = 4
) -> Figure:
    """Draw configurations side by side, the torus as its Voronoi cell and images faint around it.

    Disks are coloured by index, rattlers grey.  A line joins two centres in contact, the wider the
    larger its force; contacts without force are dotted.

    Parameters
    ----------
    model : TorusDisks
        The model of the configurations.
    configurations : sequence of CriticalConfiguration
        At least one, drawn in this order.
    columns : int, optional
        Largest number side by side.
    """
    if not configurations:
        refuse("configurations", "at least one", configurations)
    rows = math.ceil(len(configurations) / whole("columns", columns, least=1))
    columns = math.ceil(len(configurations) / rows)
    figure = Figure(figsize=(2.5 * columns, 3.0 * rows), layout="constrained")
    grid = figure.subplots(rows, columns, squeeze=False)
    for axes, configuration in zip(grid.flat, configurations, strict=False):
        _draw_one(axes, model, configuration)
    for axes in grid.flat[len(configurations) :]:
        axes.set_axis_off()
    disks = "disk" if model.count == 1 else "disks"
    figure.suptitle(f"{model.count} {disks} on the {model.lattice} torus")
    return figure


def _draw_one(axes: Axes, model: TorusDisks, c: CriticalConfiguration) -> None:
    cell = Polygon(_cell(model), closed=True, fill=False, edgecolor="0.35", linewidth=1.2, zorder=6)
    axes.add_patch(cell)
    shifts = np.array(list(product(range(-2, 3), repeat=2))) @ model.basis
    colour = INDICES[min(c.index, len(INDICES) - 1)]
    for k, centre in enumerate(model.centres(c.point), start=1):
        fill = RATTLER if k in c.rattlers else colour
        for shift in shifts:
            place = tuple(centre + shift)
            _both(axes, cell, lambda at=place, f=fill: Circle(at, c.radius, fc=f, ec="white", lw=1))
    _draw_forces(axes, cell, model, c, shifts)
    axes.set(xlim=(-REACH, REACH), ylim=(-REACH, REACH), aspect="equal")
    axes.set_axis_off()
    family = f", nullity {c.nullity}" if c.nullity else ""
    mark = ", degenerate" if c.degenerate else ""
    axes.set_title(f"$r$ = {c.radius:.6f}\nindex {c.index}{family}{mark}", fontsize=9)


def _draw_forces(
    axes: Axes, cell: Polygon, model: TorusDisks, c: CriticalConfiguration, shifts: Array
) -> None:
    largest = max(c.stress.values())
    for name, force in c.stress.items():
        ends = model.segment(c.point, name)
        width = THINNEST + (THICKEST - THINNEST) * force / largest if force else THINNEST
        style: Any = {
            "colors": FORCE,
            "linewidths": width,
            "linestyles": "solid" if force else "dotted",
            "zorder": 4,
        }
        lines = [ends + shift for shift in shifts]
        _both(axes, cell, lambda ls=lines, s=style: LineCollection(ls, **s))


def _both(axes: Axes, cell: Polygon, make: Any) -> None:
    """Add two copies of an artist: faint everywhere, and opaque inside the cell."""
    for inside in (False, True):
        artist = make()
        if not inside:
            artist.set_alpha(OUTSIDE)
        if isinstance(artist, LineCollection):
            # Round ends that overlap would show as dots where they are faint.
            artist.set_capstyle("round" if inside else "butt")
            axes.add_collection(artist, autolim=False)
        else:
            axes.add_patch(artist)
        if inside:
            artist.set_clip_path(cell)


def _cell(model: TorusDisks) -> Array:
    """Return the corners of the Voronoi cell of the origin, in order, ``(k, 2)``.

    They are the circumcentres of neighbouring lattice vectors of least length and the origin.
    """
    vectors = np.array([v for v in product((-1, 0, 1), repeat=2) if any(v)]) @ model.basis
    nearest = vectors[np.linalg.norm(vectors, axis=1) < 1 + 1e-9]
    around = nearest[np.argsort(np.arctan2(nearest[:, 1], nearest[:, 0]))]
    pairs = zip(around, np.roll(around, -1, axis=0), strict=True)
    return np.array([np.linalg.solve(np.stack(pair), [0.5, 0.5]) for pair in pairs])


# ---------------------------------------------------------------------------------- jammed packings

BODY, LOOSE, EDGE, PRESS = "#BBD3E8", "#F2F2F2", "white", "#B2182B"
SIZE = 7.0  # inches
MARGIN = 0.02  # of the box
WIDEST = 6.0  # points, in a picture of a hundred discs
MOST_LARGEST = 0.995  # quantile of the forces that has the greatest width


def draw_packing(packing: JammedPacking) -> Figure:
    """Draw a packing of discs in its periodic box, with a line for every contact force.

    The line between two centres is the wider the larger the force; discs without force are pale.

    Parameters
    ----------
    packing : JammedPacking
        Of discs.

    Raises
    ------
    ValueError
        For spheres.
    """
    checks.instance("packing", packing, JammedPacking)
    if packing.dimension != 2:
        checks.refuse("packing", "discs", f"{packing.count} spheres")
    box = packing.box
    figure = Figure(figsize=(SIZE, SIZE), layout="constrained")
    axes = figure.add_subplot()
    shifts = box * np.array(list(product((-1, 0, 1), repeat=2)))
    centres = packing.centres % box
    radii = packing.inflation * packing.radii
    colours = np.where(packing.degrees > 0, BODY, LOOSE)
    places = (centres[None] + shifts[:, None]).reshape(-1, 2)
    widths = np.tile(2 * radii, len(shifts))
    axes.add_collection(
        EllipseCollection(
            widths,
            widths,
            np.zeros(len(places)),
            units="xy",
            offsets=places,
            offset_transform=axes.transData,
            facecolors=np.tile(colours, len(shifts)),
            edgecolors=EDGE,
            linewidths=0.3,
        )
    )
    first = centres[packing.pairs[:, 0]]
    segments = np.stack([first, first + packing.vectors], axis=1)
    largest = float(np.quantile(packing.forces, MOST_LARGEST)) if len(segments) else 1.0
    thick = np.minimum(packing.forces / largest, 1.0) * WIDEST * np.sqrt(100 / packing.count)
    axes.add_collection(
        LineCollection(
            (segments[None] + shifts[:, None, None]).reshape(-1, 2, 2).tolist(),
            linewidths=np.tile(thick, len(shifts)).tolist(),
            colors=PRESS,
            capstyle="round",
        )
    )
    span = -MARGIN * box, (1 + MARGIN) * box
    axes.plot([0, box, box, 0, 0], [0, 0, box, box, 0], color="0.3", lw=0.8)
    axes.set(xlim=span, ylim=span, aspect="equal")
    axes.set_axis_off()
    axes.set_title(
        f"{packing.count} discs, density {packing.density:.4f}, {len(packing.pairs)} contacts, "
        f"{len(packing.rattlers)} rattlers",
        fontsize=10,
    )
    return figure
