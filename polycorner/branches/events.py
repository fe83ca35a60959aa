"""Events: points at which arcs of equilibria end, and all arcs that leave them.

*Something vanishes.*  Let ``W`` be the inequalities that vanish there with multiplier zero.  Every
subset ``V`` of them is a face, those with a positive multiplier added.  Where its equations have a
regular curve with the tangent ``t``, an arc leaves along ``t`` if along it the multipliers of ``V``
grow, the functions of the rest of ``W`` grow, and so does the energy's multiplier if it vanishes;
all to first order.  One of them that is zero leaves the event undecided.  A single function leads
from one arc to exactly one other ([KojimaHirabayashi] sec. 4): if the parameter goes on, the
equilibrium persists; if it turns back, this is a corner limit ([SchulzPellegrino]), at which the
index of the two arcs differs by one.

*Contacts are exchanged.*  Where gradients of functions that vanish depend, with the energy's
multiplier positive, multipliers are not unique: they are a polytope.  At its vertices they are, on
as many functions as the rank; if none of these multipliers is zero, the arcs that leave are those
of the vertices' faces along which all other functions that vanish grow.  So several contacts that
change at once, by symmetry, are exchanged.

*A curvature along the face vanishes.*  If the curve is regular, the parameter turns back: a fold.
Else this is a branch point (:mod:`polycorner.branches.branching`).

*Gradients depend.*  Where the energy's multiplier vanishes, ``sum mu_i df_i = 0`` with ``mu > 0``,
and ``D`` lies where ``sum mu_i f_i >= 0``.  If the Hessian of this sum is negative definite on the
directions across all ``df_i``, ``D`` is a single point there: a component vanishes.
"""

from collections.abc import Iterator
from itertools import chain, combinations
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from polycorner.branches.branching import branch_point, curves
from polycorner.branches.continuation import Course, Stop, corrected
from polycorner.branches.diagram import BranchKind
from polycorner.branches.network import Arm, Node
from polycorner.branches.system import FritzJohn
from polycorner.polyhedra.cones import null_space, unit_rows
from polycorner.polyhedra.strata import local_pieces
from polycorner.spaces.manifold import Array

# Kinds that are told by what leaves an event.
TOLD = BranchKind.OPENS


Event: TypeAlias = Node[FritzJohn, BranchKind]


def is_decided(node: Event) -> bool:
    """Whether all that leaves an event is known."""
    return not node.notes and not (node.arms and kind_of(node) is BranchKind.UNDECIDED)


def event_at_end(way: Course[FritzJohn]) -> Event:
    """Return the event at the end of a part of a curve."""
    at = way.last
    if way.stop is Stop.FAR:
        return Node(at, BranchKind.FAR)
    if way.stop in {Stop.LOST, Stop.LONG, Stop.LINE}:
        return Node(at, BranchKind.UNDECIDED, notes=[way.stop.value])
    if way.stop is Stop.EVENT:
        return weak_event(at)
    node = flat_event(at, way.tangent)
    vanish = abs(node.at.watched()[0]) <= at.system.tolerances.same
    return weak_event(node.at) if vanish.any() else node


def weak_event(at: FritzJohn) -> Event:
    """Return the event where functions vanish, or multipliers; of more than ten it says so."""
    system, m = at.system, at.system.problem.inequalities
    values, small = at.watched()[0], at.system.tolerances.same
    vanish = abs(values) <= small
    weak = tuple(np.flatnonzero(vanish[:m]).tolist())
    ends = bool(vanish[m + 1 :].any())
    node = Node(at, BranchKind.END if ends else TOLD, weak)
    if ends and not weak:
        return node
    if len(weak) > 10:
        node.notes.append(f"{len(weak)} functions vanish there, more than 10")
        return node
    firm = set(at.face).difference(weak)
    # Relations of equations alone hold with either sign.
    signs = (1.0, -1.0) if vanish[m] and not firm else (1.0,)
    for chosen in chain.from_iterable(combinations(weak, r) for r in range(len(weak) + 1)):
        face = tuple(sorted(firm.union(chosen)))
        for sign in signs:
            x = system.guess(face, at.u, at.s, sign * at.mu)
            node.arms += _leaving(system.point(face, x), node, m + np.flatnonzero(vanish[m:]))
    if node.notes and not vanish[m:].any() and not system.is_sparse:
        return _exchange(node) or node
    if system.is_sparse and vanish[m]:
        node.notes.append("the energy's multiplier vanishes, in a sparse problem")
    return node


def _exchange(node: Event) -> Event | None:
    """Return the event where contacts are exchanged; None if it is none, or not decided."""
    at, system = node.at, node.at.system
    rank, same = system.tolerances.rank, system.tolerances.same
    touching, gradients = sorted({*at.face, *node.weak}), at.known.gradients[:, : system.n]
    held = unit_rows(gradients[[*touching, *system.equations]])
    most = int((np.linalg.svd(held, compute_uv=False) > rank).sum()) - len(system.equations)
    if most == len(touching):
        return None
    found = Node(at, TOLD)
    for face in combinations(touching, most):
        rows = [*face, *system.equations]
        matrix = gradients[rows].T
        if np.linalg.svd(unit_rows(matrix.T), compute_uv=False)[-1] <= rank:
            continue
        mu = np.zeros(system.problem.rows)
        mu[rows], mu[-1] = np.linalg.lstsq(matrix, gradients[-1], rcond=None)[0], 1.0
        mu /= np.linalg.norm(mu)
        if (mu[[*face]] < -same).any():
            continue
        found.weak = tuple(i for i in touching if i not in face)
        start = system.point(face, system.guess(face, at.u, at.s, mu))
        if (mu[[*face]] <= same).any() or abs(start.left).max() > system.tolerances.zero:
            return None
        found.arms += _leaving(start, found, np.zeros(0, dtype=np.intp))
    if found.notes or not found.arms:
        return None
    # The same from both sides.
    always = set.intersection(*({*arm.face} for arm in found.arms))
    found.weak = tuple(i for i in touching if i not in always)
    found.at = found.arms[0].start
    return found


def _leaving(here: FritzJohn, node: Event, also: NDArray[np.intp]) -> Iterator[Arm[FritzJohn]]:
    """Yield the arcs of a face that leave an event where functions vanish."""
    system, m = here.system, here.system.problem.inequalities
    t = here.only_tangent()
    if t is None:
        several = "several curves of one face cross where functions vanish"
        node.notes.append(Stop.LINE.value if _is_line(here) else several)
        return
    values, slopes = here.watched()
    weak = list(node.weak)
    rates = slopes @ t
    least = system.tolerances.same
    if (abs(rates[[*weak, *also]]) <= least).any():
        node.notes.append("something vanishes to second order")
        return
    for side in (1.0, -1.0):
        away = np.sign(values[:m])  # what does not vanish there is far, whatever its size
        away[weak] = side * rates[weak]
        held = list(here.face)
        pressed = (away[held] > 0).all() and (side * rates[also] > 0).all()
        away[held] = 0.0
        pieces = local_pieces(
            system.problem.polyhedron, np.concatenate([away, np.zeros(system.others)]), least / 2
        )
        if pressed and pieces == [frozenset(here.face)]:
            yield Arm(here, side * t)


def flat_event(at: FritzJohn, t: Array) -> Event:
    """Return the event where a curvature along the face vanishes, with the tangent of arrival."""
    if at.is_fold(t):
        return Node(at, BranchKind.FOLD, arms=[Arm(at, at.tangent(t))])
    found = None if at.system.is_sparse else branch_point(at)
    if found is None:
        note = "a curvature vanishes, but neither a fold nor a branch point was found"
        note = Stop.LINE.value if _is_line(at) else note
        return Node(at, BranchKind.UNDECIDED, notes=[note])
    node = Node(found.at, BranchKind.BRANCH)
    tangents, note = curves(found)
    if note:
        node.notes.append(Stop.LINE.value if _is_line(found.at) else note)
    node.arms = [Arm(found.at, sign * v) for v in tangents for sign in (1.0, -1.0)]
    return node


def _is_line(at: FritzJohn) -> bool:
    """Whether equilibria at the same value of the parameter are not isolated there."""
    system, distance = at.system, at.system.tolerances.beside
    if system.is_sparse:
        return False
    fixed = np.eye(len(at.x))[system.n : system.n + system.d]
    along = np.linalg.svd(np.vstack([at.jacobian, fixed]))[2][-1]
    found = corrected(at.moved(at.x + distance * along), fixed[0], distance)
    return found is not None and bool(np.linalg.norm(found.u - at.u) > distance / 2)


def kind_of(node: Event) -> BranchKind:
    """Return the kind of an event, by what leaves it."""
    if node.kind is not TOLD:
        return node.kind
    if node.notes or not node.arms:
        return BranchKind.UNDECIDED
    n, m = node.at.system.n, node.at.system.problem.inequalities
    if len(node.arms) == 1:
        if abs(node.at.x[-1]) > node.at.system.tolerances.same or node.at.watched()[0][m] > 0.5:
            return BranchKind.RE_ENTRANT
        return BranchKind.VANISHES if _is_point(node.at) else BranchKind.DEPENDENT
    if len(node.arms) > 2:
        return BranchKind.BRANCH
    one, two = sorted(node.arms, key=lambda arm: float(arm.direction[n]))
    if one.direction[n] * two.direction[n] > 0:
        return BranchKind.CORNER_LIMIT
    if len(one.face) == len(two.face):
        return BranchKind.EXCHANGE
    return BranchKind.OPENS if len(one.face) > len(two.face) else BranchKind.CLOSES


def _is_point(at: FritzJohn) -> bool:
    """Whether the polyhedron near a point at which gradients depend is this point alone."""
    system, n = at.system, at.system.n
    rows = [i for i in at.face if at.mu[i] > system.tolerances.same]
    small = 10 * system.tolerances.zero
    if not rows or len(local_pieces(system.problem.polyhedron, at.known.values[:-1], small)) != 1:
        return False
    held = at.known.gradients[[*rows, *system.equations], :n]
    held = held[np.linalg.norm(held, axis=1) > system.tolerances.same]
    basis = null_space(np.vstack([unit_rows(held), at.orbit]), system.tolerances.rank)
    bent = np.einsum("i,ijk->jk", at.mu[:-1], at.known.hessians[:-1, :n, :n])
    values = np.linalg.eigvalsh(basis.T @ bent @ basis)
    return bool((values < -system.tolerances.same).all())
