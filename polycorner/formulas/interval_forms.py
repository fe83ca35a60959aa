"""Sharper bounds of values, from enclosures of their gradients on the same box.

Both forms need ``f`` to be continuous on the box and the enclosure ``[g]`` to contain its
generalised gradient there; elsewhere the bounds stay as they are.

*Mean value form*: ``f(q)`` lies in ``f(c) + [g].([q] - c)`` for every ``c`` in the box
([Neumaier] sec. 2.3); its excess width falls with the square of the width of the box.

*Monotone form*: where ``[g_i]`` has one sign, the least value is taken at one end of side ``i`` and
the greatest at the other, so that both are enclosed on faces of the box.
"""

from collections.abc import Sequence

from llvmlite import ir

from polycorner.formulas.interval_emit import IntervalEmitter
from polycorner.formulas.interval_library import Sides
from polycorner.formulas.ranges import Fact
from polycorner.formulas.rounding import greatest, least

FORMS = ("natural", "mean value", "monotone")
NOTHING = Fact(nonnegative=False, nonpositive=False, size=0.0)


class Sharper:
    """Bounds of values in one of ``FORMS``, by an emitter that has the natural ones.

    ``values`` are the nodes of the functions, ``slopes`` those of their partial derivatives row by
    row, None where one is zero.
    """

    def __init__(
        self, emitter: IntervalEmitter, values: Sequence[int], slopes: Sequence[int | None]
    ) -> None:
        self.emitter, self.r, self.b = emitter, emitter.r, emitter.b
        self.values, count = values, len(slopes) // max(len(values), 1)
        self.rows = [slopes[j * count : (j + 1) * count] for j in range(len(values))]
        self._offsets: dict[int, Sides] = {}
        self._middle: IntervalEmitter | None = None

    def mean_value(self, j: int) -> Sides:
        """Return bounds of function ``j``, in the mean value form where that is better."""
        if self._middle is None:
            points = {i: (c, c) for i, c in self._centre().items()}
            self._middle = IntervalEmitter(self.r, self.emitter.graph, points)
        low, high = self._middle.value(self.values[j])
        for i, slope in self._row(j).items():
            part = self.emitter.product(NOTHING, slope, NOTHING, self._offsets[i])
            low = self.r.add(low, part[0], up=False)
            high = self.r.add(high, part[1], up=True)
        return self._intersected(j, (low, high))

    def monotone(self, j: int) -> Sides:
        """Return bounds of function ``j`` on the faces where it is least and greatest."""
        zero = self.r.splat(0.0)
        lowest, highest = dict(self.emitter.boxes), dict(self.emitter.boxes)
        for i, slope in self._row(j).items():
            low, high = self.emitter.boxes[i]
            rising = self.b.fcmp_ordered(">=", slope[0], zero)
            constant_or_falling = self.b.fcmp_ordered("<=", slope[1], zero)
            falling = self.b.and_(constant_or_falling, self.b.not_(rising))
            lowest[i] = self.b.select(falling, high, low), self.b.select(rising, low, high)
            highest[i] = self.b.select(rising, high, low), self.b.select(falling, low, high)
        low, _ = IntervalEmitter(self.r, self.emitter.graph, lowest).value(self.values[j])
        _, high = IntervalEmitter(self.r, self.emitter.graph, highest).value(self.values[j])
        return self._intersected(j, (low, high))

    def _row(self, j: int) -> dict[int, Sides]:
        """Return the enclosures of the partial derivatives that are not zero."""
        return {i: self.emitter.value(a) for i, a in enumerate(self.rows[j]) if a is not None}

    def _centre(self) -> dict[int, ir.Value]:
        """Return a point of the box; record the box as seen from it."""
        centre = {}
        for i, (low, high) in self.emitter.boxes.items():
            half = self.r.splat(0.5)
            near = self.b.fadd(self.b.fmul(half, low), self.b.fmul(half, high))
            c = centre[i] = greatest(self.b, least(self.b, near, high), low)
            self._offsets[i] = self.r.sub(low, c, up=False), self.r.sub(high, c, up=True)
        return centre

    def _intersected(self, j: int, form: Sides) -> Sides:
        """Keep what is better of natural bounds and others, where those are valid."""
        node, b = self.values[j], self.b
        low, high = self.emitter.value(node)
        better = greatest(b, form[0], low), least(b, form[1], high)
        fine = self.emitter.continuous(node)
        if fine is None:
            return better
        return b.select(fine, better[0], low), b.select(fine, better[1], high)
