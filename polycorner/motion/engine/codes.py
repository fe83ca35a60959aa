"""Codes by which threads agree on who does what."""

# Numbers by which threads agree on who does what, each in a cache line of its own: phase and next
# item; phase and number of items; items done; whether the call ends.
TICKET, LIMIT, ITEMS_DONE, STOP = 0, 8, 16, 24

# What the items of a phase are.  Bodies: they are evaluated, start from forces alone, are
# predicted, begin and end sweeps, their work is booked.  Pairs: small gaps are counted, and become
# contacts.  Contacts: their blocks are assembled, they are added to the list.  Islands: they are
# solved.  Strips: contacts are made compact, pressed as before, swept, judged; their work is added
# up; they become plastic, are remembered as such, and something between that and before.  Blocks:
# impulses are stored, events are observed.
EVALUATE, START, PREDICT, BEGIN, END, BOOK, COUNT_GAPS, DETECT, ASSEMBLE, ADD = range(10)
SOLVE, COMPACT, PRESS, SWEEP, JUDGE, STORE, OBSERVE, GAIN, COMPRESS, KEEP, MIX = range(10, 21)

# What threads are told of a phase.
KIND, STEP_INDEX, COUNT, SET_OFF, AGAIN, ISLAND = range(6)
LENGTH, TIME, SPEED, DISTANCE, SHARE = range(5)  # of the step; of an island; of contacts; to mix
