"""The figure of the architecture: the rooms of the package, drawn from the import contracts."""

import tomllib
from importlib import import_module
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

ROOT = Path(__file__).parents[2]
FIGURE = "generated/rooms.svg"


def layers() -> list[list[str]]:
    """Return the rooms from the highest to the lowest, those side by side together."""
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]
    (rooms,) = (c for c in contracts["contracts"] if c["id"] == "rooms")
    return [[name.strip() for name in layer.split("|")] for layer in rooms["layers"]]


def lines(room: str) -> int:
    """Return the lines of a room's source."""
    place = ROOT / "polycorner" / room
    files = place.rglob("*.py") if place.is_dir() else [place.with_suffix(".py")]
    return sum(len(file.read_text().splitlines()) for file in files)


def draw() -> Figure:
    """Return the figure: a row a layer, each room with its lines and its first sentence."""
    rows = [layer for layer in layers() if "__main__" not in layer]
    figure = Figure(figsize=(10, 0.28 * len(rows)))
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set(xlim=(0, 1), ylim=(len(rows) - 0.4, -0.6))
    axes.set_axis_off()
    most = max(lines(room) for layer in rows for room in layer)
    for y, layer in enumerate(rows):
        count = sum(lines(room) for room in layer)
        length = 0.17 * count / most
        axes.barh(y, length, left=0.26, height=0.7, color="0.75")
        axes.text(0.25, y, ", ".join(layer), ha="right", va="center", fontsize=9 - len(layer) / 2)
        axes.text(0.265 + length, y, f"{count:,}", va="center", fontsize=7)
        if len(layer) == 1:
            said = import_module(f"polycorner.{layer[0]}").__doc__ or ""
            axes.text(0.475, y, said.split("\n")[0], va="center", fontsize=7)
    return figure


def write(app: Any, _config: Any) -> None:
    """Draw the figure before Sphinx looks for its sources."""
    file = Path(app.srcdir) / FIGURE
    file.parent.mkdir(exist_ok=True)
    draw().savefig(file, metadata={"Date": None})


def setup(app: Any) -> dict[str, bool]:
    """Draw the figure once the configuration is read."""
    app.connect("config-inited", write)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
