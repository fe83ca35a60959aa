"""The tilted drum in space with its coordinates, and a dumbbell with its lengths."""

import math
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing
from matplotlib.patches import Polygon

from paper_checks.figures import style
from paper_checks.figures.figure import Figure

DRUM = style.DRUM
TILT, RADIUS = DRUM.tilt, DRUM.drum_radius
LONG = 330.0  # mm, length of the drum as drawn; the paper does not give it
PLACE = (math.radians(30), 180.0, math.radians(24))  # phi, eta, theta of the dumbbell in space
ENLARGED = 5  # magnification of the dumbbell there
EYE = np.array([0.46, -0.42, 0.55])


def laboratory(phi: Any, eta: Any, radius: float = RADIUS) -> Any:
    """Return ``x, y, z`` of points on the tilted drum, ``(..., 3)``; ``z`` is vertical."""
    phi, eta = np.broadcast_arrays(np.asarray(phi, dtype=float), np.asarray(eta, dtype=float))
    below = radius * np.cos(phi)  # the axis, towards the lowest line
    sine, cosine = math.sin(TILT), math.cos(TILT)
    return np.stack(
        [radius * np.sin(phi), eta * cosine + below * sine, eta * sine - below * cosine], axis=-1
    )


def seen(points: Any) -> Any:
    """Return the parallel projection ``(..., 2)`` of points in space to the page."""
    eye = EYE / np.linalg.norm(EYE)
    right = np.cross([0.0, 0.0, 1.0], eye)
    right /= np.linalg.norm(right)
    return np.asarray(points) @ np.stack([right, np.cross(eye, right)], axis=1)


# ----------------------------------------------------------------------------- coordinates


@style.styled()
def draw_coordinates() -> Drawing:
    """Draw the drum in space and, beside it, the dumbbell in the developed plane."""
    figure = style.canvas(style.WIDE, 3.7)
    left, right = figure.subplots(1, 2, width_ratios=[2.35, 1])
    _draw_space(left)
    _draw_developed(right)
    for axes in (left, right):
        axes.set_anchor("N")
    style.letter(left, "a", "the tilted drum")
    style.letter(right, "b", "the dumbbell, unrolled")
    return figure


def _curve(axes: Axes, points: Any, **how: Any) -> None:
    axes.plot(*seen(points).T, **how)


def _draw_space(axes: Axes) -> None:
    turn = np.linspace(-math.pi, math.pi, 181)
    low, high = seen(laboratory(turn, 0.0)), seen(laboratory(turn, LONG))
    outline = _hull(np.concatenate([low, high]))
    axes.add_patch(Polygon(outline, fc="#EEF3F7", ec="none", zorder=0))
    axes.add_patch(Polygon(low, fc="#DCE5EC", ec="0.5", lw=0.8, zorder=0.2))
    half = np.linspace(-math.pi / 2, math.pi / 2, 91)
    strip = np.concatenate([laboratory(half, 0.0), laboratory(half[::-1], LONG)])
    axes.add_patch(Polygon(_hull(seen(strip)), fc="#D3E4F1", ec="none", alpha=0.75, zorder=0.3))
    for degrees in range(-90, 91, 30):
        along = laboratory(math.radians(degrees), np.array([0.0, LONG]))
        strong = {"color": "0.35", "lw": 1.1, "ls": (0, (4, 2))}
        faint = {"color": "0.62", "lw": 0.6}
        _curve(axes, along, zorder=0.6, **(faint if degrees else strong))
    for eta in np.linspace(0.0, LONG, 7)[1:-1]:
        _curve(axes, laboratory(half, eta), color="0.72", lw=0.5, zorder=0.5)
    axes.add_patch(Polygon(outline, fill=False, ec="0.45", lw=0.8, zorder=1))
    axes.add_patch(Polygon(high, fill=False, ec="0.25", lw=1.3, zorder=1.1))
    _draw_axis(axes)
    _draw_place(axes)
    _draw_turning(axes)
    _draw_laboratory(axes)
    style.bare(axes)
    axes.margins(0.03)


def _hull(points: Any) -> Any:
    from scipy.spatial import ConvexHull

    return points[ConvexHull(points).vertices]


def _draw_axis(axes: Axes) -> None:
    """Draw the drum's axis, a level line, and the tilt between them."""
    ends = np.array([0.0, LONG + 150])
    axis = np.stack([0 * ends, ends * math.cos(TILT), ends * math.sin(TILT)], axis=-1)
    _curve(axes, axis, color="0.3", lw=0.8, ls=(0, (7, 2, 1, 2)), zorder=1.2)
    level = axis * [1, 1 / math.cos(TILT), 0]
    _curve(axes, level, color="0.3", lw=0.8, ls=":", zorder=1.2)
    angle = np.linspace(0.0, TILT, 20)
    reach = LONG + 110
    _curve(
        axes,
        reach * np.stack([0 * angle, np.cos(angle), np.sin(angle)], axis=-1),
        color="0.1",
        lw=1.0,
        zorder=2,
    )
    x, y = seen(1.03 * reach * np.array([0.0, math.cos(TILT / 2), math.sin(TILT / 2)]))
    axes.text(x + 6, y, rf"$\alpha = {math.degrees(TILT):g}°$", va="center")


def _draw_place(axes: Axes) -> None:
    phi, eta, theta = PLACE
    middle = np.array([0.0, eta * math.cos(TILT), eta * math.sin(TILT)])
    along = np.linspace(0.0, 1.0, 2)[:, None]
    for angle in (0.0, phi):
        foot = laboratory(angle, eta)
        _curve(axes, middle + along * (foot - middle), color="0.45", lw=0.7, zorder=1.5)
    arc = np.linspace(0.0, phi, 40)
    axis = np.array([0.0, eta * math.cos(TILT), eta * math.sin(TILT)])
    reach = axis + 0.6 * (laboratory(arc, eta) - axis)
    _arrow(axes, reach, "0.1")
    x, y = seen(axis + 0.62 * (laboratory(-0.5 * phi, eta) - axis))
    axes.text(x, y, r"$\varphi$", ha="center", va="center", fontsize=13, zorder=5)
    climb = laboratory(0.0, np.linspace(0.0, eta, 2))
    _arrow(axes, climb, "0.1")
    x, y = seen(laboratory(0.0, 0.45 * eta))
    axes.text(x + 7, y - 9, r"$\eta$", ha="center", va="center", fontsize=13, zorder=5)
    latitude = laboratory(np.linspace(0.0, phi, 40), eta)
    _curve(axes, latitude, color="0.1", lw=1.0, zorder=2)
    meridian = laboratory(phi, np.linspace(eta - 90, eta + 90, 2))
    _curve(axes, meridian, color="0.1", lw=0.9, ls=(0, (3, 2)), zorder=2)
    balls = _balls(phi, eta, theta, ENLARGED * DRUM.length)
    radii = (ENLARGED * DRUM.ball_radius, ENLARGED * DRUM.rod_radius)
    style.draw_dumbbell(axes, seen(balls), radii, style.RIGHT[0], zorder=3)
    turn = np.linspace(0.0, theta, 30)
    reach = laboratory(phi + 75 * np.sin(turn) / RADIUS, eta + 75 * np.cos(turn))
    _curve(axes, reach, color="0.1", lw=1.0, zorder=4)
    x, y = seen(laboratory(phi + 92 * math.sin(theta / 2) / RADIUS, eta + 92 * math.cos(theta / 2)))
    axes.text(x, y, r"$\theta$", ha="center", va="center", fontsize=13, zorder=5)


def _balls(phi: float, eta: float, theta: float, length: float) -> Any:
    """Return the centres of the balls of a dumbbell of any length on the wall, ``(2, 3)``."""
    ends = length / 2 * np.array([-1.0, 1.0])
    inside = RADIUS - length * DRUM.ball_radius / DRUM.length
    azimuths = phi + ends * math.sin(theta) / inside
    return laboratory(azimuths, eta + ends * math.cos(theta), inside)


def _arrow(axes: Axes, points: Any, colour: str) -> None:
    """Draw a curve in space that ends in an arrow."""
    page = seen(points)
    axes.plot(*page.T, color=colour, lw=1.1, zorder=2)
    head: dict[str, Any] = {
        "arrowstyle": "-|>",
        "color": colour,
        "lw": 1.1,
        "shrinkA": 0,
        "shrinkB": 0,
    }
    axes.annotate("", page[-1], xytext=page[-2], arrowprops=head, zorder=2)


def _draw_turning(axes: Axes) -> None:
    turn = np.radians(np.linspace(15, 75, 40))
    _arrow(axes, laboratory(turn, LONG, 1.13 * RADIUS), style.GRAVITY)
    x, y = seen(laboratory(math.radians(45), LONG, 1.3 * RADIUS))
    axes.text(x, y, r"$\omega$", color=style.GRAVITY, ha="center", va="center", fontsize=13)


def _draw_laboratory(axes: Axes) -> None:
    """Draw the directions of x, y and the vertical z."""
    page = seen(laboratory(np.linspace(-math.pi, math.pi, 90), 0.0))
    origin = np.array([page[:, 0].min() - 5, page[:, 1].min() - 25])
    for k, name in enumerate("xyz"):
        tip = origin + seen(48 * np.eye(3)[k])
        head: dict[str, Any] = {
            "arrowstyle": "-|>",
            "color": "0.25",
            "lw": 0.9,
            "shrinkA": 0,
            "shrinkB": 0,
        }
        axes.annotate("", tuple(tip), xytext=tuple(origin), arrowprops=head)
        x, y = origin + 1.28 * (tip - origin)
        axes.text(x, y, f"${name}$", ha="center", va="center", color="0.25")
        axes.plot(x, y, alpha=0)


def _draw_developed(axes: Axes) -> None:
    """Draw a dumbbell to scale beside its meridian, with its lengths."""
    length, r, t = DRUM.length, DRUM.ball_radius, DRUM.rod_radius
    theta = PLACE[2]
    along, across = (
        np.array([math.sin(theta), math.cos(theta)]),
        np.array([math.cos(theta), -math.sin(theta)]),
    )
    balls = np.array([-along, along]) * length / 2
    axes.plot([0, 0], [-12.5, 16], color="0.1", lw=0.9, ls=(0, (3, 2)), zorder=2)
    axes.text(-0.7, 16, r"meridian, $\varphi$ constant", ha="center", va="bottom", fontsize=9.5)
    style.draw_dumbbell(axes, balls, (r, t), style.RIGHT[0], zorder=3)
    turn = np.linspace(0.0, theta, 30)
    axes.plot(13.5 * np.sin(turn), 13.5 * np.cos(turn), color="0.1", lw=1.0, zorder=4)
    x, y = 15.0 * math.sin(theta / 2), 15.0 * math.cos(theta / 2)
    axes.text(x, y, r"$\theta$", ha="center", va="center", fontsize=13)
    lower, upper = balls + 4.6 * across
    _measure(axes, lower, upper, rf"$\ell = {length:g}$ mm", 1.7 * across)
    low = balls[0] - 4.2 * along
    _measure(axes, low - r * across, low + r * across, f"$2r = {2 * r:g}$ mm", -1.6 * along)
    rod = -0.12 * length * along
    axes.annotate(
        f"$2t = {2 * t:g}$ mm",
        tuple(rod - 0.8 * t * across),
        xytext=(-12.4, 5.5),
        va="center",
        arrowprops={"arrowstyle": "-", "lw": 0.7},
        zorder=6,
    )
    for direction, name in (((5, 0), r"$\varphi$"), ((0, 5), r"$\eta$")):
        start = np.array([7.5, -15.0])
        head: dict[str, Any] = {
            "arrowstyle": "-|>",
            "color": "0.25",
            "lw": 0.9,
            "shrinkA": 0,
            "shrinkB": 0,
        }
        axes.annotate("", tuple(start + direction), xytext=tuple(start), arrowprops=head)
        x, y = start + 1.25 * np.array(direction)
        axes.text(x, y, name, ha="center", va="center")
    style.bare(axes)
    axes.set(xlim=(-13, 14.5), ylim=(-16, 18))


def _measure(axes: Axes, start: Any, stop: Any, words: str, off: Any) -> None:
    both: dict[str, Any] = {
        "arrowstyle": "<|-|>",
        "color": "0.2",
        "lw": 0.8,
        "shrinkA": 0,
        "shrinkB": 0,
    }
    both["mutation_scale"] = 7
    axes.annotate("", stop, xytext=start, arrowprops=both, zorder=5)
    turned = math.degrees(math.atan2(stop[1] - start[1], stop[0] - start[0]))
    x, y = (np.asarray(start) + stop) / 2 + off
    axes.text(x, y, words, rotation=turned, ha="center", va="center", zorder=6)


COORDINATES = Figure(
    "coordinates",
    "The drum and its coordinates",
    f"A drum of radius R = {RADIUS:g} mm, its axis tilted by α = {math.degrees(TILT):g}° and "
    f"rising with η, turns with ω = {DRUM.spin:g} rad/s. (a) Azimuth φ is counted from the lowest "
    "line (dashed), η along the axis from the flat bottom; the heading θ is the angle from the "
    "meridian to the dumbbell, positive as drawn. The lower half of the wall is tinted. The drum "
    f"is drawn {LONG:g} mm long and the dumbbell {ENLARGED} times its size. (b) The same dumbbell "
    "in the "
    f"developed wall, to scale: {style.sizes(style.PLANE)}.",
    "Left: a long glass cylinder rising gently to the right, a dumbbell on its lower wall; an arc "
    "from the lowest line marks the azimuth, an arrow along the lowest line the position along the "
    "axis, and an arc between meridian and dumbbell the heading. Arrows show the direction in "
    "which the drum turns, towards growing azimuth, and x, y and the vertical z. Right: the "
    "dumbbell as seen from inside, leaning to the right of its meridian by the heading, with the "
    "distance of its ball centres and the diameters of balls and rod.",
    draw_coordinates,
)
FIGURES = (COORDINATES,)
