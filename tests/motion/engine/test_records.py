"""Records of arrays: the engine has no use for the first length of an array."""

import os
import subprocess
import sys

RUN = """
import sys
import numpy as np
from polycorner.dumbbells.drum import DumbbellDrum
from polycorner.dumbbells.dynamics.starts import scatter
from polycorner.motion import Noise
from polycorner.formulas.shipped import Shipped
from polycorner.motion.engine import entry_point
from polycorner.motion.simulation import start

if sys.argv[1] != "0":
    entry_point.UNTOLD = int(sys.argv[1])
    Shipped.text = ""
drum = DumbbellDrum(count=20, floor=True)
places = scatter(drum, np.random.default_rng(0), width=0.2, height=80.0, tries=1000)
kicks = {"phi": 3000.0, "eta": 25.0, "theta": 25.0}
engine = start(drum, drum.state(places), 1e-3, noise=Noise(kicks=kicks, chatter=0.3, seed=3))
engine.advance(1500)
assert engine.effort.parts > 0
print(engine.motion.q.tobytes().hex())
"""


def test_no_index_is_below_zero(tmp_path):
    """It would be so far off that the process ends; with true lengths it would wrap around."""
    found = []
    for length in (0, 1 << 40):
        env = {**os.environ, "POLYCORNER_CACHE_DIR": str(tmp_path / str(length))}
        run = subprocess.run(
            [sys.executable, "-c", RUN, str(length)],
            env=env, capture_output=True, text=True, check=True,
        )  # fmt: skip
        found.append(run.stdout)
    assert found[0] == found[1] != ""
