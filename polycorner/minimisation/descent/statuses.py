"""Statuses with which the compiled descent ends."""

# LEVEL: converged, but flat; UNEVEN: the same, and curvatures ask for very different scales.
CONVERGED, INFEASIBLE, UNBOUNDED, STALLED, LEVEL, UNEVEN = range(6)
