"""Links in docstrings: by the public name, whichever file the object lives in.

A name that stands for an object without a page of its own is shown as it is; a name that stands
for nothing is left to Sphinx, which complains.
"""

import re
from collections.abc import Iterator
from typing import Any

# Every package with public names, the root first.
ROOMS = (
    "polycorner",
    "polycorner.spaces",
    "polycorner.formulas",
    "polycorner.polyhedra",
    "polycorner.skeletons",
    "polycorner.minimisation",
    "polycorner.proofs",
    "polycorner.landscapes",
    "polycorner.branches",
    "polycorner.measures",
    "polycorner.motion",
    "polycorner.bodies",
    "polycorner.models",
    "polycorner.files",
    "polycorner.sweeps",
    "polycorner.pictures",
    "polycorner.dumbbells",
    "polycorner.dumbbells.pictures",
    "polycorner.dumbbells.viewer",
)

DOCSTRING = re.compile(r"docstring of ([\w.]+)")


def found(target: str) -> Any:
    """Return the object of a full name, None if there is none."""
    from importlib import import_module

    parts = target.split(".")
    for cut in range(len(parts), 0, -1):
        try:
            thing = import_module(".".join(parts[:cut]))
        except ImportError:
            continue
        for name in parts[cut:]:
            thing = getattr(thing, name, None)
        return thing
    return None


def public_name(target: str) -> str | None:
    """Return ``polycorner.skeleton`` for ``polycorner.skeletons.search.skeleton``, else None."""
    name = target.rpartition(".")[2]
    for room in ROOMS:
        if name in found(room).__all__ and found(f"{room}.{name}") is found(target):
            return f"{room}.{name}"
    return None


def meanings(target: str, source: str) -> Iterator[str]:
    """Yield the full names that a name may stand for where a docstring uses it."""
    yield target
    inside = DOCSTRING.search(source)
    parts = inside[1].split(".") if inside else []
    for cut in range(len(parts), 0, -1):
        yield ".".join([*parts[:cut], target])


def resolve(app: Any, environment: Any, node: Any, content: Any) -> Any:
    """Return a link to the public name, or the bare text for what is described in the source."""
    from sphinx.util.nodes import get_node_source

    known = meanings(node["reftarget"], get_node_source(node) or "")
    target = next((name for name in known if name.startswith("polycorner.") and found(name)), None)
    if target is None:
        return None
    name = public_name(target)
    domain = environment.domains["py"]
    link = name and domain.resolve_xref(
        environment, node["refdoc"], app.builder, node["reftype"], name, node, content
    )
    return link or content


def setup(app: Any) -> dict[str, bool]:
    """Ask when a name has not been found."""
    app.connect("missing-reference", resolve)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
