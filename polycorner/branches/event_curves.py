"""The search for all curves of events that are connected with those of a diagram.

A curve ends where something more vanishes; there other curves begin, by what vanishes:

*a function or a multiplier, along a contact change*
    Of both sets of functions, those that vanished and those that now do, one vanishes along a curve
    while the other is held, or open: four curves.
*a curvature, along a contact change*
    The equilibria on one of its sides fold there, so that it persists on one side of the point and
    is a corner limit on the other (``sigma = 0``), and one curve of folds leaves.
*a function or a multiplier, along a curve of folds*
    the same point, seen from the folds.
*another curvature, along a curve of folds or of branch points*
    In systems with a symmetry the two kinds of curves cross.
*the bend of a fold*
    A cusp: the curve goes on, and its image in the plane turns back.
"""

import math
from collections.abc import Iterator, Mapping
from itertools import pairwise
from typing import TypeAlias

import numpy as np

from polycorner import checks
from polycorner.branches.continuation import Course, Stop, corrected
from polycorner.branches.diagram import BranchEvent, BranchKind, Diagram
from polycorner.branches.event_map import EventCurve, EventMap, MeetingKind, MeetingPoint
from polycorner.branches.event_points import FOLD, SYMMETRIC, EventPoint, kind_and_gain
from polycorner.branches.network import Arm, Curve, Network, Node
from polycorner.branches.posing import posed
from polycorner.branches.search import interval_ends
from polycorner.branches.system import Face, FritzJohn, FritzJohnSystem
from polycorner.kinds import checked
from polycorner.polyhedra.quotients import WalkOptions
from polycorner.polyhedra.symmetry import Symmetry
from polycorner.progress import Progress, silent
from polycorner.searches import Ending, work_through
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT

_Meeting: TypeAlias = Node[EventPoint, MeetingKind]


def _meeting(course: Course[EventPoint]) -> _Meeting:
    """Return the meeting at the end of a curve."""
    at, t, m = course.last, course.tangent, course.last.system.problem.inequalities
    if course.stop not in {Stop.EVENT, Stop.FLAT}:
        return Node(at, MeetingKind.UNDECIDED, notes=[course.stop.value])
    new = np.flatnonzero(abs(at.watched()[0]) <= at.system.tolerances.same)
    if (new > m).any():
        return Node(at, MeetingKind.END)
    both = [Arm(at, t), Arm(at, -t)]
    if course.stop is Stop.EVENT:
        return _crossing(at, tuple(new.tolist()))
    if at.flat == FOLD and abs(at.bend) <= at.system.tolerances.near:
        return Node(at, MeetingKind.CUSP, arms=both)
    if at.flat:
        return _two_flat(at, both)
    known = [abs(some).min(initial=math.inf) for some in at.spectra()]
    return _fold_at(at, at.subsets[int(np.argmin(known))], both)


def _fold_at(at: EventPoint, held: Face, arms: list[Arm[EventPoint]]) -> _Meeting:
    """Return the meeting of a contact change with the folds that hold some of its functions."""
    node = Node(at, MeetingKind.FOLD_AT_CONTACT, at.own, arms)
    face = tuple(sorted({*at.face, *held}))
    for flat in (FOLD, SYMMETRIC) if len(at.own) > 1 else (FOLD,):
        found = list(_leaving(_on(at, face, (), flat), at.own, node))
        if found:
            node.notes = []
            node.arms += found
            break
    return node


def _two_flat(at: EventPoint, arms: list[Arm[EventPoint]]) -> _Meeting:
    """Return the meeting of folds with branch points of a symmetry."""
    node = Node(at, MeetingKind.FOLD_AT_BRANCH, arms=arms)
    flat = FOLD + SYMMETRIC - at.flat
    other = EventPoint(at.system, at.face, at.x, (), flat, at.across())
    # The direction of the odd curvature is one of the folds' Jacobian as well.
    odd = other if flat == SYMMETRIC else at
    t = np.linalg.svd(np.vstack([other.jacobian, odd.right]))[2][-1]
    node.arms += [Arm(other, t), Arm(other, -t)]
    return node


def _crossing(at: EventPoint, new: Face) -> _Meeting:
    """Return the meeting where functions vanish along an event curve."""
    m = at.system.problem.inequalities
    kind = MeetingKind.DEPENDENT if m in (*at.own, *new) else MeetingKind.CONTACTS
    if at.flat:
        base = _on(at, tuple(i for i in at.face if i not in new), new, 0)
        t = base.tangent()
        node = _fold_at(base, tuple(i for i in new if i in at.face), [Arm(base, t), Arm(base, -t)])
        node.kind = kind if kind is MeetingKind.DEPENDENT else node.kind
        return node
    node = Node(at, kind, tuple(sorted({*at.own, *new})))
    firm = {*at.face}.difference(new)
    for own, rest in ((at.own, new), (new, at.own)):
        functions = [i for i in rest if i < m]
        for held in ((), functions) if functions else ((),):
            face = tuple(sorted(firm.union(held)))
            node.arms += _leaving(_on(at, face, own, 0), rest, node)
    return node


def _on(at: EventPoint, face: Face, own: Face, flat: int) -> EventPoint:
    """Return the same point as one of another curve."""
    x = at.system.guess(face, at.u, at.both, at.mu)
    return EventPoint(at.system, face, x, own, flat)


def _leaving(start: EventPoint, rest: Face, node: _Meeting) -> Iterator[Arm[EventPoint]]:
    """Yield the directions of a curve along which some functions or multipliers grow."""
    tolerances = start.system.tolerances
    sizes, vectors = start.kernel() if start.finite else (np.zeros(2), np.zeros((1, 1)))
    if sizes[1] <= tolerances.dependent:
        node.notes.append("several event curves of one kind cross there")
        return
    rates = start.watched()[1][[*rest]] @ vectors[0]
    if (abs(rates) <= tolerances.same).any():
        node.notes.append("something vanishes to second order")
    elif (rates > 0).all() or (rates < 0).all():
        yield Arm(start, -vectors[0] if (rates < 0).any() else vectors[0])


class _CurveSearch(Network[EventPoint, MeetingKind]):
    def __init__(self, options: WalkOptions) -> None:
        super().__init__(options, math.inf)
        self.lost = False

    def told(self) -> tuple[float, float | None, str]:
        """Return how far the search has come."""
        return len(self.curves), None, "curves"

    def add(self, back: Course[EventPoint], on: Course[EventPoint]) -> None:
        """Add a curve that was followed both ways, if it was."""
        if len(back.points) == len(on.points) == 1:
            self.lost = True
        else:
            super().add(back, on)

    def leave(self, k: int, arm: Arm[EventPoint]) -> None:
        """Follow an arm of a meeting, and forget it where that is not possible."""
        course = self.follow(arm.start, arm.direction)
        if len(course.points) == 1:
            note = f"a curve that leaves is not followed: {course.stop.value}"
            self.nodes[k].notes.append(note)
            self.nodes[k].arms.remove(arm)
            return
        arm.curve = len(self.curves)
        self.curves.append(Curve(course.points, [k, -1]))
        self.arrive(course, arm.curve, 1)

    def arrive(self, course: Course[EventPoint], curve: int, end: int) -> None:
        """Register the end of a curve at a meeting, a new one or one that is known."""
        at, back, near = course.last, -course.tangent, course.last.system.tolerances.near
        known = (k for k, node in enumerate(self.nodes) if node.at.apart(at) <= near)
        k = next(known, len(self.nodes))
        if k == len(self.nodes):
            self.nodes.append(_meeting(course))
        self.curves[curve].ends[end] = k
        arms, alike = self.nodes[k].arms, math.cos(self.options.turn)
        for arm in arms:
            if arm.curve < 0 and arm.start.alike(at) and arm.direction @ back > alike:
                arm.curve = curve
                return
        arms.append(Arm(at, back, curve))

    def passes(self, curve: Curve[EventPoint], at: EventPoint) -> bool:
        """Whether a curve goes through a point."""
        if not curve.points[0].alike(at):
            return False
        for one, two in pairwise(curve.points):
            way = two.x - one.x
            part = (at.x - one.x) @ way / max(float(way @ way), np.finfo(float).tiny)
            if 0 <= part <= 1:
                found = corrected(
                    one.moved(one.x + part * way), way / np.linalg.norm(way), math.inf
                )
                if found is not None and found.apart(at) <= at.system.tolerances.near:
                    return True
        return False

    def sort(self) -> None:
        """List curves and meetings, and points of curves, in an order that is theirs."""
        for curve in self.curves:
            if _key(curve.points[0]) > _key(curve.points[-1]):
                curve.points, curve.ends = curve.points[::-1], curve.ends[::-1]
        curves, meetings = self.curves, self.nodes
        order = sorted(
            range(len(curves)), key=lambda k: [_key(curves[k].points[i]) for i in (0, -1, 1)]
        )
        places = sorted(range(len(meetings)), key=lambda k: _key(meetings[k].at))
        self.curves = [curves[k] for k in order]
        self.nodes = [meetings[k] for k in places]
        for curve in self.curves:
            curve.ends = [places.index(end) if end >= 0 else end for end in curve.ends]
        for node in self.nodes:
            for arm in node.arms:
                arm.curve = order.index(arm.curve) if arm.curve >= 0 else arm.curve


def _key(at: EventPoint) -> tuple[float, ...]:
    return tuple((np.round(np.concatenate([at.both, at.u]), 6) + 0.0).tolist())


@checked
def event_curves(
    diagram: Diagram,
    parameter: str | Mapping[str, float],
    interval: tuple[float, float],
    *,
    symmetry: Symmetry | None = None,
    options: WalkOptions | None = None,
    max_curves: int = 200,
    max_seconds: float = math.inf,
    progress: Progress = silent,
) -> EventMap:
    """Follow the events of a diagram as curves in the plane of its parameter and a second one.

    Along a curve the equations of Fritz John hold and that of the event: a gap or a multiplier
    vanishes, a curvature, or the energy's multiplier (:mod:`polycorner.branches.event_points`).
    Where curves meet or end, all others that leave are followed in turn
    (:mod:`polycorner.branches.event_curves`).  A branch point is followed where it is one by
    symmetry; others, re-entrant edges and undecided events are not followed, and the map is not
    ``EventMap.closed`` then.

    Parameters
    ----------
    diagram : Diagram
        At the value of the second parameter of its problem.
    parameter : str or mapping from str to float
        The second parameter: one of the problem's functions; or several with their rates, then the
        value is the change.
    interval : (float, float)
        Its values, ascending.
    symmetry : Symmetry, optional
        As for the diagram.
    options : WalkOptions, optional
        Steps along the curves, in scale units and fifths of the intervals.
    max_curves, max_seconds : int, float, optional
        Curves and time after which the search ends.
    progress : callable, optional
        Told the number of curves followed.

    Returns
    -------
    EventMap

    Raises
    ------
    TypeError, ValueError
        Naming the argument, what was expected and what came.

    Examples
    --------
    A ball on a spring between two walls, of which one moves:

    >>> import sympy
    >>> from polycorner import Manifold, Polyhedron, SmoothFunction, minimise
    >>> from polycorner.branches import branches, event_curves
    >>> M = Manifold.euclidean("x")
    >>> (x,) = M.symbols
    >>> t, a = sympy.symbols("t a")
    >>> spring = SmoothFunction("energy", (x - t) ** 2 / 2, M, parameters={"t": 1.0})
    >>> wall = SmoothFunction("wall", x - a**2, M, parameters={"a": 0.0})
    >>> d = branches(minimise(Polyhedron(M, wall), spring, [1.0]), "t", (-1.0, 2.0))
    >>> found = event_curves(d, "a", (-1.0, 1.0))
    >>> [(curve.kind.name, curve.functions) for curve in found.curves]
    [('OPENS', ('wall',))]
    """
    low, high = interval_ends(interval)
    checks.real("max_seconds", max_seconds, above=0, infinite=True)
    checks.whole("max_curves", max_curves, least=1)
    problem, name = diagram.problem, parameter if isinstance(parameter, str) else "change"
    if problem.is_sparse:
        checks.refuse("diagram", "one of a small polyhedron", repr(diagram))
    second = {parameter: 1.0} if isinstance(parameter, str) else dict(parameter)
    problem.check_parameters(second)
    now = next(iter(problem.parameter_values[name])) if isinstance(parameter, str) else 0.0
    checks.real("interval", float(now), least=low, most=high)
    rectangle = (diagram.interval, (low, high))
    values, rates = (diagram.value, float(now)), (diagram.rates, second)
    starts, declined = [], not diagram.closed
    if diagram.arcs:
        q = diagram.arcs[0].points[0]
        posing = symmetry or Symmetry()
        system = posed(problem, rates, rectangle, values, q, posing, DEFAULT)
        for event in diagram.events:
            if event.kind not in {BranchKind.END, BranchKind.FAR}:
                declined |= event.kind is BranchKind.RE_ENTRANT
                if event.kind is BranchKind.RE_ENTRANT:
                    continue
                found = _starts(system, diagram, event, (values[1] - low) / (high - low))
                # Where contacts are exchanged each side has a curve.
                exchanged = event.kind is BranchKind.EXCHANGE
                starts += found if exchanged else found[:1]
                declined |= len(found) < 1 + exchanged
    search = _CurveSearch(options or WalkOptions())
    told = search.tasks(max_curves, starts)
    ending = work_through(told, search.told, progress, seconds=max_seconds)
    search.sort()
    done = ending is Ending.FINISHED and not any(node.notes for node in search.nodes)
    lows = np.array([interval[0] for interval in rectangle])
    units = np.array([(high - low) / system.length for low, high in rectangle]) if starts else lows
    curves = [_stated(curve, lows, units) for curve in search.curves]
    return EventMap(
        parameters=(diagram.parameter, name),
        rectangle=rectangle,
        known=(*_between(diagram, values[1]),),
        curves=tuple(curves),
        meetings=tuple(
            MeetingPoint(
                kind=node.kind,
                parameters=lows + node.at.both * units,
                point=node.at.system.manifold.canonical(node.at.system.place(node.at.u)),
                functions=_named(node.at, node.weak),
                curves=tuple(sorted(arm.curve for arm in node.arms if arm.curve >= 0)),
                note="; ".join(dict.fromkeys(node.notes)),
            )
            for node in search.nodes
        ),
        closed=done and not declined and not search.lost,
    )


def _between(diagram: Diagram, second: float) -> tuple[float, float, int]:
    """Return the place farthest from events in a diagram, and the number of minima there."""
    ends = np.unique([*diagram.interval, *(event.parameter for event in diagram.events)])
    k = int(np.argmax(np.diff(ends)))
    value = float(ends[k : k + 2].mean())
    arcs = [a for a in diagram.arcs if a.stable and a.parameters[0] < value < a.parameters[-1]]
    return value, second, len(arcs)


def _named(at: FritzJohn, rows: Face) -> tuple[str, ...]:
    functions = at.system.problem.functions
    return tuple(functions[i].name for i in rows if i < at.system.problem.inequalities)


def _stated(curve: Curve[EventPoint], lows: Array, units: Array) -> EventCurve:
    """Return a curve in terms of the user."""
    n, points = curve.points[0].system.n, curve.points
    # What happens is asked for where the curve moves most in the plane.
    tangents = [at.tangent(two.x - at.x) for at, two in pairwise(points)]
    inner = range(1 if len(tangents) > 1 else 0, len(tangents))
    k = max(inner, key=lambda k: float(np.linalg.norm(tangents[k][n : n + 2])))
    kind, gain = kind_and_gain(points[k], tangents[k])
    return EventCurve(
        kind=kind,
        active=_named(points[0], points[0].face),
        functions=_named(points[0], points[0].own),
        parameters=np.array([lows + at.both * units for at in points]),
        points=np.array([at.system.place(at.u) for at in points]),
        gain=gain,
        meetings=(curve.ends[0], curve.ends[1]),
    )


def _starts(
    system: FritzJohnSystem, diagram: Diagram, event: BranchEvent, second: float
) -> list[EventPoint]:
    """Return the point of an event on its curve, as the arcs see it; none if it is not followed."""
    starts = []
    names = [f.name for f in system.problem.functions]
    m, (low, high) = system.problem.inequalities, diagram.interval
    for k in event.arcs:
        arc = diagram.arcs[k]
        own = tuple(sorted(names.index(name) for name in event.functions))
        active = [names.index(name) for name in arc.active]
        exchanged = event.kind in {BranchKind.EXCHANGE, BranchKind.VANISHES}
        own = tuple(i for i in own if not (exchanged and i in active))
        face = tuple(i for i in active if i not in own)
        end = (
            0
            if abs(arc.parameters[0] - event.parameter) < abs(arc.parameters[-1] - event.parameter)
            else -1
        )
        u = arc.points[end] / system.manifold.scale_array
        s = np.array([(event.parameter - low) / (high - low), second]) * system.length
        gradients = system.at(u, s).gradients[:, : system.n]
        rows, mu, flat = system.rows(face), np.zeros(system.problem.rows), 0
        if event.kind is BranchKind.FOLD:
            flat = FOLD
        elif event.kind is BranchKind.BRANCH and not own:
            flat = SYMMETRIC
        elif not own:
            own = (m,)
        # The relation of the gradients, of the energy with weight one or zero.
        held = gradients[rows[:-1]]
        if m in own:
            relation = np.linalg.svd(held)[0][:, -1]
            mu[rows[:-1]] = relation * np.sign(relation.sum())
        else:
            mu[rows[:-1]] = np.linalg.lstsq(held.T, gradients[-1], rcond=None)[0]
            mu[-1] = 1.0
        x = system.guess(face, u, s, mu / np.linalg.norm(mu))
        across = np.eye(len(x))[system.n + 1]
        found = corrected(EventPoint(system, face, x, own, flat), across, system.tolerances.beside)
        starts += [] if found is None else [found]
    return starts
