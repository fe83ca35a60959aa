"""The scenes of :mod:`scenes` moved by polycorner, by MuJoCo ([MuJoCo]) and by Pymunk ([Pymunk]).

An engine builds a scene once, at a step, and then moves it from its start as often as it is asked.
"""

import importlib
from abc import ABC, abstractmethod
from typing import Any, NamedTuple

import numpy as np
from mjcf_ring import text
from scenes import FRICTION, GRAVITY, Scene, Shape

from polycorner.spaces.manifold import Array

MOST_SWEEPS = 100  # of MuJoCo's solver
STEPS_A_CALL = 10


class Moved(NamedTuple):
    """Placements and velocities at some instants, the first at 0."""

    q: list[Array]
    v: list[Array]


class Engine(ABC):
    """A scene that an engine has built.

    Raises
    ------
    ImportError
        If the engine is not installed.
    NotImplementedError, TypeError, ValueError
        If it does not take the scene.
    """

    def __init__(self, scene: Scene, dt: float) -> None:
        self.scene, self.dt = scene, dt
        self.build()

    @abstractmethod
    def build(self) -> None:
        """Build the scene."""

    @abstractmethod
    def move(self, steps: int, records: int) -> Moved:
        """Return the motion in so many steps, with so many instants after the first."""

    @property
    def unsolved(self) -> int | None:
        """Islands that missed the tolerance in the last motion, None if it is not told."""
        return None


class Ours(Engine):
    """Moved by polycorner."""

    def build(self) -> None:
        """Build the arrangement and its system."""
        from polycorner.bodies import Arrangement, HalfSpace
        from polycorner.motion import Solver

        scene = self.scene
        bodies = {name: our_body(shape) for name, shape in scene.shapes.items()}
        walls = {name: HalfSpace(*wall) for name, wall in scene.walls.items()}
        given: dict[str, Any] = {"joints": self._joints()} if scene.hinges else {}
        self.kinds = Arrangement(bodies, walls, orientations="all", **given)
        gravity = [*[0.0] * (scene.dimension - 1), -GRAVITY]
        counts: Any = dict(scene.counts) if len(bodies) > 1 else sum(scene.counts.values())
        several = {} if scene.hinges else {"count": counts}
        density = scene.bodies[0].mass / self._unit_mass(bodies)
        self.system: Any = self.kinds.system(
            gravity=gravity, friction=FRICTION, density=density, **several
        )
        self.solver = Solver.crowd(scene.sweeps) if scene.sweeps else None
        self.path: Any = None

    def _unit_mass(self, bodies: dict[str, Any]) -> float:
        from polycorner.bodies import mass_of

        return mass_of(next(iter(bodies.values())), 1.0).mass

    def _joints(self) -> dict[str, Any]:
        from polycorner.bodies import Hinge  # type: ignore[attr-defined, unused-ignore]

        names = [*self.scene.shapes]
        return {
            name: Hinge(
                "world" if hinge.parent is None else names[hinge.parent],
                names[hinge.child],
                at=hinge.at,
                on=hinge.on,
            )
            for name, hinge in self.scene.hinges.items()
        }

    def move(self, steps: int, records: int) -> Moved:
        """Simulate."""
        from polycorner import simulate

        end, every = steps * self.dt, max(1, steps // records)
        state = self.system.state(self._start())
        self.path = simulate(self.system, state, end, self.dt, every=every, solver=self.solver)
        instants = np.arange(0, steps + 1, every) * self.dt
        kept = np.searchsorted(self.path.times, instants - self.dt / 2)
        q, v = self._recorded()
        if self.scene.dimension == 3:  # the rate of a quaternion is half that of turning
            turning = 2 * np.linalg.norm(v[..., 3:], axis=-1, keepdims=True)
            v = np.concatenate([v[..., :3], turning], axis=-1)
        return Moved([*q[kept]], [*v[kept]])

    def _start(self) -> Any:
        start, counts = self.scene.start, self.scene.counts
        if self.scene.hinges:
            return start.ravel()
        if len(counts) == 1:
            return start
        ends = np.cumsum([*counts.values()])[:-1]
        return dict(zip(counts, np.split(start, ends), strict=True))

    def _recorded(self) -> tuple[Array, Array]:
        several = not self.scene.hinges and len(self.scene.counts) > 1
        paths = [self.path[name] for name in self.scene.counts] if several else [self.path]
        width = self.scene.start.shape[1]
        q, v = (
            np.concatenate([getattr(p, x).reshape(len(p.q), -1, width) for p in paths], axis=1)
            for x in ("q", "v")
        )
        return q, v

    @property
    def unsolved(self) -> int | None:
        """Islands that missed the tolerance in the last motion."""
        return None if self.path is None else int(self.path.effort.unconverged)


def our_body(shape: Shape) -> Any:
    """Return the body of a shape."""
    from polycorner import bodies as b

    points, r, d = shape.points, shape.radius, shape.points.shape[1]
    if len(points) == 1:
        return b.disc(r) if d == 2 else b.sphere(r)
    if len(points) == 2:
        return b.capsule(*points, r)
    return b.polygon(points) if d == 2 else b.polytope(points)


class MujocoEngine(Engine):
    """Moved by MuJoCo, by Newton's method; bodies in the plane have two slides and a hinge.

    Contacts are as stiff as the step allows, and friction cones are round.
    """

    option = f'cone="elliptic" integrator="implicitfast" iterations="{MOST_SWEEPS}" impratio="10"'
    stiffness = 2.0  # time constant of contacts over the step; MuJoCo accepts no less

    def build(self) -> None:
        """Compile the document."""
        self.mujoco = importlib.import_module("mujoco")
        self.model = self.mujoco.MjModel.from_xml_string(self.document())
        self.data = self.mujoco.MjData(self.model)

    def document(self) -> str:
        """Return the scene as an MJCF document."""
        walls = "\n".join(self._wall(k) for k in range(len(self.scene.walls)))
        bodies = self._arm(0) if self.scene.hinges else "\n".join(map(self._one, self._numbers()))
        solref = f'solref="{text(self.stiffness * self.dt, 1)}"' if self.stiffness else ""
        return f"""<mujoco>
  <compiler angle="radian"/>
  <option timestep="{text(self.dt)}" gravity="{text(0, 0, -GRAVITY)}" {self.option}/>
  <size memory="200M"/>
  <default><geom {solref} condim="3" friction="{text(FRICTION, 0, 0)}"/></default>
  <worldbody>
{walls}
{bodies}
  </worldbody>
  {self._excluded()}
</mujoco>"""

    def _numbers(self) -> range:
        return range(len(self.scene.bodies))

    def _wall(self, k: int) -> str:
        wall = [*self.scene.walls.values()][k]
        return (
            f'<geom type="plane" size="0 0 1" pos="{text(*_in_space(wall.point))}" '
            f'zaxis="{text(*_in_space(wall.normal))}"/>'
        )

    def _one(self, k: int) -> str:
        joint = "<freejoint/>"
        if self.scene.dimension == 2:
            joint = (
                '<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/>'
                '<joint type="hinge" axis="0 -1 0"/>'
            )
        return f"<body>{joint}{_mjcf(self.scene.bodies[k])}</body>"

    def _arm(self, k: int) -> str:
        """Return a link and the links that hang on it."""
        hinge = [*self.scene.hinges.values()][k]
        # The origin of a link is its middle; that of its parent is where `at` counts from.
        place = np.array(hinge.at) - np.array(hinge.on)
        inner = self._arm(k + 1) if k + 1 < len(self.scene.hinges) else ""
        return (
            f'<body name="link{k}" pos="{text(*_in_space(place))}"><joint type="hinge" '
            f'axis="0 -1 0" pos="{text(*_in_space(np.array(hinge.on)))}"/>'
            f"{_mjcf(self.scene.bodies[k])}{inner}</body>"
        )

    def _excluded(self) -> str:
        pairs = [(h.parent, h.child) for h in self.scene.hinges.values() if h.parent is not None]
        rows = "".join(f'<exclude body1="link{a}" body2="link{b}"/>' for a, b in pairs)
        return f"<contact>{rows}</contact>" if rows else ""

    def move(self, steps: int, records: int) -> Moved:
        """Reset and step."""
        self.mujoco.mj_resetData(self.model, self.data)
        q = self.scene.start
        angles = np.diff(q[:, 2], prepend=0.0) if self.scene.hinges else q.ravel()
        self.data.qpos[:] = angles
        moved, every = Moved([], []), max(1, steps // records)
        for done in range(0, steps + 1, every):
            self._record(moved)
            self._advance(min(every, steps - done))
        if self.data.warning.number.any():
            msg = f"MuJoCo warned, so often of each kind: {self.data.warning.number.tolist()}"
            raise RuntimeError(msg)
        return moved

    def _advance(self, steps: int) -> None:
        # A few steps a call, between which Python can end what takes too long.
        for done in range(0, steps, STEPS_A_CALL):
            self.mujoco.mj_step(self.model, self.data, min(STEPS_A_CALL, steps - done))

    def _record(self, moved: Moved) -> None:
        self.mujoco.mj_forward(self.model, self.data)
        q, v = self.data.qpos, self.data.qvel
        if not self.scene.hinges:
            width = self.scene.start.shape[1]
            moved.q.append(q.reshape(-1, width).copy())
            moved.v.append(v.reshape(-1, 3 if width == 3 else 6).copy())
            return
        places, turns = self.data.xipos[1:][:, [0, 2]], np.cumsum(q)
        rates = np.empty((len(q), 6))
        for k, row in enumerate(rates):
            kind = self.mujoco.mjtObj.mjOBJ_BODY
            self.mujoco.mj_objectVelocity(self.model, self.data, kind, k + 1, row, 0)
        moved.q.append(np.column_stack([places, turns]))
        moved.v.append(np.column_stack([rates[:, [3, 5]], -rates[:, 1]]))


class MujocoDefault(MujocoEngine):
    """The same with MuJoCo's defaults, which are softer and faster."""

    option, stiffness = "", 0.0


def _in_space(point: Array) -> Array:
    """Return a point of the plane in MuJoCo's, ``y = 0``."""
    return point if len(point) == 3 else np.array([point[0], 0.0, point[1]])


def _mjcf(shape: Shape) -> str:
    """Return the inertia and the geometry of a body; in the plane a disc is a ball."""
    flat = shape.points.shape[1] == 2
    points, r = shape.points, shape.radius
    moments = 3 * [shape.inertia]
    inertial = f'<inertial pos="0 0 0" mass="{text(shape.mass)}" diaginertia="{text(*moments)}"/>'
    if len(points) == 1:
        geometry = f'type="sphere" size="{text(r)}"'
    elif len(points) == 2:
        ends = text(*_in_space(points[0]), *_in_space(points[1]))
        geometry = f'type="capsule" size="{text(r)}" fromto="{ends}"'
    else:
        half = _in_space(points.max(0)) + (np.array([0, points.max(), 0]) if flat else 0)
        geometry = f'type="box" size="{text(*half)}"'
    return f"{inertial}<geom {geometry}/>"


class PymunkEngine(Engine):
    """Moved by Pymunk, in the plane."""

    def build(self) -> None:
        """Refuse scenes in space; :meth:`space` is built for each motion."""
        self.pymunk = importlib.import_module("pymunk")
        if self.scene.dimension == 3:
            msg = "Pymunk is for the plane"
            raise NotImplementedError(msg)

    def space(self) -> tuple[Any, list[Any]]:
        """Return the scene at its start, and the bodies."""
        space = self.pymunk.Space()
        space.gravity, space.iterations = (0.0, -GRAVITY), 10
        least = min(body.size for body in self.scene.bodies)
        space.collision_slop = 1e-3 * least
        for wall in self.scene.walls.values():
            along = 100 * np.array([-wall.normal[1], wall.normal[0]])
            ends = wall.point - wall.normal + along, wall.point - wall.normal - along
            line = self.pymunk.Segment(space.static_body, *(e.tolist() for e in ends), 1.0)
            line.friction = FRICTION**0.5  # coefficients of two shapes are multiplied
            space.add(line)
        bodies = []
        for shape, (x, y, angle) in zip(self.scene.bodies, self.scene.start.tolist(), strict=True):
            body = self.pymunk.Body(shape.mass, shape.inertia)
            body.position, body.angle = (x, y), angle
            space.add(body, self._shape(shape, body))
            bodies.append(body)
        for hinge in self.scene.hinges.values():
            ground = space.static_body
            parent = ground if hinge.parent is None else bodies[hinge.parent]
            joint = self.pymunk.PivotJoint(parent, bodies[hinge.child], hinge.at, hinge.on)
            joint.collide_bodies = hinge.parent is None
            space.add(joint)
        return space, bodies

    def _shape(self, shape: Shape, body: Any) -> Any:
        points, r = shape.points.tolist(), shape.radius
        if len(points) == 1:
            made = self.pymunk.Circle(body, r)
        elif len(points) == 2:
            made = self.pymunk.Segment(body, *points, r)
        else:
            made = self.pymunk.Poly(body, points, radius=r)
        made.friction = FRICTION**0.5
        return made

    def move(self, steps: int, records: int) -> Moved:
        """Build and step."""
        space, bodies = self.space()
        moved, every = Moved([], []), max(1, steps // records)
        for done in range(steps + 1):
            if done % every == 0:
                moved.q.append(np.array([(*b.position, b.angle) for b in bodies]))
                moved.v.append(np.array([(*b.velocity, b.angular_velocity) for b in bodies]))
            if done < steps:
                space.step(self.dt)
        return moved


ENGINES: dict[str, type[Engine]] = {
    "polycorner": Ours,
    "MuJoCo": MujocoEngine,
    "MuJoCo, defaults": MujocoDefault,
    "Pymunk": PymunkEngine,
}
