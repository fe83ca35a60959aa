"""Film of ten thousand discs that fall to the bottom of a turning drum, and audit of their energy.

The film is a page of its own: places and angles in whole numbers, each instant less the one before,
compressed.  Beside it stands a picture of four instants.
"""

import argparse
import base64
import time
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from discs_in_drum import DT, drum_radius, loose_rows, system
from numpy.typing import NDArray
from side_by_side import print_table, write

from polycorner import checks
from polycorner.motion import Solver, simulate
from polycorner.motion.trajectory import Trajectory
from polycorner.spaces.manifold import Array

LEVELS, TURN = 2**16, 2**8  # of a coordinate across the drum, and of an angle
EVERY = 20  # steps between two instants of the film
COLOURS = "#0072B2", "#E69F00", "#009E73", "#CC79A7"  # of the layers at the start

PAGE = """<!doctype html><meta charset="utf-8"><title>{count} discs in a drum</title>
<style>body{{margin:1em;font:15px sans-serif;text-align:center}}canvas{{max-width:min(100%,85vh)}}
input{{width:min(60em,80%)}}</style>
<canvas id="view" width="{pixels}" height="{pixels}"></canvas>
<p><button id="play">pause</button> <input id="instant" type="range" min="0" max="{last}" value="0">
<span id="time"></span></p>
<script type="application/octet-stream" id="data">{data}</script>
<script>
const count = {count}, frames = {frames}, pixels = {pixels}, radius = {radius};
const colours = {colours}, seconds = {seconds};
const view = document.getElementById("view").getContext("2d");
const slider = document.getElementById("instant"), button = document.getElementById("play");
let x, y, turn, playing = true;

async function unpacked() {{
  const text = document.getElementById("data").textContent;
  const bytes = Uint8Array.from(atob(text), c => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}}

// Planes of bytes, instant after instant: low and high bytes of x, of y, and angles.
function summed(raw) {{
  const size = frames * count;
  x = new Uint16Array(size); y = new Uint16Array(size); turn = new Uint8Array(size);
  for (let f = 0; f < frames; f++) {{
    const from = 5 * f * count, now = f * count, before = now - count;
    for (let i = 0; i < count; i++) {{
      const old = f > 0;
      x[now + i] = raw[from + i] + 256 * raw[from + count + i] + (old ? x[before + i] : 0);
      y[now + i] = raw[from + 2 * count + i] + 256 * raw[from + 3 * count + i]
        + (old ? y[before + i] : 0);
      turn[now + i] = raw[from + 4 * count + i] + (old ? turn[before + i] : 0);
    }}
  }}
}}

function show(f) {{
  const scale = pixels / {levels}, r = radius * scale;
  view.clearRect(0, 0, pixels, pixels);
  view.beginPath(); view.arc(pixels / 2, pixels / 2, pixels / 2 - 1, 0, 7); view.stroke();
  for (let layer = 0; layer < 4; layer++) {{
    view.fillStyle = colours[layer];
    view.beginPath();
    for (let i = 0; i < count; i++) {{
      if (layers[i] !== layer) continue;
      const a = x[f * count + i] * scale, b = pixels - y[f * count + i] * scale;
      view.moveTo(a + r, b); view.arc(a, b, r, 0, 2 * Math.PI);
    }}
    view.fill();
  }}
  view.beginPath();
  for (let i = 0; i < count; i++) {{
    const a = x[f * count + i] * scale, b = pixels - y[f * count + i] * scale;
    const angle = turn[f * count + i] * 2 * Math.PI / 256;
    view.moveTo(a, b); view.lineTo(a + r * Math.cos(angle), b - r * Math.sin(angle));
  }}
  view.strokeStyle = "#0006"; view.stroke(); view.strokeStyle = "#000";
  document.getElementById("time").textContent = (f * seconds).toFixed(2) + " s";
  slider.value = f;
}}

let layers;
button.onclick = () => {{ playing = !playing; button.textContent = playing ? "pause" : "play"; }};
slider.oninput = () => {{ playing = false; button.textContent = "play"; show(+slider.value); }};
unpacked().then(raw => {{
  layers = raw.subarray(0, count); summed(raw.subarray(count)); show({first});
  setInterval(() => {{ if (playing) show((+slider.value + 1) % frames); }}, 1000 / 15);
}});
</script>
"""


@dataclass(frozen=True)
class Film:
    """Instants of a motion, as whole numbers: ``places`` (frames, N, 2), ``angles`` (frames, N)."""

    places: NDArray[np.uint16]
    angles: NDArray[np.uint8]
    layers: NDArray[np.uint8]

    @classmethod
    def of(cls, path: Trajectory) -> "Film":
        """Return the instants of a trajectory of discs about the origin."""
        half = drum_radius(path.q.shape[1])
        places = np.rint((path.q[..., :2] / (2 * half) + 0.5) * (LEVELS - 1))
        angles = np.floor(path.q[..., 2] / (2 * np.pi) % 1.0 * TURN) % TURN
        count = path.q.shape[1]
        rank = np.argsort(np.argsort(path.q[0, :, 1], kind="stable"), kind="stable")
        return cls(
            places.clip(0, LEVELS - 1).astype(np.uint16),
            angles.astype(np.uint8),
            (len(COLOURS) * rank // count).astype(np.uint8),
        )

    def packed(self) -> bytes:
        """Return layers and changes from instant to instant, as planes of bytes, compressed."""
        places = np.diff(self.places, axis=0, prepend=np.zeros_like(self.places[:1]))
        angles = np.diff(self.angles, axis=0, prepend=np.zeros_like(self.angles[:1]))
        planes = [places[..., 0] % 256, places[..., 0] // 256]
        planes += [places[..., 1] % 256, places[..., 1] // 256, angles]
        changes = np.stack([plane.astype(np.uint8) for plane in planes], axis=1)
        return zlib.compress(self.layers.tobytes() + changes.tobytes(), 9)


def write_page(film: Film, target: Path, first: int = 0) -> int:
    """Write the page of a film, which begins with instant ``first``; return its size in bytes."""
    frames, count = film.angles.shape
    page = PAGE.format(
        count=count,
        frames=frames,
        last=frames - 1,
        first=first,
        pixels=1000,
        radius=round((LEVELS - 1) / (2 * drum_radius(count)), 3),
        levels=LEVELS,
        seconds=EVERY * DT,
        colours=list(COLOURS),
        data=base64.b64encode(film.packed()).decode(),
    )
    target.parent.mkdir(parents=True, exist_ok=True)
    return target.write_text(page, encoding="utf-8")


def draw(path: Trajectory, film: Film, target: Path) -> Path:
    """Draw four instants."""
    from matplotlib.collections import EllipseCollection
    from matplotlib.figure import Figure
    from matplotlib.patches import Circle

    from polycorner.pictures import save

    count = path.q.shape[1]
    edge, size = 1.01 * drum_radius(count), np.full(count, 2.0)
    figure = Figure(figsize=(12, 3.4), layout="constrained")
    instants = np.linspace(0, len(path) - 1, 4).round().astype(int)
    for axes, index in zip(figure.subplots(1, 4), instants.tolist(), strict=True):
        axes.add_patch(Circle((0, 0), drum_radius(count), fill=False, color="0.3"))
        discs = EllipseCollection(
            size,
            size,
            0 * size,
            units="xy",
            facecolors=[COLOURS[k] for k in film.layers],
            offsets=path.q[index, :, :2],
            transOffset=axes.transData,
        )
        axes.add_collection(discs)
        axes.set(xlim=(-edge, edge), ylim=(-edge, edge), aspect="equal")
        axes.set_title(f"{path.times[index]:.2f} s", fontsize=10)
        axes.set_axis_off()
    return save(figure, target)


def moved(count: int, spin: float, duration: float, solver: Solver) -> Trajectory:
    """Return the motion from loose rows."""
    several = system(count, spin)
    begun: Array = loose_rows(count)
    return simulate(several, several.state(begun), duration, DT, every=EVERY, solver=solver)


def main() -> None:
    """Move the discs, write the film and the picture, print the audit."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--discs", type=int, default=10_000)
    parser.add_argument("--spin", type=float, default=1.0, help="of the drum, in rad/s")
    parser.add_argument("--duration", type=float, default=2.0, help="in s")
    parser.add_argument("--sweeps", type=int, default=10)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--out", type=Path, default=Path("out"))
    given = parser.parse_args()
    try:
        checks.whole("--discs", given.discs, least=1)
        checks.real("--spin", given.spin, unit="rad/s")
        checks.real("--duration", given.duration, above=0, unit="s")
        solver = Solver(tolerance=1e-4, crowd_sweeps=given.sweeps, threads=given.threads)
    except ValueError as error:
        parser.error(str(error))
    begun = time.process_time()
    path = moved(given.discs, given.spin, given.duration, solver)
    spent = time.process_time() - begun
    film = Film.of(path)
    page, picture = given.out / "heap_film.html", given.out / "heap_film.png"
    size = write_page(film, page)
    draw(path, film, picture)
    figures: dict[str, Any] = {
        "steps": path.effort.steps,
        "instants": len(path),
        "ms of processors a step": round(1e3 * spent / path.effort.steps, 1),
        "MB of the page": round(size / 1e6, 2),
        "energy missed, of what was moved": float(f"{path.audit:.1e}"),
        "deepest overlap, of a radius": float(f"{path.max_penetration:.1e}"),
    }
    energies = {"kinetic": path.kinetic, "potential": path.potential}
    energies |= {f"work of {cause}": -work for cause, work in path.work.items()}
    energies |= {f"lost by {cause}": lost for cause, lost in path.dissipated.items()}
    for name, energy in energies.items():  # gained, less what was worked, and lost: all add up to 0
        figures[f"{name}, J"] = float(f"{1e-7 * (energy[-1] - energy[0]):.5g}")
    print_table(f"{given.discs} discs", ["", "value"], [[k, v] for k, v in figures.items()])
    print(f"wrote {page} and {picture}")
    write("heap_film", figures)


if __name__ == "__main__":
    main()
