"""Scenes for GLB files: dumbbells in the drum, and the forbidden solid of a pair.

Coordinates are the library's, in mm: ``y`` is the drum's axis, ``z`` points up, the axis of the
drum is ``x = z = 0``; in the plane centres have ``z = 0``.  Axes of 10 mm are part of a scene.
"""

import math
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from polycorner.dumbbells.drum import DumbbellDrum
from polycorner.dumbbells.pair import DumbbellPair
from polycorner.dumbbells.pictures.bodies import (
    AXIS,
    WallPatch,
    contact_point,
    dumbbell_centres,
    relative_stretch,
    tube_surface,
    wall_around,
)
from polycorner.dumbbells.pictures.placements import forbidden_solid
from polycorner.dumbbells.pictures.solid import relative_corners, relative_curves
from polycorner.dumbbells.pictures.symbols import CONTACT, HANDS, KIND_WORDS, KINDS
from polycorner.dumbbells.statics.skeleton import PairAtlas
from polycorner.polyhedra import stratum_at
from polycorner.toolkit import (
    BODIES,
    Array,
    checked,
    finite,
    painted,
    reals,
    refuse,
    write_atomically,
)

if TYPE_CHECKING:
    import trimesh

WALL, SOLID, AXES, OTHERS = "#DDD8CC", "#D2CDC0", "#606060", "#8C8C8C"
TOUCHING = 1e-6  # scaled distance within which a contact counts as closed
ROUND = 3  # subdivisions of a ball: 1280 triangles


def library() -> Any:
    """Return trimesh, imported on demand."""
    import trimesh

    return trimesh


@checked
def pair_scene(pair: DumbbellPair, q: ArrayLike, *, tolerance: float = TOUCHING) -> "trimesh.Scene":
    """Return two dumbbells in the drum or on the plane, with their contacts, as a scene in mm.

    Names of nodes: balls ``A1, A2, B1, B2``, rods ``a, b``, contacts
    ``contact A2B1`` and so on, ``wall``, and the axes ``x, y, z``.

    Parameters
    ----------
    pair : DumbbellPair
    q : (6,) array
        The configuration; it may overlap.
    tolerance : float, optional
        Scaled distance within which a contact counts as closed.

    Raises
    ------
    TypeError, ValueError
        For a configuration of another shape or not of finite numbers.

    Examples
    --------
    >>> from polycorner.dumbbells import DumbbellPair
    >>> pair = DumbbellPair(16, 3, 1.5, 125)
    >>> scene = pair_scene(pair, pair.nested("R"))
    >>> [name for name in scene.graph.nodes_geometry if name[0] in "AB"]
    ['A1', 'A2', 'B1', 'B2']
    """
    point = pair.manifold.point(finite(reals("q", q), "q"))
    centres = pair.ball_centres(point)
    scene: trimesh.Scene = library().Scene()
    _add_dumbbells(scene, pair, centres.reshape(2, 2, 3), [("A1", "A2", "a"), ("B1", "B2", "b")])
    for name in stratum_at(pair.polyhedron, point, tolerance=tolerance).active:
        _add_mark(scene, f"contact {name}", contact_point(pair, centres, name), pair.ball_radius)
    _add_surroundings(scene, wall_around(pair, centres))
    return scene


@checked
def drum_scene(drum: DumbbellDrum, q: ArrayLike) -> "trimesh.Scene":
    """Return the dumbbells of a drum as a scene in mm.

    Nodes are ``1.1, 1.2`` (balls) and ``1`` (rod) of the first dumbbell, and so on; ``wall`` is
    the part of the drum they lie on.  A dumbbell whose coordinates are NaN is left out, such as
    one that has left the drum.

    Parameters
    ----------
    drum : DumbbellDrum
    q : (N, k) array
        ``phi, eta, theta`` (and ``psi``) of each dumbbell, as a row of ``trajectory.q``.
    """
    places = np.atleast_2d(reals("q", q))
    if places.ndim != 2 or places.shape[0] != drum.count or places.shape[1] not in (3, 4):
        refuse("q", f"shape ({drum.count}, 3) or ({drum.count}, 4)", places.shape)
    here = np.flatnonzero(np.isfinite(places[:, :3]).all(axis=1))
    if not len(here):
        refuse("q", "at least one dumbbell with finite coordinates", places)
    centres = dumbbell_centres(drum.pair, places[here])
    names = [(f"{k + 1}.1", f"{k + 1}.2", f"{k + 1}") for k in here.tolist()]
    scene: trimesh.Scene = library().Scene()
    _add_dumbbells(scene, drum.pair, centres, names)
    _add_surroundings(scene, wall_around(drum.pair, centres))
    return scene


@checked
def atlas_scene(atlas: PairAtlas, *, resolution: int = 64) -> "trimesh.Scene":
    """Return the forbidden solid of a pair with the edges and corners of its atlas.

    Coordinates are the relative placement: ``x`` and ``y`` in mm, and ``delta``, a radian drawn as
    long as ``l/2`` mm.  Edges are tubes coloured by their contacts, corners spheres coloured by
    chirality (green right-handed, purple left-handed, grey neither); in the plane over half a turn
    of ``delta``, in the drum over a whole turn, at the atlas's mean heading.

    Parameters
    ----------
    atlas : PairAtlas
        As of :func:`polycorner.dumbbells.statics.skeleton`.
    resolution : int, optional
        Cells of the solid along each axis.
    """
    pair, heading = atlas.pair, atlas.heading
    period = math.pi if heading is None else math.tau
    solid = forbidden_solid(pair, resolution, period=period, mean_heading=heading)
    stretch = relative_stretch(pair)
    scene: trimesh.Scene = library().Scene()
    scene.add_geometry(solid_mesh(solid.mesh, stretch), node_name="solid", geom_name="solid")
    thick = 0.03 * (pair.length + 2 * pair.ball_radius)
    colours = {words: KINDS[kind] for kind, words in KIND_WORDS.items()}
    for k, (name, curve) in enumerate(relative_curves(atlas, period)):
        drawn = tube(curve * stretch, thick / 2, colours.get(name, OTHERS))
        scene.add_geometry(drawn, node_name=f"edge {k + 1}: {name}", geom_name=f"edge {k + 1}")
    points, letters = relative_corners(atlas, period, hands=True)
    for k, (point, letter) in enumerate(zip(points, letters, strict=True)):
        hand = next((h for h in "RL" if letter.rstrip("$").endswith(f"_{h}")), "N")
        _add_corner(scene, k, point * stretch, hand, 1.5 * thick)
    _add_axes(scene, np.array(scene.bounds[0]))
    return scene


def solid_bytes(
    pair: DumbbellPair, *, mean_heading: float | None = None, resolution: int = 32
) -> bytes:
    """Return the forbidden solid alone as a GLB file; see :func:`atlas_scene`."""
    period = math.pi if pair.is_plane else math.tau
    heading = None if pair.is_plane else mean_heading
    solid = forbidden_solid(pair, resolution, period=period, mean_heading=heading)
    scene: trimesh.Scene = library().Scene()
    scene.add_geometry(solid_mesh(solid.mesh, relative_stretch(pair)), geom_name="solid")
    return glb(scene)


@checked
def glb(scene: "trimesh.Scene") -> bytes:
    """Return a scene as the bytes of a GLB file."""
    drawn: Any = scene
    return bytes(drawn.export(file_type="glb"))


@checked
def write_scene(scene: "trimesh.Scene", path: Path) -> Path:
    """Write a scene as ``.glb``, whole or not at all, and return the path; folders are made.

    Raises
    ------
    ValueError
        For another suffix.
    OSError
        If it cannot be written.
    """
    return write_atomically(path, glb(scene), suffix=".glb")


# ------------------------------------------------------------------------------------- materials


def solid_mesh(mesh: "trimesh.Trimesh", stretch: Array) -> "trimesh.Trimesh":
    """Return a painted, slightly translucent copy of a mesh, its coordinates multiplied.

    Parts of the mesh (``face_attributes["part"]``) get vertices of their own, so that shading is
    smooth within parts and sharp between them; merged by place, the mesh is closed.
    """
    vertices, faces = np.asarray(mesh.vertices) * stretch, np.asarray(mesh.faces)
    parts = np.asarray(mesh.face_attributes.get("part", np.zeros(len(faces))))
    keys = np.stack([faces, np.broadcast_to(parts[:, None], faces.shape)], axis=-1).reshape(-1, 2)
    kept, corners = np.unique(keys.astype(np.int64), axis=0, return_inverse=True)
    made = library().Trimesh(vertices[kept[:, 0]], corners.reshape(faces.shape), process=False)
    _ = made.vertex_normals  # cached, so that they are exported
    return painted(made, SOLID, opacity=0.8, rough=0.9)


def tube(points: ArrayLike, radius: float, colour: str) -> "trimesh.Trimesh":
    """Return a polyline ``(k, 3)`` as a closed tube of one colour."""
    return painted(library().Trimesh(*tube_surface(points, radius), process=False), colour)


# ----------------------------------------------------------------------------------------- parts


def _add_dumbbells(
    scene: "trimesh.Scene",
    pair: DumbbellPair,
    centres: Array,
    names: Iterable[tuple[str, str, str]],
) -> None:
    """Add balls and rods ``(N, 2, 3)``; equal bodies share their triangles."""
    shapes = [_shapes(pair, colour) for colour in BODIES]
    for k, (ends, words) in enumerate(zip(centres, names, strict=True)):
        ball, rod = shapes[k % 2]
        for centre, name in zip(ends, words[:2], strict=True):
            _add(scene, name, f"ball {k % 2 + 1}", ball, _moved(centre))
        _add(scene, words[2], f"rod {k % 2 + 1}", rod, _along(ends))


def _shapes(pair: DumbbellPair, colour: str) -> tuple[Any, Any]:
    """Return a ball about the origin, and a rod about the origin along ``z``."""
    made = library().creation
    ball = made.icosphere(subdivisions=ROUND, radius=pair.ball_radius)
    _ = ball.vertex_normals
    rod = made.cylinder(radius=pair.rod_radius, height=pair.length, sections=32)
    return painted(ball, colour), painted(rod, colour)


def _add(scene: Any, node: str, name: str, mesh: Any, place: Array) -> None:
    if name in scene.geometry:
        scene.graph.update(frame_to=node, matrix=place, geometry=name)
    else:
        scene.add_geometry(mesh, node_name=node, geom_name=name, transform=place)


def _moved(centre: Array) -> Array:
    place = np.eye(4)
    place[:3, 3] = centre
    return place


def _along(ends: Array) -> Array:
    """Return the rigid motion that takes the ``z`` axis to the segment between two points."""
    place = _moved(ends.mean(axis=0))
    axis = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
    side = np.cross(axis, np.eye(3)[np.argmin(abs(axis))])
    side /= np.linalg.norm(side)
    place[:3, :3] = np.stack([side, np.cross(axis, side), axis], axis=-1)
    return place


def _add_mark(scene: "trimesh.Scene", node: str, point: Array, ball_radius: float) -> None:
    mark = library().creation.icosphere(subdivisions=2, radius=0.18 * ball_radius)
    _add(scene, node, "contact", painted(mark, CONTACT), _moved(point))


def _add_corner(scene: "trimesh.Scene", k: int, point: Array, hand: str, radius: float) -> None:
    mark = library().creation.icosphere(subdivisions=2, radius=radius)
    _add(scene, f"corner {k + 1} {hand}", f"corner {hand}", painted(mark, HANDS[hand]),
         _moved(point))  # fmt: skip


def _add_surroundings(scene: "trimesh.Scene", wall: WallPatch) -> None:
    scene.add_geometry(wall_mesh(wall), node_name="wall", geom_name="wall")
    _add_axes(scene, wall.points(wall.across[0], wall.along[0]))


def _add_axes(scene: "trimesh.Scene", origin: Array) -> None:
    for name, direction in zip("xyz", np.eye(3), strict=True):
        line = tube([origin, origin + AXIS * direction], 0.025 * AXIS, AXES)
        scene.add_geometry(line, node_name=name, geom_name=f"axis {name}")


def wall_mesh(wall: WallPatch) -> "trimesh.Trimesh":
    """Return a part of the wall as an open surface, its normals towards the dumbbells."""
    u = np.linspace(*wall.across, 2 if wall.is_plane else 49)
    y = np.array(wall.along)
    vertices = wall.points(u[:, None], y).reshape(-1, 3)
    k = 2 * np.arange(len(u) - 1)[:, None]
    faces = np.concatenate([k + np.array([0, 2, 1]), k + np.array([1, 2, 3])])
    mesh = library().Trimesh(vertices, faces, process=False)
    return painted(mesh, WALL, opacity=0.6, rough=1.0)
