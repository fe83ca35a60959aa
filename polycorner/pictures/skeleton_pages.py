"""Pages of skeletons: edges and corners in three coordinates, to be turned."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from polycorner.checks import names, refuse
from polycorner.kinds import checked
from polycorner.pictures.pages import html_page, packed, packed_contacts
from polycorner.skeletons.elements import Skeleton
from polycorner.spaces.manifold import Array, Manifold

MARK = 0.03  # size of a corner, of the extent
AXIS = 0.25  # length of the axes, of the extent


@checked
def skeleton_page(found: Skeleton, coordinates: Sequence[str] | None = None) -> str:
    """Return an HTML page that shows edges and corners of a skeleton, and needs no network.

    Parameters
    ----------
    found : Skeleton
        With one edge or corner at least.
    coordinates : sequence of str, optional
        Up to three of the coordinates, each in units of its scale; default the first three.

    Raises
    ------
    TypeError, ValueError
        For an empty skeleton, or names of no coordinates.
    """
    manifold = found.polyhedron.manifold
    chosen = list(manifold.names[:3] if coordinates is None else coordinates)
    names("coordinates", chosen, manifold.names)
    if not 0 < len(chosen) <= 3:
        refuse("coordinates", "one to three", chosen)
    at = [manifold.names.index(name) for name in chosen]

    def drawn(points: Any) -> Any:
        some = np.asarray(points)[..., at] / manifold.scale_array[at]
        return np.concatenate([some, np.zeros((*some.shape[:-1], 3 - len(at)))], axis=-1)

    lines = [drawn(_segments(manifold, edge.polyline)) for edge in found.edges]
    corners = [drawn(manifold.wrap(corner.point)) for corner in found.corners]
    if not lines and not corners:
        refuse("found", "a skeleton with edges or corners", found)
    every = np.concatenate([*[line.reshape(-1, 3) for line in lines], np.reshape(corners, (-1, 3))])
    low, high = every.min(axis=0), every.max(axis=0)
    size = float(np.linalg.norm(high - low)) or 1.0
    labels = [f"C{k}: {', '.join(corner.active)}" for k, corner in enumerate(found.corners)]
    data = {
        "flat": False, "unit": "", "speed": None, "count": 0,
        "times": packed(np.zeros(1, "<f4")), "centres": packed(np.zeros(0, "<f4")),
        "turns": packed(np.zeros(0, "<f4")), "kinds": [], "still": [], "shifts": [], "clip": [],
        "lines": [packed(line.astype("<f4")) for line in lines], "tone": "tint",
        "marks": "Corners",
        "axes": {"names": chosen, "origin": low.tolist(), "length": AXIS * size},
        "radius": 0.6 * size, "box": {"low": low.tolist(), "high": high.tolist()},
        "from": [0.45, -0.8, 0.35], "up": [0, 0, 1], "mark": MARK * size, "energies": [],
        "labels": ["Edges"], "word": packed(np.zeros(1, "<u4")),
        "words": [["; ".join(dict.fromkeys(", ".join(edge.active) for edge in found.edges))]],
        "contacts": packed_contacts([labels], corners),
    }  # fmt: skip
    note = f"{found!r}; {', '.join(chosen)} in units of their scales"
    return html_page("Corners and edges", note, data, plays=False)


def _segments(manifold: Manifold, line: Array) -> Array:
    """Return the segments ``(k, 2, n)`` of a polyline on circles, without those across a seam."""
    wrapped = np.asarray(manifold.wrap(line))
    pairs = np.stack([wrapped[:-1], wrapped[1:]], axis=1)
    moved = pairs[:, 1] - pairs[:, 0] - np.diff(line, axis=0)
    return np.asarray(pairs[(abs(moved) < manifold.scale_array).all(axis=1)])
