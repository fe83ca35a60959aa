"""``polycorner landscape dyad``: how deep dyads lie, and over which passes they open."""

from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Any

from polycorner.cli import (
    Telling,
    command,
    examples,
    fail,
    landscape_options,
    prepare,
    report_landscape,
    searched,
    working,
)
from polycorner.dumbbells.cli.options import chosen_pair, pair_options, parameters

if TYPE_CHECKING:
    from polycorner.dumbbells import RelativePlacements
    from polycorner.landscapes import Landscape


@command(epilog=examples("landscape dyad --out out", "landscape dyad --rod 1 --json"))
@pair_options
@landscape_options
def dyad(limits: dict[str, Any], as_json: bool, out: Path | None, **options: float) -> None:
    """Prove how deep dyads lie, and over which passes they open or change their hand.

    Heights are those over two dumbbells on the lowest line, in mm times the weight of a ball, while
    the pair hangs as low as it can; in the plane, the limit of the radius times that, in mm².
    Without --cap passes are sought a little beyond the one between the hands.
    """
    pair = chosen_pair(options)
    prepare(out)
    with working("searching", "boxes") as progress:
        from polycorner.dumbbells import RelativePlacements
        from polycorner.dumbbells.statics.depths import highest

        try:
            model = RelativePlacements(pair)
        except ValueError as error:
            fail(f"--rod: {str(error).removeprefix('pair: ')}")
        limits["cap"] = _energy(model, limits["cap"]) if "cap" in limits else highest(pair)
        limits |= {"box": model.box, "symmetry": model.symmetry, "progress": progress}
        found = searched(model.polyhedron, model.energy, **limits)
    unit, drawn = "mm²" if pair.is_plane else "mm", None
    if out is not None:
        from polycorner.dumbbells.pictures import draw_relative

        drawn = draw_relative(model)
    telling = Telling(unit, model.height, lambda it: names(model, it), drawn)
    report_landscape("dyad", parameters(pair), found, telling, as_json=as_json, out=out)


def _energy(model: "RelativePlacements", height: float) -> float:
    try:
        return model.energy_at(height)
    except ValueError as error:
        fail(f"--cap: {str(error).removeprefix('height: ')}")


def names(model: "RelativePlacements", found: "Landscape") -> list[str]:
    """Return the paper's names of minima: ``G`` is apart, others are held by contacts."""
    from polycorner.dumbbells.statics.minima import NAMES

    told = []
    for one in found.minima:
        lengths = Counter(map(len, one.active))
        kind = NAMES.get((lengths[4], lengths[3], lengths[2]), "".join(one.active))
        hand = model.pair.chirality(model.placement(one.point))
        free = one.kind == "locus" or hand is None
        told.append(kind if free else f"{kind}_{hand}")
    return told
