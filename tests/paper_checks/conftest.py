"""Fixtures for the tests of the paper's figures."""

import pytest

from paper_checks.figures import FIGURES


@pytest.fixture(scope="session")
def drawn():
    """Return a function that draws a figure once."""
    kept = {}

    def draw(name):
        if name not in kept:
            kept[name] = FIGURES[name].draw()
        return kept[name]

    return draw
