"""Ties of bodies as the engine needs to know of them."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from polycorner.formulas.families import Family
from polycorner.motion.convex_sets import ConvexSet
from polycorner.spaces.manifold import Array
from polycorner.values import Value, cached_property

WORLD = -1  # in place of a second body
MOST_CLOSED = 64  # equations of ties up to which it is asked which follow from others


@dataclass(frozen=True)
class TieFriction(Value):
    """One friction contact of a tie.

    Attributes
    ----------
    rows : int
        Components of its slip velocity, 1 or 2.
    static, dynamic : ConvexSet
        Admissible forces per unit load while it sticks and while it slips.
    pressing : int
        Number of the limit or equation whose force is the load, or -1: the load is known.
    cause : str
        Cause under which its dissipation is booked.
    """

    rows: int
    static: ConvexSet
    dynamic: ConvexSet
    pressing: int
    cause: str


@dataclass(frozen=True, eq=False)
class TieForm(Value):
    """What many ties have in common: formulas of the coordinates of two bodies, and of the time.

    Attributes
    ----------
    rows : Family
        Limits, then equations, as functions of the coordinates of both bodies and of the time.
    limits : int
        Number of the limits.
    slips : Family or None
        Slip velocities, friction after friction; variables: the coordinates of both bodies, their
        velocities, the time.
    friction : tuple of TieFriction
    forces : Family or None
        Functions of the same variables: all forces on both bodies (2k), those of them that are
        applied (2k), and for each friction contact its known load.
    energy : Family or None
        The potential energy, of the same variables as ``rows``.
    driven, damped, timed : bool
        Whether equations depend on the time, whether forces depend on velocities, and whether
        anything depends on the time.
    """

    rows: Family
    limits: int
    slips: Family | None
    friction: tuple[TieFriction, ...]
    forces: Family | None
    energy: Family | None
    driven: bool
    damped: bool
    timed: bool


@dataclass(frozen=True)
class TiedBodies(Value):
    """Bodies that hang together by ties.

    Attributes
    ----------
    bodies, ties : tuple of int
        Their numbers.
    equations : int
        How many the ties have.
    closed : bool
        Whether it is asked in each step which of them follow from others: in closed loops that are
        not very large.
    """

    bodies: tuple[int, ...]
    ties: tuple[int, ...]
    equations: int
    closed: bool


@dataclass(frozen=True, eq=False)
class Ties(Value):
    """Ties of two bodies, or of a body and the world.

    Attributes
    ----------
    forms : tuple of TieForm
    form : tuple of int
        Which of them each tie has.
    bodies : tuple of (int, int)
        The bodies of each; the second is :data:`WORLD`, -1, for the world.
    parameters : tuple of tuple of float
        Values of the parameters of each.
    names : tuple of str
        Names of limits and equations, tie after tie.
    restitution : tuple of float
        Of each of these.
    apart : tuple of (int, int)
        Bodies that do not touch each other.
    """

    forms: tuple[TieForm, ...] = ()
    form: tuple[int, ...] = ()
    bodies: tuple[tuple[int, int], ...] = ()
    parameters: tuple[tuple[float, ...], ...] = ()
    names: tuple[str, ...] = ()
    restitution: tuple[float, ...] = ()
    apart: tuple[tuple[int, int], ...] = ()

    @property
    def friction(self) -> tuple[TieFriction, ...]:
        """The friction contacts, tie after tie."""
        return tuple(f for form in self.form for f in self.forms[form].friction)

    @property
    def row_starts(self) -> NDArray[np.int64]:
        """First limit of each tie among :attr:`names`, and one more."""
        return np.cumsum([0, *(len(self.forms[form].rows.names) for form in self.form)])

    @property
    def most_rows(self) -> int:
        """The most limits and equations of one tie."""
        return max((len(form.rows.names) for form in self.forms), default=0)

    @property
    def drives(self) -> bool:
        """Whether equations depend on the time, so that their forces do work."""
        return any(form.driven for form in self.forms)

    def energy(self, q: Array) -> float:
        """Return the potential energy of all ties at the placements ``(N, k)`` of all bodies."""
        return sum(float(values.sum()) for _, (values,) in self.evaluate("energy", q))

    def evaluate(
        self, what: str, q: Array, v: Array | None = None, time: float = 0.0, order: int = 0
    ) -> Iterator[tuple[list[int], tuple[Array, ...]]]:
        """Yield ties of one form, and the values of one of its families, with derivatives.

        ``q`` and, for slips and forces, ``v`` are those of all bodies, ``(N, k)``.
        """
        for number, form in enumerate(self.forms):
            which = [t for t, other in enumerate(self.form) if other == number]
            family: Family | None = getattr(form, what)
            if family is None or not family.names:
                continue
            bodies = np.array([self.bodies[t] for t in which])
            columns = [self._sides(values, bodies) for values in (q, v) if values is not None]
            inputs = np.column_stack([*columns, np.full(len(which), time)])
            numbers = np.array([*(x for t in which for x in self.parameters[t]), 0.0])
            period = len(which) if family.parameters else 1
            yield which, family.kernel.over(inputs, numbers.ctypes.data, order, period)

    @staticmethod
    def _sides(values: Array, bodies: NDArray[np.int64]) -> Array:
        """Return what both bodies of ties have, ``(J, 2k)``; zeros for the world."""
        second = np.where(bodies[:, 1:] >= 0, values[bodies[:, 1]], 0.0)
        return np.concatenate([values[bodies[:, 0]], second], axis=1)

    @cached_property
    def components(self) -> tuple[TiedBodies, ...]:
        """Bodies that hang together by ties."""
        root: dict[int, int] = {}
        for i, j in self.bodies:
            _unite(root, i, i if j < 0 else j)
        members: dict[int, list[int]] = {}
        for i in sorted(root):
            members.setdefault(_first(root, i), []).append(i)
        ties: dict[int, list[int]] = {first: [] for first in members}
        for t, (i, _) in enumerate(self.bodies):
            ties[_first(root, i)].append(t)
        return tuple(self._component(members[first], ties[first]) for first in members)

    def _component(self, bodies: list[int], ties: list[int]) -> TiedBodies:
        """Return a component; it is closed if joints, also those to the world, make a loop."""
        forms = {t: self.forms[self.form[t]] for t in ties}
        rows = {t: len(form.rows.names) - form.limits for t, form in forms.items()}
        root: dict[int, int] = {}
        loops = [not _unite(root, *self.bodies[t]) for t in ties if rows[t]]
        equations = sum(rows.values())
        closed = any(loops) and equations <= MOST_CLOSED
        return TiedBodies(tuple(bodies), tuple(ties), equations, closed)

    def closed_room(self, k: int, own: int) -> int:
        """Return the room for gradients of a closed component; each body has ``own`` equations."""
        return max(
            (
                (c.equations + own * len(c.bodies)) * len(c.bodies) * k
                for c in self.components
                if c.closed
            ),
            default=0,
        )


def _first(root: dict[int, int], i: int) -> int:
    """Return the representative of a number in a union-find forest."""
    while root.setdefault(i, i) != i:
        i = root[i]
    return i


def _unite(root: dict[int, int], i: int, j: int) -> bool:
    """Unite the sets of two numbers; return whether they were apart."""
    one, two = _first(root, i), _first(root, j)
    root[max(one, two)] = min(one, two)
    return one != two


NO_TIES = Ties()
