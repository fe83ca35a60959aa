"""Movies of motions in the drum: MP4 where imageio-ffmpeg is installed, GIF everywhere."""

import importlib.util
import os
from collections.abc import Callable, Iterator
from itertools import chain
from pathlib import Path
from subprocess import PIPE, Popen
from tempfile import TemporaryFile
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from numpy.typing import NDArray
from PIL import Image

from polycorner.dumbbells.pictures.drum import DrumView
from polycorner.motion import Trajectory
from polycorner.toolkit import checked, missing_extra, refuse, replace_atomically, whole

Picture = NDArray[np.uint8]
FRAMES = 300  # at most
RATE = 20  # frames per second
DOTS = 110  # per inch
QUALITY = 15  # of H.264: constant rate factor, lower is better
SUFFIXES = (".mp4", ".gif")


def can_encode() -> bool:
    """Return whether MP4 files can be written."""
    return importlib.util.find_spec("imageio_ffmpeg") is not None


def movie_suffix() -> str:
    """Return ``.mp4`` where that can be written, else ``.gif``."""
    return ".mp4" if can_encode() else ".gif"


def check_movie(path: str | os.PathLike[str], argument: str = "movie") -> None:
    """Raise for a file name whose format cannot be written.

    Raises
    ------
    ValueError
        For another suffix, or for MP4 without imageio-ffmpeg.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in SUFFIXES:
        refuse(argument, "a file name that ends in .mp4 or .gif", os.fspath(path))
    if suffix == ".mp4" and not can_encode():
        msg = f"{argument}: {missing_extra('imageio-ffmpeg', 'movies')}; .gif files need no extra"
        raise ValueError(msg)


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
        See :func:`check_movie`.
    OSError
        If the file cannot be written, as on a full disk; nothing is left of it then.
    """
    check_movie(path, "path")
    whole("rate", rate, least=1)
    target = Path(path)
    numbers = chosen_frames(len(run), frames)
    suffix = target.suffix.lower()
    write = _write_mp4 if suffix == ".mp4" else _write_gif

    def pictures() -> Iterator[Picture]:
        for done, picture in enumerate(_pictures(DrumView(run), numbers), 1):
            yield picture
            if progress is not None:
                progress(done, len(numbers))

    with replace_atomically(target) as temporary:
        write(pictures(), temporary, rate)
    return target


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
        picture = np.asarray(canvas.buffer_rgba())[..., :3].copy()
        yield picture[: picture.shape[0] // 2 * 2, : picture.shape[1] // 2 * 2]  # even, for H.264


def _write_mp4(pictures: Iterator[Picture], path: Path, rate: int) -> None:
    """Write an MP4 file through ffmpeg and check its exit status."""
    import imageio_ffmpeg

    first = next(pictures)
    size = f"{first.shape[1]}x{first.shape[0]}"
    raw = ("-f", "rawvideo", "-pix_fmt", "rgb24", "-s", size, "-r", str(rate), "-i", "-")
    coded = ("-an", "-c:v", "libx264", "-crf", str(QUALITY), "-pix_fmt", "yuv420p")
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-y", "-loglevel", "error", *raw, *coded, str(path)]
    with TemporaryFile() as said, Popen(command, stdin=PIPE, stderr=said) as encoder:
        pipe: Any = encoder.stdin
        try:
            for picture in chain([first], pictures):
                pipe.write(np.ascontiguousarray(picture))
            pipe.close()
            encoder.wait()
        except BrokenPipeError:
            encoder.wait()  # it failed, and its messages say why
        except BaseException:
            encoder.kill()
            raise
        if encoder.returncode:
            said.seek(0)
            raise OSError(_reason(said.read().decode(errors="replace")))


def _reason(said: str) -> str:
    """Return the last message of ffmpeg, without the name of the component."""
    lines = said.strip().splitlines() or ["ffmpeg stopped without a message"]
    return lines[-1].rpartition("] ")[2]


def _write_gif(pictures: Iterator[Picture], path: Path, rate: int) -> None:
    frames = [
        Image.fromarray(picture).quantize(256, Image.Quantize.FASTOCTREE) for picture in pictures
    ]
    frames[0].save(
        path, save_all=True, append_images=frames[1:], duration=round(1000 / rate), loop=0
    )
