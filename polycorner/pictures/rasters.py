"""Pictures of bodies in space as pixels, by a depth buffer and in parallel projection.

Parts are drawn exactly, without triangles: a ball, a tube between two balls, and the planes of a
hull meet a ray of sight in closed form.
"""

import math
from collections.abc import Iterable

import numpy as np
from matplotlib.colors import to_rgb
from numpy.typing import NDArray

from polycorner.bodies.shapes import Part
from polycorner.pictures.films import Picture
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT

FINE = 2  # pixels computed for each one that is shown, along each side
ELEVATION, AZIMUTH = math.radians(20), math.radians(-60)  # of the eye
LIGHT = np.array([-0.45, 0.7, 0.9]) / math.hypot(0.45, 0.7, 0.9)  # right, up, towards the eye
BAND = 0.06  # half the width of the band around a ball that turns, in radii
EDGE = 0.4  # brightness of the edges of sharp parts
DARK = 0.45  # brightness out of the light, which is that of a band


class Raster:
    """A picture in the making: colours, and how near to the eye they are.

    Parameters
    ----------
    size : int
        Pixels of each side.
    window : (2, 3) array
        Two opposite corners of the cube that is seen.
    """

    def __init__(self, size: int, window: Array) -> None:
        self.size = size
        e, a = ELEVATION, AZIMUTH
        eye = np.array([math.cos(e) * math.cos(a), math.cos(e) * math.sin(a), math.sin(e)])
        right = np.array([-math.sin(a), math.cos(a), 0.0])
        self.frame = np.stack([right, np.cross(eye, right), eye], axis=1)
        self.middle = window.mean(axis=0) @ self.frame
        self.pixel = 1.25 * float(np.ptp(window[:, 0])) / (FINE * size)
        side = (np.arange(FINE * size) + 0.5 - FINE * size / 2) * self.pixel
        self.x, self.y = self.middle[0] + side, self.middle[1] + side
        self.depth = np.full((len(side), len(side)), -np.inf)
        self.colour = np.ones((len(side), len(side), 3))

    def picture(self) -> Picture:
        """Return the picture ``(size, size, 3)``."""
        blocks = self.colour[::-1].reshape(self.size, FINE, self.size, FINE, 3)
        return np.asarray(np.clip(blocks.mean(axis=(1, 3)) * 255, 0, 255).astype(np.uint8))

    def part(
        self, part: Part, origin: Array, matrix: Array, colour: str, *, band: bool = False
    ) -> None:
        """Draw a part of a body in its place, with a band around a ball that turns."""
        turned = self.frame.T @ matrix
        points, tint = origin @ self.frame + part.points @ turned.T, np.array(to_rgb(colour))
        if len(points) == 1:
            self.ball(points[0], part.radius, tint, turned[:, 2] if band else None)
            return
        facets, edges = part.facets, [(0, 1)]
        if facets is not None:
            edges = [(i, j) for i, j, _, _ in facets.edges]
            normals = facets.normals @ turned.T
            for face, normal in zip(facets.faces, normals, strict=True):
                if normal[2] > 0:
                    self._face(points[list(face)], normal, part.radius, tint)
        if part.radius == 0:
            for i, j in edges:  # which faces of one brightness do not show
                self._line(points[[i, j]] + [0.0, 0.0, 2 * self.pixel], EDGE * tint)
        else:
            for point in points:
                self.ball(point, part.radius, tint)
            for i, j in edges:
                self._tube(points[i], points[j], part.radius, tint)

    def mark(self, points: Array, radius: float, colour: str) -> None:
        """Draw spots over everything else."""
        for point in points @ self.frame:
            self.ball(np.append(point[:2], 1e9), radius, np.array(to_rgb(colour)))

    def lines(self, lines: Iterable[Array], colour: str) -> None:
        """Draw polylines, where nothing hides them."""
        for line in lines:
            self._line(line @ self.frame, np.array(to_rgb(colour)))

    # ------------------------------------------------------------------------------ the pieces

    def _line(self, ends: Array, tint: Array) -> None:
        """Draw a polyline in the axes of sight, where nothing hides it."""
        steps = np.linalg.norm(np.diff(ends[:, :2], axis=0), axis=1) / (0.7 * self.pixel)
        at = np.concatenate([[0.0], np.cumsum(np.maximum(steps, 1))])
        spread = np.linspace(0, at[-1], math.ceil(at[-1]) + 1)
        dots = np.stack([np.interp(spread, at, column) for column in ends.T], axis=1)
        i, j = (self._at(k, dots[:, k]) for k in (1, 0))
        seen = (i >= 0) & (i < len(self.y)) & (j >= 0) & (j < len(self.x))
        i, j, z = i[seen], j[seen], dots[seen, 2]
        nearer = z > self.depth[i, j]
        self.colour[i[nearer], j[nearer]] = tint

    def ball(self, centre: Array, radius: float, tint: Array, axis: Array | None = None) -> None:
        """Draw a ball at a place in the axes of sight."""
        rows, columns = self._box(centre[None, :2], radius)
        x, y = self.x[columns] - centre[0], self.y[rows, None] - centre[1]
        height = np.sqrt(np.maximum(radius**2 - x**2 - y**2, 0.0))
        light = (x * LIGHT[0] + y * LIGHT[1] + height * LIGHT[2]) / radius
        if axis is not None:
            across = (x * axis[0] + y * axis[1] + height * axis[2]) / radius
            light = np.where(abs(across) < BAND, -1.0, light)
        self._paint(rows, columns, height > 0, centre[2] + height, light, tint)

    def _tube(self, one: Array, two: Array, radius: float, tint: Array) -> None:
        along = two - one
        length = float(np.linalg.norm(along))
        u = along / length
        slant = 1 - u[2] ** 2
        if slant < DEFAULT.alike:
            return  # seen along, behind one of its balls
        rows, columns = self._box(np.array([one[:2], two[:2]]), radius)
        x, y = np.broadcast_arrays(self.x[columns], self.y[rows, None])
        w = np.stack([x - one[0], y - one[1], np.full(x.shape, -one[2])], axis=-1)
        away = w - (w @ u)[..., None] * u
        sight = np.array([0.0, 0.0, 1.0]) - u[2] * u
        b = away @ sight
        root = b**2 - slant * ((away**2).sum(axis=-1) - radius**2)
        z = (np.sqrt(np.maximum(root, 0.0)) - b) / slant
        share = w @ u + z * u[2]
        light = (away @ LIGHT + z * (sight @ LIGHT)) / radius
        self._paint(rows, columns, (root > 0) & (share >= 0) & (share <= length), z, light, tint)

    def _face(self, corners: Array, normal: Array, radius: float, tint: Array) -> None:
        """Draw a face that looks to the eye, moved outwards by a radius."""
        moved = corners + radius * normal
        rows, columns = self._box(moved[:, :2], 0.0)
        x, y = np.broadcast_arrays(self.x[columns], self.y[rows, None])
        inside = np.ones(x.shape, dtype=bool)
        for a, b in zip(moved, np.roll(moved, -1, axis=0), strict=True):
            inside &= (b[0] - a[0]) * (y - a[1]) >= (b[1] - a[1]) * (x - a[0])
        z = (
            moved[0, 2]
            - (normal[0] * (x - moved[0, 0]) + normal[1] * (y - moved[0, 1])) / normal[2]
        )
        self._paint(rows, columns, inside, z, np.full(x.shape, normal @ LIGHT), tint)

    def _at(self, axis: int, places: Array) -> NDArray[np.int64]:
        start = (self.x, self.y)[axis][0]
        return np.asarray(np.round((places - start) / self.pixel), dtype=np.int64)

    def _box(self, points: Array, radius: float) -> tuple[slice, slice]:
        """Return the rows and columns that points with a radius reach into."""
        low = [self._at(k, points[:, k].min() - radius) - 1 for k in (1, 0)]
        high = [self._at(k, points[:, k].max() + radius) + 2 for k in (1, 0)]
        rows, columns = (
            slice(max(0, int(a)), max(0, int(b))) for a, b in zip(low, high, strict=True)
        )
        return rows, columns

    def _paint(
        self, rows: slice, columns: slice, seen: NDArray[np.bool_], z: Array, light: Array,
        tint: Array,
    ) -> None:  # fmt: skip
        """Colour the pixels that are seen and nearer; ``light`` is the cosine to the lamp."""
        depth = self.depth[rows, columns]
        nearer = seen & (z > depth)
        lit = DARK + (1 - DARK) * np.clip(light[nearer], 0, 1)
        depth[nearer] = z[nearer]
        self.colour[rows, columns][nearer] = lit[:, None] * tint
