"""Collada files, checked and reduced to triangles and where they are, for pycollada to read.

A file is XML (:mod:`~polycorner.files.safe_xml`).  Meshes and nodes are kept, numbers and
references are checked, and instances of nodes are written out: pycollada takes text that is no
number for the end of the numbers, NaN for zero, and a negative index for one from the end.
Materials, images, cameras, lights and animations are left out, unread.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from polycorner.checks import missing_extra, refuse
from polycorner.files.safe_paths import MIB
from polycorner.files.safe_xml import is_finite, parsed, place_of, tag_of

NAMESPACE = "http://www.collada.org/2005/11/COLLADASchema"
FACES = ("triangles", "polylist", "polygons")
# What is kept; lines and points have no inside.
KEPT = {
    "COLLADA": ("library_geometries", "library_visual_scenes", "scene"),
    "library_geometries": ("geometry",),
    "geometry": ("mesh",),
    "mesh": ("source", "vertices", *FACES),
    "source": ("float_array", "technique_common"),
    "technique_common": ("accessor",),
    "accessor": ("param",),
    "vertices": ("input",),
    **dict.fromkeys(FACES, ("input", "vcount", "p")),
    "library_visual_scenes": ("visual_scene",),
    "visual_scene": ("node",),
    "node": (
        *("matrix", "translate", "rotate", "scale", "lookat"),
        *("node", "instance_node", "instance_geometry"),
    ),
    "scene": ("instance_visual_scene",),
}
REFUSED = {  # and what is expected instead
    **dict.fromkeys(("tristrips", "trifans"), "triangles one by one, <triangles>"),
    "ph": "polygons without holes",
    **dict.fromkeys(("convex_mesh", "spline", "brep"), "a <mesh>"),
    "instance_controller": "rigid geometry, <instance_geometry>",
    "skew": "<matrix>, <translate>, <rotate>, <scale> or <lookat>",
}
COUNTS = {"matrix": 16, "translate": 3, "rotate": 4, "scale": 3, "lookat": 9, "float_array": 0}
INDICES, INDEX = ("vcount", "p"), re.compile("[0-9]{1,9}")
WHOLE = "whole numbers from 0 to 999999999"
REFERENCES = {"instance_geometry": "url", "instance_visual_scene": "url", "input": "source"}


def plain(about: str, data: bytes, megabytes: float) -> tuple[bytes, float]:
    """Return a file with what is understood alone, and the length of its unit in metres.

    Raises
    ------
    ValueError
        With the line, for what is not understood, refers to other files, or is larger than
        ``megabytes`` once instances are written out.
    ImportError
        Naming the extra that reads Collada.
    """
    try:
        import collada  # noqa: F401 - read by trimesh
        from lxml import etree
    except ImportError as error:
        missing = missing_extra("pycollada" if error.name == "collada" else "lxml", "meshes")
        raise missing from None
    root = parsed(about, data)
    if tag_of(root) != "COLLADA":
        refuse(place_of(about, root), "the element <COLLADA>", f"<{tag_of(root)}>")
    unit, named = 1.0, dict[tuple[str, str], Any]()
    for element in root.iter():
        tag = tag_of(element)
        if tag == "unit" and tag_of(element.getparent()) == "asset":
            unit = _unit(about, element)
        if tag in {"geometry", "node", "visual_scene"} and element.get("id"):
            named.setdefault((tag, element.get("id")), element)
    try:
        found = _Copy(about, named, MIB * megabytes).of(root)
    except RecursionError:
        refuse(about, "nodes that are nested less deeply", "more levels than Python's stack has")
    shown = f"{{{NAMESPACE}}}scene/{{{NAMESPACE}}}instance_visual_scene"
    if found.find(shown) is None:
        expected = "an element <scene>, whose <instance_visual_scene> says what is where"
        refuse(place_of(about, root), expected, [f"<{tag_of(child)}>" for child in root])
    return bytes(etree.tostring(found)), unit


def _unit(about: str, element: Any) -> float:
    given = element.get("meter", "1")
    if not is_finite(given) or float(given) <= 0:
        refuse(f"{place_of(about, element)}: meter", "a length > 0", given)
    return float(given)


@dataclass
class _Copy:
    """A copy of what is kept, with instances of nodes written out.

    Attributes
    ----------
    about : str
    named : dict from (str, str) to element
        By tag and name.
    left : float
        How many bytes instances may still have.
    within : list of str
        The nodes whose instances are being written.
    """

    about: str
    named: dict[tuple[str, str], Any]
    left: float
    within: list[str] = field(default_factory=list)

    def of(self, element: Any) -> Any:
        """Return the copy of an element."""
        from lxml import etree

        tag = tag_of(element)
        if self.within:
            self._spend(element, len(tag))
        self._check_references(tag, element)
        self._check_numbers(tag, element)
        found = etree.Element(f"{{{NAMESPACE}}}{tag}", dict(element.attrib))
        found.text = element.text if tag in COUNTS or tag in INDICES else None
        for child in element:
            kind = tag_of(child)
            if kind in REFUSED:
                refuse(place_of(self.about, child), REFUSED[kind], f"<{kind}>")
            if kind == "instance_node":
                found.extend(self._instance(child))
            elif kind in KEPT.get(tag, ()):
                found.append(self.of(child))
        if tag == "polylist":
            self._check_corners(element, found)
        return found

    def _instance(self, element: Any) -> Iterator[Any]:
        """Yield the node that is referred to."""
        name = self._name(element, "url")
        node = self.named.get(("node", name))
        if node is None or name in self.within:
            expected = "the name of a node of the file, which is not within itself"
            refuse(f"{place_of(self.about, element)}: url", expected, element.get("url"))
        self.within.append(name)
        yield self.of(node)
        self.within.pop()

    def _spend(self, element: Any, size: int) -> None:
        self.left -= size
        if self.left < 0:
            refuse(place_of(self.about, element), "a smaller file, with all instances", "more")

    def _name(self, element: Any, attribute: str) -> str:
        """Return the name in the file that an element refers to."""
        given = element.get(attribute, "")
        if not given.startswith("#"):
            expected = "a name in this file, '#...', as nothing else is read"
            refuse(f"{place_of(self.about, element)}: {attribute}", expected, given)
        return str(given[1:])

    def _check_references(self, tag: str, element: Any) -> None:
        """Raise for a reference to what is not there; an instance has the size of its mesh."""
        if tag not in REFERENCES:
            return
        name, kind = self._name(element, REFERENCES[tag]), tag.removeprefix("instance_")
        target = self.named.get((kind, name))
        if kind == tag:  # an input of a mesh, whose sources are read with it
            if not INDEX.fullmatch(given := element.get("offset", "0")):
                refuse(f"{place_of(self.about, element)}: offset", WHOLE, given)
            return
        if target is None:
            place = f"{place_of(self.about, element)}: url"
            refuse(place, f"the name of a {kind} of the file", f"#{name}")
        if kind == "geometry":
            self._spend(element, sum(len(x.tag) + len(x.text or "") for x in target.iter()))

    def _check_numbers(self, tag: str, element: Any) -> None:
        """Raise for numbers that are none, and another number of them than is needed."""
        words = (element.text or "").split() if tag in COUNTS or tag in INDICES else []
        fits: Any = is_finite if tag in COUNTS else INDEX.fullmatch
        place, count = place_of(self.about, element), COUNTS.get(tag)
        if strange := next((word for word in words if not fits(word)), None):
            what = "finite numbers" if tag in COUNTS else WHOLE
            refuse(place, what, strange)
        if count and len(words) != count:
            refuse(place, f"{count} finite numbers", " ".join(words))

    def _check_corners(self, element: Any, polylist: Any) -> None:
        """Raise for another number of indices than polygons have."""
        inside = {tag_of(child): (child.text or "").split() for child in polylist}
        offsets = [int(x.get("offset", "0")) for x in polylist if tag_of(x) == "input"]
        corners, indices = sum(map(int, inside.get("vcount", []))), len(inside.get("p", []))
        if corners * (1 + max(offsets, default=0)) != indices:
            place = place_of(self.about, element)
            refuse(place, f"indices <p> of the {corners} corners that <vcount> has", indices)
