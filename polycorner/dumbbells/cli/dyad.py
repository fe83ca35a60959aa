"""``polycorner dyad``: the minima of a pair of dumbbells, certified."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from polycorner.cli import (
    command,
    deliver,
    examples,
    output_options,
    prepare,
    shown,
    working,
    write_answer,
    writing,
)
from polycorner.dumbbells.cli.options import chosen_pair, pair_options, parameters

if TYPE_CHECKING:
    from polycorner.dumbbells import DumbbellPair, DyadMinimum
    from polycorner.toolkit import Sheet

    Minima = tuple[DyadMinimum, ...]

EPILOG = examples(
    "dyad --length 16 --ball 3 --rod 1.5 --drum 125",
    "dyad --drum inf --json",
    "dyad --rod 1 --out out",
)


@command(epilog=EPILOG)
@pair_options
@output_options
def dyad(as_json: bool, out: Path | None, **options: float) -> None:
    """Find and certify the minima delta_R, delta_L and G of two dumbbells."""
    pair = chosen_pair(options)
    prepare(out)
    with working("minimising and certifying"):
        from polycorner.dumbbells import dyad_minima

        entries = dyad_minima(pair)
        answer = _answer(pair, entries)

    def write(folder: Path) -> list[Path]:
        with working("drawing"):
            return _write(pair, entries, answer, folder)

    deliver(answer, lambda: shown(_sheet(pair, entries, answer)), write, as_json=as_json, out=out)


def _answer(pair: "DumbbellPair", entries: "Minima") -> dict[str, Any]:
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
    pair: "DumbbellPair", entries: "Minima", answer: dict[str, Any], out: Path
) -> list[Path]:
    import numpy as np

    from polycorner.dumbbells.pictures import dyads
    from polycorner.pictures import save

    written = [write_answer(answer, out, "dyad.json")]
    with writing(out):
        written += [save(dyads.draw_pair(e), out / f"{e.name}.png") for e in entries]
    longest = 2 * (pair.drum_radius - pair.ball_radius)
    lengths = np.linspace(2 * pair.ball_radius, min(10 * pair.ball_radius, longest), 49)
    rods = sorted({0.25 * pair.ball_radius, pair.rod_radius, 0.8 * pair.ball_radius})
    figure = dyads.draw_heading(pair, lengths.tolist(), rods)
    with writing(out):
        return [*written, save(figure, out / "heading.png")]


def _sheet(pair: "DumbbellPair", entries: "Minima", answer: dict[str, Any]) -> "Sheet":
    from polycorner.toolkit import Sheet, Table, facts

    place = "the developed plane" if pair.is_plane else f"a drum of radius {pair.drum_radius:g} mm"
    names = tuple(entry.name for entry in entries)
    unit = "mm" if pair.is_plane else "dE/dgap"
    minima = answer["minima"]
    headings = (
        f"heading: computed {abs(minima[0]['heading_deg'][0]):.6f} deg, "
        f"plane {answer['plane_heading_deg']:.6f} deg, "
        f"paper's arctan(r/l) {answer['paper_heading_deg']:.6f} deg"
    )
    return Sheet(
        f"Two dumbbells (l = {pair.length:g}, r = {pair.ball_radius:g}, "
        f"t = {pair.rod_radius:g} mm) in {place}",
        (
            Table(("", *names), _placements(minima)),
            Table((f"multiplier ({unit})", *names), _union(minima, "multipliers", "{:.9f}")),
            Table(("entrapment", *names), _union(minima, "entrapment_by_direction", "{}")),
            facts((m["name"], m["verdict"]) for m in minima),
            headings,
        ),
    )


def _placements(minima: list[dict[str, Any]]) -> tuple[tuple[str, ...], ...]:
    rows: tuple[tuple[str, Callable[[dict[str, Any]], str]], ...] = (
        ("heading of A (deg)", lambda m: f"{m['heading_deg'][0]:.6f}"),
        ("heading of B (deg)", lambda m: f"{m['heading_deg'][1]:.6f}"),
        ("azimuth of A (deg)", lambda m: f"{m['azimuth_deg'][0]:.6f}"),
        ("azimuth of B (deg)", lambda m: f"{m['azimuth_deg'][1]:.6f}"),
        ("axial gap (mm)", lambda m: f"{m['axial_gap']:.6f}"),
        ("height (mm)", lambda m: f"{m['height']:.9f}"),
        ("minimum", lambda m: "yes" if m["is_minimum"] else "no"),
        ("(p, q, r)", lambda m: "({}, {}, {})".format(*m["signature"])),
        ("infeasibility", lambda m: f"{m['residuals']['infeasibility']:.1e}"),
        ("stationarity", lambda m: f"{m['residuals']['stationarity']:.1e}"),
        ("complementarity", lambda m: f"{m['residuals']['complementarity']:.1e}"),
    )
    return tuple((label, *map(shown_as, minima)) for label, shown_as in rows)


def _union(minima: list[dict[str, Any]], key: str, form: str) -> tuple[tuple[str, ...], ...]:
    """Return a row for each name that any of the minima has under a key."""
    names = dict.fromkeys(name for m in minima for name in m[key])
    return tuple(
        (name, *(form.format(m[key][name]) if name in m[key] else "-" for m in minima))
        for name in names
    )
