"""What is drawn in an axes, for tests to compare with formulas."""

import numpy as np
from matplotlib.colors import to_rgb


def lines(axes, colour):
    """Return the points of the lines drawn in a colour."""
    same = [line for line in axes.lines if to_rgb(line.get_color()) == to_rgb(colour)]
    return [line.get_xydata() for line in same if len(line.get_xydata()) > 2]


def bars(axes):
    """Return places with error bars, half the heights of the bars, and the line, for each curve."""
    shown = []
    for bar in axes.containers:
        line, _, drawn = bar.lines
        heights = [np.ptp(segment[:, 1]) for segment in drawn[-1].get_segments()]
        shown.append((line.get_xydata(), np.array(heights) / 2, line))
    return shown
