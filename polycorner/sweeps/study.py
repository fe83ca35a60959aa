"""The identity of a study and its provenance: everything that its results depend on."""

import hashlib
import io
import json
import pickle
import platform
import shlex
import sys
from dataclasses import dataclass
from datetime import UTC, datetime
from types import BuiltinFunctionType, FunctionType
from typing import Any

import numpy as np

from polycorner import __version__
from polycorner.errors import PolycornerError
from polycorner.formulas.families import Family
from polycorner.sweeps.grid import Grid
from polycorner.values import cached_property

FORMAT = 2


class SweepError(PolycornerError):
    """A study that had to stop: the workers do not answer, or the store cannot be written.

    Attributes
    ----------
    results : xarray.Dataset or None
        What was finished.
    """

    def __init__(self, message: str, results: Any = None) -> None:
        super().__init__(message)
        self.results = results


@dataclass(frozen=True)
class Study:
    """Grid, ``module:name`` of the function, fixed arguments as :func:`canonical` writes, seed."""

    grid: Grid
    function: str
    fixed: str
    seed: int | None

    def identity(self) -> dict[str, Any]:
        """Return what is equal for equal studies, in the types of JSON."""
        return {
            "format": FORMAT,
            "function": self.function,
            "axes": self.grid.description(),
            "fixed": json.loads(self.fixed),
            "seed": self.seed,
        }

    def attributes(self) -> dict[str, Any]:
        """Return the provenance as attributes of a dataset."""
        return {
            "polycorner_sweep": FORMAT,
            "function": self.function,
            "seed": "none" if self.seed is None else self.seed,
            "fixed": self.fixed,
            "study": json.dumps(self.identity(), sort_keys=True),
            "versions": json.dumps([versions()]),
            "command": shlex.join(sys.argv),
            "started": datetime.now(UTC).isoformat(timespec="seconds"),
            "complete": "unfinished",
        }


def versions() -> dict[str, str]:
    """Return the versions that results depend on."""
    return {
        "polycorner": __version__,
        "numpy": np.__version__,
        "python": platform.python_version(),
        "system": f"{platform.system()} {platform.machine()}",
    }


def canonical(fixed: dict[str, Any]) -> str:
    """Return fixed arguments as JSON; values that JSON does not have are named by their digest.

    Raises
    ------
    TypeError
        For a value that cannot be pickled.
    """
    try:
        return json.dumps(fixed, sort_keys=True, default=_described)
    except (TypeError, ValueError, AttributeError, pickle.PicklingError, RecursionError) as error:
        msg = f"fixed: expected values that can be pickled; got {fixed!r} ({error})"
        raise TypeError(msg) from None


def _described(value: Any) -> Any:
    """Return plain numbers for NumPy's, and type and digest of the content for other values."""
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    if isinstance(value, set | frozenset):  # whose order differs from process to process
        return sorted(json.dumps(part, sort_keys=True, default=_described) for part in value)
    content = io.BytesIO()
    pickler = _ContentPickler(content, protocol=5)
    pickler.fast = True  # equal values give equal bytes, whether or not they share parts
    pickler.dump(value)
    kind = type(value)
    digest = hashlib.sha256(content.getvalue()).hexdigest()
    return {"type": f"{kind.__module__}:{kind.__qualname__}", "sha256": digest}


class _ContentPickler(pickle.Pickler):
    """A pickler whose output depends on content alone, not on what was computed from it before."""

    def reducer_override(self, value: Any) -> Any:
        """Return what a value is made of: arrays as bytes, objects without cached properties."""
        if isinstance(value, np.ndarray) and not value.dtype.hasobject:
            return np.ndarray, (value.shape, value.dtype.str, value.tobytes())
        if isinstance(value, type | FunctionType | BuiltinFunctionType):
            return NotImplemented
        if isinstance(value, Family):  # SymPy's own pickles depend on what its caches share
            key = value.key or value.program().digest()
            return Family, (value.names, value.variables, value.parameters, key)
        reduced = value.__reduce_ex__(5)
        if isinstance(reduced, tuple) and len(reduced) > 2 and isinstance(reduced[2], dict):
            cached = {
                name
                for base in type(value).__mro__
                for name, member in vars(base).items()
                if isinstance(member, cached_property)
            }
            state = {name: part for name, part in reduced[2].items() if name not in cached}
            return (*reduced[:2], state, *reduced[3:])
        return reduced


def difference(wanted: dict[str, Any], found: dict[str, Any]) -> str:
    """Return the first difference of two identities as "this, not that"; empty if there is none."""
    for key in ("function", "seed"):
        if wanted[key] != found[key]:
            return f"{key} {_short(wanted[key])}, not {_short(found[key])}"
    for name in sorted({*wanted["fixed"], *found["fixed"]}):
        one, other = (_argument(identity["fixed"], name) for identity in (wanted, found))
        if one != other:
            return f"fixed {name} {one}, not {other}"
    names = [[axis["name"] for axis in identity["axes"]] for identity in (wanted, found)]
    if names[0] != names[1]:
        return f"axes {', '.join(names[0])}, not {', '.join(names[1])}"
    for axis, before in zip(wanted["axes"], found["axes"], strict=True):
        for key in ("unit", "values"):
            if axis[key] != before[key]:
                return f"{key} of {axis['name']} {_short(axis[key])}, not {_short(before[key])}"
    return ""


def _argument(fixed: dict[str, Any], name: str) -> str:
    return _short(fixed[name]) if name in fixed else "its default"


def _short(value: Any) -> str:
    text = json.dumps(value)
    return text if len(text) <= 80 else f"{text[:50]} ... {text[-25:]}"
