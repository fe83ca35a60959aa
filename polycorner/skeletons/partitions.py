"""Partitions: what belongs together when some pairs do."""

from collections.abc import Hashable, Iterable

import numpy as np


class Partition:
    """The finest partition of some things in which joined things are in one class.

    Parameters
    ----------
    things : iterable of hashable
        Others are added when they are joined.
    """

    def __init__(self, things: Iterable[Hashable] = ()) -> None:
        self._position = {thing: k for k, thing in enumerate(dict.fromkeys(things))}
        self._pairs: list[tuple[int, int]] = []
        self._classes: list[int] | None = None

    def join(self, one: Hashable, other: Hashable) -> None:
        """Put two things into one class."""
        known = self._position
        first = known.setdefault(one, len(known))
        self._pairs.append((first, known.setdefault(other, len(known))))
        self._classes = None

    def __getitem__(self, thing: Hashable) -> int:
        """Return the number of the class of a thing."""
        if self._classes is None:
            self._classes = self._connected()
        return self._classes[self._position[thing]]

    def _connected(self) -> list[int]:
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components

        count = len(self._position)
        rows, columns = np.array(self._pairs, dtype=np.int32).reshape(-1, 2).T
        graph = coo_array((np.ones(len(rows), np.int32), (rows, columns)), shape=(count, count))
        found: list[int] = connected_components(graph, directed=False)[1].tolist()
        return found
