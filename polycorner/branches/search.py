"""The search for all arcs of equilibria that are connected with given ones."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from polycorner import checks
from polycorner.branches.continuation import Course, corrected
from polycorner.branches.diagram import Arc, BranchEvent, BranchKind, Diagram
from polycorner.branches.events import (
    TOLD,
    Event,
    event_at_end,
    flat_event,
    is_decided,
    kind_of,
    weak_event,
)
from polycorner.branches.network import Arm, Curve, Network
from polycorner.branches.posing import posed
from polycorner.branches.system import FritzJohn, FritzJohnSystem
from polycorner.kinds import checked
from polycorner.minimisation.certificate import Certificate
from polycorner.polyhedra.quotients import WalkOptions
from polycorner.polyhedra.symmetry import Symmetry
from polycorner.progress import Progress, silent
from polycorner.searches import Ending, work_through


class _BranchSearch(Network[FritzJohn, BranchKind]):
    def __init__(self, system: FritzJohnSystem, options: WalkOptions, extent: float) -> None:
        super().__init__(options, extent)
        self.system = system

    def begin(self, at: FritzJohn) -> None:
        """Follow the curve through an equilibrium both ways, as one arc."""
        if at.only_tangent() is not None:
            super().begin(at)
        elif not any(self.passes(arc, at) for arc in self.curves):
            self.nodes.append(flat_event(at, at.tangent()))

    def begin_at_event(self, at: FritzJohn) -> None:
        """Take an equilibrium on which functions vanish without a multiplier."""
        node = weak_event(at)
        if not node.arms and not node.notes:
            node.notes.append("no arc leaves it")
        if self._known(node) is None:
            self.nodes.append(node)

    def told(self) -> tuple[float, float | None, str]:
        """Return how far the search has come."""
        waiting = sum(arm.curve < 0 for node in self.nodes for arm in node.arms)
        return len(self.curves), len(self.curves) + waiting, "arcs"

    def arrive(self, way: Course[FritzJohn], edge: int, end: int) -> None:
        """Register the end of an arc at an event, a new one or one that is known."""
        node, back, face = event_at_end(way), -way.tangent, way.last.face
        k = self._known(node)
        if k is None:
            k = len(self.nodes)
            self.nodes.append(node)
        node = self.nodes[k]
        self.curves[edge].ends[end] = k
        alike = math.cos(self.options.turn)
        if node.kind is BranchKind.BRANCH:
            back = _backwards(way, node.at)
        if node.at.face == face:
            self.curves[edge].points[-end] = node.at
        arms = [arm for arm in node.arms if arm.face == face and arm.direction @ back > alike]
        best = max(arms, key=lambda arm: float(arm.direction @ back), default=None)
        if best is not None and best.curve < 0:
            best.curve = edge
            return
        if best is not None or node.kind is BranchKind.BRANCH:
            node.notes.append("an arc arrives along a curve that is not known to leave")
        node.arms.append(Arm(way.last, back, edge))

    def _known(self, node: Event) -> int | None:
        near = self.system.tolerances.corner
        for k, other in enumerate(self.nodes):
            alike = other.weak == node.weak and other.kind is node.kind
            if alike and other.at.apart(node.at) <= near:
                return k
        return None

    def passes(self, edge: Curve[FritzJohn], at: FritzJohn) -> bool:
        """Whether an arc goes through a point."""
        for one, two in zip(edge.points, edge.points[1:], strict=False):
            if one.face != at.face or not (one.s - at.s) * (two.s - at.s) <= 0:
                continue
            part = (at.s - one.s) / ((two.s - one.s) or 1.0)
            pin = self.system.towards(at.x)
            found = corrected(at.moved(one.x + part * (two.x - one.x)), pin, math.inf)
            if found is not None and found.apart(at) <= self.system.tolerances.near:
                return True
        return False

    def contract(self) -> None:
        """Join events that an arc of no length connects, and arcs where nothing happens."""
        n, same = self.system.n, self.system.tolerances.same
        for k, edge in enumerate(self.curves):
            one, two = edge.ends
            places = np.array([p.x[: n + 1] for p in edge.points])
            extent = np.ptp(places, axis=0).max()
            if one == two >= 0 and extent <= self.system.tolerances.near:
                # No step was possible, or only such that led nowhere: a note says so.
                self.nodes[one].arms = [arm for arm in self.nodes[one].arms if arm.curve != k]
                edge.points = []
                continue
            if min(one, two) < 0 or one == two or extent > same:
                continue
            kept, gone = self.nodes[one], self.nodes[two]
            kept.kind = gone.kind if kept.kind is TOLD else kept.kind
            kept.at = min(kept.at, gone.at, key=lambda at: abs(float(at.x[-1])))
            kept.weak = tuple(sorted({*kept.weak, *gone.weak}))
            kept.notes += gone.notes
            kept.arms = [arm for arm in (*kept.arms, *gone.arms) if arm.curve != k]
            gone.arms, gone.notes, edge.points = [], [], []
            self._redirect(two, one)
        for k, node in enumerate(self.nodes):
            arms = node.arms
            nothing = node.kind is TOLD and not node.notes and len(arms) == 2
            if nothing and arms[0].face == arms[1].face and arms[0].curve != arms[1].curve:
                self._join(k, arms[0].curve, arms[1].curve)

    def _redirect(self, old: int, new: int) -> None:
        for edge in self.curves:
            edge.ends = [new if end == old else end for end in edge.ends]

    def _join(self, k: int, one: int, two: int) -> None:
        """Append an arc to another at an event where nothing happens."""
        first, second = self.curves[one], self.curves[two]
        if first.ends[0] == k:
            first.points, first.ends = first.points[::-1], first.ends[::-1]
        if second.ends[1] == k:
            second.points, second.ends = second.points[::-1], second.ends[::-1]
        first.points += second.points[1:]
        first.ends = [first.ends[0], second.ends[1]]
        second.points, self.nodes[k].arms = [], []
        for node in self.nodes:
            for arm in node.arms:
                arm.curve = one if arm.curve == two else arm.curve


def _backwards(way: Course[FritzJohn], end: FritzJohn) -> np.ndarray:
    """Return the unit tangent at a branch point, where the Jacobian gives none, towards an arc.

    That of the parabola through the point with the tangent of the last point beside it.
    """
    least = end.system.tolerances.near
    away = [np.linalg.norm(end.x - at.x) for at in way.points]
    k = max((k for k, length in enumerate(away) if length >= least), default=0)
    chord = (end.x - way.points[k].x) / (away[k] or 1.0)
    back = way.points[k].tangent(chord) - 2 * chord
    return np.asarray(back / np.linalg.norm(back))


@checked
def branches(  # noqa: PLR0913 - keywords of one search
    certificate: Certificate | Sequence[Certificate],
    parameter: str | Mapping[str, float],
    interval: tuple[float, float],
    *,
    symmetry: Symmetry | None = None,
    extent: float = math.inf,
    options: WalkOptions | None = None,
    max_arcs: int = 500,
    max_seconds: float = math.inf,
    progress: Progress = silent,
) -> Diagram:
    """Follow equilibria over a parameter through all events, until an interval is covered.

    Equilibria are points at which the energy is stationary on a face, with multipliers ``dE/df >=
    0`` of the active inequalities; they need not be minima.  At every event all arcs that leave it
    are followed in turn (:mod:`polycorner.branches.events`).  Curves that are not connected with
    the start are not found.

    Parameters
    ----------
    certificate : Certificate, or sequence of Certificate
        Equilibria to start from, at values of the parameter in the interval, with independent
        active gradients.
    parameter : str or mapping from str to float
        A parameter of the problem's functions; or several with their rates: then the value is the
        change from those of the (first) certificate.
    interval : (float, float)
        Values of the parameter, ascending.
    symmetry : Symmetry, optional
        The continuous symmetries, modulo which equilibria are isolated.
    extent : float, optional
        Distance from the start of an arc, in scale units, beyond which it is not followed.
    options : WalkOptions, optional
        Steps along the arcs, in scale units and fifths of the interval.
    max_arcs, max_seconds : int, float, optional
        Arcs and time after which the search ends; the diagram is not ``Diagram.closed`` then.
    progress : callable, optional
        Told the numbers of arcs followed and known.

    Returns
    -------
    Diagram

    Raises
    ------
    TypeError, ValueError
        Naming the argument, what was expected and what came.

    Examples
    --------
    A ball on a spring is pressed against a wall as the spring's foot ``t`` moves behind it:

    >>> import sympy
    >>> from polycorner import Manifold, Polyhedron, SmoothFunction, minimise
    >>> from polycorner.branches import branches
    >>> M = Manifold.euclidean("x")
    >>> (x,) = M.symbols
    >>> t = sympy.Symbol("t")
    >>> spring = SmoothFunction("energy", (x - t) ** 2 / 2, M, parameters={"t": 1.0})
    >>> c = minimise(Polyhedron(M, {"wall": x}), spring, [1.0])
    >>> d = branches(c, "t", (-1.0, 2.0))
    >>> [(event.kind.name, event.parameter) for event in d.events]
    [('END', -1.0), ('OPENS', 0.0), ('END', 2.0)]
    """
    several = [certificate] if isinstance(certificate, Certificate) else [*certificate]
    if not several:
        checks.refuse("certificate", "at least one", several)
    low, high = interval_ends(interval)
    checks.real("extent", extent, above=0, infinite=True)
    checks.real("max_seconds", max_seconds, above=0, infinite=True)
    checks.whole("max_arcs", max_arcs, least=1)
    rates = {parameter: 1.0} if isinstance(parameter, str) else dict(parameter)
    if not rates:
        checks.refuse("parameter", "a name, or names with rates", parameter)
    first, now = several[0], _value(several[0], rates, parameter)
    if not low <= now <= high:
        checks.refuse("interval", f"one that contains {now:g}, of the certificate", interval)
    about = first.problem, [rates], [(low, high)], [now], first.point
    system = posed(*about, symmetry or Symmetry(), first.tolerances)
    search = _BranchSearch(system, options or WalkOptions(), extent)
    for one in several:
        at = _start(system, one, rates, parameter, (low, high))
        search.begin_at_event(at) if one.found.weak else search.begin(at)
    ending = work_through(search.tasks(max_arcs), search.told, progress, seconds=max_seconds)
    search.contract()
    done = ending is Ending.FINISHED and all(map(is_decided, search.nodes))
    return _diagram(search, first, rates, parameter, (low, high), done)


def interval_ends(given: object) -> tuple[float, float]:
    """Return the ends of an interval that was given."""
    ends = checks.numbers("interval", given, "two finite numbers, ascending")
    if ends.shape != (2,) or not np.isfinite(ends).all() or not ends[0] < ends[1]:
        checks.refuse("interval", "two finite numbers, ascending", given)
    return float(ends[0]), float(ends[1])


def _value(
    certificate: Certificate, rates: Mapping[str, float], parameter: str | Mapping[str, float]
) -> float:
    """Return the value of the parameter at which a certificate was made."""
    certificate.problem.check_parameters(rates)
    if not isinstance(parameter, str):
        return 0.0
    (value,) = certificate.problem.parameter_values[parameter]
    return float(value)


def _start(
    system: FritzJohnSystem,
    certificate: Certificate,
    rates: Mapping[str, float],
    parameter: str | Mapping[str, float],
    interval: tuple[float, float],
) -> FritzJohn:
    """Return the Fritz John point of a certificate."""
    a, (low, high) = certificate.found, interval
    if not a.independent or a.multipliers.residual > a.local.small:
        expected = "a point stationary on its face, with independent active gradients"
        checks.refuse("certificate", expected, repr(certificate))
    functions = {f.name: row for row, f in enumerate(system.problem.functions)}
    lam = np.zeros(system.problem.rows)
    try:
        for name, value in a.named_multipliers.items():
            row = functions[name]
            lam[row] = value * system.sizes[row]
    except KeyError as error:
        checks.refuse("certificate", "several of the same functions", str(error))
    negative = [name for name in a.names if lam[functions[name]] < -a.local.small]
    if negative:
        expected = "an equilibrium: no active function with a negative multiplier"
        checks.refuse(
            "certificate", expected, f"{negative[0]} with {lam[functions[negative[0]]]:g}"
        )
    weak = {*a.weak}
    lam[[*weak]] = 0.0
    lam[-1] = system.sizes[-1]
    s = (_value(certificate, rates, parameter) - low) / (high - low) * system.length
    if not 0 <= s <= system.length:
        checks.refuse("certificate", "values of the parameter in the interval", repr(certificate))
    face = tuple(i for i in a.active if i not in weak)
    u = certificate.point / system.manifold.scale_array
    x = system.guess(face, u, s, lam / np.linalg.norm(lam))
    found = corrected(system.point(face, x), system.towards(x), math.inf)
    if found is None:
        expected = "an equilibrium that is isolated, modulo the symmetry, at its parameter"
        checks.refuse("certificate", expected, repr(certificate))
    return found


def _index(points: Sequence[FritzJohn]) -> int:
    """Return the index between the ends of an arc, at which curvatures may vanish."""
    one, two = points[0], points[-1]
    inner, half = points[1:-1], len(points) // 2
    if not inner:
        middle = one.moved((one.x + two.x) / 2)
        inner = [corrected(middle, two.x - one.x, math.inf) or middle]
    return max([*inner[half:], *inner[:half]], key=lambda at: at.definite).index


def _key(points: Sequence[FritzJohn]) -> tuple[float, ...]:
    """Return numbers by which arcs and events are listed: those of the parameter, then places."""
    ends = sorted((points[0].s, points[-1].s))
    places = np.concatenate([ends, points[len(points) // 2].u])
    return tuple((np.round(places, 6) + 0.0).tolist())


def _diagram(
    search: _BranchSearch,
    certificate: Certificate,
    rates: Mapping[str, float],
    parameter: str | Mapping[str, float],
    interval: tuple[float, float],
    closed: bool,
) -> Diagram:
    """Return arcs and events in terms of the user."""
    system, names = search.system, [f.name for f in search.system.problem.functions]
    (low, high), length = interval, search.system.length
    # In an order that does not depend on the order in which they were found.
    kept = sorted(
        (k for k, edge in enumerate(search.curves) if edge.points),
        key=lambda k: _key(search.curves[k].points),
    )
    shown = sorted(
        (k for k, node in enumerate(search.nodes) if node.arms or node.notes),
        key=lambda k: _key([search.nodes[k].at]),
    )
    arc_of = {k: j for j, k in enumerate(kept)}
    event_of = {k: j for j, k in enumerate(shown)}
    arcs = []
    for k in kept:
        edge = search.curves[k]
        points, ends = edge.points, edge.ends
        if points[0].s > points[-1].s:
            points, ends = points[::-1], ends[::-1]
        rows = system.rows(edge.points[0].face)[:-1]
        mu = np.array([p.mu for p in points])
        with np.errstate(divide="ignore", invalid="ignore"):
            lam = mu[:, rows] / mu[:, -1:] * system.sizes[-1] / system.sizes[rows]
        stated = {names[row]: lam[:, j] for j, row in enumerate(rows)}
        arcs.append(
            Arc(
                active=tuple(names[i] for i in edge.points[0].face),
                parameters=np.interp([p.s for p in points], (0, length), (low, high)),
                points=np.array([system.place(p.u) for p in points]),
                multipliers=certificate.problem.stated(stated),
                energies=np.array([p.known.values[-1] for p in points]) * system.sizes[-1],
                index=_index(points),
                events=(event_of.get(ends[0], -1), event_of.get(ends[1], -1)),
            )
        )
    events = []
    for k in shown:
        node = search.nodes[k]
        arms = sorted(node.arms, key=lambda arm: float(arm.direction[system.n]))
        events.append(
            BranchEvent(
                kind=kind_of(node),
                parameter=float(np.interp(node.at.s, (0, length), (low, high))),
                point=system.manifold.canonical(system.place(node.at.u)),
                before=tuple(names[i] for i in (arms[0] if arms else node.at).face),
                after=tuple(names[i] for i in (arms[-1] if arms else node.at).face),
                functions=tuple(names[i] for i in node.weak),
                arcs=tuple(arc_of[arm.curve] for arm in arms if arm.curve in arc_of),
                note="; ".join(dict.fromkeys(node.notes)),
            )
        )
    return Diagram(
        problem=certificate.problem,
        parameter=parameter if isinstance(parameter, str) else "change",
        rates=rates,
        value=_value(certificate, rates, parameter),
        interval=interval,
        arcs=tuple(arcs),
        events=tuple(events),
        closed=closed,
    )
