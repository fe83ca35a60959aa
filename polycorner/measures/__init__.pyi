from .estimates import Estimate
from .faces import FaceWeights, face_weights
from .rates import TransitionRates, rates
from .sampling import SampleOptions, StrataSample, sample
from .strata import StrataMeasures, measure
from .volumes import Volume, volume
from .weighting import Weighting

__all__ = [
    "Estimate",
    "FaceWeights",
    "SampleOptions",
    "StrataMeasures",
    "StrataSample",
    "TransitionRates",
    "Volume",
    "Weighting",
    "face_weights",
    "measure",
    "rates",
    "sample",
    "volume",
]
