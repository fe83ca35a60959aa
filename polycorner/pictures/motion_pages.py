"""Pages that play motions of bodies, and pages of skeletons."""

from collections.abc import Sequence
from itertools import product
from typing import Any

import numpy as np
from matplotlib.colors import to_hex, to_rgb

from polycorner.bodies.motions import Poses
from polycorner.bodies.shapes import Body
from polycorner.bodies.surfaces import Triangles, flat, joined, outline, surface
from polycorner.bodies.walls import HalfSpace, Wall
from polycorner.checks import names, refuse
from polycorner.kinds import checked
from polycorner.pictures.arrangements import (
    FIXED,
    OUTLINE,
    circle_of,
    colours_of,
    turns,
    wall_lines,
    window_of,
)
from polycorner.pictures.pages import html_page, packed, packed_contacts
from polycorner.pictures.rasters import BAND, DARK
from polycorner.skeletons.elements import Skeleton
from polycorner.spaces.manifold import Array, Manifold

FRAMES = 1000  # of a long motion, at most
RIM = 0.0025  # width of outlines in the plane, of the window
LIFT = 0.001  # between layers in the plane, of the window
AROUND = 48  # points of that band
SPOT = 0.03  # size of the marks of contacts, of the window


def motion_page(poses: Poses, *, title: str, speed: float, contacts: bool) -> str:
    """Return the HTML page that plays a motion; long ones at equal steps, in ``FRAMES`` instants.

    Parameters
    ----------
    poses : Poses
    title : str
    speed : float
        At which it plays at first: seconds of the motion in one second.
    contacts : bool
        Whether contacts are marked.
    """
    if len(poses) > FRAMES:
        poses = poses.only(np.linspace(0, len(poses) - 1, FRAMES).round().astype(int))
    is_flat = poses.arrangement.dimension == 2
    data = page_data(poses, speed=speed, contacts=contacts)
    heading = title or _counted(poses)
    note = _counted(poses) if title else ""
    return html_page(heading, note, data, plays=len(poses) > 1, flat=is_flat)


def _counted(poses: Poses) -> str:
    count = len(poses.kinds)
    bodies = "body" if count == 1 else "bodies"
    if not poses.timed:
        return f"{count} {bodies}"
    return f"{count} {bodies}, {poses.times[0]:g} to {poses.times[-1]:g} s"


def page_data(poses: Poses, *, speed: float, contacts: bool) -> dict[str, Any]:
    """Return a motion for JSON, its numbers packed; ``film.js`` unpacks them."""
    arrangement, window = poses.arrangement, window_of(poses)
    is_flat, unit = arrangement.dimension == 2, float(np.ptp(window[:, 0]))
    low, high = (np.resize([*corner, 0.0], 3) for corner in window)
    touched = poses.touching if contacts else ((),) * len(poses)
    found = [poses.named_marks(k) if touched[k] else [] for k in range(len(poses))]
    points = np.array([point for marks in found for _, point in marks])
    names = [[name for name, _ in marks] for marks in found]
    centres = np.where(poses.present[..., None], _in_space(poses.boxed), np.nan)
    return {
        "flat": is_flat,
        "unit": "s" if poses.timed else "",
        "speed": speed if poses.timed else None,
        "count": len(poses.kinds),
        "times": packed(np.asarray(poses.times, "<f4")),
        "centres": packed(np.asarray(centres, "<f4")),
        "turns": packed(np.asarray(poses.turns[..., [1, 2, 3, 0]], "<f4")),
        "kinds": _kinds(poses, unit),
        "still": _still(poses, window, unit),
        "lines": [] if is_flat else [_pairs(line) for line in wall_lines(arrangement, window)],
        "shifts": _shifts(poses),
        "clip": [[1, 0, -low[0]], [-1, 0, high[0]], [0, 1, -low[1]], [0, -1, high[1]]],
        "radius": (0.5 if is_flat else 0.7) * unit,
        "box": {"low": low.tolist(), "high": high.tolist()},
        "from": [0, 0, 1] if is_flat else [0.45, -0.8, 0.35],
        "up": [0, 1, 0] if is_flat else [0, 0, 1],
        "mark": SPOT * unit,
        "labels": [],
        "words": [[]],
        "word": packed(np.zeros(len(poses), "<u4")),
        "energies": [],
        "contacts": packed_contacts(names, _in_space(points.reshape(-1, arrangement.dimension))),
    }


def _in_space(points: Array) -> Array:
    """Return points with three coordinates."""
    missing = 3 - points.shape[-1]
    return np.concatenate([points, np.zeros((*points.shape[:-1], missing))], axis=-1)


def _shifts(poses: Poses) -> list[list[float]]:
    """Return the displacements of images that are drawn, in the plane only."""
    lattice = poses.arrangement.lattice
    if len(lattice.lengths) == 3:
        return [[0.0, 0.0, 0.0]]
    sides = [(-1, 0, 1) if axis in lattice.axes else (0,) for axis in range(2)]
    return [[*lattice.shift(some).tolist(), 0.0] for some in product(*sides)]


def _kinds(poses: Poses, unit: float) -> list[dict[str, Any]]:
    """Return what each kind of body looks like, in layers of one colour."""
    tints, turning = colours_of(poses), turns(poses)
    copies = len(_shifts(poses))
    found = []
    for kind, body in enumerate(poses.arrangement.named.values()):
        own = np.flatnonzero(poses.kinds == kind)
        first = poses.names[own[0]]
        layers = _layers(body, tints[first], unit, marked=first in turning)
        most = len(own) * copies
        found.append({"count": len(own), "most": most, "size": body.size, "layers": layers})
    return found


def _layers(body: Body, colour: str, unit: float, *, marked: bool) -> list[dict[str, Any]]:
    parts = [*body.parts.values()]
    if body.dimension == 3:
        made = [_layer(joined([surface(part) for part in parts]), colour)]
        if marked:
            band = _band(parts[0].points[0], parts[0].radius)
            red, green, blue = (DARK * part for part in to_rgb(colour))
            made.append(_layer(band, to_hex((red, green, blue))))
        return made
    # Outlines are wider shapes below all bodies, and radii lie above them.
    rims = [_polygon(outline(part, RIM * unit), -LIFT * unit) for part in parts]
    made = [_layer(joined(rims), OUTLINE), _layer(joined([flat(part) for part in parts]), colour)]
    if marked:
        part, half = parts[0], RIM * unit
        along, up = np.array([part.radius, 0.0]), np.array([0.0, half])
        strip = part.points[0] + np.array([-up, along - up, along + up, up])
        made.append(_layer(_polygon(strip, LIFT * unit), OUTLINE))
    return made


def _polygon(rim: Array, height: float) -> Triangles:
    """Return the triangles of a convex polygon at a height."""
    k = np.arange(1, len(rim) - 1)
    vertices = np.column_stack([rim, np.full(len(rim), height)])
    return vertices, np.column_stack([0 * k, k, k + 1]), np.tile([0.0, 0.0, 1.0], (len(rim), 1))


def _band(centre: Array, radius: float) -> Triangles:
    """Return a band around a ball, across its third axis and a little outside of it."""
    angle = np.linspace(0, 2 * np.pi, AROUND, endpoint=False)
    ring = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(AROUND)])
    normals = np.concatenate([ring + np.array([0, 0, z]) for z in (-BAND, BAND)])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    k = np.arange(AROUND)
    on = (k + 1) % AROUND
    faces = np.concatenate([[k, on, k + AROUND], [on, on + AROUND, k + AROUND]], axis=1).T
    return centre + 1.004 * radius * normals, faces, normals


def _layer(triangles: Triangles, colour: str) -> dict[str, Any]:
    vertices, faces, normals = triangles
    return {
        # One of the style sheet, which has a light and a dark one, or one of its own.
        "colour": colour if colour.startswith("--") else to_hex(colour),
        "vertices": packed(np.asarray(vertices, "<f4")),
        "faces": packed(np.asarray(faces, "<u4")),
        "normals": packed(np.asarray(normals, "<f4")),
    }


def _still(poses: Poses, window: Array, unit: float) -> list[dict[str, Any]]:
    """Return fixed bodies with their images, and in the plane the outside of walls."""
    arrangement = poses.arrangement
    found = []
    if arrangement.dimension == 2:
        areas = [_outside(wall, window, -4 * LIFT * unit) for wall in arrangement.walls.values()]
        found += [{"layers": [_layer(area, "--line")]} for area in areas]
    for body in arrangement.fixed.values():
        copies = arrangement.lattice.copies(body, *window) if arrangement.dimension == 2 else [body]
        found += [{"layers": _layers(copy, FIXED, unit, marked=False)} for copy in copies]
    return found


def _outside(wall: Wall, window: Array, height: float) -> Triangles:
    """Return triangles of the plane outside of a wall, as far as it is seen."""
    middle, size = window.mean(axis=0), 2 * float(np.ptp(window[:, 0]))
    if isinstance(wall, HalfSpace):
        along = np.array([-wall.normal[1], wall.normal[0]])
        foot = middle - ((middle - wall.point) @ wall.normal) * wall.normal
        ends = np.array([foot - size * along, foot + size * along])
        return _polygon(np.concatenate([ends, ends[::-1] - size * wall.normal])[::-1], height)
    inner = circle_of(wall)
    outer = wall.point + (inner - wall.point) * (1 + 2 * size / wall.radius)
    n = len(inner)
    k, on = np.arange(n), (np.arange(n) + 1) % n
    faces = np.concatenate([[k, k + n, on], [on, k + n, on + n]], axis=1).T
    vertices = np.column_stack([np.concatenate([inner, outer]), np.full(2 * n, height)])
    return vertices, faces, np.tile([0.0, 0.0, 1.0], (2 * n, 1))


def _pairs(line: Array) -> str:
    """Return a polyline as the ends of its segments."""
    return packed(np.asarray(np.stack([line[:-1], line[1:]], axis=1), "<f4"))


# ------------------------------------------------------------------------------- pages of skeletons

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
