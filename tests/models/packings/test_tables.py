"""Tables of coordinates: every kind that is published, all digits, and damaged ones."""

from fractions import Fraction

import numpy as np
import pytest

from polycorner.models import CirclesIn, read_coordinates

ROWS = ((Fraction(-1, 4), Fraction(1, 10)), (Fraction(1, 4), Fraction(2)))
KINDS = {
    "white space": "-0.25 0.1\n0.25 2\n",
    "an index": "  1  -.25   1e-1\n  2   +.25\t2.0\n",
    "an index from 0": "0 -0.25 0.1\n1 0.25 2\n",
    "commas": "-0.25,0.1\n0.25,2\n",
    "commas and white space": "-0.25 , 0.1\n0.25,  2\n",
    "separators at the end": "-0.25,0.1,\n0.25,2,\n",
    "semicolons": "-0.25;0.1\n0.25;2\n",
    "a header": "index,x,y\n1,-0.25,0.1\n2,0.25,2\n",
    "a header of words": "x y\n-0.25 0.1\n0.25 2\n",
    "a count": "2\n-0.25 0.1\n0.25 2\n",
    "a count and an index": "2\n1 -0.25 0.1\n2 0.25 2\n",
    "comments": "# best known\n% x y\n-0.25 0.1  // first\n\n! second\n0.25 2\n",
    "Fortran": "-0.25D0 1.0d-1\n2.5E-01 0.2D+01\n",
    "lines of Windows": "-0.25 0.1\r\n0.25 2\r\n",
}


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_table_is_read(kind, tmp_path):
    text = KINDS[kind]
    assert read_coordinates(text).rows == ROWS
    path = tmp_path / "table.txt"
    for start in (b"", b"\xef\xbb\xbf"):  # the second is what some editors put in front
        path.write_bytes(start + text.encode())
        assert read_coordinates(path).rows == ROWS
        assert read_coordinates(str(path)).rows == ROWS
    assert read_coordinates(text, columns=2).rows == ROWS


def test_all_digits_are_kept():
    written = "0.148204322565228798668007362743"
    (row, _) = read_coordinates(f"{written} 0\n1 2\n").rows
    assert row[0] == Fraction(int(written[2:]), 10 ** len(written[2:]))
    assert float(row[0]) != row[0]


def test_floats_are_the_nearest():
    table = read_coordinates("0.1 0.2\n0.3 1e-300\n")
    assert table.floats.tolist() == [[0.1, 0.2], [0.3, 1e-300]]
    assert np.asarray(table).tolist() == table.floats.tolist()
    assert len(table) == 2


def test_a_column_that_only_looks_like_an_index_can_be_kept():
    text = "1 5\n2 7\n"
    assert read_coordinates(text).floats.tolist() == [[5.0], [7.0]]
    assert read_coordinates(text, columns=2).floats.tolist() == [[1.0, 5.0], [2.0, 7.0]]
    assert read_coordinates(text, index=False).floats.tolist() == [[1.0, 5.0], [2.0, 7.0]]
    assert read_coordinates("3 5\n4 7\n", index=True).floats.tolist() == [[5.0], [7.0]]


def test_columns_are_taken_out_with_their_names():
    table = read_coordinates("index,x,y,r\n1,0.25,0.5,0.1\n2,0.75,0.5,0.1\n")
    assert table.names == ("x", "y", "r")
    centres = table.part(0, 2)
    assert (centres.names, centres.rows[0]) == (("x", "y"), (Fraction(1, 4), Fraction(1, 2)))
    assert CirclesIn("square", 2).point(centres)[-1] == pytest.approx(0.25)
    with pytest.raises(ValueError, match=r"^start, stop: expected "):
        table.part(1, 4)


@pytest.mark.parametrize(
    ("text", "line", "expected"),
    [
        ("1 0.5 0.5\n2 0.5\n", 2, "3 numbers"),
        ("0.5 0.5\n# and\n0.5 0.5 0.5\n", 3, "2 numbers"),
        ("0.5 0.5\n0.5 O.5\n", 2, "decimal numbers"),
        ("0.5 nan\n0.5 0.5\n", 1, "decimal numbers"),
        ("0.5 0x10\n0.5 0.5\n", 1, "decimal numbers"),
        ("0.5 1_0\n0.5 0.5\n", 1, "decimal numbers"),
        ("0.5 \u0661\n0.5 0.5\n", 1, "decimal numbers"),
        ("0.5 1/3\n0.5 0.5\n", 1, "decimal numbers"),
        ("0.5,,0.5\n0.5 0.5\n", 1, "decimal numbers"),
        ("0.5 1e99999\n0.5 0.5\n", 1, "decimal numbers"),
        ("0.5 1e400\n0.5 0.5\n", 1, "numbers in the range of doubles; got '1e400'"),
        ("0.5 " + "1" * 2000 + "\n0.5 0.5\n", 1, "decimal numbers"),
        ("3\n0.5 0.5\n0.5 0.5\n", 1, "the number of lines"),
    ],
)
def test_damaged_lines_are_named(text, line, expected):
    with pytest.raises(ValueError, match=rf"^table: line {line}: expected .*{expected}"):
        read_coordinates(text)


def test_an_empty_text_is_refused():
    with pytest.raises(ValueError, match=r"^table: expected a file, or a text of several lines"):
        read_coordinates("")


@pytest.mark.parametrize("text", ["\n", "# nothing\n", "x y\n"])
def test_a_table_without_numbers_is_refused(text):
    with pytest.raises(ValueError, match=r"^table: expected a line of numbers"):
        read_coordinates(text)


def test_other_numbers_of_columns_are_refused():
    with pytest.raises(ValueError, match=r"line 1: expected 3 coordinates; got 2"):
        read_coordinates("1 0.5 0.5\n2 0.5 0.5\n", columns=3, index=True)
    with pytest.raises(ValueError, match="beside the index"):
        read_coordinates("1\n2\n", index=True)


def test_bytes_that_are_no_text_are_refused(tmp_path):
    path = tmp_path / "table.txt"
    path.write_bytes(b"\xff\xfe0.5 0.5")
    with pytest.raises(ValueError, match=r"^table: expected text in UTF-8"):
        read_coordinates(path)
    with pytest.raises(FileNotFoundError):
        read_coordinates(tmp_path / "none.txt")
