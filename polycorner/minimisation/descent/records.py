"""Layouts of the problem and of the arguments that the compiled descent is given."""

from polycorner.formulas.tables import Layout

PROBLEM = Layout.of(
    calls="whole * 7",
    reads="whole *",
    outputs="whole *",
    parameters="real *",
    scales="real n",
    inequalities="whole",
    rows="whole",
    size="whole",
)
# Where `u` starts it also ends.
DESCEND = Layout.of(use="flag m", u="real n", multipliers="real M", limit="whole")
RESTORE = Layout.of(use="flag m", u="real n")
ON_FACE = Layout.of(on="flag m", u="real n")
