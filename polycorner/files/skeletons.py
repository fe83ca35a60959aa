"""Skeletons as JSON, finished or not: a search resumes from them."""

import operator
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from functools import partial
from itertools import starmap
from pathlib import Path
from typing import Any

import numpy as np

from polycorner import checks, forms
from polycorner.checks import refuse
from polycorner.container import JSON, FileKind, read_number
from polycorner.container import number as written_number
from polycorner.files.polyhedra import Entries, mismatch, polyhedron_entry, read_polyhedron
from polycorner.forms import (
    Form,
    anything,
    entries,
    generator_entry,
    made,
    many,
    mapped,
    number,
    optional,
    position,
    read_generator,
    row,
    text,
    word,
)
from polycorner.kinds import checked
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.polyhedra.quotients import Quotient, WalkOptions
from polycorner.polyhedra.strata import distances
from polycorner.polyhedra.symmetry import Symmetry
from polycorner.skeletons.assembly import assembled
from polycorner.skeletons.curves import Curve, FaceCrossing, Flag
from polycorner.skeletons.elements import Skeleton
from polycorner.skeletons.explorer import Explorer
from polycorner.skeletons.parts import Completeness
from polycorner.skeletons.probing import ISLAND, Patch
from polycorner.skeletons.registry import FoundCorner
from polycorner.skeletons.search import UNFINISHED
from polycorner.skeletons.states import SearchState
from polycorner.skeletons.tracing import FIGURE
from polycorner.skeletons.vertex_figures import corner_rank
from polycorner.skeletons.walks import End
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT, RANK_TOLERANCE, Tolerances

KIND = FileKind("skeleton", "save_skeleton", JSON)
HEADER = entries({"label": text, "polyhedron": entries({"annotations": many(text)})})


@checked
def save_skeleton(skeleton: Skeleton, path: str | os.PathLike[str], *, label: str = "") -> Path:
    """Write a skeleton, finished or not, as JSON, atomically.

    The file holds the formulas of the polyhedron as text, corners, edges with all their points, and
    all that a search needs to resume, the state of its random generator included.

    Parameters
    ----------
    skeleton : Skeleton
        As returned by :func:`~polycorner.skeletons.search.skeleton`.
    path : path
        The file; its folder is created if it does not exist.
    label : str, optional
        A name of the search, which :func:`load_skeleton` can require.

    Returns
    -------
    Path

    Raises
    ------
    TypeError
        If ``skeleton`` is none.
    OSError
        If the file cannot be written.
    """
    if not isinstance(skeleton, Skeleton) or not isinstance(skeleton.state, SearchState):
        refuse("skeleton", "a Skeleton that skeleton returned", skeleton, TypeError)
    explorer = Explorer.resumed(skeleton.state)
    points = [record.point.q for record in explorer.records]
    points += [curve.points[0] for curve in explorer.curves]
    content = {
        "label": label,
        "complete": skeleton.complete.name,
        "polyhedron": polyhedron_entry(skeleton.polyhedron),
        "symmetry": _symmetry(explorer.polyhedron, explorer.symmetry, points),
        "tolerance": explorer.quotient.tolerances.zero,
        "rank tolerance": explorer.quotient.tolerances.rank,
        "extent": written_number(explorer.quotient.extent),
        "options": asdict(explorer.quotient.options),
        "corners": [_corner(explorer, record) for record in explorer.records],
        "edges": [_curve(curve) for curve in explorer.curves],
        "crossings": [[_flag(p.start), _flag(p.stop)] for p in explorer.crossings],
        "starts": [[count, start.tolist()] for count, start in explorer.starts],
        "pending": list(explorer.pending),
        "tried": sorted(map(_flag, explorer.tried), key=str),
        "patches": [[sorted(p.active), p.point.tolist()] for p in explorer.patches],
        "links": [sorted(map(list, link), key=str) for link in explorer.links],
        "origins": [q.tolist() for q in explorer.origins],
        "least": {name: written_number(x) for name, x in explorer.least.items()},
        "sought": list(explorer.sought),
        "notes": explorer.notes,
        "lost": bool(explorer.registry.lost),
        "random": generator_entry(explorer.rng),
    }
    return KIND.save_json(path, content)


@checked
def load_skeleton(
    path: str | os.PathLike[str],
    polyhedron: Polyhedron | None = None,
    *,
    symmetry: Symmetry | None = None,
    label: str | None = None,
) -> Skeleton:
    """Read a skeleton back; :func:`~polycorner.skeletons.search.resume` continues its search.

    A polyhedron that is passed must have the names, periods and scales of the file, and its
    functions the same values at every corner, to ``1e-9`` of the larger of value and slope.

    Parameters
    ----------
    path : path
        A file that :func:`save_skeleton` wrote.
    polyhedron : Polyhedron, optional
        The polyhedron it was computed for; default that of the file.  One with annotations has to
        be passed, since these are Python functions.
    symmetry : Symmetry, optional
        The symmetry it was computed with, which is not in the file either.
    label : str, optional
        The name the search must have.

    Raises
    ------
    ValueError
        If the file is no skeleton, was changed, or is of another polyhedron or symmetry.
    """
    content = KIND.load_json(path)
    with KIND.reading(path):
        HEADER("", content)
    if label is not None and content["label"] != label:
        refuse("path", f"a skeleton called {label!r}", f"{path}, called {content['label']!r}")
    annotations = content["polyhedron"]["annotations"]
    if polyhedron is None and annotations:
        expected = f"that of {path}, whose annotations {', '.join(annotations)} are functions"
        refuse("polyhedron", expected, None)
    with KIND.reading(path):
        d = polyhedron or read_polyhedron(content["polyhedron"])[0]
        differs = mismatch(content["polyhedron"], d)
        explorer = differs or _explorer(content, d, symmetry or Symmetry())
        if not isinstance(explorer, str):
            differs = next(_differences(content, explorer), "")
            found = assembled(explorer, Completeness[content["complete"]])
    if isinstance(explorer, str) or differs:
        raise KIND.refusal(path, f"is of another polyhedron or symmetry: {differs or explorer}")
    return found


def _explorer(content: Entries, polyhedron: Polyhedron, symmetry: Symmetry) -> "Explorer | str":
    """Return the search, or which function differs at a corner."""
    sized = _read_sizes(content, polyhedron.manifold.size, len(polyhedron.functions))
    starts = [q for _, q in sized["starts"]]
    edges = [entry["points"][0] for entry in sized["edges"]]
    corners = [corner["point"] for corner in sized["corners"]]
    written, here = content["symmetry"], _symmetry(polyhedron, symmetry, corners + edges)
    if written != here:
        words = [", ".join(f"{k} {v}" for k, v in entry.items()) for entry in (written, here)]
        return f"symmetry: written {words[0]}, found {words[1]}"
    tolerances = Tolerances.of(sized["tolerance"], sized.get("rank tolerance", RANK_TOLERANCE))
    points = starts + edges + corners
    options = sized.get("options", WalkOptions())
    quotient = Quotient(polyhedron, symmetry, tolerances, sized["extent"], options=options)
    quotient = quotient.near(points)
    explorer = Explorer(quotient, [], read_generator("random", content["random"]))
    for k, (corner, q) in enumerate(zip(sized["corners"], corners, strict=True)):
        active = frozenset(map(polyhedron.names.index, corner["active"]))
        differs = _unlike(quotient, q[None], active)
        if differs:
            return differs.replace(":", f" at corner {k}:", 1)
        _check_active(f"corners[{k}].active", quotient, q, active)
        explorer.registry.restore(q, active)
    joined = _read_joints(content, sized, explorer)
    for record, corner in zip(explorer.records, sized["corners"], strict=True):
        record.edges.update(dict(corner["edges"]))
    explorer.curves += joined["curves"]
    explorer.crossings += starmap(FaceCrossing, joined["crossings"])
    explorer.starts.extend(sized["starts"])
    explorer.pending.extend(joined["pending"])
    explorer.tried.update(joined["tried"])
    explorer.patches += starmap(Patch, sized.get("patches", ()))
    explorer.links += joined.get("links", ())
    explorer.origins += sized.get("origins", ())
    explorer.least.update(joined.get("least", {}))
    explorer.sought = joined.get("sought", explorer.sought)
    for sentence in sized["notes"]:
        explorer.registry.note(sentence)
    explorer.registry.lost = sized["lost"]
    return explorer


def _differences(content: Entries, explorer: Explorer) -> Iterator[str]:
    """Yield in what the functions at the corners differ from the file."""
    names = [*explorer.polyhedron.names, *explorer.polyhedron.equation_names]
    for k, (record, entry) in enumerate(zip(explorer.records, content["corners"], strict=True)):
        values = np.array([read_number(x) for x in entry["values"]])
        found, slopes = record.point.values, np.linalg.norm(record.point.gradients, axis=1)
        allowed = DEFAULT.alike * np.maximum(slopes, abs(found))
        for i in np.flatnonzero(~np.isclose(values, found, 0.0, allowed, equal_nan=True)):
            yield f"{names[i]!r} at corner {k}: written {values[i]:.12g}, found {found[i]:.12g}"


def _symmetry(polyhedron: Polyhedron, symmetry: Symmetry, points: Sequence[Any]) -> Entries:
    """Return what is known of a symmetry without its functions."""
    return {
        "motions": len(symmetry.directions(polyhedron.manifold, points[0])) if points else None,
        "elements": len(symmetry.elements),
        "relabels": bool(symmetry.relabels),
    }


def _corner(explorer: Explorer, record: FoundCorner) -> Entries:
    names = explorer.polyhedron.names
    return {
        "point": record.point.q.tolist(),
        "active": [names[i] for i in sorted(record.active)],
        "values": [written_number(x) for x in record.point.values.tolist()],
        "edges": [[ray, edge] for ray, edge in record.edges.items()],
    }


def _curve(curve: Curve) -> dict[str, Any]:
    changed = {name: image for name, image in curve.relabelled.items() if name != image}
    return {
        "active": sorted(curve.active),
        "kinds": [kind.name for kind in curve.kinds],
        "start": curve.start,
        "stop": curve.stop,
        "relabelled": changed,
        "points": curve.points.tolist(),
    }


def _flag(flag: Flag) -> list[Any]:
    return [flag[0], flag[1], sorted(flag[2])]


# ------------------------------------------------------------------------------------------- forms

# Rays and sectors of corners are not in the file but follow from the functions: first come the
# sizes, then corners, which have to lie where their functions vanish, then all that has rays.


def _read_sizes(content: Entries, n: int, m: int) -> Entries:
    """Return what depends on ``n`` coordinates and ``m`` functions alone."""
    point = made(many(number(), exactly=n), np.array)
    active = made(many(position(m)), frozenset)
    kind = made(word(*End.__members__), lambda name: End[name])
    corner = entries(
        {
            "point": point,
            "values": many(number(infinite=True)),
            "active": many(text),
            "edges": many(row(forms.count, position(len(content["edges"])))),
        }
    )
    edge = {"points": made(many(point), np.array), "active": active, "kinds": row(kind, kind)}
    header = {
        "complete": word(*Completeness.__members__),
        "tolerance": number(above=0, below=1),
        "extent": number(above=0, infinite=True),
        "corners": many(corner),
        "edges": many(entries(edge)),
        "starts": many(row(partial(checks.whole, least=ISLAND), point)),
        "notes": many(text),
        "lost": forms.flag,
    }
    several = ("distances", "samples", "radii")
    options = {
        name: many(number(above=0)) if name in several else number(above=0)
        for name in asdict(WalkOptions())
    }
    later = {
        "rank tolerance": number(above=0, below=1),
        "options": made(entries({}, options), lambda read: WalkOptions(**read)),
        "patches": many(row(active, point)),
        "origins": many(point),
    }
    read: Entries = entries(header, later)("", content)
    return read


def _unlike(quotient: Quotient, points: Array, active: frozenset[int]) -> str:
    """Return which function does not vanish at points, or is negative there; nothing if all do.

    To the distance within which the search takes points for each other; functions that close with
    slope zero vanish to its square.
    """
    d, near = quotient.polyhedron, quotient.tolerances.near
    values, gradients = d.bundle.evaluate(points, 1)
    gradients = gradients * d.manifold.scale_array
    m = len(d.functions)
    away = np.array([distances(*both) for both in zip(values, gradients, strict=True)])
    zero = (abs(away) <= near) | (abs(values) <= near**2)
    names = (*d.names, *d.equation_names)
    for i in [*sorted(active), *range(m, values.shape[1])]:
        if not zero[:, i].all():
            return f"{names[i]!r}: written as zero, found {values[~zero[:, i], i][0]:.12g}"
    signs = np.where(zero, 0, np.where(away > 0, 1, -1))[:, :m]
    inside = not np.isnan(away).any() and all(
        d.signs_to_pieces(row.tolist()) for row in np.unique(signs, axis=0)
    )
    return "" if inside else "the polyhedron: written as met, found outside"


def _check_active(place: str, quotient: Quotient, q: Array, active: frozenset[int]) -> None:
    """Check that a corner has all functions that vanish there, unless it is singular."""
    point = quotient.at(q)
    found = point.active()
    if found is not None and found > active and operator.eq(*corner_rank(point, found)):
        names = ", ".join(quotient.polyhedron.names[i] for i in sorted(found))
        checks.refuse(place, f"the functions {names} that vanish there", len(active))


def _read_joints(content: Entries, sized: Entries, explorer: Explorer) -> Entries:
    """Return the rest, which depends on the corners, their rays and their sectors."""
    names = explorer.polyhedron.names
    rays = [len(record.figure.rays) for record in explorer.records]
    sectors = [len(record.figure.sectors) for record in explorer.records]
    edges, patches = (position(len(sized.get(name, ()))) for name in ("edges", "patches"))

    def at(counts: list[int], least: int = 0) -> Form:
        def check(place: str, value: Any) -> tuple[int, int]:
            k, i = row(position(len(counts)), anything)(place, value)
            return k, position(counts[k], least=least)(f"{place}[1]", i)

        return check

    name = word(*names)
    kinds: Mapping[str, Form] = {"half": at(rays), "curve": edges, "apex": at(sectors)}
    flag = _by_kind(kinds, made(many(name), frozenset))
    anchors: Mapping[str, Form] = {
        "half": at(rays), "curve": edges, "patch": patches, "corner": position(len(rays)),
    }  # fmt: skip
    edge = entries(
        {
            "start": optional(at(rays)),
            "stop": optional(at(rays)),
            "relabelled": mapped(name, name),
        }
    )
    required = {
        "corners": many(entries({"active": many(name)})),
        "edges": many(edge),
        "crossings": many(row(flag, flag)),
        "pending": many(at(rays, FIGURE)),
        "tried": many(flag),
    }
    later = {
        "links": many(made(many(_by_kind(anchors)), frozenset)),
        "least": mapped(name, number(infinite=True)),
        "sought": row(forms.count, partial(checks.whole, least=-1)),
    }
    read: Entries = entries(required, later)("", content)
    curves = [Curve(**one, **two) for one, two in zip(sized["edges"], read["edges"], strict=True)]
    for k, (record, corner) in enumerate(zip(explorer.records, sized["corners"], strict=True)):
        for j, (ray, kept) in enumerate(corner["edges"]):
            ends = filter(None, (curves[kept].start, curves[kept].stop))
            if ray not in {record.orbit[i] for c, i in ends if c == k}:
                checks.refuse(f"corners[{k}].edges[{j}]", "an edge that ends there", kept)
    for k, curve in enumerate(curves):
        _check_curve(f"edges[{k}]", curve, explorer)
    finished = Completeness[content["complete"]] not in UNFINISHED
    if finished and (content["pending"] or content["starts"]):
        checks.refuse(
            "complete", "an unfinished search, with work that is left", content["complete"]
        )
    return read | {"curves": curves}


def _by_kind(kinds: Mapping[str, Form], *more: Form) -> Form:
    """Return the form of a list: a kind, what has the form of this kind, and more."""

    def check(place: str, value: Any) -> tuple[Any, ...]:
        kind, where, *rest = row(word(*kinds), anything, *more)(place, value)
        return kind, kinds[kind](f"{place}[1]", where), *rest

    return check


def _check_curve(place: str, curve: Curve, explorer: Explorer) -> None:
    """Check that an edge lies where its functions vanish, is no longer than a walk, and begins."""
    quotient, points, active = explorer.quotient, curve.points, curve.active
    differs = _unlike(quotient, points, active)
    if differs:
        msg = f"{place}.points: expected an edge; got {differs}"
        raise ValueError(msg)
    inner = (quotient.at(q).active() for q in points[1:-1])
    if len(points) > 2 and all(found is not None and found > active for found in inner):
        checks.refuse(f"{place}.active", "all that vanish along the edge", sorted(active))
    chords = np.diff(points, axis=0) / explorer.scales
    # Two walks at most, whose last step is at most half as long as the extent.
    longest = 3 * (quotient.extent + quotient.options.longest_step)
    if not np.linalg.norm(chords, axis=1).sum() <= longest:
        checks.refuse(
            f"{place}.points", f"an edge of a length of at most {longest:g}", "a longer one"
        )
    begins = curve.kinds[0] is End.CORNER
    at = None if curve.start is None else explorer.records[curve.start[0]].point.q
    if begins != (at is not None) or (at is not None and (at != points[0]).any()):
        checks.refuse(f"{place}.start", "the corner where the edge begins", curve.start)
    if curve.stop is not None and curve.kinds[1] is not End.CORNER:
        checks.refuse(f"{place}.stop", "None for an edge that ends at no corner", curve.stop)
