"""Kinds of noise by which observations are judged, each with its strength and time."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

from polycorner.dumbbells.drum import DumbbellDrum
from polycorner.dumbbells.studies.driven import disturbed, kicks_of
from polycorner.motion import Noise

ALONG = "shaking along"
HELD = 0.003  # s, for which kicks are held


class Disturbance(NamedTuple):
    """One kind of noise, as in :func:`polycorner.dumbbells.studies.driven.driven`, or with kicks.

    ``kicks`` is their strength, held for 3 ms, in addition to the other kind.
    """

    kind: str
    strength: float
    scale: float
    kicks: float = 0.0

    def acting_on(self, drum: DumbbellDrum, seed: int) -> tuple[DumbbellDrum, Noise]:
        """Return the drum as it is disturbed, and the noise."""
        drum, noise = disturbed(drum, self.kind, self.strength, self.scale, seed)
        if self.kicks:
            noise = replace(noise, kicks=kicks_of(drum, self.kicks), kick_time=HELD)
        return drum, noise

    def step(self, usual: float, kicked: float) -> float:
        """Return the step in s, which is a shorter one under kicks."""
        return kicked if self.kicks or self.kind == "kicks" else usual

    def __str__(self) -> str:
        """Return the kind with its strength and time or frequencies, in words."""
        if self.kicks:
            return f"{self._replace(kicks=0.0)} and {_kicks(self.kicks, HELD)}"
        if not self.strength:
            return "no noise"
        if self.kind == "kicks":
            return _kicks(self.strength, self.scale)
        if self.kind == "chatter":
            return f"chatter of {self.strength:g}"
        band = f"{0.05 / self.scale:.2g} to {0.5 / self.scale:.2g} Hz"
        way = self.kind.replace(ALONG, "shaking along the axis")
        return f"{way} with {self.strength:g} mm/s² at {band}"


def _kicks(strength: float, held: float) -> str:
    unit = r"mm/s per $\sqrt{\mathrm{s}}$"
    return f"kicks of {strength:g} {unit} held for {1000 * held:g} ms"


class Friction(NamedTuple):
    """Static coefficients; the dynamic ones are in proportion to those of the drum's defaults."""

    sliding: float
    rolling: float
    rubbing: float

    def __str__(self) -> str:
        """Return the coefficients in words."""
        return f"sliding {self.sliding:g}, rolling {self.rolling:g}, rubbing {self.rubbing:g}"

    def of(self, drum: DumbbellDrum) -> DumbbellDrum:
        """Return the drum with these coefficients."""
        usual = DumbbellDrum.sliding, DumbbellDrum.rolling, DumbbellDrum.rubbing
        pairs = zip(self, usual, strict=True)
        sliding, rolling, rubbing = ((mu, mu * pair[1] / pair[0]) for mu, pair in pairs)
        return replace(drum, sliding=sliding, rolling=rolling, rubbing=rubbing)


TEXT = Friction(0.3, 0.1, 0.3)  # the paper gives no rubbing
CAPTIONS = Friction(0.72, 0.1, 0.1)  # sliding from the angle of 8 degrees of the caption (F2c)


def which(some: Sequence[Disturbance], kinds: Sequence[Disturbance]) -> str:
    """Name the kinds of noise under which a statement holds, among those tried."""
    if len(some) == len(kinds):
        return "of any of these kinds" if len(kinds) > 1 else str(kinds[0])
    return "; ".join(map(str, some))
