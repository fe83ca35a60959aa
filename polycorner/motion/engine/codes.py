"""Codes by which threads agree on who does what."""

# Numbers by which threads agree on who does what, each in a cache line of its own: phase and next
# item; phase and number of items; items done; whether the call ends.
TICKET, LIMIT, ITEMS_DONE, STOP = 0, 8, 16, 24

# What the items of a phase are: bodies to be evaluated, contacts whose blocks are assembled,
# islands to be solved; strips that are swept, in which bodies move apart, whose residual is asked
# for; blocks whose impulses are stored, contacts that are added to the list.
EVALUATE, ASSEMBLE, SOLVE, SWEEP, SEPARATE, JUDGE, STORE, ADD = range(8)

# What threads are told of a phase.
KIND, STEP_INDEX, COUNT, SET_OFF, AGAIN, BACKWARDS = range(6)
