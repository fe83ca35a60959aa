"""State of the live page: a pair, its placement and analysis, its descent, and messages."""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from polycorner.dumbbells.pair import Chirality, DumbbellPair
from polycorner.dumbbells.pictures.bodies import (
    WallPatch,
    box_of,
    contact_point,
    relative_stretch,
    sizes_of,
)
from polycorner.dumbbells.pictures.film import HANDS, TOUCHING, stratum_words
from polycorner.dumbbells.pictures.movies import chosen_frames
from polycorner.dumbbells.pictures.placements import relative_coordinates
from polycorner.dumbbells.pictures.symbols import energy_unit, multiplier_unit
from polycorner.minimisation import Certificate, Verdict, certify, minimise
from polycorner.polyhedra import LocalType
from polycorner.toolkit import Array, Checked, Value, cached_property, checked, pose, real, steepest

if TYPE_CHECKING:
    from polycorner.polyhedra import Polyhedron

PLACES = (
    ("lateral", "along the wall (mm)"),
    ("axial", "along the drum (mm)"),
    ("heading", "heading (degrees)"),
)
SHAPE = (
    ("length", "length l (mm)"),
    ("ball_radius", "ball radius r (mm)"),
    ("rod_radius", "rod radius t (mm)"),
    ("drum_radius", "drum radius R (mm)"),
)
BUTTONS = (
    ("fall", "Let it fall"),
    ("right", "Right-handed"),
    ("left", "Left-handed"),
    ("plane", "In the plane"),
    ("drum", "In the drum"),
)
MESSAGE = 512  # most bytes of a message; all sliders together need fewer


class UnknownMessageError(ValueError):
    """A message that the page never sends."""


@dataclass(frozen=True)
class SliderRange:
    """A number that the page may set: name, label, range and step."""

    name: str
    label: str
    low: float
    high: float
    step: float


def sliders_for(pair: DumbbellPair, radius: float) -> dict[str, SliderRange]:
    """Return the sliders of a pair by name, their ranges a few times its own lengths.

    Parameters
    ----------
    pair : DumbbellPair
    radius : float
        Of the drum, in mm, also if the pair starts in the plane.
    """
    reach = float(math.ceil(2 * (pair.length + 2 * pair.ball_radius)))
    fine = _fine(pair.ball_radius)
    limits = {"lateral": reach, "axial": reach, "heading": 180.0}
    found = [
        SliderRange(name, label, -limits[kind], limits[kind], 0.25 if kind == "heading" else fine)
        for body in "AB"
        for kind, label in PLACES
        for name in (f"{kind}_{body}",)
    ]
    r, shape = pair.ball_radius, dict(SHAPE)
    for name, low, high in (
        ("length", r, 3 * pair.length),
        ("ball_radius", r / 4, 3 * r),
        ("rod_radius", min(r / 20, pair.rod_radius), 3 * r),
        ("drum_radius", min(2 * r, radius), 4 * radius),
    ):
        found.append(SliderRange(name, shape[name], _round(low, fine), _round(high, fine), fine))
    return {slider.name: slider for slider in found}


def _fine(ball_radius: float) -> float:
    """Return a round step of about a fiftieth of a ball radius."""
    return float(10.0 ** math.floor(math.log10(ball_radius / 10)))


def _round(value: float, step: float) -> float:
    return max(step, round(value / step) * step)


def coordinates() -> list[str]:
    """Return the names of the sliders of the six coordinates, in their order."""
    return [f"{kind}_{body}" for body in "AB" for kind, _ in PLACES]


def hello(sliders: Mapping[str, SliderRange]) -> dict[str, Any]:
    """Return the groups of sliders and the buttons of the page, for JSON."""
    groups = [
        [f"Dumbbell {body}", [vars(sliders[f"{kind}_{body}"]) for kind, _ in PLACES]]
        for body in "AB"
    ]
    groups.append(["Shape", [vars(sliders[name]) for name, _ in SHAPE]])
    return {"groups": groups, "buttons": [list(button) for button in BUTTONS]}


def parsed(message: str, sliders: Mapping[str, SliderRange]) -> dict[str, float] | str:
    """Return slider values, or the name of a button, from a message of the page.

    Raises
    ------
    UnknownMessageError
        For all other messages, names and numbers.
    """
    try:
        content = json.loads(message)
    except (ValueError, RecursionError) as error:
        msg = "expected JSON: slider names with numbers, or the name of a button"
        raise UnknownMessageError(msg) from error
    if isinstance(content, str) and content in dict(BUTTONS):
        return content
    if not isinstance(content, dict) or not content:
        msg = "expected slider names with numbers, or the name of a button"
        raise UnknownMessageError(msg)
    return {name: _checked(name, value, sliders) for name, value in content.items()}


def _checked(name: str, value: object, sliders: Mapping[str, SliderRange]) -> float:
    slider = sliders.get(name)
    if slider is None:
        msg = "expected the name of a slider; got another one"
        raise UnknownMessageError(msg)
    # Integers of any size compare, but may not convert to float; nan is in no range.
    real = value if isinstance(value, int | float) and not isinstance(value, bool) else math.nan
    if slider.low <= real <= slider.high:
        return float(real)
    msg = f"{name}: expected a number from {slider.low:g} to {slider.high:g}"
    raise UnknownMessageError(msg)


STRIDE = 0.15  # longest step of a path, in scale units
LEAST = 1e-4  # length of a last step that is not worth a point of its own
MOST = 600  # points of a path


@dataclass(frozen=True, eq=False)
class Descent(Checked):
    """A path of steepest descent, and the certificate of its end.

    Attributes
    ----------
    points : (k, n) array
        From the start, or the nearest point of the polyhedron, to the minimum; coordinates on
        circles are not wrapped.  The energy decreases from each to the next.
    certificate : Certificate
        Of :func:`~polycorner.minimise` at the end; ``certificate.point`` is the last point, unless
        the polyhedron was not reached.
    """

    points: Array
    certificate: Certificate

    @property
    def lengths(self) -> Array:
        """Arc length of the path up to each point, ``(k,)``, in scale units."""
        scales = self.certificate.problem.scales
        steps = np.linalg.norm(np.diff(self.points, axis=0) / scales, axis=1)
        return np.concatenate([[0.0], np.cumsum(steps)])


@checked
def descent(
    polyhedron: "Polyhedron",
    energy: Any,
    start: ArrayLike,
    *,
    stride: float = STRIDE,
    most: int = MOST,
) -> Descent:
    """Return the path of steepest descent from ``start`` to a minimum.

    At every point the step is the negative gradient in scaled coordinates, as far as the contacts
    allow it.  It is the overdamped motion of a body: contacts close one by one, and stay closed
    while the energy presses on them.  Close to the minimum :func:`~polycorner.minimise` takes over.

    Parameters
    ----------
    polyhedron : Polyhedron
    energy : SmoothFunction or sympy.Expr
    start : (n,) array
        The start; outside the polyhedron, the path begins at a point of it nearby.
    stride : float, optional
        Longest step in scale units; a longer one may pass through thin bodies.
    most : int, optional
        Largest number of points.

    Raises
    ------
    ValueError
        For arguments that :func:`~polycorner.minimise` refuses.
    """
    real("stride", stride, above=0)
    problem = pose(polyhedron, energy)
    q = polyhedron.manifold.point(start, "start")
    points = steepest(problem, q, stride, most)
    certificate = minimise(polyhedron, energy, points[-1] if points else q)
    if not points:
        return Descent(q[None], certificate)
    last = points[-1] + polyhedron.manifold.difference(certificate.point, points[-1])
    if len(points) > 1 and np.linalg.norm((last - points[-1]) / problem.scales) < LEAST:
        points = points[:-1]
    return Descent(np.array([*points, last]), certificate)


DRUM = 125.0 / 16.0  # ratio of drum radius to length for a pair that starts in the plane
FRAMES = 150  # most frames of a descent
START = 30.0  # degrees, the initial heading set by the buttons


@dataclass(frozen=True)
class Board(Value):
    """A pair with its placement and its sliders.

    Attributes
    ----------
    pair : DumbbellPair
    q : tuple of six float
        The configuration at full precision; sliders that are not moved do not round it.
    sliders : mapping from str to SliderRange
    drum_radius : float
        ``R`` in mm, kept while the pair is in the plane.
    """

    pair: DumbbellPair
    q: tuple[float, ...]
    sliders: Mapping[str, SliderRange]
    drum_radius: float

    @classmethod
    def of(cls, pair: DumbbellPair) -> "Board":
        """Return the board that a page starts with: a right-handed pair above its minimum."""
        radius = DRUM * pair.length if pair.is_plane else pair.drum_radius
        board = cls(pair, (0.0,) * 6, sliders_for(pair, radius), radius)
        return board.started("R")

    @property
    def rho(self) -> float:
        """Millimetres along the wall for a unit of the lateral coordinate."""
        return 1.0 if self.pair.is_plane else self.pair.centre_radius

    @property
    def units(self) -> Array:
        """Unit of a slider over that of its coordinate, ``(6,)``."""
        return np.array([self.rho, 1.0, 180.0 / math.pi] * 2)

    @property
    def values(self) -> dict[str, float]:
        """The values of the sliders; headings are in ``[-180, 180]``."""
        shown = self.units * np.array(self.q)
        shown[[2, 5]] = [math.remainder(angle, 360.0) for angle in shown[[2, 5]].tolist()]
        values = dict(zip(coordinates(), shown.tolist(), strict=True))
        values |= {name: getattr(self.pair, name) for name, _ in SHAPE}
        return values | {"drum_radius": self.drum_radius}

    def moved(self, values: Mapping[str, float]) -> "Board":
        """Return the board with some sliders moved.

        Raises
        ------
        ValueError
            If there are no such dumbbells, such as with rods thicker than balls.
        """
        shape = {name: values[name] for name, _ in SHAPE if name in values}
        board = self
        if shape:
            radius = shape.get("drum_radius", self.drum_radius)
            if self.pair.is_plane:
                shape["drum_radius"] = math.inf
            board = replace(self._as(replace(self.pair, **shape)), drum_radius=radius)
        q = list(board.q)
        for k, name in enumerate(coordinates()):
            if name in values:
                q[k] = values[name] / float(board.units[k])
        return replace(board, q=tuple(q))

    def _as(self, pair: DumbbellPair) -> "Board":
        """Return the board of another pair in the same places along the wall, in mm."""
        board = replace(self, pair=pair)
        return replace(board, q=tuple((np.array(self.q) * self.units / board.units).tolist()))

    def pressed(self, button: str) -> "Board":
        """Return the board after one of the buttons other than ``fall``."""
        if button == "plane":
            return self._as(replace(self.pair, drum_radius=math.inf))
        if button == "drum":
            return self._as(replace(self.pair, drum_radius=self.drum_radius))
        return self.started("R" if button == "right" else "L")

    def started(self, chirality: Chirality) -> "Board":
        """Return the board with an open nested pair at ``START`` degrees off the lowest line."""
        sign = 1 if chirality == "R" else -1
        heading, room = math.radians(sign * START), self.pair.ball_radius / 2
        q = self.pair.nested(chirality, heading=heading, clearance=room)
        q[[0, 3]] += sign * self.pair.length / (2 * self.rho)
        return replace(self, q=tuple(q.tolist()))

    # --------------------------------------------------------------------------------- answers

    @cached_property
    def certificate(self) -> Certificate:
        """The certificate of the point, contacts closed within ``1e-6`` ball radii."""
        return certify(self.pair.polyhedron, self.pair.energy, self.q, tolerance=TOUCHING)

    @property
    def mean_heading(self) -> float:
        """The mean of both headings, in rad: in the drum the atlas is a section at it."""
        return (self.q[2] + self.q[5]) / 2

    def reading(self) -> dict[str, Any]:
        """Return all numbers and texts of the page."""
        pair, c = self.pair, self.certificate
        centres = pair.ball_centres(self.q)
        names = pair.polyhedron.names
        closed = c.stratum.active
        return {
            "sliders": self.values,
            "sizes": sizes_of(pair),
            "wall": self._wall.description,
            "box": box_of(pair, centres),
            "centres": centres.ravel().tolist(),
            "contacts": [[n, contact_point(pair, centres, n).tolist()] for n in closed],
            "gaps": dict(
                zip(names, pair.polyhedron.values(np.array(self.q)).tolist(), strict=True)
            ),
            "place": atlas_place(pair, np.array(self.q)).tolist(),
            "words": self.words,
        }

    @property
    def words(self) -> dict[str, str]:
        """Texts beside the pictures."""
        pair, c = self.pair, self.certificate
        outside = c.stratum.local_type is LocalType.OUTSIDE
        headings = [math.degrees(angle) for angle in pair.heading(self.q).tolist()]
        mean = math.degrees(float(pair.canonical([0, 0, self.mean_heading] * 2)[2]))
        return {
            "contacts": ", ".join(c.stratum.active) or "none",
            "stratum": "outside the polyhedron" if outside else stratum_words(c.stratum),
            "chirality": HANDS[c.stratum.chirality],
            "headings": "{:.6f}° and {:.6f}°".format(*headings),
            "energy": f"{c.energy:.6f} {energy_unit(pair)}",
            "multipliers": _multipliers(c, multiplier_unit(pair)),
            "rest": c.verdict.value,
            "section": "" if pair.is_plane else f"A section at mean heading {mean:.1f}°.",
        }

    @property
    def _wall(self) -> WallPatch:
        """The part of the wall that the sliders can reach."""
        pair, room = self.pair, self.pair.length / 2 + self.pair.ball_radius
        along, across = (self.sliders[f"{name}_A"].high + room for name in ("axial", "lateral"))
        if pair.is_plane:
            return WallPatch(math.inf, pair.ball_radius, (-across, across), (-along, along))
        turn = min(across / pair.centre_radius, math.pi)
        return WallPatch(pair.drum_radius, pair.ball_radius, (-turn, turn), (-along, along))

    def fall(self) -> "tuple[Board, dict[str, Any]]":
        """Return the board after a descent, and the descent for the page."""
        pair = self.pair
        # Steps shorter than rods are thick: one cannot pass through another.
        stride = min(STRIDE, pair.rod_radius / (2 * pair.ball_radius))
        found = descent(pair.polyhedron, pair.energy, self.q, stride=stride)
        reached = found.certificate.verdict is not Verdict.INFEASIBLE
        points = found.points if reached else np.array([self.q])
        last = replace(self, q=tuple(points[-1].tolist()))
        shown = [
            replace(self, q=tuple(points[k].tolist())) for k in chosen_frames(len(points), FRAMES)
        ]
        return last, {
            "frames": [board.reading() for board in shown],
            "trail": [piece.tolist() for piece in trail(pair, points)],
            "verdict": found.certificate.verdict.value,
            "way": _summary(found, pair) if reached else "",
            "last": last.reading(),
        }


# ------------------------------------------------------------------------------------- the atlas


def atlas_place(pair: DumbbellPair, q: Array) -> Array:
    """Return relative placements ``(..., 3)`` for drawings, ``delta`` in one period."""
    # Each placement is in the section at its own mean heading.
    heading = None if pair.is_plane else (q[..., 2] + q[..., 5]) / 2
    points = relative_coordinates(pair, q, mean_heading=heading)
    period = math.pi if pair.is_plane else math.tau
    points[..., 2] -= period * np.round(points[..., 2] / period)
    return np.asarray(points * relative_stretch(pair))


def trail(pair: DumbbellPair, points: Array) -> list[Array]:
    """Return a path ``(T, 6)`` in relative placements, cut at the ends of the period."""
    line = atlas_place(pair, points)
    jumps = np.abs(np.diff(line[:, 2])) > pair.length / 2
    return np.split(line, np.flatnonzero(jumps) + 1)


# ---------------------------------------------------------------------------------------- in words


def _multipliers(c: Certificate, unit: str) -> str:
    if c.stratum.local_type is LocalType.OUTSIDE:
        return "none: the dumbbells overlap"
    if not c.stratum.active:
        return "none: no contact is closed"
    listed = ", ".join(f"{name} {value:.6f}" for name, value in c.multipliers.items())
    if c.verdict is Verdict.NOT_STATIONARY:
        return f"{listed} {unit} (least squares: the contacts do not balance the weight)"
    return f"{listed} {unit}"


def _summary(found: Descent, pair: DumbbellPair) -> str:
    energies = np.asarray(pair.energy.value(found.points[[0, -1]]))
    return (
        f"Steepest descent of {found.lengths[-1]:.2f} ball radii: the energy decreases from "
        f"{energies[0]:.6f} to {energies[1]:.6f}."
    )
