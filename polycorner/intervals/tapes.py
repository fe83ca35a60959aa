"""Programs evaluated in ball arithmetic, naturally and in mean value form."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from polycorner.formulas.programs import Graph, Payload
from polycorner.intervals.balls import (
    ANALYTIC,
    PARTIALS,
    Ball,
    constant,
    current_precision,
    dot,
    narrower,
    operations,
)


@dataclass(frozen=True, eq=False)
class Box:
    """Domain of an evaluation: balls for all inputs, or a parallelotope.

    With ``slopes`` the inputs are ``middle + slopes delta``, for a common ``delta`` in ``reach``;
    a quantity is then also enclosed by its value at ``delta = 0`` plus its slopes times
    ``reach``, the mean value form ([Neumaier] sec. 2.3), which keeps what cancels between inputs
    that move together.

    Attributes
    ----------
    hull : sequence of Ball
        Contains every input.
    middle : sequence of Ball
        The inputs at ``delta = 0``.
    slopes : sequence of sequence of Ball
        The derivatives of each input with respect to each component of ``delta``.
    reach : sequence of Ball
        Contains each component of ``delta``, and 0.
    """

    hull: "Sequence[Ball]"
    middle: "Sequence[Ball]" = ()
    slopes: "Sequence[Sequence[Ball]]" = ()
    reach: "Sequence[Ball]" = ()

    @classmethod
    def moving(
        cls,
        middle: "Sequence[Ball]",
        slopes: "Sequence[Sequence[Ball]]",
        reach: "Sequence[Ball]",
    ) -> "Box":
        """Return the parallelotope ``middle + slopes delta``."""
        hull = [m + dot(row, reach) for m, row in zip(middle, slopes, strict=True)]
        return cls(hull, middle, slopes, reach)


class Tape:
    """A graph's outputs as a list of ball operations."""

    def __init__(self, graph: Graph, outputs: Sequence[int]) -> None:
        self.nodes = graph.needed(outputs)
        self.slots = {a: slot for slot, a in enumerate(self.nodes)}
        self.outputs = [self.slots[a] for a in outputs]
        self._constants: list[tuple[int, Payload]] = []
        self._inputs: list[tuple[int, int]] = []
        self._steps: list[tuple[int, str, Callable[..., Any], tuple[int, ...]]] = []
        self._known: dict[int, list[tuple[int, Ball]]] = {}
        for slot, a in enumerate(self.nodes):
            op, args = graph.nodes[a]
            if op == "const":
                self._constants.append((slot, args[0]))
            elif op == "var":
                self._inputs.append((slot, int(args[0])))
            else:
                places = tuple([self.slots[int(arg)] for arg in args])
                if op == "mul" and args[0] == args[1]:
                    op, places = "square", places[:1]
                self._steps.append((slot, op, operations()[op], places))

    def run(self, box: Box) -> list[Any]:
        """Return the balls (or truth values) of all nodes, in order."""
        if box.slopes:
            return self.moving(box)[0]
        values = self._leaves(box.hull)
        for slot, _, operation, places in self._steps:
            values[slot] = operation(*[values[place] for place in places])
        return values

    def moving(self, box: Box) -> tuple[list[Any], list[Any]]:
        """Return enclosures in a box with slopes, and derivatives of all nodes along ``delta``.

        Every node is evaluated naturally and in mean value form; the narrower is kept.
        Derivatives are ``()`` for nodes independent of ``delta``, and None for nodes that may
        not be differentiable.
        """
        values, middle = self._leaves(box.hull), self._leaves(box.middle)
        slopes: list[Any] = [()] * len(values)
        for slot, position in self._inputs:
            slopes[slot] = box.slopes[position]
        reach = box.reach
        for slot, op, operation, places in self._steps:
            given = [values[place] for place in places]
            value = operation(*given)
            middle[slot] = mean = operation(*[middle[place] for place in places])
            slope = _slope(op, given, value, [slopes[place] for place in places])
            if slope:
                slopes[slot] = slope
                for t, d in zip(slope, reach, strict=True):
                    mean = mean + t * d
                if mean.rad() < value.rad() or not value.is_finite():
                    value = narrower(value, mean)
            elif slope is None:
                slopes[slot] = None
            values[slot] = value
        return values, slopes

    def _leaves(self, inputs: "Sequence[Ball]") -> list[Any]:
        values: list[Any] = [None] * len(self.nodes)
        bits = current_precision()
        if bits not in self._known:
            self._known[bits] = [(slot, constant(value)) for slot, value in self._constants]
        for slot, value in self._known[bits]:
            values[slot] = value
        for slot, position in self._inputs:
            values[slot] = inputs[position]
        return values


def _slope(op: str, given: list[Any], value: Any, inner: list[Any]) -> Any:
    """Return the derivatives of a node along ``delta``, from those of its arguments."""
    if None in inner or op == "select":
        return _branch_slope(op, given, inner)
    if len(inner) == 2:
        u, v = inner
        if u and v:
            if op == "mul":
                x, y = given
                return [s * y + x * t for s, t in zip(u, v, strict=True)]
            if op == "add":
                return [s + t for s, t in zip(u, v, strict=True)]
            if op == "sub":
                return [s - t for s, t in zip(u, v, strict=True)]
        elif not u and not v:
            return ()
    elif not inner[0]:
        return ()
    if op not in PARTIALS or (op == "atan2" and not ANALYTIC["atan2"][1](*given)):
        return None
    total: Any = None
    for partial, slope in zip(PARTIALS[op], inner, strict=True):
        if slope:
            factor = partial(given, value)
            part = [factor * t for t in slope]
            total = part if total is None else [s + t for s, t in zip(total, part, strict=True)]
    return total


def _branch_slope(op: str, given: list[Any], inner: list[Any]) -> Any:
    """Return the derivatives of a selection, or None where an argument has none."""
    if op != "select":
        return None
    condition, slope = given[0], inner[1:]
    if condition is None:
        return () if inner == [(), (), ()] else None
    return slope[0] if condition else slope[1]
