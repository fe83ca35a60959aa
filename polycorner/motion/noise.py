"""Noise in the loads and forces of a simulation, and the accuracy of its solver."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from polycorner.checks import instance, mapping, real, whole
from polycorner.values import Checked


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
        their size are moved apart.  Not for bodies that turn in space, unless they are balls.
        Default 0: islands are solved, whatever their size.
    threads : int, optional
        How many threads do a step together; default 1.  Results are the same, bit for bit, for any
        number.  It pays for islands of many bodies, or many islands, and on idle processors.
    """

    tolerance: float = 1e-8
    sweeps: int = 2000
    refine: bool = True
    crowd_sweeps: int = 0
    threads: int = 1

    def __post_init__(self) -> None:
        real("tolerance", self.tolerance, above=0, below=1)
        whole("sweeps", self.sweeps, least=1)
        instance("refine", self.refine, bool)
        whole("crowd_sweeps", self.crowd_sweeps, least=0)
        whole("threads", self.threads, least=1)


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
    seed : int, optional
        Any whole number from 0 to 2^63 - 1; default 0.
    """

    chatter: float = 0.0
    correlation_time: float = 0.01
    kicks: Mapping[str, float] = field(default_factory=dict)
    kick_time: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        real("chatter", self.chatter, least=0)
        real("correlation_time", self.correlation_time, least=1e-12, unit="s")
        for size in mapping("kicks", self.kicks).values():
            real("kicks", size, least=0)
        real("kick_time", self.kick_time, least=0, unit="s")
        whole("seed", self.seed, least=0, most=2**63 - 1)
