"""A system laid out as arrays for the compiled core."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from polycorner.formulas.bundles import Call
from polycorner.formulas.families import Family
from polycorner.motion.formulation import Formulation, moment
from polycorner.motion.friction import ConvexSet
from polycorner.motion.noise import Noise, Solver
from polycorner.motion.system import System
from polycorner.spaces.manifold import Array

if TYPE_CHECKING:
    from polycorner.motion.engine.compiled import Scene

IMPACT = "impact"


@dataclass(frozen=True)
class Grip:
    """One friction contact of a body: which rows slip, what holds it, what presses."""

    name: str
    rows: int
    static: ConvexSet
    dynamic: ConvexSet
    owner: int
    sources: tuple[int, ...]
    kind: str


@dataclass(frozen=True, eq=False)
class Body:
    """The description of one body, or of a whole system without repetition.

    Attributes
    ----------
    formulation, parameters
        Its equations of motion and the values of their parameters.
    grips : tuple of Grip
    gaps : sequence of Call
        Kernels of its own gaps.
    contacts : tuple of str
        Names of these gaps.
    restitution : (m,) array
    unit : (k,) array
        Length of a unit of each coordinate: it turns velocities into comparable speeds.
    scale : float
        Unit of gaps.
    """

    formulation: Formulation
    parameters: Array
    grips: tuple[Grip, ...]
    gaps: Sequence[Call]
    contacts: tuple[str, ...]
    restitution: Array
    unit: Array
    scale: float


@dataclass(frozen=True, eq=False)
class Pairing:
    """The contacts between any two bodies of a herd.

    Attributes
    ----------
    gaps : Family
        Gaps of a pair.
    parameters : sequence of float
    reads : tuple of (int, int)
        For each variable the body, 0 or 1, and its coordinate.
    rubs : tuple of (Family, bool, sequence of float)
        For each gap the slip at its contact (two rows; variables: the coordinates the gaps read,
        then all velocities of both bodies), whether the bodies are exchanged in it, and its
        parameters.
    static, dynamic : ConvexSet
        Friction at these contacts.
    restitution : float
    reach : float
        Distance of places beyond which bodies cannot touch.
    """

    gaps: Family
    parameters: tuple[float, ...]
    reads: tuple[tuple[int, int], ...]
    rubs: "tuple[tuple[Family, bool, tuple[float, ...]], ...]"
    static: ConvexSet
    dynamic: ConvexSet
    restitution: float
    reach: float


@dataclass(frozen=True, eq=False)
class Herd:
    """``count`` equal bodies that may touch each other.

    Attributes
    ----------
    body : Body
    count : int
    pairing : Pairing, optional
        Contacts between bodies; none by default.
    place : (int, int)
        The two coordinates that say where a body is.
    carried : float
        Speed of the substrate along the first of them, as a length per time.
    exit_place, exit_limit : int, float
        A body leaves when this coordinate passes the limit; -1: never.
    """

    body: Body
    count: int = 1
    pairing: Pairing | None = None
    place: tuple[int, int] = (0, 0)
    carried: float = 0.0
    exit_place: int = -1
    exit_limit: float = 0.0
    causes: tuple[str, ...] = field(init=False)

    def __post_init__(self) -> None:
        kinds = [IMPACT, *(grip.kind for grip in self.body.grips)]
        if self.pairing is not None and self.pairing.rubs:
            kinds.append("rubbing")
        object.__setattr__(self, "causes", tuple(dict.fromkeys(kinds)))

    @property
    def coordinates(self) -> int:
        """Coordinates of a body, ``k``."""
        return len(self.body.formulation.coordinates)


def herd_of(system: "System | Herd") -> Herd:
    """Return a system as a herd of one body."""
    if isinstance(system, Herd):
        return system
    grips = tuple(
        Grip(f.name, len(f.slip), f.static, f.moving, owner, sources, f.kind)
        for f, owner, sources in zip(
            system.friction, system.owners, system.load_sources, strict=True
        )
    )
    scales = system.manifold.scale_array
    body = Body(
        system.formulation,
        system.parameters,
        grips,
        system.polyhedron.bundle.calls,
        system.contacts,
        system.restitutions,
        1 / scales,
        float(scales.min()),
    )
    return Herd(body)


def lay_out(herd: Herd, noise: Noise, solver: Solver) -> "Scene":
    """Return the arrays that :func:`polycorner.motion.engine.compiled.advance` reads."""
    from polycorner.motion.engine.compiled import Scene

    body, k = herd.body, herd.coordinates
    numbers = list(body.parameters)
    tables = _gap_tables(body.gaps, len(body.contacts), numbers)
    shapes = _Shapes()
    grips = body.grips
    source = np.zeros((len(grips), max(1, body.formulation.loads)), dtype=np.int64)
    for f, grip in enumerate(grips):
        source[f, list(grip.sources)] = 1
    shape = [[shapes.add(grip.static), shapes.add(grip.dynamic)] for grip in grips]
    pair = _pair_entries(herd, numbers, shapes)
    kicks = [float(noise.kicks.get(name, 0.0)) for name in body.formulation.coordinates]
    return Scene(
        bodies=herd.count,
        size=k,
        force_at=body.formulation.forces.kernel.compiled(0).point,
        slip_at=body.formulation.slip.kernel.compiled(1).point if grips else 0,
        loads=body.formulation.loads,
        row=_whole(np.cumsum([0, *(grip.rows for grip in grips)])),
        shape=_whole(shape).reshape(-1, 2),
        owner=_whole([grip.owner for grip in grips]),
        source=source,
        cause=_whole([herd.causes.index(grip.kind) for grip in grips]),
        bounce=np.asarray(body.restitution, dtype=np.float64),
        place=_whole(herd.place),
        unit=np.asarray(body.unit, dtype=np.float64),
        carried=float(herd.carried),
        exit_place=herd.exit_place,
        exit_limit=float(herd.exit_limit),
        scale=float(body.scale),
        chatter=float(noise.chatter),
        chatter_time=float(noise.correlation_time),
        kicks=np.array(kicks),
        seed=int(noise.seed),
        tolerance=float(solver.tolerance),
        sweeps=int(solver.sweeps),
        constant=int(_mass_is_constant(body)),
        numbers=np.array([*numbers, 0.0]),
        **tables,
        **pair,
        **shapes.arrays(),
    )


def _mass_is_constant(body: Body) -> bool:
    """Return whether the mass matrix is the same at three points drawn at random."""
    k = len(body.formulation.coordinates)
    draws = np.random.default_rng(0).normal(size=(3, 2, k))
    first, *others = (moment(body.formulation, body.parameters, q, v).mass for q, v in draws)
    return all(np.array_equal(first, other) for other in others)


def _whole(values: Any) -> NDArray[np.int64]:
    return np.array(values, dtype=np.int64)


def _gap_tables(calls: Sequence[Call], rows: int, numbers: list[float]) -> dict[str, Any]:
    table: list[tuple[int, ...]] = []
    reads: list[int] = []
    places: list[int] = []
    for call in calls:
        kernel = call.family.kernel
        if len(set(call.columns)) != len(call.columns) or max(call.rows) >= rows:
            msg = "polyhedron: expected each gap once; got one that occurs twice"
            raise ValueError(msg)
        where = dict(zip(call.columns, call.rows, strict=True))
        entry = (kernel.compiled(1).point, kernel.variables, kernel.outputs)
        table.append((*entry, len(reads), len(places), len(numbers)))
        reads += call.reads
        places += [where.get(column, -1) for column in range(kernel.outputs)]
        numbers += call.parameters.tolist()
    return {
        "gap_table": _whole(table).reshape(-1, 6),
        "gap_reads": _whole([*reads, 0]),
        "gap_rows": _whole([*places, 0]),
    }


def _pair_entries(herd: Herd, numbers: list[float], shapes: "_Shapes") -> dict[str, Any]:
    pairing = herd.pairing
    entries: dict[str, Any] = {
        "pair_at": 0,
        "pair_number": len(numbers),
        "pair_reads": _whole([]).reshape(-1, 2),
        "pair_gaps": 0,
        "rub_table": _whole([]).reshape(-1, 3),
        "rub_shape": _whole([0, 0]),
        "rub_cause": 0,
        "pair_bounce": 0.0,
        "reach": 0.0,
    }
    if pairing is None or herd.count < 2:
        return entries
    numbers += pairing.parameters
    rubs = []
    for family, swapped, values in pairing.rubs:
        rubs.append((family.kernel.compiled(1).point, int(swapped), len(numbers)))
        numbers += values
    entries["pair_at"] = pairing.gaps.kernel.compiled(1).point
    entries["pair_reads"] = _whole(pairing.reads)
    entries["pair_gaps"] = len(pairing.gaps.names)
    entries["rub_table"] = _whole(rubs).reshape(-1, 3)
    entries["rub_shape"] = _whole([shapes.add(pairing.static), shapes.add(pairing.dynamic)])
    entries["rub_cause"] = herd.causes.index("rubbing") if pairing.rubs else 0
    entries["pair_bounce"] = float(pairing.restitution)
    entries["reach"] = float(pairing.reach)
    return entries


class _Shapes:
    """Convex sets, each once."""

    def __init__(self) -> None:
        self.found: dict[Any, int] = {}
        self.codes: list[tuple[int, tuple[float, ...], Any]] = []

    def add(self, shape: ConvexSet) -> int:
        kind, numbers, vertices = shape.code
        key = (kind, tuple(numbers), np.asarray(vertices).tobytes())
        if key not in self.found:
            self.found[key] = len(self.codes)
            self.codes.append((kind, tuple(numbers), np.asarray(vertices).reshape(-1, 2)))
        return self.found[key]

    def arrays(self) -> dict[str, Any]:
        codes = self.codes or [(0, (0.0,) * 4, np.empty((0, 2)))]
        return {
            "kinds": _whole([kind for kind, _, _ in codes]),
            "sizes": np.array([numbers for _, numbers, _ in codes], dtype=np.float64),
            "corner": _whole(np.cumsum([0, *(len(v) for _, _, v in codes)])),
            "vertices": np.concatenate([v for _, _, v in codes] + [np.zeros((1, 2))]),
        }
