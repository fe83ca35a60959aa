from .certificate import Certificate, certify
from .methods import minimise, stationary_on
from .problem import Problem
from .search import Minima, minima
from .sensitivities import Sensitivity, sensitivity
from .verdicts import Entrapment, Verdict

__all__ = [
    "Certificate",
    "Entrapment",
    "Minima",
    "Problem",
    "Sensitivity",
    "Verdict",
    "certify",
    "minima",
    "minimise",
    "sensitivity",
    "stationary_on",
]
