"""Critical configurations of disks on a torus: described, compared, completed by rattlers."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from polycorner.models.disks.critical_points import judged
from polycorner.models.disks.torus import IMAGES, Pairs, components, translates, uncut
from polycorner.printing import Described
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT
from polycorner.values import Checked

TRIES, PLACES = 40, 500


class Disks(Protocol):
    """Equal disks on a torus: what their critical configurations depend on."""

    @property
    def count(self) -> int:
        """The number of disks."""

    @property
    def contacts(self) -> tuple[str, ...]:
        """Names of the distances, one for each pair and image."""

    @property
    def ends(self) -> Mapping[str, tuple[int, int, tuple[int, int]]]:
        """The two disks of each contact, and the image of the second."""

    @property
    def basis(self) -> Array:
        """The lattice vectors as rows."""

    @property
    def point_group(self) -> NDArray[np.intp]:
        """The lattice's symmetries that fix the origin."""

    @property
    def pairs(self) -> Pairs:
        """The distances, grouped by pair."""

    def distances(self, centres: Array, order: int) -> tuple[Array, ...]:
        """Return the distances of all pairs and images, and their derivatives."""

    def fewer(self, count: int) -> "Disks":
        """Return so many disks on the same torus."""


@dataclass(frozen=True, eq=False)
class CriticalConfiguration(Checked, Described):
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
        Number of descents that ended there; 0 if it was only built from fewer disks.
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


def coincide(
    model: Disks,
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


def placed(centres: Array) -> Array:
    """Translate centres ``(2n,)`` so that none is near the cut of the chart."""
    return np.stack([uncut(along) for along in centres.reshape(-1, 2).T], axis=1).ravel()


def described(model: Disks, centres: Array, hits: int = 0) -> CriticalConfiguration | None:
    """Return the critical configuration at centres ``(2n,)``, moved away from the chart's cut.

    None where the configuration is not critical.
    """
    return described_at(model, placed(centres), hits)


def described_at(model: Disks, centres: Array, hits: int = 0) -> CriticalConfiguration | None:
    """Return the critical configuration at centres ``(2n,)`` as they are; None if it is not."""
    corner = judged(model.distances, centres, np.tile(np.eye(2), model.count))
    if corner is None:
        return None
    names = [model.contacts[k] for k in corner.active]
    stress = dict(zip(names, corner.stress.tolist(), strict=True))
    loaded = [model.ends[name][:2] for name, force in stress.items() if force > 0]
    return CriticalConfiguration(
        point=np.append(centres, corner.value / 2),
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


def with_rattlers(
    model: Disks, c: CriticalConfiguration, rng: np.random.Generator
) -> CriticalConfiguration | None:
    """Return a configuration of fewer disks with rattlers in its free room; None without room.

    Rattlers are placed where there is most room first, then at random.
    """
    for attempt in range(TRIES):
        centres = c.point[:-1]
        while len(centres) < 2 * model.count:
            places = rng.random((PLACES, 2))
            room = _room(model, centres.reshape(-1, 2), places) - 2 * c.radius
            fits = np.flatnonzero(room > DEFAULT.same)
            if not len(fits):
                break
            chosen = np.argmax(room) if attempt == 0 else rng.choice(fits)
            centres = np.append(centres, places[chosen])
        else:
            return described(model, centres)
    return None


def _room(model: Disks, centres: Array, places: Array) -> Array:
    """Return the distance from each place to the nearest image of a centre."""
    apart = places[:, None] - centres
    images = (apart - np.round(apart))[:, :, None] + np.array(IMAGES)
    lengths = np.linalg.norm(images @ model.basis, axis=-1)
    return np.asarray(lengths.min(axis=(1, 2)), dtype=np.float64)
