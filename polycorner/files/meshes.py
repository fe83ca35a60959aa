"""Bodies from meshes of triangles: STL, OBJ, PLY, GLB, GLTF and Collada files.

Meshes are read by trimesh.  What is not convex is cut into convex parts by CoACD [CoACD], which on
brackets, rings and cups needed fewer parts than V-HACD for the same volume, in less time, and draws
its numbers from a seed.
"""

import io
import json
import math
import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from polycorner import checks
from polycorner.bodies.masses import Mass, mass_of
from polycorner.bodies.shapes import Body, Part, capsule, sphere
from polycorner.checks import missing_extra, refuse
from polycorner.files.collada import plain
from polycorner.files.safe_paths import content, name_of, within
from polycorner.kinds import checked
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT
from polycorner.values import Checked

FORMATS = ("stl", "obj", "ply", "glb", "gltf", "dae")
PARTS = ("convex", "hull", "exact")
AT_ONCE = 1000  # triangles whose heights over all faces of a hull are compared at a time


@dataclass(frozen=True, eq=False)
class Solid(Checked):
    """A body as a mesh describes it, and how well its convex parts fill the mesh.

    Attributes
    ----------
    body : Body
    mass : Mass
        Of the mesh itself, filled uniformly.
    volume : float
        Of the mesh.
    difference : float
        The volume of all parts minus that of the mesh, relative to the latter.
    """

    body: Body
    mass: Mass
    volume: float
    difference: float

    def __repr__(self) -> str:
        """Return the mass and the parts."""
        parts = f"{len(self.body.parts)} convex parts of {len(self.body.markers)} points"
        return f"Solid(mass {self.mass.mass:g}, {parts}, difference {self.difference:.2g})"


@dataclass(frozen=True)
class MeshOptions(Checked):
    """What becomes of a mesh that is large or not convex.

    Attributes
    ----------
    vertices : int
        The most vertices of a part.
    simplify : bool
        Whether a part with more vertices is replaced by the hull of so many of them, which lies
        inside of it; by default it is refused.
    concavity : float
        How concave a part may be before it is cut, between 0.01 and 1 [CoACD].
    megabytes : float
        The largest size of a file, in MiB; of a Collada file also that of all instances in it.
    """

    vertices: int = 64
    simplify: bool = False
    concavity: float = 0.05
    megabytes: float = 100.0

    def __post_init__(self) -> None:
        super().__post_init__()
        checks.whole("vertices", self.vertices, least=4)
        checks.real("concavity", self.concavity, least=0.01, most=1)
        checks.real("megabytes", self.megabytes, above=0)


@checked
def read_mesh(
    path: str | os.PathLike[str],
    *,
    scale: float = 1.0,
    density: float = 1.0,
    parts: Literal["convex", "hull", "exact"] = "convex",
    centred: bool = False,
    options: MeshOptions | None = None,
) -> Solid:
    """Read a body from a mesh of triangles.

    Vertices that are none of the convex hull of a part, up to ``1e-6`` of its size, are left out,
    and triangles of one plane are one face.

    Parameters
    ----------
    path : path
        An STL, OBJ, PLY, GLB, GLTF or Collada file (DAE, extra ``meshes``), which its suffix tells.
        Of a GLTF file buffers in its folder are read as well; materials and textures are not.  Of a
        Collada file nothing else is read; its axes are those of the body, whatever ``up_axis``.
    scale : float, optional
        Length of the file's unit, in the unit of the arrangement: 0.001 for millimetres in metres.
        For a Collada file, which may state its unit, that of a metre.
    density : float, optional
        Mass per volume, in the units of the arrangement.
    parts : {"convex", "hull", "exact"}, optional
        What becomes of a mesh whose connected components are not all convex: it is cut into convex
        parts (default; needs the extra ``meshes``), is replaced by its convex hull, or is refused.
    centred : bool, optional
        Whether the centre of mass becomes the origin; by default this is that of the file.
    options : MeshOptions, optional
        How many vertices a part may have, and more.

    Returns
    -------
    Solid
        ``body`` and ``mass`` for an :class:`~polycorner.bodies.Arrangement` and its ``system``.
        Components that overlap count twice in the mass.

    Raises
    ------
    ValueError
        For what is not understood, and meshes that are not closed: these have no volume.  With
        ``parts="hull"`` an open mesh has the mass of its hull.
    ImportError
        Naming the extra that cuts meshes and reads Collada.
    OSError
        If the file cannot be read.

    Examples
    --------
    >>> import tempfile, trimesh
    >>> path = Path(tempfile.mkdtemp()) / "brick.stl"
    >>> _ = trimesh.creation.box([2, 4, 6]).subdivide().export(path)
    >>> brick = read_mesh(path, scale=0.5)
    >>> len(brick.body.markers), brick.mass.mass, brick.mass.inertia.diagonal().round(9).tolist()
    (8, 6.0, [6.5, 5.0, 2.5])
    """
    checks.choice("parts", parts, PARTS)
    options = MeshOptions() if options is None else options
    scale, density = (
        checks.real(name, x, above=0) for name, x in (("scale", scale), ("density", density))
    )
    about = f"path: {name_of(path)}"
    mesh = load_mesh(about, path, scale, options.megabytes)
    is_closed = mesh.is_watertight and mesh.is_winding_consistent
    body = convex_body(about, mesh, parts, options)
    volumes = [float(_hull(about, part.points).volume) for part in body.parts.values()]
    filled = math.fsum(volumes)
    volume = float(mesh.volume) if is_closed else filled
    with checks.about(about):
        mass = mass_of(body, density)
        if is_closed:
            mass = _filled(mesh, density)
    if centred:
        body = body.moved(-mass.centre)
        mass = Mass(mass.mass, np.zeros(3), mass.inertia)
    return Solid(body, mass, volume, filled / volume - 1)


def convex_body(about: str, mesh: Any, parts: str, options: MeshOptions) -> Body:
    """Return the convex parts of a mesh; see :func:`read_mesh`."""
    is_closed = mesh.is_watertight and mesh.is_winding_consistent
    if is_closed and mesh.volume < 0:
        mesh.invert()  # all faces from inside
    if not (is_closed or parts == "hull"):
        _refuse_open(about, mesh)
    pieces = _pieces(about, mesh, parts, options.concavity)
    hulls = [_at_most(about, corners(about, points), options) for points in pieces]
    names = [str(k) for k in range(1, len(hulls) + 1)] if len(hulls) > 1 else [""]
    return Body({name: Part(hull, 0.0) for name, hull in zip(names, hulls, strict=True)})


def _filled(mesh: Any, density: float) -> Mass:
    """Return the mass of a closed mesh; trimesh takes small volumes for none, so that of size 1."""
    size = float(np.ptp(mesh.vertices, axis=0).max())
    unit = mesh.copy()
    unit.vertices = mesh.vertices / size
    mass = density * size**3
    return Mass(mass * unit.volume, size * unit.center_mass, mass * size**2 * unit.moment_inertia)


def load_mesh(
    about: str, path: str | os.PathLike[str], scale: float | Array, megabytes: float
) -> Any:
    """Return the triangles of a file as a ``trimesh.Trimesh`` with finite vertices."""
    import trimesh

    kind = Path(path).suffix.lower().removeprefix(".")
    if kind not in FORMATS:
        expected = f"a file name that ends in {checks.listed(f'.{f}' for f in FORMATS)}"
        refuse("path", expected, os.fspath(path))
    data = content(about, path, megabytes)
    beside = _buffers(about, data, Path(path).parent, megabytes) if kind == "gltf" else {}
    options: Any = {"ignore_broken": False} if kind == "dae" else {"skip_materials": True}
    if kind == "dae":
        data, unit = plain(about, data, megabytes)
        scale = unit * scale
    try:
        scene = trimesh.load_scene(io.BytesIO(data), file_type=kind, resolver=beside, **options)
        found = scene.to_mesh()
        points, faces = np.array(found.vertices, np.float64), np.array(found.faces, np.int64)
    except Exception as error:
        reason = checks.shortened(str(error) or type(error).__name__, checks.LONGEST_REASON)
        msg = f"{about}: expected a mesh in the format {kind.upper()}; got {reason}"
        raise ValueError(msg) from error
    if points.shape[1:] != (3,) or faces.shape[1:] != (3,) or not len(faces):
        refuse(about, "triangles", "none")
    if faces.min() < 0 or faces.max() >= len(points):
        expected = f"triangles of the {len(points)} vertices"
        refuse(about, expected, f"vertices {faces.min()} to {faces.max()}")
    if len(strange := np.flatnonzero(~np.isfinite(points).all(axis=1))):
        refuse(f"{about}: vertex {strange[0]}", "finite numbers", points[strange[0]])
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        points = scale * points
        size = float(np.ptp(points, axis=0).max())
        if not 0 < np.float64(size) ** 5 < math.inf:  # as inertias grow
            refuse(about, "a body of finite size, whose inertia is in the range of doubles", size)
    # Of size 1 meanwhile, as trimesh has lengths and areas that count as none.
    mesh = trimesh.Trimesh(points / size, faces, process=False)  # without colours and textures
    mesh.merge_vertices(digits_vertex=-math.floor(math.log10(DEFAULT.settled)))
    kept = mesh.nondegenerate_faces(height=DEFAULT.settled) & mesh.unique_faces()
    mesh.update_faces(kept)
    mesh.vertices = size * mesh.vertices
    if not len(mesh.faces) or not mesh.extents.all():
        refuse(about, "a body that is not flat", f"{len(mesh.faces)} triangles in a plane")
    return mesh


def _buffers(about: str, data: bytes, folder: Path, megabytes: float) -> dict[str, bytes]:
    """Return the buffers of a GLTF file by their names, those in files of its folder."""
    try:
        buffers = json.loads(data).get("buffers", [])
        names = [b.get("uri", "") for b in buffers]
    except (ValueError, AttributeError, TypeError, RecursionError):
        refuse(about, "a GLTF file, which is JSON with a list of buffers", data[:60])
    found = {}
    for k, name in enumerate(names):
        place = f"{about}: buffer {k}"
        checks.instance(place, name, str)
        if not name.startswith("data:"):
            file = within(place, folder, name)
            if not file.is_file():
                refuse(place, "a file that exists", name)
            found[name] = content(place, file, megabytes)
    return found


def _refuse_open(about: str, mesh: Any) -> None:
    """Raise for a mesh without an inside."""
    sides = np.unique(mesh.edges_sorted, axis=0, return_counts=True)[1]
    wrong = int((sides != 2).sum())
    got = f"{wrong} edges of {len(sides)} with another number" if wrong else "triangles that do not"
    expected = (
        "a closed mesh, with two triangles at each edge that agree about what is outside, since an "
        "open one has no volume (parts='hull' takes the convex hull)"
    )
    msg = f"{about}: expected {expected}; got {got}"
    raise ValueError(msg)


def _pieces(about: str, mesh: Any, parts: str, concavity: float) -> Iterable[Array]:
    """Return the points of convex parts."""
    if parts == "hull":
        return [mesh.vertices]
    components = mesh.split(only_watertight=False)
    if any(c.volume <= 0 for c in components):
        components = [mesh]  # with cavities, whose walls are components
    convex = [_is_convex(about, c) for c in components]
    if parts == "exact" and not all(convex):
        expected = "convex components; parts='convex' cuts others, parts='hull' fills them"
        refuse(about, expected, f"{convex.count(False)} of {len(convex)} that are not")
    return [
        points
        for c, whole in zip(components, convex, strict=True)
        for points in ([c.vertices] if whole else _cut(c, concavity))
    ]


def _is_convex(about: str, mesh: Any) -> bool:
    """Whether a closed mesh is the surface of its hull.

    A triangle whose corners and centre lie on that surface lies on it as a whole, and a closed
    surface which does so has a multiple of its volume.
    """
    hull = _hull(about, mesh.vertices)
    if not math.isclose(mesh.volume, hull.volume, rel_tol=DEFAULT.beside):
        return False
    deepest, points = -DEFAULT.same * mesh.scale, [*mesh.vertices, *mesh.triangles_center]
    normals, offsets = hull.equations[:, :3].T, hull.equations[:, 3]
    return all(
        bool(((np.array(points[k : k + AT_ONCE]) @ normals + offsets).max(axis=1) > deepest).all())
        for k in range(0, len(points), AT_ONCE)
    )


def _cut(mesh: Any, concavity: float) -> list[Array]:
    """Return the points of convex parts that nearly fill a mesh."""
    try:
        import coacd
    except ImportError:
        missing = missing_extra("coacd", "meshes")
        raise missing from None
    coacd.set_log_level("error")
    given = coacd.Mesh(mesh.vertices, mesh.faces)
    return [points for points, _ in coacd.run_coacd(given, threshold=concavity, seed=0)]


def corners(about: str, points: Array) -> Array:
    """Return the vertices of the hull of points; those that stand out by almost nothing are none.

    Only those are looked at whose faces have normals close to one plane.
    """
    hull = _hull(about, points)
    height = DEFAULT.same * float(np.ptp(points, axis=0).max())
    vertices: Any = hull.vertices.tolist()
    normals: dict[int, list[Array]] = {i: [] for i in vertices}
    for triangle, equation in zip(hull.simplices.tolist(), hull.equations, strict=True):
        for i in triangle:
            normals[i].append(equation[:3])
    kept = [*normals]
    for i, around in normals.items():
        if np.linalg.svd(np.array(around), compute_uv=False)[-1] > math.sqrt(DEFAULT.same):
            continue
        others = [j for j in kept if j != i]
        try:
            rest = ConvexHull(points[others]).equations
        except QhullError:
            continue  # the others lie in a plane
        if (rest[:, :3] @ points[i] + rest[:, 3]).max() <= height:
            kept = others
    return _flattened(about, np.array(points[kept], dtype=np.float64), height)


def _hull(about: str, points: Array) -> ConvexHull:
    try:
        return ConvexHull(points)
    except QhullError:
        refuse(about, "parts that have an interior", f"one of the sizes {np.ptp(points, axis=0)}")


def _flattened(about: str, points: Array, height: float) -> Array:
    """Return vertices shifted into the planes of their faces, where single precision put them off.

    Where more than three faces meet that is not possible for all of them.
    """
    hull = _hull(about, points)
    heights = hull.equations[:, :3] @ points.T + hull.equations[:, 3:]
    planes: list[list[tuple[Array, float]]] = [[] for _ in points]
    for face in dict.fromkeys(tuple(np.flatnonzero(row >= -height).tolist()) for row in heights):
        middle = points[list(face)].mean(axis=0)
        normal = np.linalg.svd(points[list(face)] - middle)[2][-1]
        for i in face:
            planes[i].append((normal, float(normal @ (middle - points[i]))))
    shifts = np.zeros_like(points)
    for i, some in enumerate(planes):
        directions, ways = zip(*some, strict=True)
        shifts[i] = np.linalg.lstsq(np.array(directions), np.array(ways))[0]
    shifts[np.linalg.norm(shifts, axis=1) > height] = 0.0  # of planes that hardly cross
    return np.asarray(points + shifts)


def _at_most(about: str, points: Array, options: MeshOptions) -> Array:
    """Return at most so many vertices of a hull; each next one is the farthest outside."""
    most = options.vertices
    if len(points) <= most:
        return points
    if not options.simplify:
        expected = (
            f"at most {most} vertices of a convex part, or MeshOptions(vertices=..., "
            "simplify=True), which takes the hull of so many"
        )
        refuse(about, expected, len(points))
    away = points - points.mean(axis=0)
    chosen: list[int] = []
    for _ in range(4):  # a tetrahedron: each next corner is the farthest from those before
        chosen.append(int(np.linalg.norm(away, axis=1).argmax()))
        spanned = np.linalg.svd((points[chosen] - points[chosen[0]])[1:])[2][: len(chosen) - 1]
        away = points - points[chosen[0]]
        away = away - away @ spanned.T @ spanned
    while len(chosen) < most:
        planes = ConvexHull(points[chosen]).equations
        outside = (points @ planes[:, :3].T + planes[:, 3]).max(axis=1)
        chosen.append(int(outside.argmax()))
    return points[chosen]


def capsule_around(given: Array, about: str = "points") -> Body:
    """Return the least of the capsules along the principal axes of points.

    Around an axis the radius is that of the least circle around the points seen along it; each end
    is as far inside as the half ball allows.
    """
    hull = given[_hull(about, given).vertices]
    middle = hull.mean(axis=0)
    axes = np.linalg.svd(hull - middle, full_matrices=False)[2]
    best: tuple[float, Body] | None = None
    for k, axis in enumerate(axes):
        others = np.delete(axes, k, axis=0)
        flat = (hull - middle) @ others.T
        centre, radius = _least_circle(flat)
        away = np.linalg.norm(flat - centre, axis=1)
        reach, along = np.sqrt(np.maximum(radius**2 - away**2, 0)), (hull - middle) @ axis
        low, high = float((along + reach).min()), float((along - reach).max())
        origin = middle + centre @ others
        if low >= high:
            volume, body = 4 * radius**3 / 3, sphere(radius, at=origin + axis * (low + high) / 2)
        else:
            volume = radius**2 * (high - low) + 4 * radius**3 / 3
            body = capsule(origin + low * axis, origin + high * axis, radius)
        if best is None or volume < best[0]:
            best = volume, body
    assert best is not None
    return best[1]


def _least_circle(points: Array) -> tuple[Array, float]:
    """Return centre and radius of the least circle around points: through two or three of them."""
    from trimesh import nsphere

    least: Any = nsphere.minimum_nsphere
    centre = np.asarray(least(points)[0])
    return centre, float(np.linalg.norm(points - centre, axis=1).max())
