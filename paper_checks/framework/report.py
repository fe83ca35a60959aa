"""Self-contained HTML report of a run of the claims.

Formulas are MathML, figures are data URLs; a content security policy forbids every request. The
buttons that filter claims by verdict are radio buttons and a style sheet, no script.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from html import escape
from importlib.resources import files

from paper_checks.framework.claims import Claim, Verdict
from paper_checks.framework.records import VERDICTS, counts, section_name, to_act_on
from paper_checks.framework.running import Result, Run
from paper_checks.framework.typesetting import html, sentence

TITLE = "Curvilinear polyhedra as dynamical arenas: the paper, claim by claim"
LEAD = (
    "Every statement of the paper that can be decided is restated here in our own words and "
    "decided by the strongest means that applies: a symbolic identity, a proof in interval "
    "arithmetic, a computation or a simulation. Numbers were computed when this report was made."
)
SOURCE = (
    "The paper: S. Ghosh, A. P. Merin, S. Bhattacharya, N. Nitsure, Curvilinear polyhedra as "
    "dynamical arenas, illustrated by an example of self-organized locomotion, arXiv:1605.04438."
)
MARKS = dict(zip(VERDICTS, "✓◐✎✗∅–!", strict=True))
CLASSES = {
    verdict: verdict.replace(" stated conditions", "").replace(" ", "-") for verdict in VERDICTS
}
POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:"


@dataclass(frozen=True)
class Embedded:
    """A figure as HTML with its caption and alternative text, or the error that prevented it."""

    name: str
    title: str
    html: str
    problem: str = ""


Figures = Mapping[str, Embedded]


def html_report(run: Run, figures: Figures) -> str:
    """Return the report as one HTML file.

    Parameters
    ----------
    run : Run
        Results of the checks.
    figures : mapping from str to Embedded
        Figures by name; see :func:`paper_checks.figures.embedding.embedded_figures`.
    """
    style = files("paper_checks.framework").joinpath("report.css").read_text(
        "utf-8"
    ) + _filter_rules(run)
    body = "\n".join(
        [
            f"<header><h1>{TITLE}</h1>",
            f'<p class="lead">{LEAD}</p><p class="source">{SOURCE}</p></header>',
            _tally(run),
            f"<main>{_act(run)}{_contents(run)}{''.join(_sections(run, figures))}</main>",
            _footer(run),
        ]
    )
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{TITLE}</title>\n<style>\n{style}</style>\n</head>\n"
        f"<body>\n{body}\n</body>\n</html>\n"
    )


# ------------------------------------------------------------------------------------ the summary


def _tally(run: Run) -> str:
    found = counts(run)
    bar = "".join(f'<span class="{CLASSES[v]}" style="flex: {n}"></span>' for v, n in found.items())
    buttons = [_button("all", "", len(run.results), "claims", checked=True)]
    buttons += [_button(CLASSES[v], CLASSES[v], n, v) for v, n in found.items()]
    return (
        f'<div class="bar" aria-hidden="true">{bar}</div><fieldset class="tally">'
        f"<legend>Show the claims of one verdict</legend>{''.join(buttons)}</fieldset>"
    )


def _button(name: str, tone: str, number: int, words: str, *, checked: bool = False) -> str:
    mark = " checked" if checked else ""
    return (
        f'<input type="radio" name="show" id="show-{name}"{mark}>'
        f'<label for="show-{name}" class="{tone}"><b>{number}</b>{words}</label>'
    )


def _filter_rules(run: Run) -> str:
    """Return the rules that hide the claims of all other verdicts."""
    return "".join(
        f"body:has(#show-{name}:checked) :is(article, .act li):not(.{name}) {{ display: none; }}\n"
        for name in (CLASSES[verdict] for verdict in counts(run))
    )


def _act(run: Run) -> str:
    groups = "".join(
        f"<h3>{title}</h3><ol>{''.join(map(_act_entry, group))}</ol>"
        for title, group in to_act_on(run).items()
    )
    if not groups:
        return ""
    return (
        '<section class="act" aria-labelledby="act"><h2 id="act"><small>Summary</small>'
        f"What an author would act on</h2>{groups}</section>"
    )


def _act_entry(result: Result) -> str:
    claim, finding = result.claim, result.finding
    if finding is None:
        return ""
    right = sentence(finding.correction or finding.evidence)
    return (
        f'<li class="{CLASSES[result.verdict]}"><a href="#{claim.id}">{claim.id}</a><div>'
        f"{_badge(result)}"
        f'<p class="place">{_kind(claim.section)} · {_place(claim)}</p>'
        f'<p class="printed">{html(sentence(claim.statement))}</p>'
        f'<p class="right">{html(right)}</p></div></li>'
    )


def _contents(run: Run) -> str:
    rows = []
    for section, results in _by_section(run):
        squares = "".join(
            f'<a class="{CLASSES[r.verdict]}" href="#{r.claim.id}" title="{r.verdict}">'
            f"{r.claim.id}</a>"
            for r in results
        )
        rows.append(
            f'<li><a href="#section-{section}">{section_name(section)}</a>'
            f'<span class="claims">{squares}</span></li>'
        )
    return f'<nav aria-label="Contents"><h2>Contents</h2><ol>{"".join(rows)}</ol></nav>'


# ------------------------------------------------------------------------------------- the claims


def _sections(run: Run, figures: Figures) -> Iterator[str]:
    shown: dict[str, str] = {}
    for section, results in _by_section(run):
        kind, _, about = section_name(section).partition(": ")
        yield (
            f'<section aria-labelledby="section-{section}"><h2 id="section-{section}">'
            f"<small>{kind}</small>{about}</h2>"
        )
        for result in results:
            yield _article(result, _figure(result.claim, figures, shown))
        yield "</section>"


def _article(result: Result, figure: str) -> str:
    claim, finding = result.claim, result.finding
    rows = [("Error", "right", escape(result.error))] if finding is None else []
    if finding is not None:
        rows = [("Evidence", "", html(sentence(finding.evidence)))]
    if finding is not None and finding.correction:
        word = "Condition" if finding.verdict is Verdict.HOLDS_UNDER else "Correction"
        rows.append((word, "right", html(sentence(finding.correction))))
    listed = "".join(f'<dt class="{tone}">{term}</dt><dd>{text}</dd>' for term, tone, text in rows)
    return (
        f'<article id="{claim.id}" class="{CLASSES[result.verdict]}"><header>'
        f'<a class="id" href="#{claim.id}">{claim.id}</a>{_badge(result)}'
        f'<span class="place">{_place(claim)}</span>'
        f'<span class="means">{claim.means.value}</span></header>'
        f'<p class="statement">{html(sentence(claim.statement))}</p>'
        f"<dl>{listed}</dl>{_numbers(result)}{figure}</article>\n"
    )


def _badge(result: Result) -> str:
    return f'<span class="verdict">{MARKS[result.verdict]} {result.verdict}</span>'


def _place(claim: Claim) -> str:
    """Return the place, without the section if it names the section, too."""
    kind = _kind(claim.section).lower()
    place = claim.place.removesuffix(f", {kind}").replace(f", {kind},", ",")
    return html(place[:1].upper() + place[1:])


def _kind(section: str) -> str:
    return section_name(section).partition(": ")[0]


def _numbers(result: Result) -> str:
    if result.finding is None or not result.finding.numbers:
        return ""
    rows = "".join(
        f"<tr><td>{escape(name.replace('_', ' '))}</td><td>{value:.10g}</td></tr>"
        for name, value in result.finding.numbers.items()
    )
    return f"<details><summary>Numbers</summary><div><table>{rows}</table></div></details>"


def _by_section(run: Run) -> Iterable[tuple[str, list[Result]]]:
    sections: dict[str, list[Result]] = {}
    for result in run.results:
        sections.setdefault(result.claim.section, []).append(result)
    return sections.items()


# ------------------------------------------------------------------------------------ the figures


def _figure(claim: Claim, figures: Figures, shown: dict[str, str]) -> str:
    """Return the figure of a claim where it first occurs, a link to it afterwards."""
    figure = figures.get(claim.figure or "")
    if figure is None:
        return ""
    if figure.problem:
        problem = escape(figure.problem)
        return f'<p class="source">The figure could not be drawn: {problem}</p>'
    if figure.name in shown:
        title = html(figure.title)
        return f'<p class="source">Figure: <a href="#figure-{figure.name}">{title}</a>.</p>'
    shown[figure.name] = claim.id
    return figure.html


def _footer(run: Run) -> str:
    import platform
    from importlib.metadata import version

    from polycorner import __version__

    used = ", ".join(f"{name} {version(name)}" for name in ("numpy", "sympy", "python-flint"))
    told = [f"polycorner {__version__}, Python {platform.python_version()}, {used}."]
    if run.slow:
        told.append(f"Left out as slow (add --slow): {_ids(run.slow)}.")
    if run.missed:
        told.append(f"Interrupted before these were checked: {_ids(run.missed)}.")
    told.append("Generated by <code>polycorner paper --slow --out DIR</code>.")
    return f"<footer>{' '.join(f'<p>{line}</p>' for line in told)}</footer>"


def _ids(claims: tuple[Claim, ...]) -> str:
    return ", ".join(claim.id for claim in claims)
