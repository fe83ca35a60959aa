"""Statuses with which the compiled descent ends, and what it shares with the analysis."""

# LEVEL: converged, but flat; UNEVEN: the same, and curvatures ask for very different scales.
CONVERGED, INFEASIBLE, UNBOUNDED, STALLED, LEVEL, UNEVEN = range(6)
# A curvature up to this multiple of the tolerance is not trusted, as it is positive beside an
# inflection, too; the direction is then treated as flat.
NEARLY_FLAT = 30.0
