"""Section 5: free motions of a pair, the components of the corners, and chirality."""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial

import numpy as np

from paper_checks.framework.claims import Claim, Finding, Means, Verdict
from paper_checks.section2.cylinder import typeset
from paper_checks.section5.pairs import CONTACTS, DRUM, PLANE, Array, atlas, degrees, differentiated
from polycorner import minimise
from polycorner.dumbbells import DumbbellPair

FULL = 360


# ------------------------------------------------------------------------------------ free motions


def carried(pair: DumbbellPair, q: Array, names: tuple[str, ...], turn: int) -> Array:
    """Keep contacts closed while the mean heading turns and the mean position stays fixed.

    Newton's method in steps of five degrees; ``turn`` in degrees.
    """
    rows = [pair.polyhedron.names.index(name) for name in names]
    mean = np.array([[1.0, 0, 0, 1, 0, 0], [0, 1, 0, 0, 1, 0], [0, 0, 1, 0, 0, 1]]) / 2
    target = mean @ q
    for _ in range(turn // 5):
        target[2] += math.radians(5)
        for _ in range(8):
            values, gradients = pair.polyhedron.evaluate(q, 1)
            system = np.vstack([gradients[rows], mean])
            wrong = np.concatenate([values[rows], mean @ q - target])
            q = q - np.linalg.lstsq(system, wrong, rcond=None)[0]
    return np.asarray(q)


def apart(pair: DumbbellPair, p: Array, q: Array) -> float:
    """Return the distance of two points of M x M, headings modulo half a turn."""
    difference = p - q
    difference[[2, 5]] = [math.remainder(x, math.pi) for x in difference[[2, 5]]]
    return float(abs(difference / pair.manifold.scale_array).max())


@cache
def _returns() -> tuple[set[int], set[int], float]:
    """Turn one corner of every kind, in the plane and in the drum.

    Returns the least turns, of 90, 180, 270 and 360 degrees, after which the ordered pair is back,
    those after which it is back with the dumbbells exchanged, and the largest gap on the way.
    """
    same: set[int] = set()
    exchanged: set[int] = set()
    open_by = 0.0
    for pair in (PLANE, DRUM):
        found = atlas(pair)
        corners = {found.kind(corner): corner for corner in found.skeleton.corners}
        for corner in corners.values():
            turned = {0: corner.point}
            for angle in range(90, FULL + 1, 90):
                turned[angle] = carried(pair, turned[angle - 90], corner.active, 90)
            rows = [pair.polyhedron.names.index(name) for name in corner.active]
            open_by = max(
                open_by, *(abs(pair.polyhedron.values(q)[rows]).max() for q in turned.values())
            )
            start = turned.pop(0)
            for image, back in ((start, same), (pair.swap(start), exchanged)):
                back.add(min(k for k, q in turned.items() if apart(pair, q, image) < 1e-6))
    return same, exchanged, open_by


def copies_of_m(turn: int = 180) -> Finding:
    """Compare the turn that closes a component of D3 with the circle of headings of M."""
    same, exchanged, open_by = _returns()
    holds = same == {turn} and open_by < 1e-9
    listed = ", ".join(map(str, sorted(same)))
    swapped = ", ".join(map(str, sorted(exchanged)))
    return Finding(
        Verdict.HOLDS if holds else Verdict.CORRECTED if len(same) == 1 else Verdict.REFUTED,
        "Corners of all four kinds, turned with their contacts closed, in the plane rigidly and "
        f"in the drum with readjustment (gaps below {open_by:.0e} mm), are back in $M \\times M$ "
        f"after {listed} degrees; after {swapped} degrees the dumbbells have changed places.",
        {"turn": float(max(same)), "turn_exchanged": float(max(exchanged))},
        ""
        if holds
        else f"Each component is $\\mathbb{{R}}^2$ times a circle of headings of {listed} degrees, "
        f"where $M$ has {FULL // 2}: mean place and heading map it to $M$ two to one, since half a "
        "turn exchanges the dumbbells. It is a copy of $M$ for unordered pairs.",
    )


def free_motions_are(number: int = 3) -> Finding:
    """Count the motions of a pair that change no distance, at a point without contacts."""
    point = np.array([0.03, -2.0, 0.4, 0.11, 9.0, 0.9])
    flat = point * np.array([122.0, 1, 1] * 2)

    def free(pair: DumbbellPair, q: Array) -> int:
        sizes = np.linalg.svd(differentiated(pair, q, CONTACTS), compute_uv=False)
        return 6 - int((sizes > 1e-7 * sizes[0]).sum())

    plane, drum = free(PLANE, flat), free(DRUM, point)
    rates = {}
    for times in (1, 2):
        pair = replace(DRUM, drum_radius=times * 125.0)
        rho = pair.centre_radius
        q = flat / np.array([rho, 1, 1] * 2)
        spin = np.array([q[1] / rho, -q[0] * rho, 1, q[4] / rho, -q[3] * rho, 1])
        slopes = differentiated(pair, q, CONTACTS) / pair.manifold.scale_array
        rates[times] = float(abs(slopes @ spin).max())
    order = math.log2(rates[1] / rates[2]) / math.log2(
        (250.0 - DRUM.ball_radius) / DRUM.centre_radius
    )
    if plane != number:
        verdict = Verdict.REFUTED
    else:
        verdict = Verdict.HOLDS if drum == number else Verdict.HOLDS_UNDER
    return Finding(
        verdict,
        f"The distances are unchanged by {plane} independent motions in the plane and by {drum} in "
        f"the drum of 125 mm, where turning the pair as it lies changes them at up to "
        f"{rates[1]:.4f} mm per radian; this falls like $R^{{-{order:.2f}}}$.",
        {"plane": float(plane), "drum": float(drum), "rate": rates[1], "order": order},
        "In the developed plane. In the drum rolling and shifting are free; turning the pair needs "
        r"a readjustment of relative order $(\ell/R)^2$, which leaves dimensions and counts as "
        "they are.",
    )


# ---------------------------------------------------------------------------------------- chirality


def extreme_pair_is_unique(extreme: Callable[..., tuple[int, int]] = max) -> Finding:
    """Find the farthest, or nearest, two centres of different dumbbells at all corners."""
    import sympy

    p, h, length = sympy.symbols("p h l", positive=True)
    places = {"A1": (0, 0), "A2": (0, length), "B1": (p, h), "B2": (p, h + length)}
    names = [("A1", "B1"), ("A1", "B2"), ("A2", "B1"), ("A2", "B2")]
    squares = {
        (a, b): sum((x - y) ** 2 for x, y in zip(places[a], places[b], strict=True))
        for a, b in names
    }
    outer = squares["A1", "B2"]
    leads = [sympy.factor(sympy.expand(outer - squares[n])) for n in names if n != ("A1", "B2")]
    cross = sympy.expand(p * (h - length) - (h + length) * p)
    proved = all(lead.is_positive for lead in leads) and cross.is_negative
    between, turn = np.inf, np.inf
    for pair in (PLANE, DRUM):
        for corner in atlas(pair).skeleton.corners:
            a, b = np.split(pair.developed(corner.point), 2)
            reach = {(i, j): float(np.hypot(*(b[j] - a[i]))) for i in (0, 1) for j in (0, 1)}
            first = extreme(reach, key=lambda ij: reach[ij])
            rest = [value for ij, value in reach.items() if ij != first]
            between = min(between, *(abs(value - reach[first]) for value in rest))
            i, j = first
            u, v = b[j] - a[i], b[1 - j] - a[1 - i]
            turn = min(turn, abs(float(u[0] * v[1] - u[1] * v[0])))
    right = between > 1e-6 and turn > 1e-6
    return Finding(
        Verdict.HOLDS if right and proved else Verdict.REFUTED,
        "For parallel dumbbells shifted by $h > 0$ the square of $d(A_1,B_2)$ exceeds the other "
        f"three by {', '.join(map(typeset, leads))}, and the vector product that tells the hand is "
        f"{typeset(cross)}. At all corners the pair of centres chosen leads by {between:.4f} mm or "
        f"more, and the vectors span at least {turn:.4f} square millimetres.",
        {"lead": float(between), "area": float(turn)},
    )


def right_handed_rests_at(sign: int = 1) -> Finding:
    """Compare the orientation in the plane (phi, eta) with the sign of the minimum's heading."""
    hands = {}
    for hand in ("R", "L"):
        q = minimise(DRUM.polyhedron, DRUM.energy, DRUM.nested(hand)).point
        a, b = np.split(DRUM.developed(q), 2)
        i, j = max(np.ndindex(2, 2), key=lambda ij: float(np.hypot(*(b[ij[1]] - a[ij[0]]))))
        u, v = b[j] - a[i], b[1 - j] - a[1 - i]
        positive = u[0] * v[1] > u[1] * v[0]
        hands["positively" if positive else "negatively"] = degrees(float(DRUM.heading(q)[0]))
    right = sign * hands["positively"] > 0 > sign * hands["negatively"]
    return Finding(
        Verdict.HOLDS_UNDER if right else Verdict.REFUTED,
        "The pair whose vectors are "
        + " and that whose are ".join(
            f"{name} oriented rests at {angle:.4f} degrees" for name, angle in hands.items()
        )
        + ".",
        hands,
        r"Right-handed means positively oriented by $(\partial_\varphi, \partial_\eta)$: the "
        "drum is viewed from the side where this is anticlockwise, which the definition "
        "has to say.",
    )


CLAIMS: tuple[Claim, ...] = (
    Claim(
        "D7b",
        "5",
        "components of D3",
        r"Each component of $D_3$ consists of the translates and rotations of one pair, and is "
        "thereby identified with $M$.",
        Means.NUMERICAL,
        copies_of_m,
        partial(copies_of_m, 360),
    ),
    Claim(
        "D8a",
        "5",
        "definition of chirality",
        "On $D_3$ two centres $A_i$, $B_j$ are farther apart than all others, and the two vectors "
        "that define the chirality are not parallel.",
        Means.SYMBOLIC,
        extreme_pair_is_unique,
        partial(extreme_pair_is_unique, min),
    ),
    Claim(
        "D8b",
        "5",
        "definition of chirality, against section 6",
        "Right-handed pairs, by the orientation of the two vectors, are those that rest at a "
        "positive heading.",
        Means.NUMERICAL,
        right_handed_rests_at,
        partial(right_handed_rests_at, -1),
    ),
    Claim(
        "D17",
        "5",
        "free dimensions of D",
        "Three of the six dimensions are free, by translating and rotating the pair.",
        Means.NUMERICAL,
        free_motions_are,
        partial(free_motions_are, 4),
    ),
)
