"""Movies of motions in the drum."""

import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg

from polycorner.dumbbells.pictures.drum import DrumView
from polycorner.motion import Trajectory
from polycorner.toolkit import RATE, Picture, checked, whole, write_frames

FRAMES = 300  # at most
DOTS = 110  # per inch


def chosen_frames(count: int, most: int = FRAMES) -> list[int]:
    """Return the numbers of the instants shown, the first and the last included."""
    shown = min(count, whole("frames", most, least=1))
    return sorted({round(k) for k in np.linspace(0, count - 1, shown).tolist()})


@checked
def write_movie(
    run: Trajectory,
    path: str | os.PathLike[str],
    *,
    frames: int = FRAMES,
    rate: int = RATE,
    progress: Callable[[int, int], None] | None = None,
) -> Path:
    """Write a movie of the unrolled drum and return its path.

    Parameters
    ----------
    run : Trajectory
    path : path
        Ends in ``.mp4`` or ``.gif``; the file appears whole or not at all.
    frames, rate : int, optional
        How many frames at most, and how many are shown in a second.
    progress : callable, optional
        Called with the number of frames drawn and of all.

    Raises
    ------
    ValueError
        For another suffix, or for MP4 without imageio-ffmpeg.
    OSError
        If the file cannot be written, as on a full disk; nothing is left of it then.
    """
    numbers = chosen_frames(len(run), frames)
    pictures = _pictures(DrumView(run), numbers)
    return write_frames(pictures, len(numbers), path, rate=rate, progress=progress)


def _pictures(view: DrumView, numbers: list[int]) -> Iterator[Picture]:
    """Yield frames; the static background is drawn once."""
    view.figure.set_dpi(DOTS)
    canvas: Any = FigureCanvasAgg(view.figure)
    view.show(numbers[0])
    for artist in view.moving:
        artist.set_animated(True)
    canvas.draw()
    background = canvas.copy_from_bbox(view.figure.bbox)
    for number in numbers:
        view.show(number)
        canvas.restore_region(background)
        for artist in view.moving:
            view.figure.draw_artist(artist)
        yield np.asarray(canvas.buffer_rgba())[..., :3].copy()
