"""How deep dyads lie, and the passes over which they open or change hand, with both bounds.

The energy of :mod:`~polycorner.dumbbells.statics.relative` is a monotone function of the height of
the balls: with the pair straight below the axis, the sum of the heights of the four balls is

    h = 4 (rho - sqrt(rho^2 - E/2))

above that of ``G``, where ``E = 0``; in the plane ``E`` is the limit of ``rho h``.  Weights of
balls are 1, and a rod of the weight ``w`` multiplies energies by ``1 + w/2``.

Where the energy is at most that of a pair side by side, placements outside the box can be pushed
into it along ``x`` and ``y``: dumbbells do not touch on the way, and the energy does not rise.  So
components of sublevel sets are those in the box.

**Closed forms.**  Where balls touch side by side their centres are ``rho sin(phi) = r`` from the
vertical plane through the axis.  One such contact, the outer balls on the lowest line, is at
``h = 2 (rho - sqrt(rho^2 - r^2))``, ``r^2`` in the plane.  Two of them, at four balls, are twice as
high, and ``E = 2 r^2``.  Lengths and rods do not matter.

**Tilted drums.**  The part of the weight along the drum does work in shifts of the whole pair only.
Up to shifts, heights are those in a level drum times the cosine of the tilt.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from polycorner.dumbbells.pair import DumbbellPair
from polycorner.dumbbells.statics.relative import RelativePlacements, height_of
from polycorner.landscapes import Barrier, Landscape, Minimum, Pass, landscape
from polycorner.toolkit import (
    Checked,
    Printed,
    Progress,
    Sheet,
    Table,
    Value,
    cached_property,
    checked,
    facts,
    number,
    silent,
)

if TYPE_CHECKING:
    import sympy

Bounds = tuple[float, float]
BEYOND = 1.1  # times the energy of a pair side by side, up to which a landscape is asked for
DIGITS = 12  # after the decimal point, of heights that are shown
HANDS = {"delta_L", "delta_R"}


def highest(pair: DumbbellPair) -> float:
    """Return an energy beyond that of a pair side by side, over which a dyad changes its hand."""
    return BEYOND * 2 * pair.ball_radius**2


@dataclass(frozen=True)
class Level(Value):
    """Minima or passes of one kind, the same up to symmetry and reflection.

    Attributes
    ----------
    name : str
        Of minima ``G``, ``delta`` or the contacts that hold the pair there; of passes what they
        join, as ``delta - G`` or, of one hand with the other, ``delta_L - delta_R``.
    height : (float, float)
        Bounds of the height of all of them above ``G``.
    contacts : tuple of str
        Those of the first.
    numbers : tuple of int
        Their numbers in the landscape, in which balls and dumbbells are labelled.
    """

    name: str
    height: Bounds
    contacts: tuple[str, ...]
    numbers: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class PairLandscape(Checked, Printed):
    """Minima and passes of a pair up to rolling and shifts, by height; see :func:`pair_landscape`.

    Heights are sums over the balls in mm, times the weight of a ball.  In the plane they are in
    mm^2, and have to be divided by ``rho`` of the drum that is developed.

    Attributes
    ----------
    pair : DumbbellPair
    landscape : Landscape
        That of the energy ``2 (rho^2 - d^2)``, in mm^2, in the coordinates of
        :class:`~polycorner.dumbbells.RelativePlacements`.
    """

    pair: DumbbellPair
    landscape: Landscape

    @checked
    def height(self, energy: Bounds) -> Bounds:
        """Return bounds of the height above ``G`` that belongs to an energy of the landscape."""
        return max(self._height(energy[0], -math.inf), 0.0), self._height(energy[1], math.inf)

    def _height(self, energy: float, towards: float) -> float:
        if math.isinf(energy):
            return energy
        # The height is right to within its last bit.
        return math.nextafter(height_of(self.pair, energy), towards)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the minima: ``G``, ``delta_R``, ``delta_L``, or contacts of other ones."""
        return tuple(self._name(minimum) for minimum in self.landscape.minima)

    def _name(self, minimum: Minimum) -> str:
        if minimum.kind == "locus":
            return "G"
        if sorted(map(len, minimum.active)) == [3, 3, 4]:
            place = RelativePlacements(self.pair).placement(minimum.point)
            return f"delta_{self.pair.chirality(place)}"
        return " ".join(minimum.active)

    @cached_property
    def minima(self) -> tuple[Level, ...]:
        """The minima, the lowest first."""
        names = zip(self.landscape.minima, self.names, strict=True)
        keys = [(m.orbit if m.kind == "isolated" else 0, _unhanded({name})) for m, name in names]
        return self._levels(self.landscape.minima, keys)

    @cached_property
    def passes(self) -> tuple[Level, ...]:
        """The passes, the lowest first; what may be one joins ``?``."""
        keys = []
        for p in self.landscape.passes:
            names = {"?" if s.minimum is None else self.names[s.minimum] for s in p.sides}
            keys.append((p.orbit, _unhanded(names or {"?"})))
        return self._levels(self.landscape.passes, keys)

    def _levels(
        self, entries: Sequence[Minimum] | Sequence[Pass], keys: list[tuple[int, str]]
    ) -> tuple[Level, ...]:
        levels = []
        for key in dict.fromkeys(keys):
            numbers = tuple(k for k, other in enumerate(keys) if other == key)
            lows, highs = zip(*[entries[k].energy for k in numbers], strict=True)
            height = self.height((min(lows), max(highs)))
            levels.append(Level(key[1], height, entries[numbers[0]].active, numbers))
        return tuple(levels)

    @property
    def rest(self) -> Bounds | None:
        """The height of ``delta`` above ``G``; None if it is no minimum."""
        return next((level.height for level in self.minima if level.name == "delta"), None)

    @cached_property
    def opening(self) -> Barrier | None:
        """The least energy at which a dyad is joined to ``G``, and the way; None without dyads."""
        start = next((k for k, name in enumerate(self.names) if name in HANDS), None)
        ends = [k for k, name in enumerate(self.names) if name == "G"]
        if start is None:
            return None
        barriers = [self.landscape.barrier(start, k) for k in ends]
        lowest = min(barriers, key=lambda one: one.upper)
        return replace(lowest, lower=min(one.lower for one in barriers))

    @property
    def depth(self) -> Bounds | None:
        """How far a dyad has to be lifted until it opens; None if ``delta`` is no minimum."""
        barrier = self.opening
        return None if barrier is None else self._rise((barrier.lower, barrier.upper))

    @property
    def turnover(self) -> Bounds | None:
        """How far a dyad has to be lifted to become one of the other hand without opening.

        Over a pass with a dyad of either hand below it.  Where dyads open at less, the hands are
        joined at less, too, but by way of ``G`` only.
        """
        if self.opening is None:
            return None
        lower = upper = math.inf
        for p in self.landscape.passes:
            names = {self.names[s.minimum] for s in p.sides if s.minimum is not None}
            shown = bool(p.sides) and all(s.verified for s in p.sides)
            if not shown or names == HANDS:
                lower = min(lower, p.energy[0])
            if shown and names == HANDS:
                upper = min(upper, max(p.energy[1], *(s.route.top for s in p.sides if s.route)))
        return self._rise((min(lower, self.landscape.cap), upper))

    def _rise(self, energy: Bounds) -> Bounds:
        low, high = self.rest or (0.0, 0.0)
        bottom, top = self.height(energy)
        return math.nextafter(bottom - high, -math.inf), math.nextafter(top - low, math.inf)

    def _sheet(self) -> Sheet:
        titles = ("", "height from", "to", "number", "contacts of the first")
        tables = [
            Table(titles, tuple(map(_row, levels)), (1, 2, 3), caption)
            for caption, levels in (("Minima", self.minima), ("Passes", self.passes))
        ]
        rises = (("depth of a dyad", self.depth), ("from hand to hand", self.turnover))
        told = [(name, f"{number(r[0])} to {number(r[1])}") for name, r in rises if r]
        unit = "mm^2, times 1/rho for mm" if self.pair.is_plane else "mm"
        return Sheet(
            "Landscape of a pair",
            (
                self.landscape.statement,
                facts(told),
                *tables,
                f"Heights are in {unit}, times the weight of a ball.",
                *self.landscape.notes,
            ),
        )

    def __repr__(self) -> str:
        """Return the statement of the landscape."""
        return f"PairLandscape({self.landscape.statement})"


@checked
def pair_landscape(
    pair: DumbbellPair, *, max_seconds: float = math.inf, progress: Progress = silent
) -> PairLandscape:
    """Find minima and passes of a pair up to that between the hands, with proof.

    Parameters
    ----------
    pair : DumbbellPair
        Two dumbbells in the plane or in a drum.
    max_seconds, progress : optional
        As for :func:`~polycorner.landscapes.landscape`.

    Returns
    -------
    PairLandscape
        Up to a tenth above the energy of two dumbbells side by side, ``2 r^2``.

    Raises
    ------
    TypeError, ValueError
        As :class:`~polycorner.dumbbells.RelativePlacements` does.
    """
    model = RelativePlacements(pair)
    found = landscape(
        model.polyhedron,
        model.energy,
        box=model.box,
        symmetry=model.symmetry,
        cap=highest(pair),
        max_seconds=max_seconds,
        progress=progress,
    )
    return PairLandscape(pair, found)


def plane_depth_formula() -> "sympy.Expr":
    """Return the depth of a dyad in the plane in the symbols ``l``, ``r``, ``t``, in mm^2, derived.

    The energy of two parallel dumbbells, ``p = r + t`` across and ``D = l - sqrt(4 r^2 - p^2)``
    along their axes apart, is a quadratic form in cosine and sine of the heading, so that its least
    value is an eigenvalue.  The pass above it is at ``r^2``.
    """
    import sympy

    length, r, t = sympy.symbols("l r t", positive=True)
    p = r + t
    along = length - sympy.sqrt(4 * r**2 - p**2)
    across = sympy.Matrix([-p, along])  # from centre to centre: its product with (cos, sin)
    form = (across * across.T + sympy.diag(0, length**2)) / 2
    trace, determinant = form.trace(), sympy.expand(form.det())
    return r**2 - (trace - sympy.sqrt(trace**2 - 4 * determinant)) / 2


def _row(one: Level) -> tuple[str, ...]:
    low, high = (number(round(height, DIGITS)) for height in one.height)
    return one.name, low, high, str(len(one.numbers)), " ".join(one.contacts) or "none"


def _unhanded(names: set[str]) -> str:
    """Return names in order, without the hand where they are not those of both hands."""
    return " - ".join(sorted(names if names == HANDS else {n.split("_")[0] for n in names}))
