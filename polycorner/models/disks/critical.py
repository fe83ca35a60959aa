"""Critical configurations of disks on a torus: searched, judged, named, and told apart."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from polycorner.models.disks.corners import judged, solved
from polycorner.models.disks.search import Candidate, candidates, smooth
from polycorner.models.disks.torus import IMAGES, OWN, components, translates, uncut
from polycorner.progress import Progress
from polycorner.spaces.manifold import Array

if TYPE_CHECKING:
    from polycorner.models.disks.disks import TorusDisks

Configurations = list["CriticalConfiguration"]

SAME = 1e-6
STARTS_PER_DISK, ROUNDS = 80, 8
TRIES, PLACES = 40, 500


@dataclass(frozen=True, eq=False)
class CriticalConfiguration:
    """A configuration at which the largest common radius is critical.

    Attributes
    ----------
    point : (2n + 1,) array
        Centres in lattice coordinates, no centre near the cut at 1/2, and the radius.
    radius : float
        Half the least distance.
    index : int
        Morse index; see :meth:`TorusDisks.critical`.
    nullity : int
        Dimension of the family it lies in: two for every stressed component but one.
    contacts : tuple of str
        All contacts, stressed or not.
    stress : mapping from str to float
        Force in every contact; the forces sum to 1.
    stresses : int
        Number of independent equilibrium stresses of the stressed contacts.
    components : tuple of tuple of int
        Disks (numbered from 1) joined by stressed contacts; a disk alone is a rattler.
    degenerate : bool
        Whether the index is no Morse-Bott index: a contact carries no stress, or some other
        stress leaves a family with more directions (sliding rows, say) in whose closure the
        configuration lies.
    hits : int
        How many descents ended there; 0 if it was only built from fewer disks.
    """

    point: Array
    radius: float
    index: int
    nullity: int
    contacts: tuple[str, ...]
    stress: Mapping[str, float]
    stresses: int
    components: tuple[tuple[int, ...], ...]
    degenerate: bool
    hits: int

    @property
    def rattlers(self) -> tuple[int, ...]:
        """The disks without stress, numbered from 1."""
        return tuple(part[0] for part in self.components if len(part) == 1)

    @property
    def idle(self) -> tuple[str, ...]:
        """The contacts that no stress in equilibrium loads."""
        return tuple(name for name in self.contacts if self.stress[name] == 0)


def critical_configurations(
    model: "TorusDisks", rng: np.random.Generator, starts: int | None, progress: Progress | None
) -> tuple[CriticalConfiguration, ...]:
    """Return the critical configurations of a model; see :meth:`TorusDisks.critical`."""
    if model.count == 1:
        centre, alone = np.array([0.0, 0.0, 0.5]), {OWN: 1.0}
        return (CriticalConfiguration(centre, 0.5, 0, 0, (OWN,), alone, 1, ((1,),), False, 0),)
    found: Configurations = []
    for fewer in range(2, model.count):
        smaller = replace(model, count=fewer)
        for c in _searched(smaller, rng, starts, progress):
            if not c.rattlers:
                _add(model, found, _with_rattlers(model, c, rng))
    for c in _searched(model, rng, starts, progress):
        _add(model, found, c)
    return tuple(sorted(found, key=lambda c: (-round(c.radius, 9), c.index, c.nullity)))


def coincide(
    model: "TorusDisks",
    first: CriticalConfiguration,
    second: CriticalConfiguration,
    tolerance: float,
) -> bool:
    """Whether two critical configurations are equal; see :meth:`TorusDisks.same`."""
    kinds = [
        (c.index, c.nullity, c.stresses, sorted(map(len, c.components))) for c in (first, second)
    ]
    if kinds[0] != kinds[1] or abs(first.radius - second.radius) > tolerance:
        return False
    ones, others = _parts(first), _parts(second)
    return any(_paired([one @ g.T for one in ones], others, tolerance) for g in model.point_group)


def _parts(c: CriticalConfiguration) -> list[Array]:
    centres = c.point[:-1].reshape(-1, 2)
    return [centres[[i - 1 for i in part]] for part in c.components]


def _paired(ones: list[Array], others: list[Array], tolerance: float) -> bool:
    """Whether translations, one for each, carry the sets of points to the others in some order."""
    # Being a translate is an equivalence relation, so any partner will do.
    left = list(others)
    for one in ones:
        partner = next((k for k, o in enumerate(left) if translates(one, o, tolerance)), None)
        if partner is None:
            return False
        del left[partner]
    return True


def _add(model: "TorusDisks", found: Configurations, new: CriticalConfiguration | None) -> None:
    """Add a configuration, or its hits to an equal one; of two, keep the one less in touch."""
    if new is None:
        return
    for k, old in enumerate(found):
        if coincide(model, old, new, SAME):
            kept = min(old, new, key=lambda c: len(c.contacts))
            found[k] = replace(kept, hits=old.hits + new.hits)
            return
    found.append(new)


def _searched(
    model: "TorusDisks", rng: np.random.Generator, starts: int | None, progress: Progress | None
) -> Configurations:
    """Repeat the search until a round finds nothing new."""
    found: Configurations = []
    for attempt in range(1, ROUNDS + 1):
        before = len(found)
        begin = rng.random((starts or STARTS_PER_DISK * model.count, 2 * model.count))
        for c in candidates(model.pairs, begin, rng, _moved):
            _add(model, found, _settled(model, c))
        if progress is not None:
            note = f"{model.count} disks, round {attempt}: {len(found)} critical configurations"
            progress(attempt, None, note)
        if len(found) == before:
            break
    return found


def _moved(points: Array, rng: np.random.Generator) -> Array:
    """Return configurations with one disk each put somewhere else."""
    centres = points.reshape(len(points), -1, 2).copy()
    which = rng.integers(0, centres.shape[1], len(points))
    centres[np.arange(len(points)), which] = rng.random((len(points), 2))
    return centres.reshape(points.shape)


def _settled(model: "TorusDisks", c: Candidate) -> CriticalConfiguration | None:
    """Solve for the corner near a candidate, away from the cut of the chart."""
    placed = _placed(c.point)
    weights = smooth(model.pairs, placed[None], c.sharpness).weights[0]
    chosen = np.flatnonzero(weights > c.loaded * weights.max())
    exact = solved(model.distances, placed, chosen, weights[chosen])
    return None if exact is None else described(model, exact, c.hits)


def _placed(centres: Array) -> Array:
    """Translate centres ``(2n,)`` so that none is near the cut of the chart."""
    return np.stack([uncut(along) for along in centres.reshape(-1, 2).T], axis=1).ravel()


def described(model: "TorusDisks", centres: Array, hits: int = 0) -> CriticalConfiguration | None:
    """Move centres ``(2n,)`` away from the chart's cut; say what touches there, and how hard.

    None where the configuration is not critical.
    """
    placed = _placed(centres)
    corner = judged(model.distances, placed, np.tile(np.eye(2), model.count))
    if corner is None:
        return None
    names = [model.gaps[k].name for k in corner.active]
    stress = dict(zip(names, corner.stress.tolist(), strict=True))
    loaded = [model.ends[name][:2] for name, force in stress.items() if force > 0]
    return CriticalConfiguration(
        point=np.append(placed, corner.value / 2),
        radius=corner.value / 2,
        index=corner.index,
        nullity=corner.nullity,
        contacts=tuple(names),
        stress=stress,
        stresses=corner.stresses,
        components=components(model.count, loaded),
        degenerate=corner.degenerate,
        hits=hits,
    )


def _with_rattlers(
    model: "TorusDisks", c: CriticalConfiguration, rng: np.random.Generator
) -> CriticalConfiguration | None:
    """Put the missing disks where there is most room, or anywhere with room; None if none."""
    for attempt in range(TRIES):
        centres = c.point[:-1]
        while len(centres) < 2 * model.count:
            places = rng.random((PLACES, 2))
            room = _room(model, centres.reshape(-1, 2), places) - 2 * c.radius
            fits = np.flatnonzero(room > SAME)
            if not len(fits):
                break
            chosen = np.argmax(room) if attempt == 0 else rng.choice(fits)
            centres = np.append(centres, places[chosen])
        else:
            return described(model, centres)
    return None


def _room(model: "TorusDisks", centres: Array, places: Array) -> Array:
    """Return the distance from each place to the nearest image of a centre."""
    apart = places[:, None] - centres
    images = (apart - np.round(apart))[:, :, None] + np.array(IMAGES)
    lengths = np.linalg.norm(images @ model.basis, axis=-1)
    return np.asarray(lengths.min(axis=(1, 2)), dtype=np.float64)
