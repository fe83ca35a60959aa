"""Systems of the mechanics textbook, small enough for closed forms.

Each function returns a :class:`~polycorner.motion.system.System`, in metres, kilograms and seconds.
Unless said otherwise masses, radii of balls and the length of the pendulum are 1.

==================  ====================================================================
inclines            ``x`` points down the slope, ``y`` away from it, at the angle ``angle``
belts               the substrate moves with the speed ``belt`` along ``x``
turns in the plane  positive anticlockwise, from ``x`` to ``y``
``a``, ``b``        turns of a ball; rolling without slip makes ``x' = r a'``, ``y' = r b'``
==================  ====================================================================
"""

import math
from collections.abc import Sequence
from itertools import pairwise

from polycorner.motion.contacts import (
    ContactFamily,
    Friction,
    pair_coordinates,
    time_symbol,
    velocities,
)
from polycorner.motion.convex_sets import ConvexSet
from polycorner.motion.system import System
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.spaces.manifold import Manifold

GRAVITY = 9.81  # m/s^2
END = 1000.0  # where planes end, in m
Point = tuple[float, float]


def bouncing_ball(restitution: float = 1.0, impact: str = "poisson") -> System:
    """Return a point at the height ``y >= 0`` that falls and bounces off a ``floor``.

    Dropped from ``h`` it lands after ``t = sqrt(2 h / g)``.  With ``e = 1`` it is back after
    ``2 t``, with ``e < 1`` it comes to rest after ``t (1 + e) / (1 - e)``, having bounced
    infinitely often.
    """
    M = Manifold.euclidean("y", unit="m")
    (y,), (v,) = M.symbols, velocities(M)
    floor = Polyhedron(M, {"floor": y})
    return System(floor, v**2 / 2, GRAVITY * y, restitution=restitution, impact=impact)


def sliding_block(
    static: ConvexSet,
    dynamic: ConvexSet | None = None,
    *,
    angle: float = 0.0,
    belt: float = 0.0,
    stiffness: float = 0.0,
) -> System:
    """Return a block that slides on an incline or a belt, in ``x`` and ``y``, up to a ``stop``.

    Its load is known, ``g cos(angle)``; friction acts in two directions, and a spring of the given
    ``stiffness`` may hold the block at ``x = 0``.  With Coulomb's disc the block stays where
    ``tan(angle) <= mu``, and slides down with ``g (sin(angle) - mu cos(angle))``.
    """
    M = Manifold.euclidean("x y")
    (x, _), (vx, vy) = M.symbols, velocities(M)
    load = GRAVITY * math.cos(angle)
    table = Friction("table", (vx - belt, vy), static, (load,), dynamic)
    return System(
        Polyhedron(M, {"stop": END - x}),
        (vx**2 + vy**2) / 2,
        stiffness * x**2 / 2 - GRAVITY * math.sin(angle) * x,
        friction=(table,),
    )


def ball_on_plane(
    sliding: ConvexSet, rolling: ConvexSet | None = None, *, angle: float = 0.0, belt: float = 0.0
) -> System:
    """Return a solid ball that slides and rolls on a plane, in ``x``, ``y``, ``a``, ``b``.

    Its load is known, ``g cos(angle)``.  ``rolling`` resists the turns: torques per radius and
    load.  Down an incline the ball rolls with ``5/7 g sin(angle)``, without slip while
    ``tan(angle) <= 7/2 mu``; pushed without spin it ends up rolling at ``5/7`` of its speed.
    """
    M = Manifold.euclidean("x y a b")
    (x, _, _, _), (vx, vy, va, vb) = M.symbols, velocities(M)
    load = GRAVITY * math.cos(angle)
    slip = (vx - va - belt, vy - vb)
    friction = [Friction("plane", slip, sliding, (load,))]
    if rolling is not None:
        turning = (va, vb)
        friction.append(Friction("rolling", turning, rolling, (load,), kind="rolling"))
    return System(
        Polyhedron(M, {"stop": END - x}),
        (vx**2 + vy**2) / 2 + (va**2 + vb**2) / 5,
        -GRAVITY * math.sin(angle) * x,
        friction=tuple(friction),
    )


def thrown_ball(friction: ConvexSet, restitution: float = 0.0, impact: str = "poisson") -> System:
    """Return a solid ball that spins in the plane and bounces off a rough ``floor``; ``x y a``.

    An impact at the speed ``w`` with the slip ``s = x' - r a'`` changes ``x'`` by ``-2/7 s`` if
    that needs no more than ``mu (1 + e) w``, else by ``mu (1 + e) w`` against the slip.
    """
    M = Manifold.euclidean("x y a")
    (_, y, _), (vx, vy, va) = M.symbols, velocities(M)
    rough = Friction("rough", (vx - va,), friction, "floor")
    return System(
        Polyhedron(M, {"floor": y - 1}),
        (vx**2 + vy**2) / 2 + va**2 / 5,
        GRAVITY * y,
        friction=(rough,),
        restitution=restitution,
        impact=impact,
    )


def wall_pendulum(wall: float = 0.0, restitution: float = 1.0, impact: str = "poisson") -> System:
    """Return a pendulum at the angle ``theta >= wall`` from its lowest place; ``|wall| < pi / 2``.

    The wall is vertical and hit by the bob.  Amplitudes and periods follow from the energy, which
    an impact at the angular speed ``w`` lowers by ``(1 - e^2) (l w)^2 / 2``.
    """
    import sympy

    M = Manifold.euclidean("theta")
    (theta,), (w,) = M.symbols, velocities(M)
    return System(
        Polyhedron(M, {"wall": sympy.sin(theta) - math.sin(wall)}),
        w**2 / 2,
        -GRAVITY * sympy.cos(theta),
        restitution=restitution,
        impact=impact,
    )


def dome() -> System:
    """Return a point on a smooth round ``dome`` about the origin, in ``x`` and ``y``.

    Let go at the angle ``c`` from the top it leaves the dome where ``cos(angle) = 2/3 cos(c)``.
    """
    import sympy

    M = Manifold.euclidean("x y")
    (x, y), (vx, vy) = M.symbols, velocities(M)
    gap = sympy.sqrt(x**2 + y**2) - 1
    return System(Polyhedron(M, {"dome": gap}), (vx**2 + vy**2) / 2, GRAVITY * y)


def bead_in_ring() -> System:
    """Return a bead that slides without friction or weight inside a ``ring``, in ``x`` and ``y``.

    Once it is on the ring it goes round at the speed it has along it.
    """
    import sympy as sp

    M = Manifold.euclidean("x y")
    (x, y), (vx, vy) = M.symbols, velocities(M)
    D = Polyhedron(M, {"ring": 1 - sp.sqrt(x**2 + y**2)})
    return System(D, (vx**2 + vy**2) / 2, sp.Integer(0))


def row_of_balls(
    masses: Sequence[float] = (1.0, 1.0, 1.0), restitution: float = 1.0, impact: str = "poisson"
) -> System:
    """Return balls in a row, on a line without forces: ``x_1 < x_2 < ...``.

    Contacts that close together obey the law of impact together ([Moreau]): the first of three
    equal balls hits two at rest that touch, and ``(1, 0, 0)`` becomes ``(-1, 2, 2) / 3``.  If they
    are apart, however little, the impacts follow each other and ``(0, 0, 1)`` comes out.
    """
    M = Manifold.euclidean(" ".join(f"x{i + 1}" for i in range(len(masses))))
    gaps = {f"{a.name}{b.name}": b - a - 1 for a, b in pairwise(M.symbols)}
    kinetic = sum(m * v**2 for m, v in zip(masses, velocities(M), strict=True)) / 2
    return System(Polyhedron(M, gaps), kinetic, restitution=restitution, impact=impact)


def newtons_cradle(balls: int, restitution: float = 1.0, impact: str = "poisson") -> System:
    """Return equal balls of diameter 1 in a row, any two of which may meet; ``x`` of each.

    Unlike :func:`row_of_balls` these are bodies of one system, with a family of contacts.  Balls
    that are apart, however little, meet one pair after another, and an elastic pair exchanges its
    velocities: where ``k`` balls come in, ``k`` go out.
    """
    import sympy

    M = Manifold.euclidean("x")
    (x,), (v,) = M.symbols, velocities(M)
    (x1,), (x2,) = pair_coordinates(M)
    apart = ContactFamily({"balls": sympy.Abs(x2 - x1) - 1}, reach=1.0, restitution=restitution)
    ends = Polyhedron(M, {"left": END + x, "right": END - x})
    rest = sympy.Integer(0)
    return System(ends, v**2 / 2, rest, count=balls, between=apart, impact=impact)


def dispersing_billiard(radius: float = 0.5) -> System:
    """Return a point in the square ``|x|, |y| <= 1`` about a ``disc``, elastic and without forces.

    Almost every motion fills the table ([Sinai]): places are distributed uniformly, the angle of
    incidence with the density ``cos(angle) / 2``, and the mean path between impacts is
    ``pi A / P``, with the area ``A`` and the perimeter ``P`` of the table, disc included
    ([Chernov]).
    """
    import sympy

    M = Manifold.euclidean("x y")
    (x, y), (vx, vy) = M.symbols, velocities(M)
    walls = {"left": 1 + x, "right": 1 - x, "bottom": 1 + y, "top": 1 - y}
    table = Polyhedron(M, walls | {"disc": sympy.sqrt(x**2 + y**2) - radius})
    return System(table, (vx**2 + vy**2) / 2, sympy.Integer(0), restitution=1.0)


def shaken_stack(blocks: int, amplitude: float, frequency: float) -> System:
    """Return blocks of height 1 on each other, ``y1`` to ``yn``, seen from a floor that is shaken.

    The floor is at ``A sin(w t)``, so that the weight of a block is ``g - A w^2 sin(w t)``.  While
    this is positive, the contact under block ``k``, ``floor`` or ``on<k - 1>``, carries it
    ``n - k + 1`` times.  When it vanishes, the whole stack leaves the floor.
    """
    import sympy

    M = Manifold.euclidean(" ".join(f"y{k + 1}" for k in range(blocks)))
    y, v = M.symbols, velocities(M)
    gaps = {"floor": y[0]} | {f"on{k + 1}": b - a - 1 for k, (a, b) in enumerate(pairwise(y))}
    lift = amplitude * frequency**2 * sympy.sin(frequency * time_symbol())
    return System(
        Polyhedron(M, gaps),
        sum(w**2 for w in v) / 2,
        GRAVITY * sum(y),
        forces=dict.fromkeys(M.names, lift),
    )


def block_in_wedge(half_angle: float, friction: ConvexSet, pull: Point) -> System:
    """Return a block of mass 1 in a groove, under the force ``pull``; it starts at the apex ``0``.

    The faces, ``right`` and ``left``, are ``half_angle`` off the axis ``y``.  Rest at the apex is
    possible where the opposite of ``pull`` is a sum of forces in the two friction cones.  Where the
    angle of friction exceeds ``half_angle``, the cones contain each other's apex: rest is possible
    whatever pulls the block, with forces that are indeterminate.  A pull out of the groove then has
    two answers, since rigid faces that do not press let it go.
    """
    M = Manifold.euclidean("x y")
    (x, y), (vx, vy) = M.symbols, velocities(M)
    s, c = math.sin(half_angle), math.cos(half_angle)
    faces = {"right": s * y - c * x, "left": s * y + c * x}
    rough = (
        Friction("right grip", (s * vx + c * vy,), friction, "right"),
        Friction("left grip", (-s * vx + c * vy,), friction, "left"),
    )
    force = -pull[0] * x - pull[1] * y
    return System(Polyhedron(M, faces), (vx**2 + vy**2) / 2, force, friction=rough)


def bead_on_hoop(spin: float, friction: ConvexSet) -> System:
    """Return a bead of mass 1 on a rough ``hoop`` of radius 1 that turns about its diameter ``y``.

    Seen from the hoop, in its plane, ``V = g y - spin^2 x^2 / 2``; the sides that push the bead
    round are smooth.  At the angle ``a`` from the lowest place the force along the hoop is
    ``(spin^2 cos(a) - g) sin(a)``, and across it ``spin^2 sin(a)^2 + g cos(a)``: the bead may stick
    where the first is at most ``mu`` times the second, and slides elsewhere.
    """
    import sympy

    M = Manifold.euclidean("x y")
    (x, y), (vx, vy) = M.symbols, velocities(M)
    hoop = Polyhedron(M, {}, equations={"hoop": sympy.sqrt(x**2 + y**2) - 1})
    rough = Friction("grip", (x * vy - y * vx,), friction, "hoop")
    potential = GRAVITY * y - spin**2 * x**2 / 2
    return System(hoop, (vx**2 + vy**2) / 2, potential, friction=(rough,))


def body_on_plane(
    corners: Sequence[Point],
    inertia: float,
    friction: ConvexSet,
    *,
    restitution: float = 0.0,
    impact: str = "poisson",
    angle: float = 0.0,
    belt: float = 0.0,
) -> System:
    """Return a rigid body of mass 1 that touches a plane with its corners; ``x y theta``.

    ``corners`` are seen from the centre of mass, ``inertia`` is about it.  Corner ``i`` has the
    contact ``foot<i>``, from 1, and friction of its own.
    """
    import sympy

    M = Manifold.euclidean("x y theta")
    (x, y, theta), (vx, vy, w) = M.symbols, velocities(M)
    gaps, rough = {}, []
    for i, (along, across) in enumerate(corners, start=1):
        up = along * sympy.sin(theta) + across * sympy.cos(theta)
        gaps[f"foot{i}"] = y + up
        rough.append(Friction(f"grip{i}", (vx - up * w - belt,), friction, f"foot{i}"))
    return System(
        Polyhedron(M, gaps),
        (vx**2 + vy**2 + inertia * w**2) / 2,
        GRAVITY * (math.cos(angle) * y - math.sin(angle) * x),
        friction=tuple(rough),
        restitution=restitution,
        impact=impact,
    )


def box_on_plane(
    half_width: float,
    half_height: float,
    friction: ConvexSet,
    *,
    restitution: float = 0.0,
    impact: str = "poisson",
    angle: float = 0.0,
    belt: float = 0.0,
) -> System:
    """Return a box on its two lower corners, ``foot1`` at ``-half_width`` and ``foot2``.

    It slides as a block does, without tipping where ``mu < half_width / half_height``.  A box that
    rocks changes feet without restitution with ``w+ / w- = 1 - 3/2 sin(c)^2``, ``tan(c)`` the ratio
    of width to height ([Housner]): what hits sticks, what stood lifts off, and the angular momentum
    about the new foot stays.
    """
    feet = [(-half_width, -half_height), (half_width, -half_height)]
    inertia = (half_width**2 + half_height**2) / 3
    options = {"restitution": restitution, "angle": angle, "belt": belt}
    return body_on_plane(feet, inertia, friction, impact=impact, **options)


def rimless_wheel(
    spokes: int, friction: ConvexSet, *, inertia: float = 0.1, angle: float = 0.0
) -> System:
    """Return a wheel of unit spokes, ``2 c = 2 pi / spokes`` apart, that falls from foot to foot.

    Angular momentum about the new foot stays: ``w+ / w- = (I + cos(2 c)) / (I + 1)``.  At
    ``theta = 0`` it stands on its first and last foot; down a slope ``theta`` falls.
    """
    half = math.pi / spokes
    turns = [half - math.pi / 2 + 2 * half * i for i in range(spokes)]
    feet = [(math.cos(turn), math.sin(turn)) for turn in turns]
    return body_on_plane(feet, inertia, friction, angle=angle)
