"""Section 7: dyads as a set of placements, and the effect of a tilt without motion."""

import math
from collections import Counter
from dataclasses import dataclass
from functools import cache, partial

import numpy as np
import sympy

from paper_checks.framework.claims import Claim, Finding, Means, Verdict
from paper_checks.section6.experiment import EXPERIMENT, PLANE, exact
from paper_checks.section7 import tilt
from polycorner.dumbbells import DumbbellPair, PairAtlas, pair_atlas

Array = np.ndarray
MEAN_HEADING = 40.0
EQUAL = 1e-9  # radians within which headings count as equal
SAMPLES = 400_000


# ------------------------------------------------------------------------------------ T1: the set T


@cache
def on_both_rods() -> tuple["Touching", ...]:
    """Return the results from the atlases, in the plane and in the drum at a mean heading."""
    drum = pair_atlas(EXPERIMENT, heading=math.radians(MEAN_HEADING))
    return touching(pair_atlas(PLANE)), touching(drum)


def rests_on_both_rods(active: tuple[str, ...]) -> bool:
    """Whether a ball of either dumbbell touches the other's rod."""
    return {"A", "a"} <= {name[0] for name in active if len(name) == 3}


@dataclass(frozen=True)
class Touching:
    """The pairs of one atlas in which a ball of either touches the other's rod."""

    components: int
    all_components: int
    closed: bool
    corners_covered: bool
    turned: float
    skewed: float


def touching(atlas: PairAtlas) -> Touching:
    """Collect the edges with both ball-rod contacts and measure the angles between their axes."""
    skeleton, pair = atlas.skeleton, atlas.pair
    groups = atlas.unordered["edges"]
    chosen = [k for k, edge in enumerate(skeleton.edges) if rests_on_both_rods(edge.active)]
    ends = {end for k in chosen for end in skeleton.edges[k].ends}
    points = np.concatenate([skeleton.edges[k].polyline for k in chosen])
    theta = pair.heading(points)
    turned = abs(np.sin(theta[:, 0] - theta[:, 1])).max()
    ball = pair.ball_centres(points)
    first, second = ((ball[:, k + 1] - ball[:, k]) / pair.length for k in (0, 2))
    skewed = np.linalg.norm(np.cross(first, second), axis=1).max()
    return Touching(
        components=sum(any(k in group for k in chosen) for group in groups),
        all_components=len(groups),
        closed=None not in ends,
        corners_covered=ends == set(range(len(skeleton.corners))),
        turned=float(turned),
        skewed=float(np.degrees(np.arcsin(skewed))),
    )


def touching_set(components: int = 2, of: int = 5) -> Finding:
    """Compare ``T`` with the strata: its edges, their ends, and whether its pairs are parallel."""
    found = on_both_rods()
    counts = Counter((one.components, one.all_components) for one in found)
    whole = all(one.closed and one.corners_covered for one in found)
    parallel = all(one.turned < EQUAL for one in found)
    holds = set(counts) == {(components, of)} and whole and parallel
    skewed = max(one.skewed for one in found)
    seen = " and ".join(f"{n} of {k}" for n, k in counts)
    return Finding(
        (Verdict.HOLDS_UNDER if skewed > 0.01 else Verdict.HOLDS) if holds else Verdict.REFUTED,
        f"In {len(found)} atlases (plane, and drum at a mean heading of {MEAN_HEADING:g} degrees) "
        f"the pairs with both ball-rod contacts form {seen} components of $D_4$, which end in "
        "corners, and in every corner of $D_3$. Headings agree to "
        f"{max(one.turned for one in found):.0e} rad, but in space the axes make up to "
        f"{skewed:.2f} degrees.",
        {"skewed": skewed, "components": float(found[0].components)},
        "Parallel has to mean equal headings: two chords of the drum with the same heading at "
        "different azimuths are not parallel in space, unless $\\theta = 0$. Components are "
        "counted for indistinguishable dumbbells."
        if holds
        else "",
    )


# --------------------------------------------------------------------------- T2: the neighbourhood


def contains_t(rods: str = "lines") -> Finding:
    """Check in closed form that ``U`` contains ``T``, with rods as lines or as segments.

    On ``T`` the axes are ``p = r + t`` apart and shifted by ``D``, ``s <= D <= l - s`` with
    ``s^2 = 4 r^2 - p^2``.  The farthest centres are ``sqrt((l + D)^2 + p^2)`` apart, most for
    ``D = l - s``; a ball that lies beyond the other's rod is nearest to a ball.
    """
    length, r, t = sympy.symbols("l r t", positive=True)
    p = r + t
    s = sympy.sqrt(4 * r**2 - p**2)
    excess = sympy.simplify((2 * length - s) ** 2 + p**2 - 4 * (length**2 + r**2))
    reaches = sympy.simplify(excess + 4 * length * s) == 0
    sizes = {length: exact(16.0), r: exact(3.0), t: exact(1.5)}
    nearest = {"lines": p, "segments": sympy.sqrt(s**2 + p**2)}[rods]
    beside = sympy.simplify(2 * r - nearest)
    holds = reaches and bool(beside.subs(sizes) > 0)
    return Finding(
        Verdict.HOLDS if holds else Verdict.REFUTED,
        f"On $T$ the square of the largest distance of centres is below its bound by at least "
        f"${sympy.latex(-excess)} > 0$; with rods as {rods} the ball farthest from the other rod "
        f"is nearer than $2r$ by at most ${sympy.latex(sympy.factor(beside))}$.",
        {"room": float(beside.subs(sizes))},
    )


def in_neighbourhood(pair: DumbbellPair, q: Array) -> Array:
    """Whether pairs lie in the open set ``U``, with rods as axial lines."""
    a1, a2, b1, b2 = np.moveaxis(pair.ball_centres(q), -2, 0)

    def to_line(p: Array, start: Array, end: Array) -> Array:
        distance = np.linalg.norm(np.cross(p - start, end - start), axis=-1) / pair.length
        return np.asarray(distance)

    near = [to_line(p, b1, b2) for p in (a1, a2)] + [to_line(p, a1, a2) for p in (b1, b2)]
    far = [np.linalg.norm(a - b, axis=-1) for a in (a1, a2) for b in (b1, b2)]
    reach = 2 * math.hypot(pair.length, pair.ball_radius)
    beside = np.max(near, axis=0) < 2 * pair.ball_radius
    return np.asarray(beside & (np.max(far, axis=0) < reach))


def handedness(pair: DumbbellPair, q: Array) -> tuple[Array, Array]:
    """Return the lead of the farthest pair of centres, and the vector product, in ``l^2``."""
    a1, a2, b1, b2 = np.moveaxis(pair.developed(q), -2, 0)
    outer = np.stack([b1 - a1, b2 - a1, b1 - a2, b2 - a2])
    inner = outer[::-1]
    size = np.linalg.norm(outer, axis=-1)
    first = size.argmax(axis=0)[None, :, None]
    u, v = (np.take_along_axis(e, first, axis=0)[0] for e in (outer, inner))
    turn = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    size.sort(axis=0)
    return size[-1] - size[-2], turn / pair.length**2


def drawn(rng: np.random.Generator) -> Array:
    """Draw pairs in the drum, half of them anywhere near ``U``, half almost side by side.

    The latter are where the chirality becomes weak: nearly ``2 r`` apart across, shifted along by a
    little more than keeps the balls apart, and nearly parallel.
    """
    pair, half = EXPERIMENT, SAMPLES // 2
    r = pair.ball_radius
    across = rng.uniform(-2, 2, SAMPLES) * r
    along = rng.uniform(-2, 2, SAMPLES) * pair.length
    turn = rng.uniform(-1, 1, SAMPLES) * math.asin(min(1.0, 4 * r / pair.length))
    little = 10 ** rng.uniform(-5, 0, (3, half))
    signs = rng.choice([-1.0, 1.0], (3, half))
    across[:half] = signs[0] * 2 * r * (1 - little[0])
    along[:half] = signs[1] * (np.sqrt(4 * r**2 - across[:half] ** 2) + r * little[1])
    turn[:half] = signs[2] * little[2] * turn[:half]
    q = np.zeros((SAMPLES, 6))
    q[:, 2] = rng.uniform(-math.pi / 2, math.pi / 2, SAMPLES)
    q[:, 5] = q[:, 2] + turn
    sine, cosine = np.sin(q[:, 2]), np.cos(q[:, 2])
    q[:, 3] = (along * sine - across * cosine) / pair.centre_radius
    q[:, 4] = along * cosine + across * sine
    return q


@cache
def sampled() -> tuple[int, int, float, float]:
    """Return statistics of random pairs of ``U``.

    Returns
    -------
    tuple
        The numbers of pairs in ``U`` and in both ``U`` and ``D``, and for the latter the least lead
        of the farthest pair of centres and the least vector product.
    """
    pair = EXPERIMENT
    q = drawn(np.random.default_rng(2))
    q = q[in_neighbourhood(pair, q)]
    allowed = q[np.asarray(pair.polyhedron.contains(q))]
    lead, turn = handedness(pair, allowed)
    return len(q), len(allowed), float(lead.min()), float(abs(turn).min())


def every_pair_is_chiral(*, within_d: bool = False) -> Finding:
    pair = EXPERIMENT
    inside, allowed, lead, turn = sampled()
    beside = pair.side_by_side() * np.array([0.5, 1, 1] * 2)  # half as far apart as they can be
    overlapping = bool(in_neighbourhood(pair, beside[None])[0])
    tie = float(handedness(pair, beside[None])[0][0])
    chiral = min(lead, turn) > 0
    literal = Verdict.CORRECTED if overlapping and tie < 1e-12 else Verdict.HOLDS
    return Finding(
        (Verdict.HOLDS if within_d else literal) if chiral else Verdict.REFUTED,
        f"Of {inside} random pairs of $U$ in the drum {allowed} do not overlap; for all of these "
        f"one pair of centres is the farthest (by at least {lead:.3f} mm, almost side by side) and "
        f"the two vectors are not parallel (vector product at least {turn:.3f} $\\ell^2$). Side by "
        f"side and $r$ apart, two dumbbells overlap, are {'' if overlapping else 'not '}in $U$, "
        f"and their two farthest pairs of centres differ by {tie:.0e} mm.",
        {"in_U": float(inside), "in_U_and_D": float(allowed), "lead": lead, "turn": turn},
        ""
        if within_d
        else "Every pair in $U \\cap D$ has a chirality (at the experiment's sizes, from random "
        "pairs). $U$ itself is open in $M \\times M$ and contains overlapping pairs without one.",
    )


CLAIMS = (
    Claim(
        "T1",
        "7",
        "section 7.1, first paragraph",
        "The set $T$ of parallel pairs with a ball of each at the other's rod is closed, and is "
        "the union of $D_3$ and two of the five components of $D_4$.",
        Means.NUMERICAL,
        touching_set,
        partial(touching_set, components=3),
    ),
    Claim(
        "T2a",
        "7",
        "section 7.1, definition of $U$",
        "The open set $U$, with rods as axial lines as in section 5, contains $T$.",
        Means.SYMBOLIC,
        contains_t,
        partial(contains_t, rods="segments"),
    ),
    Claim(
        "T2b",
        "7",
        "section 7.1, after the definition of $U$",
        "Every pair in $U$ has a chirality.",
        Means.NUMERICAL,
        every_pair_is_chiral,
        partial(every_pair_is_chiral, within_d=True),
    ),
    *tilt.CLAIMS,
)
