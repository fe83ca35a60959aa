"""``polycorner atlas dyad``: corners, edges and components of the placements of a pair."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from polycorner.cli.atlas import KEPT, examples, search_options
from polycorner.cli.common import fail, given
from polycorner.cli.report import keys
from polycorner.cli.search import Search
from polycorner.dumbbells.cli.options import chosen_pair, pair_settings, parameters

UNMATCHED = "relabelling leads to corners that are not in this section: not counted up to it"


@click.command(epilog=examples("dyad --plane --json", "dyad --heading 5 --out out") + KEPT)
@pair_settings
@click.option("--plane", is_flag=True, help="The developed plane: the same as --drum inf.")
@click.option("--heading", type=float, help="Mean heading in the drum, degrees. [0]")
@search_options
def dyad(
    plane: bool, heading: float | None, as_json: bool, out: Path | None, seed: int, budget: int,
    resume: bool, **options: float | None,
) -> None:  # fmt: skip
    """Walk through the placements of two dumbbells: corners, and the motions that join them."""
    if given("plane") and given("drum"):
        fail(f"--plane: expected no --drum beside it; got {options['drum']:g}")
    if plane:
        options["drum"] = math.inf
    pair = chosen_pair(None, options)
    if heading is not None and (pair.is_plane or not math.isfinite(heading)):
        fail(f"--heading: expected an angle in degrees, of a pair in a drum; got {heading:g}")
    degrees = heading or 0.0
    from polycorner.dumbbells.statics.skeleton import PairAtlas, pair_starts

    angle = math.radians(degrees)
    polyhedron = pair.polyhedron if pair.is_plane else pair.section(angle)
    search = Search("dyad", parameters(pair) | {"heading": degrees}, out, seed, budget)
    found = search.run(
        polyhedron, lambda rng: pair_starts(pair, rng, angle), pair.symmetry, resume=resume
    )
    whole = PairAtlas(pair, found, None if pair.is_plane else angle)
    extra: dict[str, Any] = {"components": keys(whole.components)}
    try:
        if search.finished:
            extra["components_ordered"] = keys(whole.components_ordered)
            extra["components_unordered"] = keys(whole.components_unordered)
    except ValueError:
        search.drawn = False
        found = replace(found, notes=(*found.notes, UNMATCHED))
    answer = search.answer(found, extra, names=[whole.kind(c) for c in found.corners])
    for corner in answer["corners"]:
        corner["dimension"] += 0 if pair.is_plane else 1
        corner["rank"] -= 0 if pair.is_plane else 1

    def draw(folder: Path) -> list[Path]:
        from polycorner.dumbbells.pictures import draw_atlas, draw_motions, write_solid
        from polycorner.pictures import save

        return [
            save(draw_atlas(whole), folder / "atlas.png"),
            save(draw_motions(whole), folder / "motions.png"),
            *write_solid(whole, folder),
        ]

    search.finish(answer, as_json=as_json, draw=draw)
