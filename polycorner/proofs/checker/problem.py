"""Problem of a file, and its functions with generalised derivatives on boxes."""

from collections.abc import Sequence
from typing import Any

from flint import arb, ctx

from .balls import BITS, NAN, ZERO, different, dot, hull, need, number, places, sides, turn
from .operations import LOGICAL, SLOPES, VALUES, arity, chain, ordered, unite

FORMAT, CORNERS = ["polycorner-stationary-list", 1], ["polycorner-corner-list", 1]
DIAGRAM = ["polycorner-diagram", 1]


class StoredProgram:
    """The functions of a file as one program, and the branches of the set."""

    def __init__(self, data: dict[str, Any], bits: int = BITS) -> None:
        ctx.prec = bits
        self.names: list[str] = data["coordinates"]
        different(self.names, "a coordinate is named")
        need(all(name.isidentifier() for name in self.names), "names of coordinates")
        self.n, self.m, self.k = len(self.names), data["inequalities"], data["equations"]
        fine = all(type(i) is int and i >= 0 for i in (self.m, self.k))
        need(fine and len(data["functions"]) == self.m + self.k + 1, "numbers of functions")
        self.nodes: list[tuple[str, list[Any]]] = []
        self.known: dict[int, arb] = {}
        self.positive, self.truths = set[int](), set[int]()
        for op, *args in data["nodes"]:
            self.add(op, args)
        self.outputs = places(data["outputs"], len(self.nodes), "outputs")
        need(len(self.outputs) == self.m + self.k + 1, "there is one output for each function")
        need(self.truths.isdisjoint(self.outputs), "functions have numbers for values")
        self.needs = [self.needed(output) for output in self.outputs]
        self.branches = {frozenset(places(b, self.m, "branches")) for b in data["branches"]}
        self.periods = [None if p is None else number(p) for p in data["periods"]]
        fine = all(period is None or period > 0 for period in self.periods)
        need(fine and len(self.periods) == self.n, "periods")

    def add(self, op: str, args: list[Any]) -> None:
        place = len(self.nodes)
        need(op not in {"const", "var"} or len(args) == 1, f"{op} of {args}")
        if op == "const":
            self.known[place] = number(args[0])
        else:
            need(op in {"var", *VALUES}, f"the operation {op}")
            places(args, self.n if op == "var" else place, f"{op} of {args}")
            truths = [a in self.truths for a in args] if op != "var" else [False]
            need(truths == arity(op), f"{op} of {args}")
        if op in LOGICAL:
            self.truths.add(place)
        if op == "mul" and args[0] == args[1]:
            op, args = "square", args[:1]
        sums = op in {"add", "mul", "div"} and self.positive.issuperset(args)
        if sums or op in {"square", "abs", "exp"} or (op == "const" and self.known[place] >= 0):
            self.positive.add(place)  # nowhere negative, whatever a ball says
        self.nodes.append((op, args))

    def needed(self, output: int) -> list[int]:
        """Return the nodes on whose derivatives those of an output depend, in order."""
        seen: set[int] = set()
        waiting = [output]
        while waiting:
            op, args = self.nodes[a := waiting.pop()]
            if a not in seen and op != "const":
                seen.add(a)
                waiting += [] if op == "var" else args[1:] if op == "select" else args
        return sorted(seen)

    def inputs(self, node: int) -> list[int]:
        """Return all nodes that a node is computed from, and itself, in order."""
        seen, waiting = set[int](), [node]
        while waiting:
            op, args = self.nodes[a := waiting.pop()]
            if a not in seen:
                seen.add(a)
                waiting += [] if op in {"const", "var"} else args
        return sorted(seen)

    def reads(self, row: int) -> frozenset[int]:
        """Return the coordinates from which a function is computed."""
        nodes = (self.nodes[a] for a in self.inputs(self.outputs[row]))
        return frozenset(args[0] for op, args in nodes if op == "var")

    def values(self, box: Sequence[arb]) -> list[Any]:
        v: list[Any] = []
        for place, (op, args) in enumerate(self.nodes):
            if op in {"const", "var"}:
                v.append(box[args[0]] if op == "var" else self.known[place])
            elif op == "sqrt" and not v[args[0]] > 0:
                root = ZERO.union(v[args[0]].abs_upper().sqrt())
                v.append(root if args[0] in self.positive else NAN)
            else:
                v.append(VALUES[op](*[v[a] for a in args]))
        return v

    def forms(self, v: list[Any], row: int, memo: dict[int, Any], order: int = 1) -> Any:
        """Return generalised gradient and Hessian of a function; None where there may be none."""
        for a in self.needs[row]:
            if a in memo:
                continue
            op, args = self.nodes[a]
            parts = [memo.get(b, ({}, {})) for b in args]
            if op == "var":
                memo[a] = {args[0]: arb(1)}, {}
            elif op in {"select", "min", "max"}:
                first = v[args[0]] if op == "select" else ordered(*[v[b] for b in args])
                (x, y), hulls = parts[-2:], op != "select" and order == 1 and None not in parts
                if first is None:
                    memo[a] = (unite(x[0], y[0]), {}) if hulls else None
                else:
                    memo[a] = x if first == (op != "max") else y
            else:
                slopes = SLOPES[op](*[v[b] for b in args])
                memo[a] = None if None in parts else chain(slopes, parts, order)
        return memo.get(self.outputs[row], ({}, {}))

    def signs(self, v: list[Any]) -> list[int]:
        """Return the signs of inequalities and equations, 0 where they are not decided."""
        rows = (v[output] for output in self.outputs[: self.m + self.k])
        return [1 if x > 0 else -1 if x < 0 else 0 for x in rows]

    def open_sets(self, signs: list[int], zeros: frozenset[int] = frozenset()) -> list[Any]:
        """Return the functions that have to hold in each branch and may vanish; least sets only."""
        if any(signs[self.m :]):
            return []
        below, above = ({i for i in range(self.m) if signs[i] == s} - zeros for s in (-1, 1))
        sets = {branch - above for branch in self.branches if not branch & below}
        return [u for u in sets if not any(smaller < u for smaller in sets)]


class StoredProblem(StoredProgram):
    """The problem of a list: its functions, its set and the domain."""

    def __init__(self, data: dict[str, Any]) -> None:
        super().__init__(data)
        known = data["format"] in (FORMAT, CORNERS, DIAGRAM)
        need(known, f"the format is {data['format']}, not {FORMAT}")
        self.lower, self.upper = sides(data["domain"], ("lower", "upper"), self.n)
        self.anywhere = hull(self.lower, self.upper)
        self.widths = [b - a for a, b in zip(self.lower, self.upper, strict=True)]
        moving = [i for i in range(self.n) if self.widths[i] > 0]
        need(data["fixed"] == [i for i in range(self.n) if i not in moving], "fixed coordinates")
        self.parameters = places(data["parameters"], self.n, "parameters")
        need(set(self.parameters) <= set(moving), "parameters")
        different(self.parameters, "a parameter is stated")
        self.free = [i for i in moving if i not in self.parameters]
        self.minima_only: bool = data["minima_only"]
        need(type(self.minima_only) is bool, "minima_only is true or false")

    def sign(self, v: list[Any], row: int, memo: Any, lo: list[float], hi: list[float]) -> int:
        """Return the sign of a function from its values at two corners, by its slopes.

        It grows from one and decreases from the other, but for slopes of the wrong sign.
        """
        found = self.forms(v, row, memo)
        slopes = [found[0].get(i, ZERO) if found else NAN for i in range(self.n)]
        if not all(x.is_finite() for x in slopes):
            return 0
        up = [x.mid() >= 0 for x in slopes]
        wrong = [max(ZERO, -x.lower() if u else x.upper()) for u, x in zip(up, slopes, strict=True)]
        lost = dot(wrong, [arb(b) - arb(a) for a, b in zip(lo, hi, strict=True)])
        for s, (a, b) in ((1, (lo, hi)), (-1, (hi, lo))):
            corner = [arb(y if u else z) for u, y, z in zip(up, a, b, strict=True)]
            if s * self.values(corner)[self.outputs[row]] > lost:
                return s
        return 0

    def inside(self, point: Sequence[arb], some: Sequence[int], room: float = 0.0) -> bool | None:
        """Whether a point lies between the sides, or no farther beyond than what is rounded."""
        sure = True
        for i in some:
            x, a, b = point[i], self.lower[i], self.upper[i]
            more, period = room * (1 + abs(x)), self.periods[i]
            x += turn(x, a, b, period)
            whole = period is not None and self.widths[i] >= period
            if not whole and (x < a - more or x > b + more):
                return False
            sure &= whole or bool(x >= a - more and x <= b + more)
        return sure or None

    def where(self) -> str:
        """Return the domain in words; numbers as they are."""
        ends = list(zip(self.names, self.lower, self.upper, strict=True))
        box = [f"{name} from {a} to {b}" for i, (name, a, b) in enumerate(ends) if i in self.free]
        said = [f"in the box {' and '.join(box)}"] if box else []
        said += [f"with {name} = {a}" for name, a, b in ends if a == b]
        said += [f"for all {ends[i][0]} from {ends[i][1]} to {ends[i][2]}" for i in self.parameters]
        return ", ".join(said)
