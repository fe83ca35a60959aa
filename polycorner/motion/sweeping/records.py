"""Layouts of what the compiled steps of first-order motion are given.

Rows are inequalities and equations that hold at the end of a step.  Body after body there are the
``m`` gaps and equations of each with its surroundings and its ``L`` limits on velocities, and after
all bodies the ``p`` gaps of each pair of neighbours.
"""

from polycorner.formulas.tables import Layout

SYSTEM = Layout.of(
    bodies="whole",
    k="whole",  # coordinates of a body
    calls="whole * 7",  # gaps and equations
    reads="whole *",
    outputs="whole *",
    parameters="real *",
    inequalities="whole",
    m="whole",  # inequalities and equations
    limits="whole",
    limit_code="whole",  # addresses of kernels; zero where there is none
    flow_code="whole",
    mobility_code="whole",
    energy_calls="whole * 7",
    energy_reads="whole *",
    energy_outputs="whole *",
    energy_parameters="real *",
    mobility="real k k",
    metric="real k k",  # its inverse
    factor="real k k",  # and its lower triangular factor
    noise="real",
    seed="whole",
    always="flag m",  # rows of no union
    piece_of_union="whole *",  # where the pieces of each union begin
    row_of_piece="whole *",  # and the rows of each piece
    rows="whole *",
    pair_codes="whole 2",
    pair_gaps="whole",
    pair_reads="whole * 2",
    pair_parameters="real *",
    reach="real",
    position="whole 3",
    period="real 3",
    units="real k",
    exit_coordinate="whole",
    exit_limit="real",
    step="real",
    start="real",
    tolerance="real",  # of a programme, relative to the travel in a step
    rounding="real",
    sweeps="whole",
    zero="real",  # distances in scaled coordinates: of a gap that is zero,
    touching="real",  # of contacts that are made,
    parting="real",  # and that are lost
    shortest="real",  # part of a step
    detection="real",  # least room of the list of neighbours
)

# Forces of rows, and whether these touch, from one step to the next; of pairs those that act only.
STATE = Layout.of(
    q="real N k",
    alive="whole N",
    rests="whole N",
    force="real S",
    touches="whole S",
    since="real S",  # when the force vanished
    keys="whole C",
    pair_force="real C",
    pair_touches="whole C",
    pair_since="real C",
    counts="whole 8",
    sums="real 5",
)

WORK = Layout.of(
    owner="whole R 2",
    on="whole R",
    value="real R",
    trial="real R",
    before="real R",
    J="real R D",
    M="real R D",  # the mobility times the gradient
    size="real R",  # gradient times mobility times gradient
    norm="real R",  # length of the gradient
    shift="real R",
    force="real R",
    former="real R",
    touches="whole R",
    since="real R",
    listed="whole R",
    active="whole R",
    slope="real R",
    course="real R",
    change="real R",
    mobility="real N k k",
    metric="real N k k",
    factor="real N k k",
    u="real N k",
    flow="real N k",
    x="real N k",
    d="real N k",
    wish="real N k",
    step="real N k",
    former_q="real N k",  # what is put back where a step is not done
    former_sums="real 5",
    former_rests="whole N",
    listed_at="real N k",
    chosen="whole N *",
    forced="whole N *",
    pairs="whole P 2",
    order="whole N",
    along="real N",
    status="whole 4",  # pairs in the list, whether there is one, bodies that were split, and where
    room="real 4",  # of the list of neighbours; where a corner was met, as a part of the step
    # (the third is what contacts of hulls are told: gradients of all gaps are asked for)
    meeting="whole *",  # pieces that meet there
    buffer="real *",
    v="real N k",
)

LOG = Layout.of(entries="whole E 4", numbers="real E 2")

# Places in counts and sums.
STEPS, PROGRAMMES, SWEEPS, CORRECTIONS, UNSOLVED, PARTS, PAIRS = range(7)
DRAG, WISH, NOISE, PENETRATION, RESIDUAL = range(5)

# Why the steps stopped.
DONE, EVENTS_FULL, PAIRS_FULL, NOT_FINITE, SPLIT = range(5)

# Places in the status of the work.
LISTED, IS_LISTED, BODY, UNION = range(4)
ROOM, PART = range(2)

FAILED = 6  # the number of the kind of event, of a step that is not solved
