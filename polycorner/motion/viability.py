"""Limits on velocities that forces of bounded size can keep: viable parts of phase space."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from polycorner.checks import instance, mapping, real, refuse
from polycorner.formulas.expressions import as_expression
from polycorner.motion.contacts import motions
from polycorner.polyhedra.groups import AllOf, AnyOf
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.spaces.manifold import Manifold
from polycorner.tolerances import DEFAULT
from polycorner.values import Checked

if TYPE_CHECKING:
    import sympy

Zone = tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class SpeedZones(Checked):
    """Speed limits along a line: one everywhere, and lower ones in zones.

    The allowed states ``(x, v)``, with ``v >= 0``, are a curvilinear polyhedron.  A motion that
    goes fast enough towards a slower zone leaves them, or jumps.  Where ``|x''| <= a``, those
    from which it need not are *viable* ([Aubin]): before a zone ``(x_1, x_2, c)`` they are below
    the braking parabola,

        v^2 <= c^2 + 2 a (x_1 - x)    or    v <= c    or    x >= x_2,

    which is a curvilinear polyhedron, too.  From states in it for all zones, braking by ``a`` keeps
    all limits; from others nothing does.

    Parameters
    ----------
    top : float
        The limit everywhere.
    zones : mapping from str to (float, float, float)
        Begin, end and limit of each zone.
    manifold : Manifold, optional
        The line, with one coordinate; default a line with the coordinate ``x``.

    Raises
    ------
    TypeError, ValueError
        Naming the parameter, what was expected and what came.

    Examples
    --------
    >>> from polycorner import skeleton, stratum_at
    >>> road = SpeedZones(30.0, {"town": (100.0, 200.0, 14.0)})
    >>> viable = road.viable(5.0)
    >>> [bool(viable.contains([x, 30.0])) for x in (20.0, 30.0)]  # (30^2 - 14^2) / 10 = 70.4
    [True, False]
    >>> stratum_at(viable, [100.0, 14.0]).local_type.name
    'UNION'
    >>> corners = skeleton(viable, [[10.0, 29.0], [150.0, 10.0]], extent=1e4).corners
    >>> sorted(corner.point.round(6).tolist() for corner in corners)
    [[29.6, 30.0], [100.0, 14.0], [200.0, 14.0], [200.0, 30.0]]
    """

    top: float
    zones: Mapping[str, Zone]
    manifold: Manifold = field(default_factory=lambda: Manifold.euclidean("x"))

    def __post_init__(self) -> None:
        most = DEFAULT.unbounded
        object.__setattr__(self, "top", real("top", self.top, above=0, most=most))
        if instance("manifold", self.manifold, Manifold).size != 1:
            refuse("manifold", "one coordinate, along the line", self.manifold)
        found = {}
        for name, zone in mapping("zones", self.zones).items():
            if not isinstance(zone, tuple | list) or len(zone) != 3:
                refuse("zones", f"begin, end and limit of {name!r}", zone)
            begin, end, speed = (real("zones", x, least=-most, most=most) for x in zone)
            if name == "top" or not (begin < end and 0 < speed <= self.top):
                most_there = f"a limit up to top, {self.top:g}, for {name!r}"
                expected = f"a begin before the end and {most_there}"
                refuse("zones", expected, zone)
            found[name] = begin, end, speed
        object.__setattr__(self, "zones", found)
        super().__post_init__()

    @property
    def allowed(self) -> Polyhedron:
        """The states within the limits, on places and velocities."""
        return self._polyhedron(None)

    def viable(self, braking: float) -> Polyhedron:
        """Return the states from which the limits can be kept, with ``|x''| <= braking``."""
        return self._polyhedron(_braking(braking))

    def _polyhedron(self, braking: float | None) -> Polyhedron:
        space = motions(self.manifold)
        x, v = space.symbols
        below: list[Any] = []
        for begin, end, c in self.zones.values():
            ahead = begin - x if braking is None else c**2 + 2 * braking * (begin - x) - v**2
            below.append(AnyOf(c - v, ahead, x - end))
        return Polyhedron(space, AllOf(v, self.top - v, *below))

    def limits(self, braking: float | None = None) -> "dict[str, sympy.Expr]":
        """Return the limits of a :class:`~polycorner.System` on the line, by the names of zones.

        With ``braking`` they are those of the viable states: a motion from one of these meets them
        without a jump, and they slow it down by ``braking`` at most.
        """
        import sympy

        x, v = motions(self.manifold).symbols
        rate = None if braking is None else _braking(braking)
        free = (self.top**2 - v**2) / 2
        found = {"top": as_expression("top", free)}
        for name, (begin, end, c) in self.zones.items():
            inside = (c**2 - v**2) / 2
            ahead = free if rate is None else inside + rate * (begin - x)
            cases = (ahead, x < begin), (inside, x < end), (free, True)
            found[name] = sympy.Piecewise(*cases)
        return found


def _braking(given: float) -> float:
    return real("braking", given, above=0, most=DEFAULT.unbounded)
