"""Colours of figures, and saving them without a display."""

from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from polycorner.atomic import replace_atomically
from polycorner.checks import listed, refuse
from polycorner.kinds import checked

# Colours that stay apart for colour-blind readers (Okabe and Ito).
BODIES = ("#0072B2", "#D55E00")
SHADES = ("#56B4E9", "#0072B2", "#CC79A7", "#D55E00", "#E69F00", "#009E73")


def bridged(shown: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return samples of a curve and their neighbours, so that parts in two line styles meet.

    Examples
    --------
    >>> bridged(np.array([True, False, False])).tolist()
    [True, True, False]
    """
    near = shown.copy()
    near[1:] |= shown[:-1]
    near[:-1] |= shown[1:]
    return near


@checked
def save(figure: Figure, path: Path) -> Path:
    """Write a figure, in the format that the suffix names, and return its path."""
    formats = FigureCanvasAgg(figure).get_supported_filetypes()
    if path.suffix[1:].lower() not in formats:
        refuse("path", f"a name ending in .{listed(formats)}", path.name)
    with replace_atomically(path) as temporary:
        figure.savefig(temporary, dpi=150)
    return path
