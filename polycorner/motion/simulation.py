"""Simulation of a system in time by Moreau-Jean time stepping.

From a state ``(t, q, v)`` and a step ``h``, with everything evaluated at the half step
``q_M = q + h v / 2``, find the velocity after the step and the impulses with ([Moreau], [AB])

.. code-block:: text

    M (v+ - v_free) = sum_i J_i' lam_i + sum_b B_b' p_b,      v_free = v + h M^-1 F
    0 <= lam_i   perp   J_i v+ - bound_i >= 0
    p_b in L_b C_b   and   -(B_b v+ + d_b) normal to L_b C_b at p_b

======================================  =====================================================
``bound_i = -e_i J_i v``                contact ``i`` closes in this step and bounces
``bound_i = -(gap_i + c_i) / h``        otherwise: it may just be reached ([StewartTrinkle]);
                                        what overlaps is pushed out no faster than what forces
                                        and curvature do within a step, ``|J_i (v_free - v)|``
                                        and ``|c_i| / h``
``c_i = gap_i(q_M + h v)``              what curvature adds to a gap where bodies slide or roll
``- gap_i - h J_i v``                   along each other, ``h |J_i v| <= 4 |c_i|``; else 0
``L_b = h N_b(q_M)``                    known normal force
``L_b = lam_i``                         friction on the unilateral contact ``i``
``C_b``                                 static set if the contact stuck before, else dynamic
======================================  =====================================================

Without ``c`` a bead that circles in a ring would leave it, step by step.  Where velocities change
much within a step it is not the curvature met: where at ``q_M + h v+``, the next half step if
nothing more happens, a gap is short of what was promised, ``min(0, gap_i + h bound_i + c_i)``, by
more than ``BEND``, the step is solved once more with the bound raised by what is missing, a step
of Newton's method for the gap itself.

Slip that reverses within a step was zero within it, and there it is the static set that decides
whether it starts again: such a step is solved anew with the static set.

A contact bounces if it approaches and would leave faster than the forces bring it back within
the step, ``e |J v| > |J (v_free - v)|``; what bounces more slowly than that is at rest within
the resolution of the step, and Zeno's infinitely many bounces end there.
"""

import math
from collections.abc import Callable
from numbers import Real
from typing import TYPE_CHECKING

import numpy as np

from polycorner.errors import SolverError
from polycorner.motion.formulation import moment
from polycorner.motion.noise import Noise, Solver
from polycorner.motion.system import State, System, bodies_of

if TYPE_CHECKING:
    from polycorner.motion.engine.driver import Engine
    from polycorner.motion.recorder import Recorder
    from polycorner.motion.trajectory import Trajectory

FRAMES = 1000  # instants recorded by default
LONGEST = 1e12  # s


def simulate(
    system: System,
    state: State,
    t_end: float,
    dt: float,
    *,
    every: int | None = None,
    noise: Noise | None = None,
    solver: Solver | None = None,
    progress: Callable[[float], None] | None = None,
) -> "Trajectory":
    """Follow a system from a state until ``t_end`` by Moreau-Jean time stepping.

    Each step solves the inclusion stated in :mod:`polycorner.motion.simulation` ([Moreau], [AB]).
    Smooth motion is of second order in ``dt``; impacts and the onset of slip are located to
    first order.

    Parameters
    ----------
    system : System
    state : State
        See :meth:`System.state`.
    t_end, dt : float
        End and step, in s.
    every : int, optional
        Record every so many steps; default such that about a thousand instants are recorded.
    noise : Noise, optional
    solver : Solver, optional
        How exactly steps are solved.
    progress : callable, optional
        Called with the time now and then.

    Returns
    -------
    Trajectory

    Raises
    ------
    TypeError, ValueError
        Naming the argument; for ``dt`` with the largest that is stable at the start.

    Examples
    --------
    >>> from polycorner import Manifold, Polyhedron
    >>> from polycorner.motion.events import EventKind
    >>> from polycorner.motion.system import velocities
    >>> M = Manifold.euclidean("y")
    >>> (y,), (v,) = M.symbols, velocities(M)
    >>> ball = System(Polyhedron(M, {"floor": y}), v**2 / 2, 9.81 * y, restitution=1.0)
    >>> path = simulate(ball, ball.state([1.0]), 2.0, 1e-3)
    >>> len(path.of_kind(EventKind.IMPACT)), round(path.events[0].time, 3)
    (2, 0.452)
    """
    engine = start(system, state, dt, noise=noise, solver=solver)
    if not isinstance(t_end, Real) or not state.time <= float(t_end) < math.inf:
        msg = f"t_end: expected a time not before that of the state, {state.time:g}; got {t_end!r}"
        raise ValueError(msg)
    steps = round((float(t_end) - state.time) / dt)
    return run(engine, steps, whole_stride(every, steps), progress).trajectory(system)


def whole_steps(duration: float, dt: float) -> int:
    """Return how many steps of ``dt`` a time takes, refusing what is no time in s."""
    if isinstance(duration, bool) or not isinstance(duration, Real) or not 0 <= duration < LONGEST:
        msg = f"duration: expected a time in s; got {duration!r}"
        raise ValueError(msg)
    return round(float(duration) / dt)


def whole_stride(every: int | None, steps: int) -> int:
    """Return how many steps to do between records."""
    if every is None:
        return max(1, steps // FRAMES)
    if isinstance(every, bool) or not isinstance(every, int) or every < 1:
        msg = f"every: expected a positive whole number of steps; got {every!r}"
        raise ValueError(msg)
    return every


def run(
    engine: "Engine", steps: int, stride: int, progress: Callable[[float], None] | None = None
) -> "Recorder":
    """Advance an engine until it has done so many steps; record every ``stride`` of them."""
    from polycorner.motion.recorder import Recorder

    recorder = Recorder(engine)
    recorder.instant()
    while engine.steps < steps:
        recorder.advance(min(stride, steps - engine.steps))
        recorder.instant()
        if progress is not None:
            progress(engine.time)
    return recorder


def start(
    system: System,
    state: State,
    dt: float,
    *,
    noise: Noise | None = None,
    solver: Solver | None = None,
) -> "Engine":
    """Return the engine of a system at a state, after checking both."""
    from polycorner.motion.engine.driver import Engine

    if not isinstance(system, System):
        msg = f"system: expected a System; got {type(system).__name__}"
        raise TypeError(msg)
    if not isinstance(state, State):
        msg = f"state: expected a State, as system.state(q, v) makes; got {type(state).__name__}"
        raise TypeError(msg)
    system.check_placement(state.q)
    check_step(dt, largest_step(system, state))
    noise = noise or Noise()
    unknown = sorted(set(noise.kicks) - set(system.manifold.names))
    if unknown:
        msg = f"kicks: expected coordinates {', '.join(system.manifold.names)}; got {unknown}"
        raise ValueError(msg)
    return Engine(
        bodies_of(system),
        state.q[None],
        state.v[None],
        state.sticking[None],
        dt,
        start=state.time,
        noise=noise,
        solver=solver,
    )


UNSTABLE = "beyond which the motion is unstable"


def check_step(dt: object, largest: float, why: str = UNSTABLE) -> None:
    """Refuse a step that is no positive time or longer than the largest, with the reason."""
    if isinstance(dt, bool) or not isinstance(dt, Real) or not 0 < float(dt) < math.inf:
        msg = f"dt: expected a positive time in s; got {dt!r}"
        raise ValueError(msg)
    if float(dt) > largest:
        msg = f"dt: expected at most {largest:.3g} s, {why}; got {dt}"
        raise ValueError(msg)


def largest_step(system: System, state: State) -> float:
    """Return ``2 / omega`` with the highest frequency of small motions: the leapfrog's limit."""
    f, numbers = system.formulation, system.parameters
    scales = system.manifold.scale_array
    mass = moment(f, numbers, state.q, state.v).mass
    stiffness = np.empty((len(scales), len(scales)))
    for i, scale in enumerate(scales):
        change = np.zeros(len(scales))
        change[i] = 1e-5 * scale
        forth = moment(f, numbers, state.q + change, state.v).force
        back = moment(f, numbers, state.q - change, state.v).force
        stiffness[:, i] = -(forth - back) / (2 * change[i])
    squared = float(np.abs(np.linalg.eigvals(np.linalg.solve(mass, stiffness))).max())
    return 2 / math.sqrt(squared) if squared > 1e-12 else math.inf


def step(system: System, state: State, dt: float) -> State:
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
    motion = engine.motion
    q, v = motion.q[0].copy(), motion.v[0].copy()
    return State(state.time + dt, q, v, motion.sticks[0].astype(np.bool_))
