"""Accelerations that contacts allow: whether rigid bodies with friction can move on smoothly."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from itertools import pairwise, product

import numpy as np

from polycorner.checks import instance, refuse
from polycorner.motion.formulation import moment
from polycorner.motion.mechanics import State
from polycorner.motion.noise import OPTIONS
from polycorner.motion.placements import gap_unit
from polycorner.motion.system import System
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT
from polycorner.values import Checked

MOST_MODES = 4096  # that are examined
SOLVED, UNBOUNDED = 0, 3  # of linear programmes
FAR = 1e4 * DEFAULT.unbounded  # whose projection onto a set is the force that opposes most


class Consistency(Enum):
    """Whether the accelerations of a state are determined."""

    CONSISTENT = "one acceleration"
    INDETERMINATE = "several accelerations"
    INCONSISTENT = "no acceleration: velocities jump"


@dataclass(frozen=True, eq=False)
class Accelerations(Checked):
    """The accelerations that the contacts of a state allow.

    Attributes
    ----------
    consistency : Consistency
    values : (s, n) array
        Different accelerations; if they form a continuum, some of them.
    forces : (s, m) array
        A normal force for each of `names` that produces each of them.
    names : tuple of str
        The contacts of the system with its surroundings, then its equations.
    """

    consistency: Consistency
    values: Array
    forces: Array
    names: tuple[str, ...]


def accelerations(system: System, state: State) -> Accelerations:
    """Find the accelerations ``a`` of a body that its contacts, joints and friction allow.

    They satisfy ``M a = F + sum_g lam_g grad f_g + sum_c B_c' p_c``.  Contacts whose gap and rate
    are zero obey ``lam_g >= 0``, ``f_g'' >= 0`` and ``lam_g f_g'' = 0``.  Where a contact slips at
    ``s``, friction is the force of its dynamic set, times the load, that opposes ``s`` most; where
    it does not slip, the same holds for the static set and ``s'``, or ``s' = 0``.  As the load of a
    contact that slips acts through friction, too, there may be several solutions, or none, and
    velocities jump without a collision: Painleve's paradox ([Genot]).

    All combinations of contacts that are pressed, of signs, and of beginnings of slip are examined;
    each is a linear programme.

    Parameters
    ----------
    system : System
        Of one body; linked bodies are written as one.
    state : State
        Of :meth:`System.state <polycorner.motion.system.System.state>`: a contact sticks there
        where its slip is exactly zero.

    Raises
    ------
    TypeError, ValueError
        If the system has several bodies; if a contact closes, which is an impact; if friction in
        two directions is at rest, which no finite list of cases covers; if there are more than 4096
        cases.

    Examples
    --------
    A rod slides on its lower end, which lies ahead of the middle: beyond ``mu = 4 / 3`` no force of
    the floor, however large, keeps it from sinking in.

    >>> import math, sympy
    >>> from polycorner import Friction, Manifold, Polyhedron, velocities
    >>> from polycorner.motion import Interval
    >>> M = Manifold.euclidean("x y theta")
    >>> x, y, theta = M.symbols
    >>> vx, vy, w = velocities(M)
    >>> end = Polyhedron(M, {"end": y - sympy.sin(theta)})
    >>> for mu in (1.2, 2.0):
    ...     rubs = Friction("rubs", vx + sympy.sin(theta) * w, Interval(mu), "end")
    ...     rod = System(end, (vx**2 + vy**2 + w**2 / 3) / 2, 9.81 * y, friction=[rubs])
    ...     tilt = math.atan(2)
    ...     found = accelerations(rod, rod.state([0, math.sin(tilt), tilt], [-3, 0, 0]))
    ...     print(mu, found.consistency.name)
    1.2 CONSISTENT
    2.0 INCONSISTENT
    """
    instance("system", system, System)
    instance("state", state, State)
    if system.count != 1:
        refuse("system", "one body, its count being 1", system.count)
    if system.hulls:
        expected = "contacts that are formulas, none of two sharp hulls"
        refuse("system", expected, system.hulls[0].names[0], NotImplementedError)
    if system.ties:
        refuse("system", "one without ties", [tie.name for tie in system.ties])
    if limited := [*system.limits, *system.nonholonomic]:
        refuse("system", "one without limits on velocities", limited, NotImplementedError)
    problem = _Problem.of(system, state)
    found: list[tuple[Array, Array]] = []
    several = False
    for mode in problem.modes():
        for acceleration, forces in problem.solutions(*mode):
            if not np.isfinite(acceleration).all():
                several = True
            elif all(problem.differ(acceleration, other) for other, _ in found):
                found.append((acceleration, forces))
    if not found:
        verdict = Consistency.INCONSISTENT
    elif several or len(found) > 1:
        verdict = Consistency.INDETERMINATE
    else:
        verdict = Consistency.CONSISTENT
    names = (*system.contacts, *system.polyhedron.equation_names)
    n = system.manifold.size
    return Accelerations(
        verdict,
        np.array([a for a, _ in found]).reshape(len(found), n),
        np.array([forces for _, forces in found]).reshape(len(found), len(names)),
        names,
    )


@dataclass(frozen=True)
class _AtRest:
    """Friction in one direction without slip: ``s' = row a + drift``, its load and its set."""

    row: Array
    drift: float
    owner: int  # the normal force that presses, or -1 for the known `load`
    load: float
    lower: float
    upper: float


@dataclass(frozen=True)
class _Problem:
    """The equations of motion at a state, with what depends on the mode left open.

    A mode is a value for each of the acting contacts (0: not pressed, 1), equations (the sign of
    its force, or 0 if that does not matter) and friction contacts at rest (the sign of ``s'``).

    Attributes
    ----------
    mass : (n, n) array
    force : (n,) array
        Of all forces that are known.
    acting : tuple of int
        Numbers of the contacts that act, and of the equations, from `unilateral` on.
    rows, bends : (m, n) and (m,) array
        ``f'' = rows a + bends`` of all contacts and equations.
    drags : (m, n) array
        Sliding friction per normal force.
    resting : tuple
    """

    mass: Array
    force: Array
    acting: tuple[int, ...]
    unilateral: int
    rows: Array
    bends: Array
    drags: Array
    resting: tuple[_AtRest, ...]

    @classmethod
    def of(cls, system: System, state: State) -> "_Problem":
        q, v, m = state.q, state.v, len(system.contacts)
        scales = system.manifold.scale_array
        law = system.formulation
        if law.is_paced:
            refuse("system", "slips that do not depend on the time", [*law.parameters])
        if system.rheonomic:
            refuse("system", "equations that do not depend on the time", [*system.rheonomic])
        now = moment(law, law.at(system.parameters, state.time), q, v)
        gaps, rows, hessians = system.polyhedron.bundle.evaluate(q, 2)
        rates = rows @ v
        sizes = np.linalg.norm(rows * scales, axis=-1)
        still = OPTIONS.overlap * sizes * np.linalg.norm(v / scales)
        touching = np.flatnonzero(gaps[:m] <= OPTIONS.overlap * gap_unit(system.manifold))
        for g in touching:
            if rates[g] < -still[g]:
                expected = f"a velocity at which contact {system.contacts[g]!r} does not close"
                refuse("state", expected, float(rates[g]))
        acting = (*(g for g in touching.tolist() if rates[g] <= still[g]), *range(m, len(rows)))
        force, drags, resting = now.force.copy(), np.zeros_like(rows), []
        slips, turns = now.slip_matrix @ v + now.drift, _turns(system, state)
        starts = np.cumsum([0, *(len(f.slip) for f in system.friction)]).tolist()
        for index, (first, last) in enumerate(pairwise(starts)):
            friction, owner = system.friction[index], system.owners[index]
            load = float(sum(max(0.0, now.loads[i]) for i in system.load_sources[index]))
            matrix, slip = now.slip_matrix[first:last], slips[first:last]
            if owner not in acting and load == 0:
                continue
            if not state.sticking[index] and slip.any():
                drag = friction.moving.project(-FAR * slip / np.linalg.norm(slip)) @ matrix
                if owner < 0:
                    force += load * drag
                else:
                    drags[owner] += drag
            elif last - first == 1:
                ends = (float(friction.static.project([end])[0]) for end in (-FAR, FAR))
                resting.append(_AtRest(matrix[0], float(turns[first]), owner, load, *ends))
            else:
                expected = f"friction {friction.name!r} in two directions to slip"
                refuse("state", expected, 0)
        bends = np.einsum("i,gij,j->g", v, hessians, v)
        return cls(now.mass, force, acting, m, rows, bends, drags, tuple(resting))

    def modes(self) -> Iterator[tuple[tuple[int, ...], tuple[int, ...]]]:
        """Yield what can be assumed of normal forces and of friction at rest."""
        rubbed = {*np.flatnonzero(self.drags.any(axis=1)), *(rest.owner for rest in self.resting)}
        choices = [
            (0, 1) if g < self.unilateral else (1, -1) if g in rubbed else (0,) for g in self.acting
        ]
        count = math.prod(map(len, choices)) * 3 ** len(self.resting)
        if count > MOST_MODES:
            refuse("state", f"contacts with at most {MOST_MODES} cases", count)
        yield from product(product(*choices), product((0, -1, 1), repeat=len(self.resting)))

    def solutions(
        self, signs: tuple[int, ...], ways: tuple[int, ...]
    ) -> Iterator[tuple[Array, Array]]:
        """Yield accelerations of a mode, least and greatest in each component, and their forces.

        What is infinite is yielded as such.  The unknowns are normal forces and friction at rest,
        in units of what the known forces ask for.
        """
        m, count = len(self.acting), len(self.acting) + len(self.resting)
        tests = np.array([*self.rows[list(self.acting)], *(rest.row for rest in self.resting)])
        tests = tests.reshape(count, len(self.mass))
        drift = [*self.bends[list(self.acting)], *(rest.drift for rest in self.resting)]
        pushes = tests.copy()
        for at, (g, sign) in enumerate(zip(self.acting, signs, strict=True)):
            pushes[at] += (sign or 1) * self.drags[g]
        free = np.linalg.solve(self.mass, self.force)
        mobility = np.linalg.solve(self.mass, tests.T)
        size = np.sqrt(np.maximum((tests * mobility.T).sum(axis=1), 1e-300))
        known = (tests @ free + drift) / size
        unit = max(float(np.abs(known).max(initial=0.0)), 1e-300) / size
        per_force: Array = np.linalg.solve(self.mass, pushes.T) * unit
        known, slope = known / (unit * size), tests @ per_force / (unit * size**2)[:, None]
        equal: list[tuple[Array, float]] = []
        below: list[tuple[Array, float]] = []
        one = np.eye(count)
        for at, (g, sign) in enumerate(zip(self.acting, signs, strict=True)):
            if g < self.unilateral and sign == 0:
                equal.append((one[at], 0.0))
                below.append((-slope[at], known[at]))
            else:
                equal.append((slope[at], -known[at]))
                below.append((-sign * one[at], 0.0))
        for at, (rest, way) in enumerate(zip(self.resting, ways, strict=True), start=m):
            load = np.zeros(count)
            if rest.owner >= 0:
                place = self.acting.index(rest.owner)
                load[place] = unit[place] / unit[at] * (signs[place] or 1)
            lowest = one[at] - rest.lower * load, rest.lower * rest.load / unit[at]
            highest = one[at] - rest.upper * load, rest.upper * rest.load / unit[at]
            below += [(-lowest[0], -lowest[1]), highest]
            if way == 0:
                equal.append((slope[at], -known[at]))
            else:
                equal.append(lowest if way > 0 else highest)
                below.append((-way * slope[at], way * known[at]))
        for cost in (*per_force, *-per_force) if count else ():
            found = _least(cost, equal, below)
            if found is None:
                return
            forces = np.zeros(len(self.rows))
            for at, g in enumerate(self.acting):
                pressed = float(found[at] * unit[at])
                forces[g] = pressed if g >= self.unilateral else max(0.0, pressed)
            answer = free + per_force @ found if np.isfinite(found).all() else found
            yield np.asarray(answer, dtype=np.float64), forces
        if not count:
            yield np.asarray(free, dtype=np.float64), np.zeros(len(self.rows))

    def differ(self, one: Array, other: Array) -> bool:
        """Return whether two accelerations are different, by ``a' M a``."""
        free = np.linalg.solve(self.mass, self.force)
        square = [a @ self.mass @ a for a in (one - other, one, other, free)]
        return bool(square[0] > DEFAULT.same**2 * max(square[1:]))


def _turns(system: System, state: State, *, turn: float = 1e-3) -> Array:
    """Return the rates of the slips at constant velocity, by differences of the fourth order.

    They are taken over a scaled displacement ``turn``.
    """
    q, v, law = state.q, state.v, system.formulation
    speed = np.abs(v / system.manifold.scale_array).max(initial=0.0)
    if not (system.friction and speed > 0):
        return np.zeros(law.slips)
    h = turn / speed
    at = [np.concatenate([q + k * h * v, v]) for k in (-2, -1, 1, 2)]
    slips, _ = law.slip_velocities(system.parameters, np.array(at))
    return np.asarray((slips[0] - 8 * slips[1] + 8 * slips[2] - slips[3]) / (12 * h))


def _least(
    cost: Array, equal: list[tuple[Array, float]], below: list[tuple[Array, float]]
) -> Array | None:
    """Return the minimum of a linear programme, infinite if there is none, None without a point."""
    from scipy.optimize import linprog

    sides = [
        (np.array([row for row, _ in side]), np.array([value for _, value in side]))
        if side
        else (None, None)
        for side in (below, equal)
    ]
    (rows, most), (flat, values) = sides
    found = linprog(cost, rows, most, flat, values, bounds=(None, None))
    if found.status == UNBOUNDED:
        return np.full(len(cost), np.inf)
    return np.asarray(found.x) if found.status == SOLVED else None
