"""Robots from URDF files.

A file is XML, parsed by lxml without entities, document types or the network, and checked element
by element; what is left of it, links with their inertia and collision shapes, and joints, is read
by yourdfpy.
"""

import io
import math
import os
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from polycorner import checks
from polycorner.bodies.holds import across
from polycorner.bodies.links import KINDS, RobotJoint, RobotLink
from polycorner.bodies.masses import Mass, mass_of
from polycorner.bodies.robots import BASES, Robot
from polycorner.bodies.shapes import Body, capsule, compound, polytope, sphere
from polycorner.checks import missing_extra, refuse
from polycorner.files.meshes import MeshOptions, capsule_around, convex_body, load_mesh
from polycorner.files.safe_paths import content, name_of, within
from polycorner.files.safe_xml import is_finite, parsed, place_of
from polycorner.kinds import checked
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT

SHAPES = ("capsules", "hulls", "parts")
INERTIAS = ("file", "nearest", "shapes")
# How many numbers each attribute has; those after "?" may be missing.
NUMBERS: Mapping[str, Mapping[str, str]] = {
    "mass": {"value": "1"},
    "inertia": dict.fromkeys(("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), "1"),
    "origin": {"xyz": "?3", "rpy": "?3"},
    "axis": {"xyz": "3"},
    "box": {"size": "3"},
    "sphere": {"radius": "1"},
    "cylinder": {"radius": "1", "length": "1"},
    "capsule": {"radius": "1", "length": "1"},
    "mesh": {"scale": "?3"},
    "limit": {"lower": "?1", "upper": "?1", "effort": "?1", "velocity": "?1"},
    "dynamics": {"damping": "?1", "friction": "?1"},
    "mimic": {"multiplier": "?1", "offset": "?1"},
}
WORDS = {
    "robot": ("name",),
    "link": ("name",),
    "joint": ("name", "type"),
    "parent": ("link",),
    "child": ("link",),
    "mesh": ("filename",),
    "mimic": ("joint",),
}
NEEDED = {
    "joint": ("parent", "child"),
    "collision": ("geometry",),
    "inertial": ("mass", "inertia"),
}
POSITIVE = ("box", "sphere", "cylinder", "capsule")  # whose numbers are
LOOSE = ("planar", "floating")  # joints with several coordinates
SEVERAL = ("link", "joint", "collision")
KEPT = {
    "robot": ("link", "joint"),
    "link": ("inertial", "collision"),
    "inertial": ("origin", "mass", "inertia"),
    "collision": ("origin", "geometry"),
    "geometry": ("box", "sphere", "cylinder", "capsule", "mesh"),
    "joint": ("origin", "parent", "child", "axis", "limit", "dynamics", "mimic"),
}


@checked
def read_urdf(
    path: str | os.PathLike[str],
    *,
    folder: str | os.PathLike[str] | None = None,
    shapes: Literal["capsules", "hulls", "parts"] = "capsules",
    sides: int | None = None,
    inertias: Literal["file", "nearest", "shapes"] = "file",
    base: Literal["fixed", "floating"] = "fixed",
    options: MeshOptions | None = None,
) -> Robot:
    """Read a robot from a URDF file.

    Collision shapes become bodies: boxes and spheres as they are; a cylinder the capsule of its
    radius about its axis, which reaches a radius beyond its ends, or a prism around it; meshes as
    ``shapes`` says.  Visual shapes, transmissions and plugins are left out.  Links that overlap
    with all joints at zero, or at the limit next to it, are taken not to touch: they are
    ``Robot.ignored``.  Limits without numbers are none, as simulators take them.
    Names become those of Python, with ``_`` for other characters.  A planar joint ``J`` has the
    coordinates ``J_x``, ``J_y`` across its axis and ``J`` about it; one that floats leads from an
    empty link to the base, which floats.

    Parameters
    ----------
    path : path
    folder : path, optional
        The folder beyond which no mesh is read; default that of the file.  It may be above that of
        the file, for meshes in ``../meshes``, and the place of a ROS package or the package itself,
        for ``package://`` paths.
    shapes : {"capsules", "hulls", "parts"}, optional
        What becomes of meshes: the least capsule found around each (default), its convex hull, or
        convex parts (extra ``meshes``).  Two capsules have one gap, two hulls of many vertices
        thousands.
    sides : int, optional
        The sides of prisms around cylinders, at most half the ``vertices`` of ``options``; by
        default cylinders become capsules.
    inertias : {"file", "nearest", "shapes"}, optional
        What becomes of inertias that no body has: they are refused (default), or changed to the
        nearest ones with second moments of at least a millimetre squared times the mass.  Or all
        centres of mass and inertias are those of the collision shapes, filled uniformly, where
        files have placeholders.  Masses are always those of the file.
    base : {"fixed", "floating"}, optional
        Whether the base stands at the origin (default) or moves freely.
    options : MeshOptions, optional
        How many vertices hulls and parts may have, how large files may be, and more.

    Returns
    -------
    Robot
        :meth:`Robot.among` places it among walls and other bodies.

    Raises
    ------
    ValueError
        With file, line and element for what is not understood: other XML, document types, xacro,
        joints that float within a chain, numbers that are none, inertias that no body has,
        meshes that are not in the folder.
    ImportError
        Naming the extra that reads URDF.
    OSError
        If the file cannot be read.

    Examples
    --------
    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "pendulum.urdf"
    >>> _ = path.write_text('''
    ... <robot name="pendulum">
    ...   <link name="frame"/>
    ...   <link name="rod">
    ...     <inertial>
    ...       <origin xyz="0 0 -0.5"/> <mass value="2"/>
    ...       <inertia ixx="0.1" iyy="0.1" izz="0.001" ixy="0" ixz="0" iyz="0"/>
    ...     </inertial>
    ...     <collision>
    ...       <origin xyz="0 0 -0.5"/> <geometry><cylinder radius="0.05" length="1"/></geometry>
    ...     </collision>
    ...   </link>
    ...   <joint name="pivot" type="revolute">
    ...     <parent link="frame"/> <child link="rod"/> <axis xyz="0 1 0"/>
    ...     <limit lower="-1" upper="2" effort="10" velocity="5"/>
    ...   </joint>
    ... </robot>''')
    >>> robot = read_urdf(path)
    >>> robot.manifold.names, robot.polyhedron.names
    (('pivot',), ('pivot lower', 'pivot upper'))
    """
    try:
        import yourdfpy
    except ImportError:
        missing = missing_extra("yourdfpy", "robots")
        raise missing from None
    for argument, word, known in (
        ("shapes", shapes, SHAPES), ("inertias", inertias, INERTIAS), ("base", base, BASES)
    ):  # fmt: skip
        checks.choice(argument, word, known)
    options = MeshOptions() if options is None else options
    _check_sides(sides, options.vertices)
    if folder is not None and not Path(folder).is_dir():
        refuse("folder", "a folder that exists", os.fspath(folder))
    about, file = f"path: {name_of(path)}", Path(path)
    root = _parsed(about, content(about, path, options.megabytes))
    _check(about, root)
    inner = _plain(root)
    try:
        data = io.BytesIO(inner)
        found = yourdfpy.URDF.load(data, build_scene_graph=False, load_meshes=False).robot
    except Exception as error:
        reason = checks.shortened(str(error) or type(error).__name__, checks.LONGEST_REASON)
        msg = f"{about}: expected a robot in URDF; got {reason}"
        raise ValueError(msg) from error
    within_folder = file.parent if folder is None else Path(folder)
    shaper = _Shaper(file.parent, within_folder, shapes, sides, inertias, options)
    names: dict[str, str] = {}
    for several in (found.links, found.joints):
        names |= _identifiers(about, [x.name for x in several])
    with checks.about(about):
        links = {names[x.name]: _link(shaper, x) for x in found.links}
        joints: dict[str, RobotJoint] = {}
        tied: list[tuple[str, str]] = []
        for x in found.joints:
            if x.type == "floating":
                _check_floating(x, found, links[names[x.parent]])
                del links[names[x.parent]]
                base = "floating"
                continue
            name, joint = names[x.name], _joint(x, names)
            if x.type == "planar":
                more, several = _planar(name, joint)
                if taken := {*more, *several} & {*links, *joints, *names.values()} - {name}:
                    refuse("joints", f"no other link or joint {min(taken)!r}", x.name)
                links, joints = links | more, joints | several
                tied.append((joint.parent, joint.child))
            else:
                joints[name] = joint
        robot = Robot(links, joints, base=base, ignored=tied)
        moves = base == "floating" or any(joint.moves for joint in joints.values())
        if not moves:
            return robot
        return replace(robot, ignored=[*robot.ignored, *robot.overlapping(robot.home)])


def _check_sides(sides: int | None, vertices: int) -> None:
    """Raise for prisms that are none, or have more vertices than parts may have."""
    if sides is not None and checks.whole("sides", sides, least=3) > vertices // 2:
        expected = f"at most {vertices // 2}, as MeshOptions(vertices={vertices}) has it"
        refuse("sides", expected, sides)


def _check_floating(joint: Any, robot: Any, parent: RobotLink) -> None:
    """Raise unless a joint that floats leads from a link that is nothing but space to the rest."""
    others = (j for j in robot.joints if j is not joint and joint.parent in {j.parent, j.child})
    if any(others) or parent.body is not None or parent.mass is not None:
        expected = f"a floating joint from an empty link, {joint.parent!r}, and no other of it"
        refuse(f"joint {joint.name!r}", expected, "shapes, a mass or further joints")


def _planar(name: str, joint: RobotJoint) -> tuple[dict[str, RobotLink], dict[str, RobotJoint]]:
    """Return what a joint in a plane is made of: two that slide and one that turns about the axis.

    The directions are those of :func:`~polycorner.bodies.holds.across`, for the axis ``z`` those of
    ``x`` and ``y``.
    """
    first, second = f"{name}_1", f"{name}_2"
    u, v = across(joint.axis)
    there = replace(joint, parent=second, origin=np.zeros(3), turn=np.eye(3))
    return {first: RobotLink(), second: RobotLink()}, {
        f"{name}_x": replace(joint, child=first, kind="prismatic", axis=u),
        f"{name}_y": replace(there, parent=first, child=second, kind="prismatic", axis=v),
        name: there,
    }


def _parsed(about: str, data: bytes) -> Any:
    """Return the root of a URDF file."""
    root = parsed(about, data)
    for element in root.iter():
        if "xacro" in (element.prefix, element.tag.partition(":")[0]):
            refuse(place_of(about, element), "plain URDF, such as the program xacro makes", "xacro")
    if root.tag != "robot":
        refuse(place_of(about, root), "the element <robot>", f"<{root.tag}>")
    return root


def _check(about: str, element: Any) -> None:
    """Raise for missing attributes and elements, and attributes that are not numbers."""
    here, tag = place_of(about, element), element.tag
    _check_attributes(here, element)
    for name in KEPT.get(tag, ()):
        if name not in SEVERAL and (count := len(element.findall(name))) > 1:
            refuse(here, f"one element <{name}> at most", count)
    for name in NEEDED.get(tag, ()):
        if element.find(name) is None:
            refuse(here, f"an element <{name}>", [child.tag for child in element])
    if tag == "joint":
        _check_kind(f"{here} {element.get('name')!r}", element)
    if tag == "geometry" and [c.tag in KEPT["geometry"] for c in element] != [True]:
        shapes = checks.listed(f"<{name}>" for name in KEPT["geometry"])
        refuse(here, f"one of {shapes}", [child.tag for child in element])
    for child in element:
        if child.tag in KEPT.get(tag, ()):
            _check(about, child)


def _check_attributes(here: str, element: Any) -> None:
    tag = element.tag
    for name in WORDS.get(tag, ()):
        if not element.get(name, "").strip():
            refuse(here, f"the attribute {name}", dict(element.attrib))
    for name, sort in NUMBERS.get(tag, {}).items():
        given = element.get(name)
        if given is None and sort.startswith("?"):
            continue
        words, count = (given or "").replace(",", " ").split(), int(sort[-1])
        fits = len(words) == count or (tag == "mesh" and len(words) == 1)
        if not fits or not all(map(is_finite, words)):
            what = "a finite number" if count == 1 else f"{count} finite numbers"
            refuse(f"{here}: {name}", what, given)
        if tag in POSITIVE and min(map(float, words)) <= 0:
            refuse(f"{here}: {name}", "a number > 0" if count == 1 else "numbers > 0", given)
        element.set(name, " ".join(words))


def _check_kind(place: str, joint: Any) -> None:
    kind = joint.get("type")
    if kind not in (*KINDS, *LOOSE):
        every = checks.listed((*KINDS, *LOOSE))
        refuse(place, f"the type {every}, of which chains are made", kind)
    if kind in {"revolute", "prismatic"} and joint.find("limit") is None:
        refuse(place, "an element <limit>", [child.tag for child in joint])


def _plain(root: Any) -> bytes:
    """Return the elements that are understood; a capsule as a cylinder in a collision so called."""
    from lxml import etree

    def copied(element: Any) -> Any:
        found = etree.Element(element.tag, dict(element.attrib))
        found.extend(copied(child) for child in element if child.tag in KEPT.get(element.tag, ()))
        if element.tag == "collision":
            shape = found.find("geometry")[0]
            found.set("name", shape.tag)
            shape.tag = "cylinder" if shape.tag == "capsule" else shape.tag
        return found

    return bytes(etree.tostring(copied(root)))


def _identifiers(about: str, names: list[str]) -> dict[str, str]:
    """Return names of letters, digits and ``_`` for those of a file."""
    found: dict[str, str] = {}
    for name in names:
        if name in found:
            refuse(about, "links, and joints, of different names", name)
        plain = re.sub(r"\W", "_", name, flags=re.ASCII)
        plain = plain if re.match("[A-Za-z_]", plain) else f"_{plain}"
        if plain in found.values():
            refuse(about, f"names that differ in letters and digits from {plain!r}", name)
        found[name] = plain
    return found


def _pose(origin: Array | None) -> tuple[Array, Array]:
    place = np.eye(4) if origin is None else np.array(origin)
    return place[:3, :3], place[:3, 3]


def _link(shaper: "_Shaper", link: Any) -> RobotLink:
    """Return a link with its shapes and its mass."""
    with checks.about(f"link {link.name!r}"):
        bodies, mass = [*shaper.bodies(link)], None
        body = None if not bodies else bodies[0] if len(bodies) == 1 else compound(bodies)
        if link.inertial is not None and link.inertial.mass != 0:
            mass = shaper.mass(link.inertial, body)
        return RobotLink(body, mass)


def _joint(joint: Any, names: Mapping[str, str]) -> RobotJoint:
    with checks.about(f"joint {joint.name!r}"):
        for role in (joint.parent, joint.child):
            checks.names("link", [role], names)
        matrix, origin = _pose(joint.origin)
        limit, dynamics, mimic = joint.limit, joint.dynamics, joint.mimic
        lower, upper = -math.inf, math.inf
        given = (limit.lower, limit.upper) if limit is not None else (None, None)
        if joint.type in {"revolute", "prismatic"} and given != (None, None):
            lower, upper = (x or 0.0 for x in given)
        if mimic is not None:
            checks.names("mimic", [mimic.joint], names)
            rate = 1.0 if mimic.multiplier is None else mimic.multiplier
            mimic = (names[mimic.joint], float(rate), float(mimic.offset or 0.0))
        return RobotJoint(
            names[joint.parent],
            names[joint.child],
            "continuous" if joint.type == "planar" else joint.type,
            origin,
            matrix,
            np.array([0.0, 0.0, 1.0]) if joint.type == "fixed" else joint.axis,
            lower,
            upper,
            float((dynamics and dynamics.damping) or 0.0),
            float((dynamics and dynamics.friction) or 0.0),
            math.inf if limit is None or limit.effort is None else limit.effort,
            mimic if joint.type != "fixed" else None,
        )


@dataclass(frozen=True)
class _Shaper:
    """How collision shapes become bodies."""

    start: Path
    folder: Path
    shapes: str
    sides: int | None
    inertias: str
    options: MeshOptions

    def mass(self, inertial: Any, body: Body | None) -> Mass:
        """Return the mass of a link."""
        if self.inertias == "shapes" and body is not None:
            return mass_of(body, inertial.mass / mass_of(body).mass)
        matrix, centre = _pose(inertial.origin)
        inertia = matrix @ inertial.inertia @ matrix.T
        if self.inertias == "nearest":
            inertia = nearest_inertia(inertia, inertial.mass)
        try:
            return Mass(inertial.mass, centre, (inertia + inertia.T) / 2)
        except ValueError as error:
            others = "inertias='nearest' takes the nearest ones, 'shapes' those of collision shapes"
            msg = f"{error} ({others})"
            raise ValueError(msg) from error

    def bodies(self, link: Any) -> Iterator[Body]:
        """Yield the bodies of a link."""
        for k, collision in enumerate(link.collisions, 1):
            matrix, origin = _pose(collision.origin)
            with checks.about(f"collision {k}"):
                yield self._body(collision.name, collision.geometry).carried(origin, matrix)

    def _body(self, tag: str, geometry: Any) -> Body:
        if tag == "sphere":
            return sphere(geometry.sphere.radius)
        if tag == "box":
            corners = np.stack(np.meshgrid(*[[-0.5, 0.5]] * 3), axis=-1).reshape(-1, 3)
            return polytope(corners * geometry.box.size)
        if tag == "mesh":
            return self._of_mesh(geometry.mesh)
        radius, half = geometry.cylinder.radius, geometry.cylinder.length / 2
        if tag == "capsule" or self.sides is None:
            return capsule([0, 0, -half], [0, 0, half], radius)
        angles = math.tau * np.arange(self.sides) / self.sides
        around = radius / math.cos(math.pi / self.sides) * np.exp(1j * angles)
        return polytope([[z.real, z.imag, x] for x in (-half, half) for z in around])

    def _of_mesh(self, mesh: Any) -> Body:
        place, start, reference = "mesh", self.start, mesh.filename
        if match := re.fullmatch(r"package://([^/]+)/(.+)", reference):
            package, reference = match.groups()
            start = self.folder / package
            if not start.is_dir() and self.folder.resolve().name == package:
                start = self.folder
        file = within(place, self.folder, reference, start)
        if not file.is_file():
            refuse(place, f"a file in the folder {self.folder.resolve()}", mesh.filename)
        scale = np.ones(3) if mesh.scale is None else mesh.scale * np.ones(3)
        if not np.all(scale):
            refuse(place, "a scale without zeros", scale)
        found = load_mesh(f"mesh {file.name}", file, scale, self.options.megabytes)
        if self.shapes == "capsules":
            return capsule_around(found.vertices, f"mesh {file.name}")
        parts = "hull" if self.shapes == "hulls" else "convex"
        return convex_body(f"mesh {file.name}", found, parts, self.options)


def nearest_inertia(inertia: Array, mass: float) -> Array:
    """Return the inertia with the nearest second moments that a body may have.

    With ``S``, the integral of ``x x^T``, an inertia is ``tr S - S``; a body has a positive ``S``,
    here one of at least ``1e-6 m^2`` times the mass.
    """
    second = np.trace(inertia) / 2 * np.eye(3) - (inertia + inertia.T) / 2
    sizes, axes = np.linalg.eigh(second)
    sizes = np.maximum(sizes, DEFAULT.same * mass)
    return np.asarray(sizes.sum() * np.eye(3) - (axes * sizes) @ axes.T)
