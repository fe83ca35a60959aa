"""The paper's figures, regenerated from the model as far as possible without its raw data."""

from collections.abc import Iterable
from os import PathLike
from pathlib import Path

from paper_checks.figures import (
    drum,
    entrapment,
    flow,
    headings,
    histories,
    pairs,
    passes,
    regions,
    rest,
    solid,
)
from paper_checks.figures.figure import Figure
from polycorner.toolkit import Progress, checks, silent

FIGURES: dict[str, Figure] = {
    figure.name: figure
    for figure in (
        *drum.FIGURES,
        *flow.FIGURES,
        *histories.FIGURES,
        *headings.FIGURES,
        *pairs.FIGURES,
        *passes.FIGURES,
        *solid.FIGURES,
        *rest.FIGURES,
        *regions.FIGURES,
        *entrapment.FIGURES,
    )
}


def write(
    folder: str | PathLike[str],
    names: Iterable[str] | None = None,
    slow: bool = True,
    progress: Progress = silent,
) -> list[Path]:
    """Draw figures and write each as ``name.png`` (200 dpi) and ``name.svg``.

    Parameters
    ----------
    folder : path
        Created if it does not exist.
    names : iterable of str, optional
        Names of the figures to draw; default all of :data:`FIGURES`.
    slow : bool, optional
        Whether the default includes figures that take a simulation.
    progress : callable, optional
        Called as ``progress(done, figures, name)`` once a figure is written.

    Returns
    -------
    list of Path
        The files written, two for each figure.

    Raises
    ------
    ValueError
        If there is no figure of some name; nothing is drawn then.
    """
    if isinstance(names, str):
        names = [names]
    chosen = list(FIGURES) if names is None else list(dict.fromkeys(names))
    checks.names("names", chosen, FIGURES)
    if names is None and not slow:
        chosen = [name for name in chosen if not FIGURES[name].slow]
    written = []
    for done, name in enumerate(chosen, 1):
        figure = FIGURES[name]
        try:
            written += figure.write(Path(folder))
        except Exception as error:
            error.add_note(f"while drawing the figure {name!r}")
            raise
        progress(done, len(chosen), name)
    return written


__all__ = ["FIGURES", "Figure", "write"]
