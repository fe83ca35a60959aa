"""Descriptions of bodies and of their contacts: what the engine needs to know of a system."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from polycorner.formulas.bundles import Call
from polycorner.formulas.families import Family
from polycorner.motion.convex_sets import ConvexSet
from polycorner.motion.formulation import Formulation
from polycorner.spaces.manifold import Array
from polycorner.values import Value

# Causes of dissipation.
IMPACT = "impact"
RUBBING = "rubbing"


@dataclass(frozen=True)
class FrictionContact(Value):
    """One friction contact of a body.

    Attributes
    ----------
    name : str
    rows : int
        Components of its slip velocity, 1 or 2.
    static, dynamic : ConvexSet
        Admissible forces per unit load while it sticks and while it slips.
    gap : int
        Number of the contact or equation whose force is the load, or -1: the load is known.
    loads : tuple of int
        Numbers of the known loads whose sum is the load; empty if a contact presses.
    cause : str
        Cause under which its dissipation is booked.
    """

    name: str
    rows: int
    static: ConvexSet
    dynamic: ConvexSet
    gap: int
    loads: tuple[int, ...]
    cause: str


@dataclass(frozen=True, eq=False)
class MovingBody(Value):
    """One body, or a whole system that is not repeated.

    Attributes
    ----------
    formulation, parameters
        Its equations of motion and the values of their parameters.
    friction : tuple of FrictionContact
    gaps : sequence of Call
        Kernels of the gaps between the body and its surroundings.
    contacts : tuple of str
        Names of these gaps, of the equations last.
    restitution : (m,) array
        Coefficient of restitution of each of them.
    units : (k,) array
        Length that a unit of each coordinate stands for; it turns velocities into speeds that can
        be compared.
    gap_unit : float
        Length by which gaps are scaled.
    equations : int
        How many of the gaps are equations: they remain zero, by forces of either sign.
    signals : Family, optional
        Functions of the time, computed once a step for all bodies.  Their values are the parameters
        of the formulation that follow the time.
    signal_parameters : array
        Values of the parameters of the signals.
    slow_signals : bool
        Whether they change as slowly as the substrate carries bodies, so that a body at rest need
        not be examined in every step.
    """

    formulation: Formulation
    parameters: Array
    friction: tuple[FrictionContact, ...]
    gaps: Sequence[Call]
    contacts: tuple[str, ...]
    restitution: Array
    units: Array
    gap_unit: float
    equations: int = 0
    signals: Family | None = None
    signal_parameters: Array = field(default_factory=lambda: np.empty(0))
    slow_signals: bool = False


@dataclass(frozen=True)
class PairLaw(Value):
    """One law of friction between bodies, which holds at each of their gaps.

    Attributes
    ----------
    rows : int
        Components of its slip velocity, 1 or 2.
    static, dynamic : ConvexSet
        Admissible forces per unit normal force while it sticks and while it slips.
    cause : str
        Cause under which its dissipation is booked.
    """

    rows: int
    static: ConvexSet
    dynamic: ConvexSet
    cause: str = RUBBING


@dataclass(frozen=True, eq=False)
class PairContacts(Value):
    """The contacts between any two of several identical bodies.

    Attributes
    ----------
    gaps : Family
        Gaps of a pair.
    parameters : sequence of float
    reads : tuple of (int, int)
        For each variable of the gaps the body, 0 or 1, and its coordinate.
    slips : tuple of (Family, bool, sequence of float)
        For each gap the slip velocities at its contact (the rows of all laws; variables: the
        coordinates that the gaps read, then all velocities of both bodies), whether the bodies
        are exchanged in them, and their parameters; empty without friction.
    laws : tuple of PairLaw
    restitution : float
    reach : float
        Distance of body positions beyond which two bodies cannot touch.
    """

    gaps: Family
    parameters: tuple[float, ...]
    reads: tuple[tuple[int, int], ...]
    slips: "tuple[tuple[Family, bool, tuple[float, ...]], ...]"
    laws: tuple[PairLaw, ...]
    restitution: float
    reach: float


@dataclass(frozen=True, eq=False)
class IdenticalBodies(Value):
    """``count`` identical bodies that may touch each other.

    Attributes
    ----------
    body : MovingBody
    count : int
    contacts : PairContacts, optional
        Contacts between the bodies; none by default.
    position : (int, int)
        The two coordinates that are a body's position.
    period : (float, float)
        After which the position repeats, as lengths; infinite if it does not.
    substrate_speed : float
        Speed of the substrate along the first of them, as a length per time.
    exit_coordinate, exit_limit : int, float
        A body leaves when this coordinate exceeds the limit; -1: never.
    causes : tuple of str
        Causes of dissipation.
    """

    body: MovingBody
    count: int = 1
    contacts: PairContacts | None = None
    position: tuple[int, int] = (0, 0)
    period: tuple[float, float] = (np.inf, np.inf)
    substrate_speed: float = 0.0
    exit_coordinate: int = -1
    exit_limit: float = 0.0
    causes: tuple[str, ...] = field(init=False)

    def __post_init__(self) -> None:
        causes = [IMPACT, *(contact.cause for contact in self.body.friction)]
        if self.contacts is not None:
            causes += [law.cause for law in self.contacts.laws]
        object.__setattr__(self, "causes", tuple(dict.fromkeys(causes)))
        super().__post_init__()

    @property
    def dimension(self) -> int:
        """Number of coordinates of one body, ``k``."""
        return len(self.body.formulation.coordinates)

    @property
    def pair_contacts(self) -> tuple[str, ...]:
        """Names of the contacts between two bodies."""
        return () if self.contacts is None else self.contacts.gaps.names

    @property
    def contact_names(self) -> tuple[str, ...]:
        """Names of all contacts: those of a body with its surroundings, then those of a pair."""
        return (*self.body.contacts, *self.pair_contacts)

    @property
    def formula_keys(self) -> list[str]:
        """Keys of all compiled formulas: they identify expressions to the last digit."""
        found = [self.body.formulation.key]
        if self.body.signals is not None:
            found.append(f"{self.body.signals.key} {self.body.signal_parameters.tolist()}")
        found += [f"{call.family.key} {call.parameters.tolist()}" for call in self.body.gaps]
        if self.contacts is not None:
            slips = [family.key for family, _, _ in self.contacts.slips]
            found += [self.contacts.gaps.key, *slips]
        return found

    def check_places(self, q: Array, v: Array, dt: float) -> None:
        """Raise ValueError where a body, now or a step later, is farther than numbers resolve gaps.

        That is where the next number is farther than the unit of gaps, or nowhere.
        """
        with np.errstate(all="ignore"):
            far = (abs(q) + dt * abs(v)) * self.body.units
            lost = np.argwhere(~(np.spacing(far) < self.body.gap_unit))
        if len(lost):
            i, c = lost[0].tolist()
            name = self.body.formulation.coordinates[c]
            msg = (
                f"state: expected coordinates that numbers resolve to {self.body.gap_unit:g}, the "
                f"unit of gaps, also a step later; got {name} = {q[i, c]:.6g} of body {i} with the "
                f"velocity {v[i, c]:.6g}"
            )
            raise ValueError(msg)

    def least_pair_gap(self, q: Array) -> tuple[float, tuple[int, int], str]:
        """Return the least gap between two bodies, the bodies, and the contact.

        Parameters
        ----------
        q : (count, k) array
            Placements of all bodies.

        Returns
        -------
        gap : float
            ``inf`` if no two bodies are near enough to touch.
        bodies : (int, int)
        contact : str
        """
        least = (np.inf, (0, 0), "")
        if self.contacts is None:
            return least
        family, reads = self.contacts.gaps, self.contacts.reads
        numbers = np.array([*self.contacts.parameters, 0.0])
        where = list(dict.fromkeys(self.position))
        positions = q[:, where] * self.body.units[where]
        periods = np.array(self.period)[-len(where) :]
        wraps = np.isfinite(periods)
        for i in range(self.count - 1):
            away = positions[i + 1 :] - positions[i]
            away[:, wraps] -= periods[wraps] * np.floor(away[:, wraps] / periods[wraps] + 0.5)
            apart = np.linalg.norm(away, axis=1)
            for j in (i + 1 + np.flatnonzero(apart < self.contacts.reach)).tolist():
                at = np.array([q[(i, j)[body], c] for body, c in reads])
                (values,) = family.kernel.at(at, numbers.ctypes.data, 0)
                worst = int(np.argmin(values))
                least = min(least, (float(values[worst]), (i, j), family.names[worst]))
        return least
