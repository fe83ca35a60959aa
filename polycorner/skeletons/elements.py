"""Skeletons of polyhedra: corners, edges, faces and their incidences."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from enum import Enum
from functools import cached_property
from typing import TYPE_CHECKING, Any

from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.polyhedra.strata import LocalType, Stratum
from polycorner.printing import Printed, Sheet, Table, facts, listed, names, number, titled, units
from polycorner.skeletons.arcs import arc_length
from polycorner.skeletons.indices import Border, face_euler_characteristic
from polycorner.skeletons.points import Quotient
from polycorner.skeletons.walks import End
from polycorner.spaces.manifold import Array
from polycorner.values import Value

if TYPE_CHECKING:
    import networkx as nx


class Completeness(Enum):
    """Completeness of a skeleton; the value is a sentence."""

    EXHAUSTED = "all that was met is traced; islands that no walk met are not excluded"
    GAPS = "some edges could not be traced: the notes say which"
    BUDGET = "budget or time was used up: edges or faces are left"
    INTERRUPTED = "interrupted: edges or faces are left"
    SEEDS = "no start leads to a corner, an edge or a closed face"


@dataclass(frozen=True, eq=False)
class Corner(Value):
    """A corner: a point that its active functions isolate, modulo the symmetry.

    Attributes
    ----------
    point : (n,) array
        The point: of its orbit the first that was found.
    stratum : Stratum
        Active functions, rank, dimension and local type there.
    singular : bool
        Whether the rank falls short: curves cross, touch or have a cusp, or a surface an apex.
    edges : tuple of int
        Edges that leave it, as positions in ``Skeleton.edges``, once for every end.
    """

    point: Array
    stratum: Stratum
    singular: bool
    edges: tuple[int, ...]

    @property
    def active(self) -> tuple[str, ...]:
        """Names of the active functions."""
        return self.stratum.active

    @property
    def rank(self) -> int:
        """Rank of the active gradients and equations."""
        return self.stratum.rank

    @property
    def local_type(self) -> LocalType:
        """What the polyhedron looks like here."""
        return self.stratum.local_type

    @property
    def chirality(self) -> str | None:
        """The model's ``chirality`` annotation, or None."""
        return self.stratum.chirality


@dataclass(frozen=True, eq=False)
class Edge(Value):
    """An edge: a curve on which the active functions vanish, modulo the symmetry.

    Attributes
    ----------
    active : tuple of str
        Functions that vanish along it.
    ends : tuple of (int or None, int or None)
        Corners at its ends, as positions in ``Skeleton.corners``; None where there is none.
    kinds : tuple of (End, End)
        How either end comes about.
    polyline : (k, n) array
        Points along it, in coordinates that are not wrapped.
    quotient : Quotient
        The polyhedron modulo its symmetry.
    """

    active: tuple[str, ...]
    ends: tuple[int | None, int | None]
    kinds: tuple[End, End]
    polyline: Array
    quotient: Quotient = field(repr=False)

    @cached_property
    def length(self) -> float:
        """Length of the curve in scale units, orthogonal to the symmetry.

        Integrated to ``1e-11`` between the ends of the polyline; see
        :func:`~polycorner.skeletons.arcs.arc_length`.  A cusp at an end is known less exactly, to
        about ``1e-7``.
        """
        names = self.quotient.polyhedron.names
        return arc_length(self.quotient, self.polyline, [names.index(f) for f in self.active])

    @property
    def is_closed(self) -> bool:
        """Whether it is a closed curve without a corner."""
        return self.kinds[0] is End.CLOSED

    @property
    def is_loop(self) -> bool:
        """Whether it returns to the corner it left, or is closed without a corner."""
        return self.is_closed or (self.ends[0] is not None and self.ends[0] == self.ends[1])


@dataclass(frozen=True)
class Face(Value):
    """A two-dimensional face, modulo the symmetry.

    Attributes
    ----------
    active : tuple of str
        Functions that vanish on it.
    boundary : tuple of tuple of int
        Its boundary curves, each as the positions of its edges; none for an apex or a closed
        surface.
    closed : bool
        Whether every boundary curve closes: no end at infinity, and no corner where the face
        could not be followed.
    border : Border or None
        What its Euler characteristic is computed from.
    """

    active: tuple[str, ...]
    boundary: tuple[tuple[int, ...], ...]
    closed: bool
    border: Border | None = field(default=None, compare=False, repr=False)

    @cached_property
    def euler_characteristic(self) -> int | None:
        """That of the face with its boundary, from the critical points of heights on it.

        A disc with ``b`` holes and ``g`` handles has ``1 - b - 2 g``.  None where it is not
        determined: the face is not compact, a net does not cover it or leaves it where no edge
        was found, heights do not agree, or the search divided by a finite symmetry.  Computed
        when it is asked for.
        """
        if self.border is None:  # as at a singular corner
            return 2 - len(self.boundary) if self.closed else None
        found = face_euler_characteristic(self.border) if self.closed else None
        return None if found is None else found - self.boundary.count(())


@dataclass(frozen=True)
class Contact:
    """Where a function of a polyhedron vanishes on it, as far as was found.

    Attributes
    ----------
    corners, edges, faces : int
        On how many of them it is active.
    least : float or None
        Least value in the polyhedron that samples and minimisation found, if it was never met;
        None if it was met, or no islands were sought.
    """

    corners: int
    edges: int
    faces: int
    least: float | None

    @property
    def met(self) -> bool:
        """Whether it is active anywhere."""
        return self.corners + self.edges + self.faces > 0


@dataclass(frozen=True, eq=False)
class Skeleton(Printed, Value):
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
    shown = manifold.dimension if manifold.dimension <= MOST_COORDINATES else 0
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
