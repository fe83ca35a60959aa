"""Joints between bodies, or of one with space, as users describe them."""

from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from polycorner import checks
from polycorner.bodies.shapes import Turn
from polycorner.checks import refuse
from polycorner.formulas.expressions import as_expression
from polycorner.kinds import check_fields
from polycorner.values import Checked

if TYPE_CHECKING:
    import sympy

WORLD = "world"  # the parent of joints with space itself


@dataclass(frozen=True, eq=False)
class Joint(Checked):
    """Base of joints of two bodies.

    The *parent* is a body, a fixed body, or ``"world"``; the *child* is a body.  Both anchors come
    together; ``at`` is in the coordinates of the parent, which are those of space for ``"world"``
    and for fixed bodies, and ``on`` in the coordinates of the child.  Default are the origins.
    """

    parent: str
    child: str
    at: ArrayLike | None = None
    on: ArrayLike | None = None
    _: KW_ONLY
    collide: bool = False

    def __post_init__(self) -> None:
        check_fields(self)
        if self.parent == self.child:
            refuse("child", f"another body than the parent {self.parent!r}", self.child)
        for name in ("at", "on", "axis"):
            given = getattr(self, name, None)
            if given is None:
                continue
            vector = checks.numbers(name, given, "2 or 3 finite numbers")
            if vector.shape not in {(2,), (3,)} or not np.isfinite(vector).all():
                refuse(name, "2 or 3 finite numbers", given)
            if name == "axis" and not vector.any():
                refuse(name, "2 or 3 numbers, not all zero", given)
            size = np.linalg.norm(vector) if name == "axis" else 1.0
            object.__setattr__(self, name, vector.astype(np.float64) / size)
        super().__post_init__()

    @property
    def bodies(self) -> tuple[str, ...]:
        """The names of what it joins."""
        return self.parent, self.child


@dataclass(frozen=True, eq=False)
class _Limited(Joint):
    """A joint with an axis and a coordinate that may have limits."""

    axis: ArrayLike | None = None
    turn: Turn | None = None
    limits: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        if self.limits is not None:
            object.__setattr__(self, "limits", checked_limits(self.limits))
        super().__post_init__()


def checked_limits(given: Any) -> tuple[float, float]:
    """Return a least and a larger value, or raise."""
    expected = "a pair of a least and a larger value, of which one may be infinite"
    pair = checks.numbers("limits", given, expected)
    if pair.shape != (2,) or not pair[0] < pair[1] or np.isinf(pair).all():
        refuse("limits", expected, given)
    return float(pair[0]), float(pair[1])


class Hinge(_Limited):
    """A hinge: anchors come together, and the child turns about the axis; two or five equations.

    The coordinate is the angle of the child against the parent in radians, right-handed about the
    axis, in the plane counterclockwise, and zero where the child is turned by ``turn``.

    Parameters
    ----------
    parent, child : str
        Names of a body, a fixed body or ``"world"``; and of a body.
    at, on : (d,) array, optional
        The anchor in coordinates of the parent (of space for ``"world"`` and fixed bodies), and in
        those of the child; default the origins.
    axis : (3,) array
        In coordinates of the parent; none in the plane.
    turn : float or scipy.spatial.transform.Rotation, optional
        The rotation of the child in the parent at the angle 0; default none.
    limits : (float, float), optional
        Of the angle: the inequalities ``<name>.min`` and ``<name>.max``, if they are less than a
        turn apart equal to the angle from the limit to the first order.  Else turns are counted, by
        a coordinate of the arrangement that follows the angle (the equation ``<name>.turns``).
    collide : bool, optional
        Whether the two may touch each other as well; default False.

    Raises
    ------
    TypeError, ValueError
        Naming the parameter, what was expected and what came.

    Examples
    --------
    A bar hangs from a nail by one end:

    >>> from polycorner.bodies import Arrangement, Hinge, capsule
    >>> bar = capsule([-1, 0], [1, 0], 0.1)
    >>> a = Arrangement({"A": bar}, joints={"nail": Hinge("world", "A", at=[0, 2], on=[-1, 0])})
    >>> a.polyhedron.equation_names
    ('nail.x', 'nail.y')
    >>> a.point(joints={"nail": -0.5}).round(3).tolist()
    [0.878, 1.521, -0.5]
    """


class Slider(_Limited):
    """A slider: the child moves along an axis of the parent without turning; two or five equations.

    The coordinate is the position of the child's anchor from the parent's along the axis.

    Parameters
    ----------
    parent, child, at, on, turn, collide
        As for :class:`Hinge`.
    axis : (d,) array
        In coordinates of the parent.
    limits : (float, float), optional
        Of the position; one may be infinite.

    Examples
    --------
    >>> from polycorner.bodies import Arrangement, Slider, disc
    >>> rail = Slider("world", "A", axis=[1, 0], limits=(0.0, 2.0))
    >>> a = Arrangement({"A": disc(0.5)}, joints={"rail": rail})
    >>> a.polyhedron.names, a.polyhedron.equation_names
    (('rail.min', 'rail.max'), ('rail.off', 'rail.turn'))
    """


class Planar(_Limited):
    """A table: the child moves and turns in a plane of the parent, in space; three equations.

    Parameters
    ----------
    parent, child, at, on, turn, collide
        As for :class:`Hinge`.
    axis : (3,) array
        Across the plane, in coordinates of the parent.
    """


class Ball(Joint):
    """A ball joint: anchors come together, and the child turns freely; ``d`` equations.

    Parameters
    ----------
    parent, child, at, on, collide
        As for :class:`Hinge`.  Bodies of revolution that are held on their axis keep the
        coordinates of an axis, discs and balls held at their centres none of an orientation.

    Examples
    --------
    >>> from polycorner.bodies import Arrangement, Ball, sphere
    >>> a = Arrangement({"A": sphere(1.0)}, joints={"pin": Ball("world", "A", at=[0, 0, 1])})
    >>> a.polyhedron.equation_names
    ('pin.x', 'pin.y', 'pin.z')
    """


@dataclass(frozen=True, eq=False)
class Fixed(Joint):
    """Two bodies that move as one: anchors come together without turning; three or six equations.

    Parameters
    ----------
    parent, child, at, on, turn, collide
        As for :class:`Hinge`.  A rigid union of parts from the start is a
        :func:`~polycorner.bodies.compound`, which costs nothing.
    """

    turn: Turn | None = None


@dataclass(frozen=True, eq=False)
class Rail(Joint):
    """A rail: the child's anchor stays on a line or plane curve of the parent; ``d - 1`` equations.

    The child turns freely.  On a line the coordinate is the position from the parent's anchor.

    Parameters
    ----------
    parent, child, at, on, collide
        As for :class:`Hinge`.
    axis : (d,) array
        The direction of the line, in coordinates of the parent; of a curve in space that across
        its plane.
    curve : sympy.Expr, optional
        A function of the symbols ``x`` and ``y`` that vanishes on the curve, about the parent's
        anchor: in the plane along the axes of the parent, in space along two directions across the
        axis (for the axis ``z`` they are ``x`` and ``y``).
    limits : (float, float), optional
        Of the position on a line.
    """

    axis: ArrayLike | None = None
    curve: "sympy.Expr | None" = None
    limits: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        if self.limits is not None:
            object.__setattr__(self, "limits", checked_limits(self.limits))
            if self.curve is not None:
                refuse("limits", "none on a curve", self.limits)
        if self.curve is not None:
            formula = as_expression("curve", self.curve)
            unknown = sorted({s.name for s in formula.free_symbols} - {"x", "y"})
            if unknown or not formula.free_symbols:
                refuse("curve", "a function of the symbols x and y", formula)
            object.__setattr__(self, "curve", formula)
        super().__post_init__()


@dataclass(frozen=True, eq=False)
class Gear(Checked):
    """A gear: the coordinate of one joint is a multiple of that of another; one equation.

    It joins two hinges, a hinge and a slider (a rack and a pinion, a screw) or two sliders:
    ``second = ratio * first + phase``.  Angles count modulo a turn.  With ``further`` joints it is
    a differential, ``second = ratio * first + sum(further[name] * name) + phase``: of a planetary
    gear whose sun has ``s`` teeth and whose ring has ``r``,
    ``Gear("sun", "ring", -s / r, further={"carrier": 1 + s / r})``.

    Parameters
    ----------
    first, second : str
        Names of two hinges, sliders or straight rails.
    ratio : float
        Not zero; negative for wheels that roll on each other.  Of two hinges a fraction with a
        denominator of at most ``teeth``, in lowest terms.
    phase : float, optional
        Of the second one where all others are zero; default 0.
    teeth : int, optional
        The largest denominator of the ratios of hinges; default 1000.
    further : mapping from str to float, optional
        Ratios of further joints, as ``ratio``; default none.
    """

    first: str
    second: str
    ratio: float
    phase: float = 0.0
    teeth: int = 1000
    further: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        check_fields(self)
        if self.first == self.second:
            refuse("second", f"another joint than {self.first!r}", self.second)
        if both := {self.first, self.second} & self.further.keys():
            refuse("further", "joints other than the first and the second one", min(both))
        object.__setattr__(self, "ratio", _ratio("ratio", self.ratio))
        more = {name: _ratio("further", x) for name, x in self.further.items()}
        object.__setattr__(self, "further", more)
        object.__setattr__(self, "phase", checks.real("phase", self.phase))
        checks.whole("teeth", self.teeth, least=1)
        super().__post_init__()

    @property
    def bodies(self) -> tuple[str, ...]:
        """None: the joints have them."""
        return ()

    @property
    def joints(self) -> tuple[str, ...]:
        """The names of the joints, the second one last."""
        return self.first, *self.further, self.second

    @property
    def coefficients(self) -> dict[str, float]:
        """By these names those of the sum that is ``phase``, of the second one 1."""
        return {self.first: -self.ratio, **{n: -x for n, x in self.further.items()}, self.second: 1}


def _ratio(argument: str, given: Any) -> float:
    ratio = checks.real(argument, given)
    if ratio == 0:
        refuse(argument, "a number that is not zero", given)
    return ratio


AnyJoint = Joint | Gear
