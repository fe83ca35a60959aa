"""Appendix C: the minimisation lemma and its application to a pair of dumbbells."""

from functools import cache, partial

import numpy as np
import sympy

from paper_checks.appendixC import chart, entrapment, lemma, rod_weight
from paper_checks.appendixC.lemma import X
from paper_checks.framework.claims import Claim, Finding, Means, Verdict
from paper_checks.section6.experiment import EXPERIMENT, PLANE, proof
from polycorner import stratum_at
from polycorner.dumbbells import DumbbellPair

SPLITS = ((1, 1, 0), (2, 1, 1), (1, 2, 1), (0, 2, 1), (3, 0, 1))
POINTS = 40
HEADINGS = (0.0, 8.0, 30.0, 60.0, 90.0)


# ---------------------------------------------------------------------------------- L1, L2: lemma


@cache
def carried_out() -> tuple[int, float]:
    """Carry out the proof on random polynomials; return how many, and the smallest cube."""
    rng = np.random.default_rng(12)
    done, smallest = 0, 1.0
    for split in SPLITS:
        example = lemma.random_example(rng, split)
        found = lemma.cube(example)
        split_holds = lemma.first_bracket_is_an_integral(example)
        if found and split_holds and lemma.bound_holds(example, rng, POINTS):
            done, smallest = done + 1, min(smallest, float(found[0]))
    return done, smallest


def minimum_lemma(dropped: str = "") -> Finding:
    """Check the lemma, with all hypotheses or without one of them."""
    known = lemma.counterexamples()
    if dropped:
        example = known[dropped]
        alone = [name for name, holds in example.hypotheses().items() if not holds] == [dropped]
        refuted = alone and example.falls()
        return Finding(
            Verdict.REFUTED if refuted else Verdict.HOLDS,
            f"$f = {sympy.latex(example.f)}$ violates {dropped} only, and on a path in $C$ to 0 "
            f"$f - f(0) = {sympy.latex(example.along_path())}$.",
        )
    done, smallest = carried_out()
    needed = [name for name in known if minimum_lemma(name).verdict is Verdict.REFUTED]
    listed = "; ".join(
        f"{name}: $f = {sympy.latex(known[name].f)}$"
        for name in needed
        if name != lemma.SMOOTH  # its formula is long and given in the lemma module
    )
    return Finding(
        Verdict.HOLDS if done == len(SPLITS) else Verdict.REFUTED,
        "The proof, $f - f(0) \\ge \\frac{a}{2}\\sum u_i + \\frac{h}{4}|v|^2$ on a small cube, is "
        f"carried out in exact arithmetic on {done} of {len(SPLITS)} random polynomials (smallest "
        f"half-width {smallest:g}). Each of {len(needed)} hypotheses is needed: without it a "
        f"function falls below $f(0)$ arbitrarily near 0 ({listed}; for smoothness, one that is "
        "differentiable at 0 only).",
        {"carried_out": float(done), "needed": float(len(needed))},
    )


def locus_of_minima(vanishing: str = "last") -> Finding:
    """Check where the minimum is attained: where the last ``r``, or the first ``p + q``, vanish."""
    f, split = X[0] + X[1] ** 2, (1, 1, 1)
    example = lemma.Example(f, split, (lemma.S, sympy.S.Zero, sympy.S.Zero))
    zero = {"last": X[2:3], "first": X[:2]}
    rises = {name: sympy.simplify(f.subs(dict.fromkeys(z, 0))) for name, z in zero.items()}
    named, right, slope = rises[vanishing], rises["first"], rises[vanishing].diff(X[0])
    failing = Verdict.CORRECTED if right == 0 else Verdict.REFUTED
    count = sum(example.hypotheses().values())
    return Finding(
        Verdict.HOLDS if named == 0 else failing,
        f"$f = {sympy.latex(f)}$ on $x_1 \\ge 0$ in $\\mathbb{{R}}^3$, $(p, q, r) = {split}$, "
        f"meets all {count} hypotheses. On the named set $f - f(0) = {sympy.latex(named)}$, with "
        f"slope {slope} along $x_1$.",
        {"hypotheses": float(count)},
        ""
        if named == 0
        else "$Z$ should be given by $x_1 = \\dots = x_{p+q} = 0$ (the first $p + q$ coordinates, "
        "not the last $r$): there $f = f(0)$, and every point of $C \\cap Z$ near 0 is a minimum.",
    )


def force_on_the_locus(splits: tuple[lemma.Split, ...] = SPLITS) -> Finding:
    """Check that ``-grad f`` does not vanish on the locus, where by (4) it equals that at 0."""
    rng = np.random.default_rng(13)
    still = [s for s in splits if not any(lemma.random_example(rng, s).slopes())]
    pulled = len(splits) - len(still)
    verdict = Verdict.HOLDS_UNDER if pulled and still else Verdict.HOLDS
    condition = all(p == 0 for p, _, _ in still)
    return Finding(
        verdict if pulled and condition else Verdict.REFUTED,
        f"For random functions with {len(splits)} choices of $(p, q, r)$ the force at 0, and so "
        f"along the locus, is not zero in {pulled} and zero in {len(still)}: "
        f"{', '.join(map(str, still)) or 'none'}.",
        {"pulled": float(pulled), "still": float(len(still))},
        "$p \\ge 1$; without a contact that presses the lemma is the usual condition on a manifold."
        if still
        else "",
    )


# ------------------------------------------------------------------------------- L6: the quadrant


def corner_determinant() -> sympy.Expr:
    """Return the Jacobian determinant of the three gaps by B's place and heading, in the plane.

    A lies along the ``y`` axis around the origin, B parallel to it at ``(-p, D)``.
    """
    length, r, t = sympy.symbols("l r t", positive=True)
    x, y, turn = sympy.symbols("x y delta", real=True)
    axis = sympy.Matrix([sympy.sin(turn), sympy.cos(turn)])
    a2 = sympy.Matrix([0, length / 2])
    b1 = sympy.Matrix([x, y]) - length / 2 * axis
    apart = a2 - b1
    gaps = [
        sympy.sqrt(apart.dot(apart)),
        -b1[0],
        apart[0] * axis[1] - apart[1] * axis[0],
    ]
    p = r + t
    place = {x: -p, y: length - sympy.sqrt(4 * r**2 - p**2), turn: 0}
    return sympy.simplify(sympy.Matrix(gaps).jacobian([x, y, turn]).subs(place).det())


def is_quadrant(corner: str = "Delta") -> Finding:
    """Determine the local type of ``D`` at a corner, at several headings in the drum."""
    pair = EXPERIMENT
    if corner == "Delta":
        found = [
            stratum_at(pair.polyhedron, chart.on_corner(pair, np.radians(h))) for h in HEADINGS
        ]
    else:
        found = [stratum_at(PLANE.polyhedron, _four_contacts(PLANE))]
    types = {stratum.local_type.name for stratum in found}
    ranks = sorted({(len(s.active), s.rank) for s in found})
    proved = proof(pair, "delta_R").conditions["independent gradients"].value
    determinant = corner_determinant()
    listed = " and ".join(f"{n} contacts of rank {k}" for n, k in ranks)
    return Finding(
        Verdict.HOLDS if types == {"QUADRANT"} else Verdict.REFUTED,
        f"There are {listed} at every point examined ({len(found)}, differing in heading): "
        f"{', '.join(sorted(types)).lower()}. At $\\delta_R$ independent gradients are {proved}; "
        f"in the plane the three gaps of $\\Delta$ have, for all sizes, the Jacobian determinant "
        f"${sympy.latex(sympy.factor(determinant))}$, positive for $t < r$.",
        {"points": float(len(found))},
    )


def _four_contacts(pair: DumbbellPair) -> np.ndarray:
    """Return the pair of the plane with four contacts: parallel, each ball beside a ball."""
    p = pair.ball_radius + pair.rod_radius
    along = np.sqrt(4 * pair.ball_radius**2 - p**2)
    return np.array([p / 2, -along / 2, 0, -p / 2, along / 2, 0])


CLAIMS = (
    Claim(
        "L1",
        "C",
        "lemma on minimisation in the corner of a quadrant, first conclusion",
        "Let $x_i \\ge 0$ on $C \\ni 0$ for $i \\le p$; let $f$ be smooth, its derivatives at 0 by "
        "the first $p$ coordinates positive, by the next $q$ zero with a positive definite "
        "Hessian, and let it not depend on the last $r$. Then 0 is a local minimum of $f$ on $C$.",
        Means.SYMBOLIC,
        minimum_lemma,
        partial(minimum_lemma, dropped="(4)"),
    ),
    Claim(
        "L2a",
        "C",
        "lemma on minimisation in the corner of a quadrant, last sentence",
        "The minimum is attained along $C \\cap Z$, where $Z$ is given by "
        "$x_{p+q+1} = \\dots = x_n = 0$.",
        Means.SYMBOLIC,
        locus_of_minima,
        partial(locus_of_minima, vanishing="first"),
    ),
    Claim(
        "L2b",
        "C",
        "after the lemma",
        "At the points of the locus the force $-\\mathrm{grad}\\,f$ does not vanish, unlike at a "
        "minimum on a manifold.",
        Means.SYMBOLIC,
        force_on_the_locus,
        partial(force_on_the_locus, ((0, 2, 1), (0, 1, 0))),
    ),
    *entrapment.CLAIMS,
    *chart.CLAIMS,
    Claim(
        "L6",
        "C",
        "before the lemma; last paragraph",
        "Around the corner $\\Delta$, $D$ is locally a quadrant: three inequalities $x_i \\ge 0$ "
        "in local coordinates.",
        Means.PROOF,
        is_quadrant,
        partial(is_quadrant, corner="E"),
    ),
    *rod_weight.CLAIMS,
)
