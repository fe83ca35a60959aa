"""Zeros of a gradient in a rectangle by Codac's paver: processor time, and the boxes left.

A process of its own, because Codac changes the rounding mode: ``python codac_paving.py TASK`` with
JSON that has ``slopes`` (two formulas in ``x`` and ``y``), ``box``, ``epsilon`` and ``rounds``.
"""

import json
import sys
from time import process_time

import codac as c


def main() -> None:
    """Print the times of all rounds in seconds, and the number of boxes, as JSON."""
    task, point = json.loads(sys.argv[1]), c.VectorVar(2)
    names = {"x": point[0], "y": point[1], "cos": c.cos, "sin": c.sin}
    slopes = [eval(formula, {}, names) for formula in task["slopes"]]  # written by bench_lists.py
    contractor = c.CtcInverse(c.AnalyticFunction([point], c.vec(*slopes)), [[0, 0], [0, 0]])
    whole, times = c.IntervalVector(task["box"]), []
    for _ in range(task["rounds"]):
        start = process_time()
        paving = c.pave(whole, contractor, task["epsilon"], False)
        times.append(process_time() - start)
    print(json.dumps({"seconds": times, "boxes": len(paving.boxes(c.PavingOut.outer))}))


if __name__ == "__main__":
    main()
