"""Section 3: whether one set of friction and noise meets all observations together.

Each of the other checks names the noise under which it holds, and these differ.  Here every set is
judged by all criteria, and none is left out:

``python -m paper_checks.section3.sets --out docs/tables`` writes the table.
"""

import math
from collections.abc import Sequence
from functools import cache, partial
from typing import NamedTuple

import numpy as np

from paper_checks.framework.claims import Claim, Finding, Means, Verdict
from paper_checks.framework.disturbances import CAPTIONS, TEXT, Disturbance, Friction
from paper_checks.section3.bunch import LARGER, LEAVING, OBSERVED_TIME, QUIET, SHORTEST, bunch
from paper_checks.section3.singles import shaken
from paper_checks.section7.driven import CHATTER, KICKED, KINDS, settled
from paper_checks.section7.moving import wandering

Set = tuple[Friction, Disturbance, float]  # and the time in s for which pairs are followed
STRONGER = KICKED._replace(strength=60.0)  # sliding friction of the captions resists as much more
SETS: tuple[Set, ...] = (
    (TEXT, QUIET, 200.0),
    *((TEXT, *kind) for kind in KINDS),
    (CAPTIONS, QUIET, 200.0),
    (CAPTIONS, CHATTER, 300.0),
    (CAPTIONS, STRONGER, 400.0),
    (TEXT, CHATTER._replace(kicks=30.0), 400.0),
    (CAPTIONS, CHATTER._replace(kicks=60.0), 400.0),
)
OBSERVED = 15.0  # degrees, the heading of dyads of 16 mm
WITHIN = 2.0  # degrees, of headings
WIDTH = (4.0, 6.0)  # degrees, of zigzags: "about 5"


class Judged(NamedTuple):
    """Whether a criterion is met, and the numbers on which that rests, in words."""

    met: bool
    told: str


def singles(friction: Friction, noise: Disturbance) -> Judged:
    """Headings of single dumbbells from 15 degrees are halved within 200 s, and they descend."""
    path = shaken(noise, friction=friction)
    last = np.abs(np.degrees(path.q[path.times >= 150.0, :4, 2])).mean()
    rate = float((path.q[-1, 4:, 1] - path.q[0, 4:, 1]).mean() / path.times[-1])
    return Judged(bool(last < OBSERVED / 2 and rate < 0), f"15 to {last:.1f}°, {rate:.3f} mm/s")


@cache
def judged(friction: Friction, noise: Disturbance, duration: float) -> dict[str, Judged]:
    """Return the criteria of one set by name; the level drum and the bunch only if others hold."""
    found = settled(noise, duration, friction=friction)
    moves = wandering(noise, duration, friction)
    right, left = (float(x.mean()) if len(x) else math.nan for x in (found.right, found.left))
    sided = max(abs(right - OBSERVED), abs(left + OBSERVED)) <= WITHIN
    low, high = moves.widths
    result = {
        "singles lose their heading and descend": singles(friction, noise),
        "headings ±15°": Judged(sided, f"{right:.1f}°, {left:.1f}°"),
        "from all starts": Judged(found.spread <= 2 * WITHIN, f"over {found.spread:.1f}°"),
        "kept within 2°": Judged(moves.heading <= WITHIN, f"{moves.heading:.2g}°"),
        "zigzags of 5°": Judged(WIDTH[0] <= low <= high <= WIDTH[1], f"{low:.1f} to {high:.1f}°"),
        "R climb, L descend": Judged(
            found.climb > 0 > found.descent, f"{found.climb:.2f}, {found.descent:.2f} mm/s"
        ),
    }
    if sided:
        level = float(settled(noise, duration, 0.0, friction=friction).right.mean())
        result["tilt"] = Judged(abs(level - right) <= WITHIN, f"level {level:.1f}°")
    if all(one.met for one in result.values()) and sided:
        result["bunch"] = _leaving(friction, noise)
    return result


def _leaving(friction: Friction, noise: Disturbance) -> Judged:
    """Forty of sixty leave, to within ten, most of them in right-handed dyads; one start."""
    dt = noise.step(2e-3, kicked=1e-3)
    run = bunch(LARGER, OBSERVED_TIME, 0, SHORTEST, dt, noise, friction)
    left, right = len(run.exits), run.exit_counts()["right"]
    return Judged(abs(left - LEAVING[1]) <= 10 and right >= left / 2, f"{left}, {right} R")


def one_set_meets_all(sets: Sequence[Set] = SETS, criteria: Sequence[str] | None = None) -> Finding:
    """Judge every set by all criteria, or by some of them; holds if one set meets all."""
    found = {one: judged(*one) for one in sets}
    missed = {
        one: [f"{k} ({j.told})" for k, j in by.items() if not j.met and k in (criteria or by)]
        for one, by in found.items()
    }
    good = [one for one, fails in missed.items() if not fails]
    listed = "; ".join(
        f"{friction}, {noise}: {', '.join(fails) or 'nothing'}"
        for (friction, noise, _), fails in missed.items()
    )
    met = [{k for k, j in by.items() if j.met} for by in found.values()]
    never = set().union(*found.values()) - set().union(*met)
    return Finding(
        Verdict.HOLDS_UNDER if good else Verdict.REFUTED,
        f"of {len(found)} sets of friction and noise each misses: {listed}",
        {f"missed_{k}": float(len(fails)) for k, fails in enumerate(missed.values())},
        "; ".join(f"{friction}, {noise}" for friction, noise, _ in good)
        or f"no set meets more than {max(map(len, met))} of the criteria, and no set meets: "
        f"{', '.join(sorted(never)) or 'all at once'}",
    )


def table(sets: Sequence[Set] = SETS) -> str:
    """Return all sets and criteria as a table of Markdown; ``–``: not reached."""
    found = {one: judged(*one) for one in sets}
    names = list(dict.fromkeys([*(k for by in found.values() for k in by), "tilt", "bunch"]))
    lines = [["friction", "noise", *names], ["---"] * (len(names) + 2)]
    for (friction, noise, _), by in found.items():
        cells = [f"{'yes' if by[k].met else 'no'}: {by[k].told}" if k in by else "–" for k in names]
        lines.append([str(friction), str(noise), *cells])
    return "".join("| " + " | ".join(line) + " |\n" for line in lines)


CLAIMS = (
    Claim(
        "B11",
        "3",
        "observations on single dumbbells, dyads and the bunch, taken together",
        "one set of friction and noise meets single dumbbells, dyads, zigzags and the bunch "
        "together",
        Means.SIMULATION,
        one_set_meets_all,
        partial(one_set_meets_all, criteria=("from all starts", "kept within 2°")),
        slow=True,
    ),
)
