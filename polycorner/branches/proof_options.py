"""Numbers that decide how finely a diagram is divided for a proof."""

from dataclasses import dataclass

from polycorner import checks
from polycorner.values import Checked


@dataclass(frozen=True)
class BranchProofOptions(Checked):
    """How finely a diagram is divided for a proof, and where it ends.

    Attributes
    ----------
    bits : int
        Working precision.
    shortest : float
        Shortest tube, in units of the unknowns.
    most_tubes : int
        Of an arc.
    overlap : float
        Part of a tube that reaches beyond its ends.
    near : tuple of float
        Reaches of tubes in which events are shown, in turn.
    widest : float
        Largest tube about an event, in units.
    halvings : int
        Of the tube about an event, at most.
    most_images : int
        Symmetries that are tried for two arcs at a branch point, at most.
    inside : float
        Part of what is shown about a pitchfork, beyond which its arcs have tubes.
    resolution : float
        Largest side, in units, of boxes that are left open.
    max_boxes : int
        That are looked at, at most.
    max_seconds : float
        Time for all boxes.
    most_open : int
        Functions that may vanish in a box, at most, for whose subsets it is looked at.
    at_once : int
        Boxes that are treated at a time.
    patience : int
        Boxes of one size that are looked at with the tubes though it brings nothing.
    narrowings : int
        Steps of Newton's method on a box, at most.
    gain : float
        Ratio of its sides after a step and before, with which another step is taken.

    Raises
    ------
    TypeError, ValueError
        Unless all are positive, ``gain`` and ``inside`` are below 1 and ``bits`` at least 53.
    """

    bits: int = 64
    shortest: float = 1e-4
    most_tubes: int = 2000
    overlap: float = 0.125
    near: tuple[float, ...] = (2.0**-30, 2.0**-20, 2.0**-12)
    widest: float = 1.0
    halvings: int = 20
    most_images: int = 256
    inside: float = 0.5
    resolution: float = 1e-4
    max_boxes: int = 200_000
    max_seconds: float = 600.0
    most_open: int = 8
    at_once: int = 256
    patience: int = 8
    narrowings: int = 6
    gain: float = 0.7

    def __post_init__(self) -> None:
        super().__post_init__()
        for name, value in vars(self).items():
            if name == "near":
                several = tuple(checks.real(name, x, above=0) for x in value)
                if not several:
                    checks.refuse(name, "at least one number", several)
            elif isinstance(getattr(type(self), name), int):
                checks.whole(name, value, least=53 if name == "bits" else 1)
            else:
                checks.real(name, value, above=0, infinite=name == "max_seconds")
        checks.real("gain", self.gain, below=1)
        checks.real("inside", self.inside, below=1)
