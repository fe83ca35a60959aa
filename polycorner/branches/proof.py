"""Proofs of diagrams: their arcs, their events, and that there is nothing else."""

import os
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from polycorner import checks
from polycorner.branches.covering import Cover, event_tubes
from polycorner.branches.diagram import Arc, BranchEvent, BranchKind, Diagram
from polycorner.branches.enclosed_arcs import EnclosedArc, Watched, enclosed_arc
from polycorner.branches.enclosed_events import (
    EnclosedEvent,
    End,
    enclosed_event,
    null_unknowns,
)
from polycorner.branches.mirrors import images
from polycorner.branches.pitchforks import Pitchfork, pitchfork
from polycorner.branches.proof_options import BranchProofOptions
from polycorner.branches.saving import Evidence, ProvedArc, save_proof
from polycorner.branches.tubes import PIN, CurveSystem, Setting, Tube, point
from polycorner.intervals.balls import Ball, ball, balls, middles, precision
from polycorner.intervals.enclosures import Formulas, Undecided
from polycorner.intervals.tapes import Box
from polycorner.kinds import checked
from polycorner.minimisation.parametric import lifted_problem
from polycorner.polyhedra.equations import independent_equations
from polycorner.polyhedra.symmetry import Symmetry
from polycorner.printing import Printed, Sheet, facts, listed, number
from polycorner.progress import Progress, silent
from polycorner.proofs.lists.domains import Domain, domain
from polycorner.proofs.lists.faces import outward
from polycorner.proofs.witnesses import UnshownError, decided, need
from polycorner.spaces.manifold import Array
from polycorner.tolerances import Tolerances
from polycorner.values import Checked

Interval = tuple[float, float]


@dataclass(frozen=True, eq=False)
class BranchProof(Checked, Printed):
    """What is proved of a diagram; see :func:`prove_branches`.

    Attributes
    ----------
    diagram : Diagram
    arcs : tuple of str
        For every arc, what is not proved of it; empty if nothing.
    events : tuple of str
        For every event, the same.
    parameters : tuple of (float, float)
        For every event, bounds of the parameter; of one that is not proved, the value that was
        followed, twice.
    tubes : tuple of int
        For every arc, the number of pieces into which it was divided.
    open_boxes : (k, 2, n + 1) array
        Boxes of coordinates and the parameter, in which there may be others.
    searched : bool
        Whether a box was searched for others.
    evidence : Evidence or None
        What it is saved with, if it is proved.
    """

    diagram: Diagram
    arcs: tuple[str, ...]
    events: tuple[str, ...]
    parameters: tuple[Interval, ...]
    tubes: tuple[int, ...]
    open_boxes: Array = field(default_factory=lambda: np.zeros((0, 2, 0)))
    searched: bool = False
    evidence: Evidence | None = field(default=None, repr=False)

    @property
    def proved(self) -> bool:
        """Whether all arcs and events are, and nothing else leaves the events.

        Nothing is said of curves that are not connected with them.
        """
        return self.diagram.closed and not any((*self.arcs, *self.events))

    @property
    def complete(self) -> bool:
        """Whether these are all equilibria in the box that was searched, for the whole interval."""
        return self.proved and self.searched and not len(self.open_boxes)

    @property
    def word(self) -> str:
        """What is known of the diagram: *followed*, *proved*, or *complete*."""
        return "complete" if self.complete else "proved" if self.proved else "followed"

    @checked
    def save(self, path: str | os.PathLike[str], *, progress: Progress = silent) -> Path:
        """Save what is proved, with its evidence, for an independent checker; return the path.

        The checker is run first.  It encloses curves less closely than :func:`prove_branches`, and
        divides the box of a complete diagram anew, as far as the options of the proof allow.

        See :mod:`polycorner.branches.saving`, and :mod:`polycorner.proofs.checker.diagrams` for
        what the checker shows.

        Parameters
        ----------
        path : path
            The file, whose name ends in ``.zip``.
        progress : callable, optional
            Told the number of boxes.

        Raises
        ------
        ValueError
            If an arc or an event is not proved, or boxes are open; if the checker does not follow
            the proof; or if the name does not end in ``.zip``.
        OSError
            If the file could not be written.
        """
        if not self.proved or self.evidence is None:
            checks.refuse("save", "a diagram of which all arcs and events are proved", self)
        if len(self.open_boxes):
            expected = "a box without open parts, or a proof without a box"
            checks.refuse("save", expected, f"{len(self.open_boxes)} open boxes")
        return save_proof(path, self.diagram, self.evidence, progress)

    def __repr__(self) -> str:
        """Return what is proved in one line."""
        low, high = self.diagram.interval
        some = f"{self._count(self.arcs)} arcs, {self._count(self.events)} events proved"
        where = f" on [{low:g}, {high:g}]" if self.complete else ""
        return f"BranchProof({self.word}{where}: {some})"

    @staticmethod
    def _count(reasons: Sequence[str]) -> str:
        done = sum(not reason for reason in reasons)
        return str(done) if done == len(reasons) else f"{done} of {len(reasons)}"

    def _sheet(self) -> Sheet:
        d = self.diagram
        left = [(f"arc {k}", reason) for k, reason in enumerate(self.arcs) if reason]
        left += [
            (f"{d.events[k].kind.name} at {d.parameter} = {number(d.events[k].parameter, 9)}", r)
            for k, r in enumerate(self.events) if r
        ]  # fmt: skip
        if not d.closed:
            left.append(("diagram", "not every arc was followed to its ends"))
        if self.searched:
            left += [("others", f"{len(self.open_boxes)} boxes are open")] * bool(
                len(self.open_boxes)
            )
        else:
            left.append(("others", "no box was searched for equilibria on other curves"))
        events = [
            (f"{low:.17g}", f"{high:.17g}", e.kind.name)
            for (low, high), e, reason in zip(self.parameters, d.events, self.events, strict=True)
            if not reason
        ]
        names = ("lower bound", "upper bound", "kind")
        return Sheet(
            repr(self),
            (
                listed("Proved events", names, events, len(events)),
                facts((name, f"not proved: {reason}") for name, reason in left) if left else "",
            ),
        )


@checked
def prove_branches(
    diagram: Diagram,
    *,
    box: Any = None,
    symmetry: Symmetry | None = None,
    options: BranchProofOptions | None = None,
    progress: Progress = silent,
) -> BranchProof:
    """Prove arcs and events of a diagram in ball arithmetic.

    Of an arc it is proved that there is exactly one curve of equilibria near its points, on which
    its functions are active, with positive multipliers, and no others, the parameter is monotone
    and the index is that of the arc; of an event, that its arcs end there, in one point, and that
    no other equilibria leave it.  Branch points are proved where a symmetry breaks, as pitchforks
    (:mod:`~polycorner.branches.pitchforks`).  Of other events where curves cross, of several
    functions that vanish at once without a symmetry, and of unions nothing is proved; they are
    *followed*.

    Parameters
    ----------
    diagram : Diagram
    box : sequence or mapping, optional
        A side for each coordinate, as of :func:`~polycorner.proofs.stationary_points`.  Where all
        arcs and events are proved, it is searched for other equilibria, over the whole interval;
        if there are none the diagram is *complete* there.
    symmetry : Symmetry, optional
        Its ``elements``, signed permutations of the coordinates, show that several functions vanish
        at once, and pitchforks.  For these symmetries of the energy and the active functions are
        also looked for among the signed permutations that take one curve to another.
    options : BranchProofOptions, optional
    progress : callable, optional
        Told the number of arcs done and of all, and of boxes.

    Returns
    -------
    BranchProof

    Raises
    ------
    TypeError, ValueError
        For diagrams of unions and on manifolds with unit vectors.
    """
    d = diagram.problem.polyhedron
    if d.is_union or d.manifold.factors or diagram.problem.is_sparse:
        expected = "one of an intersection, on lines and circles, of few coordinates"
        checks.refuse("diagram", expected, repr(d))
    sides = None if box is None else domain(d.manifold, box)
    chosen = options or BranchProofOptions()
    with precision(chosen.bits):
        prover = _Prover(diagram, symmetry or Symmetry(), chosen)
        arcs = []
        for k in range(len(diagram.arcs)):
            arcs.append(prover.arc(k))
            progress(k + 1, len(diagram.arcs), "arcs")
        events = [prover.event(k, arcs) for k in range(len(diagram.events))]
        times = [prover.times(k, event) for k, event in enumerate(events)]
        proved = not any([a.reason for a in arcs] + [e.reason for e in events])
        searched = sides is not None and diagram.closed and proved
        left = np.zeros((0, 2, 0))
        if searched:
            assert sides is not None
            left = prover.others(arcs, events, sides, progress)
        evidence = prover.evidence(arcs, sides) if proved else None
    return BranchProof(
        diagram=diagram,
        arcs=tuple(arc.reason for arc in arcs),
        events=tuple(event.reason for event in events),
        parameters=tuple(times),
        tubes=tuple(len(arc.tubes) for arc in arcs),
        open_boxes=left,
        searched=searched,
        evidence=evidence,
    )


class _Prover:
    def __init__(self, diagram: Diagram, symmetry: Symmetry, options: BranchProofOptions) -> None:
        self.diagram, self.options = diagram, options
        self.problem = problem = diagram.problem
        self.names = [f.name for f in problem.functions]
        self.setting = _setting(diagram, symmetry, options.most_images)
        low, high = (Fraction(x) for x in diagram.interval)
        self.watched = Watched(problem.inequalities, low, high)
        self.tolerances = Tolerances()
        self.pitchforks = {
            k: self._pitchfork(k, event)
            for k, event in enumerate(diagram.events) if event.kind is BranchKind.BRANCH
        }  # fmt: skip

    def _pitchfork(self, k: int, event: BranchEvent) -> Pitchfork | Undecided:
        """Return the pitchfork of an event, of any symmetry that shows one."""
        arcs = [arc for arc in self.diagram.arcs if k in arc.events]
        found = Undecided("the branch point", "no symmetry of the formulas shows a pitchfork")
        if len({arc.active for arc in arcs}) != 1:
            return found
        face = self._face(arcs[0])
        places = [self._place(event.point, event.parameter)]
        for arc in arcs:
            middle = len(arc.points) // 2
            places.append(self._place(arc.points[middle], arc.parameters[middle]))
        at, *near = [null_unknowns(self.setting, face, place) for place in places]
        if not np.isfinite([at, *near]).all():
            return found
        for g in self.setting.images:
            one = pitchfork(self.setting, face, g, at, near, self.watched, self.options)
            if isinstance(one, Pitchfork):
                return one
            found = one
        return found

    def _face(self, arc: Arc) -> tuple[int, ...]:
        return tuple(sorted(self.names.index(name) for name in arc.active))

    def _place(self, q: Array, t: float) -> Array:
        """Return coordinates and formulas' parameters."""
        line = zip(self.setting.start, self.setting.rates, strict=True)
        return np.concatenate([q, [float(a + Fraction(t) * r) for a, r in line]])

    def arc(self, k: int) -> EnclosedArc:
        """Return what is shown of an arc."""
        arc, setting = self.diagram.arcs[k], self.setting
        face = self._face(arc)
        system = CurveSystem(setting, face)
        places = list(map(self._place, arc.points, arc.parameters.tolist()))
        points = [null_unknowns(setting, face, place) for place in places]
        last = points.pop()
        points = [
            *(x for x in points
              if np.linalg.norm((x - last) / system.units) > self.options.shortest),
            last,
        ]  # fmt: skip
        for side, one in enumerate(map(self.pitchforks.get, arc.events)):
            if isinstance(one, Pitchfork) and all(np.isfinite(x).all() for x in points):
                points = one.cut(points, side, self.tolerances.near, self.options) or points
        zeros = self._zeros(k, 0, points[0], face), self._zeros(k, 1, points[-1], face)
        if not all(np.isfinite(x).all() for x in points) or len(points) < 2:
            ends = points[0], points[-1]
            return EnclosedArc(face, (), ends, zeros, (False, False), -1, "its points are too few")
        found = enclosed_arc(system, points, zeros, self.watched, self.options)
        wrong = found.reason or self._contradiction(arc, places, found)
        return replace(found, reason=wrong)

    def _zeros(self, k: int, side: int, x: Array, face: tuple[int, ...]) -> frozenset[int]:
        """Return what seems to vanish at an end of an arc."""
        same, watched = self.tolerances.same, self.watched
        number_of_event = self.diagram.arcs[k].events[side]
        kind = self.diagram.events[number_of_event].kind if number_of_event >= 0 else None
        values = self.setting.formulas.values(
            Box(balls(x[: len(self.setting.units)])),
            range(watched.inequalities),
        )
        sizes = middles(values) * self.setting.weights[:-1][: watched.inequalities]
        d = len(self.setting.units)
        sizes[list(face)] = x[d : d + len(face)]
        zeros = set(np.flatnonzero(abs(sizes) <= same).tolist())
        if kind is BranchKind.END:
            zeros.add(watched.end if side else watched.start)
        if kind is BranchKind.FOLD:
            zeros.add(watched.turn)
        if abs(x[-1]) <= same:
            zeros |= {watched.energy, watched.turn}
        return frozenset(zeros)

    def _contradiction(self, arc: Arc, places: Sequence[Array], found: EnclosedArc) -> str:
        """Return what the diagram says of an arc that differs from what is proved; or nothing."""
        if arc.index != found.index:
            return f"its index is {found.index}, not {arc.index}"
        if min(arc.events) < 0:
            return "it does not end at events"
        same, setting = self.tolerances.same, self.setting
        rows, d = found.tubes[0].system.rows, len(setting.units)
        values = [float(setting.formulas.values(Box(balls(q)), rows[-1:])[0].mid()) for q in places]
        if not np.allclose(values, arc.energies, rtol=same, atol=same):
            return "its energies are not those of its points"
        points = np.array([null_unknowns(setting, found.face, place) for place in places])
        some = [f for f in map(self.pitchforks.get, arc.events) if isinstance(f, Pitchfork)]
        if not all(self._on(found, x) or self._beside(some, points, x) for x in points):
            return "its points are not on the curve"
        inner = points[:, -1] > self.tolerances.beside
        weights = np.array([setting.weights[row] for row in rows])
        lam = points[inner, d:-1] * weights[:-1] / (points[inner, -1:] * weights[-1])
        for column, row in zip(lam.T, rows, strict=False):
            given = arc.multipliers.get(self.names[row])
            near = self.tolerances.near
            if given is not None and not np.allclose(given[inner], column, rtol=near, atol=near):
                return f"its multipliers of {self.names[row]} are not those of its points"
        return ""

    def _on(self, found: EnclosedArc, x: Array) -> bool:
        """Whether a point is near the curve that is proved."""
        near = balls(x)
        for one in found.tubes:
            if not one.enclosure.predictor.cell.reach[0].contains(one.place(near)[0]):
                continue
            there = point(one.system.pinned(one.system.normal, x.tolist()), near, self.options.bits)
            if not isinstance(there, Undecided) and one.contains(there.solution):
                return self._same(there.solution, x)
        return False

    def _beside(self, some: Sequence[Pitchfork], points: Array, x: Array) -> bool:
        """Whether a point of an arc is near a curve of a pitchfork."""
        near, bits = self.tolerances.near, self.options.bits
        evens = [one.is_trunk(list(points), near) for one in some]
        pairs = zip(some, evens, strict=True)
        return any(self._same(one.beside(x, even=even, bits=bits), x) for one, even in pairs)

    def _same(self, known: "list[Ball]", x: Array) -> bool:
        pairs = zip(known, x.tolist(), self.setting.units, strict=False)
        return all(abs(a - ball(b)) <= self.tolerances.same * unit for a, b, unit in pairs)

    def event(self, k: int, arcs: Sequence[EnclosedArc]) -> EnclosedEvent:
        """Return what is shown of an event."""
        try:
            return self._shown(k, arcs)
        except UnshownError as error:
            return EnclosedEvent([], reason=str(error))

    def _shown(self, k: int, arcs: Sequence[EnclosedArc]) -> EnclosedEvent:
        event = self.diagram.events[k]
        ends = [
            End(arcs[j], side)
            for j, arc in enumerate(self.diagram.arcs)
            for side in (0, 1)
            if arc.events[side] == k
        ]
        own = {j for j, arc in enumerate(self.diagram.arcs) if k in arc.events}
        need(set(event.arcs) == own, "its arcs are not those that end there")
        one = decided(self.pitchforks.get(k))
        if one is not None:
            found = one.event(ends, self.tolerances.near, self.options.bits)
        else:
            found = enclosed_event(self.setting, ends, self.watched, self.options)
        need(found.kind is event.kind, f"it is of the kind {found.kind.name}")
        low, high = self.times(k, found)
        same = self.tolerances.same * (1 + abs(event.parameter))
        need(low - same <= event.parameter <= high + same, f"it is at {low:.9g}")
        at = middles(found.where[: self.setting.n])
        apart = abs(self.problem.polyhedron.manifold.difference(at, event.point))
        here = (apart <= self.tolerances.near * self.problem.scales).all()
        need(here, "its point is another one")
        return found

    def others(
        self,
        arcs: Sequence[EnclosedArc],
        events: Sequence[EnclosedEvent],
        box: Domain,
        progress: Progress,
    ) -> Array:
        """Return boxes in which there may be equilibria that are not on the arcs."""
        interval = self.diagram.interval
        tubes: list[Tube | Pitchfork] = [
            *(tube for arc in arcs for tube in arc.tubes),
            *chain.from_iterable(
                event_tubes(self.setting, event, self.watched, self.options) for event in events
            ),
            *(one for one in self.pitchforks.values() if isinstance(one, Pitchfork)),
        ]
        lifted = lifted_problem(self.problem, tuple(self.diagram.rates))
        sides = np.append(box.lower, interval[0]), np.append(box.upper, interval[1])
        return Cover(self.setting, lifted, tubes, sides, self.options).run(progress)

    def evidence(self, arcs: Sequence[EnclosedArc], sides: Domain | None) -> Evidence:
        """Return what the proof is saved with."""
        proved = [
            ProvedArc(a.face, (tuple(sorted(a.zeros[0])), tuple(sorted(a.zeros[1]))),
                      np.array(a.nodes))
            for a in arcs
        ]  # fmt: skip
        box = np.zeros((2, 0)) if sides is None else np.array([sides.lower, sides.upper])
        equations = self.problem.rows - 1 - self.problem.inequalities
        return Evidence.of(self.setting, proved, equations, self.options, box)

    def times(self, k: int, found: EnclosedEvent) -> Interval:
        """Return bounds of the parameter at an event."""
        if not found.where:
            return self.diagram.events[k].parameter, self.diagram.events[k].parameter
        return outward(self.setting.time(found.where[self.setting.n :]))


def _setting(diagram: Diagram, symmetry: Symmetry, most: int) -> Setting:
    problem = diagram.problem
    values, names = problem.parameter_values, tuple(diagram.rates)
    rates = tuple(Fraction(r) for r in diagram.rates.values())
    start = tuple(
        Fraction(float(next(iter(values[name])))) - rate * Fraction(diagram.value)
        for name, rate in zip(names, rates, strict=True)
    )
    arc = max(diagram.arcs, key=lambda a: len(a.points))
    middle = len(arc.points) // 2
    q = arc.points[middle]
    _, gradients, hessians = diagram.problem_at(float(arc.parameters[middle])).evaluate(q, 2)
    sizes = np.linalg.norm(gradients * problem.scales, axis=1) + np.linalg.norm(
        hessians * np.outer(problem.scales, problem.scales), axis=(1, 2)
    )
    sizes = np.where(np.isfinite(sizes) & (sizes > 0), sizes, 1.0)
    lifted = lifted_problem(problem, names)
    known = images(lifted, symmetry, diagram, most)
    weights: list[float] = (0.5 ** np.rint(np.log2(sizes))).tolist()
    # Functions that a symmetry takes to each other have the same.
    m = problem.inequalities
    pairs = [(i, j) for g in known for i, j in enumerate(g.functions) if j >= 0]
    pairs += [(m + i, m + j) for g in known for i, (j, _) in enumerate(g.equations)]
    for i, j in pairs * len(known):
        weights[i] = weights[j] = max(weights[i], weights[j])
    low, high = diagram.interval
    return Setting(
        formulas=Formulas(problem.functions, problem.polyhedron.manifold, (*names, PIN)),
        inequalities=problem.inequalities,
        equations=tuple(independent_equations(problem.polyhedron, [q])),
        start=start,
        rates=rates,
        weights=tuple(weights),
        units=(*problem.scales.tolist(), *((high - low) / 5 * abs(float(r)) for r in rates)),
        images=tuple(known),
    )
