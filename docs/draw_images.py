"""Images of the documentation that no example draws.

``PYTHONPATH=tests/support python docs/draw_images.py [NAME ...]`` draws all, or the ones named.
"""

import asyncio
import sys
import tempfile
import threading
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from polycorner import Manifold, Polyhedron, minimise, skeleton
from polycorner.dumbbells import (
    DumbbellPair,
    RelativePlacements,
    dyad_minima,
    meeting_basins,
    minima_map,
    pair_atlas,
    pair_map,
)
from polycorner.dumbbells.cli.landscape import names as minimum_names
from polycorner.dumbbells.drum import DumbbellDrum
from polycorner.dumbbells.dynamics.bunch import BunchRun, drum_for_bunch, follow_bunch
from polycorner.dumbbells.dynamics.pairs import DumbbellLengths
from polycorner.dumbbells.pictures import (
    draw_atlas,
    draw_heading,
    draw_kinds,
    draw_meetings,
    draw_minima_map,
    draw_pair,
    draw_pair_map,
    draw_relative,
    pair_film,
    write_solid,
)
from polycorner.dumbbells.pictures.bodies import rod_outlines
from polycorner.dumbbells.pictures.drum import HANDS
from polycorner.dumbbells.studies.bunches import one_above_the_other
from polycorner.dumbbells.studies.driven import disturbed
from polycorner.dumbbells.viewer import descent, film_page, live_application, serve, write_page
from polycorner.dumbbells.viewer.server import bound
from polycorner.landscapes import landscape
from polycorner.measures import SampleOptions, Weighting, measure, sample
from polycorner.models import SphereCluster, Tutorial
from polycorner.pictures import draw_clusters, draw_landscape, draw_region, save
from polycorner.skeletons.search import traced

IMAGES = Path(__file__).parent / "images"
DRUM, PLANE = DumbbellPair(16, 3, 1.5, 125), DumbbellPair(16, 3, 1.5)
READY = "document.documentElement.dataset.ready === 'yes'"


def heading() -> None:
    """Draw headings against length."""
    save(draw_heading(DRUM, np.linspace(6, 30, 49).tolist(), [0.75, 1.5, 2.4]), _png("heading"))


def delta() -> None:
    """Draw the right-handed pair at its minimum."""
    save(draw_pair(dyad_minima(DRUM)[0]), _png("delta_R"))


def atlas() -> None:
    """Draw the skeleton of a pair as a graph, and the forbidden solid."""
    found = pair_atlas(PLANE)
    save(draw_atlas(found), _png("pair_atlas"))
    with tempfile.TemporaryDirectory() as folder:
        write_solid(found, Path(folder))
        (Path(folder) / "solid.png").replace(_png("solid"))


def proportions() -> None:
    """Draw the map over length and rod radius."""
    found = pair_map(np.linspace(2, 6, 12), np.linspace(0.05, 0.95, 8), tolerance=1e-3)
    save(draw_pair_map(found), _png("pair_map"))


def minima_kinds() -> None:
    """Draw the regions with the same minima over the proportions, and an example of each kind."""
    found = minima_map()
    save(draw_minima_map(found), _png("minima_map"))
    save(draw_kinds(found), _png("minima_kinds"))


def collisions() -> None:
    """Draw where collisions end, every half millimetre and every three degrees."""
    grid = np.meshgrid(np.linspace(-22, 22, 89), np.radians(np.linspace(-90, 90, 61)))
    found = meeting_basins(DRUM, np.stack([x.ravel() for x in grid], axis=1))
    save(draw_meetings(DRUM, found), _png("meetings"))


def dyad_landscape() -> None:
    """Draw how dyads open: one of the four parts of the tree that differ in the names of balls."""
    model = RelativePlacements(DRUM)
    cap = model.energy_at(0.16)
    found = landscape(
        model.polyhedron, model.energy, box=model.box, symmetry=model.symmetry, cap=cap
    )
    minima = [k for k in range(len(found.minima)) if not k or found.barrier(k, 0).upper < cap]
    some = [
        replace(p, sides=tuple(replace(s, minimum=minima.index(s.minimum)) for s in p.sides))
        for p in found.passes
        if {s.minimum for s in p.sides} <= set(minima)
    ]
    part = replace(found, minima=tuple(found.minima[k] for k in minima), passes=tuple(some))
    symbols = {"delta_R": "δ R", "delta_L": "δ L"}
    names = [symbols.get(name, name) for name in minimum_names(model, part)]
    contacts = [" ".join(p.active) for p in some]
    drawn = draw_landscape(
        part, pictures=draw_relative(model), names=names, pass_names=contacts,
        height=model.height, label="height (mm)",
    )  # fmt: skip
    save(drawn, _png("dyad_landscape"))


def tutorial() -> None:
    """Draw the planar region with its corners."""
    region = Tutorial()
    found = skeleton(region.polyhedron, region.starts(np.random.default_rng(0), 60))
    corners = [(f"C{k}", corner.point) for k, corner in enumerate(found.corners)]
    edges = [traced(found, edge) for edge in found.edges]
    drawn = draw_region(region.polyhedron, (-3.6, 3.8, -3, 3.3), corners=corners, edges=edges)
    save(drawn, _png("tutorial"))


def measures() -> None:
    """Draw points on the strata of a parabola with a lid, and how often clusters are seen."""
    M = Manifold.euclidean("x y")
    x, y = M.symbols
    region = Polyhedron(M, {"parabola": y - x**2, "lid": 2 - y})
    options = SampleOptions(step=0.9, sideways=0.3, reach=0.7, every=20)
    found = sample(
        region, [[0.0, 1.0]], 4000, weighting=Weighting(gradients=False), rng=1, options=options
    )
    figure = Figure(figsize=(5.2, 3.4), layout="constrained")
    axes = figure.subplots()
    colours = {0: "#BBBBBB", 1: "#0072B2", 2: "#D55E00"}
    words = {0: "area", 1: "edges", 2: "corners"}
    for count, colour in colours.items():
        points = found.points[found.contacts == count]
        share = 100 * found.fraction(contacts=count).value
        sizes = (3, 3, 40)[count]
        axes.scatter(
            *points.T, s=sizes, color=colour, label=f"{words[count]}: {share:.0f} %", zorder=count
        )
    axes.set_aspect("equal")
    axes.set_ylim(-0.1, 2.4)
    axes.legend(frameon=False, ncols=3, loc="upper center", fontsize="small")
    axes.set_axis_off()
    save(figure, _png("measures"))
    seven = SphereCluster(7)
    weighed = measure(
        skeleton(seven.polyhedron, seven.starts(), symmetry=seven.symmetry), edges=False
    )
    order = np.argsort(-weighed.probabilities)
    points = np.array([weighed.skeleton.corners[k].point for k in order])
    labels = [f"{100 * weighed.probabilities[k]:.3g} %" for k in order]
    save(draw_clusters(seven, points, labels=labels), _png("cluster_shares"))


def viewer() -> None:
    """Photograph the live page after a fall."""
    import chromium

    application, addresses = live_application(DRUM, "127.0.0.1"), list[str]()
    listener, opened = bound("127.0.0.1", 0), threading.Event()

    def ready(address: str) -> None:
        addresses.append(address)
        opened.set()

    asyncio.set_event_loop(asyncio.new_event_loop())
    threading.Thread(target=serve, args=(application, listener, ready), daemon=True).start()
    opened.wait()
    with (
        tempfile.TemporaryDirectory() as profile,
        chromium.page(chromium.needed(), Path(profile), graphics=True) as tab,
    ):
        tab.open(addresses[0], width=1200)
        tab.wait(f"{READY} && document.documentElement.dataset.solid === 'yes'")
        tab.click("#fall")
        tab.wait("document.getElementById('verdict').textContent !== ''")
        tab.wait("!board.falling")
        tab.picture(_png("viewer"), whole=True)


def viewer_film() -> None:
    """Photograph the last instant of a film, in dark colours."""
    import chromium

    corner = minimise(DRUM.polyhedron, DRUM.energy, DRUM.nested("R"))
    start = DRUM.nested("R", heading=0.5, clearance=1.5) + np.array([0.08, 0, 0, 0.06, 0, -0.1])
    points = descent(DRUM.polyhedron, DRUM.energy, start).points
    note = f"The steepest descent to delta_R, heading {np.degrees(corner.point[2]):.3f}°"
    film = pair_film(DRUM, points, title="A pair reaches its minimum", note=note)
    with (
        tempfile.TemporaryDirectory() as folder,
        chromium.page(chromium.needed(), Path(folder) / "profile", graphics=True) as tab,
    ):
        tab.open(write_page(film_page(film), Path(folder) / "film.html"), width=1200, dark=True)
        tab.wait(READY)
        tab.press("End")
        tab.picture(_png("viewer_film"))


def drum_bunch() -> None:
    """Draw sixty dumbbells, and eight pairs one above the other, in a shaken drum."""
    drum = drum_for_bunch(DumbbellDrum(16.0), top=300.0)
    shaken, again = (disturbed(drum, "shaking along", 600.0, 0.01, seed)[0] for seed in (0, 1))
    heap = follow_bunch(shaken, 1200.0, dt=1e-3)
    file = follow_bunch(
        replace(again, count=16), 1200.0, start=one_above_the_other(drum, "RLRLRLRL"), dt=2e-3
    )
    stills = {heap: (0.0, 100.0, 1200.0), file: (0.0, 100.0, 400.0, 1200.0)}
    save(draw_bunches(stills), _png("drum_bunch"))


def draw_bunches(runs: dict[BunchRun, tuple[float, ...]]) -> Figure:
    """Draw instants of bunches side by side, the drum unrolled, dyads coloured by chirality."""
    stills = [(run, time) for run, times in runs.items() for time in times]
    widths = [125 if run.drum.count > 16 else 62 for run, _ in stills]
    figure = Figure(figsize=(12, 5.4), layout="constrained")
    panels = figure.subplots(1, len(stills), sharey=True, width_ratios=widths)
    for axes, width, (run, time) in zip(panels, widths, stills, strict=True):
        index = int(np.searchsorted(run.times, time - 0.01))
        _draw_instant(axes, run, index)
        left = 48 if width > 100 else 12
        axes.set(xlim=(-left, width - left), ylim=(0, 300), aspect="equal", title=f"{time:g} s")
        axes.axvline(0, color="0.6", lw=0.8, ls=":", zorder=0)
    panels[0].set_ylabel("along the axis, η (mm)")
    words = "across, ρφ (mm); the lowest line is dotted, and the wall moves to the right"
    figure.supxlabel(words, fontsize=10)
    return figure


def _draw_instant(axes: Axes, run: BunchRun, index: int) -> None:
    sizes, q, here = (
        DumbbellLengths.of_drum(run.drum),
        run.q[index],
        np.flatnonzero(run.present[index]),
    )
    sums = dict.fromkeys(here.tolist(), 0)
    for i, j, hand in run.dyads(index):
        sums[i] += hand
        sums[j] += hand
    colours = [HANDS["R"] if n > 0 else HANDS["L"] if n < 0 else "0.7" for n in sums.values()]
    balls = sizes.balls(q[here])
    outlines = list(rod_outlines(balls, sizes.rod_radius))
    axes.add_collection(PolyCollection(outlines, facecolor=colours, edgecolor="none"))
    for pair, colour in zip(balls, colours, strict=True):
        for centre in pair:
            axes.add_patch(Circle(tuple(centre), sizes.ball_radius, color=colour, lw=0))


def _png(name: str) -> Path:
    return IMAGES / f"{name}.png"


DRAWN = {
    f.__name__: f
    for f in (
        heading,
        delta,
        atlas,
        proportions,
        minima_kinds,
        collisions,
        dyad_landscape,
        tutorial,
        measures,
        viewer,
        viewer_film,
        drum_bunch,
    )
}

if __name__ == "__main__":
    for chosen in sys.argv[1:] or DRAWN:
        DRAWN[chosen]()
