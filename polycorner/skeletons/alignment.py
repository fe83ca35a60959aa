"""Borders of faces whose edges are known from images under a finite symmetry."""

from dataclasses import replace

import numpy as np

from polycorner.polyhedra.symmetry import Element
from polycorner.skeletons.borders import Border, seeds_of
from polycorner.skeletons.nets import Net
from polycorner.skeletons.surfaces import Surface
from polycorner.spaces.manifold import Array

# Step, in scale units, of the differences that carry a direction.
STEP = 1e-4


def aligned(border: Border) -> Border | None:
    """Return a border with all its edges carried to one image of the face.

    None if a symmetry carries the face to itself, so that it is not its own quotient, or if it is
    not clear which image of an edge bounds it.
    """
    group = border.quotient.symmetry.group
    if len(group) == 1:
        return border
    surface = Surface(border.quotient, border.active, border.seeds[0])
    net = Net(surface, border.seeds[:1])
    if any(_covered(net, _carried(g, net.points)) for g in group[1:]):
        return None
    edges = []
    for active, points, closed in border.edges:
        images = [_carried(g, points) for g in group]
        here = [image for image in images if _covered(net, image)]
        if len(here) != 1:
            return None
        edges.append((active, here[0], closed))
    if not edges:
        return border
    around = surface.embedded(np.concatenate([points for _, points, _ in edges]))

    def moved(ray: tuple[frozenset[int], Array]) -> tuple[frozenset[int], Array]:
        active, (q, direction) = ray
        ahead = q + STEP * surface.scales * direction
        images = [_carried(g, np.array([q, ahead])) for g in group]
        away = [
            np.linalg.norm(surface.apart(surface.embedded(image[:1]), around), axis=1).min()
            for image in images
        ]
        start, end = images[int(np.argmin(away))]
        return active, np.array([start, (end - start) / surface.scales / STEP])

    corners = tuple((moved(first), moved(last)) for first, last in border.corners)
    seeds = seeds_of([points for _, points, _ in edges])
    return replace(border, edges=tuple(edges), corners=corners, seeds=seeds)


def _carried(element: Element, points: Array) -> Array:
    return np.array([element.apply(q) for q in points])


def _covered(net: Net, points: Array) -> bool:
    """Whether a net covers any of the points."""
    q, _ = net.surface.projected(points)
    _, gradients = net.surface.evaluated(q)
    return bool(net.covers(net.surface.embedded(q), net.surface.across(gradients)).any())
