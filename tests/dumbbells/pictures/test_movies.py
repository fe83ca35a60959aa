"""A movie is written whole, or a sentence says why not."""

import stat
import subprocess
import sys

import numpy as np
import pytest

from polycorner.dumbbells.pictures import movies

ffmpeg = pytest.importorskip("imageio_ffmpeg")


def pictures(count, size=(64, 96)):
    """Yield a bright bar that moves down."""
    for k in range(count):
        picture = np.zeros((*size, 3), dtype=np.uint8)
        picture[4 * k : 4 * k + 8] = 255
        yield picture


def encoder(tmp_path, lines):
    """Return a program in place of ffmpeg."""
    program = tmp_path / "encoder"
    program.write_text("\n".join([f"#!{sys.executable}", "import sys", *lines]) + "\n")
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    return str(program)


def test_every_frame_is_in_the_file(tmp_path):
    path = tmp_path / "bar.mp4"
    movies._write_mp4(pictures(9), path, 10)
    form = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    command = [ffmpeg.get_ffmpeg_exe(), "-i", str(path), *form]
    read = subprocess.run(command, capture_output=True, check=True)
    assert b", 96x64" in read.stderr
    assert b", 10 fps" in read.stderr
    frames = np.frombuffer(read.stdout, np.uint8).reshape(9, 64, 96, 3)
    for k, frame in enumerate(frames):
        rows = np.flatnonzero(frame.mean(axis=(1, 2)) > 128)
        assert abs(rows.mean() - (4 * k + 3.5)) < 1


@pytest.mark.parametrize("read", ["sys.stdin.buffer.read()", "sys.stdin.buffer.read(100)"])
def test_a_full_disk_is_told_in_one_line(tmp_path, monkeypatch, read):
    """At the end of the file, or while there are still frames to come."""
    lines = (
        read,
        "print('[out#0/mp4 @ 0x1] Error writing trailer: nothing', file=sys.stderr)",
        "print('[out#0/mp4 @ 0x1] Error closing file: No space left on device', file=sys.stderr)",
        "sys.exit(228)",
    )
    program = encoder(tmp_path, lines)
    monkeypatch.setattr(ffmpeg, "get_ffmpeg_exe", lambda: program)
    with pytest.raises(OSError, match=r"^Error closing file: No space left on device$"):
        movies._write_mp4(pictures(9, (640, 960)), tmp_path / "bar.mp4", 10)


def test_an_encoder_that_stops_silently_is_told_too(tmp_path, monkeypatch):
    program = encoder(tmp_path, ["sys.exit(3)"])
    monkeypatch.setattr(ffmpeg, "get_ffmpeg_exe", lambda: program)
    with pytest.raises(OSError, match=r"^ffmpeg stopped without a message$"):
        movies._write_mp4(pictures(9, (640, 960)), tmp_path / "bar.mp4", 10)


def test_what_interrupts_the_drawing_goes_on(tmp_path):
    def interrupted():
        yield from pictures(2)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        movies._write_mp4(interrupted(), tmp_path / "bar.mp4", 10)
