"""Messages of the live page: values in range are understood, everything else is refused."""

import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from polycorner.dumbbells import DumbbellPair
from polycorner.dumbbells.viewer.board import Board
from polycorner.dumbbells.viewer.sliders import (
    BUTTONS,
    MESSAGE,
    RefusedError,
    coordinates,
    parsed,
    sliders_for,
)

DRUM, PLANE = DumbbellPair(16, 3, 1.5, 125), DumbbellPair(16, 3, 1.5)
SLIDERS = sliders_for(DRUM, 125.0)
BOARDS = {pair: Board.of(pair) for pair in (DRUM, PLANE)}


@given(
    st.dictionaries(
        st.sampled_from(sorted(SLIDERS)), st.floats(0, 1), min_size=1, max_size=len(SLIDERS)
    )
)
def test_every_value_in_range_is_understood_and_comes_back(shares):
    values = {
        name: SLIDERS[name].low + share * (SLIDERS[name].high - SLIDERS[name].low)
        for name, share in shares.items()
    }
    assert parsed(json.dumps(values), SLIDERS) == values
    placed = {name: value for name, value in values.items() if name in coordinates()}
    for board in BOARDS.values():
        shown = board.moved(placed).values
        for name, value in placed.items():
            apart = shown[name] - value
            assert abs(math.remainder(apart, 360.0) if "heading" in name else apart) < 1e-9


def test_all_sliders_fit_in_one_message():
    longest = {name: -1 / 3 * slider.high for name, slider in SLIDERS.items()}
    assert len(json.dumps(longest)) < MESSAGE


@pytest.mark.parametrize("button", [name for name, _ in BUTTONS])
def test_buttons_are_understood(button):
    assert parsed(json.dumps(button), SLIDERS) == button


@pytest.mark.parametrize(
    "message",
    [
        "",
        "fall",  # not JSON
        '"delete"',
        "[]",
        "{}",
        "null",
        "3",
        '["fall"]',
        '{"fall": 1}',
        '{"heading_A": "1"}',
        '{"heading_A": true}',
        '{"heading_A": null}',
        '{"heading_A": NaN}',
        '{"heading_A": Infinity}',
        '{"heading_A": 1e999}',
        '{"heading_A": 180.5}',
        '{"rod_radius": 0}',
        '{"heading_A": 1, "file": "/etc/passwd"}',
        '{"heading_A": ' + "9" * 400 + "}",
        "[" * 500,
        '{"heading_A": [1]}',
        '{"__class__": 1}',
    ],
)
def test_everything_else_is_refused(message):
    with pytest.raises(RefusedError, match=r"^([a-zA-Z_]+: )?expected [a-zA-Z]"):
        parsed(message, SLIDERS)
