"""The report: formulas in MathML, embedded figures, no requests; rendered by a real browser."""

import re
from html.parser import HTMLParser

import pytest
import small_catalogue

from paper_checks import CLAIMS
from paper_checks.figures.embedding import embedded_figures
from paper_checks.framework.claims import Verdict
from paper_checks.framework.records import SECTIONS, counts
from paper_checks.framework.report import html_report
from paper_checks.framework.running import Result, Run
from paper_checks.framework.typesetting import html, plain, sentence

VOID = {"meta", "input", "img", "wbr", "br", "link"}


def pretended():
    """Return a run over the whole catalogue without running it, with all verdicts and an error."""
    verdicts = list(Verdict)
    results = [
        Result(claim, small_catalogue.found(verdicts[k % 5], "" if k % 2 else r"$p \ge 1$"))
        for k, claim in enumerate(CLAIMS)
    ]
    broken = Result(small_catalogue.CLAIMS[1], None, "ValueError: <no> such thing")
    return Run((broken, *results), slow=CLAIMS[:2], missed=CLAIMS[2:3])


RUN = pretended()


@pytest.fixture(scope="module")
def page():
    drawn = Run(tuple(r for r in RUN.results if r.claim.figure == "tutorial"))
    return html_report(RUN, embedded_figures(drawn))


class Reader(HTMLParser):
    """Collects tags, and asserts that they are properly nested."""

    def __init__(self, text):
        super().__init__()
        self.open, self.tags, self.ids = [], [], []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attributes):
        attributes = dict(attributes)
        self.tags.append((tag, attributes))
        if "id" in attributes:
            self.ids.append(attributes["id"])
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


# -------------------------------------------------------------------------------- sentences


@pytest.mark.parametrize(
    ("tex", "unicode"),
    [
        (r"\theta_s = \arctan(r/\ell)", "θ_s = arctan(r/ℓ)"),
        (r"\frac{2 D p}{D^2 - p^2}", "(2 D p)/(D^2 - p^2)"),
        (r"\frac{\sqrt{E}}{\sqrt{k}}", "(√E)/(√k)"),
        (r"7^\circ", "7°"),
        (r"7^{\circ}", "7°"),
        (r"x^{\frac{3}{2}} \ge 0", "x^(3/2) ≥ 0"),
        (r"\{x_{i+1} > 0\}", "{x_(i+1) > 0}"),
        (r"\mathcal{E}_L", "E_L"),
        (r"\cos{\left(\alpha \right)}", "cos(α)"),
    ],
)
def test_plain(tex, unicode):
    assert plain(f"so ${tex}$.") == f"so {unicode}."


def test_html_keeps_text_and_makes_formulas_mathml():
    written = html(r"a < b & `x`: $\theta < 1$.")
    assert written.startswith(
        'a &lt; b &amp; <code>x</code>: <span class="nb"><math><mrow><mi>θ</mi>'
    )
    assert written.endswith("</math>.</span>")
    assert "$" not in written


def test_long_formulas_can_be_broken_before_relations_and_short_ones_not():
    assert html("$a = b$").count("<math>") == 1
    assert html("$(a = b)$ and").count("<math>") == 1
    long = html(r"$\varphi = \arctan(x / (z \cos\alpha - y \sin\alpha)) \le \pi = \pi$")
    assert long.count("<wbr>") == 3


def test_a_formula_that_cannot_be_shown_is_refused():
    with pytest.raises(ValueError, match=r"^formula: expected .*nosuch"):
        html(r"$\nosuch{x}$")


@pytest.mark.parametrize(
    ("text", "whole"),
    [("a rod", "A rod."), ("$x$ is", "$x$ is."), ("Done.", "Done."), ("dE holds", "dE holds.")],
)
def test_sentence(text, whole):
    assert sentence(text) == whole


# ------------------------------------------------------------------------------ the catalogue


def test_what_claims_say_can_be_typeset(subtests):
    for claim in CLAIMS:
        with subtests.test(claim.id):
            for text in (claim.statement, claim.place):
                assert text.count("$") % 2 == 0
                html(text)
                assert "\\" not in plain(text)
            assert claim.section in SECTIONS


# ----------------------------------------------------------------------------------- the file


def test_structure(page):
    reader = Reader(page)
    assert reader.open == []
    assert len(set(reader.ids)) == len(reader.ids)
    links = [a["href"] for tag, a in reader.tags if tag == "a"]
    assert {link[1:] for link in links} <= set(reader.ids)
    articles = [a["id"] for tag, a in reader.tags if tag == "article"]
    assert articles == [result.claim.id for result in RUN.results]
    for verdict, number in counts(RUN).items():
        assert f"<b>{number}</b>{verdict}" in page
    assert "ValueError: &lt;no&gt; such thing" in page


def test_nothing_outside_is_referred_to(page):
    assert "default-src 'none'" in page
    for tag, attributes in Reader(page).tags:
        assert tag not in {"script", "link", "iframe", "object", "base"}
        for name in ("src", "href", "srcset", "action", "data"):
            assert attributes.get(name, "#").startswith(("#", "data:"))
    style = page[page.index("<style>") : page.index("</style>")]
    assert "url(" not in style
    assert "@import" not in style


def test_figures_have_alternative_texts_and_captions(page):
    images = [attributes for tag, attributes in Reader(page).tags if tag == "img"]
    assert len(images) == 1
    assert len(images[0]["alt"]) > 40
    assert "<figcaption><b>" in page
    assert page.count('href="#figure-tutorial"') >= 1  # the second claim that it shows


def test_a_figure_that_breaks_is_said_to():
    broken = Run((Result(small_catalogue.claim("A1", None, figure="nosuch"), None, "x"),))
    page = html_report(broken, embedded_figures(broken))
    assert "The figure could not be drawn: KeyError" in page


# -------------------------------------------------------------------------------- the browser


@pytest.fixture(scope="module")
def file(page, tmp_path_factory):
    written = tmp_path_factory.mktemp("report") / "report.html"
    written.write_text(page, encoding="utf-8")
    return written


@pytest.mark.parametrize("width", [1200, 360])
@pytest.mark.parametrize("dark", [False, True])
def test_in_a_browser(tab, file, width, dark):
    tab.open(file, width=width, dark=dark)
    assert [url for url in tab.requests() if not url.startswith("data:image/")] == [file.as_uri()]
    assert tab.complaints() == []
    size = "m => m.getBoundingClientRect()"
    formulas = tab.value(f"[...document.querySelectorAll('math')].map({size}).map(b => b.height)")
    assert len(formulas) == len(re.findall("<math>", file.read_text(encoding="utf-8")))
    assert min(formulas) > 5
    loaded = "[...document.images].map(i => [i.naturalWidth, i.alt.length])"
    assert all(min(numbers) > 40 for numbers in tab.value(loaded))
    assert tab.value("document.documentElement.scrollWidth") <= width
    red, green, blue = map(int, re.findall(r"\d+", tab.value(COLOUR))[:3])
    assert (red + green + blue < 150) is dark


COLOUR = "getComputedStyle(document.body).backgroundColor"


def test_buttons_show_the_claims_of_one_verdict(tab, file):
    tab.open(file, width=1200)
    shown = "[...document.querySelectorAll('article')].filter(a => a.offsetHeight > 0).length"
    assert tab.value(shown) == len(RUN.results)
    tab.value("document.querySelector('label[for=show-refuted]').click()")
    assert tab.value(shown) == counts(RUN)["refuted"]
    tab.value("document.querySelector('label[for=show-all]').click()")
    assert tab.value(shown) == len(RUN.results)
