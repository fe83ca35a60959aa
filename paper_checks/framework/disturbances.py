"""Kinds of noise by which observations are judged, each with its strength and time."""

from collections.abc import Sequence
from typing import NamedTuple

ALONG = "shaking along"


class Disturbance(NamedTuple):
    """One kind of noise; see :func:`polycorner.dumbbells.studies.driven.driven`."""

    kind: str
    strength: float
    scale: float

    def __str__(self) -> str:
        """Return the kind with its strength and time or frequencies, in words."""
        if not self.strength:
            return "no noise"
        if self.kind == "kicks":
            held = f"held for {1000 * self.scale:g} ms"
            return f"kicks of {self.strength:g} mm/s per $\\sqrt{{\\mathrm{{s}}}}$ {held}"
        if self.kind == "chatter":
            return f"chatter of {self.strength:g}"
        band = f"{0.05 / self.scale:.2g} to {0.5 / self.scale:.2g} Hz"
        way = self.kind.replace(ALONG, "shaking along the axis")
        return f"{way} with {self.strength:g} mm/s² at {band}"


def which(some: Sequence[Disturbance], kinds: Sequence[Disturbance]) -> str:
    """Name the kinds of noise under which a statement holds, among those tried."""
    if len(some) == len(kinds):
        return "of any of these kinds" if len(kinds) > 1 else str(kinds[0])
    return "; ".join(map(str, some))
