"""Pages for films and atlases of dumbbells, complete in themselves."""

from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.colors import to_hex

from polycorner.dumbbells.pictures.bodies import box_of, sizes_of
from polycorner.dumbbells.pictures.film import Film
from polycorner.dumbbells.pictures.scenes import atlas_scene, glb
from polycorner.dumbbells.pictures.symbols import HANDS, KIND_WORDS, KINDS, WORDS
from polycorner.dumbbells.statics.skeleton import PairAtlas
from polycorner.toolkit import checked, html_page, packed, packed_contacts, write_atomically

CELLS = 48  # of an atlas's solid along each axis


@checked
def film_page(film: Film) -> str:
    """Return the HTML page that plays a film."""
    scripts = [own_file("dumbbells.js")]
    plays = len(film) > 1
    return html_page(film.title, film.note, film_data(film), plays=plays, scripts=scripts)


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
    return html_page("The forbidden solid", note, data, plays=False)


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


def own_file(name: str) -> str:
    """Return a script or a template of this package."""
    return files("polycorner.dumbbells.viewer").joinpath("assets", name).read_text("utf-8")


# ----------------------------------------------------------------------------------- the numbers


def film_data(film: Film) -> dict[str, Any]:
    """Return a film for JSON, its numbers packed; ``film.js`` unpacks them."""
    words = sorted(set(film.words), key=lambda w: (w.stratum, w.chirality))
    places = [place for closed in film.contacts for place in closed.values()]
    return {
        "stage": "dumbbells",
        "labels": ["Stratum", "Chirality"],
        "unit": film.unit,
        "mark": film.pair.ball_radius,
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
        "contacts": packed_contacts(film.contacts, places),
    }
