"""Diagrams of equilibria over a parameter: arcs, and the events at which they end."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum

import numpy as np

from polycorner import checks
from polycorner.kinds import checked
from polycorner.minimisation.certificate import Certificate
from polycorner.minimisation.methods import stationary_on
from polycorner.minimisation.parametric import problem_with
from polycorner.minimisation.problem import Problem
from polycorner.printing import Printed, Sheet, listed, number
from polycorner.spaces.manifold import Array
from polycorner.values import Checked


class BranchKind(Enum):
    """What happens to an equilibrium at a value of the parameter; the value is a sentence."""

    OPENS = "a contact opens and the equilibrium persists"
    CLOSES = "a contact closes and the equilibrium persists"
    EXCHANGE = "one contact is exchanged for another and the equilibrium persists"
    CORNER_LIMIT = "two equilibria that differ by contacts meet there, and none is beyond"
    FOLD = "two equilibria of one face meet there, and none is beyond"
    BRANCH = "several curves of equilibria cross there"
    DEPENDENT = "the active gradients become dependent: no equilibrium of the energy is beyond"
    VANISHES = "a component of the polyhedron shrinks to a point there"
    RE_ENTRANT = "another piece of the polyhedron begins there, along which the energy falls"
    END = "the interval of the parameter ends"
    FAR = "the curve leaves the extent that was asked for"
    UNDECIDED = "what happens there is not decided"


@dataclass(frozen=True, eq=False)
class BranchEvent(Checked):
    """A point at which arcs of equilibria end.

    Attributes
    ----------
    kind : BranchKind
    parameter : float
        Its value there.
    point : (n,) array
    before, after : tuple of str
        The active functions on the arc that came first and on that which leaves; the same where
        none leaves.
    functions : tuple of str
        What vanishes there beside the functions of the arc: gaps that close, multipliers that
        vanish.
    arcs : tuple of int
        Numbers of the arcs that end there.
    note : str
        What is not decided, and why.
    """

    kind: BranchKind
    parameter: float
    point: Array
    before: tuple[str, ...]
    after: tuple[str, ...]
    functions: tuple[str, ...]
    arcs: tuple[int, ...]
    note: str = ""


@dataclass(frozen=True, eq=False)
class Arc(Checked):
    """A curve of equilibria along which the parameter is monotone and the active set the same.

    Attributes
    ----------
    active : tuple of str
    parameters : (k,) array
        Ascending.
    points : (k, n) array
        Coordinates, not wrapped.
    multipliers : dict from str to (k,) array
        ``dE/df`` of the active functions and the equations.
    energies : (k,) array
    index : int
        Number of independent directions along the face in which the energy falls.
    events : (int, int)
        Numbers of the events at which it begins and ends.
    """

    active: tuple[str, ...]
    parameters: Array
    points: Array
    multipliers: dict[str, Array]
    energies: Array
    index: int
    events: tuple[int, int]

    def at(self, value: float) -> Array:
        """Return the point at a value of the parameter, by linear interpolation, ``(n,)``."""
        columns = self.points.T
        return np.array([np.interp(value, self.parameters, column) for column in columns])

    @property
    def stable(self) -> bool:
        """Whether its points are strict minima, modulo continuous symmetries."""
        return self.index == 0


@dataclass(frozen=True, eq=False)
class Diagram(Checked, Printed):
    """Equilibria over an interval of a parameter; see :func:`branches`.

    Attributes
    ----------
    problem : Problem
        At the value of the parameter of the first certificate.
    parameter : str
        Its name.
    rates : mapping from str to float
        Derivatives of the formulas' parameters by it.
    value : float
        That of the problem.
    interval : (float, float)
    arcs : tuple of Arc
    events : tuple of BranchEvent
        In the order of the parameter.
    closed : bool
        Whether every arc was followed to its ends, and all that leave events were followed.
        Nothing is said of curves that are not connected with the start.
    """

    problem: Problem
    parameter: str
    rates: Mapping[str, float]
    value: float
    interval: tuple[float, float]
    arcs: tuple[Arc, ...]
    events: tuple[BranchEvent, ...]
    closed: bool

    @checked
    def at(self, value: float) -> list[Certificate]:
        """Return the equilibria of all arcs at a value of the parameter.

        Raises
        ------
        ValueError
            For a value that is not in the interval.
        """
        low, high = self.interval
        checks.real("value", value, least=low, most=high)
        problem = self.problem_at(value)
        found = []
        for arc in self.arcs:
            if arc.parameters[0] <= value <= arc.parameters[-1]:
                d, energy = problem.polyhedron, problem.energy
                found.append(stationary_on(d, energy, arc.at(value), arc.active))
        return found

    def problem_at(self, value: float) -> Problem:
        """Return the problem at a value of the parameter."""
        moved = value - self.value
        known = self.problem.parameter_values
        values = {name: next(iter(known[name])) + rate * moved for name, rate in self.rates.items()}
        return problem_with(self.problem, values)

    def __repr__(self) -> str:
        """Return the numbers of arcs and events in one line."""
        low, high = self.interval
        span = f"{self.parameter} from {low:g} to {high:g}"
        return f"Diagram({len(self.arcs)} arcs, {len(self.events)} events; {span})"

    def _sheet(self) -> Sheet:
        arcs = [
            (
                str(k),
                f"{number(arc.parameters[0], 6)} to {number(arc.parameters[-1], 6)}",
                ", ".join(arc.active) or "nothing",
                "minimum" if arc.stable else f"index {arc.index}",
            )
            for k, arc in enumerate(self.arcs)
        ]
        events = [
            (number(e.parameter, 9), e.kind.name, ", ".join(e.functions), str(e.arcs)[1:-1])
            for e in self.events
        ]
        return Sheet(
            repr(self),
            (
                listed("Arcs", ("arc", self.parameter, "active", "kind"), arcs, len(arcs)),
                listed("Events", (self.parameter, "kind", "vanish", "arcs"), events, len(events)),
            ),
        )
