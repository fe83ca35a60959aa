"""Functions that read the same coordinates as one family, so that one kernel evaluates them.

Kernels of single functions repeat what these have in common, such as where a body puts its points,
and cost a call each.  In a fused family the parameters of all functions are numbered by their
absolute values: equal ones become one parameter, opposite ones share its products, and zeros vanish
from the formulas.  Functions of other numbers that are equal in the same places share the kernel.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import TYPE_CHECKING, NamedTuple

from polycorner.formulas import cache, families, programs
from polycorner.formulas.families import Family, Term, composition, stationary, symbol
from polycorner.formulas.functions import SmoothFunction
from polycorner.formulas.programs import Graph, Program

if TYPE_CHECKING:
    import sympy

    from polycorner.formulas.families import Formulas

# Second derivatives up to which functions are fused: nine gaps of 14 coordinates have 1764, which
# take three seconds to compile, once.  Kernels of single functions compile in a tenth of that.
MOST_FUSED = 2000


class _Bound(NamedTuple):
    """A function whose variables and parameters are numbered among those of all.

    Parameters are numbered from 1, with the sign of their value; 0 stands for zero.
    """

    family: Family
    name: str
    variables: tuple[int, ...]
    parameters: tuple[int, ...]

    @property
    def term(self) -> Term:
        """The function with symbols by these numbers."""
        family = self.family
        formal = map(symbol, (*family.variables, *family.parameters))
        places = [symbol(f"v{i}") for i in self.variables] + [*map(_signed, self.parameters)]
        return Term(family, self.name, dict(zip(formal, places, strict=True)))

    def graft(self, graph: Graph) -> tuple[int, list[int]]:
        """Write the function into a graph; return its place, and those of what is stationary."""
        program, zero = _program(self.family), graph.const(0)
        inputs = {("var", i): graph.node("var", k) for i, k in enumerate(self.variables)}
        for i, k in enumerate(self.parameters):
            number = graph.node("par", abs(k) - 1) if k else zero
            inputs["par", i] = graph.neg(number) if k < 0 else number
        placed = graph.grafted(program, inputs)
        output = program.outputs[self.family.names.index(self.name)]
        return placed[output], [graph.core(placed[a]) for a in program.stationary]


@lru_cache(maxsize=64)
def _program(family: Family) -> Program:
    return family.program()


@dataclass(frozen=True, eq=False)
class Fused(Family):
    """A family of functions of others; its program is made of theirs."""

    bound: tuple[_Bound, ...] = ()

    def program(self) -> Program:
        """Return the straight-line program of the values."""
        graph = Graph()
        grafts = [b.graft(graph) for b in self.bound]
        outputs = tuple(output for output, _ in grafts)
        held = tuple(a for _, some in grafts for a in some)
        return Program(graph, outputs, len(self.variables), len(self.parameters), held)


def _signed(k: int) -> "sympy.Expr":
    import sympy

    return sympy.sign(k) * symbol(f"p{abs(k)}")


def fused(functions: Sequence[SmoothFunction]) -> list[SmoothFunction]:
    """Return the same functions, on one manifold, as members of one family.

    They stay as they are where there is only one, or too many to be compiled together.
    """
    reads = sorted({i for f in functions for i in f.reads})
    if len(functions) == 1 or len(functions) * len(reads) ** 2 > MOST_FUSED:
        return list(functions)
    sizes = tuple(dict.fromkeys(abs(x) for f in functions for x in f.parameters if x))
    number = {0.0: 0} | {s * x: s * k for k, x in enumerate(sizes, 1) for s in (1, -1)}
    bound = [
        _Bound(
            f.family,
            f.member_name,
            tuple(map(reads.index, f.reads)),
            tuple(number[x] for x in f.parameters),
        )
        for f in functions
    ]
    family, manifold = _family(tuple(bound), len(reads), len(sizes)), functions[0].manifold
    names = [manifold.names[i] for i in reads]
    return [
        SmoothFunction.member(family, name, manifold, parameters=sizes, reads=names, label=f.name)
        for name, f in zip(family.names, functions, strict=True)
    ]


@lru_cache(maxsize=64)
def _family(bound: tuple[_Bound, ...], variables: int, parameters: int) -> Family:
    return Fused(
        tuple(f"f{k}" for k in range(len(bound))),
        tuple(f"v{k}" for k in range(variables)),
        tuple(f"p{k}" for k in range(1, parameters + 1)),
        partial(_formulas, bound),
        repr((_sources(), [(b.family.key, *b[1:]) for b in bound])),
        stationary=stationary(b.family for b in bound),
        bound=bound,
    )


def _sources() -> str:
    return cache.source_key(families.__name__, programs.__name__, __name__)


def _formulas(bound: tuple[_Bound, ...]) -> "Formulas":
    return composition({f"f{k}": b.term for k, b in enumerate(bound)})


def written_out(
    functions: Mapping[str, SmoothFunction],
) -> "tuple[dict[str, sympy.Expr], dict[str, sympy.Expr]]":
    """Return definitions and expressions of functions, with numbers in place of parameters."""
    import sympy

    terms = {}
    for name, f in functions.items():
        read = [f.manifold.names[i] for i in f.reads]
        places = {symbol(x): symbol(y) for x, y in zip(f.family.variables, read, strict=True)}
        places |= {symbol(x): sympy.Float(y) for x, y in f.parameter_values.items()}
        terms[name] = Term(f.family, f.member_name, places)
    return composition(terms)
