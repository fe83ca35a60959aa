"""Systems of many bodies of several kinds, from arrangements of one body each."""

from collections.abc import Mapping
from itertools import combinations_with_replacement
from typing import Any

from polycorner import checks
from polycorner.bodies.dynamics import between, twins
from polycorner.bodies.laws import Meeting, laws_of
from polycorner.bodies.pairs import distances
from polycorner.bodies.poses import Placement
from polycorner.bodies.scenes import KindsInSpace
from polycorner.motion.assembly import Assembly


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
        return twins((by_name[one], by_name[two]), alone[by_name[one]].lattice)

    scenes = {name: system.scene for name, system in found.items()}
    ordered = {name: count[name] for name in found}
    return Assembly(found, count, families, KindsInSpace(scenes, ordered, met))


def _touched(one: Any) -> list[Meeting]:
    """Return the contacts of a single body with walls and fixed bodies."""
    touches = [t for pair in one.pairs for t in distances(one.manifold, *pair)]
    found = [Meeting(t.gap.name, t.one.body, t.two.body) for t in touches]
    return [*found, *(Meeting(t.gap.name, t.member.body, t.name) for t in one.at_walls)]
