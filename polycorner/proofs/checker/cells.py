"""Strict local minima for all parameters in a box, cell by cell.

The file divides the box by a tree of splits, each node before its halves.  In each cell Krawczyk's
operator shows, for all its parameters together, that the equations of ``minimum.py`` have one
solution in a box of coordinates and multipliers, and the hypotheses are checked there.  As all
matrices of their derivatives are regular on the box, the Hessian has one inertia along the face,
which is that in the middle.  Cells for which this is not shown at once are bisected.
"""

from collections.abc import Iterator
from typing import Any

from flint import arb

from .balls import NotShownError, hull, moved, need, places
from .minimum import StoredMinimum
from .rationals import decimals, ratios
from .statement import MOST_NAMED

PIECES = 64  # into which a cell is bisected at most


class StoredCells(StoredMinimum):
    """A strict local minimum for each value of some parameters."""

    def show(self) -> None:
        """Check the tree, and the hypotheses in each cell."""
        count, record = self.p.n - self.size, self.record
        need(count, "a box of parameters has parameters")
        self.lower, self.upper = (
            [float.fromhex(text) for text in record[side]] for side in ("lower", "upper")
        )
        ends = list(zip(self.lower, self.upper, strict=True))
        fine = all(abs(a) < float("inf") and a < b < float("inf") for a, b in ends)
        need(len(ends) == count and fine, "sides of the box of parameters")
        self.pressing, self.cells = self.active, 0
        self.found: list[arb] = []
        waiting = [(self.lower, self.upper)]
        for node in record["tree"]:
            need(waiting, "the tree has too many nodes")
            lo, hi = waiting.pop()
            if "start" in node:
                start = [arb(x) for x in ratios(node["start"], self.size, "a start")]
                self.cover(start, lo, hi)
                self.cells += 1
            else:
                (axis,) = places([node["axis"]], count, "an axis")
                x = float.fromhex(node["at"])
                need(lo[axis] < x < hi[axis], f"a cell is split at {x}")
                waiting += [(moved(lo, axis, x), hi), (lo, moved(hi, axis, x))]
        need(not waiting, "the tree is incomplete")

    def cover(self, start: list[arb], lower: list[float], upper: list[float]) -> None:
        """Check a cell, or all parts of a bisection of it."""
        waiting = [(lower, upper)]
        for _ in range(PIECES):
            lo, hi = waiting.pop()
            middle = [0.5 * (a + b) for a, b in zip(lo, hi, strict=True)]
            whole = hull(lo, hi)
            try:
                point = self.settled(start, [arb(x) for x in middle], whole)
                (value,) = [self.p.values([*point, *whole])[self.p.outputs[self.energy]]]
                need(value.is_finite(), "the energy is not bounded")
            except NotShownError as error:
                reason = f"{error}"
                shares = [
                    (b - a) / (d - c)
                    for a, b, c, d in zip(lo, hi, self.lower, self.upper, strict=True)
                ]
                axis = shares.index(max(shares))
                need(lo[axis] < middle[axis] < hi[axis], reason)
                waiting += [
                    (moved(lo, axis, middle[axis]), hi), (lo, moved(hi, axis, middle[axis])),
                ]  # fmt: skip
                continue
            new: list[Any] = [*point, value]
            old = self.found or new
            self.found = [x.union(y) for x, y in zip(old, new, strict=True)]
            if not waiting:
                return
        need(False, f"a cell is not covered: {reason}")

    def said(self) -> Iterator[str]:
        """Yield the parts of the statement."""
        ends = zip(self.p.names[self.size :], self.lower, self.upper, strict=True)
        box = " and ".join(f"{name} from {a} to {b}" for name, a, b in ends)
        yield f"for all {box} there is a strict local minimum"
        *point, energy = [decimals(x, x) for x in self.found]
        if self.size <= MOST_NAMED:
            sides = zip(self.p.names, point, strict=False)
            yield ", ".join(f"{name} between {a} and {b}" for name, (a, b) in sides)
        yield f"its energy is between {energy[0]} and {energy[1]}"
        yield from self.modulo()
        if self.pressing:
            yield f"supported by {self.named(self.pressing)}"
        yield f"{self.cells} cells"
        yield self.problem()
