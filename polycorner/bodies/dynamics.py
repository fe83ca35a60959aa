"""The mechanical system of an arrangement: inertia, weight, contacts and friction."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from itertools import chain, islice
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np
from numpy.typing import ArrayLike

from polycorner import checks
from polycorner.bodies.frames import Frame
from polycorner.bodies.kernels import together
from polycorner.bodies.lattices import Lattice
from polycorner.bodies.laws import Both, ContactLaws
from polycorner.bodies.masses import Mass, stated_mass
from polycorner.bodies.neighbours import Pair, pairs
from polycorner.bodies.pairs import PlacedPart, Touch, both_sharp, distances
from polycorner.bodies.poses import Placement
from polycorner.bodies.rigid_motions import carried, turned
from polycorner.bodies.shapes import Part
from polycorner.bodies.slips import ROLLING, SLIDING, slips_at_wall, slips_of
from polycorner.bodies.walls import WallTouch
from polycorner.checks import refuse
from polycorner.formulas.expressions import as_expression
from polycorner.formulas.functions import SmoothFunction, with_numbers
from polycorner.formulas.fusion import written_out
from polycorner.motion.attraction import Attraction
from polycorner.motion.bodies import RUBBING, PairLaw
from polycorner.motion.contacts import (
    PAIR,
    ContactFamily,
    Friction,
    PairFriction,
    motions,
    time_symbol,
    velocities,
)
from polycorner.motion.convex_sets import ConvexSet
from polycorner.motion.friction import Disc, Interval
from polycorner.motion.hulls.contacts import Hull, HullContacts
from polycorner.motion.noise import OPTIONS
from polycorner.motion.rotations import rotational_energy
from polycorner.spaces.manifold import Array, Manifold
from polycorner.tolerances import DEFAULT

if TYPE_CHECKING:
    import sympy

NONE = (0.0, 0.0)  # no friction
MOST_VERTICES = 64  # of a sharp part that moves: two of them have 35,000 pairs of edges


def masses_of(placements: tuple[Placement, ...], density: float, given: Any) -> dict[str, Mass]:
    """Return the mass of every body: a given one, or that of a uniform body."""
    given = checks.mapping("masses", given)
    checks.names("masses", given, [p.name for p in placements])
    found = {}
    for p in placements:
        mass = stated_mass(p.name, p.body, given, density)
        if len(mass.centre) != p.body.dimension:
            refuse("masses", f"a centre of {p.body.dimension} numbers for {p.name!r}", mass.centre)
        if not _as_round_as_the_body(p, mass):
            expected = f"a mass of {p.name!r} that looks the same when turned as the body does"
            refuse("masses", f"{expected}, or orientations='all'", mass)
        found[p.name] = mass
    return found


def _as_round_as_the_body(p: Placement, mass: Mass) -> bool:
    """Whether the coordinates of a body tell how its mass is placed."""
    size = DEFAULT.alike * p.body.size
    if p.frame is Frame.SHIFTED and p.is_round:
        return bool(np.abs(mass.centre).max() <= size)
    if p.frame is not Frame.AXIAL:
        return True
    off = mass.centre - (mass.centre @ p.axis) * p.axis
    along = p.axis @ mass.inertia @ p.axis
    across = (np.trace(mass.inertia) - along) / 2
    even = across * np.eye(3) + (along - across) * np.outer(p.axis, p.axis)
    skew = np.abs(mass.inertia - even).max()
    return bool(np.abs(off).max() <= size and skew <= DEFAULT.alike * np.trace(mass.inertia))


def energies(
    placements: tuple[Placement, ...], masses: Mapping[str, Mass], gravity: Any, turning: ArrayLike
) -> "tuple[sympy.Expr, sympy.Expr, dict[str, sympy.Expr]]":
    """Return kinetic and potential energy, and applied forces, as formulas.

    The kinetic energy is that of the centre of mass and of the rotation about it.  Weight that does
    not change has the potential energy; what is added to it as the time goes by is applied.  In
    axes that turn there are the potential and the forces of :func:`inertial_forces` as well.
    """
    import sympy

    d, omega = placements[0].body.dimension, np.atleast_1d(turning)
    constant, changing = _pull([0.0] * d if gravity is None else gravity, d, omega)
    kinetic = potential = sympy.S.Zero
    forces: dict[str, sympy.Expr] = {}
    for p in placements:
        mass = masses[p.name]
        rates = velocities(p.manifold)
        centre = p.frame.point(p.name, p.frame.local(mass.centre.tolist(), p.body.axis), d)[:d]
        moving = [
            sum(sympy.diff(c, q) * v for q, v in zip(p.manifold.symbols, rates, strict=True))
            for c in centre
        ]
        energy = mass.mass * sum(v**2 for v in moving) / 2 + _rotation(p, mass, rates)
        centrifugal, deflecting = inertial_forces(p, energy, omega)
        kinetic += energy
        potential += centrifugal
        potential -= mass.mass * sum(g * c for g, c in zip(constant, centre, strict=True))
        work = mass.mass * sum(g * c for g, c in zip(changing, centre, strict=True))
        for q, deflects in zip(p.manifold.symbols, deflecting, strict=True):
            if (force := sympy.diff(work, q) + deflects) != 0:
                forces[q.name] = force
    return kinetic, potential, forces


def inertial_forces(
    p: Placement, kinetic: "sympy.Expr", turning: Array
) -> "tuple[sympy.Expr, list[sympy.Expr]]":
    """Return the centrifugal potential of a body in axes that turn, and the Coriolis forces.

    Where a placement ``q`` of the body has the velocity ``u(q)`` if it rests in axes that turn, the
    kinetic energy is ``T(q, v + u) = T(q, v) + a.v + T(q, u)`` with ``a = M u``.  So ``-T(q, u)``
    is a potential, and Lagrange's equations of ``a.v`` give the forces ``(da_j/dq_i - da_i/dq_j)
    v_j``, which do no work ([Lanczos] ch. 4).
    """
    import sympy

    q, v, d = p.manifold.symbols, velocities(p.manifold), p.body.dimension
    if not turning.any():
        return sympy.S.Zero, [sympy.S.Zero] * len(q)
    omega = [sympy.Float(x) for x in turning.tolist()]
    motion = [sympy.S.Zero] * d + omega
    field = [*carried(motion, q[:d]), *turned(p.frame, omega, q[d:])]
    at_rest = dict(zip(v, field, strict=True))
    a = [sympy.diff(kinetic, rate).xreplace(at_rest) for rate in v]
    forces = [
        sum((sympy.diff(a[j], q[i]) - sympy.diff(a[i], q[j])) * v[j] for j in range(len(q)))
        for i in range(len(q))
    ]
    return -sympy.expand(kinetic.xreplace(at_rest)), [sympy.expand(force) for force in forces]


def _pull(gravity: Any, dimension: int, turning: Array) -> "tuple[list[float], list[sympy.Expr]]":
    """Return what does not depend on the time in each component of gravity, and the rest.

    In axes that turn the components are those in the axes at the time.
    """
    import sympy

    expected = f"{dimension} finite numbers, or expressions of time_symbol()"
    now = time_symbol()
    if isinstance(gravity, np.ma.MaskedArray):
        refuse("gravity", expected, gravity, TypeError)
    try:
        given = [as_expression("gravity", component) for component in gravity]
    except TypeError:
        refuse("gravity", expected, gravity, TypeError)
    free = set().union(*(component.free_symbols for component in given))
    strange = (sympy.I, sympy.oo, -sympy.oo, sympy.zoo, sympy.nan)
    if len(given) != dimension or free - {now} or any(part.has(*strange) for part in given):
        refuse("gravity", expected, gravity)
    if turning.any():
        given = _turned_back(given, turning, now)
    parts = [component.as_independent(now, as_Add=True) for component in given]
    return [float(constant) for constant, _ in parts], [changing for _, changing in parts]


def _turned_back(
    vector: "list[sympy.Expr]", turning: Array, time: "sympy.Symbol"
) -> "list[sympy.Expr]":
    """Return a vector in axes that turn, by Rodrigues' formula; expanded."""
    import sympy

    speed = float(np.linalg.norm(turning))
    x, y, z = (*vector, sympy.S.Zero)[:3]
    n = (turning / speed).tolist() if len(turning) == 3 else [0, 0, float(np.sign(turning[0]))]
    along = n[0] * x + n[1] * y + n[2] * z
    across = n[1] * z - n[2] * y, n[2] * x - n[0] * z, n[0] * y - n[1] * x
    cosine, sine = sympy.cos(speed * time), sympy.sin(speed * time)
    found = [
        cosine * g - sine * c + (1 - cosine) * along * w
        for g, c, w in zip((x, y, z), across, n, strict=True)
    ]
    return [sympy.expand(component) for component in found[: len(vector)]]


def _rotation(p: Placement, mass: Mass, rates: "tuple[sympy.Symbol, ...]") -> "sympy.Expr":
    """Return the energy of the rotation about the centre of mass."""
    import sympy

    if p.frame is Frame.TURNED:
        return mass.inertia * rates[-1] ** 2 / 2
    if p.frame is Frame.ROTATED:
        return rotational_energy(p.manifold, mass.inertia)
    if p.frame is Frame.AXIAL:
        # Without spin the axis u turns with |u'|, about an axis across.
        along = p.axis @ mass.inertia @ p.axis
        across = (np.trace(mass.inertia) - along) / 2
        return across * sum(v**2 for v in rates[3:]) / 2
    return sympy.S.Zero


def friction_of(
    manifold: Manifold,
    touches: list[Touch],
    walls: list[WallTouch],
    sliding: Mapping[str, Both],
    rolls: Mapping[str, Both],
) -> tuple[Friction, ...]:
    """Return dry friction and rolling resistance where a coefficient is positive."""
    space = motions(manifold)
    rubbing: dict[str, list[PlacedPart]] = {t.gap.name: [t.one, t.two] for t in touches}
    rubbing |= {t.gap.name: [t.member] for t in walls}
    slips: dict[str, Callable[[str], tuple[SmoothFunction, ...]]] = {
        t.gap.name: partial(slips_of, space, t) for t in touches
    }
    slips |= {t.gap.name: partial(slips_at_wall, space, t) for t in walls}
    laws: list[Callable[..., Friction]] = []
    rows: list[tuple[SmoothFunction, ...]] = []
    for argument, by_name, kind, verb in (
        ("friction", sliding, SLIDING, "slips"),
        ("rolling", rolls, ROLLING, "rolls"),
    ):
        for label in slips:
            static, dynamic = by_name.get(label, NONE)
            if static == 0:
                continue
            _check_turning(argument, rubbing[label], static)
            d = rubbing[label][0].part.dimension
            sticks, slides = _set(static, d), _set(dynamic, d)
            law = partial(Friction, f"{label} {verb}", static=sticks, load=label, dynamic=slides)
            laws.append(partial(law, kind=kind))
            rows.append(slips[label](kind))
    shared = iter(together(chain.from_iterable(rows)))
    return tuple(
        law(slip=tuple(islice(shared, len(components))))
        for law, components in zip(laws, rows, strict=True)
    )


def attraction_of(
    touches: list[Touch], walls: list[WallTouch], pulls: Mapping[str, Attraction]
) -> "sympy.Expr":
    """Return the potential energy of the attraction at contacts by name."""
    import sympy

    gaps = [*(t.gap for t in touches), *(t.gap for t in walls)]
    pulled = (pulls[g.name].energy(with_numbers(g)) for g in gaps if g.name in pulls)
    return sum(pulled, sympy.S.Zero)


def _set(mu: float, dimension: int) -> ConvexSet:
    return Interval(mu) if dimension == 2 else Disc(mu)


def _check_turning(argument: str, rubbing: list[PlacedPart], given: Any) -> None:
    for member in rubbing:
        if member.frame in {Frame.SHIFTED, Frame.AXIAL}:
            missing = "coordinates of all rotations (orientations='all')"
            refuse(argument, f"{missing}, those of {member.body!r} too", given)


def twins(
    placements: tuple[Placement, Placement], lattice: Lattice
) -> tuple[tuple[Placement, Placement], list[Pair]]:
    """Return two bodies like given ones, called after these with 1 and 2, and parts that meet."""
    one, two = (
        replace(p, name=f"{p.name}{k}", manifold=renamed(p, f"{p.name}{k}"))
        for p, k in zip(placements, PAIR, strict=True)
    )
    return (one, two), pairs(lattice, (one, two), {})


def touching_twins(
    placements: tuple[Placement, Placement], lattice: Lattice
) -> tuple[tuple[Placement, Placement], list[Touch], HullContacts | None]:
    """Return these and their contacts, those of sharp parts apart."""
    pair, meeting = twins(placements, lattice)
    space = pair[0].manifold * pair[1].manifold
    smooth = (parts for parts in meeting if not both_sharp(*parts))
    touches = [t for parts in smooth for t in distances(space, *parts)]
    return pair, touches, _twin_hulls(pair, meeting, lattice)


def _twin_hulls(
    pair: tuple[Placement, Placement], meeting: list[Pair], lattice: Lattice
) -> HullContacts | None:
    """Return the contacts of the sharp parts of two bodies, of the second the nearest image."""
    sharp = [parts for parts in meeting if both_sharp(*parts)]
    if not sharp:
        return None
    made = {m.name: _hull(m.name, m.part) for parts in sharp for m in parts}
    scale = pair[0].manifold.scales[0]
    return HullContacts(
        [(made[one.name], made[two.name]) for one, two in sharp],
        (pair[0].manifold.size, pair[1].manifold.size),
        (OPTIONS.overlap * scale, OPTIONS.touching * scale),
        (*pair[0].manifold.names, *pair[1].manifold.names),
        lattice.lengths.tolist(),
    )


def between(
    placements: tuple[Placement, Placement], lattice: Lattice, known: ContactLaws
) -> ContactFamily | HullContacts:
    """Return the contacts of any two bodies like two given ones, by the laws of this pair.

    The two, which may be the same, are called after these, with 1 and 2, and so are their
    coordinates.  In a periodic box the second is the nearest image.
    """
    pair, meeting = twins(placements, lattice)
    space, d = pair[0].manifold * pair[1].manifold, pair[0].body.dimension
    sharp = [parts for parts in meeting if both_sharp(*parts)]
    touches = [t for parts in meeting if parts not in sharp for t in distances(space, *parts)]
    definitions, gaps = written_out({t.gap.name: t.gap for t in touches})
    both, laws = motions(space), []
    name = "-".join(p.name for p in placements)
    if sharp:
        _refuse_attraction(known.attraction.get(name))
    for argument, given, kind, cause in (
        ("friction", known.friction, SLIDING, RUBBING),
        ("rolling", known.rolling, ROLLING, ROLLING),
    ):
        static, dynamic = given.get(name, NONE)
        if static == 0:
            continue
        if sharp and argument == "rolling":
            _refuse_rolling(static)
        _check_turning(argument, [*meeting[0]], static)
        sets = _set(static, d), _set(dynamic, d)
        slips = {t.gap.name: slips_of(both, t, kind) for t in touches}
        laws.append(PairFriction(slips, *sets, cause))
    scale, restitution = pair[0].manifold.scales[0], known.restitution.get(name, 0.0)
    reach = sum(p.body.size for p in placements) / scale
    position = tuple(dict.fromkeys(n for p in placements for n in p.manifold.names[:d]))
    family = None
    if touches:
        family = ContactFamily(
            gaps,
            reach,
            position,
            friction=tuple(laws),
            restitution=restitution,
            definitions=definitions,
            attraction=known.attraction.get(name),
        )
    hulls = _twin_hulls(pair, meeting, lattice)
    if hulls is None:
        assert family is not None, name
        return family
    return replace(
        hulls,
        reach=reach,
        position=position,
        laws=tuple(PairLaw(f.static.dimension, f.static, f.moving, f.kind) for f in laws),
        restitution=restitution,
        further=family,
    )


def _refuse_rolling(given: float) -> NoReturn:
    msg = (
        f"rolling: expected 0 between sharp polygons or polyhedra, which roll on no radius; got "
        f"{given}"
    )
    raise NotImplementedError(msg)


def _refuse_attraction(given: Attraction | None) -> None:
    """Raise for attraction between sharp parts, whose gaps begin and end as these turn and pass."""
    if given is not None:
        msg = (
            f"attraction: expected none between sharp polygons or polyhedra, whose gaps have no "
            f"potential energy (round one of them); got {given}"
        )
        raise NotImplementedError(msg)


def listed_hulls(one: PlacedPart, two: PlacedPart, scale: float) -> HullContacts:
    """Return the contacts of two sharp parts, of which one may be fixed, without friction."""
    if one.image or two.image:
        msg = (
            f"period: expected no images of sharp bodies that are listed; repeat one (count=) or "
            f"round them; got {one.name}-{two.name}"
        )
        raise NotImplementedError(msg)
    return HullContacts(
        [(_hull(one.name, one.part), _hull(two.name, two.part))],
        (len(one.coordinates), len(two.coordinates)),
        (OPTIONS.overlap * scale, OPTIONS.touching * scale),
        (*one.coordinates, *two.coordinates),
    )


def rubbing_hulls(
    contacts: HullContacts, one: PlacedPart, two: PlacedPart, known: ContactLaws
) -> HullContacts:
    """Return contacts of two sharp parts with friction by the laws of each."""
    d, rubbing = one.part.dimension, {}
    for label in contacts.names:
        _refuse_attraction(known.attraction.get(label))
        if known.rolling.get(label, NONE)[0]:
            _refuse_rolling(known.rolling[label][0])
        static, dynamic = known.friction.get(label, NONE)
        if static:
            rubbing[label] = _set(static, d), _set(dynamic, d)
            _check_turning("friction", [m for m in (one, two) if m.coordinates], static)
    return replace(contacts, friction=rubbing)


def _hull(label: str, part: Part) -> Hull:
    """Return a sharp part with the numbers that the compiled code needs."""
    facets = part.facets
    assert facets is not None, label
    if len(part.points) > MOST_VERTICES:
        why = "since contacts are as many as pairs of edges"
        expected = f"at most {MOST_VERTICES} vertices of {label!r}, {why}"
        refuse("bodies", expected, len(part.points))
    on = np.array([face[0] for face in facets.faces])
    return Hull(label, part.points, facets.normals, on, facets.edges)


def renamed(p: Placement, name: str) -> Manifold:
    """Return the manifold of a body of another name."""
    named = p.frame.manifold(name, p.body.dimension, 1.0, 1.0, "")
    return replace(named, scales=p.manifold.scales, units=p.manifold.units)
