"""Noise in the loads and forces of a simulation, and the accuracy of its solver."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from polycorner.checks import instance, mapping, real, whole
from polycorner.values import Checked


@dataclass(frozen=True)
class MotionOptions(Checked):
    """Numbers that decide in a motion what touches, what is slow, and how short steps become.

    Lengths are in the scale units of the manifold, except for ``crowd_travel``.

    Attributes
    ----------
    touching, parting : float
        Gap up to which a contact is made, and beyond which it is lost.
    zero_gap : float
        Depth up to which a gap counts as zero.
    overlap : float
        Depth up to which the start of a motion counts as touching: what a step may leave.
    detection : float
        Gap up to which contacts between bodies are looked for, at least.
    bending : float
        Depth to which a gap may close by its curvature within a step.
    slow_travel, slow_travel_kicked, slow_bounce : float
        Travel in a step up to which an impact is slow, so that it need not be located: a plastic
        one, also of a limit on velocities, without and with random impulses, and one that bounces.
    crowd_travel : float
        The same for a plastic impact in a crowd, over the reach of bodies.
    crowd_overlap : float
        Overlap that is left as it is in a crowd whose contacts are swept.
    shortest_part : float
        Part of a step to which it is halved where contacts sink in.
    dependent : float
        Sine of the angle to other equations below which one follows from them.
    left_over : float
        Slip of what sticks, over the speeds that cancel in it, beyond which it is stopped anew.
    """

    touching: float = 1e-7
    parting: float = 100.0 * 1e-7
    zero_gap: float = 1e-9
    overlap: float = 1e-4
    detection: float = 1e-2
    bending: float = 1e-4
    slow_travel: float = 1e-6
    slow_travel_kicked: float = 1e-4
    slow_bounce: float = 1e-6
    crowd_travel: float = 0.01
    crowd_overlap: float = 1e-3
    shortest_part: float = 1.0 / 4096.0
    dependent: float = 1e-4
    left_over: float = 0.25

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            real(name, value, above=0, below=1)


OPTIONS = MotionOptions()  # where no solver is given


@dataclass(frozen=True)
class Solver(Checked):
    """How exactly the inclusion of each step is solved.

    Parameters
    ----------
    tolerance : float, optional
        Largest residual of a step, relative to the speeds in it; default 1e-8, but see
        :attr:`System.solver` for more than two bodies that touch each other.  A step that misses it
        is counted in ``Effort.unconverged``, with the worst residual, and is an event.
    sweeps : int, optional
        Most Gauss-Seidel sweeps over one island of touching bodies; default 2000.
    refine : bool, optional
        Whether touching bodies whose step cannot be solved, or is too long for an impact, take it
        in shorter ones; default true.  Otherwise impacts act up to a step before bodies meet, and
        bodies that are fast may pass through thin ones.
    crowd_sweeps : int, optional
        For thousands of bodies: sweeps over an island of more than 1,024 unilateral and friction
        contacts, after which its step is taken as it is.  It is counted in ``Effort.unconverged``,
        and ``Effort.residual`` says how much is missing.  Forces spread only so far in a step, so
        that heaps are a little soft and friction creeps.  Bodies that overlap by more than 0.1 % of
        their size are moved apart.  With ``refine`` it takes the step in shorter ones, all swept,
        where a body would pass through another.  Not for bodies that turn in space, unless they are
        balls.  Default 0: islands are solved, whatever their size.
    threads : int, optional
        How many threads do a step together; default 1.  Results are the same, bit for bit, for any
        number.  It pays for islands of many bodies, or many islands, and on idle processors.
    options : MotionOptions, optional
        What counts as touching, as slow and as short.
    """

    tolerance: float = 1e-8
    sweeps: int = 2000
    refine: bool = True
    crowd_sweeps: int = 0
    threads: int = 1
    options: MotionOptions = field(default=OPTIONS, repr=False)

    @classmethod
    def piles(cls) -> "Solver":
        """Return the solver of more than two bodies that touch each other."""
        return cls(tolerance=1e-4, sweeps=62)

    @classmethod
    def crowd(cls, crowd_sweeps: int) -> "Solver":
        """Return the solver of thousands of bodies, with so many sweeps over each large island."""
        return cls(tolerance=1e-4, crowd_sweeps=crowd_sweeps)

    def __post_init__(self) -> None:
        real("tolerance", self.tolerance, above=0, below=1)
        whole("sweeps", self.sweeps, least=1)
        instance("refine", self.refine, bool)
        whole("crowd_sweeps", self.crowd_sweeps, least=0)
        whole("threads", self.threads, least=1)
        instance("options", self.options, MotionOptions)


@dataclass(frozen=True)
class Noise(Checked):
    """Chattering loads and random impulses.

    On a substrate that is not quite smooth loads fluctuate.  *Chatter*: every known load ``N`` is
    multiplied by ``max(0, 1 + A xi)`` with ``xi`` standard normal, independent for each body and
    load, held for a correlation time and then drawn anew.  Bodies that need almost all of their
    friction then slip now and then: these are the slippages of [GMBN] sec. 3.  *Kicks*: random
    forces on coordinates.  White ones, impulses ``sigma sqrt(h) xi`` in each step of length ``h``,
    have different paths for different steps.  With a ``kick_time`` ``tau`` the force is
    ``sigma / sqrt(tau) xi_n`` on ``[n tau, (n + 1) tau)``, counted from the start of the run, and
    each step gets its exact integral: the motion converges as ``h -> 0``, and as ``tau -> 0`` the
    force tends to the white one of the same ``sigma``.

    *Scatter*: what a contact under a known load can hold differs from stop to stop.  Whenever it
    comes to stick, its static set is multiplied by a factor drawn anew, lognormal with the mean 1
    and the standard deviation ``s``, but so that the dynamic set remains inside it.

    Each number is a function of the seed, the time, the body and its use (SplitMix64, [Steele]), so
    a run that resumes meets the same noise.

    Parameters
    ----------
    chatter : float, optional
        Amplitude ``A >= 0`` of the loads' relative fluctuation; default 0.
    correlation_time : float, optional
        How long a draw is held, in s; default 0.01.
    kicks : mapping from str to float, optional
        ``sigma`` by coordinate: a coordinate of mass ``m`` diffuses in velocity with
        ``<dv^2> = (sigma / m)^2 t``, for times that are long against ``kick_time``.  In units of
        force times sqrt(s).
    kick_time : float, optional
        How long a random force is held, in s, or 0 (default): white noise.
    scatter : mapping from str to float, optional
        ``s`` by kind of friction, such as ``{"rolling": 0.3}``; default none.
    seed : int, optional
        Any whole number from 0 to 2^63 - 1; default 0.
    """

    chatter: float = 0.0
    correlation_time: float = 0.01
    kicks: Mapping[str, float] = field(default_factory=dict)
    kick_time: float = 0.0
    seed: int = 0
    scatter: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        real("chatter", self.chatter, least=0)
        real("correlation_time", self.correlation_time, least=1e-12, unit="s")
        for size in mapping("kicks", self.kicks).values():
            real("kicks", size, least=0)
        for width in mapping("scatter", self.scatter).values():
            real("scatter", width, least=0)
        real("kick_time", self.kick_time, least=0, unit="s")
        whole("seed", self.seed, least=0, most=2**63 - 1)
