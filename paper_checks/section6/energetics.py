"""Section 6: minima of the energy of a pair, and claims about its corner."""

import math
from dataclasses import replace
from functools import cache, partial

import numpy as np
import sympy

from paper_checks.framework.claims import Claim, Finding, Means, Verdict
from paper_checks.section6 import corner, depths, ends, grip
from paper_checks.section6.corner import BALL, LENGTH, ROD, sizes
from paper_checks.section6.experiment import (
    BUNCH,
    CORNER,
    EXPERIMENT,
    enclosed,
    height,
    middle,
    multiplier,
    proof,
    rests,
)
from polycorner import Minima, Proof, minimise, prove
from polycorner.dumbbells import (
    DumbbellPair,
    RelativePlacements,
    critical_rod_radius,
    pair_minima,
    plane_critical_formula,
)
from polycorner.proofs import StationaryList, stationary_points

THIN = DumbbellPair(length=12.5, ball_radius=3, rod_radius=0.05, drum_radius=125)
THICK = replace(EXPERIMENT, rod_radius=2.95)
SHORT = replace(EXPERIMENT, length=7)  # a ball touches both balls of the other dumbbell
NAMED = frozenset({"G", "delta_R", "delta_L"})
OTHERS = tuple(
    replace(EXPERIMENT, length=length, rod_radius=rod)
    for length in (14, 16, 18)
    for rod in (1.2, 1.5, 1.8)
)


# ------------------------------------------------------------------------- E2: the nested corners


def corners_are_minima(pair: DumbbellPair = EXPERIMENT) -> Finding:
    proofs = {name: proof(pair, name) for name in ("delta_R", "delta_L")}
    proved = all(found.proved and set(found.active) == set(CORNER) for found in proofs.values())
    failed = [k for k, v in proofs["delta_R"].conditions.items() if v.name == "FAILED"]
    if not proved:
        return Finding(
            Verdict.REFUTED,
            f"At $t = {pair.rod_radius:g}$ mm, where the energy is stationary on the corner, "
            f"interval arithmetic proves that these fail: {', '.join(failed) or 'none'}.",
        )
    energies = [middle(enclosed(found, height(pair))) for found in proofs.values()]
    rise = energies[0] - 4 * pair.ball_radius
    least = min(middle(multiplier(proofs["delta_R"], name)) for name in CORNER)
    return Finding(
        Verdict.HOLDS,
        f"Interval arithmetic proves both corners to be strict local minima up to a shift along "
        f"the drum: the three contacts {', '.join(CORNER)} are closed and press, the least with "
        f"multiplier {least:.6f}; all other gaps are open. Both lie {rise:.6f} mm higher than "
        f"$G$ (difference {abs(energies[0] - energies[1]):.0e} mm).",
        {"least_multiplier": least, "rise": rise},
    )


# ---------------------------------------------------------------------------- E7: other minima


@cache
def fallen(pair: DumbbellPair, starts: int) -> Minima:
    """Return the minima found by descent from random placements, up to shifts and relabelling."""
    return pair_minima(pair, starts=starts, rng=np.random.default_rng(6))


def locus_of(pair: DumbbellPair, active: tuple[str, ...], q: np.ndarray) -> str:
    """Return the paper's name of a minimum, or the contacts that hold the pair there."""
    kinds = sorted(len(name) for name in active)
    if not kinds:
        return "G"
    return f"delta_{pair.chirality(q)}" if kinds == [3, 3, 4] else " ".join(active)


@cache
def everything(pair: DumbbellPair) -> tuple[StationaryList, frozenset[str]]:
    """Return all local minima of a pair up to rolling and shifts, with proof, and their names."""
    model = RelativePlacements(pair)
    found = stationary_points(
        model.polyhedron, model.energy, box=model.box, symmetry=model.symmetry, minima_only=True
    )
    corners = [locus_of(pair, p.active, model.placement(p.point)) for p in found.minima]
    lines = [
        all(abs(np.sin(place.lower[name])) < 1e-6 for name in ("alpha", "beta"))
        for place in found.loci
    ]
    return found, frozenset([*corners, *("G" if line else "another locus" for line in lines)])


def only_loci(
    named: frozenset[str] = NAMED,
    pairs: tuple[DumbbellPair, ...] = (*OTHERS, BUNCH),
    starts: int = 1000,
) -> Finding:
    """List all local minima with proof; then examine far thinner and shorter rods."""
    found = {pair: everything(pair) for pair in pairs}
    complete = all(listed.complete for listed, _ in found.values())
    boxes = sum(listed.tally.boxes for listed, _ in found.values())
    sizes: dict[frozenset[str], list[str]] = {}
    for p, (_, names) in found.items():
        size = f"{p.length:g}, {p.ball_radius:g}, {p.rod_radius:g}"
        sizes.setdefault(names, []).append(size)
    told = "; ".join(
        f"{', '.join(sorted(names))} for $(\\ell, r, t) = ({'), ('.join(of)})$"
        for names, of in sizes.items()
    )
    told = (
        f"Branch and bound over {boxes} boxes of relative placements in the drum, in interval "
        f"arithmetic, lists all local minima{'' if complete else ' but for undecided boxes'} "
        f"({told})."
    )
    numbers = {"boxes": float(boxes)}
    if not complete:
        return Finding(Verdict.NOT_TESTABLE, told, numbers)
    if any(names != named for _, names in found.values()):
        return Finding(Verdict.REFUTED, told, numbers)
    crossed = [c for c in fallen(THIN, starts) if "ab" in c.active and len(c.active) > 1]
    proofs = [found for found in map(prove, crossed) if found.proved]
    if not proofs:
        return Finding(Verdict.HOLDS, told, numbers)
    rho, width = THIN.centre_radius, THIN.length**2 / 16
    level = float(rho - np.sqrt(rho**2 - 4 * width)) / 2
    short, others = everything(SHORT)
    balls = {name for name in others - {"G"} if not set("ab") & set(name)}
    reach = 2 * math.sqrt(4 * SHORT.ball_radius**2 - (SHORT.ball_radius + SHORT.rod_radius) ** 2)
    replaced = short.complete and others == {"G"} | balls and len(balls) > 0
    thicker = fallen(replace(THIN, rod_radius=1.2 * level), starts)
    crossings = sum("ab" in c.active for c in thicker)
    return Finding(
        Verdict.HOLDS_UNDER,
        f"{told} For $\\ell = {THIN.length:g}$, $r = {THIN.ball_radius:g}$, $t = "
        f"{THIN.rod_radius:g}$ mm, which also meets the assumptions ($\\ell/R = "
        f"{THIN.length / THIN.drum_radius:g}$), a crossed pair held by "
        f"{', '.join(proofs[0].active)} is proved to be a strict local minimum up to shifts; with "
        f"rods of {1.2 * level:.3f} mm {crossings or 'no'} crossed ones are found by descent from "
        f"{starts} random placements. For $\\ell = {SHORT.length:g}$ mm the complete list has "
        + (
            "$G$ and pairs held by three contacts of balls, in place of $\\delta$."
            if replaced
            else f"{', '.join(sorted(others))}."
        ),
        numbers
        | {
            "other_minima_proved": float(len(proofs)),
            "level_crossing_below": level,
            "by_balls": float(len(balls)),
            "shortest": reach,
        },
        "$G \\cup \\delta$ is everything for dumbbells of the experiment's sizes (proved). Rods "
        "have to be long, as section 5 assumes and section 6 does not repeat: where $\\ell < "
        f"2\\sqrt{{4r^2 - (r+t)^2}}$, here {reach:.2f} mm, a ball touches both balls of the other "
        "dumbbell before its rod, and three contacts of balls hold the pair. With "
        "very thin rods there are minima with one dumbbell across the other. A level crossing "
        f"needs $t(R - r - t) \\le \\ell^2/16$, here $t \\le {level:.3f}$ mm, and for thicker rods "
        "none is found; $D$ then has rod-rod contacts.",
    )


# ------------------------------------------------------------------------- E8: the shape of delta


@cache
def resting_places(count: int = 400) -> dict[str, set[tuple[float, ...]]]:
    """Return the minima of ordered pairs, up to shifts and with headings modulo ``pi``."""
    pair, rng = EXPERIMENT, np.random.default_rng(8)
    found: dict[str, set[tuple[float, ...]]] = {}
    for start in pair.placements(rng, count):
        rest = minimise(pair.polyhedron, pair.energy, start)
        if not rest.is_minimum:
            continue
        name = locus_of(pair, rest.active, rest.point)
        p1, e1, t1, p2, e2, t2 = pair.canonical(rest.point)
        along = np.sign(e2 - e1) if name == "G" else e2 - e1
        place = tuple(float(x) for x in np.round([p1, t1, p2, t2, along], 6) + 0.0)
        found.setdefault(name, set()).add(place)
    return found


def _shared(places: dict[str, set[tuple[float, ...]]]) -> int:
    """Return the number of minima that two loci have in common."""
    return sum(map(len, places.values())) - len(set().union(*places.values()))


def half_lines(components: int = 1, ordered: bool = True) -> Finding:
    """Count the components of ``G``, ``delta_R`` and ``delta_L`` in one and the same way."""
    places = resting_places()
    pair = EXPERIMENT
    counts = {
        name: len(found if ordered else {min(p, (*p[2:4], *p[:2], -p[4])) for p in found})
        for name, found in places.items()
    }
    q = rests(pair)["delta_R"].point
    exchanged = pair.swap(q)
    moved = float(abs(exchanged[4] - exchanged[1] - (q[4] - q[1])))
    holds = counts == {"delta_R": components, "delta_L": components, "G": 2 if ordered else 1}
    listed = ", ".join(f"{name}: {counts[name]}" for name in sorted(counts))
    return Finding(
        Verdict.HOLDS if holds else Verdict.CORRECTED,
        f"Components found by descent of {'ordered' if ordered else 'unordered'} pairs: {listed}."
        f" {_shared(places) or 'No'} place is in two of them. Exchanging the dumbbells changes "
        f"$\\eta_2 - \\eta_1$ at $\\delta_R$ by {moved:.4f} mm, so it leads to another point with "
        "the same mean $\\eta$, as it does on $G$.",
        {name: float(n) for name, n in counts.items()},
        ""
        if holds
        else "In $M \\times M$, where $G$ has two components, $\\delta_L$ and $\\delta_R$ "
        f"are {counts['delta_R']} half-lines each: either dumbbell can be the one in front. Only "
        "for dumbbells without names are they single half-lines, and then $G$ is connected too.",
    )


# --------------------------------------------------------- E9: rod radii for which it is a minimum


def minimum_below(limit: sympy.Expr = BALL, *, least: float = 0.05) -> Finding:
    """Check that the corner is a minimum for every rod thicker than ``least``, up to ``limit``.

    It is proved on an interval of rods by interval arithmetic, and checked just below the limit.
    """
    pair = EXPERIMENT
    numbers = sizes(pair)
    end, claimed = (float(e.subs(numbers)) for e in (critical_formula(), limit))
    computed = critical_rod_radius(pair)
    top = round(0.97 * end if least < end else 0.99 * claimed, 2)
    thinner = proved_for_rods(pair, least, top)
    below = rests(replace(pair, rod_radius=claimed * (1 - 1e-4)))["delta_R"].certificate
    thick = proof(THICK, "delta_R")
    known = thinner.proved and computed is not None and abs(computed - end) < 1e-9
    holds = known and below.is_minimum
    pressure = min(below.multipliers.values())
    return Finding(
        Verdict.HOLDS if holds else Verdict.HOLDS_UNDER if known else Verdict.REFUTED,
        f"For $t$ from {least:g} to {top:g} mm, in {len(thinner.cells)} cells, the corner is "
        f"{'' if thinner.proved else 'not '}proved to be a minimum; that all three contacts press "
        f"at $t = {THICK.rod_radius:g}$ mm is "
        f"{'disproved' if thick.conditions['multipliers positive'].name == 'FAILED' else 'open'}. "
        f"A multiplier vanishes at $t = {computed:.9f}$ mm, and "
        f"$2r\\sqrt{{1 - r^2/\\ell^2}} - r = {end:.9f}$. "
        f"Just below the claimed limit, {claimed:.4f} mm, the least one is {pressure:.2e}.",
        {"critical": end, "least_multiplier": pressure},
        ""
        if holds
        else "The corner is a minimum if and only if $t < t_c = 2r\\sqrt{1 - r^2/\\ell^2} "
        f"- r$ (here {end:.4f} mm; in the plane exactly, in the drum computed). For thicker rods "
        "the pair slides apart downhill.",
    )


@cache
def proved_for_rods(pair: DumbbellPair, least: float, most: float) -> Proof:
    """Return the proof about the corner for all rod radii of an interval."""
    corner_there = rests(replace(pair, rod_radius=most))["delta_R"].certificate
    return prove(corner_there, parameters={"t": (least, most)})


@cache
def critical_formula() -> sympy.Expr:
    """Return the critical rod radius in this module's symbols."""
    formula = plane_critical_formula()
    own = {s.name: s for s in (LENGTH, BALL, ROD)}
    return formula.subs({s: own[s.name] for s in formula.free_symbols})


CLAIMS = (
    *ends.CLAIMS,
    Claim(
        "E2",
        "6",
        "second paragraph; appendix C, last part",
        "Inside $\\Delta$ there is a locus $\\delta = \\delta_L \\cup \\delta_R$ of local minima "
        "of the energy, higher than $G$.",
        Means.PROOF,
        corners_are_minima,
        partial(corners_are_minima, THICK),
        figure="nested",
    ),
    *corner.CLAIMS,
    Claim(
        "E7",
        "6",
        "second paragraph; section 7.1, last paragraph",
        "$G$ and $\\delta$ are all the local minima of the energy on $D$.",
        Means.PROOF,
        only_loci,
        partial(only_loci, frozenset({"G"})),
        slow=True,
    ),
    Claim(
        "E8",
        "6",
        "after the definition of $\\delta_L$ and $\\delta_R$",
        "$\\delta_L$ and $\\delta_R$ are disjoint closed submanifolds of $M \\times M$, each a "
        "half-line with coordinate $(\\eta_1 + \\eta_2)/2$.",
        Means.NUMERICAL,
        half_lines,
        partial(half_lines, components=2),
    ),
    Claim(
        "E9",
        "6",
        "sections 2 and 6, read together",
        "The corner $\\Delta$ holds a minimum whatever the rods, as long as they are thinner than "
        "the balls.",
        Means.PROOF,
        minimum_below,
        partial(minimum_below, least=2.9),
    ),
    *grip.CLAIMS,
    *depths.CLAIMS,
)
