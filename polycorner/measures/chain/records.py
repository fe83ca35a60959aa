"""Layouts of what the compiled chain is given."""

from polycorner.formulas.tables import Layout

# Rows of the system are the inequalities, the equations, and the energy if there is one.
SYSTEM = Layout.of(
    calls="whole * 6",
    reads="whole *",
    outputs="whole *",
    parameters="real *",
    size="whole",
    scales="real n",
    inequalities="whole",
    rows="whole",
    charged="whole",  # whether the last row is an energy
    temperature="real",
    sticky="whole",  # whether gradients of contacts divide the density
    weights="real m",  # logarithms of the factors of contacts
    fixed="flag m",  # contacts that are never lost
    least="whole",  # contacts that are held at least, and at most
    most="whole",
    step="real",  # standard deviation of a step within a stratum
    sideways="real",  # and of that along the lower stratum when a contact is gained or lost
    reach="real",  # distance over which contacts are gained and lost
    gain="real",  # probabilities of these moves
    lose="real",
    zero="real",  # distances from zero: of what is not held, of what is,
    settled="real",
    same="real",  # and between a point and the one that the way back leads to
    singular="real",  # sine of an angle between gradients that counts as none
)
# `u`, `held` and `stream` are where the chain begins, and afterwards where it ended.
CHAIN = Layout.of(
    u="real n",
    held="whole m",
    stream="whole 1",
    every="whole",  # steps from one record to the next
    points="real K n",
    codes="whole K w",  # bits of the contacts held
    counts="whole 6",  # moves tried: within, gain, lose; and those accepted
)
BITS = 60  # contacts in a word of a code
