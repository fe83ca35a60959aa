"""Maps of events in the plane of two parameters: curves, and the points at which they meet."""

from dataclasses import dataclass
from enum import Enum

import numpy as np

from polycorner import checks
from polycorner.branches.diagram import BranchKind
from polycorner.kinds import checked
from polycorner.printing import Printed, Sheet, listed, number
from polycorner.spaces.manifold import Array
from polycorner.values import Checked


class MeetingKind(Enum):
    """What happens at an end of event curves; the value is a sentence."""

    CUSP = "two curves of folds meet in a cusp: three equilibria become one"
    FOLD_AT_CONTACT = "a curve of folds ends on one where a contact changes"
    FOLD_AT_BRANCH = "a curve of folds crosses one of branch points"
    CONTACTS = "several functions vanish: curves of contact changes cross"
    DEPENDENT = "the active gradients become dependent, too"
    END = "the rectangle ends"
    UNDECIDED = "what happens there is not decided"


@dataclass(frozen=True, eq=False)
class MeetingPoint(Checked):
    """A point of the plane at which event curves end.

    Attributes
    ----------
    kind : MeetingKind
    parameters : (2,) array
    point : (n,) array
    functions : tuple of str
        What vanishes there: gaps that close, multipliers that vanish.
    curves : tuple of int
        Numbers of the curves that end there.
    note : str
        What is not decided, and why.
    """

    kind: MeetingKind
    parameters: Array
    point: Array
    functions: tuple[str, ...]
    curves: tuple[int, ...]
    note: str = ""


@dataclass(frozen=True, eq=False)
class EventCurve(Checked):
    """A curve of events of one kind.

    Attributes
    ----------
    kind : BranchKind
        ``OPENS`` where a contact opens or closes.
    active : tuple of str
        The functions that are active on both sides.
    functions : tuple of str
        What vanishes along it beside them.
    parameters : (k, 2) array
    points : (k, n) array
        Coordinates, not wrapped.
    gain : int or None
        How many minima more are on its left than on its right, where it is the only curve; None
        where it is not known, as at branch points.
    meetings : (int, int)
        Numbers of the points at which it begins and ends; -1 for a closed curve.
    """

    kind: BranchKind
    active: tuple[str, ...]
    functions: tuple[str, ...]
    parameters: Array
    points: Array
    gain: int | None
    meetings: tuple[int, int]


@dataclass(frozen=True, eq=False)
class EventMap(Checked, Printed):
    """Events over a rectangle of two parameters; see :func:`event_curves`.

    Attributes
    ----------
    parameters : (str, str)
        Their names.
    rectangle : ((float, float), (float, float))
        The interval of each.
    known : (float, float, int)
        A place in the plane, and the number of minima there.
    curves : tuple of EventCurve
    meetings : tuple of MeetingPoint
    closed : bool
        Whether every curve was followed to its ends, and all that leave meetings were followed.
        Nothing is said of curves that are not connected with the start.
    """

    parameters: tuple[str, str]
    rectangle: tuple[tuple[float, float], tuple[float, float]]
    known: tuple[float, float, int]
    curves: tuple[EventCurve, ...]
    meetings: tuple[MeetingPoint, ...]
    closed: bool

    @checked
    def minima(self, first: float, second: float) -> int | None:
        """Return the number of minima at values of the parameters, by the curves on the way.

        Counted are those that are connected with the start; None where a curve is crossed whose
        gain is not known.

        Raises
        ------
        ValueError
            For values outside the rectangle.
        """
        for name, value, (low, high) in zip(
            ("first", "second"), (first, second), self.rectangle, strict=True
        ):
            checks.real(name, value, least=low, most=high)
        start, count = np.array(self.known[:2]), self.known[2]
        for curve in self.curves:
            signs = _crossings(curve.parameters, start, np.array([first, second]))
            if curve.gain is None and signs:
                return None
            count += signs * (curve.gain or 0)
        return count

    def __repr__(self) -> str:
        """Return the numbers of curves and meetings in one line."""
        names = " and ".join(self.parameters)
        return f"EventMap({len(self.curves)} curves, {len(self.meetings)} meetings; {names})"

    def _sheet(self) -> Sheet:
        curves = [
            (
                str(k),
                c.kind.name,
                ", ".join(c.active),
                ", ".join(c.functions),
                str(c.meetings)[1:-1],
            )
            for k, c in enumerate(self.curves)
        ]
        meetings = [
            (*(number(x, 6) for x in m.parameters), m.kind.name, ", ".join(m.functions))
            for m in self.meetings
        ]
        heads = ("curve", "kind", "active", "vanish", "meetings")
        return Sheet(
            repr(self),
            (
                listed("Curves", heads, curves, len(curves)),
                listed("Meetings", (*self.parameters, "kind", "vanish"), meetings, len(meetings)),
            ),
        )


def _crossings(line: Array, start: Array, end: Array) -> int:
    """Return how often a line of points is crossed from right to left, less from left to right."""
    way = end - start
    aside = (line - start) @ np.array([-way[1], way[0]])  # positive on the left of the way
    one, two = aside[:-1], aside[1:]
    over = (one < 0) != (two < 0)
    part = one[over] / (one[over] - two[over])
    places = line[:-1][over] + part[:, None] * np.diff(line, axis=0)[over]
    along = (places - start) @ way / max(float(way @ way), np.finfo(float).tiny)
    within = (along > 0) & (along < 1)
    return int(np.sign(one[over] - two[over])[within].sum())
