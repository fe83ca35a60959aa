"""Section 5: numbers of components of the strata, their kinds, and the motions between them.

A point of ``M x M`` is an ordered pair of dumbbells with indistinguishable balls.  Counts for
labelled balls, and for indistinguishable dumbbells, are given for comparison.
"""

from collections import Counter
from dataclasses import replace
from functools import cache, partial

import numpy as np

from paper_checks.framework.claims import Claim, Finding, Means, Verdict
from paper_checks.section5.pairs import DRUM, PLANE, atlas, first_contacts, kinds
from polycorner.dumbbells import DumbbellPair, PairAtlas, RelativePlacements
from polycorner.dumbbells.statics.skeleton import corner_kind
from polycorner.proofs import CornerList, corners

Ends = tuple[str, ...]
PARTS = ("corners", "edges", "faces")
SIZES = (PLANE, *(replace(PLANE, length=a, rod_radius=t) for a, t in ((14, 1.8), (18, 1.2))))


def _typeset(kinds: str) -> str:
    """Return names of corners, joined by hyphens, as TeX."""
    letters = kinds.replace("Delta", r"\Delta").replace("E_", r"\mathcal{E}_")
    return f"${letters.replace('-', '$ to $')}$"


def _counts(found: PairAtlas) -> dict[str, dict[int, int]]:
    return {
        "labelled": found.components,
        "ordered": found.components_ordered,
        "unordered": found.components_unordered,
    }


def _both_agree() -> bool:
    """Return whether the section of the drum has the counts of the plane."""
    return _counts(atlas(PLANE)) == _counts(atlas(DRUM))


def kinds_are(numbers: tuple[int, int, int] = (2, 5, 2)) -> Finding:
    """Count kinds in D5, D4 and D3: sets of contacts up to names, with mirror images as one."""
    found = atlas(PLANE)
    by_dimension = [getattr(found.skeleton, part) for part in reversed(PARTS)]
    alike = tuple(len(kinds([frozenset(s.active) for s in strata])) for strata in by_dimension)
    handed = tuple(found.components_unordered[k] for k in (5, 4, 3))
    sizes = Counter(len(c.active) for c in found.skeleton.corners)
    holds = numbers in (alike, handed)
    return Finding(
        Verdict.HOLDS if holds else Verdict.CORRECTED,
        "Kinds of contact in $D_5$, $D_4$, $D_3$, no matter which of the balls and dumbbells take "
        f"part: {alike} if mirror images count as one, {handed} if they count as two. Corners have "
        f"{' or '.join(str(size) for size in sorted(sizes))} contacts.",
        {f"kinds_D{5 - k}": float(n) for k, n in enumerate(alike)},
        ""
        if holds
        else f"With mirror images counted as one throughout there are {alike[0]} kinds in $D_5$, "
        f"{alike[1]} in $D_4$ and {alike[2]} in $D_3$; counted as two, {handed[0]}, {handed[1]} "
        f"and {handed[2]}. {numbers[1]} for $D_4$ is of the second count, the others of the first.",
    )


@cache
def all_corners(pair: DumbbellPair) -> CornerList:
    """Return all corners of a pair in the plane up to motions, with proof."""
    model = RelativePlacements(pair)
    box = {**model.box, "alpha": 0.0}
    return corners(model.polyhedron, box=box, symmetry=model.rotations)


def _relabelled(active: frozenset[str]) -> set[frozenset[str]]:
    """Return contacts under all exchanges of the balls of either dumbbell."""
    found = {active}
    for one, other in (("A1", "A2"), ("B1", "B2")):
        found |= {frozenset(_exchanged(name, one, other) for name in names) for names in found}
    return found


def _exchanged(name: str, one: str, other: str) -> str:
    return name.replace(one, "*").replace(other, one).replace("*", other)


def _components(pair: DumbbellPair) -> tuple[list[str], bool]:
    """Return the kinds of all corners, and whether those of a kind are images of each other."""
    model = RelativePlacements(pair)
    kinds: dict[str, list[frozenset[str]]] = {}
    for p in all_corners(pair).points:
        kind = corner_kind(p.active, pair.chirality(model.placement(p.point)))
        kinds.setdefault(kind, []).append(frozenset(p.active))
    orbits = all(
        len(found) == len(set(found)) and set(found) == _relabelled(found[0])
        for found in kinds.values()
    )
    return sorted(kinds), orbits


def corners_fall_into(
    names: tuple[str, ...] = ("Delta_L", "Delta_R", "E_L", "E_R"),
    pairs: tuple[DumbbellPair, ...] = SIZES,
) -> Finding:
    """List all corners with proof and compare the components of D3 in M x M with the names."""
    lists = [all_corners(pair) for pair in pairs]
    boxes = sum(found.tally.boxes for found in lists)
    sizes = ", ".join(f"({p.length:g}, {p.ball_radius:g}, {p.rod_radius:g})" for p in pairs)
    told = (
        f"Branch and bound over {boxes} boxes of relative placements in the plane, in interval "
        f"arithmetic, for $(\\ell, r, t)$ = {sizes}, "
    )
    numbers = {"labelled": float(len(lists[0])), "boxes": float(boxes)}
    if not all(found.complete for found in lists):
        return Finding(Verdict.NOT_TESTABLE, told + "leaves something undecided.", numbers)
    found = [_components(pair) for pair in pairs]
    right = all(kinds == sorted(names) and orbits for kinds, orbits in found) and _both_agree()
    kinds = ", ".join(map(_typeset, found[0][0]))
    return Finding(
        Verdict.HOLDS if right else Verdict.REFUTED,
        f"{told}lists all corners up to motions: {len(lists[0])} with labelled balls, {kinds}. "
        "Those of a kind differ by an exchange of balls, so that each kind is one component of "
        f"$D_3$. A section of the drum has {'the same' if _both_agree() else 'other'} counts, "
        "which are those of a search.",
        numbers | {"components": float(len(found[0][0]))},
    )


def components_are(dimension: int, number: int) -> Finding:
    """Count components of a stratum in M x M; test the counts by Euler's formula and handshakes."""
    counts = _counts(atlas(PLANE))
    ordered, loose = counts["ordered"], counts["unordered"]
    true = ordered[dimension]
    claimed = ordered | {dimension: number}
    euler = {name: c[3] - c[4] + c[5] for name, c in (("counted", ordered), ("printed", claimed))}
    ends = [len(c.edges) for c in atlas(PLANE).skeleton.corners]
    edges = sum(ends) / len(ends) * ordered[3] / 2
    sound = euler["counted"] == atlas(PLANE).skeleton.euler_characteristic == 0 and _both_agree()
    holds = number == true and sound
    return Finding(
        Verdict.HOLDS if holds else Verdict.CORRECTED if sound else Verdict.REFUTED,
        f"In $M \\times M$, ordered pairs with balls alike, $D_3$, $D_4$, $D_5$ have "
        f"{ordered[3]}, {ordered[4]}, {ordered[5]} components ({loose[3]}, {loose[4]}, {loose[5]} "
        f"for indistinguishable dumbbells); {ordered[3]} corners with "
        f"{sum(ends) / len(ends):g} edges on average need {edges:g} edges. The boundary of the "
        f"forbidden body has the Euler characteristic {euler['counted']}; {number} components of "
        f"$D_{dimension}$ would give {euler['printed']}.",
        {"ordered": float(true), "unordered": float(loose[dimension])},
        ""
        if holds
        else f"$D_{dimension}$ has {true} components in $M \\times M$, where the caption counts "
        f"{ordered[5]} of $D_5$; {loose[dimension]} is the number for indistinguishable "
        f"dumbbells, which leaves {loose[5]} of $D_5$.",
    )


def _motion(active: tuple[str, ...]) -> str:
    """Return the name of a kind of motion."""
    balls = sum(len(name) == 4 for name in active)
    return {0: "slide", 1: "turn", 2: "swing"}[balls]


def half_motions_are(numbers: tuple[int, int] = (3, 4)) -> Finding:
    """Count the edges at every Delta and E, and list which corners each kind of motion joins."""
    found = atlas(PLANE)
    corners, edges = found.skeleton.corners, found.skeleton.edges
    seen: dict[str, set[tuple[str, ...]]] = {}
    for corner in corners:
        letter = found.kind(corner).split("_")[0]
        leaving = tuple(sorted(_motion(edges[k].active) for k in corner.edges))
        seen.setdefault(letter, set()).add(leaving)
    joined: dict[str, set[str]] = {}
    for edge in edges:
        ends = sorted(found.kind(corners[k]) for k in edge.ends if k is not None)
        joined.setdefault(_motion(edge.active), set()).add("-".join(ends))
    closed = all(
        set(edges[k].active) < set(corner.active) for corner in corners for k in corner.edges
    )
    delta, e = (seen[letter] for letter in ("Delta", "E"))
    (from_delta,), (from_e,) = delta, e
    new = Counter(from_e) - Counter(from_delta)
    right = (len(from_delta), len(from_e)) == numbers and closed and sum(new.values()) == 1
    direct = any("Delta_L-Delta_R" in ends for ends in joined.values())
    listed = "; ".join(
        f"{kind}: {', '.join(_typeset(pair) for pair in sorted(ends))}"
        for kind, ends in joined.items()
    )
    return Finding(
        Verdict.HOLDS if right else Verdict.REFUTED,
        f"Every $\\Delta$ has the motions {', '.join(from_delta)}, every $\\mathcal{{E}}$ "
        f"{', '.join(from_e)}: new at $\\mathcal{{E}}$ is {', '.join(new)}. A slide keeps two "
        "ball-rod contacts, a turn a ball-ball and a ball-rod contact, a swing two ball-ball "
        f"contacts. Joined by a {listed}; {'some' if direct else 'none'} joins $\\Delta_L$ to "
        "$\\Delta_R$.",
        {"at_delta": float(len(from_delta)), "at_E": float(len(from_e))},
    )


def mirror_stays_in_component(motion: str = "swing") -> Finding:
    """Find the components that contain the mirror images of the midpoints of a kind of edge."""
    found = atlas(PLANE)
    corners, edges = found.skeleton.corners, found.skeleton.edges
    home = {k: n for n, orbit in enumerate(found.ordered["edges"]) for k in orbit}

    def mirrored(k: int) -> int:
        image = PLANE.mirror(corners[k].point)
        apart = [
            PLANE.symmetry.separation(PLANE.manifold, image, c.point)
            if c.active == corners[k].active
            else np.inf
            for c in corners
        ]
        return int(np.argmin(apart)) if min(apart) < 1e-6 else -1

    kept, lost = 0, 0
    for k, edge in enumerate(edges):
        if _motion(edge.active) == motion:
            ends = {mirrored(end) for end in edge.ends if end is not None}
            (image,) = (
                j
                for j, other in enumerate(edges)
                if other.active == edge.active and set(other.ends) == ends
            )
            kept, lost = kept + (home[image] == home[k]), lost + (home[image] != home[k])
    flat = PLANE.side_by_side()
    between = PLANE.chirality(flat)
    return Finding(
        Verdict.HOLDS if kept and not lost else Verdict.REFUTED,
        f"Of {kept + lost} edges with labelled balls of the kind {motion!r} the mirror image of "
        f"{kept} lies in the same component of $D_4$ in $M \\times M$, that of {lost} in another. "
        "During a swing the dumbbells come to lie side by side, where the hand is "
        f"{'not defined' if between is None else between}.",
        {"kept": float(kept), "lost": float(lost)},
    )


def single_contacts_have_no_hand(of: str = "points") -> Finding:
    """Determine the hand at single contacts, and search every component of D5 for both hands."""
    found = first_contacts(PLANE)
    hands = [(_component(name), PLANE.chirality(q)) for name, q in found]
    flipped = [PLANE.chirality(PLANE.mirror(q)) for _, q in found]
    handed = sum(hand is not None for _, hand in hands)
    opposite = sum({a, b} == {"L", "R"} for (_, a), b in zip(hands, flipped, strict=True))
    touching = PLANE.chirality(PLANE.end_to_end(gap=0.0))
    met: dict[str, Counter[str | None]] = {}
    for component, hand in hands:
        met.setdefault(component, Counter())[hand] += 1
    both = all(count["L"] and count["R"] for count in met.values())
    whole = both and len(met) == atlas(PLANE).components_ordered[5]
    holds = whole if of == "components" else handed == 0
    listed = "; ".join(f"{name}: {n['L']} left, {n['R']} right" for name, n in sorted(met.items()))
    return Finding(
        Verdict.HOLDS if holds else Verdict.CORRECTED if whole else Verdict.REFUTED,
        f"Of {len(found)} random pairs with one contact {handed} have a hand by the paper's own "
        f"definition, and the mirror image of {opposite} has the other one, so that they cannot be "
        f"moved onto their mirror images. By component of $D_5$: {listed}.",
        {"handed": float(handed), "pairs": float(len(found))},
        ""
        if holds
        else "A component of $D_5$ has no chirality: it contains pairs of either hand and is its "
        "own mirror image. Its points have one, with exceptions "
        f"({'pairs end to end' if touching is None else 'none known'}).",
    )


def _component(contact: str) -> str:
    """Return the component of D5 in M x M to which a contact belongs."""
    if len(contact) == 4:
        return "ball on ball"
    return "ball of A on rod of B" if contact[0] == "A" else "ball of B on rod of A"


CLAIMS: tuple[Claim, ...] = (
    Claim(
        "D3",
        "5",
        "kinds of contact",
        "There are two kinds of pairs in $D_5$, five in $D_4$, and two in $D_3$, with three and "
        "four points of contact.",
        Means.NUMERICAL,
        kinds_are,
        partial(kinds_are, (2, 3, 2)),
        figure="faces",
    ),
    Claim(
        "D7a",
        "5",
        "partition of D3 by chirality",
        r"$D_3$ has the four components $\Delta_L$, $\Delta_R$, $\mathcal{E}_L$, $\mathcal{E}_R$.",
        Means.PROOF,
        corners_fall_into,
        partial(corners_fall_into, ("Delta_L", "Delta_R", "E_N")),
        figure="faces",
    ),
    Claim(
        "D9a",
        "5",
        "caption of the figure of the faces",
        "$D_5$ has exactly three components, two of which are exchanged with the dumbbells.",
        Means.NUMERICAL,
        partial(components_are, 5, 3),
        partial(components_are, 5, 2),
        figure="faces",
    ),
    Claim(
        "D9b",
        "5",
        "caption of the figure of the faces; section 7",
        "$D_4$ has five components.",
        Means.NUMERICAL,
        partial(components_are, 4, 5),
        partial(components_are, 4, 7),
        figure="faces",
    ),
    Claim(
        "D10",
        "5",
        "caption of the figure of the solid",
        r"Three half motions that keep two contacts leave every $\Delta$, and four every "
        r"$\mathcal{E}$: the same three and a new one.",
        Means.NUMERICAL,
        half_motions_are,
        partial(half_motions_are, (3, 3)),
        figure="solid",
    ),
    Claim(
        "D11",
        "5",
        "caption of the figure of the faces",
        "The pair with two ball-ball contacts and its mirror image lie in one component of $D_4$.",
        Means.NUMERICAL,
        mirror_stays_in_component,
        partial(mirror_stays_in_component, "slide"),
        figure="faces",
    ),
    Claim(
        "D13",
        "5",
        "caption of the figure of the faces",
        "Pairs with a single point of contact have no chirality.",
        Means.NUMERICAL,
        single_contacts_have_no_hand,
        partial(single_contacts_have_no_hand, "components"),
        figure="faces",
    ),
)
