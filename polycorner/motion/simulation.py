"""Simulation of a system in time by Moreau-Jean time stepping.

From a state ``(t, q, v)`` and a step ``h``, with everything evaluated at the half step
``q_M = q + h v / 2``, find the velocity after the step and the impulses with ([Moreau], [AB])

.. code-block:: text

    M (v+ - v_free) = sum_i J_i' lam_i + sum_b B_b' p_b,      v_free = v + h M^-1 F
    0 <= lam_i   perp   J_i v+ - bound_i >= 0
    p_b in L_b C_b   and   -(B_b v+ + d_b - c_b) normal to L_b C_b at p_b

======================================  =====================================================
``bound_i = d / 2 - e_i (J_i v          contact ``i`` closes in this step and bounces by
+ d / 2)``                              Newton's law; ``d = J_i (v_free - v)``
``bound_i = -(gap_i + c_i) / h``        otherwise: it may just be reached ([StewartTrinkle]);
                                        what overlaps is pushed out no faster than what forces
                                        and curvature do within a step, ``|J_i (v_free - v)|``
                                        and ``|c_i| / h``
``c_i = gap_i(q_M + h v)``              what curvature adds to a gap where bodies slide or roll
``- gap_i - h J_i v``                   along each other, ``h |J_i v| <= 4 |c_i|``; else 0
``J_j v+ = -(h_j(q_M) + c_j) / h``      an equation ``h_j = 0``, with ``lam_j`` of either sign
``L_b = h N_b(q_M)``                    known normal force
``L_b = lam_i, |lam_j|``                friction on the contact ``i``, on the equation ``j``
``C_b``                                 static set if the contact stuck before, else dynamic
======================================  =====================================================

The forces ``F`` are those at ``q_M``, the middle of the step in time, and the mean velocity
``(v + v+) / 2``: where they depend on the velocity, the step is solved until they do not change.
Then a force that is at right angles to the velocity does no work, and the scheme is symmetric in
time, hence of second order also where the mass matrix is not constant ([HLW] sec. II.3, V.1).

Without ``c`` a bead that circles in a ring would leave it, step by step.  Where velocities change
much within a step it is not the curvature met: where at ``q_M + h v+``, the next half step if
nothing more happens, a gap is short of what was promised, ``min(0, gap_i + h bound_i + c_i)``, by
more than ``BEND``, the step is solved once more with the bound raised by what is missing, a step
of Newton's method for the gap itself.

Where the impulses of an island are not found at once, gaps of closed contacts that are smaller than
:attr:`~polycorner.motion.noise.MotionOptions.touching` are left as they are, ``bound_i = 0``.

Equations are solved for until they hold at ``q_M + h v+``: on the midpoints of steps the scheme is
SHAKE, symmetric and symplectic where forces have a potential and masses are constant ([HLW] sec.
VII.1).  Where a step is shorter than the one before, or the first, ``q_M`` is moved onto the
equations.  Of equations that follow from others, the later ones carry no force.

A limit on velocities ``f(q, v, t) >= 0`` has the row ``J = df/dv`` at ``q_M`` and the mean
velocity, and an impulse ``p >= 0`` with ``p f = 0`` at ``q_M + h v+ / 2``, ``v+`` and the end of
the step; where it falls by a step, this is located, and the velocity projected onto it in the
metric of the masses.  A nonholonomic equation ``f = 0`` holds at ``q_M`` and the mean velocity, so
that it does no work ([MP]).

Friction acts at the mean slip of a step, ``c_b = -(B_b v + d_b)``, or, where slip stops, so that it
vanishes at the end of the step, where the bodies are then; see
:mod:`polycorner.motion.engine.mean_slip`.

Slip that reverses within a step was zero within it, and there it is the static set that decides
whether it starts again: such a step is solved anew with the static set.

By other laws of impact an island in which contacts bounce is solved twice, with ``e_i = 0`` and for
the expansion that follows: :mod:`polycorner.motion.engine.impacts`.

A contact bounces if it approaches and would leave faster than the forces bring it back within
the step, ``e |J v| > |J (v_free - v)|``; what bounces more slowly than that is at rest within
the resolution of the step, and Zeno's infinitely many bounces end there.

Bodies for which such a step is too long, because they meet others on their way, take it in parts
that end at impacts: :mod:`polycorner.motion.engine.refinement`.
"""

import math
import threading
import time
from contextlib import nullcontext
from dataclasses import replace
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from polycorner import __version__
from polycorner.checks import instance, names, real, refuse, whole
from polycorner.errors import SolverError
from polycorner.interrupts import first_interrupt
from polycorner.kinds import checked
from polycorner.motion.bodies import IdenticalBodies, MovingBodies
from polycorner.motion.charts import Chart
from polycorner.motion.drifts import Drift
from polycorner.motion.formulation import mass_and_forces
from polycorner.motion.mechanics import MechanicalSystem, Memory, State
from polycorner.motion.noise import OPTIONS, Noise, Solver
from polycorner.progress import Progress
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT

if TYPE_CHECKING:
    from polycorner.motion.checkpoints import Checkpoint, SavedRun
    from polycorner.motion.engine.driver import Engine
    from polycorner.motion.recorder import Recorder
    from polycorner.motion.sweeping.driver import DriftEngine
    from polycorner.motion.trajectory import Trajectory

FRAMES = 1000  # instants recorded by default
LONGEST = 1e12  # s
MOST_KICKS = 10_000  # random forces of one coordinate in a step
MOST_STEPS = 10**15
SHORTEST_STEP = 1e-50  # s, by which gaps are divided


@checked
def simulate(
    system: MechanicalSystem,
    state: State,
    t_end: float,
    dt: float,
    *,
    every: int | None = None,
    noise: Noise | None = None,
    solver: Solver | None = None,
    progress: Progress | None = None,
    checkpoint: "Checkpoint | None" = None,
) -> "Trajectory":
    """Simulate a system from a state until ``t_end`` by Moreau-Jean time stepping.

    Each step solves the inclusion stated in :mod:`polycorner.motion.simulation` ([Moreau], [AB]);
    of a :class:`~polycorner.Drift` it projects the displacement that is wished ([Moreau77]), and
    ``path.v`` and forces are those admitted at each instant, not means over a step.
    Smooth motion, impacts and the loss of contact are of second order in ``dt``; so are sliding
    whose direction turns, and rolling and sticking on surfaces that curve.  What goes on to stick
    does no work.  The instants at which slip begins or ends are located to first order.  Of first
    order are also the directions of slip in islands of more than 48 unilateral and friction
    contacts, at contacts of sharp hulls, and of slips that depend on the time.

    Parameters
    ----------
    system : System, Drift or another MechanicalSystem, such as a DumbbellDrum
    state : State
        See :meth:`System.state`, :meth:`Drift.state`.
    t_end, dt : float
        End and longest step, in s.  Steps are equal, and the last ends at ``t_end``.
    every : int, optional
        Record every so many steps; default such that about a thousand instants are recorded.
    noise : Noise, optional
        Of a :class:`~polycorner.Drift` the seed alone: its noise is its own.
    solver : Solver, optional
        How exactly steps are solved; default ``system.solver``.
    progress : callable, optional
        Called at every record with the time simulated and the time to simulate, in s.
    checkpoint : Checkpoint, optional
        Where progress is saved.  A run that was interrupted or killed continues from there, on
        the same machine and version bit for bit as if it had never stopped.  The first Ctrl-C
        then ends the run at the next record, and returns what was done, saved and not
        ``finished``; the second one, or one without a checkpoint, interrupts at once.

    Returns
    -------
    Trajectory

    Raises
    ------
    SolverError
        If a force, a mass or a gap is not finite; ``state`` is the state before.
    TypeError, ValueError
        Naming the argument; for ``dt`` with the largest that is stable at the start, for
        ``checkpoint`` with the parameter that differs from the saved run's, or as it is in use.

    Examples
    --------
    >>> from polycorner import Manifold, Polyhedron, System, velocities
    >>> from polycorner.motion import EventKind
    >>> M = Manifold.euclidean("y")
    >>> (y,), (v,) = M.symbols, velocities(M)
    >>> ball = System(Polyhedron(M, {"floor": y}), v**2 / 2, 9.81 * y, restitution=1.0)
    >>> path = simulate(ball, ball.state([1.0]), 2.0, 1e-3)
    >>> len(path.of_kind(EventKind.IMPACT)), round(path.events[0].time, 3)
    (2, 0.452)
    """
    from polycorner.motion.checkpoints import SavedRun

    noise = Noise() if noise is None else instance("noise", noise, Noise)
    solver = system_solver(system) if solver is None else instance("solver", solver, Solver)
    begin = real("state.time", state.time, unit="s")
    end = real("t_end", t_end, least=begin, most=LONGEST, unit="s")
    steps, step = _steps(end - state.time, real("dt", dt, above=0, unit="s"))
    engine, chart = start(system, state, step, noise=noise, solver=solver), _chart(system, noise)
    stride = max(1, steps // FRAMES) if every is None else whole("every", every, least=1)
    recorder, saved = _recorder(engine), None
    if checkpoint is not None:
        told = _parameters(system, state, end, dt, stride, noise, solver)
        told |= {"steps before": engine.before} if engine.before else {}
        saved = SavedRun(checkpoint, told, steps, stride)
    with nullcontext() if saved is None else saved.alone():
        if saved is None or not saved.begin(recorder):
            recorder.instant()
        try:
            rate = _follow(recorder, steps, stride, saved, progress)
        except SolverError as error:
            error.state = _present(engine, state, chart)
            raise
    arrays = {name: array.copy() for name, array in engine.save().items()}
    memory = Memory(system, engine.start, engine.time, engine.dt, arrays)
    last = replace(_present(engine, state, chart), memory=memory)
    run = {"noise": noise, "solver": solver, "every": stride, "t_end": end, "last": last}
    path = recorder.trajectory(system, **run, steps_per_second=rate)
    if chart is None:
        return path
    q, v = chart.outward(path.q, path.v, state.q.size)
    return replace(path, q=q, v=v)


def _chart(system: MechanicalSystem, noise: Noise | None) -> Chart | None:
    """Return the coordinates in which a motion is computed, if they are not those of the system.

    Random forces are those on coordinates of the system.
    """
    return None if noise is not None and noise.kicks else system.chart


def _recorder(engine: Any) -> "Recorder":
    """Return what records an engine."""
    from polycorner.motion.drift_recorder import DriftRecorder
    from polycorner.motion.recorder import Recorder
    from polycorner.motion.sweeping.driver import DriftEngine

    drifts = isinstance(engine, DriftEngine)
    return DriftRecorder(cast("Any", engine)) if drifts else Recorder(engine)


def _steps(duration: float, dt: float) -> tuple[int, float]:
    """Return the number of equal steps of at most ``dt`` that end at the end, and their length."""
    if duration > MOST_STEPS * dt:
        refuse("dt", f"at least {duration / MOST_STEPS:.3g} s, for t_end to be reached", dt)
    steps = round(duration / dt)
    if abs(steps * dt - duration) <= 10 * DEFAULT.rounding * duration:
        return steps, dt
    steps = math.ceil(duration / dt)
    return steps, duration / steps


def _follow(
    recorder: "Recorder",
    steps: int,
    stride: int,
    saved: "SavedRun | None",
    progress: Progress | None,
) -> float:
    """Advance to the end or to Ctrl-C and return the steps in a second of real time."""
    if saved is None:
        return _advance(recorder, steps, stride, None, progress, threading.Event())
    asked = threading.Event()
    with first_interrupt(asked.set):
        rate = _advance(recorder, steps, stride, saved, progress, asked)
        if recorder.engine.steps or not steps:  # before the first step there is nothing to save
            saved.save(recorder, finished=recorder.engine.steps >= steps)
    return rate


def _advance(
    recorder: "Recorder",
    steps: int,
    stride: int,
    saved: "SavedRun | None",
    progress: Progress | None,
    asked: threading.Event,
) -> float:
    engine = recorder.engine
    counted, spent, first, last_save = 0, 0.0, True, time.monotonic()
    while engine.steps < steps and not asked.is_set():
        before, clock = engine.steps, time.perf_counter()
        if not before and not engine.before:
            recorder.begin()
        recorder.advance(min(stride, steps - before) - (engine.steps - before))
        if not first:
            counted += engine.steps - before
            spent += time.perf_counter() - clock
        first = False
        recorder.instant()
        if saved is not None and time.monotonic() - last_save >= saved.checkpoint.seconds:
            saved.save(recorder, finished=False)
            last_save = time.monotonic()
        if progress is not None:
            progress(engine.steps * engine.dt, steps * engine.dt, "s simulated")
    return counted / spent if spent > 0 else math.nan


def _parameters(
    system: MechanicalSystem,
    state: State,
    t_end: float,
    dt: float,
    every: int,
    noise: Noise,
    solver: Solver,
) -> dict[str, Any]:
    """Return everything that a run depends on, by name."""
    from polycorner.motion.checkpoints import fingerprint

    return {
        "polycorner": __version__,
        **system.described(),
        "t_end": t_end,
        "dt": float(dt),
        "every": every,
        "noise.chatter": float(noise.chatter),
        "noise.correlation_time": float(noise.correlation_time),
        "noise.kicks": {name: float(size) for name, size in sorted(noise.kicks.items())},
        **({"noise.kick_time": float(noise.kick_time)} if noise.kick_time else {}),
        **{f"noise.scatter {kind}": float(s) for kind, s in sorted(noise.scatter.items()) if s},
        "noise.seed": int(noise.seed),
        "solver.tolerance": float(solver.tolerance),
        "solver.sweeps": int(solver.sweeps),
        "solver.refine": solver.refine,
        **({"solver.crowd_sweeps": int(solver.crowd_sweeps)} if solver.crowd_sweeps else {}),
        **{
            f"solver.options.{name}": float(value)
            for name, value in vars(solver.options).items()
            if value != getattr(OPTIONS, name)
        },
        "state.time": float(state.time),
        **{f"state.{a}": fingerprint(getattr(state, a)) for a in ("q", "v", "sticking")},
    }


def system_solver(system: object) -> Solver:
    """Return the default solver of what has to be a mechanical system."""
    # mypy refuses an abstract class where `isinstance` takes one.
    return instance("system", system, MechanicalSystem).solver  # type: ignore[type-abstract]


def start(
    system: MechanicalSystem,
    state: State,
    dt: float,
    *,
    noise: Noise | None = None,
    solver: Solver | None = None,
) -> "Engine":
    """Return the engine of a system at a state, after checking both."""
    from polycorner.motion.engine.driver import Engine

    solver = system_solver(system) if solver is None else instance("solver", solver, Solver)
    bodies = system.bodies
    size = sum(kind.count * kind.dimension for kind in bodies.kinds)
    if state.q.size != size:
        each = " and ".join(f"{a.count} bodies of {a.dimension} coordinates" for a in bodies.kinds)
        refuse("state", f"one of {each}", state.q.shape)
    if state.sticking.size != bodies.frictions:
        each = " and ".join(str(len(kind.body.friction)) for kind in bodies.kinds)
        refuse("state", f"one of {each} friction contacts a body", state.sticking.shape)
    real("dt", dt, least=SHORTEST_STEP, unit="s")
    placed = bodies.padded(state.q), bodies.padded(state.v)
    bodies.check_places(*placed, dt)
    if not isinstance(system, Drift):
        _check_mass(bodies, *placed)
    chart = _chart(system, noise)
    memory = state.memory if _goes_on(system, chart, state, dt) else None
    if memory is None:  # what goes on was let in; bodies that have left stand where others may be
        system.check_placement(state.q)
        largest, why = system.largest_step(state)
        if dt > largest:
            msg = f"dt: expected at most {largest:.3g} s, {why}; got {dt}"
            raise ValueError(msg)
    noise = Noise() if noise is None else instance("noise", noise, Noise)
    if isinstance(system, Drift):
        # It is used as the engine of other systems is.
        return cast("Engine", _start_drift(system, placed[0], state, dt, noise, solver, memory))
    every = [name for kind in bodies.kinds for name in kind.body.formulation.coordinates]
    names("kicks", noise.kicks, list(dict.fromkeys(every)))
    known = {c.cause for kind in bodies.kinds for c in kind.body.friction if c.gap < 0}
    names("scatter", noise.scatter, sorted(known))
    if noise.kicks and noise.kick_time:
        real("kick_time", noise.kick_time, least=dt / MOST_KICKS, unit="s")
    if chart is not None:
        bodies = chart.system.bodies
        placed = tuple(map(bodies.padded, chart.inward(state.q, state.v)))
    if isinstance(bodies, IdenticalBodies) and bodies.body.formulation.is_paced:
        law = bodies.body.formulation
        paced = replace(bodies.body, parameters=law.at(bodies.body.parameters, step=dt))
        bodies = replace(bodies, body=paced)
    begun = state.time if memory is None else memory.start
    engine = Engine(bodies, *placed, state.sticking, dt, start=begun, noise=noise, solver=solver)
    if memory is not None:
        engine.resume(memory.arrays)
    return engine


def _start_drift(
    drift: Drift,
    q: Array,
    state: State,
    dt: float,
    noise: Noise,
    solver: Solver,
    memory: Memory | None,
) -> "DriftEngine":
    """Return the engine of first-order motion."""
    from polycorner.motion.sweeping.driver import DriftEngine

    if noise.chatter or noise.kicks or noise.scatter:
        expected = "a seed alone for a Drift, whose noise is its own"
        refuse("noise", expected, noise, TypeError)
    if solver.crowd_sweeps or solver.threads != 1 or not solver.refine:
        refuse("solver", "tolerance, sweeps and options alone for a Drift", solver)
    begun = state.time if memory is None else memory.start
    engine = DriftEngine(drift, q, dt, start=begun, noise=noise, solver=solver)
    if memory is not None:
        engine.resume(memory.arrays)
    return engine


def _goes_on(system: MechanicalSystem, chart: Chart | None, state: State, dt: float) -> bool:
    """Whether a state is the last of a run of the same system with the same step, unchanged."""
    memory = state.memory
    if memory is None or memory.system is not system or memory.dt != dt:
        return False
    known, bodies = memory.arrays, system.bodies
    given = np.ravel(state.q), np.ravel(state.v), np.ravel(state.sticking)
    kept = *_told(bodies, chart, known["q"], known["v"]), known["sticks"]
    return state.time == memory.end and all(map(np.array_equal, given, map(np.ravel, kept)))


def _told(bodies: MovingBodies, chart: Chart | None, q: Array, v: Array) -> tuple[Array, Array]:
    """Return coordinates and velocities of a system from those in an engine."""
    q, v = bodies.unpadded(q), bodies.unpadded(v)
    return (q, v) if chart is None else chart.outward(q, v, q.size)


def _check_mass(bodies: MovingBodies, q: Array, v: Array) -> None:
    for i, a in enumerate(bodies.kind_of):
        body, k = bodies.kinds[a].body, bodies.kinds[a].dimension
        mass, _ = mass_and_forces(body.formulation, body.parameters, q[i, :k], v[i, :k])
        least = np.linalg.eigvalsh(mass)[0] if np.isfinite(mass).all() else np.nan
        if not (least > 0 and _is_regular(mass)):
            msg = (
                "kinetic: expected a positive definite mass matrix; got one with the eigenvalue "
                f"{least:.6g} at q = {q[i, :k].tolist()}"
            )
            raise ValueError(msg)


def _is_regular(mass: Array) -> bool:
    """Whether a positive matrix is more than rounding from a singular one, in any units."""
    sizes = np.sqrt(np.diagonal(mass))
    return bool(np.linalg.eigvalsh(mass / np.outer(sizes, sizes))[0] > DEFAULT.rounding)


@checked
def step(system: MechanicalSystem, state: State, dt: float) -> State:
    """Return the state one step later.

    The same step as in :func:`simulate`, which is much faster for many of them.

    Raises
    ------
    SolverError
        If the step cannot be solved; the message has the residual.
    """
    engine = start(system, state, dt)
    engine.advance(1)
    effort = engine.effort
    if effort.unconverged:
        msg = f"the step was not solved: its residual is {effort.residual:.3g} of the speeds in it"
        raise SolverError(msg)
    return _present(engine, state, _chart(system, None))


def _present(engine: "Engine", like: State, chart: Chart | None) -> State:
    """Return the present state, in the shape of another."""
    motion = engine.motion
    q, v = _told(engine.bodies, chart, motion.q, motion.v)
    return State(
        engine.time,
        q.reshape(like.q.shape),
        v.reshape(like.v.shape),
        (motion.sticks != 0).reshape(like.sticking.shape),
    )
