"""What a store is of, and whether that is what is asked for."""

import json
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from polycorner.sweeps.grid import written
from polycorner.sweeps.points import Column
from polycorner.sweeps.results import FORMAT, Study


def need_zarr() -> None:
    """Refuse to go on without zarr, saying how it is had."""
    if find_spec("zarr") is None:
        msg = "store: expected zarr to be installed: pip install 'polycorner[sweep]'"
        raise ImportError(msg)


def is_store(path: Path) -> bool:
    """Whether there is a zarr group."""
    return (path / "zarr.json").exists()


def _attributes(path: Path) -> dict[str, Any]:
    """Return the attributes of a store that :class:`Store` made."""
    try:
        about = json.loads((path / "zarr.json").read_text(encoding="utf-8"))["attributes"]
    except (OSError, UnicodeDecodeError, json.JSONDecodeError, KeyError, TypeError) as error:
        msg = f"store: expected a store of a sweep; {path} is damaged or something else ({error})"
        raise ValueError(msg) from error
    if not isinstance(about, dict) or "polycorner_sweep" not in about:
        msg = f"store: expected a store of a sweep; {path} is something else"
        raise ValueError(msg)
    return about


def stored_columns(about: Any) -> tuple[Column, ...]:
    """Return the columns of the results from the attributes of a store."""
    listed = json.loads(str(about.get("columns", "[]")))
    return tuple(Column(**entry | {"shape": tuple(entry["shape"])}) for entry in listed)


def stored_study(path: Path) -> dict[str, Any] | None:
    """Return the identity of the study in a store, or None where there is none."""
    if not is_store(path):
        return None
    about = _attributes(path)
    if about["polycorner_sweep"] != FORMAT:
        msg = f"store: expected format {FORMAT}; {path} has format {about['polycorner_sweep']}"
        raise ValueError(msg)
    found: dict[str, Any] = json.loads(about["study"])
    return found


def check_study(path: Path, study: Study) -> None:
    """Refuse a folder with anything but this study, in a sentence that names what differs."""
    if path.exists() and not path.is_dir():
        msg = f"store: expected a folder; {path} is a file"
        raise ValueError(msg)
    found = stored_study(path)
    if found is None:
        if path.is_dir() and any(entry.name != "journal" for entry in path.iterdir()):
            msg = f"store: expected a new or empty folder, or a store of a sweep; {path} is neither"
            raise ValueError(msg)
        return
    wanted = json.loads(written(study.identity(), "fixed"))
    if found == wanted:
        return
    msg = f"store: expected {_difference(wanted, found)}; {path} is of another study"
    raise ValueError(msg)


def _difference(wanted: dict[str, Any], found: dict[str, Any]) -> str:
    """Return what the first thing that differs should be, and what it is."""
    for key in ("function", "seed", "fixed"):
        if wanted[key] != found[key]:
            return f"{key} {_short(wanted[key])}, not {_short(found[key])}"
    names = [[axis["name"] for axis in one["axes"]] for one in (wanted, found)]
    if names[0] != names[1]:
        return f"axes {', '.join(names[0])}, not {', '.join(names[1])}"
    for one, other in zip(wanted["axes"], found["axes"], strict=True):
        for key in ("unit", "values"):
            if one[key] != other[key]:
                return f"{key} of {one['name']} {_short(one[key])}, not {_short(other[key])}"
    return "the same study"


def _short(value: Any) -> str:
    text = json.dumps(value)
    return text if len(text) <= 60 else f"{text[:40]} ... {text[-15:]}"
