"""``polycorner atlas``: corners, edges and faces of a model, and how they are joined."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from polycorner.cli.lazy import group
from polycorner.cli.options import examples, option, output_options, seed_option
from polycorner.cli.search import (
    RESUMING,
    Begin,
    DiskSearch,
    SkeletonSearch,
    critical_sheet,
    resume_option,
    search_options,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from polycorner.polyhedra.polyhedron import Polyhedron

    Starts = Callable[[Any], Any]

STARTS = 60  # random points from which a search in the plane descends


@group("atlas", "atlas dyad --plane", "atlas spheres --count 6", "atlas tutorial --out out")
def atlas() -> None:
    """List corners, edges and faces of a model.

    A search descends from starting points to corners, traces every edge to the next corner and
    reports how the faces are joined.
    """


def _epilog(*lines: str) -> str:
    return examples(*(f"atlas {line}" for line in lines)) + RESUMING


@atlas.command(epilog=_epilog("spheres --count 6"))
@option("--count", type=click.IntRange(min=2), default=6, group="Model", help="Number of spheres.")
@search_options
def spheres(count: int, begin: Begin) -> None:
    """List rigid clusters of sticky unit spheres.

    Clusters are counted up to congruence and relabelling; edges are motions with one degree of
    freedom between them.
    """
    from polycorner.models.spheres import SphereCluster

    model = SphereCluster(count)
    search = begin("spheres", {"count": count})
    found = search.run(model.polyhedron, lambda _: model.starts(), model.symmetry)
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

    search.finish(search.answer(found, extra), draw)


@atlas.command(epilog=_epilog("tutorial", "tutorial --out out"))
@search_options
def tutorial(begin: Begin) -> None:
    """List the sides of a planar region with seven corners."""
    from polycorner.models.planar import Tutorial

    region = Tutorial()
    planar(begin("tutorial", {}), region.polyhedron, lambda rng: region.starts(rng, STARTS))


@atlas.command(epilog=_epilog("pinball --seed 1 --json"))
@search_options
def pinball(begin: Begin) -> None:
    """List the walls of a pinball board with pins, wedges and cups."""
    from polycorner.models.pinball import Pinball

    board = Pinball()
    planar(begin("pinball", {}), board.polyhedron, lambda rng: board.starts(rng, STARTS))


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
    chosen = {"count": count, "torus": torus}
    search = DiskSearch("disks", chosen, out=out, seed=seed, resume=resume, as_json=as_json)
    found = search.run(model)
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

    search.finish(answer, draw, critical_sheet)


def skeletal(search: SkeletonSearch, polyhedron: "Polyhedron", starts: "Starts") -> None:
    """Search a polyhedron and report it without a picture."""
    found = search.run(polyhedron, starts, None)
    search.finish(search.answer(found, {}), lambda _: [])


def planar(search: SkeletonSearch, polyhedron: "Polyhedron", starts: "Starts") -> None:
    """Search a region of the plane and report it with a picture."""
    found = search.run(polyhedron, starts, None)

    def draw(folder: Path) -> list[Path]:
        from polycorner.pictures import regions, style

        return [style.save(regions.draw_region(found), folder / f"{search.model}.png")]

    search.finish(search.answer(found, {}), draw)
