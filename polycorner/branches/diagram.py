"""Diagrams of equilibria over a parameter: arcs, and the events at which they end."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from polycorner import checks
from polycorner.kinds import checked
from polycorner.minimisation.certificate import Certificate
from polycorner.minimisation.methods import stationary_on
from polycorner.minimisation.parametric import problem_with
from polycorner.minimisation.problem import Problem
from polycorner.printing import Printed, Sheet, few, listed, number
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT
from polycorner.values import Checked, cached_property


class BranchKind(Enum):
    """What happens to an equilibrium at a value of the parameter; the value is a sentence."""

    OPENS = "a contact opens and the equilibrium persists"
    CLOSES = "a contact closes and the equilibrium persists"
    EXCHANGE = "contacts are exchanged for as many others and the equilibrium persists"
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

    @checked
    def at(self, value: float) -> Array:
        """Return the point at a value of the parameter, by interpolation, ``(n,)``."""
        checks.real("value", value)
        curve = self.curve
        t = curve(curve.x)[:, 0]
        i = min(max(int(np.searchsorted(t, value)), 1), len(t) - 1)
        low, high = curve.x[i - 1 : i + 1]
        if not t[i - 1] < value < t[i]:
            return np.array(curve(low if value <= t[i - 1] else high)[2:])
        return np.array(curve(brentq(lambda s: float(curve(s)[0]) - value, low, high))[2:])

    @cached_property
    def curve(self) -> CubicSpline:
        """Parameter, energy and point over the length of the arc."""
        return spline(self.parameters, self.energies, self.points)

    @property
    def stable(self) -> bool:
        """Whether its points are strict minima, modulo continuous symmetries."""
        return self.index == 0


def spline(parameters: Array, values: Array, points: Array) -> CubicSpline:
    """Return parameters, values ``(k,)`` and points ``(k, n)`` over the length of a polyline.

    In the lengths the parameter and each coordinate count in units of their ranges, so that the
    spline is smooth also where the parameter turns.
    """
    columns = np.column_stack([parameters, points])
    size, least = np.ptp(columns, axis=0), DEFAULT.alike * abs(points).max()
    moved = size > np.append(0.0, np.full(points.shape[1], least))  # others are rounding
    steps = np.linalg.norm(np.diff(columns[:, moved] / size[moved], axis=0), axis=1)
    # Arcs have points twice where two courses meet.
    apart = np.concatenate([[True], steps > DEFAULT.settled])
    lengths = np.concatenate([[0.0], np.cumsum(steps)])
    return CubicSpline(lengths[apart], np.column_stack([parameters, values, points])[apart])


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

    @checked
    def values_at(self, value: float) -> dict[str, float]:
        """Return the values of the formulas' parameters at a value of the parameter."""
        moved, known = checks.real("value", value) - self.value, self.problem.parameter_values
        return {name: next(iter(known[name])) + rate * moved for name, rate in self.rates.items()}

    @checked
    def problem_at(self, value: float) -> Problem:
        """Return the problem at a value of the parameter."""
        return problem_with(self.problem, self.values_at(value))

    @checked
    def named(self, parameter: str, value: float) -> "Diagram":
        """Return the diagram over a parameter of another name, with a value at the problem.

        As where a size changes several parameters of the formulas, of which a diagram tells the
        change.
        """
        checks.real("value", value)
        by = value - self.value
        return replace(
            self,
            parameter=parameter,
            value=value,
            interval=(self.interval[0] + by, self.interval[1] + by),
            arcs=tuple(replace(arc, parameters=arc.parameters + by) for arc in self.arcs),
            events=tuple(replace(e, parameter=e.parameter + by) for e in self.events),
        )

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
                few(arc.active) if arc.active else "nothing",
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
