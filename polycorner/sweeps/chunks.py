"""Chunks of a grid: runs of consecutive points, each a rectangle of the array."""

import math
import os
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Place = tuple[int, ...]


@dataclass(frozen=True)
class Chunks:
    """A grid cut into rectangles of consecutive points.

    Parameters
    ----------
    shape : tuple of int
        Of the grid.
    most : int
        Points in a chunk, at most.

    Examples
    --------
    >>> Chunks((5, 4, 10), 100).sizes, Chunks((5, 4, 10), 25).sizes
    ((2, 4, 10), (1, 2, 10))
    """

    shape: tuple[int, ...]
    most: int

    @cached_property
    def sizes(self) -> tuple[int, ...]:
        """How far a chunk reaches along each axis: ones, a part of one axis, and whole axes."""
        sizes, room = [], self.most
        for length in reversed(self.shape):
            sizes.append(min(length, max(1, room)))
            room = room // length if room >= length else 0
        return tuple(reversed(sizes))

    def holding(self, numbers: NDArray[np.int64]) -> Iterator[tuple[Place, NDArray[np.int64]]]:
        """Yield the chunks that hold some points, and which of ``numbers`` each holds."""
        index = np.stack(np.unravel_index(numbers, self.shape), axis=1) // np.array(self.sizes)
        places, which = np.unique(index, axis=0, return_inverse=True)
        for k, place in enumerate(places.tolist()):
            yield tuple(place), np.flatnonzero(which.reshape(-1) == k)

    def region(self, place: Place) -> tuple[slice, ...]:
        """Return the rectangle of a chunk."""
        return tuple(
            slice(k * size, min((k + 1) * size, length))
            for k, size, length in zip(place, self.sizes, self.shape, strict=True)
        )

    def first(self, place: Place) -> int:
        """Return the number of a chunk's first point."""
        corner = tuple(part.start for part in self.region(place))
        return int(np.ravel_multi_index(corner, self.shape))

    def count(self, place: Place) -> int:
        """Return how many points a chunk has."""
        return math.prod(part.stop - part.start for part in self.region(place))

    def write(
        self, array: Any, folder: Path, numbers: NDArray[np.int64], values: NDArray[Any]
    ) -> None:
        """Put values at points of an array, every chunk whole, and wait for the disk.

        Parameters
        ----------
        array : zarr.Array
            Of the grid's shape, and perhaps further dimensions that are not cut.
        folder : Path
            Where its chunks are.
        numbers : (k,) array
            Points, all different.
        values : (k, ...) array
        """
        for place, which in self.holding(numbers):
            region, count = self.region(place), self.count(place)
            slab = np.array(array[region])
            flat = slab.reshape(count, *slab.shape[len(self.shape) :])
            flat[numbers[which] - self.first(place)] = values[which]
            array[region] = slab
            file = folder.joinpath("c", *map(str, place), *("0" for _ in flat.shape[1:]))
            if file.exists():  # chunks in which nothing is known are not written
                with file.open("rb+") as opened:
                    os.fsync(opened.fileno())
