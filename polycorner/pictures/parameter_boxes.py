"""Figures of proofs over boxes of parameters, coloured by outcome."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.collections import PatchCollection
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle

from polycorner.checks import refuse
from polycorner.kinds import checked

if TYPE_CHECKING:
    from polycorner.proofs import Proof

COLOURS = {"proved": "#009E73", "failed": "#D55E00", "undecided": "#E69F00"}


@checked
def draw_cells(proof: "Proof", units: Mapping[str, str] | None = None) -> Figure:
    """Draw the cells of a proof over one or two parameters, coloured by what was decided.

    Parameters
    ----------
    proof : Proof
        A proof over a box of parameters.
    units : mapping from str to str, optional
        Labels of the axes by parameter, such as ``{"t": "rod radius t (mm)"}``.

    Raises
    ------
    ValueError
        If the proof has no parameters, or more than two.
    """
    names = list(proof.parameters)
    if len(names) not in (1, 2):
        refuse("proof", "one over one or two parameters", names)
    figure = Figure(figsize=(6.5, 5 if len(names) == 2 else 2), layout="constrained")
    axes = figure.add_subplot()
    for status, colour in COLOURS.items():
        boxes = [
            _rectangle([cell.parameters[name] for name in names])
            for cell in proof.cells
            if cell.status == status
        ]
        axes.add_collection(
            PatchCollection(boxes, facecolor=colour, edgecolor="white", linewidth=0.4)
        )
    labels = dict(units or {})
    axes.set_xlim(*proof.parameters[names[0]])
    axes.set_xlabel(labels.get(names[0], names[0]))
    if len(names) == 2:
        axes.set_ylim(*proof.parameters[names[1]])
        axes.set_ylabel(labels.get(names[1], names[1]))
    else:
        axes.set_ylim(0, 1)
        axes.set_yticks([])
    found = {str(cell.status) for cell in proof.cells}
    axes.legend(
        handles=[Patch(color=c, label=s) for s, c in COLOURS.items() if s in found],
        loc="lower center",
        bbox_to_anchor=(0.5, 1.01),
        ncols=3,
        frameon=False,
    )
    axes.set_title(f"{100 * np.floor(1e4 * proof.proved_fraction) / 1e4:g} % proved", pad=28)
    return figure


def _rectangle(sides: Sequence[tuple[float, float]]) -> Rectangle:
    (left, right), (low, high) = sides if len(sides) == 2 else (sides[0], (0.0, 1.0))
    return Rectangle((left, low), right - left, high - low)
