"""The paper's figures: drawn in one font, described and written."""

import re
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
from matplotlib.text import Text
from PIL import Image

from paper_checks import figures
from paper_checks.figures import FIGURES, Figure, write

NAMES = [
    "coordinates",
    "flow_lines",
    "single_history",
    "dyad_history",
    "heading_length",
    "faces",
    "nested",
    "passes",
    "solid",
    "torque",
    "rest_regions",
    "tutorial",
    "entrapment",
]
UNITS = re.compile(r"\((degrees|mm|s|0\.001 degrees|°|any unit of length)\)|/")


def every(names=NAMES):
    slow = pytest.mark.slow
    return [pytest.param(n, marks=[slow] if FIGURES[n].slow else []) for n in names]


# ------------------------------------------------------------------------------------ all of them


def test_the_catalogue():
    assert set(FIGURES) == set(NAMES)
    assert all(figure.name == name for name, figure in FIGURES.items())
    slow = {n for n, figure in FIGURES.items() if figure.slow}
    assert slow == {"single_history", "dyad_history", "passes"}


@pytest.mark.parametrize("name", every())
def test_words(name):
    figure = FIGURES[name]
    assert 5 < len(figure.title) < 60
    for words in (figure.caption, figure.alt):
        assert len(words) > 150
        assert words.endswith(".")
        assert not re.search(r"\bnan\b|\binf\b|None|  |\$|[^\w.)]-\d", words)
    assert figure.caption != figure.alt
    assert figure.caption is figure.caption  # computed once


@pytest.mark.parametrize("name", every())
def test_axes_say_what_they_show_in_which_unit(name, drawn):
    for axes in drawn(name).findobj(lambda artist: hasattr(artist, "get_xlabel")):
        if not getattr(axes, "_axis3don", axes.axison):
            continue
        for axis in (axes.xaxis, axes.yaxis, *([axes.zaxis] if hasattr(axes, "zaxis") else [])):
            label = axis.get_label_text()
            shown = any(tick.label1.get_visible() for tick in axis.get_major_ticks())
            assert label or not shown or _labelled_beside(axes, axis)
            if label and label != "$y$":
                assert UNITS.search(label), label


def _labelled_beside(axes, axis):
    """Return whether the panel to the left shows the same quantity."""
    box = axes.get_position()
    which = "y" if axis is axes.yaxis else "x"
    others = [other for other in axes.figure.axes if other.get_position().x0 < box.x0 - 1e-6]
    return any(getattr(other, f"get_{which}label")() for other in others)


@pytest.mark.parametrize("name", every())
def test_one_font(name, drawn):
    texts = [text for text in drawn(name).findobj(Text) if text.get_text().strip()]
    assert {tuple(text.get_fontfamily()) for text in texts} == {("STIXGeneral",)}
    assert {text.get_math_fontfamily() for text in texts} == {"stix"}
    assert min(text.get_fontsize() for text in texts) >= 8


# ---------------------------------------------------------------------------------------- writing


def test_files(tmp_path):
    told, names = [], ["tutorial", "coordinates"]
    paths = write(
        tmp_path / "new", [*names, "tutorial"], progress=lambda *state: told.append(state)
    )
    assert told == [(1, 2, "tutorial"), (2, 2, "coordinates")]
    expected = [f"{name}.{ending}" for name in names for ending in ("png", "svg")]
    assert [path.name for path in paths] == expected
    with Image.open(paths[0]) as image:
        assert image.info["dpi"] == pytest.approx((200, 200), abs=0.1)
        assert image.size[0] > 800
    root = ET.parse(paths[1]).getroot()
    assert root.tag.endswith("svg")
    links = [v for e in root.iter() for k, v in e.attrib.items() if k.endswith("href")]
    assert all(link.startswith(("#", "data:")) for link in links)
    assert not any(element.tag.endswith("}text") for element in root.iter())


def test_the_same_figure_is_the_same_file(tmp_path):
    first, second = (write(tmp_path / k, "tutorial") for k in "ab")
    for one, other in zip(first, second, strict=True):
        assert one.read_bytes() == other.read_bytes()


def test_unknown_names_are_refused_before_anything_is_drawn(tmp_path):
    with pytest.raises(ValueError, match=r"^names: expected .*nothing") as caught:
        write(tmp_path / "out", ["tutorial", "nothing"])
    assert all(name in str(caught.value) for name in NAMES)
    assert not (tmp_path / "out").exists()


def test_slow_ones_are_left_out_unless_they_are_named(tmp_path, monkeypatch):
    quick = FIGURES["tutorial"]
    late = Figure("late", "Late", "words", "words", quick.draw, slow=True)
    monkeypatch.setattr(figures, "FIGURES", {"tutorial": quick, "late": late})
    names = [
        [path.stem for path in write(tmp_path, chosen, slow=slow)][::2]
        for chosen, slow in ((None, False), (None, True), (["late"], False))
    ]
    assert names == [["tutorial"], ["tutorial", "late"], ["late"]]


def test_what_goes_wrong_names_the_figure(tmp_path, monkeypatch):
    def broken():
        msg = "no"
        raise RuntimeError(msg)

    monkeypatch.setattr(figures, "FIGURES", {"x": Figure("x", "X", "words", "words", broken)})
    with pytest.raises(RuntimeError, match="no") as caught:
        write(tmp_path)
    assert "'x'" in caught.value.__notes__[0]


def test_words_may_be_computed():
    told = []
    figure = Figure("x", "X", lambda: told.append(1) or "late", "now", lambda: None)
    assert not told
    assert (figure.caption, figure.caption, figure.alt) == ("late", "late", "now")
    assert told == [1]
    with pytest.raises(TypeError, match="caption"):
        Figure("x", "X")


# ------------------------------------------------------------------------------------- on the page

PAGE = Path(__file__).parents[3] / "docs" / "paper_figures.md"


@pytest.mark.parametrize("name", every())
def test_the_page_shows_the_figure_with_its_words(name):
    """What is simulated may differ in its numbers from one processor to another."""
    page, figure = PAGE.read_text(encoding="utf-8"), FIGURES[name]
    blurred = (lambda text: re.sub(r"[-+−\d.]+", "#", text)) if figure.slow else str
    assert blurred(f"![{figure.alt}](images/paper/{name}.png)") in blurred(page)
    assert blurred(f"*{figure.title}.* {figure.caption}") in blurred(page)
    image = PAGE.parent / "images" / "paper" / f"{name}.png"
    assert image.stat().st_size < 150_000
    with Image.open(image) as opened:
        assert opened.size[0] > 800
