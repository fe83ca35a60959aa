"""Figures of jammed packings: bodies, and the network of their contact forces."""

from itertools import product

import numpy as np
from matplotlib.collections import EllipseCollection, LineCollection
from matplotlib.figure import Figure

from polycorner import checks
from polycorner.models.packings.jammed import JammedPacking

BODY, RATTLER, EDGE, FORCE = "#BBD3E8", "#F2F2F2", "white", "#B2182B"
SIZE = 7.0  # inches
MARGIN = 0.02  # of the box
THICKEST = 6.0  # points, in a picture of a hundred discs
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
    colours = np.where(packing.degrees > 0, BODY, RATTLER)
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
    thick = np.minimum(packing.forces / largest, 1.0) * THICKEST * np.sqrt(100 / packing.count)
    axes.add_collection(
        LineCollection(
            (segments[None] + shifts[:, None, None]).reshape(-1, 2, 2).tolist(),
            linewidths=np.tile(thick, len(shifts)).tolist(),
            colors=FORCE,
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
