"""Readings from drawings of a pair: texts, balls, and marks of contacts."""

import numpy as np
from matplotlib.colors import same_color
from matplotlib.patches import Circle

from polycorner.dumbbells import DumbbellPair
from polycorner.pictures.style import BODIES

LONG = DumbbellPair(16, 3, 1.5)


def texts(axes):
    return [text.get_text() for text in axes.texts]


def circles(axes):
    """Return the balls of an axes as rows of four: A1, A2, B1, B2, with their radius."""
    found = [p for p in axes.patches if isinstance(p, Circle)]
    centres = np.array([c.center for c in found]).reshape(-1, 4, 2)
    (radius,) = {round(c.radius, 12) for c in found}
    for k, circle in enumerate(found):
        assert same_color(circle.get_facecolor(), BODIES[(k % 4) // 2])
    return centres, radius


def lit(axes):
    """Return where contacts are drawn."""
    marks = [line.get_xydata() for line in axes.lines if line.get_marker() == "o"]
    return np.array([mark[0] for mark in marks if len(mark)])


def depths(pair, centres, scale, mark):
    """Return how far outside a mark is of A and of B, each its balls and its rod."""
    found = []
    for body in (centres[:2], centres[2:]):
        u = body[1] - body[0]
        s = np.clip((mark - body[0]) @ u / (u @ u), 0, 1)
        to_rod = np.linalg.norm(mark - body[0] - s * u) - scale * pair.rod_radius
        to_balls = np.linalg.norm(mark - body, axis=1) - scale * pair.ball_radius
        found.append(min(to_rod, *to_balls))
    return found
