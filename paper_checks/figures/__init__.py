"""The paper's figures, regenerated from the model as far as that can be without its raw data."""

from collections.abc import Callable, Iterable
from os import PathLike
from pathlib import Path

from paper_checks.figures import (
    drum,
    entrapment,
    flow,
    headings,
    histories,
    pairs,
    regions,
    rest,
    solid,
)
from paper_checks.figures.figure import Figure

FIGURES: dict[str, Figure] = {
    figure.name: figure
    for figure in (
        *drum.FIGURES,
        *flow.FIGURES,
        *histories.FIGURES,
        *headings.FIGURES,
        *pairs.FIGURES,
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
    progress: Callable[[str], None] | None = None,
) -> list[Path]:
    """Draw figures and write each as ``name.png`` (200 dpi) and ``name.svg``.

    Parameters
    ----------
    folder : path
        It is made if need be.
    names : iterable of str, optional
        Which; default all of :data:`FIGURES`.
    slow : bool, optional
        Whether figures that take a simulation are among all; those that are named are drawn.
    progress : callable, optional
        Called with the name of each figure once it is written.

    Returns
    -------
    list of Path
        What was written, two for each figure.

    Raises
    ------
    ValueError
        If there is no figure of some name; nothing is drawn then.
    """
    if isinstance(names, str):
        names = [names]
    chosen = list(FIGURES) if names is None else list(dict.fromkeys(names))
    for name in chosen:
        if name not in FIGURES:
            msg = f"names: expected some of {', '.join(FIGURES)}; got {name!r}"
            raise ValueError(msg)
    written = []
    for name in chosen:
        figure = FIGURES[name]
        if names is None and figure.slow and not slow:
            continue
        try:
            written += figure.write(Path(folder))
        except Exception as error:
            error.add_note(f"while drawing the figure {name!r}")
            raise
        if progress is not None:
            progress(name)
    return written


__all__ = ["FIGURES", "Figure", "write"]
