"""What is drawn in an axes, for tests to compare with formulas."""

from matplotlib.colors import to_rgb


def lines(axes, colour):
    """Return the points of the lines drawn in a colour."""
    same = [line for line in axes.lines if to_rgb(line.get_color()) == to_rgb(colour)]
    return [line.get_xydata() for line in same if len(line.get_xydata()) > 2]
