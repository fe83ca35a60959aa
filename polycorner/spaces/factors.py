"""Spheres and rotations among the coordinates of a product."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from polycorner.checks import listed, refuse
from polycorner.spaces.embedding import (
    Array,
    body_frame,
    exponential,
    logarithm,
    normalised,
    tangent_basis,
    upright,
)

QUATERNION = 4


@dataclass(frozen=True)
class Factor:
    """A sphere or the rotations, by the coordinates of the space around it.

    Attributes
    ----------
    names : tuple of str
        Names of these coordinates.
    at : slice
        Where they stand.
    turns : bool
        Whether opposite points are one: unit quaternions as rotations.
    """

    names: tuple[str, ...]
    at: slice
    turns: bool

    @property
    def name(self) -> str:
        """What the names of the coordinates have in common: ``"a"`` of ``aw ax ay az``."""
        head = _shared(self.names)
        tail = _shared([name[len(head) :][::-1] for name in self.names])[::-1]
        return head + tail or self.names[0]

    @property
    def kind(self) -> str:
        """The factor in words."""
        return "quaternion" if self.turns else "vector"

    def even(self, q: Array) -> Array:
        """Return quadratic forms of the vector that tell points apart up to the sign, ``(..., m)``.

        Nearby they are as far apart as the vectors.
        """
        part = q[..., self.at]
        i, j = np.triu_indices(part.shape[-1])
        return np.asarray(part[..., i] * part[..., j] * np.where(i == j, np.sqrt(0.5), 1.0))

    def frame(self, q: Array) -> Array:
        """Return a basis of the tangent spaces as columns: angular velocities of a rotation."""
        part = normalised(q[..., self.at])
        return body_frame(part) if self.turns else tangent_basis(part)


class Factors(tuple[Factor, ...]):
    """All spheres and rotations of a product; points are arrays ``(..., N)`` of float64."""

    __slots__ = ()

    def wrap(self, q: Array) -> None:
        """Normalise vectors and quaternions in place, the sign of quaternions too."""
        for f in self:
            part = normalised(q[..., f.at])
            q[..., f.at] = upright(part) if f.turns else part

    def onto(self, q: Array) -> Array:
        """Return points with normalised vectors and quaternions."""
        q = q.copy()
        for f in self:
            q[..., f.at] = normalised(q[..., f.at])
        return q

    def check(self, q: Array, argument: str, near: float | None = 1e-3) -> None:
        """Raise ValueError for a vector not ``near`` the length one, or if None, of length zero."""
        for f in self:
            length = np.sqrt(np.einsum("...i,...i->...", q[..., f.at], q[..., f.at]))
            bad = ~(length > 0) if near is None else abs(length - 1) > near
            if bad.any():
                got = length[bad].flat[0]
                wanted = "a length > 0" if near is None else f"the length 1 up to {near:g}"
                where = ", ".join(f.names)
                msg = f"{argument}: expected a {f.kind} ({where}) of {wanted}; got length {got:.6g}"
                raise ValueError(msg)

    def signs(self, p: Array, q: Array) -> Array:
        """Return the factors -1 and 1 of ``p`` that give its image nearest to ``q``."""
        signs = np.ones(np.broadcast_shapes(p.shape, q.shape))
        for f in self:
            if f.turns:
                across = np.einsum("...i,...i->...", p[..., f.at], q[..., f.at])
                signs[..., f.at] = np.where(across < 0, -1.0, 1.0)[..., None]
        return signs

    def difference(self, p: Array, q: Array, found: Array) -> None:
        """Write the shortest tangent vectors from ``q`` to ``p`` into ``found``."""
        p = self.onto(self.signs(p, q) * p)
        for f in self:
            found[..., f.at] = logarithm(p[..., f.at], normalised(q[..., f.at]))

    def shift(self, q: Array, v: Array, found: Array) -> None:
        """Write where great circles from ``q`` along ``v`` end into ``found``."""
        for f in self:
            found[..., f.at] = exponential(normalised(q[..., f.at]), v[..., f.at])

    def scattered(self, q: Array, rng: "np.random.Generator") -> Array:
        """Return points with uniformly distributed vectors and quaternions."""
        q = q.copy()
        for f in self:
            q[..., f.at] = normalised(rng.standard_normal(q[..., f.at].shape))
        return q

    def named(self, name: str | None, *, turns: bool) -> Factor:
        """Return the only factor of a kind, or the one of a given name."""
        known = {f.name: f for f in self if f.turns == turns}
        words = "a rotation" if turns else "a sphere"
        if name is None and len(known) == 1:
            (name,) = known
        if not known:
            refuse("name", f"{words} among the factors", name)
        if name not in known:
            refuse("name", f"the name of {words}: {listed(map(repr, known))}", name)
        return known[name]

    def frame(self, q: Array, found: Array) -> None:
        """Write bases of the tangent spaces into the columns of ``found``, which is zero."""
        row = column = 0
        for f in self:
            straight = np.arange(f.at.start - row)
            found[..., row + straight, column + straight] = 1.0
            part = f.frame(q)
            row, column = f.at.stop, column + len(straight)
            found[..., f.at, column : column + part.shape[-1]] = part
            column += part.shape[-1]
        straight = np.arange(q.shape[-1] - row)
        found[..., row + straight, column + straight] = 1.0


def factors(
    names: Sequence[str],
    spheres: Sequence[tuple[str, ...]],
    rotations: Sequence[tuple[str, ...]],
    periods: Sequence[float],
    scales: Sequence[float],
) -> Factors:
    """Return the spheres and rotations of a product, in the order of their coordinates."""
    found = [*_located(names, "spheres", spheres), *_located(names, "rotations", rotations)]
    found.sort(key=lambda f: f.at.start)
    for before, after in pairwise(found):
        if before.at.stop > after.at.start:
            refuse("rotations" if after.turns else "spheres", "factors without common names", names)
    for f in found:
        if any(np.isfinite(periods[f.at])):
            refuse("periods", f"inf for {', '.join(f.names)}", tuple(periods[f.at]))
        if len(set(scales[f.at])) > 1:
            refuse("scales", f"one scale for {', '.join(f.names)}", tuple(scales[f.at]))
    return Factors(found)


def _located(
    names: Sequence[str], argument: str, given: Sequence[tuple[str, ...]]
) -> Iterator[Factor]:
    turns = argument == "rotations"
    for some in given:
        start = names.index(some[0]) if some and some[0] in names else 0
        at = slice(start, start + len(some))
        count = f"{QUATERNION}" if turns else "two or more"
        if tuple(names[at]) != some or (len(some) != QUATERNION if turns else len(some) < 2):
            refuse(argument, f"{count} coordinates in succession for each", some)
        yield Factor(some, at, turns)


def _shared(words: Sequence[str]) -> str:
    """Return what words have in common at the beginning."""
    same = 0
    for letters in zip(*words, strict=False):
        if len(set(letters)) > 1:
            break
        same += 1
    return words[0][:same]
