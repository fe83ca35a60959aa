"""The mechanical system of an arrangement, whose bodies are listed, or one or several repeated."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from polycorner import checks, signatures
from polycorner.bodies.checking import check_together
from polycorner.bodies.drives import counted_energy, driven, split
from polycorner.bodies.dynamics import (
    attraction_of,
    between,
    energies,
    friction_of,
    listed_hulls,
    masses_of,
    rubbing_hulls,
    touching_twins,
)
from polycorner.bodies.joints import WORLD, AnyJoint
from polycorner.bodies.laws import ContactLaws, Meeting, laws_of
from polycorner.bodies.mechanisms import joined
from polycorner.bodies.neighbours import Pair, check_width
from polycorner.bodies.pairs import Touch, both_sharp, distances
from polycorner.bodies.poses import Placement
from polycorner.bodies.scenes import BodiesInSpace
from polycorner.bodies.several import assembly, check_size, tied
from polycorner.bodies.ties import bouncing, met, owned
from polycorner.checks import refuse
from polycorner.motion.assembly import Assembly
from polycorner.motion.hulls.contacts import HullContacts
from polycorner.motion.limits import rate_limits
from polycorner.motion.system import System
from polycorner.motion.ties import Tie
from polycorner.values import Value

ByName = Mapping[str, Any] | None
signatures.NAMES[ByName] = "ByName"


@dataclass(frozen=True, eq=False)
class Asked(Value):
    """The arguments of :meth:`Arrangement.system`."""

    gravity: Any
    density: float
    masses: Any
    friction: Any
    rolling: Any
    restitution: Any
    attraction: Any
    impact: str
    exits: Any
    count: Any
    joints: Any
    drives: Any
    forces: Any
    rates: Any
    limits: Any
    nonholonomic: Any


def system_of(a: Any, asked: Asked) -> System | Assembly:
    """Return the system of an arrangement ``a``, after checking what is asked."""
    limited = _limited(a, asked)
    held = _further(a, asked.joints)
    if isinstance(asked.count, Mapping):
        return _of_kinds(a, asked, held)
    count, first = checks.whole("count", asked.count, least=1), a.placements[0]
    if count > 1 and len(a.placements) > 1:
        refuse("count", "1, or numbers by name, for several bodies", count)
    if len(a.placements) > 1:
        check_size(a.pairs, a.manifold.size)
    friction, rubbing_ties = split(asked.friction, held)
    drives, ties = asked.drives, list[Tie]()
    if count > 1:
        given = {first: a}, {first.name: count}, held, drives or {}, rubbing_ties
        (drives,), ties = tied(*given)
    elif held:
        refuse("joints", "those of the arrangement where count is 1", [*held])
    friction, rubbing = split(friction, a.joints)
    laws, moved, timed = _laws(a, asked, drives, rubbing)
    touches, hulls = _contacts(a)
    meetings = [*_meetings(a, touches, hulls), *met(ties)]
    if count > 1:
        meetings.append(Meeting(f"{first.name}-{first.name}", first.name, first.name, True))
    known = laws_of(friction, asked.rolling, asked.restitution, meetings, a.named, asked.attraction)
    family = None
    if count > 1:
        check_width(a.lattice, [first.body], [*a.fixed.values()])
        family = between((first, first), a.lattice, known)
    placed = joined(a.mechanism, a.manifold, a.contacts(excluded=False, sharp=False))
    rubbing_at = tuple(rubbing_hulls(one, *pair, known) for one, pair in hulls)
    kinetic, potential, forces = laws
    potential = potential + attraction_of(touches, a.at_walls, known.attraction)
    laws_of_friction = friction_of(a.manifold, touches, a.at_walls, known.friction, known.rolling)
    return System(
        placed,
        kinetic,
        potential,
        forces,
        laws_of_friction + moved,
        restitution=_bounces([*placed.names, *(n for h in rubbing_at for n in h.names)], known),
        count=count,
        between=family,
        exits={} if asked.exits is None else asked.exits,
        hulls=rubbing_at,
        rheonomic=timed,
        scene=_scene(a, count, touches, hulls),
        ties=bouncing(ties, known.restitution),
        impact=asked.impact,
        **limited,
    )


def _of_kinds(a: Any, asked: Asked, held: dict[str, AnyJoint]) -> Assembly:
    """Return the system of bodies that are repeated as kinds."""
    check_width(a.lattice, [*a.named.values()], [*a.fixed.values()])
    alone = {p: _alone(a, p) for p in a.placements}
    laws = {n: vars(asked)[n] for n in ("friction", "rolling", "restitution", "attraction")}
    some = {n: vars(asked)[n] or {} for n in ("masses", "exits", "drives", "forces")}
    own = {name for one in alone.values() for name in one.joints}
    shared = {name: joint for name, joint in a.joints.items() if name not in own}
    rest = {n: vars(asked)[n] for n in ("gravity", "density", "impact")}
    return assembly(alone, asked.count, laws, some, shared | held, **rest)


def _limited(a: Any, asked: Asked) -> dict[str, Any]:
    """Return the arguments of a system for limits on velocities."""
    bounds, further, equations = (
        checks.mapping(name, {} if (given := vars(asked)[name]) is None else given)
        for name in ("rates", "limits", "nonholonomic")
    )
    checks.names("rates", bounds, a.joints)
    turning = {name: a.joint_rate(name) for name in bounds}
    given = {**rate_limits(turning, bounds), **further}
    if isinstance(asked.count, Mapping) and (given or equations):
        refuse("limits", "none where count has names", [*given, *equations])
    return {"limits": given, "nonholonomic": equations}


def _further(a: Any, joints: Any) -> dict[str, AnyJoint]:
    """Return joints of repeated bodies, after checking their names."""
    found = {} if joints is None else dict(checks.mapping("joints", joints))
    check_together(a.named, a.fixed, a.walls, [*a.joints, *found])
    return found


def _alone(a: Any, p: Placement) -> Any:
    """Return the arrangement of one of the bodies, in the units of all."""
    one = replace(a, bodies={p.name: p.body}, joints=owned(a.joints, p.name, a.fixed))
    vars(one).update(scale=a.scale, placements=(replace(p, at=slice(0, p.manifold.size)),))
    return one


def _laws(a: Any, asked: Asked, drives: Any, rubbing: Mapping[str, Any]) -> Any:
    """Return energies and forces, the friction of joints and drives, equations with the time."""
    weights = masses_of(a.placements, asked.density, {} if asked.masses is None else asked.masses)
    kinetic, *rest = energies(a.placements, weights, asked.gravity, a.turning)
    laws = kinetic + counted_energy(a.mechanism, a.manifold, weights), *rest
    known = [WORLD, *a.fixed, *a.named]
    return driven(a.mechanism, a.manifold, known, laws, drives, asked.forces, rubbing)


def _contacts(a: Any) -> tuple[list[Touch], list[tuple[HullContacts, Pair]]]:
    """Return the contacts of bodies with each other and with fixed ones, of sharp parts apart."""
    touches, hulls = list[Touch](), list[tuple[HullContacts, Pair]]()
    for pair in a.pairs:
        if both_sharp(*pair):
            hulls.append((listed_hulls(pair[0], pair[1], a.scale), pair))
        else:
            touches += distances(a.manifold, *pair)
    return touches, hulls


def _meetings(
    a: Any, touches: list[Touch], hulls: list[tuple[HullContacts, Pair]]
) -> list[Meeting]:
    """Return what touches at each contact; a limit of a joint is one of this with itself."""
    found = [Meeting(t.gap.name, t.one.body, t.two.body) for t in touches]
    found += [Meeting(n, one.body, two.body) for some, (one, two) in hulls for n in some.names]
    found += [Meeting(t.gap.name, t.member.body, t.name) for t in a.at_walls]
    ends = {end: end.rpartition(".")[0] for end in a.mechanism.limits}
    return found + [Meeting(end, joint, joint) for end, joint in ends.items()]


def _bounces(contacts: list[str], known: ContactLaws) -> dict[str, float]:
    return {name: known.restitution.get(name, 0.0) for name in contacts}


def _scene(
    a: Any, count: int, touches: list[Touch], hulls: list[tuple[HullContacts, Pair]]
) -> BodiesInSpace:
    """Return the names of the bodies in space, and where they touch."""
    first = a.placements[0]
    return BodiesInSpace(
        a.placements,
        tuple(touches),
        tuple(a.at_walls),
        frozenset(a.walls),
        count,
        partial(touching_twins, (first, first), a.lattice),
        tuple((some, (one.body, two.body)) for some, (one, two) in hulls),
    )
