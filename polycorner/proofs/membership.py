"""Whether a solution is a point of the set, and the set near it a part of that of its face."""

from collections.abc import Iterator, Sequence
from itertools import product
from typing import TYPE_CHECKING

from polycorner.proofs.statements import (
    Claim,
    ConditionResult,
    Solved,
    Status,
    failed,
    proved,
    shown,
    undecided,
)

if TYPE_CHECKING:
    from polycorner.intervals.balls import Ball

MOST_UNKNOWN = 4  # functions of unknown sign up to which all their signs are tried in a tree
MOST_HALVINGS = 8  # of a cell, to decide the signs of inactive functions


def inside(solved: Solved) -> ConditionResult:
    """Decide whether the functions that are not held are positive, or exactly zero and not needed.

    A cell of parameters is divided until they are on every part of it, or on none.
    """
    claim, enclosure = solved.claim, solved.enclosure
    if not claim.others:
        return _membership(solved, [])
    waiting = [(tuple(enclosure.predictor.cell.reach), 0)]
    found: dict[Status, ConditionResult] = {}
    while waiting:
        reach, depth = waiting.pop()
        values = claim.system.formulas.values(enclosure.neighbourhood(reach), claim.others)
        result = _membership(solved, values)
        if result.status is Status.UNDECIDED and reach and depth < MOST_HALVINGS:
            waiting += [(half, depth + 1) for half in _halves(reach)]
            continue
        found[result.status] = result
        if result.status is Status.UNDECIDED:
            return result
        if len(found) > 1:
            return undecided(f"true on a part of the cell only: {found[Status.FAILED].reason}")
    return next(iter(found.values()))


def _halves(reach: "tuple[Ball, ...]") -> "Iterator[tuple[Ball, ...]]":
    """Return the two halves of a box, divided across its widest side."""
    widest = max(range(len(reach)), key=lambda a: float(reach[a].rad()))
    side = reach[widest]
    for end in (side.lower(), side.upper()):
        yield (*reach[:widest], side.mid().union(end), *reach[widest + 1 :])


def _membership(solved: Solved, values: "Sequence[Ball]") -> ConditionResult:
    """Decide whether the point is in the set, and the set in that of the functions held.

    A sign of None is open; a function shown to be exactly 0 may be of any sign nearby.
    """
    claim = solved.claim
    d = claim.problem.polyhedron
    listed = dict(zip(claim.others, values, strict=True))
    signs = {i: sign(solved, i, value) for i, value in listed.items()}
    agrees = _face_holds(claim, signs)
    if agrees is None:
        row = next((i for i, sign in signs.items() if sign is None), None)
        if row is None:
            zeros = claim.named([i for i, sign in signs.items() if sign == 0])
            return undecided(f"the tree has branches of {', '.join(zeros)}, which are 0 there")
        reason = (
            f"{claim.named([row])[0]} may vanish there without being needed (redundant, or weakly "
            f"active), or the box is too wide: it lies in {shown(listed[row])}"
        )
        return undecided(reason)
    if not agrees:
        below = {i: v for i, v in listed.items() if v < 0 or (d.is_union and signs[i])}
        below = below or {i: v for i, v in listed.items() if signs[i]}
        row, value = min(below.items(), key=lambda item: abs(float(item[1].mid())))
        reason = f"{claim.named([row])[0]} lies in {shown(value)}"
        if d.is_union:
            held = ", ".join(d.names[i] for i in claim.active) or "nothing"
            reason = f"the tree requires more, or less, than {held} alone there: {reason}"
        return failed(reason)
    return proved(_why_inside(claim, listed, signs))


def sign(solved: Solved, row: int, value: "Ball") -> int | None:
    """Return the sign of a function from its enclosure, 0 where algebra shows it; or None."""
    if value > 0 or value < 0:
        return 1 if value > 0 else -1
    return 0 if value.is_finite() and solved.vanishes(row) else None


def _why_inside(claim: Claim, listed: "dict[int, Ball]", signs: dict[int, int | None]) -> str:
    if not listed:
        return "every inequality is active"
    parts = []
    zeros = claim.named([i for i, sign in signs.items() if sign == 0])
    if zeros:
        parts.append(f"{', '.join(zeros)}: exactly 0 there, and not needed for a minimum")
    away = [i for i, sign in signs.items() if sign]
    if away:
        nearest = min(away, key=lambda i: abs(float(listed[i].mid())))
        parts.append(
            f"the nearest to 0 is {claim.named([nearest])[0]}, in {shown(listed[nearest])}"
        )
    return "; ".join(parts)


def _face_holds(claim: Claim, signs: dict[int, int | None]) -> bool | None:
    """Whether every branch of the tree near the point asks for all active functions, and one is."""
    d, m = claim.problem.polyhedron, claim.problem.inequalities
    dropped = [sign for i, sign in signs.items() if i >= m]
    if any(dropped):
        return False  # an equation that does not hold
    all_signs = [signs.get(i, 0) for i in range(m)]
    unknown = [i for i, sign in enumerate(all_signs) if sign is None]
    if not d.is_union:
        if -1 in all_signs:
            return False
        return None if unknown or None in dropped else True
    if len(unknown) > MOST_UNKNOWN or None in dropped:
        return None
    answers = set()
    for guess in product((-1, 0, 1), repeat=len(unknown)):
        tried = [0 if sign is None else sign for sign in all_signs]
        for i, sign in zip(unknown, guess, strict=True):
            tried[i] = sign
        answers.add(_pieces_hold(d.signs_to_pieces(tried), frozenset(claim.active)))
    return answers.pop() if len(answers) == 1 else None


def _pieces_hold(pieces: Sequence[frozenset[int]], active: frozenset[int]) -> bool | None:
    """Whether every piece asks for all active functions; None where others may imply them."""
    if all(piece >= active for piece in pieces):
        return bool(pieces)
    return False if any(piece < active for piece in pieces) else None
