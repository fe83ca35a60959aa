"""Hysteresis: the way of a quasi-static system as its parameter goes up and down.

Where a parameter changes slowly, a system without inertia that follows the gradient flow of its
energy stays at a strict minimum while there is one; where a stable arc ends it falls, at a fixed
parameter, along the curve of steepest descent that leaves the end ([Zanini] for folds), here in
scale units.  The way does not depend on the rate at which the parameter changes.

*Energies.*  Along an arc of the face ``A`` the energy changes by ``dE/dt = E_t - sum lam_i f_i,t``,
derivatives by the parameter at a fixed point: what drives the parameter does this work, on a load
or by moving walls.  In a jump the energy falls by what is released.  After a closed loop the energy
is what it was, so that the work, the area of the loop in the plane of the parameter and ``dE/dt``,
is the sum of the energies released.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from polycorner import checks
from polycorner.branches.diagram import Arc, BranchEvent, BranchKind, Diagram, spline
from polycorner.branches.search import branches
from polycorner.kinds import checked
from polycorner.landscapes.steepest import MOST, steepest
from polycorner.minimisation.certificate import Certificate
from polycorner.minimisation.methods import minimise, stationary_on
from polycorner.minimisation.parametric import lifted_problem
from polycorner.minimisation.problem import Problem
from polycorner.polyhedra.quotients import WalkOptions
from polycorner.polyhedra.symmetry import Symmetry
from polycorner.printing import Printed, Sheet, listed, number
from polycorner.progress import Progress, silent
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT
from polycorner.values import Checked, cached_property

# Ends of arcs from which a system does not fall, and why.
LAST = {
    BranchKind.VANISHES: "the component of the set vanishes there",
    BranchKind.FAR: "the arc was not followed farther",
    BranchKind.END: "the diagram ends there",
}


@dataclass(frozen=True, eq=False)
class Leg(Checked):
    """A part of a stable arc, in the order in which it is passed.

    Attributes
    ----------
    diagram, arc : int
        Numbers of the diagram and of the arc in it.
    active : tuple of str
    parameters : (k,) array
        Monotone.
    points : (k, n) array
        Coordinates, not wrapped.
    energies : (k,) array
    forces : (k,) array
        ``dE/dt`` along the arc: what resists the change of the parameter.
    """

    diagram: int
    arc: int
    active: tuple[str, ...]
    parameters: Array
    points: Array
    energies: Array
    forces: Array

    @cached_property
    def work(self) -> float:
        """The integral of ``dE/dt`` over the parameter, by cubic splines along the arc."""
        # Over the length of the curve forces are smooth, also where the parameter turns.
        curve = spline(self.parameters, self.forces, self.points)
        nodes, weights = np.polynomial.legendre.leggauss(3)  # exact for two cubics
        half = np.diff(curve.x)[:, None] / 2
        places = curve.x[:-1, None] + half * (1 + nodes)
        t, force = curve(places, 1)[..., 0], curve(places)[..., 1]
        return float((half * weights * force * t).sum())


@dataclass(frozen=True, eq=False)
class Jump(Checked):
    """A fall into another minimum.

    Attributes
    ----------
    parameter : float
    kind : BranchKind
        What ends the arc that is left.
    start, end : (n,) array
    before, after : tuple of str
        The active functions.
    energies : (float, float)
        Before and after.
    """

    parameter: float
    kind: BranchKind
    start: Array
    end: Array
    before: tuple[str, ...]
    after: tuple[str, ...]
    energies: tuple[float, float]

    @property
    def released(self) -> float:
        """By how much the energy falls."""
        return self.energies[0] - self.energies[1]


@dataclass(frozen=True, eq=False, repr=False)
class Hysteresis(Checked, Printed):
    """The way of a quasi-static system; see :func:`hysteresis`.

    Attributes
    ----------
    diagrams : tuple of Diagram
        The one that was given, and those of minima that are not connected with it.
    legs : tuple of Leg
    jumps : tuple of Jump
    closed : bool
        Whether the way ends where it began.
    note : str
        Why it ends before the last value of the parameter, if it does.
    """

    diagrams: tuple[Diagram, ...]
    legs: tuple[Leg, ...]
    jumps: tuple[Jump, ...]
    closed: bool
    note: str = ""

    @property
    def released(self) -> float:
        """The sum of the energies that the jumps release."""
        return math.fsum(jump.released for jump in self.jumps)

    @property
    def work(self) -> float:
        """The work of what drives the parameter: the area of a closed loop.

        The sum of :attr:`Leg.work`; of a closed loop it equals :attr:`released`, to within the
        error of the splines.
        """
        return math.fsum(leg.work for leg in self.legs)

    def __repr__(self) -> str:
        """Return the energy that is released in one line."""
        words = "closed" if self.closed else "not closed"
        return f"Hysteresis({len(self.jumps)} jumps, {self.released:g} released; {words})"

    def _sheet(self) -> Sheet:
        name = self.diagrams[0].parameter
        rows = [
            (
                number(jump.parameter, 9),
                jump.kind.name,
                ", ".join(jump.before) or "nothing",
                ", ".join(jump.after) or "nothing",
                number(jump.released, 9),
            )
            for jump in self.jumps
        ]
        head = (name, "end of the arc", "active before", "after", "released")
        parts = [listed("Jumps", head, rows, len(rows), (0, 4))]
        words = f"Work done: {number(self.work, 9)}; released: {number(self.released, 9)}."
        ended = f"It ends early: {self.note}." if self.note else ""
        return Sheet(repr(self), (*parts, words, *filter(None, [ended])))


@dataclass
class _Way:
    """A way in the making."""

    diagrams: list[Diagram]
    symmetry: Symmetry
    beyond: float
    stride: float
    options: WalkOptions | None
    extent: float
    between: int
    progress: Progress
    lifted: Problem
    k: int = 0
    j: int = 0
    value: float = 0.0
    point: Array = field(default_factory=lambda: np.zeros(0))
    legs: list[Leg] = field(default_factory=list)
    jumps: list[Jump] = field(default_factory=list)
    note: str = ""

    @property
    def diagram(self) -> Diagram:
        return self.diagrams[self.k]

    @property
    def arc(self) -> Arc:
        return self.diagram.arcs[self.j]

    def place(self, k: int, j: int, value: float) -> Array:
        """Return the point of an arc at a value of the parameter, not wrapped."""
        diagram, arc = self.diagrams[k], self.diagrams[k].arcs[j]
        same = np.flatnonzero(arc.parameters == value)
        if same.size:
            return np.array(arc.points[same[0]])
        near, problem = arc.at(value), diagram.problem_at(value)
        found = stationary_on(problem.polyhedron, problem.energy, near, arc.active)
        return near + problem.polyhedron.manifold.difference(found.point, near)

    def apart(self, p: Array, q: Array) -> float:
        return self.symmetry.separation(self.diagram.problem.polyhedron.manifold, p, q)

    def stand(self, k: int, j: int, value: float) -> None:
        self.k, self.j, self.value, self.point = k, j, value, self.place(k, j, value)

    def go(self, value: float) -> None:
        """Move along the arc, and list points of it that are dense enough for splines."""
        curve, first = self.arc.curve, self.value
        knots, more = curve.x, self.between + 1
        s = np.interp(np.arange(more * (len(knots) - 1)) / more, np.arange(len(knots)), knots)
        t = curve(s)[:, 0]
        t = np.unique([first, *t[(t - first) * (value - t) > 0], value])
        parameters = t if value > first else t[::-1]
        inner = [self.place(self.k, self.j, float(at)) for at in parameters[1:-1]]
        start, self.value, self.point = self.point, value, self.place(self.k, self.j, value)
        points = np.array([start, *inner, self.point])
        told = [self._told(*at) for at in zip(parameters, points, strict=True)]
        energies, forces = np.array(told).T
        active = self.arc.active
        self.legs.append(Leg(self.k, self.j, active, parameters, points, energies, forces))
        self.progress(len(self.legs), None, f"{self.diagram.parameter} = {value:g}")

    def _told(self, value: float, point: Array) -> tuple[float, float]:
        """Return the energy of a point of the arc, and its derivative along the arc."""
        diagram, n = self.diagram, len(point)
        values = diagram.values_at(value)
        at = np.concatenate([point, [*values.values()]])
        found, slopes, *_ = self.lifted.evaluate(at, 1)
        functions, rates = self.lifted.functions, np.array([*diagram.rates.values()])
        m = self.lifted.inequalities
        held = [i for i, f in enumerate(functions[:-1]) if i >= m or f.name in self.arc.active]
        scales, by_t = diagram.problem.scales, slopes[:, n:] @ rates
        rows = slopes[held, :n] * scales
        lam = np.linalg.lstsq(rows.T, slopes[-1, :n] * scales, rcond=None)[0]
        return float(found[-1]), float(by_t[-1] - lam @ by_t[held])

    def move(self, target: float) -> bool:
        """Move until the parameter has a value; return whether that is reached."""
        side = 1 if target > self.value else -1
        while True:
            arc = self.arc
            last = float(arc.parameters[-1 if side > 0 else 0])
            if (target - last) * side <= 0:
                self.go(target)
                return True
            if last != self.value:
                self.go(last)
            k = arc.events[1 if side > 0 else 0]
            event = self.diagram.events[k] if k >= 0 else None
            onward = [
                j
                for j in (event.arcs if event else ())
                if self.diagram.arcs[j].stable
                and self.diagram.arcs[j].events[0 if side > 0 else 1] == k
            ]
            if len(onward) == 1:
                self.stand(self.k, onward[0], last)
            elif not self.fall(event, side, abs(target - last)):
                return False

    def fall(self, event: BranchEvent | None, side: int, room: float) -> bool:
        """Fall from the end of an arc into the next minimum; return whether its arc is found."""
        kind, before = (event.kind if event else BranchKind.FAR), self.arc
        if kind in LAST:
            self.note = LAST[kind]
            return False
        there, start, left = self.value, self.point, before.energies
        low, high = self.diagram.interval
        value = there + side * min(self.beyond * (high - low), room)
        found = self._descended(value, start)
        energy = float(left[-1 if side > 0 else 0])
        if not found.is_minimum:
            self.note = f"a descent ends in no minimum: {found.verdict.value}"
            return False
        landing = self._arc_of(found, value)
        if landing is None:
            end, after, low = found.point, found.active, found.energy
        else:
            k, j = landing
            arc = self.diagrams[k].arcs[j]
            there = float(np.clip(there, *arc.parameters[[0, -1]]))
            self.stand(k, j, there)
            end, after = self.point, arc.active
            low = self._told(there, end)[0]
        goes_on = self.apart(start, end) <= DEFAULT.near
        if not goes_on:
            self.jumps.append(Jump(there, kind, start, end, before.active, after, (energy, low)))
        return landing is not None

    def _descended(self, value: float, start: Array) -> Certificate:
        problem, point = self.diagram.problem_at(value), start
        # Short steps first, while the slope is small and valleys are narrow: all those of one
        # length together are as long as one of the next.
        finer = math.sqrt(self.beyond)
        for stride, most in ((finer**2, 1 / finer), (finer, 1 / finer), (1.0, MOST)):
            way = steepest(problem, point, stride * self.stride, math.ceil(most), whole=True)
            point = [point, *way][-1]
        return minimise(problem.polyhedron, problem.energy, point)

    def _arc_of(self, found: Certificate, value: float) -> tuple[int, int] | None:
        """Return the diagram and the arc of a minimum, followed if it is not known; or None."""
        known = self._known(found, value, 0)
        if known is None:
            of = self.diagram
            low, high = of.interval
            try:
                new = branches(
                    found, of.rates, (low - value, high - value),
                    symmetry=self.symmetry, extent=self.extent, options=self.options,
                ).named(of.parameter, value)  # fmt: skip
            except ValueError as error:
                self.note = f"the equilibrium after the jump is not followed: {error}"
                return None
            self.diagrams.append(new)
            known = self._known(found, value, len(self.diagrams) - 1)
            if known is None:
                self.diagrams.pop()
                self.note = "the minimum after the jump is not isolated, or its arc is not found"
        return known

    def _known(self, found: Certificate, value: float, first: int) -> tuple[int, int] | None:
        strong = {*found.active} - {found.problem.polyhedron.names[i] for i in found.found.weak}
        for k in range(first, len(self.diagrams)):
            for j, arc in enumerate(self.diagrams[k].arcs):
                low, high = arc.parameters[[0, -1]]
                held = arc.stable and {*arc.active} == strong and low <= value <= high
                if held and self.apart(self.place(k, j, value), found.point) <= DEFAULT.near:
                    return k, j
        return None


@checked
def hysteresis(  # noqa: PLR0913 - keywords of one way
    diagram: Diagram,
    path: Sequence[float] | None = None,
    *,
    start: ArrayLike | None = None,
    symmetry: Symmetry | None = None,
    beyond: float = 1e-4,
    stride: float = 0.02,
    between: int = 3,
    extent: float = math.inf,
    options: WalkOptions | None = None,
    progress: Progress = silent,
) -> Hysteresis:
    """Follow a quasi-static system as the parameter goes through given values, up and down.

    It moves along stable arcs.  Where one ends, and not exactly one stable arc goes on, the system
    falls at a fixed parameter: by steepest descent in scale units, in short steps, from the end of
    the arc with the parameter slightly beyond it; :func:`~polycorner.minimise`, whose own
    steps are long and may lead elsewhere, only finishes it near the next minimum.  Where this lies
    on no arc that is known its arcs are followed, too.  Where two minima leave symmetrically,
    rounding decides between them.

    Parameters
    ----------
    diagram : Diagram
        The equilibria that :func:`branches` found.
    path : sequence of float, optional
        Values of the parameter between which it is monotone; default from the start of the
        diagram's interval to its end, and back.
    start : (n,) array, optional
        A point near the minimum in which the system begins; default the lowest one.
    symmetry : Symmetry, optional
        As for :func:`branches`.
    beyond : float, optional
        Part of the interval by which the parameter goes beyond an event before the system falls,
        and the first steps of its fall as a part of ``stride``.
    stride : float, optional
        Longest step of a fall, in scale units.
    between : int, optional
        Points of a leg between each two of its arc, which make :attr:`Hysteresis.work` exact.
    extent, options : optional
        As for :func:`branches`.
    progress : callable, optional
        Told the number of legs, and the value of the parameter.

    Returns
    -------
    Hysteresis

    Raises
    ------
    TypeError, ValueError
        Naming the argument, what was expected and what came.

    Examples
    --------
    A ball in a double well that leans by ``t`` falls where a well ends, at ``t = +-2 / 3^(3/2)``,
    and releases an energy of 3/4 each time:

    >>> import sympy
    >>> from polycorner import Manifold, Polyhedron, SmoothFunction, minimise
    >>> from polycorner.branches import branches, hysteresis
    >>> M = Manifold.euclidean("x")
    >>> (x,) = M.symbols
    >>> t = sympy.Symbol("t")
    >>> well = SmoothFunction("E", x**4 / 4 - x**2 / 2 - t * x, M, parameters={"t": -0.6})
    >>> c = minimise(Polyhedron(M, {"far": x + 9}), well, [-1.0])
    >>> loop = hysteresis(branches(c, "t", (-0.6, 0.6)))
    >>> [(round(jump.parameter, 6), round(jump.released, 6)) for jump in loop.jumps], loop.closed
    ([(0.3849, 0.75), (-0.3849, 0.75)], True)
    """
    values = _path(diagram, path)
    checks.real("beyond", beyond, above=0, below=1)
    checks.real("stride", stride, above=0)
    checks.real("extent", extent, above=0, infinite=True)
    checks.whole("between", between, least=0)
    lifted = lifted_problem(diagram.problem, tuple(diagram.rates))
    chosen = symmetry or Symmetry()
    way = _Way([diagram], chosen, beyond, stride, options, extent, between, progress, lifted)
    way.stand(0, _first(way, values[0], start), values[0])
    first = way.j, way.point
    done = all(way.move(value) for value in values[1:])
    closed = done and values[0] == values[-1] and (way.k, way.j) == (0, first[0])
    return Hysteresis(
        diagrams=tuple(way.diagrams),
        legs=tuple(way.legs),
        jumps=tuple(way.jumps),
        closed=closed and way.apart(first[1], way.point) <= DEFAULT.near,
        note=way.note,
    )


def _path(diagram: Diagram, path: Sequence[float] | None) -> list[float]:
    low, high = diagram.interval
    if path is None:
        return [low, high, low]
    expected = f"two or more values from {low:g} to {high:g}, each other than the one before"
    values = checks.numbers("path", path, expected)
    inside = (values >= low) & (values <= high)
    if values.ndim != 1 or len(values) < 2 or not inside.all() or not np.diff(values).all():
        checks.refuse("path", expected, path)
    return [float(value) for value in values]


def _first(way: _Way, value: float, start: ArrayLike | None) -> int:
    """Return the number of the stable arc from which a way begins."""
    arcs = way.diagram.arcs
    there = [
        j for j, a in enumerate(arcs) if a.stable and a.parameters[0] <= value <= a.parameters[-1]
    ]
    if not there:
        checks.refuse("path", "a first value at which an arc is stable", value)
    if start is None:
        return min(
            there, key=lambda j: float(np.interp(value, arcs[j].parameters, arcs[j].energies))
        )
    q = way.diagram.problem.polyhedron.manifold.point(start, "start")
    return min(there, key=lambda j: way.apart(way.place(0, j, value), q))
