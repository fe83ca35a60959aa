"""``polycorner dyad``: the minima of a pair of dumbbells, certified."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from polycorner.cli.common import deliver, output_options, patience, prepare, write_answer, writing
from polycorner.cli.manner import console
from polycorner.dumbbells.cli.options import chosen_pair, pair_settings, parameters

if TYPE_CHECKING:
    from rich.table import Table

    from polycorner.dumbbells import DumbbellPair, DyadMinimum

DRAWING = "drawing"
WORDS = "finding and certifying (the first run on a machine compiles for about 20 seconds)"
EPILOG = """\b
Examples:
  polycorner dyad --length 16 --ball 3 --rod 1.5 --drum 125
  polycorner dyad --drum inf --json
  polycorner dyad --config examples/dyads.toml --rod 1 --out out
"""


@click.command(epilog=EPILOG)
@pair_settings
@output_options
def dyad(as_json: bool, out: Path | None, **options: float | None) -> None:
    """Find delta_R, delta_L and G of two dumbbells in a drum, and certify them."""
    pair = chosen_pair(None, options)
    prepare(out)
    with patience(WORDS):
        from polycorner.dumbbells import dyad_minima

        entries = dyad_minima(pair)
        answer = _answer(pair, entries)

    def write() -> list[Path]:
        if out is None:
            return []
        with patience(DRAWING):
            return _write(pair, entries, answer, out)

    deliver(answer, lambda: _print_tables(pair, entries, answer), write, as_json=as_json)


def _answer(pair: "DumbbellPair", entries: "tuple[DyadMinimum, ...]") -> dict[str, Any]:
    import math

    from polycorner.dumbbells import critical_rod_radius, paper_heading

    return {
        "parameters": parameters(pair),
        "minima": [_entry(entry) for entry in entries],
        "paper_heading_deg": paper_heading(pair),
        "plane_heading_deg": math.degrees(pair.plane_corner()[0]),
        "critical_rod_radius": critical_rod_radius(pair),
    }


def _entry(entry: "DyadMinimum") -> dict[str, Any]:
    certificate = entry.certificate
    residuals = certificate.residuals
    return {
        "name": entry.name,
        "heading_deg": list(entry.headings),
        "azimuth_deg": list(entry.azimuths),
        "lateral": list(entry.lateral),
        "axial_gap": entry.axial_gap,
        "height": entry.height,
        "active": list(certificate.active),
        "multipliers": entry.multipliers,
        "signature": list(certificate.signature),
        "entrapment": certificate.entrapment_counts,
        "entrapment_by_direction": {
            direction: kind.value for direction, kind in certificate.entrapment.items()
        },
        "chirality": certificate.stratum.chirality,
        "is_minimum": certificate.is_minimum,
        "verdict": certificate.verdict.value,
        "residuals": {
            "infeasibility": residuals.infeasibility,
            "stationarity": residuals.stationarity,
            "complementarity": residuals.complementarity,
        },
    }


def _write(
    pair: "DumbbellPair",
    entries: "tuple[DyadMinimum, ...]",
    answer: dict[str, Any],
    out: Path,
) -> list[Path]:
    import numpy as np

    from polycorner.dumbbells.pictures import dyads
    from polycorner.pictures import style as plots

    written = [write_answer(answer, out, "dyad.json")]
    with writing(out):
        written += [plots.save(dyads.draw_pair(e), out / f"{e.name}.png") for e in entries]
    longest = 2 * (pair.drum_radius - pair.ball_radius)
    lengths = np.linspace(2 * pair.ball_radius, min(10 * pair.ball_radius, longest), 49)
    rods = sorted({0.25 * pair.ball_radius, pair.rod_radius, 0.8 * pair.ball_radius})
    figure = dyads.draw_heading(pair, lengths.tolist(), rods)
    with writing(out):
        return [*written, plots.save(figure, out / "heading.png")]


def _print_tables(
    pair: "DumbbellPair", entries: "tuple[DyadMinimum, ...]", answer: dict[str, Any]
) -> None:
    terminal = console()
    where = "the developed plane" if pair.is_plane else f"a drum of radius {pair.drum_radius:g} mm"
    terminal.print(
        f"Two dumbbells (l = {pair.length:g}, r = {pair.ball_radius:g}, "
        f"t = {pair.rod_radius:g} mm) in {where}"
    )
    terminal.print(_table(entries))
    for entry in entries:
        terminal.print(f"{entry.name}: {entry.certificate.verdict.value}")
    computed = abs(entries[0].headings[0])
    terminal.print(
        f"heading: computed {computed:.6f} deg, plane {answer['plane_heading_deg']:.6f} deg, "
        f"paper's arctan(r/l) {answer['paper_heading_deg']:.6f} deg"
    )


def _table(entries: "tuple[DyadMinimum, ...]") -> "Table":
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("")
    for entry in entries:
        table.add_column(entry.name)
    for label, cells in _rows(entries):
        table.add_row(label, *cells)
    return table


def _rows(entries: "tuple[DyadMinimum, ...]") -> list[tuple[str, list[str]]]:
    certificates = [entry.certificate for entry in entries]
    unit = "mm" if entries[0].pair.is_plane else "dE/dgap"
    residuals = [certificate.residuals for certificate in certificates]
    return [
        ("heading (deg)", ["{:.6f}  {:.6f}".format(*e.headings) for e in entries]),
        ("azimuth (deg)", ["{:.6f}  {:.6f}".format(*e.azimuths) for e in entries]),
        ("axial gap (mm)", [f"{e.axial_gap:.6f}" for e in entries]),
        ("height (mm)", [f"{e.height:.9f}" for e in entries]),
        ("minimum", ["yes" if c.is_minimum else "no" for c in certificates]),
        (f"multipliers ({unit})", [_lines(e.multipliers, "{:.9f}") for e in entries]),
        ("(p, q, r)", ["({}, {}, {})".format(*c.signature) for c in certificates]),
        (
            "entrapment",
            [_lines({d: k.value for d, k in c.entrapment.items()}, "{}") for c in certificates],
        ),
        ("infeasibility", [f"{r.infeasibility:.1e}" for r in residuals]),
        ("stationarity", [f"{r.stationarity:.1e}" for r in residuals]),
        ("complementarity", [f"{r.complementarity:.1e}" for r in residuals]),
    ]


def _lines(values: dict[str, Any], form: str) -> str:
    width = max((len(name) for name in values), default=0)
    return "\n".join(f"{name:<{width}}  {form.format(v)}" for name, v in values.items()) or "none"
