"""``polycorner atlas``: corners, edges and faces of a model, and how they hang together."""

from pathlib import Path
from typing import Any

import click

from polycorner.cli.common import (
    fail,
    output_options,
    seed_option,
    settings_option,
)
from polycorner.cli.lazy import LazyGroup
from polycorner.cli.manner import Command
from polycorner.cli.search import Search

MEMBERS = {"dyad": "polycorner.dumbbells.cli.atlas:dyad"}
# Random points that a search in the plane falls from.
STARTS = 60
# Corners above which a picture is clearer without their numbers.
CROWDED = 12
KEPT = """
Ctrl-C ends a search, keeps it and reports what was found (exit code 130);
the same command with --resume goes on from there.
"""


def examples(*lines: str) -> str:
    """Return the end of a help text: examples of how a model is called."""
    shown = "\n".join(f"  polycorner atlas {line}" for line in lines)
    return f"\b\nExamples:\n{shown}\n"


EPILOG = examples("dyad --plane --json", "spheres --count 8", "tutorial --out out") + KEPT


@click.group(cls=LazyGroup, members=MEMBERS, epilog=EPILOG, no_args_is_help=True)
def atlas() -> None:
    """Walk from corner to corner of a model and report how its faces hang together."""


def search_options(command: Command) -> Command:
    """Add ``--seed``, ``--budget`` and ``--resume``, and what every answer is written with."""
    command = output_options(command)
    for option in (
        click.option("--resume", is_flag=True, help="Go on with the search that was interrupted."),
        click.option("--budget", type=int, default=100_000, help="Edges to walk at most. [100000]"),
        seed_option("the random directions"),
    ):
        command = option(command)
    return command


@atlas.command(epilog=examples("spheres --count 7", "spheres --count 8 --out out") + KEPT)
@settings_option
@click.option("--count", type=int, default=6, help="Number of spheres. [6]")
@search_options
def spheres(
    count: int, as_json: bool, out: Path | None, seed: int, budget: int, resume: bool
) -> None:
    """List rigid clusters of sticky unit spheres up to congruence and relabelling."""
    from polycorner.models.spheres import SphereCluster

    try:
        model = SphereCluster(count)
    except ValueError as error:
        fail(f"--{error}")
    search = Search("spheres", {"count": count}, out, seed, budget)
    found = search.run(model.polyhedron, lambda _: model.starts(), model.symmetry, resume=resume)
    singular = sum(corner.singular for corner in found.corners)
    extra = {
        "corners_count": len(found.corners),
        "edges_count": len(found.edges),
        "faces_count": len(found.faces),
        "singular_count": singular,
    }
    answer = search.answer(found, extra)

    def draw(folder: Path) -> list[Path]:
        from polycorner.pictures import clusters
        from polycorner.pictures import style as plots

        if not found.corners:
            return []
        special = [k for k, corner in enumerate(found.corners) if corner.singular]
        points = [corner.point for corner in found.corners]
        figure = clusters.draw_clusters(model, points, singular=special)
        return [plots.save(figure, folder / "clusters.png")]

    search.finish(answer, as_json=as_json, draw=draw)


@atlas.command(epilog=examples("tutorial", "tutorial --out out") + KEPT)
@settings_option
@search_options
def tutorial(as_json: bool, out: Path | None, seed: int, budget: int, resume: bool) -> None:
    """Walk around a planar region with seven corners, locally convex but not convex."""
    from polycorner.models.tutorial import Tutorial

    _planar("tutorial", Tutorial(), as_json, out, seed, budget, resume)


@atlas.command(epilog=examples("pinball --seed 1", "pinball --json --out out") + KEPT)
@settings_option
@search_options
def pinball(as_json: bool, out: Path | None, seed: int, budget: int, resume: bool) -> None:
    """Walk around a board with pins and wedges: corners that trap and corners that split."""
    from polycorner.models.pinball import Pinball

    _planar("pinball", Pinball(), as_json, out, seed, budget, resume)


@atlas.command(epilog=examples("disks --count 4", "disks --count 2 --torus hexagonal --json"))
@settings_option
@click.option("--count", type=int, default=3, help="Number of disks. [3]")
@click.option(
    "--torus", type=click.Choice(["square", "hexagonal"]), default="square", help="[square]"
)
@seed_option("the random starts")
@output_options
def disks(count: int, torus: str, seed: int, as_json: bool, out: Path | None) -> None:
    """List the critical largest common radii of hard disks on a flat torus."""
    import numpy as np

    from polycorner.models.disks.disks import TorusDisks

    try:
        model = TorusDisks(count, "hexagonal" if torus == "hexagonal" else "square")
    except (TypeError, ValueError) as error:
        fail(f"--{error}")
    search = Search("disks", {"count": count, "torus": torus}, out, seed, 1)
    with search.patience() as progress:
        found = model.critical(np.random.default_rng(seed), progress=progress)
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
    answer = {"model": "disks", "parameters": search.parameters, "critical": rows}

    def draw(folder: Path) -> list[Path]:
        from polycorner.pictures import disks as torus
        from polycorner.pictures import style as plots

        return [plots.save(torus.draw_critical(model, found), folder / "critical.png")]

    search.finish(answer, as_json=as_json, draw=draw)


def _planar(
    name: str, model: Any, as_json: bool, out: Path | None, seed: int, budget: int, resume: bool
) -> None:
    search = Search(name, {}, out, seed, budget)
    found = search.run(model.polyhedron, lambda rng: model.starts(rng, STARTS), None, resume=resume)
    answer = search.answer(found, {})

    def draw(folder: Path) -> list[Path]:
        import numpy as np

        from polycorner.pictures import regions
        from polycorner.pictures import style as plots
        from polycorner.skeletons.refinement import traced

        curves = [traced(found, edge) for edge in found.edges]
        low, high = np.vstack(curves).min(axis=0), np.vstack(curves).max(axis=0)
        crowded = len(found.corners) > CROWDED
        room = 0.06 * (high - low).max()
        figure = regions.draw_region(
            model.polyhedron,
            (low[0] - room, high[0] + room, low[1] - room, high[1] + room),
            corners=[
                ("" if crowded else f"C{k}", corner.point) for k, corner in enumerate(found.corners)
            ],
            edges=curves,
        )
        return [plots.save(figure, folder / f"{name}.png")]

    search.finish(answer, as_json=as_json, draw=draw)
