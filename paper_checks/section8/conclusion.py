"""Section 8: entrapment and bifurcation at corners, limits on velocities, and cusps."""

from collections.abc import Callable
from functools import cache, partial
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from paper_checks.framework.claims import Claim, Finding, Means, Verdict
from polycorner import (
    AllOf,
    Manifold,
    Polyhedron,
    SmoothFunction,
    System,
    Trajectory,
    certify,
    simulate,
    skeleton,
    stratum_at,
    velocities,
)
from polycorner.models import Pinball
from polycorner.motion import SpeedZones, motions
from polycorner.polyhedra import LocalType

if TYPE_CHECKING:
    from polycorner.toolkit import Array

BOARD = Pinball()
ASIDE = 1e-3  # distance from a corner at which balls are released
STEP, STEPS = 5e-3, 40
FOOTING, GRAZING = 1e-9, 2e-5  # height above a wall in sliding; depth of a chord of a pin
APART = 0.1  # final distance of two balls from which on their paths count as separate

CONVEX, CONCAVE = LocalType.QUADRANT, LocalType.UNION


# ------------------------------------------------------------------------------- the pinball board


@cache
def corners(kind: LocalType) -> "tuple[Array, ...]":
    """Return the corners of the board where it is locally a quadrant, or a union of them."""
    D = BOARD.polyhedron
    return tuple(p for p in BOARD.corners() if stratum_at(D, p).local_type is kind)


def corners_hold(kind: LocalType = CONVEX) -> Finding:
    """Count the corners of a kind at which the height has a certified local minimum."""
    found = [certify(BOARD.polyhedron, BOARD.energy, p) for p in corners(kind)]
    held = [certificate for certificate in found if certificate.is_minimum]
    words = "convex" if kind is CONVEX else "concave"
    return Finding(
        Verdict.HOLDS if held else Verdict.REFUTED,
        f"On a board with pins, wedges and cups the height has a certified minimum at {len(held)} "
        f"of {len(found)} locally {words} corners; at the others it decreases along a side.",
        {"corners": len(found), "minima": len(held)},
    )


def ways_part(kind: LocalType = CONCAVE) -> Finding:
    """Release balls close to a corner, on all its sides, and check whether they stay together."""
    parting = [p for p in corners(kind) if _part(p)]
    free, round_tops = pins_that_part()
    total = len(corners(kind))
    words = "convex" if kind is CONVEX else "concave"
    return Finding(
        Verdict.HOLDS_UNDER if parting else Verdict.REFUTED,
        f"Balls released {ASIDE:g} from a corner move more than "
        f"{APART:g} apart at {len(parting)} of {total} locally {words} corners. They also do at "
        f"the tops of {round_tops} of {free} round pins, which have no corner.",
        {"corners": total, "parting": len(parting), "pins": free, "parting_pins": round_tops},
        correction=(
            "A locally concave corner is a bifurcation if the energy decreases away from it along "
            "both sides; at one that hangs down the paths stay together. It is not needed for a "
            "bifurcation: the smooth top of a pin is one, too."
        )
        if parting
        else "",
    )


@cache
def pins_that_part() -> tuple[int, int]:
    """Return the number of pins without a corner near the top, and of those where balls part."""
    tops = [np.array([x, y + r]) for x, y, r in BOARD.pins]
    free = [p for p in tops if not corners_near(p)]
    return len(free), sum(map(_part, free))


def corners_near(point: "Array", distance: float = 0.05) -> bool:
    """Whether a corner of the board is close to a point."""
    return bool((np.linalg.norm(BOARD.corners() - point, axis=1) < distance).any())


def _part(place: "Array") -> bool:
    """Whether balls released around a point of the boundary end up apart."""
    ends = [_run(start) for start in _around(place)]
    return max(float(np.linalg.norm(p - q)) for p in ends for q in ends) > APART


def _around(place: "Array") -> "list[Array]":
    """Return the points of a small circle between which it lies in the board, and one midway."""
    angles = np.linspace(-np.pi, np.pi, 3600, endpoint=False)
    circle = place + ASIDE * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    inside = np.asarray(BOARD.polyhedron.contains(circle))
    first = int(np.flatnonzero(inside & ~np.roll(inside, 1))[0])
    arc = np.roll(circle, -first, axis=0)[: int(inside.sum())]
    return [arc[0], arc[len(arc) // 2], arc[-1]]


def _run(start: "Array") -> "Array":
    """Follow steepest descent of the height, falling freely or sliding along walls."""
    p = start
    for _ in range(STEPS):
        reached = _reached(p)
        lowest = reached[np.argmin(reached[:, 1])]
        if lowest[1] > p[1] - 1e-6 * STEP:
            break
        p = lowest
    return p


def _reached(p: "Array") -> "Array":
    """Return the possible next points: straight down, along walls that are close, or none."""
    D = BOARD.polyhedron
    values, gradients = D.evaluate(p, 1)
    sizes = np.linalg.norm(gradients, axis=1)
    close = abs(values) < 2 * STEP * sizes
    along = (gradients / sizes[:, None])[close] @ np.array([[0.0, -1.0], [1.0, 0.0]])
    ahead = p + STEP * np.vstack([[(0.0, -1.0)], along, -along])
    values, gradients = (part[:, close] for part in D.evaluate(ahead, 1))
    squares = (gradients**2).sum(axis=-1)
    feet = ahead[:, None] - ((values - FOOTING) / squares)[..., None] * gradients
    reached = np.vstack([ahead, feet.reshape(-1, 2)])
    between = p + np.array([0.5, 1.0])[:, None, None] * (reached - p)
    allowed = np.asarray(D.contains(between, tolerance=GRAZING)).all(axis=0)
    return np.vstack([p[None], reached[allowed]])


# ---------------------------------------------------------------------------- limits on velocities

LINE = Manifold.euclidean("x")  # along a road, in m; speeds are in m/s
TOWN, FAST, SLOW = (100.0, 200.0), 30.0, 14.0
BRAKES = 5.0  # m/s^2, also of full throttle
ROAD = SpeedZones(FAST, {"town": (*TOWN, SLOW)}, LINE)
SEEDS = [[0.5, 0.25], [0.5, 10.0], [150.0, 10.0]]


def cusped() -> Polyhedron:
    """Return states under a constraint whose derivative vanishes where its sides meet."""
    phases = motions(LINE)
    x, v = phases.symbols
    return Polyhedron(phases, AllOf(x**3 - v**2, 1 - x))


def limits_carve_a_polyhedron(allowed: Callable[[], Polyhedron] = lambda: ROAD.allowed) -> Finding:
    """Trace the sets that limits define in phase space, and drive along their boundary."""
    every = [allowed(), ROAD.viable(BRAKES)]
    (quadrants, unions, degenerate), (convex, concave, others) = map(_corners, every)
    path, jump = drive(BRAKES), drive(None)
    states = np.concatenate([path.q[:, 0], path.v[:, 0]], axis=1)
    inside = bool(np.all(every[1].contains(states, tolerance=1e-9)))
    slowed, fallen = (-float(np.diff(run.v[:, 0, 0]).min()) for run in (path, jump))
    hardest, holds = slowed / path.dt, inside and not degenerate and not others
    return Finding(
        Verdict.HOLDS_UNDER if holds else Verdict.REFUTED,
        f"A limit of {FAST:g} m/s that is {SLOW:g} m/s between {TOWN[0]:g} and {TOWN[1]:g} m cuts "
        f"out of the plane of $x$ and $v$ a set with {quadrants} locally convex and {unions} "
        f"locally concave corners, and {degenerate} where the derivatives are dependent. At full "
        f"throttle a drive meets the town at {SLOW + fallen:.4g} m/s, and loses {fallen:.4g} m/s "
        f"at once. With brakes of {BRAKES:g} m/s² the states from which no jump is needed lie "
        f"below $v^2 = {SLOW:g}^2 + 2 \\cdot {BRAKES:g}\\,({TOWN[0]:g} - x)$, which begins "
        f"{braking():.4g} m before the town: a set with {convex} locally convex and {concave} "
        f"locally concave corners. Under these limits the drive "
        f"{'stays' if inside else 'does not stay'} inside at every recorded instant, and is "
        f"slowed down by {hardest:.4g} m/s² at most.",
        {
            "convex": quadrants,
            "concave": unions,
            "degenerate": degenerate,
            "braking": braking(),
            "jump": fallen,
            "viable_convex": convex,
            "viable_concave": concave,
            "inside": inside,
            "deceleration": hardest,
        },
        correction=(
            "The derivatives of the active functions have to be independent, as they are for "
            r"limits $u(x) - v \ge 0$, where $\partial f/\partial v = -1$. An ideal limit exerts a "
            r"force along $\partial f/\partial v$, as a wall does along $\partial f/\partial q$, "
            "and as at a wall velocities jump where a limit falls. What bounded forces can keep "
            r"is a smaller polyhedron of phase space, bounded by braking parabolas."
        ),
    )


def _corners(D: Polyhedron) -> tuple[int, int, int]:
    """Return how many corners of a set are locally convex, concave, and degenerate."""
    atlas = skeleton(D, SEEDS, extent=1e4)
    types = [corner.local_type for corner in atlas.corners]
    singular = [p for f in D.functions for p in _singular(f) if D.contains(p, tolerance=1e-9)]
    return (
        types.count(CONVEX),
        types.count(CONCAVE),
        types.count(LocalType.DEGENERATE) + len(singular),
    )


def _singular(f: SmoothFunction) -> "list[Array]":
    """Return the real points where a function vanishes together with its derivative."""
    import sympy

    symbols = motions(LINE).symbols
    system = [f.expression, *(f.expression.diff(s) for s in symbols)]
    solutions = sympy.solve([g for g in system if g != 0], symbols, dict=True)
    return [np.array([float(point[s]) for s in symbols]) for point in solutions]


def braking() -> float:
    """Return the braking distance from ``FAST`` to ``SLOW`` at constant deceleration."""
    return (FAST**2 - SLOW**2) / (2 * BRAKES)


def drive(braking: float | None) -> Trajectory:
    """Drive at full throttle under the limits, those of viable states if ``braking`` is given."""
    (x,), (v,) = LINE.symbols, velocities(LINE)
    road = Polyhedron(LINE, {"begin": x + 1})
    throttle = {"x": 0 * x + BRAKES}
    car = System(road, v**2 / 2, forces=throttle, limits=ROAD.limits(braking))
    return simulate(car, car.state([0.0], [20.0]), 15.0, 1e-2, every=1)


# -------------------------------------------------------------------------------------------- cusps


def algebraic_set_has_a_cusp(power: int = 3) -> Finding:
    """Compare the width of ``y^2 <= x^power`` with the distance from its tip."""
    import sympy

    x = sympy.Symbol("x", positive=True)
    width = 2 * sympy.sqrt(x**power)
    opening = sympy.limit(width / x, x, 0, "+")
    area = sympy.integrate(width, (x, 0, 1))
    plane = Manifold.euclidean("x y")
    a, b = plane.symbols
    D = Polyhedron(plane, AllOf(a**power - b**2, a))
    kind = stratum_at(D, [0.0, 0.0]).local_type
    cusp = opening == 0 and area > 0
    return Finding(
        Verdict.HOLDS if cusp else Verdict.REFUTED,
        f"The set $0 \\le x$, $y^2 \\le x^{power}$ has the width ${sympy.latex(width)}$ at the "
        f"distance $x$ from its tip, and their quotient goes to {opening}. A polyhedron with "
        "interior points arbitrarily near to a point contains a cone there, in any coordinates, "
        f"where the quotient has a positive limit. Of the tip the library says: {kind.value}.",
        {"opening": float(opening), "area": float(area)},
    )


Tool = Literal["lemma", "multipliers"]


def stops_at_the_cusp(tool: Tool = "lemma") -> Finding:
    """Apply a tool of appendix C to the energy ``x + b y`` at the tip of ``y^2 <= x^3``."""
    works, told = lemma_at_the_cusp() if tool == "lemma" else multipliers_at_the_cusp()
    other_works, other = multipliers_at_the_cusp() if tool == "lemma" else lemma_at_the_cusp()
    return Finding(
        Verdict.HOLDS if not works else Verdict.REFUTED if other_works else Verdict.CORRECTED,
        f"{told} {other}",
        correction=(
            r"The lemma asks only that $x_1, \ldots, x_p \ge 0$ on $C$, not that $C$ is a "
            r"quadrant; with $p = 1$ and $x_1 = E - E_0 - x_2^2 - \ldots - x_n^2$ it covers every "
            "point from which $E$ grows at least as fast as the distance. What needs a quadrant, "
            "or at least a polyhedron, is to read off the conditions from multipliers."
        )
        if works
        else "",
    )


def lemma_at_the_cusp() -> tuple[bool, str]:
    """Whether the lemma's hypotheses hold in the coordinates ``E - y^2`` and ``y``."""
    import sympy

    x, b = sympy.symbols("x b", positive=True)
    u, w = sympy.symbols("u w", real=True)
    # Points of the set are (x, s x^(3/2)) with |s| <= 1; b y is least at s = -1, -y^2 at |s| = 1.
    least = (x + b * y_on_set(x, -1)) - y_on_set(x, -1) ** 2
    slope = sympy.limit(least / x, x, 0, "+")
    f = u + w**2
    at = {u: 0, w: 0}
    first, flat, second = (g.subs(at) for g in (f.diff(u), f.diff(w), f.diff(w, 2)))
    works = bool(slope > 0 and first > 0 and flat == 0 and second > 0)
    return works, (
        f"With $x_1 = E - y^2$ and $x_2 = y$ the energy $E = x + by$ is ${sympy.latex(f)}$ for "
        f"$u = x_1$, $w = x_2$, with derivatives {first}, {flat} and second derivative {second}; "
        f"on the set $x_1 \\ge {sympy.latex(sympy.simplify(least))}$, which over $x$ goes to "
        f"{slope}: it is not negative near the tip."
    )


def y_on_set(x: Any, share: float) -> Any:
    """Return ``y`` at a share of the half-width of the cusp."""
    import sympy

    return share * sympy.sqrt(x**3)


def multipliers_at_the_cusp() -> tuple[bool, str]:
    """Whether ``dE`` is a combination of the derivatives of the functions that bound the set."""
    plane = Manifold.euclidean("x y")
    x, y = plane.symbols
    D = Polyhedron(plane, {"cusp": x**3 - y**2})
    E = x + y / 2
    rows = D.gradients([0.0, 0.0]).T
    slope = np.array([float(E.diff(s)) for s in (x, y)])
    rest = float(np.linalg.norm(slope - rows @ np.linalg.lstsq(rows, slope, rcond=None)[0]))
    certificate = certify(D, E, [0.0, 0.0])
    return rest < 1e-9 and certificate.is_minimum, (
        f"The derivative of $x^3 - y^2$ at the tip is {rows.ravel().tolist()}, so that no "
        f"multiplier balances $dE$: {rest:.4g} of it remains."
    )


CLAIMS = (
    Claim(
        "C1a",
        "8",
        "on locally convex corners",
        "Locally convex corners of a pinball machine can entrap.",
        Means.NUMERICAL,
        corners_hold,
        partial(corners_hold, CONCAVE),
    ),
    Claim(
        "C1b",
        "8",
        "on locally concave corners",
        "Locally concave corners, as in a pinball machine, result in bifurcations.",
        Means.NUMERICAL,
        ways_part,
        partial(ways_part, CONVEX),
    ),
    Claim(
        "C2",
        "8",
        "on constraints that involve velocities",
        r"Constraints $f(q, \dot q) \ge 0$, such as a speed limit that depends on position, carve "
        "polyhedra out of phase space.",
        Means.NUMERICAL,
        limits_carve_a_polyhedron,
        partial(limits_carve_a_polyhedron, cusped),
    ),
    Claim(
        "C3a",
        "8",
        "on sets defined by algebraic functions",
        "Among semi-algebraic sets there are cusps, which no polyhedron has.",
        Means.SYMBOLIC,
        algebraic_set_has_a_cusp,
        partial(algebraic_set_has_a_cusp, power=2),
    ),
    Claim(
        "C3b",
        "8",
        "on entrapment in more general corners",
        "For corners that are no quadrants the minimisation lemma of appendix C has to be "
        "generalised first.",
        Means.SYMBOLIC,
        stops_at_the_cusp,
        partial(stops_at_the_cusp, "multipliers"),
    ),
)
