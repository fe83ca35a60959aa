"""Self-contained HTML pages for films and atlases.

A page contains three.js (from trimesh's viewer), our scripts and the data.  Its content security
policy allows these scripts by their hashes and forbids every request.
"""

import base64
import gzip
import hashlib
import io
import json
import zipfile
from collections.abc import Iterable
from functools import cache
from html import escape
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import Any

import numpy as np
from matplotlib.colors import to_hex
from numpy.typing import ArrayLike

from polycorner import PolycornerError
from polycorner.dumbbells.pictures.bodies import box_of, sizes_of
from polycorner.dumbbells.pictures.film import Film
from polycorner.dumbbells.pictures.scenes import atlas_scene, glb, library
from polycorner.dumbbells.pictures.symbols import HANDS, KIND_WORDS, KINDS, WORDS
from polycorner.dumbbells.statics.skeleton import PairAtlas
from polycorner.toolkit import checked, write_atomically

END_OF_LIBRARY = "THREE.GLTFLoader=GLTFLoader;})();"  # trimesh's own page follows
KEYS = " Space plays, ← and → step, Home and End go to the ends."
CELLS = 48  # of an atlas's solid along each axis


@checked
def film_page(film: Film) -> str:
    """Return the HTML page that plays a film."""
    keys = KEYS if len(film) > 1 else ""
    return _page(film.title, film.note, film_data(film), keys)


@checked
def atlas_page(atlas: PairAtlas, *, resolution: int = CELLS) -> str:
    """Return the HTML page of the forbidden solid of a pair with its edges and corners."""
    pair = atlas.pair
    where = "in the plane" if atlas.heading is None else f"in a drum, R = {pair.drum_radius:g} mm"
    data = {
        "model": packed(glb(atlas_scene(atlas, resolution=resolution))),
        "legend": [
            ["Corners", [[WORDS[h], to_hex(HANDS[h])] for h in _hands(atlas)]],
            ["Edges", [[words, to_hex(KINDS[kind])] for kind, words in KIND_WORDS.items()]],
        ],
    }
    note = (
        f"Where two dumbbells (l = {pair.length:g}, r = {pair.ball_radius:g}, "
        f"t = {pair.rod_radius:g} mm) {where} overlap: relative positions x and y in mm, and the "
        f"relative heading, a radian drawn as long as l/2."
    )
    return _page("The forbidden solid", note, data, "")


def _hands(atlas: PairAtlas) -> list[str]:
    found = {corner.chirality or "N" for corner in atlas.skeleton.corners}
    return [hand for hand in HANDS if hand in found]


@checked
def write_page(page: str, path: Path) -> Path:
    """Write a page as ``.html``, whole or not at all, and return the path; folders are made.

    Raises
    ------
    ValueError
        For another suffix.
    OSError
        If it cannot be written.
    """
    return write_atomically(path, page, suffix=".html")


# ----------------------------------------------------------------------------------- the scripts


def page_file(name: str) -> str:
    """Return a script, a style sheet or a template of this package."""
    return files("polycorner.dumbbells.viewer").joinpath("assets", name).read_text("utf-8")


@cache
def three_script() -> str:
    """Return three.js with its trackball and its reader of GLB files, from trimesh's viewer.

    Raises
    ------
    PolycornerError
        If the installed trimesh does not contain it in this form.
    """
    try:
        packed_viewer = library().resources.get_bytes("templates/viewer.zip")
        with zipfile.ZipFile(io.BytesIO(packed_viewer)) as archive:
            text = archive.read("viewer.html.template").decode("utf-8")
        start = text.index("<script>") + len("<script>")
        script = text[start : text.index(END_OF_LIBRARY, start) + len(END_OF_LIBRARY)]
        if "THREE.TrackballControls" not in script or "</script" in script:
            raise ValueError
    except (AttributeError, KeyError, OSError, ValueError, zipfile.BadZipFile) as error:
        msg = (
            "three.js: expected it in templates/viewer.zip of trimesh, as in versions 4.5 to 5.2; "
            f"got trimesh {library().__version__} without it"
        )
        raise PolycornerError(msg) from error
    return script


def _page(title: str, note: str, data: dict[str, Any], keys: str) -> str:
    scripts = {
        "three": three_script(),
        "scene": page_file("stage.js"),
        "player": page_file("film.js"),
    }
    style = page_file("page.css")
    policy = (
        f"default-src 'none'; script-src {_hashes(scripts.values())}; style-src {_hashes([style])};"
        " img-src data:; base-uri 'none'; form-action 'none'"
    )
    # In a block of data only "<" needs escaping: it could end the block.
    block = json.dumps(data, ensure_ascii=False, allow_nan=False).replace("<", "\\u003c")
    return Template(page_file("film.html")).substitute(
        scripts, policy=policy, style=style, title=escape(title), note=escape(note), data=block,
        keys=keys,
    )  # fmt: skip


def _hashes(texts: Iterable[str]) -> str:
    digests = (hashlib.sha256(text.encode()).digest() for text in texts)
    return " ".join(f"'sha256-{base64.b64encode(digest).decode()}'" for digest in digests)


# ----------------------------------------------------------------------------------- the numbers


def film_data(film: Film) -> dict[str, Any]:
    """Return a film for JSON, its numbers packed; ``film.js`` unpacks them."""
    names = sorted({name for closed in film.contacts for name in closed})
    words = sorted(set(film.words), key=lambda w: (w.stratum, w.chirality))
    places = [place for closed in film.contacts for place in closed.values()]
    return {
        "unit": film.unit,
        "count": film.centres.shape[1],
        "spin": film.spin,
        "sizes": sizes_of(film.pair),
        "wall": film.wall.description,
        "box": box_of(film.pair, film.centres),
        "times": packed(np.asarray(film.times, "<f4")),
        "centres": packed(np.asarray(film.centres, "<f4")),
        "roles": packed(np.asarray(film.roles, "<u1")),
        "energies": [[k, packed(np.asarray(v, "<f8"))] for k, v in film.energies.items()],
        "words": [[w.stratum, w.chirality] for w in words],
        "word": packed(np.array([words.index(w) for w in film.words], "<u4")),
        "contacts": {
            "names": names,
            "which": packed(_whole(names.index(n) for closed in film.contacts for n in closed)),
            "first": packed(np.cumsum([0, *(len(c) for c in film.contacts)], dtype="<u4")),
            "places": packed(np.asarray(places, "<f4")),
        },
    }


def _whole(values: Iterable[int]) -> ArrayLike:
    return np.fromiter(values, "<u4")


def packed(values: ArrayLike | bytes) -> str:
    """Return the bytes of an array, or bytes, compressed with gzip, in base64."""
    content = values if isinstance(values, bytes) else np.asarray(values).tobytes()
    return base64.b64encode(gzip.compress(content, mtime=0)).decode()
