"""What the entries of a skeleton's file may be: sizes first, then corners, then all that has rays.

Rays and sectors of corners are not in the file but follow from the functions, so they count only
after the corners were made again; before that corners have to lie where their functions vanish.
"""

import operator
from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np

from polycorner import checks, forms
from polycorner.forms import (
    Form,
    anything,
    entries,
    many,
    mapped,
    number,
    optional,
    position,
    row,
    text,
    word,
)
from polycorner.polyhedra.strata import distances
from polycorner.skeletons.explorer import Explorer
from polycorner.skeletons.parts import Completeness
from polycorner.skeletons.points import Quotient
from polycorner.skeletons.probing import ISLAND
from polycorner.skeletons.search import UNFINISHED
from polycorner.skeletons.tracing import FIGURE
from polycorner.skeletons.vertex_figures import corner_rank
from polycorner.skeletons.walks import LONGEST_STEP, End
from polycorner.spaces.manifold import Array

HEADER = entries(
    {
        "label": text,
        "polyhedron": entries({"annotations": many(text)}),
    }
)


def check_sizes(content: Mapping[str, Any], n: int, m: int) -> None:
    """Check what depends on ``n`` coordinates and ``m`` functions alone."""
    point, active = many(number(), exactly=n), many(position(m))
    kind = word(*End.__members__)
    corner = entries(
        {
            "point": point,
            "values": many(number(infinite=True)),
            "active": many(text),
            "edges": many(row(forms.count, position(len(content["edges"])))),
        }
    )
    edge = entries({"points": many(point), "active": active, "kinds": row(kind, kind)})
    header = {
        "complete": word(*Completeness.__members__),
        "tolerance": number(above=0, below=1),
        "extent": number(above=0, infinite=True),
        "corners": many(corner),
        "edges": many(edge),
        "starts": many(row(partial(checks.whole, least=ISLAND), point)),
        "notes": many(text),
        "lost": forms.flag,
    }
    later = {
        "rank tolerance": number(above=0, below=1),
        "patches": many(row(active, point)),
        "origins": many(point),
    }
    entries(header, later)("", content)


def unlike(quotient: Quotient, points: Array, active: frozenset[int]) -> str:
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


def check_active(place: str, quotient: Quotient, q: Array, active: frozenset[int]) -> None:
    """Check that a corner has all functions that vanish there, unless it is singular."""
    point = quotient.at(q)
    found = point.active()
    if found is not None and found > active and operator.eq(*corner_rank(point, found)):
        names = ", ".join(quotient.polyhedron.names[i] for i in sorted(found))
        checks.refuse(place, f"the functions {names} that vanish there", len(active))


def check_rays(content: Mapping[str, Any], explorer: Explorer) -> None:
    """Check the rest against the corners, their rays and their sectors."""
    names = explorer.polyhedron.names
    rays = [len(record.figure.rays) for record in explorer.records]
    sectors = [len(record.figure.sectors) for record in explorer.records]
    edges = position(len(content["edges"]))
    patches = position(len(content.get("patches", ())))

    def at(counts: list[int], least: int = 0) -> Form:
        def check(place: str, value: Any) -> None:
            row(position(len(counts)), anything)(place, value)
            position(counts[value[0]], least=least)(f"{place}[1]", value[1])

        return check

    name = word(*names)
    kinds: Mapping[str, Form] = {"half": at(rays), "curve": edges, "apex": at(sectors)}
    flag = _by_kind(kinds, many(name))
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
        "links": many(many(_by_kind(anchors))),
        "least": mapped(name, number(infinite=True)),
        "sought": row(forms.count, partial(checks.whole, least=-1)),
    }
    entries(required, later)("", content)
    for k, (record, corner) in enumerate(zip(explorer.records, content["corners"], strict=True)):
        for j, (ray, kept) in enumerate(corner["edges"]):
            ends = content["edges"][kept]
            here = {record.orbit[i] for c, i in _ends(ends) if c == k}
            if ray not in here:
                checks.refuse(f"corners[{k}].edges[{j}]", "an edge that ends there", kept)
    for k, written in enumerate(content["edges"]):
        _check_curve(f"edges[{k}]", written, explorer)
    finished = Completeness[content["complete"]] not in UNFINISHED
    if finished and (content["pending"] or content["starts"]):
        checks.refuse(
            "complete", "an unfinished search, with work that is left", content["complete"]
        )


def _by_kind(kinds: Mapping[str, Form], *more: Form) -> Form:
    """Return the form of a list: a kind, what has the form of this kind, and more."""

    def check(place: str, value: Any) -> None:
        row(word(*kinds), anything, *more)(place, value)
        kinds[value[0]](f"{place}[1]", value[1])

    return check


def _ends(edge: Mapping[str, Any]) -> list[list[int]]:
    return [end for end in (edge["start"], edge["stop"]) if end is not None]


def _check_curve(place: str, edge: Mapping[str, Any], explorer: Explorer) -> None:
    """Check that an edge lies where its functions vanish, is no longer than a walk, and begins."""
    quotient, points = explorer.quotient, np.array(edge["points"], dtype=np.float64)
    differs = unlike(quotient, points, frozenset(edge["active"]))
    if differs:
        msg = f"{place}.points: expected an edge; got {differs}"
        raise ValueError(msg)
    active = frozenset(edge["active"])
    inner = (quotient.at(q).active() for q in points[1:-1])
    if len(points) > 2 and all(found is not None and found > active for found in inner):
        checks.refuse(f"{place}.active", "all that vanish along the edge", edge["active"])
    chords = np.diff(points, axis=0) / explorer.scales
    # Two walks at most, whose last step is at most half as long as the extent.
    longest = 3 * (quotient.extent + LONGEST_STEP)
    if not np.linalg.norm(chords, axis=1).sum() <= longest:
        checks.refuse(
            f"{place}.points", f"an edge of a length of at most {longest:g}", "a longer one"
        )
    start, corner = edge["start"], End.CORNER.name
    begins = edge["kinds"][0] == corner
    at = None if start is None else explorer.records[start[0]].point.q
    if begins != (at is not None) or (at is not None and (at != points[0]).any()):
        checks.refuse(f"{place}.start", "the corner where the edge begins", start)
    if edge["stop"] is not None and edge["kinds"][1] != corner:
        checks.refuse(f"{place}.stop", "None for an edge that ends at no corner", edge["stop"])
