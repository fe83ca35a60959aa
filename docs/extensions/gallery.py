"""The gallery: every example writes its pictures into a folder, and they are shown on its page."""

import os
import shutil
from pathlib import Path
from typing import Any


def arguments(configuration: dict[str, Any], example: dict[str, Any]) -> list[str]:
    """Return the command line of an example: an empty folder for its pictures.

    An example runs in its own folder; a path from there says nothing about the machine.
    """
    folder = _folder(configuration, example)
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    return [os.path.relpath(folder, Path(example["src_file"]).parent)]


def pictures(_block: Any, example: dict[str, Any], configuration: dict[str, Any]) -> str:
    """Return the reStructuredText of the pictures that a block of an example has written."""
    from sphinx_gallery.scrapers import figure_rst

    written = sorted(_folder(configuration, example).glob("*.png"))
    shown = [shutil.move(file, next(example["image_path_iterator"])) for file in written]
    return figure_rst(shown, configuration["src_dir"])


def _folder(configuration: dict[str, Any], example: dict[str, Any]) -> Path:
    stem = Path(example["src_file"]).stem
    return Path(configuration["src_dir"]) / "generated" / "pictures" / stem
