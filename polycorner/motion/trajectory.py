"""Trajectories: recorded states, contacts, events, and the balance of energy."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from itertools import starmap, zip_longest
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from polycorner import checks
from polycorner.checks import refuse
from polycorner.kinds import checked
from polycorner.motion.engine.driver import Effort
from polycorner.motion.events import Event, EventKind
from polycorner.motion.mechanics import MechanicalSystem, State
from polycorner.motion.noise import Noise, Solver
from polycorner.motion.placements import onto_equations
from polycorner.motion.scenes import ContactForce, ContactForces, FrictionTable
from polycorner.motion.splits import Split
from polycorner.motion.system import System
from polycorner.printing import Printed, Sheet, Table, facts, listed, names, number, titled
from polycorner.spaces.manifold import Array
from polycorner.values import Checked

if TYPE_CHECKING:
    import xarray as xr

    from polycorner.polyhedra.strata import Stratum

ROLLING = "rolling"  # the kind of friction that is a torque
MOST_COLUMNS = 9  # of coordinates beside each other
ANGLES = "Angles are in radians, times in s, all else in the units of the system."
Touch = tuple[tuple[int, ...], str, float]


@dataclass(frozen=True, eq=False)
class MotionOfKind(Checked):
    """The motion of the bodies of one kind among several.

    Attributes
    ----------
    times : (T,) array
    q, v : (T, n, k) array
        Coordinates, not wrapped, and velocities.
    rests, present : (T, n) array of bool
        Which bodies are at rest on their substrate, and which have not left.
    """

    times: Array
    q: Array
    v: Array
    rests: NDArray[np.bool_]
    present: NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Trajectory(Checked, Printed):
    """A motion, recorded at ``T`` instants and at every event between them.

    Attributes
    ----------
    system : MechanicalSystem
        The system: ``N`` bodies of ``k`` coordinates.
    dt : float
        The step, in s.
    times : (T,) array
    q, v : (T, N, k) array
        Coordinates, not wrapped, and velocities; of an :class:`~polycorner.motion.Assembly` all of
        them, ``(T, D)``: ``trajectory["large"]`` has those of one kind, ``(T, n, k)``.
    rests, present : (T, N) array of bool
        Which bodies are at rest on their substrate, and which have not left.
    touching : sequence of T tuples
        Contacts that touch at each instant, and all equations: bodies, name, and the force, along
        the gradient of the gap or equation: its mean over the step before the instant, and at the
        start over the first step.  Limits on velocities that act, and nonholonomic equations: the
        force is along the gradient by the velocities.
    friction : FrictionTable
        The forces of friction at these contacts; :meth:`contacts` lists them.
    kinetic, potential : (T,) array
        Energies of the bodies that are present.
    dissipated : mapping from str to (T,) array
        Energy lost until each instant, by cause: ``impact`` and the kinds of friction.
    work : mapping from str to (T,) array
        Work done until each instant by the moving ``substrate``, by ``applied`` forces and by
        ``noise``, by the ``drive`` of equations with the time, by each limit on velocities and each
        nonholonomic equation, by its name, by the ``attraction`` of bodies, and what ``left`` with
        bodies that left (negative).  Of a :class:`~polycorner.Drift` by the wished ``velocity`` and
        by ``noise``; all of it is dissipated by ``drag``.
    events : sequence of Event
        In time.  They are held as arrays; each becomes an object when it is asked for.
    max_penetration : float
        The deepest overlap met, in units of the gaps.
    effort : Effort
    noise : Noise
    solver : Solver or None
        None if it is not known.
    every : int
        Steps between records.
    t_end : float or None
        The end that was asked for; None if it is not known.
    steps_per_second : float
        Steps in a second of real time, the first record left out, which includes loading the
        compiled engine; nan if there is no other.
    last : State or None
        The last state.  ``simulate(path.system, path.last, t_end, dt)`` goes on bit for bit as one
        run would have, with accounts of work from zero.  Files do not have it.
    splits : sequence of Split
        Of a :class:`~polycorner.Drift` the concave corners that were met, with the states from
        which the motion goes on beyond.  Files do not have them.
    """

    system: MechanicalSystem
    dt: float
    times: Array
    q: Array
    v: Array
    rests: NDArray[np.bool_]
    present: NDArray[np.bool_]
    touching: Sequence[tuple[Touch, ...]]
    kinetic: Array
    potential: Array
    dissipated: Mapping[str, Array]
    work: Mapping[str, Array]
    events: Sequence[Event]
    max_penetration: float
    effort: Effort
    noise: Noise = field(default_factory=Noise)
    solver: Solver | None = None
    every: int = 1
    t_end: float | None = None
    steps_per_second: float = math.nan
    friction: FrictionTable = field(default_factory=FrictionTable)
    last: State | None = None
    splits: Sequence[Split] = ()

    def __len__(self) -> int:
        """Return the number of recorded instants."""
        return len(self.times)

    def __repr__(self) -> str:
        """Return what was recorded, in one line."""
        count = len(self.bodies)
        bodies = f"{count} {'body' if count == 1 else 'bodies'}"
        span = f"{self.times[0]:g} to {self.times[-1]:g} s in {len(self)} instants"
        return f"Trajectory({bodies}; {span}; {len(self.events)} events)"

    def __getitem__(self, kind: str) -> MotionOfKind:
        """Return the motion of the bodies of one kind, by its name."""
        bodies = self.system.bodies
        checks.names("kind", [kind], bodies.labels)
        start, end = bodies.starts[bodies.labels.index(kind) :][:2]
        q, v = (self._of(values, kind) for values in (self.q, self.v))
        return MotionOfKind(self.times, q, v, self.rests[:, start:end], self.present[:, start:end])

    def _of(self, values: Array, kind: str) -> Array:
        return self.system.bodies.split(values)[self.system.bodies.labels.index(kind)]

    @property
    def bodies(self) -> tuple[str, ...]:
        """What the bodies are called, in the order of their numbers."""
        bodies = self.system.bodies
        return bodies.names or tuple(f"body {i}" for i in range(bodies.total))

    def _sheet(self) -> Sheet:
        tables = (_energies(self), _events(self), _contacts(self), *_last(self))
        return Sheet("Trajectory", (facts(_summary(self)), *tables, ANGLES))

    @property
    def finished(self) -> bool:
        """Whether the end that was asked for was reached."""
        if self.t_end is None:
            return True
        return self.effort.steps >= round((self.t_end - float(self.times[0])) / self.dt)

    @property
    def converged(self) -> bool:
        """Whether every step was solved to the tolerance."""
        return self.effort.unconverged == 0

    @property
    def missed(self) -> float:
        """Share of the islands that were not solved to the tolerance."""
        return self.effort.unconverged / max(1, self.effort.islands)

    @property
    def solver_error(self) -> float:
        """Bound on the displacements that unsolved islands caused, in scaled lengths.

        The residual of an island is relative to the speeds in it, so an island that is not solved
        misplaces its bodies by at most residual times speed times step.  This is the sum over all
        of them with the worst residual and the highest recorded speed.  It does not include what
        an unstable motion makes of a small displacement later.
        """
        bodies = self.system.bodies
        units = np.concatenate([np.tile(kind.body.units, kind.count) for kind in bodies.kinds])
        speeds = np.abs(self.v.reshape(len(self), -1)) * units
        fastest = float(speeds.max(initial=0.0))
        return self.effort.unconverged * self.effort.residual * fastest * self.dt

    @property
    def convergence(self) -> str:
        """How many islands missed the solver's tolerance, by how much, and what follows."""
        effort = self.effort
        if self.converged:
            return f"all islands solved; worst residual {effort.residual:.1e}"
        limit = "" if self.solver is None else f" {self.solver.tolerance:g}"
        share = number(100 * self.missed, 2)
        return (
            f"{effort.unconverged} of {effort.islands} islands ({share} %) missed the "
            f"tolerance{limit}, at worst with a residual of {effort.residual:.1e} of their "
            f"speeds; together they displace bodies by at most {number(self.solver_error, 2)}"
        )

    @property
    def energy_audit(self) -> Array:
        """Energy that is not accounted for, ``(T,)``: gained minus worked plus dissipated.

        Impulses and velocities balance exactly; what is left is what the scheme does to a
        potential that is not linear within a step, of second order in the step, and rounding.
        """
        total = self.kinetic + self.potential
        worked = sum(self.work.values(), np.zeros(len(self)))
        lost = sum(self.dissipated.values(), np.zeros(len(self)))
        return np.asarray(total - total[0] - worked + lost)

    @property
    def audit(self) -> float:
        """The largest entry of :attr:`energy_audit`, relative to the energy that was moved."""
        moved = sum((np.abs(w) for w in self.work.values()), np.zeros(len(self)))
        moved = moved + sum(self.dissipated.values(), np.zeros(len(self)))
        size = float(np.abs(self.kinetic + self.potential).max())
        scale = max(float(moved.max()), float(np.ptp(self.potential)), float(self.kinetic.max()))
        scale = max(scale, 1e-12 * size)
        worst = float(np.abs(self.energy_audit).max())
        return worst / scale if scale > 0 else worst

    @checked
    def of_kind(self, kind: EventKind) -> list[Event]:
        """Return the events of one kind, in time."""
        return [event for event in self.events if event.kind == kind]

    @checked
    def to_xarray(self, *, units: Mapping[str, str] | None = None) -> "xr.Dataset":
        """Return the motion as an xarray dataset, the content of ``save_trajectory``.

        ``q`` and ``v`` over ``time``, ``body`` and ``coordinate``, ``gaps`` over ``time``, ``body``
        and ``gap``, energies, contacts, events, dissipation and work by cause, with units.

        Parameters
        ----------
        units : mapping from str to str, optional
            Units of ``time`` (default s), ``energy``, ``force``, ``impulse`` and ``gap`` (default
            that of the contacts' functions); those of coordinates are the manifold's.

        Raises
        ------
        TypeError, ValueError
            For the motion of no :class:`~polycorner.System`, or units of other things.

        Examples
        --------
        >>> from polycorner import Manifold, Polyhedron, System, simulate, velocities
        >>> M = Manifold.euclidean("x y")
        >>> x, y = M.symbols
        >>> vx, vy = velocities(M)
        >>> ball = System(Polyhedron(M, {"floor": y}), (vx**2 + vy**2) / 2, 10 * y)
        >>> data = simulate(ball, ball.state([0.0, 1.0]), 0.1, 0.01).to_xarray()
        >>> round(float(data.q.sel(coordinate="y", time=0.1).item()), 3)
        0.95
        """
        # The one way up: people look for the method here, and the dataset is that of files.
        # By name: files know of trajectories.
        files = import_module("polycorner.files.trajectories")
        found: xr.Dataset = files.trajectory_dataset(self, units=units)
        return found

    @checked
    def stratum(self, index: int, *, tolerance: float = 1e-6) -> "Stratum":
        """Return the face of the polyhedron at a recorded instant, moved onto the equations.

        Only for a :class:`~polycorner.motion.system.System` of one body.
        """
        from polycorner.polyhedra.strata import stratum_at

        if not isinstance(self.system, System) or self.rests.shape[1] != 1:
            msg = f"stratum: expected the trajectory of a System of one body; got {self!r}"
            raise TypeError(msg)
        place = onto_equations(self.system.polyhedron, self.q[index, 0])
        return stratum_at(self.system.polyhedron, place, tolerance=tolerance)

    @checked
    def contacts(self, when: float) -> list[ContactForce]:
        """Return what touches at a recorded instant, with normal forces and friction.

        Forces are means over the step before the instant, and at the start over the first step: a
        contact that closes with an impact there has a large one.

        Parameters
        ----------
        when : int or float
            The number of the instant, or a time in s: then the last instant that is not after it.

        Examples
        --------
        A block on a slope is held by friction:

        >>> from polycorner import simulate
        >>> from polycorner.bodies import Arrangement, HalfSpace, polygon
        >>> block = polygon([[-1, -1], [1, -1], [1, 1], [-1, 1]])
        >>> a = Arrangement({"block": block}, {"slope": HalfSpace([0, 1], [0, 0])})
        >>> system = a.system(gravity=[2.0, -10.0], friction=0.5)
        >>> path = simulate(system, system.state(a.point({"block": [0, 1]})), 0.1, 1e-2)
        >>> for row in path.contacts(-1):
        ...     print(row.contact, row.between, round(row.normal, 6), row.point.round(3))
        block.v1-slope ('block', 'slope') 16.0 [-1.  0.]
        block.v2-slope ('block', 'slope') 24.0 [1. 0.]
        >>> sum(row.force for row in path.contacts(-1)).round(6).tolist()
        [-8.0, 40.0]
        """
        index = self._instant("when", when) if isinstance(when, float) else int(when)
        index = range(len(self))[index]
        rubbed = self.friction.at(index, self.system.bodies.rubbing)
        normal = {(bodies, name): force for bodies, name, force in self.touching[index]}
        return [
            _contact(self, index, *touch, normal.get(touch, math.nan), rubbed.get(touch, {}))
            for touch in dict.fromkeys([*normal, *rubbed])
        ]

    @checked
    def at(self, time: float) -> int:
        """Return the index of the last recorded instant that is not after ``time``."""
        return self._instant("time", time)

    def _instant(self, argument: str, time: float) -> int:
        first, last = self.times[[0, -1]].tolist()
        if not first <= time <= last:
            refuse(argument, f"a time from {first:g} to {last:g}", float(time))
        return int(np.searchsorted(self.times, time, side="right")) - 1


def contact_forces(path: Trajectory, when: float) -> ContactForces:
    """Return the forces at an instant between bodies in space, as arrays for drawing.

    Parameters
    ----------
    path : Trajectory
        Of the system of an arrangement; contacts of other systems have no places, and are left out.
    when : int or float
        As for :meth:`Trajectory.contacts`.
    """
    checks.instance("path", path, Trajectory)
    rows = [row for row in path.contacts(when) if row.point is not None]
    d = len(rows[0].point) if rows and rows[0].point is not None else 0
    points, directions, forces = (
        np.array([getattr(row, name) for row in rows]).reshape(len(rows), d)
        for name in ("point", "direction", "force")
    )
    torques = np.array([row.torque for row in rows], dtype=np.float64)
    between = tuple((row.between[0], row.between[1]) for row in rows)
    names = tuple(row.contact for row in rows)
    return ContactForces(points, directions, forces, torques, between, names)


def _contact(
    path: Trajectory,
    index: int,
    bodies: tuple[int, ...],
    contact: str,
    normal: float,
    friction: Mapping[str, tuple[float, ...]],
) -> ContactForce:
    scene = path.system.scene
    between = () if scene is None else scene.parties(bodies, contact)
    q = path.system.bodies.padded(path.q[index])
    site = None if scene is None else scene.site(bodies, contact, q)
    if site is None:
        return ContactForce(bodies, contact, between, normal, friction)
    slides = [np.array(p) for kind, p in friction.items() if kind != ROLLING]
    force = normal * site.normal + sum(slides, np.zeros(len(site.tangents))) @ site.tangents
    rolls = site.arm * np.array(friction.get(ROLLING, (0.0,) * len(site.tangents)))
    torque = rolls[0] if len(rolls) == 1 else rolls @ site.tangents
    told = site.point, site.normal, force, np.array(torque)
    return ContactForce(bodies, contact, (site.one, site.two), normal, friction, *told)


def _summary(path: Trajectory) -> Iterator[tuple[str, str]]:
    effort, bodies, told = path.effort, path.system.bodies, []
    for label, kind in zip_longest(bodies.labels, bodies.kinds):
        size, each = kind.dimension, " each" if kind.count > 1 else ""
        many = f"{kind.count} {label}" if label else f"{len(path.bodies)}"
        told.append(f"{many}, with {size} coordinate{'s' if size > 1 else ''}{each}")
    known = f": {names(bodies.names)}" if bodies.total == 1 < len(bodies.names) else ""
    yield "bodies", "; ".join(told) + known
    unfinished = "" if path.finished else f"; unfinished, {path.t_end:g} s were asked for"
    instants = f"in {len(path)} instants{unfinished}"
    yield "time", f"{path.times[0]:g} s to {path.times[-1]:g} s, {instants}"
    yield "step", f"{path.dt:g} s"
    yield "steps", str(effort.steps)
    yield "solver", path.convergence
    yield "deepest overlap", f"{number(path.max_penetration, 3)} (unit of the gaps)"
    yield "energy audit", f"{number(path.audit, 3)} of the energy that was moved"
    present = path.present[-1]
    at_rest = int((path.rests[-1] & present).sum())
    if bodies.total == 1 < len(path.bodies):  # in one dense system they rest or leave together
        at_end = f"all {len(path.bodies)} at rest" if at_rest else "not at rest"
        yield "at the end", at_end if present[0] else "none present"
    else:
        yield "at the end", f"{int(present.sum())} present, {at_rest} of them at rest"


def _energies(path: Trajectory) -> Table:
    rows = [("kinetic", *_ends(path.kinetic)), ("potential", *_ends(path.potential))]
    rows += [(f"dissipated by {cause}", *_ends(lost)) for cause, lost in path.dissipated.items()]
    rows += [(f"work of {cause}", *_ends(done)) for cause, done in path.work.items()]
    return Table(("energy", "at first", "at last"), tuple(rows), (1, 2))


def _ends(values: Array) -> tuple[str, str]:
    return number(values[0], 6), number(values[-1], 6)


def _events(path: Trajectory) -> Table:
    counts = [(kind.sentence, len(path.of_kind(kind))) for kind in EventKind]
    rows = tuple((words, str(count)) for words, count in counts if count)
    return Table(("event", "times"), rows, (1,))


def _contacts(path: Trajectory) -> Table:
    """Return what touches at last."""
    touching, scene = path.touching[-1], path.system.scene
    rubbed = path.friction.at(len(path) - 1, path.system.bodies.rubbing)

    def row(bodies: tuple[int, ...], contact: str, force: float) -> tuple[str, ...]:
        parties = () if scene is None else scene.parties(bodies, contact)
        between = " and ".join(parties or map(path.system.bodies.called, bodies))
        friction = "; ".join(
            f"{kind} {', '.join(number(x, 4) for x in components)}"
            for kind, components in rubbed.get((bodies, contact), {}).items()
        )
        return contact, between, number(force, 6), friction

    head = ("contact", "between", "normal force", "friction")
    return listed("Contacts at last", head, starmap(row, touching), len(touching), (2,))


def _last(path: Trajectory) -> Iterator[Table]:
    bodies = path.system.bodies
    for label, kind, q in zip_longest(bodies.labels, bodies.kinds, bodies.split(path.q[-1])):
        titles = list(kind.body.formulation.coordinates)
        if isinstance(path.system, System):
            titles = list(map(titled, titles, path.system.manifold.periods))
        if not label and kind.count == 1 and len(titles) > MOST_COLUMNS:
            values = ((title, number(x, 6)) for title, x in zip(titles, q[0], strict=True))
            yield listed("Placement at last", ("coordinate", "value"), values, len(titles), (1,))
            continue
        first = 1 if label else 0
        called = kind.names if len(kind.names) == kind.count else ()
        rows = (
            (called[i] if called else str(i + first), *(number(x, 6) for x in at))
            for i, at in enumerate(q)
        )
        columns = tuple(range(len(titles) + 1))
        yield listed("Placement at last", (label or "body", *titles), rows, kind.count, columns)
