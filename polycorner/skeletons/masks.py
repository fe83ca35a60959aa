"""Sets of functions as bits of integers: a fiftieth of the memory of sets of names."""

from collections.abc import Iterable, Sequence

from polycorner.polyhedra.symmetry import Relabelling


def mask_of(positions: Iterable[int]) -> int:
    """Return the integer whose bits are given positions.

    >>> mask_of([0, 3])
    9
    """
    mask = 0
    for i in positions:
        mask |= 1 << i
    return mask


def positions_in(mask: int) -> list[int]:
    """Return the positions of the bits of an integer, in ascending order.

    >>> positions_in(9)
    [0, 3]
    """
    found = []
    while mask:
        lowest = mask & -mask
        found.append(lowest.bit_length() - 1)
        mask ^= lowest
    return found


class Renaming:
    """A relabelling of named functions, acting on sets of them.

    >>> Renaming(["a", "b", "c"], {"a": "c", "c": "a"})(0b011) == 0b110
    True
    """

    def __init__(self, names: Sequence[str], relabelling: Relabelling) -> None:
        place = {name: i for i, name in enumerate(names)}
        self._images = [1 << place[relabelling.get(name, name)] for name in names]

    def __call__(self, mask: int) -> int:
        """Return the image of a set."""
        return sum(self._images[i] for i in positions_in(mask))
