"""Forces at contacts, and what a system knows of the space in which its bodies touch."""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from polycorner.spaces.manifold import Array
from polycorner.values import Checked, Value


class Site(NamedTuple):
    """Where two things touch.

    Attributes
    ----------
    one, two : str
        Their names.
    point : (d,) array
    normal : (d,) array
        Unit vector towards the first.
    arm : float
        Length by which a rolling force turns.
    """

    one: str
    two: str
    point: Array
    normal: Array
    arm: float

    @property
    def tangents(self) -> Array:
        """The directions of the components of friction, ``(d - 1, d)``, as in the slips.

        In the plane the normal turned left; in space a basis without a singular direction ([Duff]).
        """
        if len(self.normal) == 2:
            return np.array([[-self.normal[1], self.normal[0]]])
        x, y, z = self.normal
        side = 1.0 if z >= 0 else -1.0
        a = -1 / (side + z)
        b = x * y * a
        return np.array([[1 + side * x**2 * a, side * b, -side * x], [b, side + y**2 * a, -y]])


class Scene(Value, ABC):
    """What is known of bodies in space: their names, and where they touch.

    Attributes
    ----------
    names : tuple of str
        Of all bodies that move; of a dense system of those that it consists of.
    walls : frozenset of str
        Which names are those of walls.
    can_cross : bool
        Whether two of them may cross each other without a gap that is negative.
    """

    names: tuple[str, ...]
    walls: frozenset[str]
    can_cross: bool

    @property
    def lever(self) -> Array:
        """How far a unit of each coordinate turns points of a body, as of a ``MovingBody``."""
        return np.empty(0)

    @abstractmethod
    def crossed(self, bodies: tuple[int, ...], q: Array) -> tuple[str, ...]:
        """Return the names of two that cross each other: of a body and what is fixed, or of two.

        Distances of the features of rods in the plane, and of rounded hulls, are large there.
        """

    @abstractmethod
    def parties(self, bodies: tuple[int, ...], contact: str) -> tuple[str, ...]:
        """Return the names of the two that touch at a contact of bodies; empty if not known."""

    @abstractmethod
    def site(self, bodies: tuple[int, ...], contact: str, q: Array) -> Site | None:
        """Return where a contact of bodies is; None if it is not known.

        Parameters
        ----------
        bodies : tuple of int
        contact : str
        q : (N, k) array
            Placements of all bodies.
        """


@dataclass(frozen=True, eq=False)
class ContactForce(Checked):
    """The force at a contact at an instant.

    Attributes
    ----------
    bodies : tuple of int
        As in ``Trajectory.touching``.
    contact : str
    between : tuple of str
        The names of the two that touch, where the system knows them; else empty.
    normal : float
        Normal force, along the gradient of the gap; of an equation of either sign.  Not a number
        where friction has a load that is known beforehand.
    friction : mapping from str to tuple of float
        Components of each kind of friction, ``"sliding"``, ``"rolling"`` (``"rubbing"`` between
        repeated bodies), a force as the normal one; empty where none acts.
    point : (d,) array, optional
        Where they touch, of bodies in space.
    direction : (d,) array, optional
        The unit normal, towards the first.
    force : (d,) array, optional
        The force on the first; that on the second is opposite.
    torque : float or (3,) array, optional
        The torque on the first that resists rolling, about the point.
    """

    bodies: tuple[int, ...]
    contact: str
    between: tuple[str, ...]
    normal: float
    friction: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    point: Array | None = None
    direction: Array | None = None
    force: Array | None = None
    torque: Array | None = None


@dataclass(frozen=True, eq=False)
class ContactForces(Checked):
    """The forces of all contacts at an instant, for drawing.

    Attributes
    ----------
    points, directions, forces : (n, d) array
        Where bodies touch, the unit normal towards the first, and the force on the first.
    torques : (n,) or (n, 3) array
        The torque on the first that resists rolling.
    between : tuple of (str, str)
        The first and the second.
    contacts : tuple of str
    """

    points: Array
    directions: Array
    forces: Array
    torques: Array
    between: tuple[tuple[str, str], ...]
    contacts: tuple[str, ...]


class Rubbing(NamedTuple):
    """The law of a friction force: the contact that presses, the kind, how many components."""

    contact: str
    kind: str
    rows: int


@dataclass(frozen=True, eq=False)
class FrictionTable(Value):
    """Friction forces of all recorded instants; those that are zero are left out.

    Attributes
    ----------
    whole : (n, 4) array of int
        Instant, ascending, bodies (-1: none) and law of each.
    forces : (n, 2) array
        Components; zero where there is one only.
    """

    whole: NDArray[np.int64] = field(default_factory=lambda: np.zeros((0, 4), dtype=np.int64))
    forces: Array = field(default_factory=lambda: np.zeros((0, 2)))

    def at(
        self, instant: int, laws: Sequence[Rubbing]
    ) -> dict[tuple[tuple[int, ...], str], dict[str, tuple[float, ...]]]:
        """Return by bodies and contact the components of each kind at an instant."""
        rows = slice(*np.searchsorted(self.whole[:, 0], [instant, instant + 1]))
        found: dict[tuple[tuple[int, ...], str], dict[str, tuple[float, ...]]] = {}
        pairs = zip(self.whole[rows].tolist(), self.forces[rows].tolist(), strict=True)
        for (_, i, j, which), components in pairs:
            law = laws[which]
            kinds = found.setdefault(((i,) if j < 0 else (i, j), law.contact), {})
            kinds[law.kind] = (*kinds.get(law.kind, ()), *components[: law.rows])
        return found


def friction_table(parts: Iterable[FrictionTable]) -> FrictionTable:
    """Return tables one after the other."""
    empty = FrictionTable()
    every = [empty, *parts]
    return FrictionTable(
        np.concatenate([part.whole for part in every]),
        np.concatenate([part.forces for part in every]),
    )


def overlapping(scene: Scene | None, called: str, contact: str, i: int) -> str:
    """Return what overlaps at a contact of a body with the surroundings, for a message."""
    parties = () if scene is None else scene.parties((i,), contact)
    if scene is None or not parties:
        return f"contact {contact!r}{called and f' of {called}'} overlaps"
    one, two = parties
    if two in scene.walls:
        return f"body {one!r} and wall {two!r} overlap"
    return f"bodies {one!r} and {two!r} overlap"
