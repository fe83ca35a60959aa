"""Saving and loading what was computed, so that it can be gone on with."""

import json
import os
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from polycorner.polyhedra.assembly import assembled
from polycorner.polyhedra.atlas import Completeness, Skeleton
from polycorner.polyhedra.curves import Ground
from polycorner.polyhedra.explorer import Curve, Explorer
from polycorner.polyhedra.faces import Flag, Passage
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.polyhedra.symmetry import Symmetry
from polycorner.polyhedra.walks import End

VERSION = 1


def save_atlas(atlas: Skeleton, path: str | os.PathLike[str], *, label: str = "") -> Path:
    """Write an atlas, finished or not, as JSON; the file appears whole or not at all.

    Parameters
    ----------
    atlas : Skeleton
        What :func:`~polycorner.polyhedra.skeleton.skeleton` returned.
    path : path
        The file; its folder is made if need be.
    label : str, optional
        What the search is called; :func:`load_atlas` can insist on it.

    Returns
    -------
    Path
    """
    explorer: Explorer = atlas.state
    content = {
        "polycorner atlas": VERSION,
        "label": label,
        "functions": list(atlas.polyhedron.names),
        "complete": atlas.complete.name,
        "tolerance": explorer.ground.tolerance,
        "extent": explorer.ground.extent,
        "corners": [place.spot.q.tolist() for place in explorer.places],
        "ends": [[[ray, edge] for ray, edge in p.edges.items()] for p in explorer.places],
        "curves": [_curve(curve) for curve in explorer.curves],
        "passages": [[_flag(p.start), _flag(p.stop)] for p in explorer.passages],
        "seeds": [[number, seed.tolist()] for number, seed in explorer.seeds],
        "pending": list(explorer.pending),
        "shot": [[edge, sorted(face)] for edge, face in explorer.shot],
        "notes": explorer.notes,
        "lost": explorer.register.lost,
        "random": explorer.rng.bit_generator.state,
    }
    target = Path(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=target.parent, suffix=".part")
    with os.fdopen(handle, "w", encoding="utf-8") as file:
        json.dump(content, file)
    Path(name).replace(target)
    return target


def load_atlas(
    path: str | os.PathLike[str],
    polyhedron: Polyhedron,
    *,
    symmetry: Symmetry | None = None,
    label: str | None = None,
) -> Skeleton:
    """Read an atlas back; :func:`~polycorner.polyhedra.skeleton.resume` goes on with it.

    Parameters
    ----------
    path : path
        A file that :func:`save_atlas` wrote.
    polyhedron, symmetry
        Those it was computed for: formulas are not in the file.
    label : str, optional
        What the search must be called.

    Raises
    ------
    ValueError
        If the file is no atlas, or one of a polyhedron with other functions.
    """
    try:
        content = json.loads(Path(path).read_text(encoding="utf-8"))
    except (UnicodeDecodeError, json.JSONDecodeError) as error:
        msg = f"path: expected an atlas that save_atlas wrote; {path} is no JSON ({error})"
        raise ValueError(msg) from error
    if not isinstance(content, dict) or content.get("polycorner atlas") != VERSION:
        msg = f"path: expected an atlas that save_atlas wrote; {path} is something else"
        raise ValueError(msg)
    if label is not None and content.get("label") != label:
        msg = f"path: expected an atlas called {label!r}; {path} is called {content.get('label')!r}"
        raise ValueError(msg)
    if content.get("functions") != list(polyhedron.names):
        msg = f"path: expected an atlas of {', '.join(polyhedron.names)}; {path} has others"
        raise ValueError(msg)
    try:
        return _restored(content, polyhedron, symmetry or Symmetry())
    except (AttributeError, IndexError, KeyError, TypeError, ValueError) as error:
        msg = f"path: expected an atlas that save_atlas wrote; {path} is damaged ({error!r})"
        raise ValueError(msg) from error


def _restored(content: dict[str, Any], polyhedron: Polyhedron, symmetry: Symmetry) -> Skeleton:
    ground = Ground(polyhedron, symmetry, content["tolerance"], content["extent"])
    rng = np.random.default_rng()
    rng.bit_generator.state = content["random"]
    explorer = Explorer(ground, [], rng)
    _fill(explorer, content)
    return assembled(explorer, Completeness[content["complete"]])


def _fill(explorer: Explorer, content: dict[str, Any]) -> None:
    for point in content["corners"]:
        explorer.register.restore(np.array(point))
    for place, ends in zip(explorer.places, content["ends"], strict=True):
        place.edges.update(dict(ends))
    explorer.curves += [_read_curve(entry) for entry in content["curves"]]
    explorer.passages += [
        Passage(_read_flag(start), _read_flag(stop)) for start, stop in content["passages"]
    ]
    explorer.seeds.extend((number, np.array(seed)) for number, seed in content["seeds"])
    explorer.pending.extend((corner, ray) for corner, ray in content["pending"])
    explorer.shot.update((edge, frozenset(face)) for edge, face in content["shot"])
    for sentence in content["notes"]:
        explorer.register.note(sentence)
    explorer.register.lost = content["lost"]


def _curve(curve: Curve) -> dict[str, Any]:
    changed = {name: image for name, image in curve.relabelled.items() if name != image}
    return {
        "active": sorted(curve.active),
        "kinds": [kind.name for kind in curve.kinds],
        "start": curve.start,
        "stop": curve.stop,
        "relabelled": changed,
        "length": curve.length,
        "branches": int(curve.branches),
        "points": curve.points.tolist(),
    }


def _read_curve(entry: dict[str, Any]) -> Curve:
    first, last = (End[name] for name in entry["kinds"])
    return Curve(
        points=np.array(entry["points"]),
        active=frozenset(entry["active"]),
        kinds=(first, last),
        start=_pair(entry["start"]),
        stop=_pair(entry["stop"]),
        relabelled=entry["relabelled"],
        length=entry["length"],
        branches=entry["branches"],
    )


def _pair(half: list[int] | None) -> tuple[int, int] | None:
    return None if half is None else (half[0], half[1])


def _flag(flag: Flag) -> list[Any]:
    return [flag[0], flag[1], sorted(flag[2])]


def _read_flag(written: list[Any]) -> Flag:
    kind, place, names = written
    return kind, tuple(place) if isinstance(place, list) else place, frozenset(names)
