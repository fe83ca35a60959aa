"""Systems of many bodies of several kinds, from arrangements of one body each."""

from collections.abc import Mapping, Sequence
from itertools import combinations_with_replacement
from typing import Any

from polycorner import checks
from polycorner.bodies.dynamics import between, listed_hulls, touching_twins
from polycorner.bodies.laws import Meeting, laws_of
from polycorner.bodies.pairs import PlacedPart, both_sharp, distances
from polycorner.bodies.poses import Placement
from polycorner.bodies.scenes import KindsInSpace
from polycorner.checks import fits
from polycorner.motion.assembly import Assembly

ROWS = 19  # numbers that a gap of a dense system takes for each coordinate


def assembly(
    alone: Mapping[Placement, Any],
    count: Mapping[str, int],
    laws: Mapping[str, Any],
    some: Mapping[str, Mapping[str, Any]],
    **rest: Any,
) -> Assembly:
    """Return the system of many bodies of several kinds.

    Parameters
    ----------
    alone : mapping from Placement to Arrangement
        Each kind, and the arrangement of one such body.
    count : mapping from str to int
    laws : mapping from str to coefficients
        ``friction``, ``rolling`` and ``restitution``.
    some : mapping from str to mapping
        Further arguments that have values for some of the kinds: ``masses`` by their names, and
        ``exits`` by coordinate.
    **rest
        Arguments of ``system`` that are those of all kinds.
    """
    kinds = [p.name for p in alone]
    checks.names("count", checks.mapping("count", count), kinds)
    checks.names("masses", checks.mapping("masses", some["masses"]), kinds)
    coordinates = [name for p in alone for name in p.manifold.names]
    checks.names("exits", checks.mapping("exits", some["exits"]), coordinates)
    touched = {p.name: _touched(one) for p, one in alone.items()}
    pairs = [*combinations_with_replacement(alone, 2)]
    meetings = [meeting for own in touched.values() for meeting in own]
    meetings += [Meeting(f"{p.name}-{q.name}", p.name, q.name, True) for p, q in pairs]
    known = laws_of(**laws, meetings=meetings, moving=kinds)
    found = {}
    for p, one in alone.items():
        own = {m.contact for m in touched[p.name]}
        given = {
            argument: {name: value for name, value in by_name.items() if name in own}
            for argument, by_name in known._asdict().items()
        }
        masses = {p.name: some["masses"][p.name]} if p.name in some["masses"] else {}
        exits = {x: limit for x, limit in some["exits"].items() if x in p.manifold.names}
        found[p.name] = one.system(masses=masses, exits=exits, **given, **rest)
    families = {
        (p.name, q.name): between((p, q), alone[p].lattice, known)
        for p, q in pairs
        if p is not q or count.get(p.name, 1) > 1
    }

    def met(one: str, two: str) -> Any:
        by_name = {p.name: p for p in alone}
        return touching_twins((by_name[one], by_name[two]), alone[by_name[one]].lattice)

    scenes = {name: system.scene for name, system in found.items()}
    ordered = {name: count[name] for name in found}
    return Assembly(found, count, families, KindsInSpace(scenes, ordered, met))


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
    return found
