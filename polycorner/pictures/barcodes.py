"""Barcodes: the heights between which classes of homology live."""

from itertools import count

import numpy as np
from matplotlib.figure import Figure

from polycorner import checks
from polycorner.kinds import checked
from polycorner.pictures.style import SHADES
from polycorner.polyhedra.nerves import Nerve

WIDTH, HEAD, ROW = 7.0, 1.2, 0.09  # inches
MARGIN = 0.15  # of the span of the heights, beyond which bars go on that do not end


@checked
def draw_barcode(nerve: Nerve, label: str = "height") -> Figure:
    """Draw a bar for every class of homology, from its death to its birth.

    Bars that reach the left side do not end, and those that reach the right side have no birth.
    Dashed lines are the critical heights; colours tell dimensions.

    Parameters
    ----------
    nerve : Nerve
    label : str, optional
        What the height is.
    """
    checks.instance("nerve", nerve, Nerve, "nerve(polyhedron)")
    heights = np.array(nerve.critical or (0.0,))
    margin = MARGIN * (np.ptp(heights) or 1.0)
    left, right = float(heights.min() - margin), float(heights.max() + margin)
    rows = count()
    figure = Figure(figsize=(WIDTH, HEAD + ROW * len(nerve.bars)), layout="constrained")
    axes = figure.add_subplot()
    for dimension in sorted({bar.dimension for bar in nerve.bars}):
        some = [bar for bar in nerve.bars if bar.dimension == dimension]
        axes.hlines(
            [next(rows) for _ in some],
            [max(bar.death, left) for bar in some],
            [min(bar.birth, right) for bar in some],
            color=SHADES[dimension % len(SHADES)],
            lw=3,
            label=f"dimension {dimension}",
        )
    for height in nerve.critical:
        axes.axvline(height, color="0.6", lw=0.8, ls="--", zorder=0)
    axes.set(xlim=(left, right), yticks=[], xlabel=label)
    figure.legend(loc="outside right upper", frameon=False, fontsize=8)
    return figure
