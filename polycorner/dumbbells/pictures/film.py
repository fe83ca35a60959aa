"""Films: dumbbells at many instants, with contacts, strata and energies, for pages to play."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polycorner.dumbbells.drum import DumbbellDrum, drum_of
from polycorner.dumbbells.dynamics.pairs import DumbbellLengths, Handed, dyads_among
from polycorner.dumbbells.formulas import CONTACTS
from polycorner.dumbbells.pair import DumbbellPair
from polycorner.dumbbells.pictures.bodies import (
    WallPatch,
    contact_point,
    dumbbell_centres,
    wall_around,
)
from polycorner.dumbbells.pictures.movies import chosen_frames
from polycorner.dumbbells.pictures.symbols import energy_unit
from polycorner.motion import Trajectory
from polycorner.polyhedra import Stratum, stratum_at
from polycorner.toolkit import DEFAULT, Array, Checked, checked, finite, rank, reals, refuse

if TYPE_CHECKING:
    from polycorner.toolkit import Touch

TOUCHING = 1e-6  # scaled distance within which a contact of a configuration counts as closed
FRAMES = 1000  # of a long run, at most
HANDS: Mapping[str | None, str] = {"R": "right-handed", "L": "left-handed", None: "none"}
FIRST, SECOND, SINGLE, RIGHT, LEFT = range(5)  # roles of dumbbells, by which they are coloured


@dataclass(frozen=True)
class Words:
    """Texts beside a frame.

    Attributes
    ----------
    stratum : str
        The face of the polyhedron: its dimension, rank and local type; empty if not computed.
    chirality : str
    """

    stratum: str
    chirality: str


@dataclass(frozen=True, eq=False)
class Film(Checked):
    """Dumbbells at ``T`` instants.

    Attributes
    ----------
    title, note : str
        A title, and a sentence of description.
    pair : DumbbellPair
        The lengths.
    times : (T,) array
        Times in ``unit``: seconds, or ball radii along a path.
    centres : (T, N, 2, 3) array
        Ball centres in mm; NaN for dumbbells that have left.
    roles : (T, N) array of int
        Roles of dumbbells: 0 and 1 the members of a pair; 2 single, 3 in a right-handed
        and 4 in a left-handed dyad.
    energies : mapping from str to (T,) array
        By name with unit.
    contacts : tuple of T mappings from str to (3,) array
        Closed contacts and their points, in mm.
    words : tuple of T Words
    wall : WallPatch
    spin : float
        Of the drum, rad/s.
    """

    title: str
    note: str
    pair: DumbbellPair
    times: Array
    unit: str
    centres: Array
    roles: NDArray[np.int64]
    energies: Mapping[str, Array]
    contacts: tuple[Mapping[str, Array], ...]
    words: tuple[Words, ...]
    wall: WallPatch
    spin: float = 0.0

    def __len__(self) -> int:
        """Return the number of instants."""
        return len(self.times)


def stratum_words(stratum: Stratum) -> str:
    """Return the description of a stratum, such as ``dimension 3, rank 3, quadrant``."""
    return f"dimension {stratum.dimension}, rank {stratum.rank}, {stratum.local_type.name.lower()}"


def energy_name(pair: DumbbellPair) -> str:
    """Return the name of the energy of a pair with its unit."""
    return f"Energy ({energy_unit(pair)})"


# ----------------------------------------------------------------------------------------- a pair


@checked
def pair_film(
    pair: DumbbellPair,
    q: ArrayLike,
    *,
    times: ArrayLike | None = None,
    unit: str = "",
    title: str = "Two dumbbells",
    note: str = "",
    tolerance: float = TOUCHING,
) -> Film:
    """Return a path of a pair ``(T, 6)``, or one configuration ``(6,)``, as a film.

    Strata and chirality are those of :func:`~polycorner.stratum_at` at every point.

    Parameters
    ----------
    pair : DumbbellPair
    q : (T, 6) or (6,) array
    times : (T,) array, optional
        Increasing; default the arc length of the path in ball radii.
    unit : str, optional
        Of the times.
    title, note : str, optional
        Heading of the film.
    tolerance : float, optional
        Scaled distance within which a contact counts as closed.

    Raises
    ------
    ValueError
        For arrays that do not fit, or times that do not increase.
    """
    points = np.atleast_2d(finite(reals("q", q), "q"))
    if points.ndim != 2 or points.shape[1] != 6 or not len(points):
        refuse("q", "shape (T, 6) with T >= 1", np.shape(q))
    if times is None:
        scales = pair.manifold.scale_array
        steps = np.linalg.norm(pair.manifold.difference(points[1:], points[:-1]) / scales, axis=1)
        instants, unit = np.concatenate([[0.0], np.cumsum(steps)]), unit or "ball radii"
    else:
        instants = _increasing(times, len(points))
    strata = [stratum_at(pair.polyhedron, point, tolerance=tolerance) for point in points]
    centres = pair.ball_centres(points)
    contacts = tuple(
        {name: contact_point(pair, balls, name) for name in stratum.active}
        for balls, stratum in zip(centres, strata, strict=True)
    )
    return Film(
        title,
        note,
        pair,
        instants,
        unit,
        centres.reshape(-1, 2, 2, 3),
        np.tile([FIRST, SECOND], (len(points), 1)),
        {energy_name(pair): np.asarray(pair.energy.value(points))},
        contacts,
        tuple(Words(stratum_words(s), HANDS[s.chirality]) for s in strata),
        wall_around(pair, centres),
    )


def _increasing(times: ArrayLike, count: int) -> Array:
    instants = finite(reals("times", times), "times")
    if instants.shape != (count,) or not (np.diff(instants) > 0).all():
        refuse("times", f"{count} increasing numbers", instants)
    return instants


# ------------------------------------------------------------------------------------------ a run


@checked
def run_film(
    run: Trajectory, *, frames: int = FRAMES, title: str = "Dumbbells in the drum"
) -> Film:
    """Return a motion in the drum as a film of at most ``frames`` of its instants.

    Contacts are those recorded with the motion, named ``A1b`` for one or two dumbbells and
    ``3-7 A1b`` for more.  For a pair the film gives the face of the polyhedron, from the gradients
    of the closed contacts, and the chirality; for more dumbbells, the number of dyads of each
    chirality (:func:`~polycorner.dumbbells.dynamics.pairs.dyads_among`).
    """
    path, drum = run, drum_of(run)
    chosen = chosen_frames(len(path), frames)
    q = np.where(path.present[chosen][..., None], path.q[chosen], np.nan)
    centres = dumbbell_centres(drum.pair, np.nan_to_num(q))
    centres[~path.present[chosen]] = np.nan
    shots = [_Shot.of(run, k, balls) for k, balls in zip(chosen, centres, strict=True)]
    return motion_film(
        title,
        drum,
        path,
        chosen,
        centres,
        [shot.roles for shot in shots],
        [shot.contacts for shot in shots],
        [Words(shot.face, shot.hands) for shot in shots],
    )


def motion_film(
    title: str,
    drum: DumbbellDrum,
    path: Trajectory,
    chosen: Sequence[int],
    centres: Array,
    roles: Sequence[Sequence[int]],
    contacts: "Sequence[Mapping[str, Array]]",
    words: Sequence[Words],
) -> Film:
    """Return the film of a motion in a drum, of what is seen at the chosen instants."""
    return Film(
        title,
        described(drum),
        drum.pair,
        np.asarray(path.times[chosen]),
        "s",
        centres,
        np.array(roles),
        {
            "Kinetic energy (nJ)": path.kinetic[chosen],
            "Potential energy (nJ)": path.potential[chosen],
        },
        tuple(contacts),
        tuple(words),
        wall_around(drum.pair, centres),
        drum.spin,
    )


def described(drum: DumbbellDrum) -> str:
    """Return a sentence on a drum and what is in it."""
    r, t = drum.ball_radius, drum.rod_radius
    return (
        f"{drum.count} of l = {drum.length:g}, r = {r:g}, t = {t:g} mm in a drum of radius "
        f"{drum.drum_radius:g} mm, tilted by {math.degrees(drum.tilt):.3g}°, turning with "
        f"{drum.spin:g} rad/s"
    )


@dataclass(frozen=True, eq=False)
class _Shot:
    """One recorded instant of a run: its contacts and its dyads."""

    pair: DumbbellPair
    q: Array
    present: NDArray[np.bool_]
    centres: Array
    touching: "tuple[Touch, ...]"
    dyads: "list[Handed]"

    @classmethod
    def of(cls, run: Trajectory, index: int, centres: Array) -> "_Shot":
        path, drum = run, drum_of(run)
        q, present = path.q[index], path.present[index]
        dyads = dyads_among(DumbbellLengths.of_drum(drum), q, present) if drum.count > 2 else []
        return cls(drum.pair, q, present, centres, path.touching[index], dyads)

    @property
    def between(self) -> "list[Touch]":
        """Contacts between dumbbells, without those with the bottom."""
        return [touch for touch in self.touching if touch[1] in CONTACTS]

    @property
    def contacts(self) -> dict[str, Array]:
        found = {}
        for bodies, contact, _ in self.between:
            numbers = "-".join(str(body + 1) for body in bodies)
            name = contact if len(self.q) == 2 else f"{numbers} {contact}"
            found[name] = contact_point(self.pair, self.centres[[*bodies]].reshape(4, 3), contact)
        return found

    @property
    def roles(self) -> list[int]:
        """Roles of dumbbells; one in dyads of both chiralities has that of the last."""
        count = len(self.q)
        if count <= 2:
            return [FIRST, SECOND][:count]
        roles = [SINGLE] * count
        for i, j, hand in self.dyads:
            roles[i] = roles[j] = RIGHT if hand > 0 else LEFT
        return roles

    @property
    def face(self) -> str:
        """The face of the polyhedron of one or two dumbbells; empty if they touch the bottom."""
        names = [contact for _, contact, _ in self.between]
        if len(self.q) > 2 or not self.present.all() or len(names) < len(self.touching):
            return ""
        free = 3 * len(self.q)
        if not names:
            return f"dimension {free}, rank 0, interior"
        rows = [self.pair.polyhedron.names.index(name) for name in names]
        _, gradients = self.pair.polyhedron.bundle.evaluate(self.q[:, :3].reshape(6), 1)
        r = rank(gradients[rows] * self.pair.manifold.scale_array, DEFAULT.rank)
        return f"dimension {free - r}, rank {r}, {'quadrant' if r == len(rows) else 'dependent'}"

    @property
    def hands(self) -> str:
        if len(self.q) > 2:
            right = sum(hand > 0 for _, _, hand in self.dyads)
            return f"{right} right-handed, {len(self.dyads) - right} left-handed dyads"
        whole = len(self.q) == 2 and bool(self.present.all())
        return HANDS[self.pair.chirality(self.q[:, :3].reshape(6)) if whole else None]
