"""``polycorner measure``: how often corners are seen, what edges weigh, and rates."""

import math
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from polycorner.cli.lazy import group
from polycorner.cli.options import Command, added, command, examples, option
from polycorner.cli.output import fail, working
from polycorner.cli.problems import inner_starts, read, with_problem
from polycorner.cli.search import RESUMING, Begin, SkeletonSearch, search_options

if TYPE_CHECKING:
    from polycorner.measures.estimates import Estimate
    from polycorner.printing import Sheet
    from polycorner.skeletons.elements import Skeleton

Rows = list[dict[str, Any]]


@group(
    "measure",
    "measure spheres --count 6",
    "measure spheres --count 6 --dimension 2 --stickiness 60 --json",
)
def measure() -> None:
    """Weigh the corners and edges of a model, as sticky contacts do.

    A search finds them as in atlas.  Without --stickiness contacts are as sticky as can be, so that
    corners with the most contacts have all the weight.
    """


def weighting_options(function: Command) -> Command:
    """Add ``--stickiness``, ``--stiffness``, ``--diffusion`` and ``--faces``."""
    above = click.FloatRange(min=0, min_open=True)
    stickiness = option(
        "--stickiness", type=above, default=math.inf, group="Measure",
        help="Factor of a contact, in the units of its function; with a finite one rates are told.",
    )  # fmt: skip
    stiffness = option(
        "--stiffness", type=above, default=None, group="Measure",
        help="Second derivative of U / T at the bottom of a contact's well: weighs singular corners"
        " and those with more contacts than dimensions, too.",
    )  # fmt: skip
    diffusion = option(
        "--diffusion", type=above, default=1.0, group="Measure",
        help="Diffusion constant of every coordinate, for the rates.",
    )  # fmt: skip
    faces = option(
        "--faces", type=click.IntRange(0, 10**8), default=0, group="Measure",
        help="Points of each of four chains that weigh the faces, too; 0 for none.",
    )  # fmt: skip
    return added(function, stickiness, stiffness, diffusion, faces)


@measure.command(
    epilog=examples("measure spheres --count 6", "measure spheres --count 7 --out out") + RESUMING
)
@option("--count", type=click.IntRange(min=2), default=6, group="Model", help="Number of spheres.")
@option(
    "--dimension", type=click.IntRange(2, 3), default=3, group="Model",
    help="2 for discs in the plane.",
)  # fmt: skip
@weighting_options
@search_options
def spheres(count: int, dimension: int, begin: Begin, **ways: Any) -> None:
    """Tell how often each rigid cluster of sticky unit spheres is seen.

    The stickiness is that of |x|^2 - 1: twice the one of the distance, in diameters.
    """
    from polycorner.models.spheres import SphereCluster

    model = SphereCluster(count, dimension)
    search = begin("spheres", {"count": count, "dimension": dimension})
    found = search.run(model.polyhedron, lambda _: model.starts(), model.symmetry)

    def draw(folder: Path, rows: Rows) -> list[Path]:
        import numpy as np

        from polycorner.pictures import clusters, style

        known = [row for row in rows if row["probability"] is not None]
        known.sort(key=lambda row: -row["probability"])
        if not known:
            return []
        points = np.array([row["point"] for row in known]).reshape(len(known), count, dimension)
        flat = np.pad(points, ((0, 0), (0, 0), (0, 3 - dimension))).reshape(len(known), -1)
        labels = [f"{row['name']}: {100 * row['probability']:.3g} %" for row in known]
        figure = clusters.draw_clusters(SphereCluster(count), flat, labels=labels)
        return [style.save(figure, folder / "clusters.png")]

    weigh(search, found, draw, **ways)


@command(epilog=examples("measure region.toml --stickiness 20 --json"))
@with_problem
@weighting_options
@search_options
def measure_file(file: Path, begin: Begin, **ways: Any) -> None:
    """Weigh the corners and edges of the set in FILE, by its energy as E / T if there is one."""
    problem = read(file)
    search = begin(file.stem, {"file": str(file.resolve())})
    found = search.run(problem.polyhedron, partial(inner_starts, problem), None)
    weigh(search, found, lambda _folder, _rows: [], problem.energy, **ways)


def weigh(
    search: SkeletonSearch,
    found: "Skeleton",
    draw: Callable[[Path, Rows], list[Path]],
    energy: Any = None,
    *,
    stickiness: float,
    stiffness: float | None,
    diffusion: float,
    faces: int,
) -> None:
    """Weigh a skeleton and report it."""
    given = {"stickiness": stickiness, "stiffness": stiffness, "diffusion": diffusion}
    for name, value in given.items():
        if value is not None and math.isnan(value):
            fail(f"--{name}: expected a number above 0; got nan")
    with working("measuring", "edges") as progress:
        import numpy as np

        from polycorner.measures import Weighting, face_weights, measure, rates

        try:
            weighting = Weighting(stickiness=stickiness, stiffness=stiffness, energy=energy)
            measured = measure(found, weighting=weighting, progress=progress)
            rng = np.random.default_rng(search.seed)
            weighed = face_weights(measured, points=faces, rng=rng) if faces else None
        except ValueError as error:
            fail(str(error))
    answer = search.answer(found, {})
    numbers = (measured.corners, measured.corner_orders, measured.probabilities)
    for row, z, order, p in zip(answer["corners"], *numbers, strict=True):
        row |= {"weight": _known(z), "symmetry_number": int(order), "probability": _known(p)}
    several = (measured.edges, measured.edge_orders, measured.resistances, measured.errors)
    for row, z, order, r, away in zip(answer["edges"], *several, strict=True):
        row |= {"weight": _known(z), "symmetry_number": int(order), "resistance": _known(r)}
        row["error"] = _known(away)
    answer["parameters"] = {
        **answer["parameters"],
        **given,
        "stickiness": None if math.isinf(stickiness) else stickiness,
    }
    answer["partition"] = {str(d): z for d, z in measured.partition.items()}
    notes = measured.notes
    answer["faces_weight"] = None
    if weighed is not None:
        answer["faces_weight"] = _estimate(weighed.total)
        for row, one in zip(answer["faces"], weighed.by_face, strict=True):
            row["weight"] = None if one is None else _estimate(one)
    answer["rates"] = None
    if not math.isinf(stickiness) and not np.isnan(measured.corners).any():
        between = rates(measured, diffusion=diffusion)
        answer["rates"], notes = between.matrix.tolist(), between.notes
    answer["notes"] += notes
    search.finish(
        answer,
        lambda folder: draw(folder, answer["corners"]),
        partial(_sheet, measured.balance),
        "measure.json",
    )


def _estimate(found: "Estimate") -> dict[str, float]:
    return {"value": found.value, "error": found.error}


def _known(value: float) -> float | None:
    return None if math.isnan(value) else float(value)


def _sheet(balance: str, answer: dict[str, Any]) -> "Sheet":
    from polycorner.printing import Sheet, Table, number

    def told(value: float | None) -> str:
        return "declined" if value is None else number(value, 9)

    rows = tuple(
        (
            row["name"],
            str(len(row["active"])),
            told(row["weight"]),
            str(row["symmetry_number"]),
            told(row["probability"]),
        )
        for row in answer["corners"]
    )
    head = ("corner", "contacts", "weight", "symmetry number", "probability")
    parts: list[Table | str] = [Table(head, rows, (1, 2, 3, 4))]
    if answer["rates"] is not None:
        names = [row["name"] for row in answer["corners"]]
        matrix = tuple(
            (name, *(number(k, 6) for k in row))
            for name, row in zip(names, answer["rates"], strict=True)
        )
        columns = tuple(range(1, len(names) + 1))
        parts.append(Table(("rate from", *names), matrix, columns))
    parts.append(balance)
    if answer["faces_weight"] is not None:
        total = answer["faces_weight"]
        faces = tuple(
            (", ".join(row["active"]), told(one["value"]), f"{one['error']:.1g}")
            for row in answer["faces"]
            if (one := row["weight"]) is not None
        )
        if faces:
            parts.append(Table(("face", "weight", "error"), faces, (1, 2)))
        parts.append(
            f"Without stickiness all faces weigh {told(total['value'])} +- {total['error']:.1g}."
        )
    return Sheet("", (*parts, *(f"note: {note}" for note in answer["notes"])))
