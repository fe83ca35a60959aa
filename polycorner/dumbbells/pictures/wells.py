"""Figures of U, half-U and half-V wells: capture, escape, wells of a dyad, collisions."""

import math
from collections.abc import Sequence
from itertools import cycle
from statistics import NormalDist

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from scipy.spatial import KDTree

from polycorner.dumbbells.pair import DumbbellPair
from polycorner.dumbbells.pictures.relabelling import draw_flat_pair
from polycorner.dumbbells.pictures.symbols import HANDS, sizes_in_words
from polycorner.dumbbells.statics.wells import Agitation, Hold, dyad_holds, hold_escapes, hold_times
from polycorner.landscapes import Basins
from polycorner.minimisation import Entrapment
from polycorner.models.wells import (
    KINDS,
    Comparison,
    Escapes,
    Well,
    kick_of,
    ladder,
    overdamped_escape_time,
    rests,
)
from polycorner.motion import Noise, simulate
from polycorner.toolkit import SHADES, Array, checked, refuse

COLOURS = dict(zip(KINDS, ("#0072B2", "#E69F00", "#D55E00"), strict=True))
SHAKEN = 120.0  # duration of sample paths, in a sqrt(m / D)
RIMS = tuple(np.geomspace(0.1, 1.0, 8).tolist())  # mm
SHAKING = Agitation(energy=2e-3, drag_rate=5.0)  # of the dyad, in weights of a ball times mm; 1/s
MEASURED = 0.25  # mm, simulated
LONGEST = 30.0  # s, longest mean time that is simulated
TITLE = 11
PATH = 2  # seed of the sample paths
FRICTION = 0.04  # of the depth per rim, in the panels with friction


@checked
def draw_wells(comparison: Comparison, pair: DumbbellPair) -> Figure:
    """Draw the three wells, their escape times by drag and restitution, and the wells of a dyad.

    The first row is about noise: the wells, paths under the same kicks, and mean times to escape
    by drag and by restitution; points with error bars (95 per cent) are simulations, curves solve
    the backward equation.  The second row is about capture without noise, and about the corner of a
    dyad, whose directions are labelled by its certificate.
    """
    figure = Figure(figsize=(18, 8.6), layout="constrained")
    axes = figure.subplots(2, 4)
    _draw_wells(axes[0, 0], comparison.wells)
    _draw_paths(axes[0, 1], comparison)
    _draw_drags(axes[0, 2], comparison)
    _draw_restitutions(axes[0, 3], comparison)
    lossy = ladder(1.0, friction=FRICTION, restitution=0.6)
    _draw_capture(axes[1, 0], lossy)
    _draw_final_positions(axes[1, 1], lossy)
    holds = [hold for hold in dyad_holds(pair) if hold.kind is not Entrapment.FREE]
    _draw_holds(axes[1, 2], _distinct(holds))
    _draw_hold_times(axes[1, 3], _distinct(holds))
    sizes = f"l = {pair.length:g}, r = {pair.ball_radius:g}, t = {pair.rod_radius:g}"
    figure.suptitle(
        "Three ways to hold a mass, at the same rim a, depth D, noise and drag;  "
        f"below right: a dyad with {sizes}, R = {pair.drum_radius:g} mm"
    )
    return figure


def _draw_wells(axes: Axes, wells: Sequence[Well]) -> None:
    for well in wells:
        x = np.linspace(0 if well.wall else -well.rim, well.rim, 201)
        y = well.potential(x) / well.depth
        axes.plot(x, y, color=COLOURS[well.kind], linewidth=2, label=well.kind.value)
    axes.axvline(0, color="0.35", linewidth=1.2)
    axes.axvspan(-0.06, 0, ymax=0.92, facecolor="none", hatch="////", edgecolor="0.5", linewidth=0)
    axes.text(-0.09, 0.97, "wall of the half wells", rotation=90, va="top", ha="right", color="0.4")
    axes.set(xlabel="x / a", ylabel="V / D", ylim=(-0.02, 1.05), xticks=[-1, -0.5, 0, 0.5, 1])
    axes.set_title("(a) equal rim and depth", fontsize=TITLE)
    axes.legend(loc="lower left", frameon=False)


def _draw_paths(axes: Axes, comparison: Comparison) -> None:
    step = min(well.time_step for well in comparison.wells)
    unit = math.sqrt(1 / comparison.wells[0].depth)
    for rank, well in enumerate(reversed(comparison.wells)):
        noise = Noise(kicks={"x": kick_of(well, comparison.temperature)}, seed=PATH)
        start = well.system.state([0.0])
        path = simulate(well.system, start, SHAKEN * unit, step, every=2, noise=noise)
        out = [event.time for event in path.events if event.contact == "rim"]
        inside = path.times <= min([*out, math.inf])
        base, colour = 1.5 * rank, COLOURS[well.kind]
        place = path.q[inside, 0, 0] if well.wall else abs(path.q[inside, 0, 0])
        axes.plot(path.times[inside] / unit, base + place, color=colour, linewidth=0.8)
        axes.axhline(base, color="0.35", linewidth=0.8)
        axes.axhline(base + 1, color="0.7", linewidth=0.8, linestyle=":")
        if out:
            axes.plot(min(out) / unit, base + 1, "x", color=colour, markersize=9, mew=2)
        name = well.kind.value if well.wall else f"{well.kind.value}, |x|"
        axes.text(0.99 * SHAKEN, base + 1.05, name, color=colour, ha="right", va="bottom")
    axes.set(ylim=(-0.1, 4.4), xlim=(0, SHAKEN), yticks=[0, 1], yticklabels=["0", "a"])
    axes.set_xlabel("time / a √(m/D)")
    drag = comparison.wells[0].drag
    axes.set_title(f"(b) the same kicks, until out; c = {drag:g} √(mT)/a", fontsize=TITLE)


def _draw_drags(axes: Axes, comparison: Comparison) -> None:
    """Draw the mean escape times relative to those of the U well with the same drag."""
    reference = {run.well.drag: run for run in comparison.runs if not run.well.wall}
    for kind, times in zip(KINDS, comparison.over_drag, strict=True):
        ratio = times / comparison.over_drag[0]
        axes.loglog(comparison.drags, ratio, color=COLOURS[kind], label=kind.value)
    for run in comparison.runs:
        if run.well.restitution == 0 and run.well.wall:
            _error_bar(axes, run.well.drag, run, reference[run.well.drag])
    first, _, third = (_limit(comparison, which) for which in range(3))
    axes.axhline(third / first, color=COLOURS[KINDS[2]], linestyle="--", linewidth=1)
    axes.text(comparison.drags[0], 0.98 * third / first, "half-V, overdamped", va="top", fontsize=9)
    axes.set(xlabel="drag c / (√(mT)/a)", ylabel="mean time to escape / that of U")
    depth = comparison.wells[0].depth / comparison.temperature
    axes.set_title(f"(c) walls that absorb, D = {depth:g} T", fontsize=TITLE)
    axes.legend(frameon=False, loc="upper right")


def _limit(comparison: Comparison, which: int) -> float:
    well = comparison.wells[which]
    return overdamped_escape_time(well, kick_of(well, comparison.temperature))


def _draw_restitutions(axes: Axes, comparison: Comparison) -> None:
    least = comparison.wells[0].drag
    for kind, times in zip(KINDS, comparison.over_restitution, strict=True):
        ratio = times / comparison.over_restitution[0]
        axes.semilogy(comparison.restitutions, ratio, color=COLOURS[kind], label=kind.value)
    (reference,) = (r for r in comparison.runs if r.well.drag == least and not r.well.wall)
    for run in comparison.runs:
        if run.well.drag == least and run.well.wall:
            _error_bar(axes, run.well.restitution, run, reference)
    axes.set(xlabel="restitution e of the wall", ylabel="mean time to escape / that of U")
    axes.yaxis.set_major_formatter("{x:g}")
    axes.yaxis.set_minor_formatter("{x:.1g}")
    axes.set_title(f"(d) from absorbing to elastic, c = {least:g} √(mT)/a", fontsize=TITLE)
    axes.legend(frameon=False, loc="upper right")


def _error_bar(
    axes: Axes,
    where: float,
    run: Escapes,
    reference: Escapes | None = None,
    colour: str | None = None,
) -> None:
    """Draw a mean, or a ratio of two independent ones, with its 95 per cent interval."""
    mean, spread = run.mean, run.error / run.mean
    if reference is not None:
        mean = mean / reference.mean
        spread = math.hypot(spread, reference.error / reference.mean)
    factor = math.exp(NormalDist().inv_cdf(0.975) * spread)
    bar = [[mean - mean / factor], [mean * factor - mean]]
    style = colour or COLOURS[run.well.kind]
    axes.errorbar(where, mean, bar, fmt="o", color=style, markersize=4, capsize=3)


def _draw_capture(axes: Axes, wells: Sequence[Well]) -> None:
    """Draw the energy of the mass at each passage of 0, from the rim on."""
    for well in wells:
        speed = _speed_to(well, 0.9 * well.rim)
        energies, times, total = [well.mass * speed**2 / 2], [0.0], 0.0
        for flight in well.flights(speed):
            total += flight.duration
            kept = well.kept * flight.speed
            energies.append(well.mass * kept**2 / 2)
            times.append(total)
            if energies[-1] < 1e-7 * energies[0]:
                break
        colour = COLOURS[well.kind]
        shown = np.array(energies) / well.depth
        end, place = well.capture(speed)
        label = f"{well.kind.value}: stops at {f'{place:.2g} a' if place else 0}"
        axes.semilogy(times, np.where(shown > 0, shown, math.nan), "o-", color=colour, markersize=4)
        axes.axvline(end, color=colour, linestyle="--", linewidth=1, label=label)
    axes.set(xlabel="time / a √(m/D)", ylabel="energy on leaving 0 / D", ylim=(1e-5, 2))
    loss = f"e = {wells[-1].restitution:g}, friction {wells[0].friction:g} D/a"
    axes.set_title(f"(e) no noise, {loss}", fontsize=TITLE)
    axes.legend(frameon=False, loc="center", bbox_to_anchor=(0.57, 0.3), fontsize=9)


def _speed_to(well: Well, height: float) -> float:
    """Return the speed at 0 with which the mass reaches a height."""
    work = well.potential(height) + well.friction * height
    return math.sqrt(2 * float(work) / well.mass)


def _draw_final_positions(axes: Axes, wells: Sequence[Well]) -> None:
    """Draw the final positions of masses that start at rest anywhere in the well."""
    rng = np.random.default_rng(1)
    for well in wells:
        starts = well.starts(rng, 200)[:, 0]
        places, _ = rests(well, starts, np.zeros(len(starts)), duration=80.0, dt=0.02)
        ends = np.concatenate([[-1.0], np.sort(places) / well.rim, [1.0]])
        share = np.concatenate([[0.0], np.arange(1, len(places) + 1) / len(places), [1.0]])
        axes.step(ends, share, where="post", color=COLOURS[well.kind], label=well.kind.value)
    reach = 1.3 * wells[0].friction / wells[0].stiffness
    axes.set(xlabel="final position x / a", xlim=(-reach, reach), ylim=(0, 1.02))
    axes.set_ylabel("share of masses up to there")
    axes.set_title("(f) final positions under friction", fontsize=TITLE)
    axes.legend(frameon=False, loc="upper left")


def _distinct(holds: Sequence[Hold]) -> list[tuple[str, Hold]]:
    """Return distinct holds, with the names of all directions that share them."""
    found: list[tuple[str, Hold]] = []
    for hold in holds:
        for k, (name, other) in enumerate(found):
            numbers = (hold.slope, hold.stiffness), (other.slope, other.stiffness)
            if np.allclose(*numbers, rtol=1e-9):
                found[k] = (f"{name}, {hold.direction}", other)
                break
        else:
            found.append((hold.direction, hold))
    return found


def _colours(holds: Sequence[tuple[str, Hold]]) -> list[str]:
    """Return reds for half-V and blues for U."""
    reds, blues = cycle(("#D55E00", "#CC79A7", "#E69F00")), cycle(("#0072B2", "#56B4E9", "#009E73"))
    return [next(blues if hold.kind is Entrapment.U else reds) for _, hold in holds]


def _draw_holds(axes: Axes, holds: Sequence[tuple[str, Hold]]) -> None:
    s = np.linspace(0, 1.2, 121)
    for colour, (name, hold) in zip(_colours(holds), holds, strict=True):
        energy = 1e3 * (hold.slope * s + hold.stiffness * s**2 / 2)
        axes.plot(s, energy, color=colour, label=f"{hold.kind.value}:  {name}")
        if hold.slope > 0:
            axes.plot(s, 1e3 * hold.stiffness * s**2 / 2, ":", color=colour, linewidth=1)
    axes.plot([], [], ":", color="0.5", linewidth=1, label="the same without its slope")
    axes.set(xlabel="mean way of the balls s (mm)", ylabel="energy (µm × weight of a ball)")
    axes.set(xlim=(0, 1.2), ylim=(0, None))
    axes.set_title("(g) the dyad's corner, direction by direction", fontsize=TITLE)
    axes.legend(frameon=False, fontsize=9)


def _draw_hold_times(axes: Axes, holds: Sequence[tuple[str, Hold]]) -> None:
    times = hold_times([hold for _, hold in holds], RIMS, SHAKING)
    for colour, (name, hold), row in zip(_colours(holds), holds, times, strict=True):
        axes.loglog(RIMS, row, color=colour, label=f"{hold.kind.value}:  {name}")
        if (expected := float(np.interp(MEASURED, RIMS, row))) < LONGEST:
            run = hold_escapes(hold, MEASURED, SHAKING, duration=12 * expected)
            _error_bar(axes, MEASURED, run, colour=colour)
    bare = [hold.without_slope for _, hold in holds if hold.slope > 0]
    for colour, row in zip(_colours(holds), hold_times(bare, RIMS, SHAKING), strict=False):
        axes.loglog(RIMS, row, ":", color=colour, linewidth=1)
    axes.plot([], [], ":", color="0.5", linewidth=1, label="the same without its slope: half-U")
    axes.set(xlabel="mean way of the balls (mm)", ylabel="mean time to get there (s)")
    noise = f"T = {1e3 * SHAKING.energy:g} µm × weight, drag {SHAKING.drag_rate:g}/s"
    axes.set_title(f"(h) {noise}, e = {SHAKING.restitution:g}", fontsize=TITLE)
    axes.legend(frameon=False, fontsize=9)


# -------------------------------------------------------------------- collisions, by where they end

KNOWN = {"G": ("$G$", "0.85"), "delta_R": ("$\\delta_R$", HANDS["R"])}
KNOWN["delta_L"] = ("$\\delta_L$", HANDS["L"])
PANELS = 3  # collisions that are shown beside the map, at most


@checked
def draw_meetings(pair: DumbbellPair, found: Basins) -> Figure:
    """Draw where collisions end, over the axial offset and the heading of the second dumbbell.

    Where it is black they end in no minimum.  Beside the map is, of each kind, a collision far from
    those of other kinds, in the developed plane with the drum's axis upright.

    Parameters
    ----------
    pair : DumbbellPair
    found : Basins
        Of :func:`~polycorner.dumbbells.meeting_basins`, for offsets and headings on a grid.
    """
    if not found.descents:
        refuse("found", "at least one collision", found)
    figure = Figure(figsize=(10, 6.2), layout="constrained")
    kinds = sorted((k for k, n in enumerate(found.counts) if n), key=lambda k: -found.counts[k])
    styles = {k: _style(found.names[k], k) for k in kinds}
    grid = figure.add_gridspec(PANELS, 2, width_ratios=(3, 1))
    axes = figure.add_subplot(grid[:, 0])
    _draw_map(axes, found, {k: colour for k, (_, colour) in styles.items()})
    handles = [
        Patch(color=colour, label=f"{word}: {found.shares[k]:.1%}")
        for k, (word, colour) in styles.items()
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(kinds), frameon=False)
    reach = pair.length + 3 * pair.ball_radius
    for row, k in enumerate(kinds[:PANELS]):
        q = found.points[_deepest(found, k)]
        axes.text(q[4], np.degrees(q[5]), f"{row + 1}", ha="center", va="center", weight="bold")
        side = figure.add_subplot(grid[row, 1])
        balls = pair.developed(q)
        draw_flat_pair(side, pair, balls - balls.mean(axis=0), ())
        side.set(aspect="equal", title=f"{row + 1}: to {styles[k][0]}")
        side.set(xlim=(-0.7 * reach, 0.7 * reach), ylim=(-reach, reach))
        side.set_axis_off()
    figure.suptitle(f"Collisions by where they end, {sizes_in_words(pair)}")
    return figure


def _style(name: str, k: int) -> tuple[str, str]:
    return KNOWN.get(name, (name, SHADES[k % len(SHADES)]))


def _draw_map(axes: Axes, found: Basins, colours: dict[int, str]) -> None:
    offsets, column = np.unique(found.points[:, 4], return_inverse=True)
    headings, row = np.unique(np.degrees(found.points[:, 5]), return_inverse=True)
    image = np.ones((len(headings), len(offsets), 3))
    image[row, column] = [to_rgb(colours.get(k, "black")) for k in found.ends.tolist()]
    axes.pcolormesh(_edges(offsets), _edges(headings), image)
    axes.set(xlabel="axial offset (mm)", ylabel="heading of the second dumbbell (°)")


def _edges(middles: Array) -> Array:
    """Return the boundaries of cells around values, halfway between them."""
    if len(middles) == 1:
        return np.asarray(middles + np.array([-0.5, 0.5]))
    between = (middles[1:] + middles[:-1]) / 2
    ends = 2 * middles[[0, -1]] - between[[0, -1]]
    return np.concatenate([ends[:1], between, ends[1:]])


def _deepest(found: Basins, k: int) -> int:
    """Return the number of the collision of a kind that is farthest from others and from the rim.

    On the rim are, at each heading, the outermost offsets.
    """
    headings, row = np.unique(found.points[:, 5], return_inverse=True)
    far = np.zeros(len(headings))
    np.maximum.at(far, row, abs(found.points[:, 4]))
    places = found.points[:, 4:6] / np.maximum(np.ptp(found.points[:, 4:6], axis=0), 1.0)
    others = places[(found.ends != k) | (abs(found.points[:, 4]) == far[row])]
    same = np.flatnonzero(found.ends == k)
    return int(same[np.argmax(KDTree(others).query(places[same])[0])])
