"""Self-contained HTML pages of scenes and films.

A page contains three.js (from trimesh's viewer), our scripts and the data.  Its content security
policy allows these scripts by their hashes and forbids every request.
"""

import base64
import gzip
import hashlib
import io
import json
import zipfile
from collections.abc import Iterable, Mapping
from functools import cache
from html import escape
from importlib.resources import files
from string import Template
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from polycorner.errors import PolycornerError

END_OF_LIBRARY = "THREE.GLTFLoader=GLTFLoader;})();"  # trimesh's own page follows
KEYS = " Space plays, ← and → step, Home and End go to the ends."
TURNED = "Drag to turn, wheel or pinch to zoom, right button or two fingers to move."
MOVED = "Drag to move, wheel or pinch to zoom."


def page_file(name: str) -> str:
    """Return a script, a style sheet or a template of pages."""
    return files("polycorner.pictures").joinpath("assets", name).read_text("utf-8")


@cache
def three_script() -> str:
    """Return three.js with its trackball and its reader of GLB files, from trimesh's viewer.

    Raises
    ------
    PolycornerError
        If the installed trimesh does not contain it in this form.
    """
    import trimesh

    library: Any = trimesh
    try:
        packed_viewer = library.resources.get_bytes("templates/viewer.zip")
        with zipfile.ZipFile(io.BytesIO(packed_viewer)) as archive:
            text = archive.read("viewer.html.template").decode("utf-8")
        start = text.index("<script>") + len("<script>")
        script = text[start : text.index(END_OF_LIBRARY, start) + len(END_OF_LIBRARY)]
        if "THREE.TrackballControls" not in script or "</script" in script:
            raise ValueError
    except (AttributeError, KeyError, OSError, ValueError, zipfile.BadZipFile) as error:
        msg = (
            "three.js: expected it in templates/viewer.zip of trimesh, as in versions 4.5 to 5.2; "
            f"got trimesh {library.__version__} without it"
        )
        raise PolycornerError(msg) from error
    return script


def html_page(
    title: str,
    note: str,
    data: Mapping[str, Any],
    *,
    plays: bool,
    flat: bool = False,
    scripts: Iterable[str] = (),
) -> str:
    """Return a page that shows data in JSON, by ``film.js``.

    Parameters
    ----------
    title, note : str
        A heading, and a sentence of description.
    data : mapping
        What ``film.js`` expects: a film, or the model of a scene with its legend.
    plays : bool
        Whether there is more than one instant.
    flat : bool, optional
        Whether the picture is of the plane, and is not turned.
    scripts : iterable of str, optional
        Scripts of an application, after ``stage.js``.
    """
    every = [three_script(), page_file("stage.js"), *scripts, page_file("film.js")]
    style = page_file("page.css")
    policy = (
        f"default-src 'none'; script-src {_hashes(every)}; style-src {_hashes([style])};"
        " img-src data:; base-uri 'none'; form-action 'none'"
    )
    # In a block of data only "<" needs escaping: it could end the block.
    block = json.dumps(data, ensure_ascii=False, allow_nan=False).replace("<", "\\u003c")
    return Template(page_file("film.html")).substitute(
        policy=policy, style=style, title=escape(title), note=escape(note), data=block,
        keys=KEYS if plays else "", hint=MOVED if flat else TURNED,
        scripts="\n".join(f"<script>{script}</script>" for script in every),
    )  # fmt: skip


def _hashes(texts: Iterable[str]) -> str:
    digests = (hashlib.sha256(text.encode()).digest() for text in texts)
    return " ".join(f"'sha256-{base64.b64encode(digest).decode()}'" for digest in digests)


def packed(values: ArrayLike | bytes) -> str:
    """Return the bytes of an array, or bytes, compressed with gzip, in base64."""
    content = values if isinstance(values, bytes) else np.asarray(values).tobytes()
    return base64.b64encode(gzip.compress(content, mtime=0)).decode()


def packed_contacts(names: Iterable[Iterable[str]], places: Iterable[ArrayLike]) -> dict[str, Any]:
    """Return the contacts of each instant, by name, and their points ``(3,)``, for ``film.js``."""
    every = [list(closed) for closed in names]
    known = sorted({name for closed in every for name in closed})
    number = {name: k for k, name in enumerate(known)}
    which = np.array([number[name] for closed in every for name in closed], "<u4")
    return {
        "names": known,
        "which": packed(which),
        "first": packed(np.cumsum([0, *map(len, every)], dtype="<u4")),
        "places": packed(np.asarray([*places], "<f4")),
    }
