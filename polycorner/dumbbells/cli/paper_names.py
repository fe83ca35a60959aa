"""Ids of claims and names of figures, read from the sources of the checks without importing them.

Importing the checks takes seconds; completing or refusing a name must not.
"""

import re
from collections.abc import Iterable, Iterator
from importlib.util import find_spec
from pathlib import Path

from polycorner.cli.output import fail
from polycorner.errors import nearest

ID = re.compile(r'\bClaim\(\s*"(\w+)",\s*"(\w+)"')  # and the section
FIGURE = re.compile(r'\bFigure\(\s*"(\w+)"')


def claim_ids() -> list[str]:
    """Return the ids of all claims and, as ``E4`` for ``E4a`` and ``E4b``, of their groups."""
    ids = [found[0] for source in _sources() for found in ID.findall(source)]
    return sorted({*ids, *map(_group, ids)}, key=_order)


def sections() -> list[str]:
    """Return the sections and appendices of the paper that claims belong to."""
    return sorted({found[1] for source in _sources() for found in ID.findall(source)})


def figure_names() -> list[str]:
    """Return the names of all figures."""
    return sorted(name for source in _sources("figures") for name in FIGURE.findall(source))


def check_names(what: str, given: Iterable[str], known: list[str]) -> None:
    """End the command at the first name that is not known."""
    for name in given:
        if name not in known:
            fail(f"{what}; got {nearest(name, known)}")


def _group(name: str) -> str:
    return name.rstrip("abcdefghijklmnopqrstuvwxyz")


def _order(name: str) -> tuple[str, int, str]:
    number = "".join(filter(str.isdigit, name))
    letter, _, part = name.partition(number)
    return letter, int(number), part


def _sources(folder: str = "") -> Iterator[str]:
    spec = find_spec("paper_checks")
    for place in (spec.submodule_search_locations or ()) if spec else ():
        for file in sorted((Path(place) / folder).rglob("*.py")):
            yield file.read_text(encoding="utf-8")
