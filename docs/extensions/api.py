"""The page of the API, written from the public names that each package declares."""

from importlib import import_module
from pathlib import Path
from typing import Any

from docs.extensions.homes import ROOMS

PAGE = "api.rst"
HEAD = """\
API
===

Every public name, under the package that declares it.  The most common ones are also in
``polycorner`` itself and are shown by that name.

"""


def page() -> str:
    """Return the page as reStructuredText."""
    root, *rooms = (import_module(room) for room in ROOMS)
    shown: set[str] = set()
    sections = [HEAD]
    for room in rooms:
        common = [name for name in room.__all__ if name in root.__all__ and name not in shown]
        others = [name for name in room.__all__ if name not in root.__all__]
        shown.update(common)
        sections.append(_section(room, {root.__name__: common, room.__name__: others}))
    rest = [name for name in root.__all__ if name not in shown]
    sections.append(_section(import_module("polycorner.errors"), {root.__name__: rest}))
    return "\n".join(sections)


def _section(room: Any, names: dict[str, list[str]]) -> str:
    title = room.__name__.removeprefix("polycorner.")
    summary = (room.__doc__ or "").split("\n\n")[0]
    lines = [title, "-" * len(title), "", summary, ""]
    for package, listed in names.items():
        if listed:
            lines += [f".. currentmodule:: {package}", "", ".. autosummary::"]
            lines += ["   :toctree: generated", "", *(f"   {name}" for name in listed), ""]
    return "\n".join(lines)


def write(app: Any, _config: Any) -> None:
    """Write the page before Sphinx looks for its sources."""
    file = Path(app.srcdir) / PAGE
    text = page()
    if not file.exists() or file.read_text() != text:
        file.write_text(text)


def setup(app: Any) -> dict[str, bool]:
    """Write the page once the configuration is read."""
    app.connect("config-inited", write)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
