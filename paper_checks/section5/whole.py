"""Section 5: the polyhedron as a whole: long rods, crossed rods, the forbidden body."""

import math
from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from paper_checks.framework.claims import Claim, Finding, Means, Verdict
from paper_checks.section5.pairs import CONTACTS, DRUM, PLANE, Array, atlas
from polycorner.dumbbells import DumbbellPair, long_rod_length


def touching_both_ends(rod: float) -> float:
    """Return the largest ``l/r`` at which a ball can touch both balls of the other dumbbell.

    The ball is at ``2 r`` from both; its own dumbbell points straight away.  Bisection between
    ``2 r`` and ``4 r`` finds the length up to which this is allowed.
    """

    def allowed(length: float) -> bool:
        pair = DumbbellPair(length, 1.0, rod)
        out = math.sqrt(4 - length**2 / 4)
        away = np.array([0.0, 0, 0, out + length / 2, 0, math.pi / 2])
        return bool(pair.polyhedron.contains(away, tolerance=1e-12))

    low, high = 2.0, 4.0
    if not allowed(low):
        return low
    while high - low > 1e-10:
        middle = (low + high) / 2
        low, high = (middle, high) if allowed(middle) else (low, middle)
    return low


def picture_holds_above(threshold: Callable[[float], float] = touching_both_ends) -> Finding:
    """Count the components just above and just below a length, for two radii of the rod."""
    rods = (0.25, 0.5)
    counts: dict[str, set[tuple[int, ...]]] = {"above": set(), "below": set()}
    named: dict[str, set[str]] = {"above": set(), "below": set()}
    for rod in rods:
        length = threshold(rod)
        for side, factor in (("above", 1.01), ("below", 0.99)):
            found = atlas(DumbbellPair(factor * length, 1.0, rod))
            counts[side].add(tuple(found.components_ordered[k] for k in (3, 4, 5)))
            named[side] |= {found.kind(corner) for corner in found.skeleton.corners}
    full = atlas(PLANE)
    described = {tuple(full.components_ordered[k] for k in (3, 4, 5))}
    kinds = {full.kind(corner) for corner in full.skeleton.corners}
    exact = max(abs(touching_both_ends(rod) - long_rod_length(1.0, rod)) for rod in rods)
    always = math.sqrt(3) - 1
    right = counts["above"] == described != counts["below"] and named["above"] == kinds
    return Finding(
        Verdict.HOLDS if right else Verdict.REFUTED,
        f"For $t/r$ = {rods[0]} and {rods[1]} the lengths examined are "
        f"{threshold(rods[0]):.4f} and {threshold(rods[1]):.4f} ball radii; one per cent above, "
        f"$D_3, D_4, D_5$ have {_listed(counts['above'])} components, one per cent below "
        f"{_listed(counts['below'])}, {'with' if named['below'] & kinds else 'without'} "
        r"$\Delta$ and $\mathcal{E}$. Where a ball can just touch both balls of the other dumbbell "
        r"is $\ell = 2\sqrt{4r^2 - (r+t)^2}$ to within "
        f"{exact:.0e} ball radii; for $t/r >$ {always:.3f} that is less than $2r$ and all rods are "
        "long.",
        {"deviation": exact},
    )


def _listed(counts: set[tuple[int, ...]]) -> str:
    return " or ".join(str(count) for count in sorted(counts))


def crossed(pair: DumbbellPair, q: Array) -> NDArray[np.bool_]:
    """Return whether the axes cross in the developed plane, from the sides of their ends."""
    a1, a2, b1, b2 = np.moveaxis(pair.developed(q), -2, 0)

    def side(p: Array, start: Array, end: Array) -> Array:
        u, v = end - start, p - start
        return np.asarray(np.sign(u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]))

    apart_b = side(b1, a1, a2) != side(b2, a1, a2)
    return np.asarray(apart_b & (side(a1, b1, b2) != side(a2, b1, b2)))


def inequalities_suffice(names: tuple[str, ...] = CONTACTS) -> Finding:
    """Sample pairs that satisfy the inequalities, and search for overlapping rods or balls."""
    rng = np.random.default_rng(11)
    reach = PLANE.length + 4 * PLANE.ball_radius
    wrong, crosses, least, judged = 0, 0, np.inf, 0
    for pair in (PLANE, DRUM):
        q = np.zeros((20000, 6))
        q[:, 3:5] = rng.uniform(-reach, reach, (len(q), 2)) / 2
        q[:, [2, 5]] = rng.uniform(-math.pi, math.pi, (len(q), 2))
        q[:, 3] /= 1.0 if pair.is_plane else pair.centre_radius
        values = pair.polyhedron.values(q)
        rows = [pair.polyhedron.names.index(name) for name in names]
        held = (values[:, rows] >= 0).all(axis=1)
        bad = held & ~np.asarray(pair.polyhedron.contains(q))
        meet = crossed(pair, q)
        judged, crosses = judged + int(held.sum()), crosses + int((bad & meet).sum())
        wrong += int((bad & ~meet).sum())
        least = min(least, float(values[held & ~meet, pair.polyhedron.names.index("ab")].min()))
    example = np.array([0, 0, 0, 0, 0, math.pi / 2])
    gaps = dict(zip(PLANE.polyhedron.names, PLANE.polyhedron.values(example), strict=True))
    smallest = min(gaps[name] for name in CONTACTS)
    kept = Verdict.HOLDS_UNDER if crosses else Verdict.HOLDS
    return Finding(
        Verdict.REFUTED if wrong else kept,
        f"Of {judged} random pairs that satisfy the {len(names)} inequalities {crosses} overlap "
        f"with crossed rods and {wrong} otherwise; rods that do not cross are {least:.3f} mm or "
        "more apart. Two dumbbells laid crosswise with common centre keep the eight gaps at "
        f"{smallest:.2f} mm or more while their rods overlap by {-gaps['ab']:.2f} mm.",
        {"crossed": float(crosses), "otherwise": float(wrong), "least_rod_gap": least},
        "For pairs whose rods do not cross. Crossed pairs satisfy all eight and need a ninth "
        r"inequality, $d(\alpha,\beta) \ge 2t$ for the rods. It is never active: in the plane, "
        "rods that do not cross are nearest at an end of one of them, and an end is $r + t > 2t$ "
        "away.",
    )


def body_is(*, ball: bool = False) -> Finding:
    """Compare the forbidden body, modulo motions of the pair, with a solid without a hole."""
    found = atlas(PLANE)
    skeleton, ordered = found.skeleton, found.components_ordered
    euler = skeleton.euler_characteristic
    sizes = len(skeleton.corners), len(skeleton.edges), len(skeleton.faces)
    local = all(len(f.boundary) == 1 and f.closed for f in skeleton.faces)
    if not local or (ball and euler != 2):
        verdict = Verdict.REFUTED
    else:
        verdict = Verdict.HOLDS if euler == 2 else Verdict.HOLDS_UNDER
    return Finding(
        verdict,
        f"The surface of the forbidden body has {sizes[0]} corners, {sizes[1]} edges and "
        f"{sizes[2]} faces with labelled balls, {ordered[3]}, {ordered[4]} and {ordered[5]} in "
        f"$M \\times M$, each face with one boundary curve: Euler characteristic {euler}, that of "
        "a torus, where the surface of a ball has 2.",
        {"euler": float(euler if euler is not None else -1)},
        "Locally, as stated. As a whole the body is a solid torus around the circle of relative "
        "headings, and not the compact solid without a hole that a drawing in space suggests.",
    )


def drawings() -> Finding:
    return Finding(
        Verdict.NOT_TESTABLE,
        "The source of the paper comes without its drawings. Which drawn pair has which colour, "
        "which panel shows which motion, and which pair is left-handed in them cannot be checked; "
        "what the drawings have to show is checked in the other claims.",
    )


CLAIMS: tuple[Claim, ...] = (
    Claim(
        "D14",
        "5",
        "assumption on the length of the rods",
        "The description holds as long as no ball can touch both balls of the other dumbbell.",
        Means.NUMERICAL,
        picture_holds_above,
        partial(picture_holds_above, lambda _: 4.0),
    ),
    Claim(
        "D15",
        "5",
        "inequalities, section 5",
        "The inequalities between balls, and between balls and rods, describe $D$.",
        Means.NUMERICAL,
        inequalities_suffice,
        partial(inequalities_suffice, CONTACTS[1:]),
    ),
    Claim(
        "D16",
        "5",
        "caption of the figure of the solid",
        "Without the free dimensions $D$ is locally the outside of a compact solid, whose corners, "
        "edges and faces are $D_3$, $D_4$ and $D_5$.",
        Means.NUMERICAL,
        body_is,
        partial(body_is, ball=True),
        figure="solid",
    ),
    Claim(
        "D18",
        "5",
        "colours and panels of the figures of faces, solid and nested pairs",
        "Colours and panels are assigned to the pairs and motions as the captions say.",
        Means.NUMERICAL,
        drawings,
        None,
    ),
)
