"""Films: frames written as MP4 where imageio-ffmpeg is installed, as GIF everywhere."""

import importlib.util
import os
from collections.abc import Callable, Iterator
from itertools import chain
from pathlib import Path
from subprocess import PIPE, Popen
from tempfile import TemporaryFile
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from polycorner.atomic import replace_atomically
from polycorner.checks import missing_extra, refuse, whole

Picture = NDArray[np.uint8]
RATE = 20  # frames per second
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


def write_frames(
    pictures: Iterator[Picture],
    count: int,
    path: str | os.PathLike[str],
    *,
    rate: int = RATE,
    progress: Callable[[int, int], None] | None = None,
) -> Path:
    """Write ``count`` frames ``(height, width, 3)`` of one size, and return the path.

    Parameters
    ----------
    pictures : iterator of array
    count : int
        Their number, for reports of progress.
    path : path
        Ends in ``.mp4`` or ``.gif``; the file appears whole or not at all.
    rate : int, optional
        How many are shown in a second.
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
    write = _write_mp4 if target.suffix.lower() == ".mp4" else _write_gif

    def reported() -> Iterator[Picture]:
        for done, picture in enumerate(pictures, 1):
            # Even sides, for H.264.
            yield picture[: picture.shape[0] // 2 * 2, : picture.shape[1] // 2 * 2]
            if progress is not None:
                progress(done, count)

    with replace_atomically(target) as temporary:
        write(reported(), temporary, rate)
    return target


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
