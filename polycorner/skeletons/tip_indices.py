"""What tips count in the Euler characteristic of a face.

At a tip, where tangents do not tell the face, its link is followed: the arc or the closed curve in
which the face meets a small sphere, and over which it is a cone ([Mil] sec. 2).  A height that
vanishes on no limit of tangent planes has there the index ``1 - chi`` of the part of the link that
lies lower ([GoreskyMacPherson], part I): chi is the number of arcs of this part, and 0 where it is
all of a closed curve.
"""

from collections.abc import Iterable

import numpy as np

from polycorner.skeletons.borders import Tip
from polycorner.skeletons.heights import Height
from polycorner.skeletons.points import HeldPoint
from polycorner.skeletons.spheres_about import link_about
from polycorner.skeletons.surfaces import Surface
from polycorner.skeletons.walks import End, follow
from polycorner.spaces.manifold import Array

# Deviation from 1 of the cosine between directions that are parallel.
PARALLEL = 1e-6


Links = list[tuple[Tip, Array]]


def links_at(surface: Surface, tips: Iterable[Tip]) -> Links | None:
    """Return tips with their links, as :func:`tips_index` takes them; None if one is unknown."""
    found = [(tip, _link(surface, tip)) for tip in tips]
    known = [(tip, link) for tip, link in found if link is not None]
    return known if len(known) == len(found) else None


def tips_index(height: Height, links: Links) -> int:
    """Return what tips count for a height."""
    return sum(_index(height, tip, link) for tip, link in links)


def _link(surface: Surface, tip: Tip) -> Array | None:
    """Return the scaled ways from a tip to points of its link in order, ``(n, k)``.

    None where the link is not known.
    """
    if not tip.sampled:
        opposite = len(tip.ways) == 2 and abs(tip.ways[0] @ tip.ways[1]) > 1 - PARALLEL
        return np.array(tip.ways).T if opposite else None
    radius = float(np.linalg.norm((tip.near - tip.point) / surface.scales))
    link = link_about(surface.quotient.at(tip.point), radius)
    start = HeldPoint(link, tip.near, link.at(tip.near).basis(surface.active))
    ahead = start.tangent(np.random.default_rng(0).standard_normal(len(tip.near)))
    sides: list[Array] = []
    for way in (ahead, -ahead):
        walk = follow(start, way, passive=surface.active, home=True)
        sides.append(walk.points[:: 1 - 2 * len(sides)])
        if walk.end is End.CLOSED and not tip.ways:
            break
        if walk.end is not End.CORNER or not tip.ways:
            return None
    points = np.concatenate(sides[::-1])
    return np.asarray(((points - tip.point) / surface.scales).T)


def _index(height: Height, tip: Tip, link: Array) -> int:
    """Return what a tip counts; of its link the scaled ways are given."""
    low = height.slopes(tip.point[None], link[None])[0] < 0
    before = np.append(bool(not tip.ways and low[-1]), low[:-1])
    return 1 - int((low & ~before).sum())
