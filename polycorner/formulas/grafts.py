"""Programs written into the graphs of others."""

from collections.abc import Iterable, Mapping

from polycorner.formulas.operations import OPERATIONS
from polycorner.formulas.programs import Graph, Payload, Program


def grafted(graph: Graph, program: Program, inputs: Mapping[tuple[str, int], int]) -> list[int]:
    """Write a program into a graph; return the places of its nodes there.

    ``inputs`` are the nodes in place of its variables ``("var", i)`` and parameters ``("par", i)``.
    Operations on constants and on what the graph has already are simplified and shared.
    """
    placed: dict[int, int] = {}
    for a, (op, args) in enumerate(program.graph.nodes):
        leaf = op in {"var", "par"}
        placed[a] = inputs[op, int(args[0])] if leaf else rebuilt(graph, op, args, placed)
    return [*placed.values()]


def rebuilt(graph: Graph, op: str, args: Iterable[Payload], placed: Mapping[int, int]) -> int:
    """Write one operation into another graph, its arguments being there already."""
    if op == "const":
        return graph.const(*args)
    if op == "var":
        return graph.node(op, *args)
    children = [placed[int(arg)] for arg in args]
    if op in {"add", "sub", "neg", "mul", "div", "select"}:
        result: int = getattr(graph, op)(*children)
        return result
    return graph.unary(op, *children) if op in OPERATIONS else graph.node(op, *children)
