"""Section 5: dimensions of the strata, the stratum of least dimension, and local convexity."""

from functools import cache, partial
from typing import TYPE_CHECKING

import numpy as np

from paper_checks.framework.claims import Claim, Finding, Means, Verdict
from paper_checks.section2.cylinder import typeset
from paper_checks.section5.pairs import DELTA, DRUM, E_CORNER, Array, atlas, first_contacts, parts
from polycorner import stratum_at
from polycorner.polyhedra import LocalType

if TYPE_CHECKING:
    import sympy

# Mean headings, in radians, of the sections of the drum that are examined.
HEADINGS = (0.0, 0.5)
# Sets of contacts that occur, one of every kind, in the order of growing number; see D3.
KINDS = (("aB1",), ("A2B1",), ("A2b", "aB1"), ("A2B1", "aB1"), ("A1B1", "A2B2"), DELTA, E_CORNER)


@cache
def plane_gradients() -> "dict[tuple[str, ...], sympy.Matrix]":
    """Return the gradients of all kinds of contacts in the plane, by position and heading of B.

    A lies along the second axis, ``A1`` at 0; ``B1`` is at ``(x, y)`` and the axis of B makes the
    angle ``d`` with that of A.  Distances of ball centres are squared and halved.  At the positions
    considered the contacts are closed: ``p = r + t``, ``p^2 + s^2 = 4 r^2``, ``h > 0`` the distance
    of a foot from the end of its rod, ``c > 0`` the cosine of the direction from ball to ball.
    """
    import sympy

    x, y, d = sympy.symbols("x y d", real=True)
    length, r, s, p, h, c = sympy.symbols("l r s p h c", positive=True)
    axis = sympy.Matrix([sympy.sin(d), sympy.cos(d)])
    first = sympy.Matrix([x, y])
    ball = {"A1": sympy.zeros(2, 1), "A2": sympy.Matrix([0, length])}
    ball |= {"B1": first, "B2": first + length * axis}

    def distance(name: str) -> sympy.Expr:
        one, other = parts(name)
        if len(name) == 4:
            apart = ball[one] - ball[other]
            return apart.dot(apart) / 2
        if one == "a":
            return ball[other][0]
        apart = first - ball[one]
        return apart[0] * axis[1] - apart[1] * axis[0]

    side = 2 * r * c
    places = {
        ("aB1",): {},
        ("A2B1",): {x: side, y: length + 2 * r * sympy.sqrt(1 - c**2)},
        ("A2b", "aB1"): {x: p, y: length - h, d: 0},
        ("A2B1", "aB1"): {x: p, y: length - s},
        ("A1B1", "A2B2"): {x: side, y: 2 * r * sympy.sqrt(1 - c**2), d: 0},
        DELTA: {x: p, y: length - s, d: 0},
        E_CORNER: {x: p, y: s, d: 0},
    }
    found = {}
    for names, place in places.items():
        rows = sympy.Matrix([distance(name) for name in names]).jacobian([x, y, d])
        found[names] = rows.subs(place).applyfunc(sympy.simplify)
    return found


def _volumes() -> "dict[tuple[str, ...], sympy.Expr]":
    """Return the Gram determinant of every kind; for E that of three of its contacts."""
    import sympy

    found = {}
    for names, rows in plane_gradients().items():
        kept = rows[:3, :]
        found[names] = sympy.factor(sympy.simplify((kept * kept.T).det()))
    return found


def long_rods(expression: "sympy.Expr") -> "sympy.Expr":
    """Return an expression with ``l = 2 s + g``, ``g > 0``: no ball touches both others."""
    import sympy

    length, s, g = sympy.symbols("l s g", positive=True)
    return sympy.factor(sympy.simplify(expression.subs(length, 2 * s + g)))


@cache
def drum_strata() -> dict[int, set[int]]:
    """Return the dimensions found in the drum by number of contacts: pairs, edges and corners."""
    met: dict[int, set[int]] = {}

    def note(q: Array, expected: int | None = None) -> None:
        stratum = stratum_at(DRUM.polyhedron, q)
        count = len(stratum.active)
        if expected is None or count == expected:
            met.setdefault(min(count, 3), set()).add(stratum.dimension)

    rng = np.random.default_rng(8)
    for q in DRUM.placements(rng, 20):
        note(q)
    for _, q in first_contacts():
        note(q)
    for heading in HEADINGS:
        found = atlas(DRUM, heading).skeleton
        for edge in found.edges:
            for q in edge.polyline[1:-1]:
                note(q, 2)
        for corner in found.corners:
            note(corner.point)
    return met


def dimensions_are(dimensions: tuple[int, int, int, int] = (6, 5, 4, 3)) -> Finding:
    """Compare the dimensions of strata with 0, 1, 2 and at least 3 contacts."""
    volumes = _volumes()
    positive = all(long_rods(volume).is_positive for volume in volumes.values())
    met = drum_strata()
    plane = {0: 6} | {min(len(names), 3): 6 - min(len(names), 3) for names in volumes}
    right = positive and all(
        met[k] == {dimension} and plane[k] == dimension for k, dimension in enumerate(dimensions)
    )
    listed = ", ".join(f"{k}: {sorted(found)}" for k, found in sorted(met.items()))
    pairs = [typeset(volumes[names]) for names in KINDS[2:]]
    return Finding(
        Verdict.HOLDS if right else Verdict.REFUTED,
        "In the plane the Gram determinants of the gradients, by place and heading, are "
        f"{', '.join(pairs)} for the kinds of two and more contacts (of four, for three of them), "
        f"{'all' if positive else 'not all'} positive. Dimensions in the drum by number of "
        f"contacts (3 stands for three and more): {listed}.",
        {f"dimension_{k}_contacts": float(max(found)) for k, found in met.items()},
    )


def lowest_dimension_is(lowest: int = 3) -> Finding:
    """Rigid motions act freely in the plane; in the drum corners never meet a fourth condition."""
    import sympy

    names = sympy.symbols("x1 y1 t1 x2 y2 t2", real=True)
    x1, y1, t1, x2, y2, t2 = names
    length = sympy.symbols("l", positive=True)
    centres = [
        sympy.Matrix([x + k * length / 2 * sympy.sin(t), y + k * length / 2 * sympy.cos(t)])
        for x, y, t in ((x1, y1, t1), (x2, y2, t2))
        for k in (-1, 1)
    ]
    squares = sympy.Matrix([(a - b).dot(a - b) for a in centres[:2] for b in centres[2:]])
    motions = sympy.Matrix([[1, 0, 0, 1, 0, 0], [0, 1, 0, 0, 1, 0], [y1, -x1, 1, y2, -x2, 1]])
    still = (squares.jacobian(names) * motions.T).applyfunc(sympy.simplify).is_zero_matrix
    minor = motions[:, :3].det()
    ranks = {
        stratum_at(DRUM.polyhedron, c.point).rank
        for heading in HEADINGS
        for c in atlas(DRUM, heading).skeleton.corners
    }
    right = still and minor == 1 and 6 - max(ranks) == lowest == motions.rank()
    return Finding(
        Verdict.HOLDS if right else Verdict.REFUTED,
        f"In the plane translations and the rotation leave the distances of the ball centres "
        f"{'unchanged' if still else 'changed'} and are independent everywhere (minor {minor}), so "
        f"that every stratum has dimension {motions.rank()} or more. In the drum the contacts at "
        f"the corners of sections at {len(HEADINGS)} mean headings have rank "
        f"{', '.join(map(str, sorted(ranks)))}: dimension {6 - max(ranks)}.",
        {"rank_at_corners": float(max(ranks))},
    )


def convex_as(allowed: tuple[LocalType, ...] = (LocalType.QUADRANT, LocalType.CONE)) -> Finding:
    """Examine the local type of every stratum, and the linear relation of the gradients at E."""
    import sympy

    (relation,) = plane_gradients()[E_CORNER].T.nullspace()
    weights = [sympy.factor(w) for w in relation]
    general = all(long_rods(w).is_nonzero for w in weights)
    points = [q for _, q in first_contacts()]
    for heading in HEADINGS:
        found = atlas(DRUM, heading).skeleton
        points += [c.point for c in found.corners]
        points += [e.polyline[len(e.polyline) // 2] for e in found.edges]
    types = [stratum_at(DRUM.polyhedron, q).local_type for q in points]
    counts = {kind.name.lower(): types.count(kind) for kind in dict.fromkeys(types)}
    return Finding(
        Verdict.HOLDS if general and set(types) <= set(allowed) else Verdict.REFUTED,
        f"Local types at {len(points)} points of the boundary in the drum: "
        f"{', '.join(f'{kind} {count}' for kind, count in counts.items())}. At $\\mathcal{{E}}$ in "
        f"the plane the gradients of {', '.join(E_CORNER)} satisfy one relation, with coefficients "
        f"{', '.join(map(typeset, weights))}, {'all' if general else 'not all'} different from "
        "zero for long rods: with three gaps as coordinates $x, y, z$ the fourth, which vanishes "
        "with them, is $ax + by + cz$ with smooth $a, b, c$, and $ax, by, cz$ straighten all four.",
        {kind: float(count) for kind, count in counts.items()},
    )


CLAIMS: tuple[Claim, ...] = (
    Claim(
        "D2",
        "5",
        "dimensions of the strata",
        r"Pairs with no, one, two and at least three points of contact form strata of dimension "
        "6, 5, 4 and 3.",
        Means.SYMBOLIC,
        dimensions_are,
        partial(dimensions_are, (6, 5, 4, 2)),
        figure="faces",
    ),
    Claim(
        "D4",
        "5",
        "sharpest corner",
        r"$D_0$, $D_1$ and $D_2$ are empty; $D_3$ is the stratum of least dimension.",
        Means.SYMBOLIC,
        lowest_dimension_is,
        partial(lowest_dimension_is, 2),
    ),
    Claim(
        "D12",
        "5",
        "local convexity",
        "$D$ is locally convex in the curvilinear sense.",
        Means.SYMBOLIC,
        convex_as,
        partial(convex_as, (LocalType.QUADRANT,)),
        figure="solid",
    ),
)
