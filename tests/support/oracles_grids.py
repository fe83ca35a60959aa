"""Euler characteristics and components of a set by counting the cells of a cubical complex.

A cell of a grid belongs to the complex if all its vertices lie in the set.
"""

import itertools

import numpy as np
from scipy.ndimage import label


def vertices(inside, axes):
    """Return which vertices of a grid lie in a set, from ``inside(*coordinates)``."""
    return inside(*np.meshgrid(*axes, indexing="ij"))


def cells(grid, periodic, directions):
    """Return which cells spanned by given directions have all their vertices in the set."""
    found = grid
    for axis in directions:
        moved = np.roll(found, -1, axis)
        if not periodic[axis]:
            cut = [slice(None)] * grid.ndim
            cut[axis] = slice(-1, None)
            moved[tuple(cut)] = False
        found = found & moved
    return found


def grid_euler(grid, periodic):
    """Return vertices minus edges plus squares minus cubes."""
    return sum(
        (-1) ** k * int(cells(grid, periodic, directions).sum())
        for k in range(grid.ndim + 1)
        for directions in itertools.combinations(range(grid.ndim), k)
    )


def grid_boundary_euler(grid, periodic):
    """Return that of the boundary of a solid: twice that of the solid, in three dimensions."""
    return 2 * grid_euler(grid, periodic)


def grid_pieces(grid):
    """Return the number of components on a grid that is not periodic."""
    return label(grid)[1]
