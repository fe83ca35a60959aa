"""Sizes on which the shapes of the engine's arrays depend."""

from typing import NamedTuple

from polycorner.motion.bodies import MovingBodies

WIDTH = 4  # reals in a vector
MOST_ENTRIES = 48  # of a body above the diagonal of the matrix, on average, at most
AT_ONCE = 256  # bodies, pairs, contacts or blocks that a thread does at once
MOST_STRIPS = 128  # into which a crowd is divided, at most
EVENTS = 4096  # events after which no step begins before the engine returns


class Sizes(NamedTuple):
    """Sizes on which the shapes depend."""

    N: int  # bodies
    A: int  # kinds of bodies
    k: int  # coordinates of a body, of the kind that has most of them
    K: int  # the same, and the time if equations have it, rounded up to whole vectors
    F: int  # friction contacts of all bodies with their surroundings
    R: int  # rows of their slip velocities
    L: int  # known loads of a body, at least 1
    U: int  # gaps between bodies and their surroundings, of all bodies
    m: int  # those of a body, at most
    J: int  # families of contacts between two bodies
    G: int  # gaps between two bodies, at most
    H: int  # laws of friction of all families
    T: int  # rows of the slip velocities of a family, at most
    Y: int  # gaps of a body, of two, or of a tie, whichever are most
    D: int  # causes of dissipation, then limits on velocities by name, then attraction
    C: int  # contacts between bodies for which there is room
    P: int  # pairs of neighbours for which there is room
    B: int  # blocks
    E: int  # events: those, and as many as one step can have
    S: int  # keys to be sorted
    W: int  # numbers that go in and come out of a kernel
    Q: int  # entries of the matrix above the diagonal: pairs of bodies
    M: int  # numbers in the matrix
    Z: int  # strips
    V: int  # items of a phase
    TJ: int  # ties
    TU: int  # their limits and equations
    TX: int  # their friction contacts
    RC: int  # equations of a closed component, times its coordinates
    LU: int  # limits on velocities of all bodies, and their nonholonomic equations

    @classmethod
    def of(cls, bodies: MovingBodies, contacts: int) -> "Sizes":
        """Return the sizes of bodies with room for so many contacts between them."""
        kinds, families = bodies.kinds, [*bodies.families.values()]
        N, k, F = bodies.total, bodies.width, bodies.frictions
        own = sum(kind.count * len(kind.body.contacts) for kind in kinds)
        called = [kind.body.formulation.forces for kind in kinds]
        for family in families:
            called += [family.gaps, *(slip for slip, _, _ in family.slips)]
        ties = bodies.ties
        called += [f for form in ties.forms for f in (form.rows, form.slips, form.forces) if f]
        shapes = [(len(f.names), len(f.variables)) for f in called]
        calls = [c for a in kinds for c in (*a.body.gaps, *a.body.formulation.slip_calls)]
        shapes += [(len(call.family.names), len(call.reads)) for call in calls]
        kernels = [m * (1 + k) + k for m, k in shapes]
        sides = [(len(a.body.limit_names), 2 * a.dimension + 1) for a in kinds]
        kernels += [m * (1 + k + k * k) + k for m, k in sides]
        lanes = -(-(k + any(kind.body.timed for kind in kinds)) // WIDTH) * WIDTH
        pairs = min(N * (N - 1) // 2, 8 * contacts) if N > 1 else 0
        entries = N * min(N - 1, MOST_ENTRIES)
        laws = max((len(family.laws) for family in families), default=0)
        rows, slips = len(ties.names), len(ties.friction)
        limits = sum(kind.count * len(kind.body.limit_names) for kind in kinds)
        blocks = F + own + (1 + laws) * contacts + rows + slips + limits
        gaps = max((len(family.gaps.names) for family in families), default=0)
        most = max(len(kind.body.contacts) for kind in kinds)
        return cls(
            N=N,
            A=len(kinds),
            k=k,
            K=lanes,
            F=F,
            R=sum(a.count * sum(c.rows for c in a.body.friction) for a in kinds),
            L=max(1, *(kind.body.formulation.loads for kind in kinds)),
            U=own,
            m=most,
            J=len(families),
            G=gaps,
            H=sum(len(family.laws) for family in families),
            T=max((sum(law.rows for law in family.laws) for family in families), default=0),
            Y=max(most, gaps, ties.most_rows),
            D=len(bodies.causes) + len(bodies.limit_names) + bodies.attracts,
            C=contacts,
            P=pairs,
            B=blocks,
            E=EVENTS + 2 * contacts + 3 * N + own + rows + limits,
            S=max(contacts, pairs, 1),
            W=max(kernels) + 16,
            Q=entries,
            M=(N + 2 * entries) * lanes * lanes,
            Z=MOST_STRIPS,
            V=max(N, pairs, blocks) // AT_ONCE + 1,
            TJ=len(ties.bodies),
            TU=rows,
            TX=slips,
            RC=ties.closed_room(k, max(kind.body.equations for kind in kinds)),
            LU=limits,
        )
