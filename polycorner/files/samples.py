"""Samples of strata as NumPy archives: the problem's formulas as text, points, and the chains."""

import json
import os
from collections.abc import Iterator, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from polycorner import checks, forms
from polycorner.container import BINARY, FileKind
from polycorner.files.polyhedra import Entries, mismatch, polyhedron_entry, read_polyhedron
from polycorner.kinds import checked
from polycorner.measures.sampling import (
    ChainState,
    SampleOptions,
    StrataSample,
    StratifiedSampler,
)
from polycorner.measures.weighting import Weighting, posed
from polycorner.tolerances import DEFAULT

if TYPE_CHECKING:
    from polycorner.polyhedra.polyhedron import Polyhedron

KIND = FileKind("sample", "save_sample", BINARY)


@checked
def save_sample(found: StrataSample, path: str | os.PathLike[str]) -> Path:
    """Write a sample of strata as a NumPy archive, atomically.

    The file holds the formulas of the polyhedron and of the energy as text, all points and their
    strata, and where the chains ended, so that :meth:`~polycorner.measures.StrataSample.more` goes
    on with what was loaded.

    Parameters
    ----------
    found : StrataSample
    path : path
        The file; its folder is created if it does not exist.

    Returns
    -------
    Path

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    sampler, weighting = found.sampler, found.sampler.weighting
    sticky = weighting.stickiness
    about = {
        "problem": polyhedron_entry(sampler.polyhedron, posed(weighting, sampler.polyhedron)),
        "stickiness": dict(sticky) if isinstance(sticky, Mapping) else float(sticky),
        "gradients": weighting.gradients,
        "temperature": weighting.temperature,
        "stiffness": weighting.stiffness,
        "contacts": list(sampler.contacts),
        "keep": list(sampler.keep),
        "options": asdict(sampler.options),
        "strata": [list(some) for some in found.strata],
    }
    text = json.dumps(about, allow_nan=False).encode()
    return KIND.save_arrays(
        path,
        {
            "about": np.frombuffer(text, dtype=np.uint8),
            "points": found.points,
            "positions": found.positions,
            "moves": found.moves,
            "ends": np.array([state.point for state in found.states]),
            "held": np.array([state.held for state in found.states]),
            "streams": np.array([state.stream for state in found.states], dtype=np.int64),
        },
    )


@checked
def load_sample(
    path: str | os.PathLike[str], polyhedron: "Polyhedron | None" = None
) -> StrataSample:
    """Read a sample of strata back.

    At all points the contacts of their strata have to vanish, and all others to hold, to ``1e-6``
    of scaled gradients.

    Parameters
    ----------
    path : path
        A file that :func:`save_sample` wrote.
    polyhedron : Polyhedron, optional
        The polyhedron that was sampled; default that of the file, whose annotations, being Python
        functions, are not in it.

    Raises
    ------
    ValueError
        If the file is no sample, was changed, or is of another polyhedron.
    """
    content = KIND.load_arrays(path)
    with KIND.reading(path):
        text = forms.array("about", content["about"], "u", (-1,)).astype(np.uint8)
        about = json.loads(text.tobytes())
        forms.entries({"problem": forms.entries({})})("", about)
        own, energy = read_polyhedron(about["problem"])
        differs = "" if polyhedron is None else mismatch(about["problem"], polyhedron)
        if not differs:
            chosen = own if polyhedron is None else polyhedron
            read = _read(content, about, chosen, energy)
            differs = next(_differences(read), "")
    if differs:
        raise KIND.refusal(path, f"is of another polyhedron: {differs}")
    return read


def _read(content: Entries, about: Entries, polyhedron: "Polyhedron", energy: Any) -> StrataSample:
    """Return the sample after a check of each number."""
    names, n, m = polyhedron.names, polyhedron.manifold.size, len(polyhedron.functions)
    if polyhedron.is_union:
        checks.refuse("problem", "inequalities that hold together", polyhedron)
    active = forms.made(forms.many(forms.word(*names)), tuple)
    read: Entries = forms.entries(
        {
            "stickiness": _stickiness,
            "gradients": forms.flag,
            "temperature": forms.number(),
            "stiffness": forms.optional(forms.number()),
            "contacts": forms.row(forms.count, forms.count),
            "keep": active,
            "options": _options,
            "strata": forms.made(forms.many(active), tuple),
        }
    )("", about)
    keys = ("stickiness", "gradients", "temperature", "stiffness")
    weighting = Weighting(energy=energy, **{key: read[key] for key in keys})
    if weighting.is_limit:
        checks.refuse("stickiness", "a finite one", weighting.stickiness)
    sampler = StratifiedSampler(
        polyhedron, weighting, tuple(read["contacts"]), read["keep"], read["options"]
    )
    points = forms.array("points", content["points"], "f", (-1, -1, n))
    shape, strata = points.shape[:2], read["strata"]
    if len({frozenset(some) for some in strata}) < len(strata):
        checks.refuse("strata", "each of them once", "one again")

    def of(key: str, kinds: str, *shape: int, **limits: Any) -> Any:
        return forms.array(key, content[key], kinds, shape, **limits)

    ends, streams = of("ends", "f", shape[0], n), of("streams", "i", shape[0])
    held = of("held", "i", shape[0], m, least=0, most=1).astype(np.int64)
    return StrataSample(
        sampler,
        points.astype(np.float64),
        strata,
        of("positions", "i", *shape, least=0, most=len(strata) - 1).astype(np.int64),
        of("moves", "i", 2, 3, least=0).astype(np.int64),
        tuple(map(ChainState, ends.astype(np.float64), held, map(int, streams.tolist()))),
    )


def _stickiness(place: str, value: Any) -> float | dict[str, float]:
    form = forms.mapped(forms.text, forms.number()) if isinstance(value, dict) else forms.number()
    found: float | dict[str, float] = form(place, value)
    return found


def _options(place: str, value: Any) -> SampleOptions:
    whole = ("every", "discarded", "block")
    names = SampleOptions.__dataclass_fields__
    form = {name: checks.whole if name in whole else forms.number() for name in names}
    return SampleOptions(**forms.entries(form)(place, value))


def _differences(read: StrataSample) -> Iterator[str]:
    """Yield which functions have other values than their strata say."""
    d, size = read.sampler.polyhedron, read.sampler.options.block
    names = [*d.names, *(h.name for h in d.equations)]
    kinds = [np.isin(d.names, some) for some in read.strata]
    kinds += [state.held != 0 for state in read.states]
    points = [read.points.reshape(-1, d.manifold.size), *(s.point[None] for s in read.states)]
    q = np.concatenate(points)
    last = len(read.strata) + np.arange(len(read.states))
    where = np.concatenate([read.positions.ravel(), last])
    for begin in range(0, len(q), size):
        part = slice(begin, begin + size)
        values, slopes = d.bundle.evaluate(q[part], 1)
        limits = DEFAULT.same * np.linalg.norm(slopes * d.manifold.scale_array, axis=2)
        zero = np.ones(values.shape, dtype=np.bool_)
        zero[:, : len(d.names)] = np.array(kinds).reshape(len(kinds), -1)[where[part]]
        fits = (values >= -limits) & ((values <= limits) | ~zero)
        for k, i in np.argwhere(~fits).tolist():
            written = "zero" if zero[k, i] else "met"
            found = f"written as {written}, found {values[k, i]:.12g}"
            yield f"{names[i]!r} at point {begin + k}: {found}"
