"""Blocks of code end with their last line, although a doctest in Markdown needs an empty one."""

from typing import Any


def trim(_app: Any, document: Any) -> None:
    """Take empty lines off the ends of all blocks of code."""
    from docutils import nodes

    for block in document.findall(nodes.literal_block):
        text = block.astext().rstrip()
        if block.rawsource == block.astext():
            block.rawsource = text  # what Sphinx compares to tell code from parsed text
            block[:] = [nodes.Text(text)]


def setup(app: Any) -> dict[str, bool]:
    """Trim every page once it is read."""
    app.connect("doctree-read", trim)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
