"""The map of proportions of a pair: where its skeleton in the plane changes."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from polycorner.dumbbells.pictures.symbols import corner_symbol
from polycorner.dumbbells.statics.skeleton import long_rod_length
from polycorner.dumbbells.statics.skeleton_map import PairMap, Signature
from polycorner.toolkit import SHADES, checked


@checked
def draw_pair_map(found: PairMap) -> Figure:
    """Draw where the skeleton of the pair in the plane changes, over ``l/r`` and ``t/r``.

    A dot for every skeleton of the grid, coloured by its signature; rings for the changes found by
    bisection; dashed the closed form.  The legend describes the signatures, those that occur only
    at the changes included.
    """
    figure = Figure(figsize=(11, 6), layout="constrained")
    axes = figure.add_subplot()
    low, high = float(found.lengths[0]), float(found.lengths[-1])
    x, y = np.meshgrid(found.lengths, found.rods)
    for k, signature in enumerate(found.signatures):
        here, colour = found.table == k, SHADES[(1 + 2 * k) % len(SHADES)]
        if here.any():
            label = _described(signature)
            axes.plot(x[here], y[here], "o", ms=5, ls="", color=colour, label=label, zorder=1)
    rods = np.linspace(0.0, 1.0, 200)
    exact = [long_rod_length(1.0, t) for t in rods.tolist()]
    axes.plot(exact, rods, "k--", lw=1.2, zorder=3, label=r"$2\sqrt{4r^2-(r+t)^2}$")
    if len(found.change_rods):
        _draw_changes(axes, found)
    axes.axvspan(0.0, 2.0, color="0.93", zorder=0)
    axes.set(xlim=(min(low, 2.0) - 0.1, high + 0.1), ylim=(0, 1))
    axes.set(xlabel="length $l/r$", ylabel="rod radius $t/r$")
    notation = "$C^{ijk}$: a corner with $i$ ball–ball, $j$ ball–rod and $k$ rod–rod contacts"
    axes.set_title(f"Corners, edges and faces of the pair in the plane\n{notation}", fontsize=11)
    figure.legend(loc="outside right upper", frameon=False, fontsize=9, labelspacing=1.2)
    return figure


def _draw_changes(axes: Axes, found: PairMap) -> None:
    middle, odd = found.change_brackets.mean(axis=1), ~found.explained
    met = sorted(set(found.critical[found.critical >= 0].tolist()))
    rows = ["change, by bisection"]
    if met:
        rows += ["exactly there:", *(_described(found.signatures[k]) for k in met)]
    label = "\n".join(rows)
    axes.plot(
        middle, found.change_rods, "o", ms=9, mfc="none", mec="black", ls="", zorder=4, label=label
    )
    if odd.any():
        axes.plot(middle[odd], found.change_rods[odd], "rx", ms=11, zorder=5, label="unexplained")


def _described(signature: Signature) -> str:
    counts = (signature.labelled, signature.ordered, signature.pattern.counts)
    kinds = ",  ".join(corner_symbol(kind) for kind, _ in signature.pattern.corners)
    words = ("balls labelled", "dumbbells labelled", "nothing labelled")
    rows = ["{}, {}, {}  {}".format(*n, word) for n, word in zip(counts, words, strict=True)]
    return "\n".join([kinds, *rows, *([] if signature.sound else ["incomplete"])])
