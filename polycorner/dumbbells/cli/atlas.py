"""``polycorner atlas dyad``: corners, edges and faces of the placements of a pair."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

from polycorner.cli import (
    RESUMING,
    Begin,
    command,
    counts_by_dimension,
    examples,
    fail,
    given,
    option,
    search_options,
)
from polycorner.dumbbells.cli.options import GROUP, chosen_pair, pair_options, parameters

UNMATCHED = "relabelling leads to corners that are not in this section: not counted up to it"


@command(epilog=examples("atlas dyad --plane", "atlas dyad --heading 5 --out out") + RESUMING)
@pair_options
@option("--plane", is_flag=True, help="The developed plane, like --drum inf.", group=GROUP)
@option(
    "--heading", type=float, default=0.0, help="Mean heading in the drum, degrees.", group=GROUP
)
@search_options
def dyad(plane: bool, heading: float, begin: Begin, **options: float) -> None:
    """List corners and edges of the placements of two dumbbells.

    In the drum the placements are a section at one mean heading.
    """
    if given("plane") and given("drum"):
        fail(f"--plane: expected no --drum beside it; got {options['drum']:g}")
    if plane:
        options["drum"] = math.inf
    pair = chosen_pair(options)
    if not math.isfinite(heading) or (pair.is_plane and heading):
        fail(f"--heading: expected an angle in degrees, for a pair in a drum; got {heading:g}")
    from polycorner.dumbbells.statics.skeleton import PairAtlas, pair_starts

    angle = math.radians(heading)
    polyhedron = pair.polyhedron if pair.is_plane else pair.section(angle)
    search = begin("dyad", parameters(pair) | {"heading_deg": heading})
    found = search.run(polyhedron, lambda rng: pair_starts(pair, rng, angle), pair.symmetry)
    whole = PairAtlas(pair, found, None if pair.is_plane else angle)
    extra: dict[str, Any] = {"components": counts_by_dimension(whole.components)}
    try:
        if search.finished:
            extra["components_ordered"] = counts_by_dimension(whole.components_ordered)
            extra["components_unordered"] = counts_by_dimension(whole.components_unordered)
    except ValueError:
        search.drawn = False
        found = replace(found, notes=(*found.notes, UNMATCHED))
    answer = search.answer(found, extra, kinds=[whole.kind(c) for c in found.corners])
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

    search.finish(answer, draw)
