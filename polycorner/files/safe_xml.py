"""XML of others: no document types, entities or network, and places for errors."""

import math
import re
from typing import Any

from polycorner.checks import refuse


def parsed(about: str, data: bytes) -> Any:
    """Return the root of an XML file, without comments and processing instructions.

    Raises
    ------
    ValueError
        With the line, for what is no XML, has a document type, or entities.
    """
    from lxml import etree

    parser = etree.XMLParser(
        resolve_entities=False,
        no_network=True,
        load_dtd=False,
        huge_tree=False,
        remove_comments=True,
        remove_pis=True,
    )
    # Files of PyBullet declare the version 0.0, and others begin with an empty line.
    if declared := re.match(rb"(\xef\xbb\xbf)?\s*<\?xml[^>]*\?>", data):
        encoding = re.search(rb"encoding\s*=\s*[\"']([\w-]+)", declared[0])
        if encoding is None or encoding[1].lower() in {b"utf-8", b"ascii", b"us-ascii"}:
            data = b"\n" * declared[0].count(b"\n") + data[declared.end() :]
    try:
        root = etree.fromstring(data, parser)
    except etree.XMLSyntaxError as error:
        msg = f"{about}: line {error.lineno}: expected XML; got {error.msg}"
        raise ValueError(msg) from error
    if root.getroottree().docinfo.doctype:
        refuse(about, "no document type, whose entities could be anything", "one")
    for element in root.iter():
        if not isinstance(element.tag, str):
            refuse(place_of(about, element), "no entities", str(element))
    return root


def tag_of(element: Any) -> str:
    """Return the tag of an element without its namespace."""
    return str(element.tag).rpartition("}")[2]


def place_of(about: str, element: Any) -> str:
    """Return where an element is, for errors."""
    return f"{about}: line {element.sourceline}: <{tag_of(element)}>"


def is_finite(word: str) -> bool:
    """Whether a word is a finite number."""
    try:
        return math.isfinite(float(word)) and "_" not in word
    except ValueError:
        return False
