"""Appendix B: strata of curvilinear polyhedra, their boundaries, and the region of its figure."""

from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from paper_checks.appendixB.near import PLANE, Spot, examples, plane_sets, region_atlas, spots
from paper_checks.framework.claims import Claim, Finding, Means, Verdict
from polycorner import AllOf, Polyhedron, Stratum, skeleton, stratum_at
from polycorner.models import Tutorial
from polycorner.polyhedra import LocalType

# ------------------------------------------------------------------------------------- the strata


def by_rank(stratum: Stratum, n: int) -> int:
    """Return ``n`` minus the rank of the active gradients."""
    return n - stratum.rank


def by_count(stratum: Stratum, n: int) -> int:
    """Return ``n`` minus the number of active functions."""
    return n - len(stratum.active)


def strata_are_submanifolds(dimension: Callable[[Stratum, int], int] = by_rank) -> Finding:
    """Check that near each of its points a stratum is the zero set of all active functions."""
    wrong = []
    for spot in spots():
        own = dimension(spot.stratum, spot.example.polyhedron.dimension)
        if [vanish for d, vanish in spot.cells if d == own] != [True]:
            wrong.append(f"{spot.example.name}, {len(spot.stratum.active)} contacts")
    cells = sum(len(spot.cells) for spot in spots())
    told = (
        f"At {len(spots())} points of {len(examples())} polyhedra, with {cells} cells around them, "
        "the stratum of the point is near it the set on which all its active functions vanish, of "
        "dimension $n$ minus the rank of their gradients, and nothing else; cells of one point lie "
        "in one stratum each."
    )
    if wrong:
        told = f"It fails at {len(wrong)} of {len(spots())} points, such as {wrong[0]}."
    return Finding(
        Verdict.REFUTED if wrong else Verdict.HOLDS,
        told,
        {"points": len(spots()), "cells": cells, "failures": len(wrong)},
    )


def boundaries_go(down: bool = True) -> Finding:
    """Check that points near a point lie in strata of at least its own dimension."""
    wrong = [s for s in spots() if not _goes(s, down)]
    return Finding(
        Verdict.REFUTED if wrong else Verdict.HOLDS,
        f"{len(spots()) - len(wrong)} of {len(spots())} points are limits of points of "
        f"{'higher' if down else 'lower'} strata and of their own alone. So a limit of points of "
        "$D_r$ that is not in $D_r$ lies lower, and the lowest stratum is closed.",
        {"points": len(spots()), "failures": len(wrong)},
    )


def _goes(spot: Spot, down: bool) -> bool:
    own = spot.stratum.dimension
    return all(d >= own if down else d <= own for d in spot.nearby)


def connected(_: Iterable[Spot], __: int) -> bool:
    """Accept every dimension: all examples are connected, as the paper's hypothesis requires."""
    return True


def convex_and_within(around: Iterable[Spot], r: int) -> bool:
    """Require local convexity, and a stratum of this dimension or a higher one."""
    around = tuple(around)
    highest = max(max(spot.nearby) for spot in around)
    return all(spot.is_locally_convex for spot in around) and r <= highest


Hypothesis = Callable[[Iterable[Spot], int], bool]


def boundary_is_all_lower_strata(hypothesis: Hypothesis = connected) -> Finding:
    """Look for points of lower strata that are not limits of points of ``D_r``."""
    tried, failures = _missed(hypothesis)
    right_tried, right_failures = _missed(convex_and_within)
    numbers = {"tried": tried, "failures": len(failures), "tried_under_condition": right_tried}
    if not failures:
        return Finding(
            Verdict.HOLDS, f"It holds for all {tried} pairs of a polyhedron and $r$.", numbers
        )
    listed = "; ".join(f"{name}, $r = {r}$" for name, r in failures)
    return Finding(
        Verdict.REFUTED if right_failures else Verdict.CORRECTED,
        f"Of {tried} pairs of a connected polyhedron and $r$, {len(failures)} fail: {listed}. "
        f"The {right_tried} pairs that are locally convex with $r$ at most the dimension hold.",
        numbers,
        correction=(
            r"For connected $D$ that is locally convex, $\partial D_r = D_0 \cup \ldots \cup "
            r"D_{r-1}$ for all $r \le \dim D$. Without local convexity, and for $r > \dim D$, only "
            r"$\subset$ is true."
        ),
    )


def _missed(hypothesis: Hypothesis) -> tuple[int, list[tuple[str, int]]]:
    """Return how many pairs of an example and ``r`` satisfy the hypothesis, and those that fail."""
    tried, failures = 0, []
    for example in (example for example in examples() if example.connected):
        around = [spot for spot in spots() if spot.example is example]
        for r in range(1, example.polyhedron.dimension + 1):
            if hypothesis(around, r):
                tried += 1
                lower = [spot for spot in around if spot.stratum.dimension < r]
                if not all(r in spot.nearby for spot in lower):
                    failures.append((example.name, r))
    return tried, failures


# ---------------------------------------------------------------------------------------- charts

Map = Callable[[Any, Any], tuple[Any, Any]]


def bend(x: Any, y: Any) -> tuple[Any, Any]:
    """Map the plane to itself by a diffeomorphism that bends straight lines."""
    across = x + y**2
    return across, y + across**2 / 3


def unbend(x: Any, y: Any) -> tuple[Any, Any]:
    """Invert :func:`bend`."""
    up = y - x**2 / 3
    return x - up**2, up


def cube(x: Any, y: Any) -> tuple[Any, Any]:
    """Map the plane to itself by a homeomorphism whose inverse has no derivative on an axis."""
    return x**3, y


def root(x: Any, y: Any) -> tuple[Any, Any]:
    """Invert :func:`cube`."""
    return np.cbrt(x), y


def strata_survive(chart: Map = bend, inverse: Map = unbend) -> Finding:
    """Compare the strata of sets with those of the same sets in other coordinates."""
    before = plane_sets(*PLANE.symbols)
    lost, compared = [], 0
    for name, (tree, points) in plane_sets(*chart(*PLANE.symbols)).items():
        plain, changed = Polyhedron(PLANE, before[name][0]), Polyhedron(PLANE, tree)
        for point in points:
            old = stratum_at(plain, point).dimension
            new = stratum_at(changed, inverse(*point)).dimension
            compared += 1
            if old != new:
                lost.append(f"in {name} the point {point} goes from $D_{old}$ to $D_{new}$")
    told = (
        f"All {compared} points keep the dimension of their stratum under a change of coordinates "
        "by a polynomial diffeomorphism that bends every side."
    )
    if lost:
        told = f"{len(lost)} of {compared} points change: {lost[0]}."
    return Finding(
        Verdict.REFUTED if lost else Verdict.HOLDS,
        told,
        {"compared": compared, "changed": len(lost)},
    )


# ------------------------------------------------------------------------------------- the figure


def region_has(claimed: tuple[int, int, int] = (7, 7, 1)) -> Finding:
    """Count corners, sides and faces by tracing the boundary of the region of the figure."""
    atlas = region_atlas()
    found = (len(atlas.corners), len(atlas.edges), len(atlas.faces))
    corners, sides, faces = found
    return Finding(
        Verdict.HOLDS if found == claimed else Verdict.CORRECTED,
        f"Walking along a region with three sides that bulge inwards, drawn after the figure, "
        f"finds {corners} corners, {sides} sides and {faces} open region; its Euler characteristic "
        f"is {atlas.euler_characteristic}, and the smallest stratum has dimension "
        f"{min(corner.stratum.dimension for corner in atlas.corners)}.",
        {"corners": corners, "sides": sides, "faces": faces},
        correction="" if found == claimed else f"{corners} corners, {sides} sides, {faces} region.",
    )


def region_is_convex_in_charts_only(bends: float = 1.0) -> Finding:
    """Examine the corners of the region, and ever shorter chords of its sides.

    The curvatures of the sides are multiplied by ``bends``; 0 makes all of them straight.
    """
    region = Tutorial()
    walls = [replace(wall, bend=bends * wall.bend) for wall in region.walls]
    D = Polyhedron(region.manifold, AllOf(*[wall.function(region.manifold) for wall in walls]))
    corners = skeleton(D, [[0.0, 0.0]]).corners
    quadrants = sum(corner.local_type is LocalType.QUADRANT for corner in corners)
    lengths = 10.0 ** -np.arange(1, 5)
    dented = []
    for wall in walls:
        ends = wall.at(np.stack([-lengths, lengths], axis=-1) / 2)
        if D.contains(ends, tolerance=1e-12).all() and (D.implicit(ends.mean(axis=1)) < 0).all():
            dented.append(wall.name)
    told = (
        f"At {quadrants} of {len(corners)} corners two functions vanish with independent "
        "gradients, which makes a chart in which the region is a quadrant. "
    )
    if dented:
        told += (
            f"Chords of {', '.join(dented)} leave the region however short they are "
            f"(tried down to {lengths[-1]:.0e}), so that near these sides it is not convex."
        )
    else:
        told += "No chord leaves it: it is convex in the plane itself."
    held = quadrants == len(corners) and bool(dented)
    return Finding(
        Verdict.HOLDS if held else Verdict.REFUTED,
        told,
        {"corners": len(corners), "quadrants": quadrants, "dented_sides": len(dented)},
    )


CLAIMS = (
    Claim(
        "P1a",
        "B",
        "on the decomposition into strata",
        r"Each stratum $D_r$ of a polyhedron that is not empty is a locally closed submanifold of "
        r"dimension $r$, and the strata are disjoint.",
        Means.NUMERICAL,
        strata_are_submanifolds,
        partial(strata_are_submanifolds, by_count),
    ),
    Claim(
        "P1b",
        "B",
        "on the decomposition into strata",
        "The strata do not depend on the charts that are used to define them.",
        Means.NUMERICAL,
        strata_survive,
        partial(strata_survive, cube, root),
    ),
    Claim(
        "P2a",
        "B",
        "on the boundary of a stratum",
        r"The boundary of $D_r$, the limits of its points that are not its points, lies in the "
        r"lower strata $D_0 \cup \ldots \cup D_{r-1}$; the lowest stratum is closed.",
        Means.NUMERICAL,
        boundaries_go,
        partial(boundaries_go, down=False),
    ),
    Claim(
        "P2b",
        "B",
        "on the boundary of a stratum",
        r"In a connected polyhedron the boundary of $D_r$ is all of "
        r"$D_0 \cup \ldots \cup D_{r-1}$.",
        Means.NUMERICAL,
        boundary_is_all_lower_strata,
        partial(boundary_is_all_lower_strata, convex_and_within),
    ),
    Claim(
        "P3a",
        "B",
        "caption of the figure of a polyhedron in the plane",
        "The region of the figure has seven corners and seven sides around one open set; its "
        "corners are its smallest stratum.",
        Means.NUMERICAL,
        region_has,
        partial(region_has, (6, 7, 1)),
        figure="tutorial",
    ),
    Claim(
        "P3b",
        "B",
        "caption of the figure of a polyhedron in the plane",
        "It is locally convex as a curvilinear polyhedron, and neither convex nor locally convex "
        "as a subset of the plane.",
        Means.NUMERICAL,
        region_is_convex_in_charts_only,
        partial(region_is_convex_in_charts_only, bends=0.0),
        figure="tutorial",
    ),
)
