"""Sizes on which the shapes of the engine's arrays depend."""

from typing import NamedTuple

from polycorner.motion.bodies import IdenticalBodies

WIDTH = 4  # reals in a vector
MOST_ENTRIES = 48  # of a body above the diagonal of the matrix, on average, at most
AT_ONCE = 256  # bodies, pairs, contacts or blocks that a thread does at once
MOST_STRIPS = 128  # into which a crowd is divided, at most
EVENTS = 4096  # events after which no step begins before the engine returns


class Sizes(NamedTuple):
    """Sizes on which the shapes depend."""

    N: int  # bodies
    k: int  # coordinates of a body
    K: int  # the same, rounded up to whole vectors
    F: int  # friction contacts of a body with its surroundings
    R: int  # rows of their slip velocities
    L: int  # known loads of a body, at least 1
    m: int  # gaps between a body and its surroundings
    G: int  # gaps between two bodies
    H: int  # laws of friction at each of these
    T: int  # rows of their slip velocities
    Y: int  # gaps of a body or of two, whichever are more
    D: int  # causes of dissipation
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

    @classmethod
    def of(cls, bodies: IdenticalBodies, contacts: int) -> "Sizes":
        """Return the sizes of bodies with room for so many contacts between them."""
        body, N, k = bodies.body, bodies.count, bodies.dimension
        F, m, R = len(body.friction), len(body.contacts), sum(c.rows for c in body.friction)
        families = [body.formulation.forces]
        laws = () if bodies.contacts is None else bodies.contacts.laws
        if bodies.contacts is not None:
            families += [bodies.contacts.gaps, *(slip for slip, _, _ in bodies.contacts.slips)]
        shapes = [(len(f.names), len(f.variables)) for f in families]
        calls = [*body.gaps, *body.formulation.slip_calls]
        shapes += [(len(call.family.names), len(call.reads)) for call in calls]
        kernels = [m * (1 + k) + k for m, k in shapes]
        lanes = -(-k // WIDTH) * WIDTH
        pairs = min(N * (N - 1) // 2, 8 * contacts) if N > 1 else 0
        entries = N * min(N - 1, MOST_ENTRIES)
        blocks = N * (F + m) + (1 + len(laws)) * contacts
        return cls(
            N=N,
            k=k,
            K=lanes,
            F=F,
            R=R,
            L=max(1, body.formulation.loads),
            m=m,
            G=len(bodies.pair_contacts),
            H=len(laws),
            T=sum(law.rows for law in laws),
            Y=max(m, len(bodies.pair_contacts)),
            D=len(bodies.causes),
            C=contacts,
            P=pairs,
            B=blocks,
            E=EVENTS + 2 * contacts + N * (3 + m),
            S=max(contacts, pairs, 1),
            W=max(kernels) + 16,
            Q=entries,
            M=(N + 2 * entries) * lanes * lanes,
            Z=MOST_STRIPS,
            V=max(N, pairs, blocks) // AT_ONCE + 1,
        )
