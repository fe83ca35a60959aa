from .errors import NonsmoothWarning, PolycornerError, SolverError
from .formulas import SmoothFunction
from .minimisation import (
    Certificate,
    Entrapment,
    Minima,
    Sensitivity,
    Verdict,
    certify,
    minima,
    minimise,
    sensitivity,
    stationary_on,
)
from .motion import Drift, Friction, State, System, Trajectory, simulate, velocities
from .polyhedra import AllOf, AnyOf, Polyhedron, Stratum, Symmetry, stratum_at
from .proofs import Membership, Proof, exact_point, prove
from .skeletons import Skeleton, skeleton
from .spaces import Manifold

__version__: str
__all__ = [
    "AllOf",
    "AnyOf",
    "Certificate",
    "Drift",
    "Entrapment",
    "Friction",
    "Manifold",
    "Membership",
    "Minima",
    "NonsmoothWarning",
    "PolycornerError",
    "Polyhedron",
    "Proof",
    "Sensitivity",
    "Skeleton",
    "SmoothFunction",
    "SolverError",
    "State",
    "Stratum",
    "Symmetry",
    "System",
    "Trajectory",
    "Verdict",
    "certify",
    "exact_point",
    "minima",
    "minimise",
    "prove",
    "sensitivity",
    "simulate",
    "skeleton",
    "stationary_on",
    "stratum_at",
    "velocities",
]
