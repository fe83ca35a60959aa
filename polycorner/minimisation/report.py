"""Certificates, minima and sensitivities as tables."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

from polycorner.printing import (
    Sheet,
    Table,
    angle_unit,
    coordinates,
    facts,
    listed,
    names,
    number,
    titled,
    units,
)

if TYPE_CHECKING:
    from polycorner.minimisation.certificate import Certificate
    from polycorner.minimisation.search import Minima
    from polycorner.minimisation.sensitivities import Sensitivity


def certificate_line(c: "Certificate") -> str:
    """Return a certificate in one line."""
    manifold = c.problem.polyhedron.manifold
    point = ", ".join(
        f"{name} = {number(x, 6)} {angle_unit(period)}".rstrip()
        for name, period, x in zip(manifold.names, manifold.periods, c.point, strict=True)
    )
    active = names(c.active, 40) or "nothing"
    return f"Certificate({c.verdict.name} at {point}; energy {number(c.energy, 6)}; on {active})"


def certificate_sheet(c: "Certificate") -> Sheet:
    """Return a certificate as tables of the point, the active functions and the directions."""
    manifold = c.problem.polyhedron.manifold
    residuals = c.residuals
    several = "" if c.multipliers_unique else "The multipliers are one choice of several."
    return Sheet(
        "Certificate",
        (
            facts(
                (
                    ("verdict", c.verdict.value),
                    ("energy", number(c.energy, 12)),
                    ("active", ", ".join(c.active) or "none"),
                    ("signature", "(p, q, r) = ({}, {}, {})".format(*c.signature)),
                    ("infeasibility", f"{residuals.infeasibility:.1e}"),
                    ("stationarity", f"{residuals.stationarity:.1e}"),
                    ("complementarity", f"{residuals.complementarity:.1e}"),
                )
            ),
            coordinates(manifold.names, manifold.periods, c.point.tolist()),
            _multipliers(c),
            several,
            Table(
                ("direction", "entrapment"),
                tuple((direction, kind.value) for direction, kind in c.entrapment.items()),
            ),
            units(manifold.periods),
        ),
    )


def _multipliers(c: "Certificate") -> Table:
    d, multipliers = c.problem.polyhedron, c.multipliers
    values = dict(
        zip((*d.names, *d.equation_names), c.analysis.local.values[:-1].tolist(), strict=True)
    )
    rows = [(name, number(values[name], 3), number(x)) for name, x in multipliers.items()]
    head: tuple[str, ...] = ("active function", "value", "multiplier dE/df")
    if not c.multipliers_unique:
        head = (*head, "least", "largest")
        ranges = c.multiplier_ranges.values()
        spans = [tuple(map(number, span)) for span in ranges]
        return Table(
            head,
            tuple((*row, *span) for row, span in zip(rows, spans, strict=True)),
            (1, 2, 3, 4),
        )
    return Table(head, tuple(rows), (1, 2))


def minima_sheet(found: "Minima") -> Sheet:
    """Return minima as a table, the lowest first, with their points where these are short."""
    rows = (
        (
            number(c.energy),
            str(count),
            "({}, {}, {})".format(*c.signature),
            c.verdict.name,
            names(c.active) or "-",
            *(number(x, 6) for x in _point(c)),
        )
        for c, count in zip(found, found.counts, strict=True)
    )
    head = ["energy", "starts", "(p, q, r)", "verdict", "active"]
    for c in found[:1]:
        manifold = c.problem.polyhedron.manifold
        head += map(titled, manifold.names[: len(_point(c))], manifold.periods)
    columns = (0, 1, *range(5, len(head)))
    return Sheet("Minima", (listed("", head, rows, len(found), columns), found.completeness))


def _point(c: "Certificate") -> list[float]:
    """Return the point where it has few enough coordinates for a row."""
    return c.point.tolist() if len(c.point) <= 3 else []


def sensitivity_sheet(s: "Sensitivity") -> Sheet:
    """Return derivatives as a table, a column for each parameter."""
    manifold = s.certificate.problem.polyhedron.manifold
    head = ("derivative of", *(f"d/d {name}" for name in s.rates))
    rows = tuple(
        (name, *(number(x, 6) for x in row)) for name, row in _derivatives(s, manifold.periods)
    )
    return Sheet(
        "Sensitivity", (Table(head, rows, tuple(range(1, len(head)))), units(manifold.periods))
    )


def _derivatives(
    s: "Sensitivity", periods: tuple[float, ...]
) -> "Iterator[tuple[str, list[float]]]":
    manifold = s.certificate.problem.polyhedron.manifold
    for name, period, row in zip(manifold.names, periods, s.point, strict=True):
        yield titled(name, period), row.tolist()
    yield "energy", s.energy.tolist()
    for name, derivative in s.multipliers.items():
        yield f"multiplier {name}", derivative.tolist()
