"""Disks on a torus from the definition, slowly: distances, contacts, differences, copies."""

import math
import re
from functools import cache
from itertools import permutations, product

import numpy as np

from polycorner.models.disks.disks import TorusDisks

LATTICES = ("square", "hexagonal")
SEARCHED = {(2, "square"): 2, (2, "hexagonal"): 2, (3, "square"): 6, (3, "hexagonal"): 3}
SEARCHED |= {(4, "hexagonal"): 8}
BASES = {
    "square": np.array([[1.0, 0.0], [0.0, 1.0]]),
    "hexagonal": np.array([[1.0, 0.0], [0.5, math.sqrt(0.75)]]),
}


@cache
def found(count, lattice, seed=0):
    """Search once for all tests."""
    return TorusDisks(count, lattice).critical(np.random.default_rng(seed))


def plane(centres, lattice):
    """Return centres in the plane from lattice coordinates ``(2n,)``."""
    return np.reshape(centres, (-1, 2)) @ BASES[lattice]


def least_distance(centres, lattice):
    """Return the least distance over all pairs, a disk and its own images included."""
    points = plane(np.mod(centres, 1.0), lattice)
    least = math.inf
    for i, j in product(range(len(points)), repeat=2):
        for p, q in product(range(-3, 4), repeat=2):
            if i < j or (i == j and (p, q) != (0, 0)):
                moved = points[j] + p * BASES[lattice][0] + q * BASES[lattice][1]
                least = min(least, math.dist(points[i], moved))
    return least


def contact_vector(name, points, lattice):
    """Return the disks of a contact, numbered from 0, and the vector from one to the other."""
    i, j, p, q = map(int, re.fullmatch(r"(\d+)-(\d+)\((-?\d+),(-?\d+)\)", name).groups())
    shift = p * BASES[lattice][0] + q * BASES[lattice][1]
    return i - 1, j - 1, points[j - 1] + shift - points[i - 1]


def contact_distance(name, flat, lattice):
    return np.linalg.norm(contact_vector(name, flat.reshape(-1, 2), lattice)[2])


def differenced(function, x, step=1e-4):
    """Return the gradient by central differences."""
    return np.array(
        [(function(x + step * e) - function(x - step * e)) / (2 * step) for e in np.eye(len(x))]
    )


def labelled_copies(c, lattice):
    """Count the labelled configurations, up to translation, that are equal to this one."""
    centres = c.point[:-1].reshape(-1, 2)
    copies = []
    for g in TorusDisks(2, lattice).point_group:
        for order in permutations(range(len(centres))):
            image = (centres @ g.T)[list(order)]
            image = image - image[0]
            if not any(abs((image - o) - np.round(image - o)).max() < 1e-6 for o in copies):
                copies.append(image)
    return len(copies)
