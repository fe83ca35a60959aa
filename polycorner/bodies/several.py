"""Systems of many bodies of several kinds, from arrangements of one body each."""

from collections.abc import Mapping, Sequence
from functools import partial
from itertools import combinations_with_replacement
from typing import Any

from polycorner import checks
from polycorner.bodies.drives import split
from polycorner.bodies.dynamics import between, listed_hulls, touching_twins
from polycorner.bodies.joints import WORLD, AnyJoint
from polycorner.bodies.lattices import Lattice
from polycorner.bodies.laws import Meeting, laws_of
from polycorner.bodies.pairs import PlacedPart, both_sharp, distances
from polycorner.bodies.poses import Placement
from polycorner.bodies.scenes import KindsInSpace
from polycorner.bodies.ties import Tied, bouncing, met, names_of, refers, ties_of
from polycorner.checks import fits
from polycorner.motion.assembly import Assembly
from polycorner.motion.ties import Tie

ROWS = 19  # numbers that a gap of a dense system takes for each coordinate


def assembly(
    alone: Mapping[Placement, Any],
    count: Mapping[str, int],
    laws: Mapping[str, Any],
    some: Mapping[str, Mapping[str, Any]],
    joints: Mapping[str, AnyJoint],
    **rest: Any,
) -> Assembly:
    """Return the system of many bodies of several kinds.

    Parameters
    ----------
    alone : mapping from Placement to Arrangement
        Each kind, and the arrangement of one such body.
    count : mapping from str to int
    laws : mapping from str to coefficients
        ``friction``, ``rolling``, ``restitution`` and ``attraction``.
    some : mapping from str to mapping
        Further arguments that have values for some of the kinds: ``masses`` and ``forces`` by
        their names, ``exits`` by coordinate, and ``drives``, some of which tie bodies.
    joints : mapping from str to Joint or Gear
        Those that bodies do not have each by itself.
    **rest
        Arguments of ``system`` that are those of all kinds.
    """
    kinds = [p.name for p in alone]
    checks.names("count", checks.mapping("count", count), kinds)
    for name, number in count.items():
        checks.whole(f"count of {name!r}", number, least=1)
    for argument in ("masses", "forces"):
        checks.names(argument, checks.mapping(argument, some[argument]), kinds)
    coordinates = [name for p in alone for name in p.manifold.names]
    checks.names("exits", checks.mapping("exits", some["exits"]), coordinates)
    touched = {p.name: _touched(one) for p, one in alone.items()}
    pairs = [*combinations_with_replacement(alone, 2)]
    meetings = [meeting for own in touched.values() for meeting in own]
    meetings += [Meeting(f"{p.name}-{q.name}", p.name, q.name, True) for p, q in pairs]
    rubs = [*joints, *(name for one in alone.values() for name in one.joints)]
    friction, rubbing = split(laws["friction"], rubs)
    drives, ties = tied(alone, count, joints, some["drives"], rubbing)
    meetings += met(ties)
    known = laws_of(**{**laws, "friction": friction}, meetings=meetings, moving=kinds)
    found = {}
    for (p, one), moved in zip(alone.items(), drives, strict=True):
        own = {m.contact for m in touched[p.name]}
        given = {
            argument: {name: value for name, value in by_name.items() if name in own}
            for argument, by_name in known._asdict().items()
        }
        given["friction"] |= {name: rubbing[name] for name in one.joints if name in rubbing}
        masses, forces = (
            {p.name: some[argument][p.name]} if p.name in some[argument] else {}
            for argument in ("masses", "forces")
        )
        exits = {x: limit for x, limit in some["exits"].items() if x in p.manifold.names}
        found[p.name] = one.system(
            masses=masses, exits=exits, forces=forces, drives=moved, **given, **rest
        )
    families = {
        (p.name, q.name): between((p, q), alone[p].lattice, known)
        for p, q in pairs
        if p is not q or count.get(p.name, 1) > 1
    }
    touching = partial(_touching, {p.name: (p, one.lattice) for p, one in alone.items()})
    scenes = {name: system.scene for name, system in found.items()}
    ordered = {name: count[name] for name in found}
    scene = KindsInSpace(scenes, ordered, touching)
    return Assembly(found, count, families, scene, bouncing(ties, known.restitution))


def tied(
    alone: Mapping[Placement, Any],
    count: Mapping[str, int],
    joints: Mapping[str, AnyJoint],
    drives: Any,
    rubbing: Mapping[str, Any],
) -> tuple[list[dict[str, Any]], list[Tie]]:
    """Return the drives that bodies of each kind have by themselves, and the ties of bodies.

    Parameters
    ----------
    alone, count, joints
        As of :func:`assembly`.
    drives : mapping from str to Spring, Damper, Motor or Prescribed
    rubbing : mapping from str to float, or to (float, float)
        Friction in joints.
    """
    drives, found = checks.mapping("drives", drives), []
    # Joints with space of the only body of its kind, which drives and gears may name.
    known = {n: j for p, one in alone.items() if count[p.name] == 1 for n, j in one.joints.items()}
    for p, one in alone.items():
        around, own = {WORLD, *one.fixed}, {p.name, *p.manifold.names, *one.joints}
        by_name = {n: refers(drive) for n, drive in drives.items()}
        owns = {n for n, told in by_name.items() if told & own and told <= around | own}
        found.append({n: drive for n, drive in drives.items() if n in owns})
    further = {n: drive for n, drive in drives.items() if all(n not in own for own in found)}
    if not joints and not further:
        return found, []
    first = next(iter(alone.values()))
    every = Tied(
        {p.name: p for p in alone},
        names_of([*alone], count),
        first.fixed,
        {**known, **joints},
        tuple(first.lattice.lengths.tolist()),
    )
    return found, ties_of(every, joints, further, rubbing)


def _touching(known: Mapping[str, tuple[Placement, Lattice]], one: str, two: str) -> Any:
    """Return two bodies of given kinds, and their contacts."""
    (first, lattice), (second, _) = known[one], known[two]
    return touching_twins((first, second), lattice)


def check_size(meeting: Sequence[tuple[PlacedPart, PlacedPart]], coordinates: int) -> None:
    """Raise ValueError if the steps of listed bodies, which are one dense system, do not fit.

    Each gap has rows over all coordinates in several arrays of the engine, and so has its friction.
    """
    gaps = sum(len(one.part.points) + len(two.part.points) - 1 for one, two in meeting)
    what = f"the dense system of {coordinates} coordinates and {gaps} gaps or more"
    advice = "many bodies are given by kinds and count"
    fits("bodies", 8.0 * ROWS * coordinates * gaps, f"{what} ({advice})")


def _touched(one: Any) -> list[Meeting]:
    """Return the contacts of a single body with walls and fixed bodies."""
    found = [Meeting(t.gap.name, t.member.body, t.name) for t in one.at_walls]
    for pair in one.pairs:
        hulls = listed_hulls(pair[0], pair[1], one.scale).names if both_sharp(*pair) else ()
        smooth = () if both_sharp(*pair) else distances(one.manifold, *pair)
        names = [*hulls, *(touch.gap.name for touch in smooth)]
        found += [Meeting(name, pair[0].body, pair[1].body) for name in names]
    ends = one.mechanism.limits
    return found + [Meeting(end, *2 * [end.rpartition(".")[0]]) for end in ends]
