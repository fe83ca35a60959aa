from .catalogue import CLAIMS
from .framework.claims import Claim, Finding, Means, Verdict

__all__ = ["CLAIMS", "Claim", "Finding", "Means", "Verdict"]
