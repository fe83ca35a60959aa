"""Skeletons of polyhedra: parts and their incidences."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.printing import Printed, Sheet, Table, facts, listed, names, number, titled, units
from polycorner.skeletons.parts import Completeness, Contact, Corner, Edge, Face
from polycorner.skeletons.walks import End
from polycorner.values import Checked, cached_property

if TYPE_CHECKING:
    import networkx as nx


@dataclass(frozen=True, eq=False)
class Skeleton(Printed, Checked):
    """Corners, edges and faces of a polyhedron modulo its symmetry; see :func:`skeleton`.

    Attributes
    ----------
    polyhedron : Polyhedron
        The set.
    corners, edges, faces : tuples
        What was found.
    complete : Completeness
        How complete it is.
    notes : tuple of str
        What a user should know: starts outside, points too near to each other, ends of
        charts, edges and faces that could not be traced.
    components : mapping from int to int
        Numbers of connected components by dimension: corners, edges, faces, and the interior
        where it comes next.
    whole : bool
        Whether faces were assembled everywhere: not where a face lies on both sides of an edge,
        or modulo relabellings.
    contacts : mapping from str to Contact
        For every function where it is active, or the least value that was found.
    state : object
        The state of the search, for :func:`resume`.
    """

    polyhedron: Polyhedron
    corners: tuple[Corner, ...]
    edges: tuple[Edge, ...]
    faces: tuple[Face, ...]
    complete: Completeness
    notes: tuple[str, ...]
    components: Mapping[int, int]
    whole: bool = True
    contacts: Mapping[str, Contact] = field(default_factory=dict)
    state: Any = None

    def __repr__(self) -> str:
        """Return the counts, and how complete they are."""
        counts = f"{len(self.corners)} corners, {len(self.edges)} edges, {len(self.faces)} faces"
        return f"Skeleton({counts}; {self.complete.value})"

    def _sheet(self) -> Sheet:
        notes = (f"Note: {note}" for note in self.notes)
        tables = (table(self) for table in (_corner_table, _edge_table, _face_table))
        unit = units(self.polyhedron.manifold.periods)
        contacts = list(_contact_table(self))
        return Sheet("Skeleton", (facts(_counts(self)), *tables, *contacts, *notes, unit))

    @property
    def euler_characteristic(self) -> int | None:
        """Corners minus edges plus the Euler characteristics of the faces.

        It is that of the union of all of them: the polyhedron itself if it has dimension two,
        its boundary if it has dimension three.  A closed edge counts zero.  It is that of what
        was found, without islands that were not.
        None where it is not determined; :attr:`euler_note` gives the reason.
        """
        if self.euler_note:
            return None
        open_edges = sum(not edge.is_closed for edge in self.edges)
        surfaces = sum(face.euler_characteristic or 0 for face in self.faces)
        return len(self.corners) - open_edges + surfaces

    @property
    def euler_note(self) -> str:
        """Why the Euler characteristic is not determined; empty where it is."""
        if self.complete in (Completeness.BUDGET, Completeness.INTERRUPTED):
            return "the search is not finished"
        if not self.faces:
            return "no faces were found"
        if any(edge.kinds[1] not in (End.CORNER, End.CLOSED) for edge in self.edges):
            return "an edge has an open end"
        if not all(face.closed for face in self.faces):
            return "the boundary of a face is not closed"
        if not self.whole:
            return "faces were not assembled everywhere"
        if any(face.euler_characteristic is None for face in self.faces):
            return "that of a face is not determined"
        return ""

    @cached_property
    def graph(self) -> "nx.MultiGraph":
        """Corners as nodes, edges as edges, with ``active``, ``length`` and ``position``."""
        import networkx as nx

        graph = nx.MultiGraph()
        for i, corner in enumerate(self.corners):
            graph.add_node(i, active=corner.active, singular=corner.singular)
        for k, edge in enumerate(self.edges):
            if None not in edge.ends:
                graph.add_edge(*edge.ends, active=edge.active, length=edge.length, position=k)
        return graph


def corner_name(position: int) -> str:
    """Return the name of a corner by its position in ``Skeleton.corners``.

    >>> corner_name(3)
    'C3'
    """
    return f"C{position}"


MOST_COORDINATES = 6  # of a corner, in a row of its table


def _counts(found: Skeleton) -> Iterator[tuple[str, str]]:
    yield "corners", str(len(found.corners))
    yield "edges", str(len(found.edges))
    yield "faces", str(len(found.faces))
    counts = (f"{n} of dimension {d}" for d, n in sorted(found.components.items()))
    yield "components", ", ".join(counts) or "none"
    yield "Euler characteristic", _euler(found)
    yield "complete", found.complete.value


def _euler(found: Skeleton) -> str:
    if found.euler_note:
        return f"not determined: {found.euler_note}"
    return str(found.euler_characteristic)


def _corner_table(found: Skeleton) -> Table:
    manifold = found.polyhedron.manifold
    shown = manifold.size if manifold.size <= MOST_COORDINATES else 0
    rows = (
        (
            corner_name(k),
            names(corner.active),
            str(corner.rank),
            corner.local_type.name + (", singular" if corner.singular else ""),
            *(number(x, 6) for x in corner.point[:shown]),
        )
        for k, corner in enumerate(found.corners)
    )
    coordinates = map(titled, manifold.names[:shown], manifold.periods)
    head = ("corner", "active", "rank", "type", *coordinates)
    return listed("Corners", head, rows, len(found.corners), (0, 2, *range(4, len(head))))


def _edge_table(found: Skeleton) -> Table:
    rows = (
        (
            str(k),
            names(edge.active),
            *(kind.name.lower() if at is None else corner_name(at) for at, kind in _ends(edge)),
            number(edge.length, 6),
        )
        for k, edge in enumerate(found.edges)
    )
    head = ("edge", "active", "from", "to", "length (scale units)")
    return listed("Edges", head, rows, len(found.edges), (0, 4))


def _ends(edge: Edge) -> Iterator[tuple[int | None, End]]:
    yield from zip(edge.ends, edge.kinds, strict=True)


def _face_table(found: Skeleton) -> Table:
    rows = (
        (
            str(k),
            names(face.active) or "-",
            "; ".join(" ".join(map(str, curve)) for curve in face.boundary) or "-",
            "yes" if face.closed else "no",
        )
        for k, face in enumerate(found.faces)
    )
    head = ("face", "active", "edges around it", "closed")
    return listed("Faces", head, rows, len(found.faces), (0,))


def _contact_table(found: Skeleton) -> Iterator[Table]:
    missed = [(name, c.least) for name, c in found.contacts.items() if not c.met]
    if not missed:
        return
    rows = ((name, "not sought" if least is None else number(least, 6)) for name, least in missed)
    head = ("never met", "least value found")
    yield listed("Functions", head, rows, len(missed), (1,))
