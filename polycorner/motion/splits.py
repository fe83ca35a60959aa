"""Concave corners of unions that a motion meets, and its continuations there."""

from dataclasses import dataclass

from polycorner.motion.mechanics import State
from polycorner.spaces.manifold import Array
from polycorner.values import Checked


@dataclass(frozen=True, eq=False)
class Split(Checked):
    """A concave corner of a union that a body meets, where its motion has several continuations.

    Several pieces of the union hold at the corner, and none of them admits the wished velocity; in
    each the motion goes on along that piece.

    Attributes
    ----------
    time : float
        When the corner is met.
    body : int
    q : (n,) array
        The corner.
    pieces : tuple of tuple of str
        The pieces that lie beyond, each by the functions that hold together in it.
    states : tuple of State
        The state of all bodies at the end of the step, for each piece: ``simulate(system,
        split.states[k], t_end, dt)`` goes on in piece ``k``.
    taken : int
        The piece in which the run that met the corner went on: the one nearest to what is wished,
        of several the first.
    """

    time: float
    body: int
    q: Array
    pieces: tuple[tuple[str, ...], ...]
    states: tuple[State, ...]
    taken: int
