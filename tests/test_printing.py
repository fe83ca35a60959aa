"""What is printed: aligned text, clean HTML, the same cells in both, units for angles."""

import math
import pickle
from html.parser import HTMLParser

import numpy as np
import pytest
import sympy
from hypothesis import given
from hypothesis import strategies as st

from polycorner import (
    Manifold,
    Polyhedron,
    certify,
    minima,
    minimise,
    prove,
    sensitivity,
    skeleton,
    stratum_at,
)
from polycorner.dumbbells import DumbbellPair
from polycorner.printing import MOST_ROWS, Sheet, Table, listed, number, titled

ODD = "<b>&\"'"
cells = st.text(st.characters(codec="utf-8", categories=("L", "N", "P", "S")), max_size=8)


class Reader(HTMLParser):
    """Read a fragment: its cells, row by row, whatever else is said, and whether tags match."""

    def __init__(self, text):
        super().__init__()
        self.rows, self.words, self.tags, self.attributes, self.open = [], [], set(), set(), []
        self.sides = []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attributes):
        self.open.append(tag)
        self.tags.add(tag)
        self.attributes |= {name for name, _ in attributes}
        if tag == "tr":
            self.rows.append([])
            self.sides.append([])
        if tag in ("td", "th"):
            self.rows[-1].append("")
            self.sides[-1].append(dict(attributes)["style"].split(";")[0])

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open[-1] in ("td", "th"):
            self.rows[-1][-1] += data
        else:
            self.words.append(data)


@st.composite
def tables(draw):
    width = draw(st.integers(1, 4))
    row = st.tuples(*[cells] * width)
    rows = draw(st.lists(row, min_size=1, max_size=5))
    head = draw(st.sampled_from([(), draw(row)]))
    right = draw(st.sets(st.integers(0, width - 1)))
    return Table(head, tuple(rows), tuple(right), draw(cells))


@given(tables())
def test_html_holds_the_cells_and_nothing_foreign(table):
    read = Reader(table.html())
    head = [list(table.head)] if table.head else []
    assert read.rows == head + [list(row) for row in table.rows]
    assert "".join(read.words) == table.caption
    assert read.tags <= {"table", "caption", "thead", "tbody", "tr", "th", "td"}
    assert read.attributes <= {"style", "scope"}
    for k in range(len(table.rows[0])):
        side = "text-align: right" if k in table.numbers else "text-align: left"
        assert {sides[k] for sides in read.sides} == {side}


@given(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=8), cells)
def test_numbers_stand_with_their_points_below_each_other(values, title):
    table = Table(("name", title), tuple((f"v{i}", number(x)) for i, x in enumerate(values)), (1,))
    lines = table.text().splitlines()[1:]
    plain = [line for line in lines if "e" not in line]
    assert len({line.index(".") for line in plain if "." in line}) <= 1
    ends = {len(line) for line in plain if "." not in line}
    assert len(ends) <= 1
    assert [float(line.split()[1]) for line in lines] == pytest.approx(values, rel=1e-8, abs=1e-300)


@given(st.lists(st.tuples(cells, cells, cells), min_size=1, max_size=5))
def test_columns_of_words_begin_below_each_other(rows):
    table = Table(("a", "b", "c"), tuple(rows))
    lines = [f"{line:<40}" for line in table.text().split("\n")]
    start = 0
    for k in range(3):
        width = max(len(row[k]) for row in (table.head, *rows))
        assert [line[start : start + width] for line in lines] == [
            f"{row[k]:<{width}}" for row in (table.head, *rows)
        ]
        start += width + 2


def test_long_tables_say_how_many_rows_are_left_out():
    def rows(count):
        return ((str(k),) for k in range(count))

    short = listed("Things", ["k"], rows(MOST_ROWS), MOST_ROWS)
    assert (len(short.rows), short.caption) == (MOST_ROWS, "Things")
    long = listed("Things", ["k"], rows(MOST_ROWS + 5), MOST_ROWS + 5)
    assert len(long.rows) == MOST_ROWS
    assert long.caption == f"Things (the first {MOST_ROWS} of {MOST_ROWS + 5})"


@given(st.text(min_size=1), st.text(min_size=1))
def test_sentences_and_titles_are_escaped(title, words):
    read = Reader(Sheet(title, (words,)).html())
    assert read.tags == {"div", "p", "strong"}


@given(tables(), st.integers(4, 60))
def test_no_width_cuts_a_word(table, width):
    """At any width the cells are whole, and lines are longer only where one word is."""
    shown = table.text(width)
    told = [table.caption, *table.head, *(cell for row in table.rows for cell in row)]
    every = [word for cell in told for word in cell.split()]
    assert set(shown.split()) == set(every)
    longest = max(map(len, every), default=0)
    assert max(map(len, shown.splitlines()), default=0) <= max(width, longest + 2)


def test_wide_tables_are_wrapped_and_wider_ones_become_lines():
    table = Table(("name", "contacts"), (("delta", "A2B1 A2b aB1"),))
    assert table.text(80) == "name   contacts\ndelta  A2B1 A2b aB1"
    assert table.text(15) == "name   contacts\ndelta  A2B1 A2b\n       aB1"
    assert table.text(12) == "name\n  delta\ncontacts\n  A2B1 A2b\n  aB1"


@given(tables())
def test_sheets_are_values(table):
    sheet = Sheet("title", (table, "words"))
    assert pickle.loads(pickle.dumps(sheet)) == sheet


def test_zero_has_no_sign():
    assert number(-0.0) == "0"


@pytest.mark.parametrize("turns", [1, 2, 3])
def test_angles_are_circles_of_a_turn_or_a_part_of_it(turns):
    assert titled("a", 2 * math.pi / turns) == "a (rad)"
    assert titled("a", 1.0 / turns) == "a"
    assert titled("a", 360.0 / turns) == "a"


# ------------------------------------------------------------------- what users print

M = Manifold(("x", "phi"), periods=(math.inf, math.tau))
X, PHI = M.symbols
BUMP = 2 - 2 * sympy.cos(PHI)
D = Polyhedron(M, {ODD: X, "wall": X - BUMP})
PAIR = DumbbellPair(length=16, ball_radius=3, rod_radius=1.5, drum_radius=125)


def bowl():
    plane = Manifold.euclidean("x y")
    x, y = plane.symbols
    return Polyhedron(plane, {"bowl": y - x**2, "lid": 2 - y}), x + y


def printed():
    region, energy = bowl()
    corner = minimise(PAIR.polyhedron, PAIR.energy, PAIR.nested("R"))
    yield "certificate", corner
    yield "dependent", certify(D, X + BUMP, [0.0, 0.0])
    yield "stratum", stratum_at(PAIR.polyhedron, corner.point)
    yield "skeleton", skeleton(region, [[0.0, 1.0]])
    yield "minima", minima(region, energy, starts=20, box=[(-2, 2), (0, 2)])
    yield "proof", prove(minimise(region, energy, [1.0, 1.5]), digits=5)
    yield "unproved", prove(certify(region, energy, [0.0, 0.0]))
    yield "sensitivity", sensitivity(corner, ["t"])


@pytest.fixture(scope="module")
def shown():
    return dict(printed())


KINDS = (
    "certificate",
    "dependent",
    "stratum",
    "skeleton",
    "minima",
    "proof",
    "unproved",
    "sensitivity",
)


@pytest.mark.parametrize("kind", KINDS)
def test_text_and_html_say_the_same(shown, kind):
    text, read = str(shown[kind]), Reader(shown[kind]._repr_html_())
    words = text.split()
    for row in read.rows:
        for cell in row:
            assert all(word in words for word in cell.split())
    told = " ".join(read.words).split()
    assert all(word in words for word in told)
    assert len(words) == len(told) + sum(len(cell.split()) for row in read.rows for cell in row)


@pytest.mark.parametrize("kind", KINDS)
def test_html_has_no_colours_scripts_or_resources(shown, kind):
    read = Reader(shown[kind]._repr_html_())
    plain = {"div", "p", "strong", "table", "caption", "thead", "tbody", "tr", "th", "td"}
    assert read.tags <= plain
    assert read.attributes <= {"style", "scope"}
    styles = {side for row in read.sides for side in row}
    assert styles <= {"text-align: left", "text-align: right"}


@pytest.mark.parametrize("kind", KINDS)
def test_repr_is_one_short_line(shown, kind):
    line = repr(shown[kind])
    assert "\n" not in line
    assert len(line) < 250
    assert line.startswith(type(shown[kind]).__name__)


def test_names_are_escaped(shown):
    html = shown["dependent"]._repr_html_()
    assert "<b>" not in html
    assert any(ODD in cell for row in Reader(html).rows for cell in row)


def test_a_point_is_told_in_radians_and_degrees(shown):
    lines = [line.split() for line in str(shown["certificate"]).splitlines()]
    manifold = PAIR.manifold
    for name, value, period in zip(
        manifold.names, shown["certificate"].point, manifold.periods, strict=True
    ):
        (row,) = [words for words in lines if words[:1] == [name] and len(words) > 1]
        assert float(row[1]) == pytest.approx(value, rel=1e-8)
        if period < math.inf:
            assert row[2] == "rad"
            assert float(row[3]) == pytest.approx(np.degrees(value), abs=1e-6)
            assert row[4] == "deg"
        else:
            assert len(row) == 2


def test_multipliers_that_are_not_unique_come_with_their_range(shown):
    c = shown["dependent"]
    lines = [line.split() for line in str(c).splitlines()]
    for name, (low, high) in c.multiplier_ranges.items():
        (row,) = [words for words in lines if words[0:1] == [name] and len(words) == 5]
        assert [float(word) for word in row[3:]] == pytest.approx([low, high], rel=1e-6, abs=1e-9)


def test_a_skeleton_lists_its_corners_and_edges(shown):
    found = shown["skeleton"]
    text = str(found)
    for corner in found.corners:
        assert all(number(x, 6) in text for x in corner.point)
    for edge in found.edges:
        assert number(edge.length, 6) in text
    assert found.complete.value in text
