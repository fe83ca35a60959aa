from .abundance import Richness, richness
from .certificate import Certificate, Condition, Residuals, certify
from .immobility import Immobility, Mobility, immobility
from .methods import minimise, stationary_on
from .multistart import Minima, minima
from .problem import Problem
from .sensitivities import Crossing, Sensitivity, crossing, sensitivity
from .verdicts import Entrapment, Verdict

__all__ = [
    "Certificate",
    "Condition",
    "Crossing",
    "Entrapment",
    "Immobility",
    "Minima",
    "Mobility",
    "Problem",
    "Residuals",
    "Richness",
    "Sensitivity",
    "Verdict",
    "certify",
    "crossing",
    "immobility",
    "minima",
    "minimise",
    "richness",
    "sensitivity",
    "stationary_on",
]
