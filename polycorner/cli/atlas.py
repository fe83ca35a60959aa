"""``polycorner atlas``: corners, edges and faces of a model, and how they are joined."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from polycorner.cli.lazy import LazyGroup
from polycorner.cli.options import (
    Command,
    examples,
    option,
    output_options,
    seed_option,
)
from polycorner.cli.report import critical_sheet, label
from polycorner.cli.search import DiskSearch, SkeletonSearch

if TYPE_CHECKING:
    from polycorner.models.pinball import Pinball
    from polycorner.models.tutorial import Tutorial

STARTS = 60  # random points from which a search in the plane descends
CROWDED = 12  # corners above which a picture is clearer without their names
RESUMING = """
A search is saved every few seconds.  Ctrl-C ends it and reports what was found (exit code 130);
the same command with --resume continues it, also after the process was killed.
"""


@click.group(
    cls=LazyGroup,
    prefix="atlas.",
    epilog=examples("atlas dyad --plane", "atlas spheres --count 6", "atlas tutorial --out out"),
    no_args_is_help=True,
)
def atlas() -> None:
    """List corners, edges and faces of a model.

    A search descends from starting points to corners, traces every edge to the next corner and
    reports how the faces are joined.
    """


resume_option = option(
    "--resume",
    is_flag=True,
    group="Search",
    help="Continue a search that was stopped, killed or out of budget.",
)


def search_options(function: Command) -> Command:
    """Add ``--seed``, ``--budget``, ``--workers``, ``--resume`` and the options of every answer."""
    for add in (
        output_options,
        resume_option,
        option(
            "--workers", type=click.IntRange(min=1), group="Search",
            help="Processes that walk along edges. [this one]",
        ),
        option(
            "--budget", type=click.IntRange(min=1), default=100_000, group="Search",
            help="Most edges to trace.",
        ),
        seed_option("the random directions"),
    ):  # fmt: skip
        function = add(function)
    return function


def _epilog(*lines: str) -> str:
    return examples(*(f"atlas {line}" for line in lines)) + RESUMING


@atlas.command(epilog=_epilog("spheres --count 6"))
@option("--count", type=click.IntRange(min=2), default=6, group="Model", help="Number of spheres.")
@search_options
def spheres(
    count: int, as_json: bool, out: Path | None, seed: int, budget: int, workers: int | None,
    resume: bool,
) -> None:  # fmt: skip
    """List rigid clusters of sticky unit spheres.

    Clusters are counted up to congruence and relabelling; edges are motions with one degree of
    freedom between them.
    """
    from polycorner.models.spheres import SphereCluster

    model = SphereCluster(count)
    search = SkeletonSearch("spheres", {"count": count}, out, seed, budget, workers)
    found = search.run(model.polyhedron, lambda _: model.starts(), model.symmetry, resume=resume)
    special = [k for k, corner in enumerate(found.corners) if corner.singular]
    extra = {
        "corners_count": len(found.corners),
        "edges_count": len(found.edges),
        "faces_count": len(found.faces),
        "singular_count": len(special),
    }

    def draw(folder: Path) -> list[Path]:
        from polycorner.pictures import clusters, style

        if not found.corners:
            return []
        points = [corner.point for corner in found.corners]
        figure = clusters.draw_clusters(model, points, singular=special)
        return [style.save(figure, folder / "clusters.png")]

    search.finish(search.answer(found, extra), as_json=as_json, draw=draw)


@atlas.command(epilog=_epilog("tutorial", "tutorial --out out"))
@search_options
def tutorial(
    as_json: bool, out: Path | None, seed: int, budget: int, workers: int | None, resume: bool
) -> None:
    """List the sides of a planar region with seven corners."""
    from polycorner.models.tutorial import Tutorial

    _planar("tutorial", Tutorial(), as_json, out, seed, budget, workers, resume)


@atlas.command(epilog=_epilog("pinball --seed 1 --json"))
@search_options
def pinball(
    as_json: bool, out: Path | None, seed: int, budget: int, workers: int | None, resume: bool
) -> None:
    """List the walls of a pinball board with pins, wedges and cups."""
    from polycorner.models.pinball import Pinball

    _planar("pinball", Pinball(), as_json, out, seed, budget, workers, resume)


@atlas.command(
    epilog=_epilog("disks --count 2", "disks --count 2 --torus hexagonal --json"),
)
@option("--count", type=click.IntRange(min=1), default=3, group="Model", help="Number of disks.")
@option(
    "--torus", type=click.Choice(["square", "hexagonal"]), default="square", group="Model",
    help="Lattice of the torus.",
)  # fmt: skip
@seed_option("the random starts")
@resume_option
@output_options
def disks(count: int, torus: str, seed: int, resume: bool, as_json: bool, out: Path | None) -> None:
    """List the critical radii of hard disks on a flat torus.

    At a critical radius the contacts of the disks carry a stress in equilibrium.
    """
    from polycorner.models import TorusDisks

    model = TorusDisks(count, "hexagonal" if torus == "hexagonal" else "square")
    search = DiskSearch("disks", {"count": count, "torus": torus}, out, seed)
    found = search.run(model, resume=resume)
    rows = [
        {
            "radius": c.radius,
            "index": c.index,
            "nullity": c.nullity,
            "contacts": len(c.contacts),
            "hits": c.hits,
        }
        for c in found
    ]
    answer = {
        "model": "disks",
        "parameters": search.parameters,
        "critical": rows,
        "complete": "exhausted" if search.finished else "interrupted",
    }

    def draw(folder: Path) -> list[Path]:
        from polycorner.pictures import disks, style

        return [style.save(disks.draw_critical(model, found), folder / "critical.png")]

    search.finish(answer, as_json=as_json, draw=draw, sheet=critical_sheet)


def _planar(
    name: str,
    model: "Tutorial | Pinball",
    as_json: bool,
    out: Path | None,
    seed: int,
    budget: int,
    workers: int | None,
    resume: bool,
) -> None:
    search = SkeletonSearch(name, {}, out, seed, budget, workers)
    found = search.run(model.polyhedron, lambda rng: model.starts(rng, STARTS), None, resume=resume)

    def draw(folder: Path) -> list[Path]:
        import numpy as np

        from polycorner.pictures import regions, style
        from polycorner.skeletons.refinement import traced

        curves = [traced(found, edge) for edge in found.edges]
        low, high = np.vstack(curves).min(axis=0), np.vstack(curves).max(axis=0)
        margin = 0.06 * (high - low).max()
        crowded = len(found.corners) > CROWDED
        corners = [
            ("" if crowded else label(k), corner.point) for k, corner in enumerate(found.corners)
        ]
        window = (low[0] - margin, high[0] + margin, low[1] - margin, high[1] + margin)
        figure = regions.draw_region(model.polyhedron, window, corners=corners, edges=curves)
        return [style.save(figure, folder / f"{name}.png")]

    search.finish(search.answer(found, {}), as_json=as_json, draw=draw)
