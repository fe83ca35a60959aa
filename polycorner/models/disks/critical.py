"""Search for the critical configurations of disks on a torus, round by round."""

import copy
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from polycorner import checks, forms
from polycorner.models.disks.configurations import (
    CriticalConfiguration,
    Disks,
    coincide,
    described,
    described_at,
    placed,
    with_rattlers,
)
from polycorner.models.disks.critical_points import solved
from polycorner.models.disks.smoothing import NearlyCritical, candidates, smooth
from polycorner.models.disks.torus import OWN
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT
from polycorner.values import Checked

STARTS_PER_DISK, ROUNDS = 80, 8

_ENTRY = {"centres": forms.many(forms.number()), "hits": forms.count}
_RECORD = {
    "starts": forms.optional(partial(checks.whole, least=1)),
    "attempts": forms.count,
    "rounds": forms.count,
    "stage": forms.many(forms.entries(_ENTRY)),
    "found": forms.many(forms.entries(_ENTRY)),
}
Configurations = tuple[CriticalConfiguration, ...]


@dataclass(frozen=True, eq=False)
class CriticalSearch(Checked):
    """A search for critical configurations, finished or not.

    Configurations with rattlers are those of fewer disks with room for the others, so that two
    disks are searched first, then three, and so on.

    Attributes
    ----------
    model : Disks
        The disks.
    starts : int or None
        Random starts of each round; None for 80 for each disk.
    rng : numpy.random.Generator
        Draws the starts of the next round.
    disks : int
        Number of disks that the next round searches.
    attempts : int
        Rounds done with so many disks.
    rounds : int
        Rounds done with any number of disks.
    stage : tuple of CriticalConfiguration
        What was found of so many disks.
    found : tuple of CriticalConfiguration
        What was found of the model by the stages before.
    """

    model: Disks
    starts: int | None
    rng: np.random.Generator
    disks: int = 2
    attempts: int = 0
    rounds: int = 0
    stage: Configurations = ()
    found: Configurations = ()

    @property
    def complete(self) -> bool:
        """Whether no round is left."""
        return self.disks > self.model.count

    @property
    def configurations(self) -> Configurations:
        """The critical configurations found so far, the largest radius first.

        Equal radii by index and nullity.
        """
        if self.model.count == 1:
            centre, alone = np.array([0.0, 0.0, 0.5]), {OWN: 1.0}
            return (CriticalConfiguration(centre, 0.5, 0, 0, (OWN,), alone, 1, ((1,),), False, 0),)
        whole = list(self.found)
        if self.disks == self.model.count:
            for c in self.stage:
                _add(self.model, whole, c)
        return tuple(sorted(whole, key=lambda c: (-round(c.radius, 9), c.index, c.nullity)))

    def advanced(self) -> "CriticalSearch":
        """Return the search after one more round; an interruption of it loses this round only."""
        if self.complete:
            return self
        rng, model = copy.deepcopy(self.rng), self.model.fewer(self.disks)
        stage = list(self.stage)
        begin = rng.random((self.starts or STARTS_PER_DISK * model.count, 2 * model.count))
        for c in candidates(model.pairs, begin, rng, _moved):
            _add(model, stage, _settled(model, c))
        attempts = self.attempts + 1
        after = replace(
            self, rng=rng, attempts=attempts, rounds=self.rounds + 1, stage=tuple(stage)
        )
        settled = len(stage) == len(self.stage) or attempts == ROUNDS
        return _next_stage(after) if settled else after

    @property
    def record(self) -> dict[str, Any]:
        """The search as plain values for a JSON file; see :meth:`restored`."""
        return {
            "starts": self.starts,
            "disks": self.disks,
            "attempts": self.attempts,
            "rounds": self.rounds,
            "stage": [_entry(c) for c in self.stage],
            "found": [_entry(c) for c in self.found],
            "random": self.rng.bit_generator.state,
        }

    @classmethod
    def restored(cls, model: Disks, record: Mapping[str, Any]) -> "CriticalSearch":
        """Return a search from its record; every configuration is judged anew.

        Raises
        ------
        ValueError
            If a configuration of the record is not critical, a number cannot be one of a search,
            or the generator is not PCG64.
        """
        forms.entries(_RECORD)("record", record)
        most = max(model.count + 1, 3)  # where a search for one disk begins
        disks = checks.whole("record.disks", record["disks"], least=2, most=most)
        rng = forms.read_generator("record.random", record["random"])
        checks.instance("record.random", rng.bit_generator, np.random.PCG64)
        return cls(
            model=model,
            starts=record["starts"],
            rng=rng,
            disks=disks,
            attempts=record["attempts"],
            rounds=record["rounds"],
            stage=_configurations(model.fewer(disks), record["stage"]),
            found=_configurations(model, record["found"]),
        )


def _next_stage(search: CriticalSearch) -> CriticalSearch:
    """Return the search with one more disk; its generator is advanced."""
    found = list(search.found)
    for c in search.stage:
        if search.disks == search.model.count:
            _add(search.model, found, c)
        elif not c.rattlers:
            _add(search.model, found, with_rattlers(search.model, c, search.rng))
    return replace(search, disks=search.disks + 1, attempts=0, stage=(), found=tuple(found))


def _entry(c: CriticalConfiguration) -> dict[str, Any]:
    return {"centres": c.point[:-1].tolist(), "hits": c.hits}


def _configurations(model: Disks, entries: list[dict[str, Any]]) -> Configurations:
    judged = [described_at(model, np.array(entry["centres"]), entry["hits"]) for entry in entries]
    critical = tuple(c for c in judged if c is not None)
    if len(critical) < len(judged):
        msg = "record: expected critical configurations; got centres that are not critical"
        raise ValueError(msg)
    return critical


def _add(
    model: Disks, found: list[CriticalConfiguration], new: CriticalConfiguration | None
) -> None:
    """Add a configuration, or its hits to an equal one; of two keep that with fewer contacts."""
    if new is None:
        return
    for k, old in enumerate(found):
        if coincide(model, old, new, DEFAULT.same):
            kept = min(old, new, key=lambda c: len(c.contacts))
            found[k] = replace(kept, hits=old.hits + new.hits)
            return
    found.append(new)


def _moved(points: Array, rng: np.random.Generator) -> Array:
    """Return configurations with one disk of each moved to a random place."""
    centres = points.reshape(len(points), -1, 2).copy()
    which = rng.integers(0, centres.shape[1], len(points))
    centres[np.arange(len(points)), which] = rng.random((len(points), 2))
    return centres.reshape(points.shape)


def _settled(model: Disks, c: NearlyCritical) -> CriticalConfiguration | None:
    """Solve for the corner near a candidate, away from the cut of the chart."""
    centres = placed(c.point)
    weights = smooth(model.pairs, centres[None], c.sharpness).weights[0]
    chosen = np.flatnonzero(weights > c.loaded * weights.max())
    exact = solved(model.distances, centres, chosen, weights[chosen])
    return None if exact is None else described(model, exact, c.hits)
