"""Points of event curves: events of equilibria in the plane of two parameters.

With two parameters ``s`` the Fritz John points of a face are a surface.  On it the events are
curves, along which one equation more holds:

*Something vanishes*
    the gap of an open function, with the multiplier zero: a contact opens or closes; or the
    multiplier of the energy: the active gradients are dependent.
*A curvature along the face vanishes*
    an eigenvalue ``lam`` of the Lagrangian's Hessian ``L`` on the kernel of the gradients ``G``:
    ``L v - G' w = lam v``, ``G v = 0``.  Its derivative is that of ``v'Lv - 2 w'Gv`` at fixed ``v``
    and ``w``; as this is a second derivative ``z' J z`` of the equations, with their Jacobian ``J``
    and ``z = (v, w)``, two evaluations of ``J`` give it ([Gov] ch. 4, with this bordering).

Several that vanish together all along, by symmetry, are more equations than unknowns, which have
solutions nevertheless; so has a branch point of a symmetry, with the equation that the point does
not move along ``v``.  Newton's method with least squares finds them, and no others.
"""

import math
from dataclasses import replace
from itertools import chain, combinations
from typing import Self

import numpy as np

from polycorner.branches.continuation import corrected
from polycorner.branches.diagram import BranchKind
from polycorner.branches.events import kind_of, weak_event
from polycorner.branches.system import Face, FritzJohn, FritzJohnSystem
from polycorner.spaces.manifold import Array

FOLD, SYMMETRIC = 1, 2  # how a curvature vanishes


class EventPoint(FritzJohn):
    """The equations of an event at a guess.

    Attributes
    ----------
    own : tuple of int
        What vanishes, in the order of :meth:`FritzJohn.watched`; functions are not of the face.
    flat : int
        0; FOLD, where a curvature vanishes; or SYMMETRIC, where one of an odd direction does.
    right : array
        The unit vector along which equilibria at fixed parameters move there, to first order.
    bend, push : float, (d,) array
        At a fold the second derivative of the equations along ``right``, and the first by the
        parameters, both in the direction of their left null vector.
    """

    def __init__(
        self,
        system: FritzJohnSystem,
        face: Face,
        x: Array,
        own: tuple[int, ...] = (),
        flat: int = 0,
        right: Array | None = None,
    ) -> None:
        super().__init__(system, face, x)
        self.own, self.flat, self.right, self.bend = own, flat, np.zeros(len(x)), 0.0
        self.place: int | list[int] = []  # of the curvature that vanishes
        values, slopes = super().watched()
        rows, left, lines = self.jacobian, [self.left, values[[*own]]], [slopes[[*own]]]
        if flat and self.finite and len(self.curvatures()):
            lam, slope = self._flatten(rows, right)
            left, lines = [*left, np.array([lam])], [*lines, slope[None]]
            if flat == SYMMETRIC:
                left, lines = [*left, np.zeros(1)], [*lines, self.right[None]]
        self.left, self.jacobian = np.concatenate(left), np.vstack([rows, *lines])
        self.finite = bool(self.finite and np.isfinite(self.jacobian).all())

    def _flatten(self, rows: Array, like: Array | None) -> tuple[float, Array]:
        """Return the curvature that vanishes, and its derivative by the unknowns."""
        system, n, p = self.system, self.system.n, self.system.n + self.system.d
        curvatures, vectors = self.spectrum
        # Where a second one vanishes by symmetry directions tell which is which.
        alike = 1.0 if like is None else abs(vectors @ like[:n])
        small = abs(curvatures) + system.tolerances.near
        self.place = int(np.argmax(alike / small))
        lam, v = float(curvatures[self.place]), vectors[self.place]
        gradients = self.known.gradients[system.rows(self.face)[:-1], :n]
        w = np.linalg.lstsq(gradients.T, self.curvature @ v - lam * v, rcond=None)[0]
        z, mu = np.concatenate([v, np.zeros(p - n), w, [0.0]]), self.x[p:]
        right = z.copy()
        right[p:] -= (z[p:] @ mu) * mu
        sign = -1.0 if like is not None and right[: len(like)] @ like < 0 else 1.0
        left = sign * np.concatenate([v, -w, np.zeros(len(rows) - n - len(w))])
        h = system.tolerances.difference / np.linalg.norm(z)
        ends = [FritzJohn(system, self.face, self.x + side * h * z).jacobian for side in (1, -1)]
        slope = sign * left @ (ends[0] - ends[1]) / (2 * h)
        self.right = sign * right / np.linalg.norm(right)
        self.bend, self.push = float(slope @ self.right), left @ rows[:, n:p]
        return lam, slope

    def moved(self, x: Array) -> Self:
        """Return the equations at another guess."""
        return type(self)(self.system, self.face, x, self.own, self.flat, self.right)

    def across(self) -> Array:
        """Return the direction of a second curvature that vanishes, ``(n,)``."""
        values, vectors = self.spectrum
        others = np.delete(np.arange(len(values)), self.place)
        return np.asarray(vectors[others[np.argmin(abs(values[others]))]])

    def turns(self, before: Self) -> float:
        """Return the angle by which the direction of a vanishing curvature has turned."""
        return math.acos(np.clip(self.right @ before.right, -1, 1)) if self.flat else 0.0

    def alike(self, other: "EventPoint") -> bool:
        """Whether another point is one of the same equations."""
        return (self.face, self.own, self.flat) == (other.face, other.own, other.flat)

    def watched(self) -> tuple[Array, Array]:
        """Return what must not be negative along the curve, and derivatives."""
        values, slopes = super().watched()
        values[[*self.own]], slopes[[*self.own]] = 1.0, 0.0
        return values, slopes

    @property
    def subsets(self) -> list[Face]:
        """Sets of functions among those that vanish, which are held on one side or the other."""
        m = self.system.problem.inequalities
        own = [i for i in self.own if i < m]
        return [*chain.from_iterable(combinations(own, r) for r in range(len(own) + 1))]

    def spectra(self) -> list[Array]:
        """Return curvatures along all faces that meet there; at a fold the others and the bend."""
        if not self.flat:
            return [self.curvatures(some) for some in self.subsets]
        others = np.delete(self.curvatures(), self.place)
        return [others, np.array([self.bend])] if self.flat == FOLD else [others]


def sliced(at: FritzJohn, direction: Array) -> FritzJohn:
    """Return a point in the line of parameters through it in a direction ``(d,)``."""
    system, p = at.system, at.system.n + at.system.d
    half = system.length / 2
    line = replace(
        system,
        start=system.values(at.both - half * direction),
        rates=(system.rates @ direction)[:, None],
    )
    return line.point(at.face, np.concatenate([at.u, [half], at.x[p:]]))


def kind_and_gain(at: EventPoint, tangent: Array) -> tuple[BranchKind, int | None]:
    """Return what happens across an event curve, and how many minima more are on its left.

    OPENS stands for CLOSES as well, which is the same in the other direction.  The number is None
    at branch points.
    """
    n = at.system.n
    way = tangent[n : n + 2]
    normal = np.array([-way[1], way[0]]) / np.linalg.norm(way)
    if at.flat:
        side = -np.sign(at.bend * (at.push @ normal))
        stable = not (at.spectra()[0] < 0).any()
        fold = at.flat == FOLD
        return (BranchKind.FOLD, int(side * stable)) if fold else (BranchKind.BRANCH, None)
    node = weak_event(sliced(at, normal))
    kind, gain, h = kind_of(node), 0, at.system.tolerances.beside
    for arm in node.arms:
        here = arm.start
        # Where gradients are dependent the parameter moves to second order only.
        ahead = corrected(here.moved(here.x + h * arm.direction), arm.direction, h)
        moved = 0.0 if ahead is None else ahead.s - here.s
        if abs(moved) > at.system.tolerances.zero and ahead is not None:
            gain += int(np.sign(moved) * (not (ahead.curvatures() < 0).any()))
        elif kind in {BranchKind.OPENS, BranchKind.CLOSES, BranchKind.CORNER_LIMIT}:
            kind = _of_corner(here, arm.direction)
    simple = kind not in {BranchKind.BRANCH, BranchKind.UNDECIDED}
    return (BranchKind.OPENS if kind is BranchKind.CLOSES else kind), gain if simple else None


def _of_corner(at: FritzJohn, direction: Array) -> BranchKind:
    """Return what happens at a corner with a function too many, by what loses its multiplier."""
    mu, rates = at.x[at.system.n + 1 :], direction[at.system.n + 1 :]
    left = np.full(len(mu), np.inf)
    np.divide(mu, -rates, out=left, where=rates < 0)
    return BranchKind.VANISHES if np.argmin(left) == len(mu) - 1 else BranchKind.EXCHANGE
