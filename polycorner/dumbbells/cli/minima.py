"""``polycorner minima dyad``: the local minima of two dumbbells."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from polycorner.cli import command, examples, prepare, report_minima, start_options, working
from polycorner.dumbbells.cli.options import chosen_pair, pair_options, parameters

if TYPE_CHECKING:
    from polycorner.minimisation import Certificate


@command(
    epilog=examples("minima dyad --starts 300", "minima dyad --rod 0.3 --starts 2000 --json"),
)
@pair_options
@start_options
def dyad(starts: int, seed: int, as_json: bool, out: Path | None, **options: float) -> None:
    """Find the local minima of two dumbbells.

    Minima that differ by a shift along the drum or by relabelling are one.
    """
    pair = chosen_pair(options)
    prepare(out)
    with working("minimising", "starts") as progress:
        import numpy as np

        from polycorner.dumbbells.statics.minima import kind_of, pair_minima

        found = pair_minima(pair, starts=starts, rng=seed, progress=progress)

    def described(certificate: "Certificate") -> dict[str, Any]:
        hand = certificate.stratum.chirality
        name = kind_of(certificate)
        return {
            "name": f"{name}_{hand}" if hand else name,
            "chirality": hand,
            "heading_deg": np.degrees(pair.heading(certificate.point)).tolist(),
        }

    unit = "mm²" if pair.is_plane else "mm"
    report_minima("dyad", parameters(pair), found, described, unit, as_json=as_json, out=out)
