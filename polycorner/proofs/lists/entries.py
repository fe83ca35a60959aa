"""Layouts of what the compiled tests of boxes are given, and bounds of rounding errors."""

from polycorner.formulas.tables import Layout

UNIT = 2.0**-52
TINY = 2.0**-1000

DIRECTIONS = Layout.of(
    low="real B * n",
    high="real B * n",
    boxes="whole I",
    masks="flag I m",
    equations="whole",
    scales="real n",
    energy_sign="real",
    found="flag I",  # results
    v="real I n",
    weights="real I *",
)
COVERED = Layout.of(
    lower="real B n",
    upper="real B n",
    boxes="whole I",
    masks="flag I m",
    left="real R n",
    right="real R n",
    active="flag R m",
    found="flag I",  # the result
)
CARRIED = Layout.of(
    lower="real B n",
    upper="real B n",
    orders="whole G n",
    signs="real G n",
    shifts="real G n",
    slopes="real G n",
    weights="real n",
    periods="real n",
    least="real n",
    most="real n",
    margin="real",
    gone="flag B",  # the result
)
BENT = Layout.of(
    g_lo="real B * n",
    g_hi="real B * n",
    h_lo="real B * n n",
    h_hi="real B * n n",
    left="real B k n",
    start="real B n",
    found="flag B",  # the result
)
