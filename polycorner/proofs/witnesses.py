"""Witnesses: what the proof of a minimum between two energies is made from.

Symbols are those of :mod:`~polycorner.proofs.growth`.
"""

from dataclasses import dataclass
from fractions import Fraction
from typing import TypeVar

from polycorner.intervals.enclosures import Undecided
from polycorner.proofs.invariance import Generator
from polycorner.values import Value

Point = tuple[Fraction, ...]
T = TypeVar("T")


class UnshownError(Exception):
    """A hypothesis that is not shown, in a sentence."""


def need(condition: object, reason: str) -> None:
    """Raise UnshownError unless a condition holds."""
    if not condition:
        raise UnshownError(reason)


def decided(found: T | Undecided) -> T:
    """Return what was found; raise UnshownError where it is undecided."""
    if isinstance(found, Undecided):
        raise UnshownError(str(found))
    return found


@dataclass(frozen=True, eq=False)
class Gauge(Value):
    """A symmetry and the section that it crosses: a field and a normal in coordinates."""

    field: Generator
    normal: Point


@dataclass(frozen=True, eq=False)
class Witness(Value):
    """What a claim is made from; nothing of it is taken on trust.

    Attributes
    ----------
    order : int
        Which lemma is applied, 1 or 2.
    centre : tuple of Fraction
        The point ``c``; at coordinates that rattle the middle of their room.
    inner : tuple of Fraction
        The point ``p``, up to coordinates that the equations determine.
    supports, equations : tuple of int
        Rows of ``S`` and of the equations in ``B``.
    weights : tuple of Fraction
        ``lam`` on ``S``, then on the equations.
    reach : Fraction
        ``R``, in scale units.
    room : mapping from int to Fraction
        Half sides of ``R'`` in scale units, by coordinates.
    direction : tuple of Fraction
        ``w``, in scale units.
    gauges : tuple of Gauge
        Symmetries modulo which the minimum is one.
    """

    order: int
    centre: Point
    inner: Point
    supports: tuple[int, ...]
    equations: tuple[int, ...]
    weights: Point
    reach: Fraction
    room: dict[int, Fraction]
    direction: Point
    gauges: tuple[Gauge, ...] = ()
