"""Motions of bodies in files of other programs: GSD and XYZ for OVITO, GLB for Blender."""

import importlib.util
import json
import os
import struct
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from polycorner.atomic import replace_atomically, write_atomically
from polycorner.bodies.arrangement import Arrangement
from polycorner.bodies.motions import Motion, Poses, poses_of
from polycorner.bodies.shapes import Body
from polycorner.bodies.surfaces import Triangles, flat, joined, surface
from polycorner.checks import listed, missing_extra, refuse
from polycorner.kinds import checked
from polycorner.pictures.arrangements import FIXED, colours_of, extent_of
from polycorner.pictures.solids.meshes import painted
from polycorner.spaces.manifold import Array

ROOM = 1.05  # of a box around bodies where there are no periods, against their extent
COLUMNS = "species:S:1:pos:R:3:orientation:R:4:radius:R:1"
FLOAT = 5126  # 32 bits, in glTF


@checked
def save_motion(arrangement: Arrangement, motion: Motion, path: str | os.PathLike[str]) -> Path:
    """Write where bodies are, for other programs, in the format that the suffix names.

    ======== =======================================================================================
    suffix   content
    ======== =======================================================================================
    ``.gsd`` HOOMD's format, read by OVITO, with the extra ``gsd``: positions, orientations,
             velocities, the shapes of all kinds, fixed bodies, and the number of each body as
             ``particles/body`` (-1: fixed); ``log/time`` is the time in s
    ``.xyz`` extended XYZ: kind, position, orientation ``x y z w`` and radius of each body
    ``.glb`` a scene that moves, in linear steps between the instants; one that stands still where
             there is one instant
    ======== =======================================================================================

    In all of them coordinates are those of the library; in the plane the third one is zero.
    Bodies that have left are left out, in GLB files of size zero.  Walls are in none of them.

    Parameters
    ----------
    arrangement : Arrangement
    motion : Trajectory or array
        As for :func:`film`.
    path : path
        The file appears whole or not at all; its folder is created if it does not exist.

    Raises
    ------
    TypeError, ValueError
        For a motion of another arrangement, or another suffix.
    ImportError
        For ``.gsd`` without the package gsd.
    OSError
        If the file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> from polycorner.bodies import Arrangement, disc
    >>> a = Arrangement({"A": disc(0.5), "B": disc(0.3)})
    >>> file = save_motion(a, [0, 0, 1, 0], Path(tempfile.mkdtemp()) / "pair.xyz")
    >>> print(file.read_text().splitlines()[2])
    A 0 0 0 0 0 0 1 0.5
    """
    return write_poses(poses_of(arrangement, motion), path)


def write_poses(poses: Poses, path: str | os.PathLike[str]) -> Path:
    """Write where bodies are, see :func:`save_motion`."""
    suffix = Path(path).suffix.lower()
    if suffix not in WRITERS:
        refuse("path", f"a file name that ends in {listed(sorted(WRITERS))}", os.fspath(path))
    return WRITERS[suffix](poses, Path(path))


def _in_space(points: Array) -> Array:
    return np.concatenate([points, np.zeros((*points.shape[:-1], 3 - points.shape[-1]))], axis=-1)


def _box(poses: Poses) -> Array:
    """Return the sides of a box about the origin that contains all bodies, or of the periods."""
    low, high = extent_of(poses)
    lengths = poses.arrangement.lattice.lengths
    sides = 2 * ROOM * np.maximum(abs(low), abs(high))
    found = np.where(np.isfinite(lengths), lengths, sides)
    return np.append(found, [1.0] * (3 - len(found)))


# ------------------------------------------------------------------------------------------ GSD


def _write_gsd(poses: Poses, path: Path) -> Path:
    if importlib.util.find_spec("gsd") is None:
        error = missing_extra("gsd", "gsd")
        raise error
    import gsd.hoomd

    with replace_atomically(path) as part, gsd.hoomd.open(os.fspath(part), "w") as file:
        for frame in _frames(poses, gsd.hoomd.Frame):
            file.append(frame)
    return path


def _frames(poses: Poses, new: Any) -> Iterator[Any]:
    """Yield the frames of a GSD file, made by ``gsd.hoomd.Frame``."""
    arrangement, sides = poses.arrangement, _box(poses)
    bodies = {**arrangement.named, **arrangement.fixed}
    still, d = len(arrangement.fixed), arrangement.dimension
    axes, shapes = list(arrangement.lattice.axes), [_shape(body) for body in bodies.values()]
    for k, time in enumerate(poses.times.tolist()):
        here, frame = np.flatnonzero(poses.present[k]), new()
        places = _in_space(np.concatenate([poses.origins[k, here], np.zeros((still, d))]))
        images = np.zeros(places.shape, dtype=np.int32)
        images[:, axes] = np.floor(places[:, axes] / sides[axes] + 0.5)
        turns = np.concatenate([poses.turns[k, here], np.tile([1.0, 0, 0, 0], (still, 1))])
        kinds = np.concatenate([poses.kinds[here], len(arrangement.named) + np.arange(still)])
        sizes = np.array([2 * body.size for body in bodies.values()])
        frame.configuration.step = k
        frame.configuration.dimensions = d
        frame.configuration.box = [*sides, 0, 0, 0]
        told = frame.particles
        told.N, told.types, told.typeid = len(kinds), [*bodies], kinds
        told.type_shapes = shapes
        told.position, told.image, told.orientation = places - images * sides, images, turns
        told.diameter, told.body = sizes[kinds], [*here.tolist(), *[-1] * still]
        moving = poses.velocities[k, here]
        told.velocity = _in_space(np.concatenate([moving, np.zeros((still, d))]))
        frame.log["time"] = np.array([time])
        yield frame


def _shape(body: Body) -> dict[str, Any]:
    """Return the shape of a kind as GSD files tell it."""
    parts = [*body.parts.values()]
    first = parts[0]
    if all(len(part.points) == 1 for part in parts):
        if len(parts) == 1 and not first.points.any():
            return {"type": "Sphere", "diameter": 2 * first.radius}
        centres = _in_space(np.concatenate([part.points for part in parts])).tolist()
        diameters = [2 * part.radius for part in parts]
        return {"type": "SphereUnion", "centers": centres, "diameters": diameters}
    if len(parts) == 1 and len(first.points) > 2:
        kind = "Polygon" if body.dimension == 2 else "ConvexPolyhedron"
        vertices = first.points.tolist()
        return {"type": kind, "rounding_radius": first.radius, "vertices": vertices}
    vertices, faces, _ = _triangles(body)
    return {"type": "Mesh", "vertices": vertices.tolist(), "indices": faces.tolist()}


def _triangles(body: Body) -> Triangles:
    made = flat if body.dimension == 2 else surface
    return joined([made(part) for part in body.parts.values()])


# ------------------------------------------------------------------------------------------ XYZ


def _write_xyz(poses: Poses, path: Path) -> Path:
    return write_atomically(path, "".join(_blocks(poses)))


def _blocks(poses: Poses) -> Iterator[str]:
    sides, lattice = _box(poses), poses.arrangement.lattice
    periodic = " ".join("T" if k in lattice.axes else "F" for k in range(3))
    corner = [0.0 if k in lattice.axes else -side / 2 for k, side in enumerate(sides)]
    cell, start = (_row(numbers) for numbers in (np.diag(sides).ravel(), corner))
    about = f'Lattice="{cell}" Origin="{start}" pbc="{periodic}" Properties={COLUMNS}'
    bodies = {**poses.arrangement.named, **poses.arrangement.fixed}
    for k, time in enumerate(poses.times.tolist()):
        rows = [
            ([*bodies][poses.kinds[n]], poses.origins[k, n], poses.turns[k, n, [1, 2, 3, 0]])
            for n in np.flatnonzero(poses.present[k]).tolist()
        ]
        origin = np.zeros(poses.arrangement.dimension)
        rows += [(name, origin, np.array([0, 0, 0, 1.0])) for name in poses.arrangement.fixed]
        yield f"{len(rows)}\n{about} Time={time:.10g}\n"
        for name, place, turn in rows:
            yield f"{name} {_row([*_in_space(place), *turn, bodies[name].size])}\n"


def _row(numbers: Iterable[float]) -> str:
    return " ".join(f"{x:.10g}" for x in numbers)


# ------------------------------------------------------------------------------------------ GLB


def _write_glb(poses: Poses, path: Path) -> Path:
    import trimesh

    scene: Any = trimesh.Scene()
    tints, bodies = colours_of(poses), [*poses.arrangement.named.values()]
    for number, name in enumerate(poses.names):
        kind, place = int(poses.kinds[number]), np.eye(4)
        if f"kind {kind}" not in scene.geometry:
            mesh = _mesh(bodies[kind], tints[name])
            scene.add_geometry(mesh, node_name=name, geom_name=f"kind {kind}", transform=place)
        else:
            scene.graph.update(frame_to=name, matrix=place, geometry=f"kind {kind}")
    for name, body in poses.arrangement.fixed.items():
        scene.add_geometry(_mesh(body, FIXED), node_name=name, geom_name=name)
    return write_atomically(path, _moving(bytes(scene.export(file_type="glb")), poses))


def _mesh(body: Body, colour: str) -> Any:
    import trimesh

    vertices, faces, normals = _triangles(body)
    mesh = trimesh.Trimesh(vertices, faces, vertex_normals=normals, process=False)
    return painted(mesh, colour, two_sided=body.dimension == 2)


def _moving(scene: bytes, poses: Poses) -> bytes:
    """Return a GLB file whose nodes of bodies are placed, and move if there are several instants.

    A file is a header of 12 bytes and two chunks, of JSON and of numbers, each after its length
    and kind (https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html, sec. 4.4).
    """
    (length,) = struct.unpack_from("<I", scene, 12)
    told, numbers = json.loads(scene[20 : 20 + length]), bytearray(scene[28 + length :])
    nodes = {node.get("name"): (k, node) for k, node in enumerate(told["nodes"])}

    def accessor(values: ArrayLike, kind: str, **more: Any) -> int:
        content = np.asarray(values, "<f4").tobytes()
        view = {"buffer": 0, "byteOffset": len(numbers), "byteLength": len(content)}
        numbers.extend(content)
        told["bufferViews"].append(view)
        entry = {"bufferView": len(told["bufferViews"]) - 1, "componentType": FLOAT, "type": kind}
        told["accessors"].append(entry | {"count": len(poses)} | more)
        return len(told["accessors"]) - 1

    channels: list[dict[str, Any]] = []
    samplers: list[dict[str, Any]] = []
    times = np.asarray(poses.times - poses.times[0], "<f4")
    clock = {"min": [0.0], "max": [float(times[-1])]}
    at = accessor(times, "SCALAR", **clock) if len(poses) > 1 else -1
    for number, name in enumerate(poses.names):
        k, node = nodes[name]
        tracks = {
            "translation": (_in_space(poses.origins[:, number]), "VEC3", "LINEAR"),
            "rotation": (_continuous(poses.turns[:, number])[:, [1, 2, 3, 0]], "VEC4", "LINEAR"),
            "scale": (np.repeat(poses.present[:, number, None], 3, axis=1), "VEC3", "STEP"),
        }
        node.pop("matrix", None)
        for target, (values, kind, steps) in tracks.items():
            node[target] = np.asarray(values[0], dtype=np.float64).tolist()
            if at < 0 or (target == "scale" and poses.present[:, number].all()):
                continue
            output = accessor(values, kind)
            samplers.append({"input": at, "output": output, "interpolation": steps})
            where = {"node": k, "path": target}
            channels.append({"sampler": len(samplers) - 1, "target": where})
    if channels:
        told["animations"] = [{"name": "motion", "channels": channels, "samplers": samplers}]
    told["buffers"][0]["byteLength"] = len(numbers)
    text = json.dumps(told, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    whole = 28 + len(text) + len(numbers)
    head = struct.pack("<4sII", b"glTF", 2, whole)
    chunks = struct.pack("<I4s", len(text), b"JSON"), struct.pack("<I4s", len(numbers), b"BIN\0")
    return head + chunks[0] + text + chunks[1] + bytes(numbers)


def _continuous(turns: Array) -> Array:
    """Return quaternions ``(T, 4)`` of signs such that each is near the one before it."""
    signs = np.where((turns[1:] * turns[:-1]).sum(axis=1) < 0, -1.0, 1.0)
    return np.asarray(turns * np.cumprod([1.0, *signs])[:, None])


WRITERS = {".gsd": _write_gsd, ".xyz": _write_xyz, ".glb": _write_glb}
