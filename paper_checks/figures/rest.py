"""Regions of rest of a dumbbell on the tilted drum, turning points, and the sign of the torque."""

import math
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing

from paper_checks.figures import style
from paper_checks.figures.figure import Figure
from polycorner.dumbbells.dynamics.singles import keel_of
from polycorner.dumbbells.pictures.experiments import (
    HEADINGS,
    place_region,
    place_regions,
    place_torque,
)
from polycorner.dumbbells.statics.keel import RestRegion, net_torque, s_curve

KEEL = keel_of(style.DRUM)
TILT = KEEL.tilt
# Coefficients of rolling and angles epsilon in the paper's captions; its text contradicts them.
# Further coefficients for which the boundary is drawn, with their dashes.
OTHERS = {0.6: (4, 2), 1.2: (1, 1.5)}
DASHED = "#8E5A93"
CAPTIONS = (("b", "single dumbbells", 0.1, 8.0), ("c", "dyads", 0.2, 20.0))


def caption_region(rolling: float, epsilon: float) -> RestRegion:
    """Return ``A`` for a coefficient of rolling and ``epsilon`` in degrees."""
    return RestRegion(TILT, rolling, rolling / math.sin(math.radians(epsilon)))


# --------------------------------------------------------------------------------- regions


@style.styled()
def draw_rest_regions() -> Drawing:
    """Draw A, B and the eastern boundary, and A for the numbers of the paper's captions."""
    figure = style.canvas(style.WIDE, 4.4)
    first, *others = figure.subplots(1, 3, width_ratios=[1.5, 1, 1])
    place_regions(first, KEEL)
    style.letter(first, "a", rf"$\mu_r = {KEEL.rolling:g}$, $\mu_s = {KEEL.sliding:g}$")
    for axes, (letter, _, rolling, epsilon) in zip(others, CAPTIONS, strict=True):
        region = caption_region(rolling, epsilon)
        place_region(axes, region)
        words = rf"$\mu_r = {rolling:g}$, $\varepsilon = {epsilon:g}°$"
        style.letter(axes, letter, words)
        axes.set_xticks(range(-40, 41, 20))
    for axes in (first, *others):
        _frame(axes)
    for axes in others:
        axes.set_ylabel("")
        axes.tick_params(labelleft=False)
    handles, labels = first.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3)
    return figure


def _frame(axes: Axes) -> None:
    axes.set(ylim=(-90, 90), yticks=range(-90, 91, 30))
    axes.set(xlabel=r"azimuth $\varphi$ (degrees)", ylabel=r"heading $\theta$ (degrees)")
    axes.axhline(0, color="0.75", linewidth=0.6, zorder=0.5)
    axes.axvline(0, color="0.75", linewidth=0.6, zorder=0.5)


def _rest_caption() -> str:
    limits = [
        math.degrees(region.limit)
        for region in (KEEL.onset, *(caption_region(*row[2:]) for row in CAPTIONS))
    ]
    east = np.degrees(KEEL.onset.eastern_boundary(np.radians([-15.0, 0.0, 15.0])))
    slides = [caption_region(*row[2:]).sliding for row in CAPTIONS]
    epsilon = math.degrees(math.asin(KEEL.rolling / KEEL.sliding))
    return style.minus(
        "Azimuths and headings at which a short dumbbell rests in a drum tilted by α = "
        f"{math.degrees(TILT):g}° (tan α = {math.tan(TILT):.3f}). (a) The coefficients of the "
        f"paper's text, sin ε = μr/μs, ε = {epsilon:.1f}°. A (pale): a dumbbell at rest stays; B "
        f"(dark): also when it is nudged, with dynamic coefficients {KEEL.rolling_dynamic:g} and "
        f"{KEEL.sliding_dynamic:g}, which the paper does not give. The drum carries a dumbbell to "
        "the right, out of A through its eastern boundary (blue for positive, green for negative "
        f"headings), at φ = {east[0]:.2f}°, {east[1]:.2f}° and {east[2]:.2f}° for θ = −15°, 0°, "
        "15°; arrows lead to where, by its inertia, it stops. Vermilion: S, dumbbells along the "
        f"flow lines. Beyond |φ| = φs no dumbbell rests: {limits[0]:.2f}°. (b), (c) A for the "
        "values in the paper's caption on turning points, of single dumbbells and of dyads: they "
        f"mean μs = {slides[0]:.3f} and {slides[1]:.3f}, "
        f"φs = {limits[1]:.1f}° and {limits[2]:.1f}°, "
        "other than in the text; in (c) μr exceeds tan α, so that on the lowest line every "
        "heading rests. The measured points are not given as numbers."
    )


def _rest_alt() -> str:
    return (
        "Three panels, azimuth to the right, heading upwards from minus 90 to 90 degrees. In the "
        "first a pale region A, a slanted band along the S-shaped curve that widens to a full "
        "strip of azimuths where the curve runs steeply through the middle, contains a smaller "
        "dark region B of the same shape. A's right-hand boundary is blue above heading zero and "
        f"green below. From it {len(HEADINGS)} arrows point left, into B. The other two panels "
        "show larger regions A for the numbers in the paper's captions; the last, for dyads, "
        "covers all headings near azimuth zero."
    )


# ---------------------------------------------------------------------------------- torque


@style.styled()
def draw_torque() -> Drawing:
    """Draw S and the region in which the torque on a sliding dumbbell increases its heading."""
    figure = style.canvas(style.WIDE, 4.1)
    first, second = figure.subplots(1, 2)
    for axes in (first, second):
        place_torque(axes, KEEL, KEEL.sliding_dynamic)
        _draw_others(axes)
        _frame(axes)
    second.set(xlim=(0, 90), ylim=(70, 90), yticks=range(70, 91, 5))
    style.letter(first, "a")
    style.letter(second, "b", "steep headings, enlarged")
    second.text(48, 83.2, r"$|\theta|$ falls", ha="center", color="0.3")
    box = {"boxstyle": "round,pad=0.15", "fc": "white", "ec": "none", "alpha": 0.85}
    second.text(60, 89.1, r"$|\theta|$ grows", ha="center", va="center", color="0.3", bbox=box)
    handles, labels = first.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=5)
    return figure


def _draw_others(axes: Axes) -> None:
    """Draw the boundary for other coefficients of friction."""
    phi, theta = np.linspace(-89.9, 89.9, 721), np.linspace(-89.9, 89.9, 1441)[:, None]
    for friction, dashes in OTHERS.items():
        torque = np.sign(theta) * net_torque(np.radians(phi), np.radians(theta), TILT, friction)
        for side in (phi < 0, phi > 0):
            how: dict[str, Any] = {"colors": DASHED, "linewidths": 0.9, "linestyles": [(0, dashes)]}
            half = theta[:, 0] * (1 if phi[side][0] > 0 else -1) > 0
            axes.contour(phi[side], theta[half, 0], torque[np.ix_(half, side)], levels=[0], **how)
        axes.plot([], [], color=DASHED, lw=0.9, ls=(0, dashes), label=rf"$\mu = {friction:g}$")


def growing(phi: Any, theta: Any) -> Any:
    """Return whether the torque at angles in degrees has the sign of the heading."""
    phi, theta = np.radians(phi), np.radians(theta)
    return np.sign(theta) * net_torque(phi, theta, TILT, KEEL.sliding_dynamic) > 0


def least_within(limit: float) -> float:
    """Return the least heading, in degrees, that grows at an azimuth up to a limit in degrees."""
    theta = np.linspace(0.01, 89.99, 9000)[:, None]
    return float(theta[growing(np.linspace(0, limit, 301), theta).any(axis=1)].min())


def grown_share(limit: float) -> float:
    """Return the share of all headings and of azimuths up to a limit, in degrees, that grow."""
    phi, theta = np.linspace(-limit, limit, 801), np.linspace(-90, 90, 901)[:, None]
    return float(np.mean(growing(phi, theta)))


def _torque_caption() -> str:
    limit = math.degrees(KEEL.onset.limit)
    others = " and ".join(f"{friction:g}" for friction in OTHERS)
    return (
        f"(a) Azimuths and headings in a drum tilted by α = {math.degrees(TILT):g}°. Vermilion: "
        "the curve S, tan θ = sin φ / tan α, on which a dumbbell lies along a flow line of "
        "gravity and is not made to roll. Hatched: where the torque on a short dumbbell that "
        f"slides down the slope increases |θ|; friction {KEEL.sliding_dynamic:g} times each "
        "ball's load acts against the motion, and the lower ball is pressed harder. That is "
        f"{100 * grown_share(90.0):.2f} % of the plane, between S and |θ| = 90°, at headings of "
        f"more than {least_within(89.99):.1f}°; at |φ| ≤ φs = {limit:.1f}° (grey), beyond which "
        f"no dumbbell rests, it is {100 * grown_share(limit):.2f} % and begins at "
        f"{least_within(limit):.1f}°. Elsewhere |θ| decreases. Dashed and dotted: the boundary for "
        f"friction {others}. (b) A part of (a). The paper does not say in which motion its torque "
        "is taken; a dumbbell that rests or rolls is held by friction and keeps its heading."
    )


def _torque_alt() -> str:
    return (
        "The plane of azimuth and heading, both from minus 90 to 90 degrees. The S-shaped curve "
        "runs steeply through the origin and flattens towards headings of "
        f"{math.degrees(float(s_curve(math.pi / 2, TILT))):.0f} degrees at the right and minus "
        "that at the left. Hatched is a thin strip above it at the right, along the upper edge, "
        f"above {least_within(89.99):.0f} degrees, and its image below the curve at the left. A "
        "grey band in the middle marks the azimuths at which a dumbbell can rest. The upper "
        "right part is shown again enlarged: with more friction the strip is wider, but stays "
        "above the curve."
    )


FIGURES = (
    Figure("torque", "Where headings grow", _torque_caption, _torque_alt, draw_torque),
    Figure(
        "rest_regions",
        "Regions of rest and their eastern boundary",
        _rest_caption,
        _rest_alt,
        draw_rest_regions,
    ),
)
