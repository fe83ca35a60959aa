"""Certificates as plain text."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from polycorner.minima.certificate import Certificate


def certificate_text(c: "Certificate") -> str:
    """Return a certificate as lines of aligned plain text."""
    names = c.problem.polyhedron.manifold.names
    residuals = c.residuals()
    point = ", ".join(f"{name} = {x:.9g}" for name, x in zip(names, c.point, strict=True))
    lines = [
        ("verdict", c.verdict.value),
        ("point", point),
        ("energy", f"{c.energy:.12g}"),
        ("active", ", ".join(c.active) or "none"),
        ("multipliers", _multipliers(c)),
        ("signature", "(p, q, r) = ({}, {}, {})".format(*c.signature())),
        ("entrapment", ", ".join(f"{d}: {e.value}" for d, e in c.entrapment().items()) or "none"),
        (
            "residuals",
            (
                f"infeasibility {residuals.infeasibility:.1e}, "
                f"stationarity {residuals.stationarity:.1e}, "
                f"complementarity {residuals.complementarity:.1e}"
            ),
        ),
    ]
    return "\n".join(f"{label:<12} {text}" for label, text in lines)


def _multipliers(c: "Certificate") -> str:
    listed = ", ".join(f"{name} {value:.9g}" for name, value in c.multipliers.items()) or "none"
    return listed if c.multipliers_unique else f"{listed} (one choice of several)"
