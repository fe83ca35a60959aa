"""Points that lie beside the exact corner of active functions, within the tolerance."""

from dataclasses import replace

import numpy as np

from polycorner.minimisation.degeneracy import undecided
from polycorner.minimisation.descent.statuses import NEARLY_FLAT
from polycorner.minimisation.findings import OPEN, Analysis, Local
from polycorner.minimisation.steadiness import is_steady
from polycorner.minimisation.verdicts import Verdict

NEWTON = 4  # steps to a corner
ROUNDING = 1e-14  # relative length of a step that is rounding


def corner(local: Local, active: tuple[int, ...]) -> Local | None:
    """Return the derivatives where the active functions vanish exactly, by Newton's method.

    A point is within its tolerance of them, which is more than rounding: higher orders would tell
    it from the corner.  None where it is the corner, or where none is found as near.
    """
    numbers, scales = [*active, *local.sections], local.problem.scales
    q, steps = local.point, []
    for _ in range(NEWTON):
        values, gradients = local.problem.evaluate(q, 1)
        step = np.linalg.lstsq(gradients[numbers], values[numbers], rcond=local.tolerances.rank)[0]
        q = q - step * scales
        steps.append(float(abs(step).max()))
    size = ROUNDING * (1.0 + float(abs(q / scales).max()))
    if not (size < steps[0] <= OPEN * local.tolerances.zero and steps[-1] <= size):
        return None
    values, gradients, hessians = local.problem.evaluate(q, 2)
    return replace(local, point=q, values=values, gradients=gradients, hessians=hessians)


def seen_from(a: Analysis, exact: Analysis) -> Analysis:
    """Return the analysis of a point as that of the exact corner beside it."""
    if exact.verdict in {Verdict.NOT_STATIONARY, Verdict.NO_MULTIPLIER}:
        reason = "the exact corner of the active functions beside it is not stationary"
        return replace(a, decision=undecided(len(a.local.point), reason))
    return replace(a, verdict=exact.verdict, decision=exact.decision, curvature=exact.curvature)


def beside_inflection(a: Analysis) -> Analysis:
    """Return an analysis to second order with weak functions, where the curvature is steady.

    Beside an inflection the wall may lie on either side of it.
    """
    strict = a.verdict is Verdict.STRICT_MINIMUM
    point = a.local, a.active, a.gradients, a.multipliers, a.curvature
    if not is_steady(*point, least=NEARLY_FLAT * a.small_curvature if strict else np.inf):
        reason = "the second order changes as much as it is over a tiny distance"
        return replace(a, verdict=Verdict.UNDECIDED, decision=undecided(len(a.local.point), reason))
    return replace(a, verdict=Verdict.WEAK_MINIMUM) if strict else a
