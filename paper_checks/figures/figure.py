"""Figures: a name, caption and alternative text, and the function that draws it."""

import io
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure as Drawing
from PIL import Image

from paper_checks.figures.style import styled
from polycorner.toolkit import replace_atomically

DPI = 200
SHADES = 128  # of a PNG


# A text, or a function that computes it when it is first read.
Words = str | Callable[[], str]


@dataclass(frozen=True, eq=False)
class Figure:
    """A figure of the paper, drawn from the model.

    Attributes
    ----------
    name : str
        Name by which it is selected.
    title : str
        Title in a few words.
    caption_words, alt_words : str or callable
        Its caption and its alternative text. Functions are called when the text is first read,
        because they compute the numbers in it.
    draw : callable
        Returns the matplotlib figure.
    slow : bool
        Whether drawing takes a simulation.
    """

    name: str
    title: str
    caption_words: Words
    alt_words: Words
    draw: Callable[[], Drawing]
    slow: bool = False

    @cached_property
    def caption(self) -> str:
        """Description of the drawing, with parameters and units."""
        return self.caption_words if isinstance(self.caption_words, str) else self.caption_words()

    @cached_property
    def alt(self) -> str:
        """Alternative text for readers who cannot see the figure."""
        return self.alt_words if isinstance(self.alt_words, str) else self.alt_words()

    def write(self, folder: Path) -> list[Path]:
        """Write ``name.png`` and ``name.svg``; text in them needs no installed fonts."""
        drawing = self.draw()
        paths = [folder / f"{self.name}.{ending}" for ending in ("png", "svg")]
        with styled():
            _save_png(drawing, paths[0])
            with replace_atomically(paths[1]) as temporary:
                drawing.savefig(temporary, metadata={"Date": None, "Title": self.title})
        return paths


def _save_png(drawing: Drawing, path: Path) -> None:
    """Save with a palette of few colours, which halves the file without visible change."""
    FigureCanvasAgg(drawing)
    raw = io.BytesIO()
    drawing.savefig(raw, format="png", dpi=DPI)
    with Image.open(raw) as image:
        few = image.convert("RGB").quantize(SHADES, dither=Image.Dither.NONE)
        with replace_atomically(path) as temporary:
            few.save(temporary, optimize=True, dpi=(DPI, DPI))
