"""Tables of the page on the drum, from the stores of its studies.

``polycorner sweep benchmarks/drum/NAME.toml --out out/drum/NAME --resume`` computes a study, as far
as there is time; ``python benchmarks/drum_tables.py NAME`` writes ``docs/tables/NAME.md`` and, for
bunches, ``NAME.json`` with each dumbbell that left.  Rows that are missing are counted, not filled.
"""

import argparse
import json
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from side_by_side import ROOT

from polycorner.atomic import write_atomically
from polycorner.sweeps import open_results

EARLY = 300.0  # s, of twenty minutes
KINDS = {1: "R", -1: "L", 0: "none"}  # hands of dyads in which dumbbells leave
FEATURES = {  # of starts, at the first of twenty instants
    "in the largest group": "heap_at",
    "in right-handed dyads": "right_at",
    "in left-handed dyads": "left_at",
}
STEADY = 1.0  # degrees, the spread below which starts from both sides have met
Row = dict[str, Any]


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="+", metavar="NAME", help="a study of benchmarks/drum")
    parser.add_argument("--stores", type=Path, default=Path("out/drum"))
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "tables")
    options = parser.parse_args(arguments)
    for name in options.names:
        folder = options.stores / name / "sweep.zarr"
        try:
            found = open_results(folder).load()
        except (ValueError, OSError) as error:
            parser.error(f"{folder}: {error}")
        options.out.mkdir(parents=True, exist_ok=True)
        bunches = "exit_time" in found
        rows = attracted if "cohesion" in found.dims else driven
        text = told_of_bunches(found) if bunches else table([*rows(found)])
        write_atomically(options.out / f"{name}.md", text.encode())
        if bunches:
            content = ",\n".join(map(json.dumps, runs(found)))
            write_atomically(
                options.out / f"{name}.json", f'{{"runs": [\n{content}\n]}}\n'.encode()
            )
        print(text)


# ------------------------------------------------------------------------------------ one dumbbell


def points(found: xr.Dataset) -> "Iterator[tuple[Row, xr.Dataset]]":
    """Yield the finished points of a study, with the values of the axes that vary."""
    axes = found["status"].dims
    for at in np.argwhere(found["status"].values == 1):
        one = found.isel(dict(zip(axes, at.tolist(), strict=True)))
        yield {str(a): one[a].item() for a in axes if found.sizes[a] > 1}, one


def runs(found: xr.Dataset) -> Iterator[Row]:
    """Yield the bunches of a study: who left, and what the drum contained at twenty instants."""
    for axes, one in points(found):
        count = int(np.isfinite(one["exit_time"].values).sum())
        exits = [
            {
                "time": round(float(one["exit_time"][k]), 1),
                "as": KINDS[int(one["exit_hand"][k])],
                "heading": round(float(one["exit_heading"][k]), 1),
                "alone": round(float(one["exit_alone"][k]), 1),
                "above": round(float(one["exit_above"][k]), 1),
            }
            for k in range(count)
        ]
        history = {name: one[name].values.astype(int).tolist() for name in FEATURES.values()}
        yield {**axes, "left": int(one["left"]), "exits": exits, **history}


# ------------------------------------------------------------------------------- sets of parameters


def told_of_bunches(found: xr.Dataset) -> str:
    """Return the table by sets of parameters, and what tells starts of one set from each other."""
    members = [*runs(found)]
    axes = [a for a in members[0] if a in found.dims and a != "start"] if members else []
    groups: dict[tuple[Any, ...], list[Row]] = {}
    for run in members:
        groups.setdefault(tuple(run[a] for a in axes), []).append(run)
    rows = [
        dict(zip(map(words, axes), map(short, key), strict=True)) | of_one_set(some)
        for key, some in groups.items()
    ]
    total, done = found["status"].size, len(members)
    lines = [f"{done} of {total} starts of the study were followed.", "", table(rows)]
    several = list(groups.values())
    return "\n".join([*lines, *separating(several), *by_start(several)])


def of_one_set(some: list[Row]) -> Row:
    """Return who left the bunches of one set of parameters, and how."""
    exits = [one for run in some for one in run["exits"]]
    headings = np.array([one["heading"] for one in exits])
    return {
        "starts": len(some),
        "left, start by start": ", ".join(str(run["left"]) for run in some),
        "mean": mean([run["left"] for run in some]),
        "R, L, none": ", ".join(str(sum(e["as"] == k for e in exits)) for k in KINDS.values()),
        "in the first 300 s": share([e["time"] <= EARLY for e in exits]),
        "heading": spread(headings, "°"),
        "untouched before, s": middle([e["alone"] for e in exits]),
        "above the mean, mm": middle([e["above"] for e in exits]),
    }


def separating(groups: list[list[Row]]) -> list[str]:
    """Return rank correlations, within sets, of how many left with what starts are like at first.

    Ranks are taken within a set and pooled; sets of fewer than three starts tell nothing.
    """
    some = [group for group in groups if len(group) > 2]
    if not some:
        return []
    rows = [
        {
            "after a twentieth of the time": told,
            "rank correlation with the number that left": f"{pooled(some, name):.2f}",
            "starts": sum(map(len, some)),
        }
        for told, name in FEATURES.items()
    ]
    return ["", table(rows)]


def pooled(groups: list[list[Row]], name: str) -> float:
    """Return the correlation of centred ranks, over all groups."""
    pairs = [
        np.array([ranks([run[name][0] for run in g]), ranks([run["left"] for run in g])])
        for g in groups
    ]
    x, y = np.concatenate([p - p.mean(axis=1, keepdims=True) for p in pairs], axis=1)
    size = math.sqrt(float((x @ x) * (y @ y)))
    return float(x @ y) / size if size else math.nan


def by_start(groups: list[list[Row]]) -> list[str]:
    """Return what three or more starts have in common that were followed with every set."""
    each = [{run.get("start"): run for run in group} for group in groups]
    starts = [start for start in each[0] if all(start in one for one in each)] if each else []
    if len(each) < 2 or len(starts) < 3:
        return []
    rows = [
        {
            "start": start,
            f"left, mean of {len(each)} sets": mean([one[start]["left"] for one in each]),
            "in the largest group after a twentieth of the time": mean(
                [one[start]["heap_at"][0] for one in each]
            ),
        }
        for start in starts
    ]
    left = np.array([[one[start]["left"] for one in each] for start in starts], dtype=float)
    of_starts, of_sets = (f"{100 * part:.0f} %" for part in parts_of_variance(left))
    told = f"Of the variance of the {left.size} numbers {of_starts} lies between starts, {of_sets} "
    told += "between sets."
    return ["", table(rows), "", told]


def parts_of_variance(values: np.ndarray) -> tuple[float, float]:
    """Return the parts of the variance of a table between rows, and between columns."""
    away = values - values.mean()
    total = (away**2).mean()
    if not total:
        return math.nan, math.nan
    rows, columns = ((away.mean(axis=k) ** 2).mean() / total for k in (1, 0))
    return float(rows), float(columns)


def ranks(values: Sequence[float]) -> np.ndarray:
    """Return mean ranks, equal ones for equal values."""
    x = np.asarray(values, dtype=float)
    return np.asarray([(x < v).sum() + ((x == v).sum() - 1) / 2 for v in x], dtype=float)


# -------------------------------------------------------------------------------- pairs and singles


def driven(found: xr.Dataset) -> Iterator[Row]:
    """Yield rows of the study ``driven``: right- and left-handed pairs, and single dumbbells."""
    for axes, one in points(found):
        value = {str(name): float(x) for name, x in one.data_vars.items() if x.dtype.kind in "fi"}
        yield {
            **{words(name): short(x) for name, x in axes.items()},
            **headings(value, "right", "R"),
            "n": number(value["samples_right"], 0),
            "relaxation (s)": number(value["relaxation_right"], 0),
            "climb R": number(value["climb_rate_right"], 3),
            "corner": f"{number(100 * value['corner_right'], 0)} %",
            **headings(value, "left", "L"),
            "climb L": number(value["climb_rate_left"], 3),
            "held R, L": f"{value['held_right']:.0f}, {value['held_left']:.0f}",
            "rate (1/s)": number(value["single_rate"], 4),
            "kept": number(value["single_kept"], 2),
            "climb, single": number(value["single_climb_rate"], 3),
        }


def attracted(found: xr.Dataset) -> Iterator[Row]:
    """Yield rows of ``driven`` over attraction and scatter: how high, which heading, how fast."""
    for axes, one in points(found):
        value = {str(name): float(x) for name, x in one.data_vars.items() if x.dtype.kind in "fi"}
        yield {
            **{words(name): short(x) for name, x in axes.items()},
            "carried, single": with_error(
                value["single_carried"], value["single_carried_error"], 1, "°"
            ),
            "carried R": with_error(value["carried_right"], value["carried_right_error"], 1, "°"),
            "highest R": f"{number(value['highest_right'], 1)}°",
            **headings(value, "right", "R"),
            "climb R": number(value["climb_rate_right"], 2),
            **headings(value, "left", "L"),
            "climb L": number(value["climb_rate_left"], 2),
            "held R, L": f"{value['held_right']:.0f}, {value['held_left']:.0f}",
            "climb, single": number(value["single_climb_rate"], 2),
        }


def headings(value: dict[str, float], hand: str, letter: str) -> Row:
    """Return heading, its spread over the pairs, and whether it is steady."""
    spread_of = value[f"spread_{hand}"]
    return {
        f"heading {letter}": with_error(
            value[f"heading_{hand}"], value[f"heading_{hand}_error"], 2, "°"
        ),
        f"spread {letter}": "–" if math.isnan(spread_of) else f"{number(spread_of, 1)}°",
        f"steady {letter}": "yes" if value[f"settled_{hand}"] and spread_of < STEADY else "no",
    }


# -------------------------------------------------------------------------------------------- words


def table(rows: Sequence[Row]) -> str:
    """Return rows as a table of Markdown."""
    if not rows:
        return "No row was computed.\n"
    names = list(rows[0])
    lines = [names, ["---"] * len(names), *([row[name] for name in names] for row in rows)]
    return "".join("| " + " | ".join(map(str, line)) + " |\n" for line in lines)


def words(name: str) -> str:
    return {"sliding_ratio": "dynamic sliding over static", "dt": "step (s)"}.get(name, name)


def short(value: Any) -> str:
    return f"{value:.3g}" if isinstance(value, float) else str(value)


def number(value: float, digits: int) -> str:
    """Return a number with a minus sign, and a dash where there is none."""
    if math.isnan(value):
        return "–"
    return f"{value:.{digits}f}".replace("-", "−").replace("inf", "∞")


def with_error(value: float, error: float, digits: int, unit: str = "") -> str:
    """Return a value with its error, where there is one."""
    if math.isnan(value):
        return "–"
    told = number(value, digits)
    return f"{told}{unit}" if math.isnan(error) else f"{told} ± {error:.{digits}f}{unit}"


def mean(values: Sequence[float]) -> str:
    """Return a mean with its standard error."""
    x = np.asarray(values, dtype=float)
    error = float(x.std(ddof=1) / math.sqrt(len(x))) if len(x) > 1 else math.nan
    return with_error(float(x.mean()), error, 1)


def spread(values: np.ndarray, unit: str) -> str:
    """Return median and quartiles."""
    if not len(values):
        return "–"
    low, half, high = np.percentile(values, [25, 50, 75])
    return f"{half:.0f} ({low:.0f} to {high:.0f}){unit}"


def middle(values: Sequence[float]) -> str:
    return spread(np.asarray(values, dtype=float), "")


def share(flags: Sequence[bool]) -> str:
    return f"{100 * sum(flags) / len(flags):.0f} %" if flags else "–"


if __name__ == "__main__":
    main()
