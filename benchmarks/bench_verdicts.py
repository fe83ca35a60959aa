"""The same points for several tools: who says what of minima, overlaps, saddles and empty sets.

Every tool starts at the point with its default tolerances and exact first derivatives; Ipopt has
second ones too.  *true* and *false* judge claims without a tolerance: proofs, and that a set is
empty.  *right* and *wrong* judge claims within a tolerance: that a search has converged, or that a
point is a minimum or is none.  What a solver calls converged or optimal means such a point, not a
proof; it is right where a minimum is near and no other stationary point is nearer.  *elsewhere*: it
converged to a point away from the one asked about.  Tools that are not installed are left out.
"""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from importlib import metadata
from importlib.util import find_spec
from itertools import combinations
from time import perf_counter
from typing import Any

import numpy as np
import sympy
from side_by_side import print_table, write

from polycorner import Manifold, Polyhedron, Verdict, certify, prove

NEAR = 1e-6  # farther away, an answer is about another point
TOO_LARGE = 1e-9  # by how much radii are increased
COUNTS = ("true", "false", "right", "wrong", "elsewhere", "does not say")


@dataclass(frozen=True)
class Case:
    """A problem with inequalities, the point asked about, and what is there in truth."""

    name: str
    variables: tuple[sympy.Symbol, ...]
    energy: sympy.Expr
    functions: tuple[sympy.Expr, ...]
    start: np.ndarray
    minima: tuple[np.ndarray, ...] = ()  # of those near the start
    others: tuple[np.ndarray, ...] = ()  # stationary points near it that are none
    free: tuple[int, ...] = ()  # coordinates of circles that rattle

    def apart(self, q: np.ndarray, places: tuple[np.ndarray, ...]) -> float:
        """Return the distance of a point to the nearest of some, whatever rattles."""
        kept = [j for j in range(len(q)) if j not in self.free]
        return min((float(abs(q - p)[kept].max()) for p in places), default=np.inf)

    def overlap(self, q: np.ndarray) -> float:
        """Return the largest violation of an inequality, in exact arithmetic."""
        f = sympy.lambdify(self.variables, self.functions, "math")
        return float(max(0, -min(f(*map(Fraction, q.tolist())))))


Answer = tuple[str, str, np.ndarray]  # optimal, none, proved, empty, nothing; words; a point
Tool = Callable[[Case], Answer]


def circles(name: str, rows: list[tuple[float, float]], free: tuple[int, ...] = ()) -> list[Case]:
    """Return equal circles in the unit square at a point, and with radii 1e-9 too large."""
    z = sympy.symbols(f"z:{2 * len(rows)}")
    r = sympy.Symbol("r")
    gaps = [
        (z[2 * i] - z[2 * j]) ** 2 + (z[2 * i + 1] - z[2 * j + 1]) ** 2 - 4 * r**2
        for i, j in combinations(range(len(rows)), 2)
    ]
    walls = [f for s in z for f in (s - r, 1 - r - s)]
    c = np.array(rows)
    apart = min(np.linalg.norm(a - b) for a, b in combinations(c, 2)) / 2
    point = np.append(c.ravel(), min(apart, c.min(), (1 - c).min()))
    large = point.copy()
    large[-1] += TOO_LARGE
    minima, others = ((), (point,)) if "row" in name else ((point,), ())
    told = ((name, point), (f"{name}, 1e-9 too large", large))
    return [
        Case(title, (*z, r), -r, (*walls, *gaps), start, minima, others, free)
        for title, start in told
    ]


def cases() -> list[Case]:
    """Return all points."""
    x, y = v = sympy.symbols("x y")
    zero, half = np.zeros(2), np.full(2, 0.5)
    z = 10**7 * x
    well = z**4 / 4 - z**2 / 2 + y**2
    bottoms = (np.array([-1e-7, 0]), np.array([1e-7, 0]))
    disc = 1 - x**2 - y**2
    s = float((sympy.sqrt(2) - 1) / 2)
    # Seven circles with the distance 2 / (4 + sqrt(3)), one of which rattles.
    d = float(2 / (4 + sympy.sqrt(3)))
    a, up = d / 2, 1 - d / 2
    seven = [
        (3 * a, a),
        (a, a),
        (2 * a, up),
        (3 * a, 3 * a),
        (a, 3 * a),
        (0.796, 0.796),
        (up, 2 * a),
    ]
    corners = [(s, s), (1 - s, s), (s, 1 - s), (1 - s, 1 - s)]
    quarters = [(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)]
    return [
        Case("corner of a box", v, x + 2 * y, (x, y, disc), zero, (zero,)),
        Case("bowl, second order", v, y - x**2 / 2, (y - x**2, disc), zero, (zero,)),
        Case("edge, second order", v, x**2 + y**2, (x + y - 1, 2 - x), half, (half,)),
        *circles("4 circles", quarters),
        *circles("5 circles", [*corners, (0.5, 0.5)]),
        *circles("7 circles", seven, free=(10, 11)),
        *circles("3 circles in a row", [(k / 6, 0.5) for k in (1, 3, 5)])[:1],
        Case("saddle 1e-7 beside minima", v, well, (disc,), zero, bottoms, (zero,)),
        Case("minimum 1e-7 beside a saddle", v, well, (disc,), bottoms[1], bottoms, (zero,)),
        Case("contact without a force", v, x - y**2, (x, y, disc), zero, (), (zero,)),
        Case("set empty by 1e-12", v, x + y, (x, y, -x - y - sympy.Rational(1, 10**12)), zero),
    ]


def derivatives(case: Case) -> tuple[Callable[..., Any], ...]:
    """Return the energy and the functions, each with its gradient, of an array."""
    parts = []
    for formula in (case.energy, sympy.Matrix(case.functions)):
        value = sympy.lambdify([case.variables], formula)
        slope = sympy.lambdify([case.variables], sympy.Matrix([formula]).jacobian(case.variables))
        parts += [value, slope]
    f, df, g, dg = parts
    return (
        lambda q: float(f(q)),
        lambda q: np.array(df(q), dtype=float).ravel(),
        lambda q: np.array(g(q), dtype=float).ravel(),
        lambda q: np.array(dg(q), dtype=float),
    )


def slsqp(case: Case) -> Answer:
    """Ask SciPy's SLSQP."""
    from scipy.optimize import minimize

    f, df, g, dg = derivatives(case)
    held = {"type": "ineq", "fun": g, "jac": dg}
    found = minimize(f, case.start, jac=df, method="SLSQP", constraints=[held])
    empty = found.status == 4  # "Inequality constraints incompatible"
    word = "optimal" if found.success else "empty" if empty else "nothing"
    return word, found.message, found.x


def pounce(case: Case) -> Answer:
    """Ask POUNCE through its facade in the manner of SciPy."""
    import pounce as solver

    f, df, g, dg = derivatives(case)
    held = {"type": "ineq", "fun": g, "jac": dg}
    found = solver.minimize(f, case.start, jac=df, constraints=[held], print_level=0)
    words = str(found.info["status_msg"])
    if "infeasib" in f"{words} {found.message}".lower():
        return "empty", words, np.asarray(found.x)
    return "optimal" if found.success else "nothing", words, np.asarray(found.x)


def ipopt(case: Case) -> Answer:
    """Ask Ipopt, which is in the wheel of CasADi."""
    import casadi

    q = casadi.SX.sym("q", len(case.variables))
    pieces = casadi.vertsplit(q)
    problem = {
        "x": q,
        "f": sympy.lambdify(case.variables, case.energy, "math")(*pieces),
        "g": casadi.vertcat(*sympy.lambdify(case.variables, case.functions, "math")(*pieces)),
    }
    silent = {"ipopt.print_level": 0, "ipopt.sb": "yes", "print_time": False}
    search = casadi.nlpsol("search", "ipopt", problem, silent)
    found = search(x0=case.start, lbg=0.0, ubg=np.inf)
    words = str(search.stats()["return_status"])
    good = {"Solve_Succeeded": "optimal", "Infeasible_Problem_Detected": "empty"}
    acceptable = "optimal" if words == "Solved_To_Acceptable_Level" else "nothing"
    return good.get(words, acceptable), words, found["x"].full().ravel()


def posed(case: Case) -> tuple[Polyhedron, sympy.Expr]:
    """Return a case for this library."""
    manifold = Manifold.euclidean(" ".join(map(str, case.variables)))
    own = dict(zip(case.variables, manifold.symbols, strict=True))
    functions = {f"f{i}": f.subs(own) for i, f in enumerate(case.functions)}
    return Polyhedron(manifold, functions), case.energy.subs(own)


def certified(case: Case) -> Answer:
    """Ask for a certificate, in floating point."""
    found = certify(*posed(case), case.start)
    denied = found.verdict in {Verdict.SADDLE, Verdict.NOT_STATIONARY}
    word = "optimal" if found.is_minimum else "none" if denied else "nothing"
    return word, found.verdict.name, case.start


def proved(case: Case) -> Answer:
    """Ask for a proof."""
    proof = prove(certify(*posed(case), case.start))
    words = proof.statement if proof.proved else "not proved"
    if not proof.proved:
        return "nothing", words, case.start
    names = map(str, case.variables)
    middle = [sum(map(float, proof.enclosures[name])) / 2 for name in names]
    return "proved", words, np.array(middle)


TOOLS: dict[str, tuple[Tool, str]] = {
    "certify": (certified, "polycorner"),
    "prove": (proved, "polycorner"),
    "SLSQP": (slsqp, "scipy"),
    "Ipopt": (ipopt, "casadi"),
    "POUNCE": (pounce, "pounce-solver"),
}
MODULES = {"pounce-solver": "pounce"}


def judged(case: Case, word: str, q: np.ndarray) -> str:
    """Compare what was said with what is there."""
    if word == "nothing":
        return "does not say"
    if word == "empty":
        return "true" if not case.minima + case.others else "false"
    there = case.apart(q, case.minima)
    minimum = there <= NEAR and there < case.apart(q, case.others)
    if word == "proved":
        return "true" if minimum else "false"
    if word == "none":
        return "wrong" if minimum else "right"
    if not minimum and case.apart(q, (case.start,)) > NEAR:
        return "elsewhere"
    return "right" if minimum else "wrong"


def main() -> None:
    rows: list[dict[str, Any]] = []
    totals: dict[str, Counter[str]] = {}
    versions: dict[str, str] = {}
    for name, (tool, package) in TOOLS.items():
        if find_spec(MODULES.get(package, package)) is None:
            print(f"{name} is left out: {package} is not installed")
            continue
        versions[package] = metadata.version(package)
        totals[name] = Counter[str]()
        for case in cases():
            begun = perf_counter()
            word, words, q = tool(case)
            row: dict[str, Any] = {
                "tool": name,
                "case": case.name,
                "says": words,
                "is": judged(case, word, q),
            }
            row |= {"seconds": perf_counter() - begun, "overlap": case.overlap(q)}
            row["moved"] = float(abs(q - case.start).max())
            totals[name][row["is"]] += 1
            rows.append(row)
    shown = [
        [row["case"], row["tool"], row["says"][:46], row["is"], f"{row['overlap']:.0e}"]
        for row in rows
    ]
    print_table("What is said of each point", ["case", "tool", "says", "is", "overlap"], shown)
    counts = [[name, *(str(total[word]) for word in COUNTS)] for name, total in totals.items()]
    print_table("What is true", ["tool", *COUNTS], counts)
    write("verdicts", {"versions": versions, "counts": totals, "answers": rows})


if __name__ == "__main__":
    main()
