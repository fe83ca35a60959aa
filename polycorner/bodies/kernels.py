"""And/or trees of gaps in which the gaps of the same bodies share one kernel."""

from collections.abc import Iterable, Iterator

from polycorner.bodies.pairs import Tree
from polycorner.formulas.functions import SmoothFunction
from polycorner.formulas.fusion import fused


def together(trees: Iterable[Tree]) -> list[Tree]:
    """Return the trees with all gaps that read the same coordinates in one family.

    Two bodies have many gaps, which depend on where the bodies put the same few points; pairs of
    equal bodies have equal families, and so share a kernel among each other.
    """
    trees = list(trees)
    groups: dict[frozenset[int], list[SmoothFunction]] = {}
    for function in _functions(trees):
        groups.setdefault(frozenset(function.reads), []).append(function)
    known = {
        id(old): new
        for group in groups.values()
        for old, new in zip(group, fused(group), strict=True)
    }

    def replaced(tree: Tree) -> Tree:
        if isinstance(tree, SmoothFunction):
            return known[id(tree)]
        return type(tree)(*map(replaced, tree.parts))

    return [replaced(tree) for tree in trees]


def _functions(trees: Iterable[Tree]) -> Iterator[SmoothFunction]:
    for tree in trees:
        if isinstance(tree, SmoothFunction):
            yield tree
        else:
            yield from _functions(tree.parts)
