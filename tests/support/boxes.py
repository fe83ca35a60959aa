"""Boxes and arches of sharp hulls, and what overlaps among bodies like one."""

from itertools import product

import numpy as np
from scipy.optimize import linprog

from polycorner.bodies import mass_of, polygon, polytope
from tests.support.hulls import margin


def brick(*sides):
    """A sharp box about the origin."""
    half = np.array(sides) / 2
    if len(sides) == 2:
        return polygon(half * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]))
    return polytope(half * np.array(list(product([-1, 1], repeat=3))))


def deepest(a, placements):
    """The least margin of any two of several bodies like one, at each of some instants."""
    size, worst = a.named["A"].size, np.inf
    for q in placements:
        parts = [a.placed(x)["A"].parts[""] for x in q]
        for k, one in enumerate(parts):
            for i in range(k):
                if np.linalg.norm((q[k] - q[i])[: a.dimension]) < 2 * size:
                    worst = min(worst, margin(one, parts[i]))
    return worst


def loads(path, t=-1):
    """The normal force on all contacts of the same bodies, by these."""
    total = {}
    for bodies, _, force in path.touching[t]:
        total[bodies] = total.get(bodies, 0.0) + force
    return total


def voussoir(thickness, count):
    """One of so many wedges of a semicircular arch of mean radius 1, about its centre of mass.

    Then the distance of its centre from that of the arch.
    """
    ends = [(s, 1 + t * thickness / 2) for t, s in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    angles = [(s * np.pi / count / 2, r) for s, r in ends]
    points = np.array([[r * np.cos(angle), r * np.sin(angle)] for angle, r in angles])
    centre = mass_of(polygon(points)).centre
    return polygon(points - centre), float(centre[0])


def can_stand(thickness, count, mu):
    """Whether forces at the ends of all joints can hold the arch, with weight and friction.

    A linear programme: two pressures and a shear at each joint balance every wedge ([Heyman]).
    """
    body, centre = voussoir(thickness, count)
    weight = mass_of(body).mass
    joints = count + 1
    balance, known = np.zeros((3 * count, 3 * joints)), np.zeros(3 * count)
    for k in range(count):
        at = np.pi * (k + 0.5) / count
        known[3 * k + 1 : 3 * k + 3] = weight, centre * np.cos(at) * weight
        for j, sign in ((k, 1), (k + 1, -1)):
            angle = np.pi * j / count
            out, along = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
            for e, r in enumerate((1 - thickness / 2, 1 + thickness / 2)):
                balance[3 * k : 3 * k + 2, 3 * j + e] = sign * along
                balance[3 * k + 2, 3 * j + e] = sign * r
            balance[3 * k : 3 * k + 2, 3 * j + 2] = sign * out
    slides = np.zeros((2 * joints, 3 * joints))
    for j, sign in product(range(joints), (0, 1)):
        slides[2 * j + sign, 3 * j : 3 * j + 3] = -mu, -mu, 1 - 2 * sign
    bounds = [(0, None), (0, None), (None, None)] * joints
    zero = np.zeros(2 * joints)
    found = linprog(np.zeros(3 * joints), slides, zero, balance, known, bounds)
    return found.status == 0
