"""Section 5: the polyhedron of a pair near each kind of contact."""

from functools import cache, partial

import numpy as np

from paper_checks.framework.claims import Claim, Finding, Means, Verdict
from paper_checks.section5.pairs import (
    DELTA,
    DRUM,
    E_CORNER,
    PLANE,
    Array,
    atlas,
    between,
    by_contacts,
    differentiated,
    first_contacts,
    is_described,
    least,
    parts,
)
from polycorner import minimise, prove
from polycorner.dumbbells import DumbbellPair


def ball_on_ball(equality: str = "line") -> Finding:
    """Compare distances at pairs with one ball-ball contact: to the centre or to the axial line."""
    points = [(name, q) for name, q in first_contacts() if len(name) == 4]
    missed = sum(is_described(DRUM, q, by_contacts(DRUM, [n]), 1)[0] for n, q in points)
    off = {"line": 0.0, "centre": 0.0}
    for name, q in points:
        ball, other = parts(name)
        two = least(DRUM, name)
        off["centre"] = max(off["centre"], abs(float(between(DRUM, q, ball, other)) - two))
        off["line"] = max(off["line"], abs(float(between(DRUM, q, ball, "b")) - two))
    small = 1e-9
    repaired = missed == 0 and off["centre"] < small
    holds = missed == 0 and off[equality] < small
    return Finding(
        Verdict.HOLDS if holds else Verdict.CORRECTED if repaired else Verdict.REFUTED,
        f"At {len(points)} pairs with one ball-ball contact the distance of the centres differs "
        f"from $2r$ by {off['centre']:.1e} mm at most, that of $A_i$ from the axial line $\\beta$ "
        f"by up to {off['line']:.2f} mm; $d(A_i,B_j) \\ge 2r$ misjudges {missed} of "
        f"{2000 * len(points)} neighbours.",
        {"off_line": off["line"], "off_centre": off["centre"]},
        "" if holds else r"$D_5$ is $d(A_i, B_j) = 2r$ there, and $D_6$ is $d(A_i, B_j) > 2r$.",
    )


def ball_on_rod(radii: tuple[float, float] = (1.0, 1.0)) -> Finding:
    """Compare the distance to the axial line with a combination of ball and rod radius."""
    points = [(name, q) for name, q in first_contacts() if len(name) == 3]
    limit = radii[0] * DRUM.ball_radius + radii[1] * DRUM.rod_radius
    missed, off, room = 0, 0.0, np.inf
    for name, q in points:
        pair = parts(name) if name[0] == "A" else parts(name)[::-1]
        gap = [lambda p, pair=pair: between(DRUM, p, *pair) - limit]
        missed += is_described(DRUM, q, gap, 2)[0]
        off = max(off, abs(float(gap[0](q))))
        ends = [f"{pair[1].upper()}{k}" for k in (1, 2)]
        room = min(room, *(float(between(DRUM, q, pair[0], end)) for end in ends))
    foot = np.sqrt(room**2 - limit**2) if room > limit else 0.0
    return Finding(
        Verdict.HOLDS if missed == 0 and off < 1e-9 else Verdict.REFUTED,
        f"At {len(points)} pairs with one ball-rod contact the distance from the axial line is "
        f"{limit:g} mm to within {off:.1e} mm, and the inequality misjudges {missed} of "
        f"{2000 * len(points)} neighbours. The foot is {foot:.2f} mm or more from the rod's ends, "
        "so that line and rod are the same there.",
        {"off": off, "misjudged": float(missed)},
    )


def corner_points(names: tuple[str, ...], pair: DumbbellPair = DRUM) -> list[Array]:
    """Return the corners with these contacts, in the plane or in a section of the drum."""
    wanted = frozenset(names)
    return [c.point for c in atlas(pair).skeleton.corners if frozenset(c.active) == wanted]


def edge_points(names: tuple[str, ...], pair: DumbbellPair = DRUM) -> list[Array]:
    """Return a point in the middle of every edge with these contacts."""
    wanted = frozenset(names)
    edges = [e for e in atlas(pair).skeleton.edges if frozenset(e.active) == wanted]
    return [e.polyline[len(e.polyline) // 2] for e in edges]


def two_rods_touch(names: tuple[str, ...] = ("aB1", "A2b")) -> Finding:
    points = edge_points(("A2b", "aB1"))
    judged = [is_described(DRUM, q, by_contacts(DRUM, names), 3) for q in points]
    missed = sum(wrong for wrong, _ in judged)
    ranks = [np.linalg.matrix_rank(differentiated(DRUM, q, names), tol=1e-6) for q in points]
    return Finding(
        Verdict.HOLDS if missed == 0 else Verdict.REFUTED,
        f"Near {len(points)} pairs of this kind the {len(names)} inequalities misjudge {missed} of "
        f"{2000 * len(points)} neighbours; their gradients have rank "
        f"{', '.join(str(r) for r in sorted({int(r) for r in ranks}))}, so that closing one of two "
        "and opening the other is possible.",
        {"misjudged": float(missed)},
    )


@cache
def _proved() -> tuple[bool, bool, tuple[str, ...]]:
    """Prove properties of the corner Delta of the plane in interval arithmetic."""
    certificate = minimise(PLANE.polyhedron, PLANE.energy, PLANE.nested("R"))
    conditions = prove(certificate).conditions
    told = [
        conditions[name].value == "proved" and conditions["unique solution"].value == "proved"
        for name in ("independent gradients", "inactive gaps positive")
    ]
    return told[0], told[1], tuple(certificate.active)


def delta_is(names: tuple[str, ...] = DELTA) -> Finding:
    """Sample around Delta in the drum; prove the claim for one pair in the plane, hence for all."""
    points = corner_points(DELTA)
    missed = sum(is_described(DRUM, q, by_contacts(DRUM, names), 4)[0] for q in points)
    independent, apart, active = _proved()
    proved = independent and apart and len(active) == len(names)
    return Finding(
        Verdict.HOLDS if missed == 0 and proved else Verdict.REFUTED,
        f"The {len(names)} inequalities misjudge {missed} of {2000 * len(points)} neighbours of "
        f"{len(points)} corners in the drum. In the plane, interval arithmetic encloses a pair "
        f"with the contacts {', '.join(active)} and proves "
        f"{'both' if independent and apart else 'not both'} that their gradients are independent "
        "and that all other gaps are positive; rigid motions and the mirror carry this to all of "
        "$\\Delta$.",
        {"misjudged": float(missed)},
    )


def e_is(names: tuple[str, ...] = E_CORNER, excess: int = 1) -> Finding:
    points = corner_points(E_CORNER)
    missed = sum(is_described(DRUM, q, by_contacts(DRUM, names), 6)[0] for q in points)
    needed = all(
        any(is_described(DRUM, q, by_contacts(DRUM, rest), 6)[0] for q in points)
        for k in range(len(names))
        for rest in [names[:k] + names[k + 1 :]]
    )
    values = [np.linalg.svd(differentiated(DRUM, q, names), compute_uv=False) for q in points]
    ranks = {int((v > 1e-7 * v[0]).sum()) for v in values}
    right = missed == 0 and needed and ranks == {len(names) - excess}
    return Finding(
        Verdict.HOLDS if right else Verdict.REFUTED,
        f"Near {len(points)} corners in the drum the {len(names)} inequalities misjudge {missed} "
        f"of {2000 * len(points)} neighbours, and {'none' if needed else 'some'} can be left "
        f"out. The gradients have rank {', '.join(map(str, sorted(ranks)))}, the next singular "
        f"value being {max(v[-1] / v[0] for v in values):.0e} of the largest: {len(names)} "
        f"equalities of which {len(names) - max(ranks)} follows from the others, hence dimension "
        f"{6 - max(ranks)}.",
        {"misjudged": float(missed), "rank": float(max(ranks))},
    )


CLAIMS: tuple[Claim, ...] = (
    Claim(
        "D1a",
        "5",
        "description of D5 where balls touch",
        r"Where $A_i$ touches $B_j$, $D$ is locally $d(A_i,B_j) \ge 2r$, with $D_5$ given by "
        r"$d(A_i,\beta) = 2r$ and $D_6$ by $d(A_i,\beta) > 2r$.",
        Means.NUMERICAL,
        ball_on_ball,
        partial(ball_on_ball, "centre"),
        figure="faces",
    ),
    Claim(
        "D1b",
        "5",
        "description of D5 where a ball touches a rod",
        r"Where a ball touches the rod of the other dumbbell, $D$ is locally the set where its "
        r"centre is at least $r + t$ from the axial line.",
        Means.NUMERICAL,
        ball_on_rod,
        partial(ball_on_rod, (0.0, 2.0)),
        figure="faces",
    ),
    Claim(
        "D1c",
        "5",
        "example of D4",
        r"Where $A_2$ touches $\beta$ and $B_1$ touches $\alpha$, the two inequalities define $D$ "
        r"locally, and equality in one or both gives $D_5$ and $D_4$.",
        Means.NUMERICAL,
        two_rods_touch,
        partial(two_rods_touch, ("aB1",)),
        figure="faces",
    ),
    Claim(
        "D5",
        "5",
        "description of Delta",
        r"Near a pair with $A_2$ on $\beta$, $B_1$ on $\alpha$ and $A_2$ on $B_1$, exactly these "
        "three inequalities define $D$.",
        Means.PROOF,
        delta_is,
        partial(delta_is, ("A2b", "aB1")),
        figure="solid",
    ),
    Claim(
        "D6",
        "5",
        "description of E",
        r"Near a pair with $A_2$ on $\beta$, $B_1$ on $\alpha$, $A_1$ on $B_1$ and $A_2$ on $B_2$ "
        r"these four inequalities define $D$; as equalities they are overdetermined by one, so "
        r"that $\mathcal{E}$ has dimension three.",
        Means.NUMERICAL,
        e_is,
        partial(e_is, excess=0),
        figure="solid",
    ),
)
