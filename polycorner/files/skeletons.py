"""Skeletons as JSON, finished or not: gone on with when they are loaded, after a check."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from polycorner.files.container import Kind, load_json, number, read_number, save_json
from polycorner.files.models import units_of
from polycorner.files.skeleton_checks import corner_entry, fault, symmetry_entry
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.polyhedra.symmetry import Symmetry
from polycorner.skeletons.assembly import assembled
from polycorner.skeletons.elements import Completeness, Skeleton
from polycorner.skeletons.explorer import Explorer, SearchState
from polycorner.skeletons.flags import Crossing, Flag
from polycorner.skeletons.points import Quotient
from polycorner.skeletons.tracing import Curve
from polycorner.skeletons.walks import End

KIND = Kind("a skeleton", "save_skeleton", "polycorner skeleton", schema=1)
RANDOM = ("MT19937", "PCG64", "PCG64DXSM", "Philox", "SFC64")


def save_skeleton(
    skeleton: Skeleton,
    path: str | os.PathLike[str],
    *,
    label: str = "",
    units: Mapping[str, str] | None = None,
) -> Path:
    """Write a skeleton, finished or not, as JSON; the file appears whole or not at all.

    Parameters
    ----------
    skeleton : Skeleton
        What :func:`~polycorner.skeletons.search.skeleton` returned.
    path : path
        The file; its folder is made if need be.
    label : str, optional
        What the search is called; :func:`load_skeleton` can insist on it.
    units : mapping from str to str, optional
        Units of coordinates by name.  Those of the package's models are known, and a circle of
        period ``2 pi`` is an angle in ``rad``.

    Returns
    -------
    Path

    Raises
    ------
    TypeError, ValueError
        Naming the argument.
    OSError
        If the file cannot be written.
    """
    if not isinstance(skeleton, Skeleton) or not isinstance(skeleton.state, SearchState):
        msg = f"skeleton: expected a Skeleton that skeleton returned; got {type(skeleton).__name__}"
        raise TypeError(msg)
    explorer = Explorer.resumed(skeleton.state)
    d, manifold = skeleton.polyhedron, skeleton.polyhedron.manifold
    known = units_of(d, None, units).coordinates
    content = {
        "label": label,
        "complete": skeleton.complete.name,
        "coordinates": [
            {"name": name, "unit": known[name], "period": number(period), "scale": scale}
            for name, period, scale in zip(
                manifold.names, manifold.periods, manifold.scales, strict=True
            )
        ],
        "functions": list(d.names),
        "equations": list(d.equation_names),
        "symmetry": symmetry_entry(explorer),
        "tolerance": explorer.quotient.tolerance,
        "extent": number(explorer.quotient.extent),
        "corners": [corner_entry(explorer, record) for record in explorer.records],
        "ends": [[[ray, edge] for ray, edge in p.edges.items()] for p in explorer.records],
        "curves": [_curve(curve) for curve in explorer.curves],
        "crossings": [[_flag(p.start), _flag(p.stop)] for p in explorer.crossings],
        "starts": [[count, start.tolist()] for count, start in explorer.starts],
        "pending": list(explorer.pending),
        "tried": [[edge, sorted(face)] for edge, face in sorted(explorer.tried, key=_order)],
        "notes": explorer.notes,
        "lost": bool(explorer.registry.lost),
        "random": _listed(explorer.rng.bit_generator.state),
    }
    return save_json(KIND, path, content)


def load_skeleton(
    path: str | os.PathLike[str],
    polyhedron: Polyhedron,
    *,
    symmetry: Symmetry | None = None,
    label: str | None = None,
) -> Skeleton:
    """Read a skeleton back; :func:`~polycorner.skeletons.search.resume` goes on with it.

    Checked anew: that names, periods and scales are those of the polyhedron; that the functions
    have the values written at every corner, to ``1e-9`` of their slopes; that the corners lie on
    the functions written, and all points of edges on theirs and in the polyhedron.

    Parameters
    ----------
    path : path
        A file that :func:`save_skeleton` wrote.
    polyhedron, symmetry
        Those it was computed for: formulas are not in the file.
    label : str, optional
        What the search must be called.

    Raises
    ------
    ValueError
        If the file is no skeleton, was changed, or is of another polyhedron or symmetry.
    """
    content = load_json(KIND, path)
    if label is not None and content.get("label") != label:
        msg = (
            f"path: expected a skeleton called {label!r}; {path} is called {content.get('label')!r}"
        )
        raise ValueError(msg)
    try:
        _check_names(content, polyhedron, path)
        return _restored(content, polyhedron, symmetry or Symmetry(), path)
    except (ArithmeticError, AttributeError, LookupError, TypeError) as error:
        raise KIND.refusal(path, f"is damaged ({error!r})") from error


def _check_names(
    content: dict[str, Any], polyhedron: Polyhedron, path: str | os.PathLike[str]
) -> None:
    manifold = polyhedron.manifold
    written = [(c["name"], read_number(c["period"]), c["scale"]) for c in content["coordinates"]]
    columns = zip(manifold.names, manifold.periods, manifold.scales, strict=True)
    for what, found, wanted in (
        ("functions", content["functions"], polyhedron.names),
        ("equations", content["equations"], polyhedron.equation_names),
        ("coordinates, periods and scales", written, columns),
    ):
        if list(found) != list(wanted):
            names = ", ".join(polyhedron.names if what == "functions" else manifold.names)
            msg = f"path: expected a skeleton of {names}; {path} has other {what}"
            raise ValueError(msg)


def _restored(
    content: dict[str, Any],
    polyhedron: Polyhedron,
    symmetry: Symmetry,
    path: str | os.PathLike[str],
) -> Skeleton:
    extent = read_number(content["extent"])
    quotient = Quotient(polyhedron, symmetry, float(content["tolerance"]), extent)
    explorer = Explorer(quotient, [], _generator(content["random"]))
    try:
        _fill(explorer, content)
        found = fault(explorer, content)
        skeleton = None if found else assembled(explorer, Completeness[content["complete"]])
    except ValueError as error:
        raise KIND.refusal(path, f"is damaged ({error})") from error
    if skeleton is None:
        raise KIND.refusal(path, f"is not what is computed here: {found}")
    return skeleton


def _fill(explorer: Explorer, content: dict[str, Any]) -> None:
    n = explorer.manifold.dimension
    for corner in content["corners"]:
        explorer.registry.restore(_points(corner["point"], n, 1))
    for record, ends in zip(explorer.records, content["ends"], strict=True):
        record.edges.update(dict(ends))
    explorer.curves += [_read_curve(entry, n) for entry in content["curves"]]
    explorer.crossings += [
        Crossing(_read_flag(start), _read_flag(stop)) for start, stop in content["crossings"]
    ]
    explorer.starts.extend((count, _points(start, n, 1)) for count, start in content["starts"])
    explorer.pending.extend((corner, ray) for corner, ray in content["pending"])
    explorer.tried.update((edge, frozenset(face)) for edge, face in content["tried"])
    for sentence in content["notes"]:
        explorer.registry.note(sentence)
    explorer.registry.lost = bool(content["lost"])


def _points(written: Any, n: int, dimensions: int) -> Any:
    found = np.array(written, dtype=np.float64)
    if found.ndim != dimensions or found.shape[-1] != n or not np.isfinite(found).all():
        msg = f"{n} finite numbers make a point, not an array of shape {found.shape}"
        raise ValueError(msg)
    return found


def _curve(curve: Curve) -> dict[str, Any]:
    changed = {name: image for name, image in curve.relabelled.items() if name != image}
    return {
        "active": sorted(curve.active),
        "kinds": [kind.name for kind in curve.kinds],
        "start": curve.start,
        "stop": curve.stop,
        "relabelled": changed,
        "length": float(curve.length),
        "branches": int(curve.branches),
        "points": curve.points.tolist(),
    }


def _read_curve(entry: dict[str, Any], n: int) -> Curve:
    first, last = (End[name] for name in entry["kinds"])
    return Curve(
        points=_points(entry["points"], n, 2),
        active=frozenset(entry["active"]),
        kinds=(first, last),
        start=_pair(entry["start"]),
        stop=_pair(entry["stop"]),
        relabelled=entry["relabelled"],
        length=float(entry["length"]),
        branches=entry["branches"],
    )


def _pair(half: list[int] | None) -> tuple[int, int] | None:
    return None if half is None else (half[0], half[1])


def _flag(flag: Flag) -> list[Any]:
    return [flag[0], flag[1], sorted(flag[2])]


def _read_flag(written: list[Any]) -> Flag:
    kind, record, names = written
    return kind, tuple(record) if isinstance(record, list) else record, frozenset(names)


def _order(crossing: tuple[int, frozenset[int]]) -> tuple[int, list[int]]:
    return crossing[0], sorted(crossing[1])


# -------------------------------------------------------------------------------- random generators


def _listed(state: Any) -> Any:
    """Return the state of a bit generator, some of which have arrays in it, as plain values."""
    if isinstance(state, Mapping):
        return {name: _listed(value) for name, value in state.items()}
    return state.tolist() if isinstance(state, np.ndarray | np.generic) else state


def _generator(state: dict[str, Any]) -> np.random.Generator:
    if state["bit_generator"] not in RANDOM:
        msg = f"no bit generator is called {state['bit_generator']!r}"
        raise LookupError(msg)
    found = getattr(np.random, state["bit_generator"])()
    found.state = _unlisted(state)
    return np.random.Generator(found)


def _unlisted(state: Any) -> Any:
    if isinstance(state, dict):
        return {name: _unlisted(value) for name, value in state.items()}
    return np.array(state, dtype=np.uint64) if isinstance(state, list) else state
