"""Figures embedded in a page as data URLs."""

from base64 import b64encode
from html import escape
from io import BytesIO
from typing import TYPE_CHECKING, Any

from paper_checks.framework.report import Embedded
from paper_checks.framework.running import Run
from paper_checks.framework.typesetting import html, plain

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Drawn

LARGEST_SVG = 400_000  # bytes; a larger picture of many small parts is embedded as pixels


def embedded_figures(run: Run, *, slow: bool = False) -> dict[str, Embedded]:
    """Draw the figures to which claims of a run refer, slow ones only on request.

    A figure that cannot be drawn is reported in its place.
    """
    names = dict.fromkeys(r.claim.figure for r in run.results if r.claim.figure is not None)
    figures = (_embedded(name, slow) for name in names)
    return {figure.name: figure for figure in figures if figure is not None}


def _embedded(name: str, slow: bool) -> Embedded | None:
    try:
        from paper_checks.figures import FIGURES

        figure = FIGURES[name]
        if figure.slow and not slow:
            return None
        data = _data(figure.draw())
    except Exception as error:  # no exception may prevent the report
        problem = " ".join(f"{type(error).__name__}: {error}".split())
        return Embedded(name, name, "", problem)
    alternative = escape(plain(figure.alt), quote=True)
    caption = f"<b>{html(figure.title)}.</b> {html(figure.caption)}"
    return Embedded(
        name,
        figure.title,
        f'<figure id="figure-{name}"><img src="{data}" alt="{alternative}">'
        f"<figcaption>{caption}</figcaption></figure>",
    )


def _data(drawn: "Drawn") -> str:
    from paper_checks.figures.style import styled

    with styled():
        kind, data = "svg+xml", _saved(drawn, "svg", metadata={"Date": None})
        if len(data) > LARGEST_SVG:
            kind, data = "png", _saved(drawn, "png", dpi=160)
    return f"data:image/{kind};base64,{b64encode(data).decode()}"


def _saved(drawn: "Drawn", form: str, **options: Any) -> bytes:
    file = BytesIO()
    drawn.savefig(file, format=form, bbox_inches="tight", **options)
    return file.getvalue()
