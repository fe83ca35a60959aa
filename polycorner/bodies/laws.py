"""Friction, rolling, restitution and attraction by the names of what touches.

For each contact the most specific of the names holds that are given:

1. the contact itself, ``"A.v1-floor"``;
2. the pair of what touches, ``("A", "floor")`` or ``"A-floor"``, in any order;
3. ``"between"``, for contacts among repeated bodies;
4. the wall or fixed body, ``"floor"``;
5. the body or kind of bodies that moves, ``"A"``.  Where both have a value, these have to agree.

Contacts that no name tells of have no friction and no attraction, and are plastic.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple, TypeVar

import numpy as np

from polycorner import checks, signatures
from polycorner.checks import refuse
from polycorner.errors import nearest
from polycorner.motion.attraction import Attraction

BETWEEN = "between"  # the name of the contacts among repeated bodies

Both = tuple[float, float]  # static and dynamic
Coefficient = float | Both
# Names are words and pairs of them, of which a mapping may have both.
Coefficients = Coefficient | Mapping[Any, Coefficient]
Restitution = float | Mapping[Any, float]
Attractions = Attraction | Mapping[Any, Attraction] | None
signatures.NAMES |= {
    Coefficients: "Coefficients",
    Restitution: "Restitution",
    Attractions: "Attractions",
}

T = TypeVar("T")


class Meeting(NamedTuple):
    """A contact, and the names of the two things that touch there, of which one moves.

    Attributes
    ----------
    contact, one, two : str
    repeated : bool
        Whether both are repeated bodies, which ``"between"`` tells of as well.
    """

    contact: str
    one: str
    two: str
    repeated: bool = False


class ContactLaws(NamedTuple):
    """Coefficients by the name of the contact; those of contacts without any are left out."""

    friction: dict[str, Both]
    rolling: dict[str, Both]
    restitution: dict[str, float]
    attraction: dict[str, Attraction]


def laws_of(
    friction: Coefficients,
    rolling: Coefficients,
    restitution: Restitution,
    meetings: Sequence[Meeting],
    moving: Iterable[str],
    attraction: Attractions = None,
) -> ContactLaws:
    """Return the laws of all contacts; ``moving`` are the bodies or kinds that move.

    Raises
    ------
    TypeError, ValueError
        For a coefficient that is none, a name that no contact has, and two bodies whose own
        coefficients differ where they touch.
    """
    moving = frozenset(moving)
    # The limits of joints are no contacts of bodies.
    touching = [m for m in meetings if m.one in moving or m.two in moving]
    pulls = {} if attraction is None else attraction
    bounces = partial(checks.real, "restitution", least=0, most=1)
    rubs, rolls = (partial(static_and_dynamic, name) for name in ("friction", "rolling"))
    return ContactLaws(
        _by_contact("friction", friction, meetings, moving, rubs),
        _by_contact("rolling", rolling, meetings, moving, rolls),
        _by_contact("restitution", restitution, meetings, moving, bounces),
        _by_contact("attraction", pulls, touching, moving, _pull),
    )


def _pull(given: Any) -> Attraction:
    return checks.instance("attraction", given, Attraction)


def static_and_dynamic(argument: str, given: Any) -> Both:
    """Return the static and the dynamic one of a coefficient, which may be the same."""
    expected = "a coefficient >= 0, or a pair of a static and a smaller dynamic one"
    pair = np.array(checks.numbers(argument, given, expected), dtype=np.float64)
    if pair.shape not in {(), (2,)} or not np.isfinite(pair).all() or (pair < 0).any():
        refuse(argument, expected, given)
    static, dynamic = np.broadcast_to(pair, 2).tolist()
    if dynamic > static:
        refuse(argument, expected, given)
    return static, dynamic


def _by_contact(
    argument: str,
    given: Any,
    meetings: Sequence[Meeting],
    moving: frozenset[str],
    read: Callable[[Any], T],
) -> dict[str, T]:
    """Return what holds at each contact for which something is given."""
    if not isinstance(given, Mapping):
        value = read(given)
        return {m.contact: value for m in meetings}
    named, paired = _sorted(argument, given, meetings, read)
    found = {}
    for m in meetings:
        values = {name: named[name] for name in (m.one, m.two) if name in named}
        around = [value for name, value in values.items() if name not in moving]
        if m.contact in named:
            found[m.contact] = named[m.contact]
        elif (pair := frozenset((m.one, m.two))) in paired:
            found[m.contact] = paired[pair]
        elif m.repeated and BETWEEN in named:
            found[m.contact] = named[BETWEEN]
        elif around or values:
            first, *others = around or values.values()
            if others and others[0] != first:
                expected = (
                    f"a value for {m.one}-{m.two}, as those of {m.one!r} and {m.two!r} differ"
                )
                refuse(argument, expected, given)
            found[m.contact] = first
    return found


def _sorted(
    argument: str, given: Mapping[Any, Any], meetings: Sequence[Meeting], read: Callable[[Any], T]
) -> tuple[dict[str, T], dict[frozenset[str], T]]:
    """Return what is given by the name of one thing or contact, and by that of a pair."""
    pairs = {
        f"{a}-{b}": frozenset((a, b)) for m in meetings for a, b in ((m.one, m.two), (m.two, m.one))
    }
    known = dict.fromkeys(thing for m in meetings for thing in (m.one, m.two))
    known |= dict.fromkeys([BETWEEN] * any(m.repeated for m in meetings))
    contacts = {m.contact for m in meetings}
    named: dict[str, T] = {}
    paired: dict[frozenset[str], T] = {}
    for key, value in given.items():
        coefficient = read(value)
        pair = pairs.get("-".join(map(str, key)) if isinstance(key, tuple) else key)
        if pair is None and key not in known and key not in contacts:
            _refuse_name(argument, key, [*known], [*pairs, *contacts])
        if not isinstance(key, tuple):
            named[key] = coefficient
        if pair is not None and paired.setdefault(pair, coefficient) != coefficient:
            refuse(argument, f"one value for {'-'.join(sorted(pair))}, in whichever order", given)
    return named, paired


def _refuse_name(argument: str, key: Any, things: list[str], longer: list[str]) -> None:
    """Raise ValueError for a name that no contact has, with the nearest one."""
    shown = nearest(key, [*things, *longer]) if isinstance(key, str) else repr(key)
    example = f", pairs of them that touch such as {longer[0]!r}, or contacts" if longer else ""
    msg = f"{argument}: expected names among {', '.join(things) or 'none'}{example}; got {shown}"
    raise ValueError(msg)
