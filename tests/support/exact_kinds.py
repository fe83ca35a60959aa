"""Random problems of known answer, kind by kind, many of them on the edge of being minima."""

from fractions import Fraction

from exact_algebra import ZERO, null_space, reduced, whole
from exact_problems import Programme


class Draft:
    """A problem being drawn: a strict minimum at ``c`` on ``k`` contacts; a kind may spoil it."""

    def __init__(self, rng, least_n=1, least_k=0, free=0):
        self.rng = rng
        self.n = int(rng.integers(least_n, 4))
        self.k = max(least_k, int(rng.integers(0, self.n + 1 - free)))
        self.rows = self.independent()
        self.weights = [Fraction(int(rng.integers(1, 9)), 4) for _ in range(self.k)]
        self.form = self.positive_form()
        self.extra, self.offsets = [], [ZERO] * self.k
        self.more = {"minimum": True}

    def vector(self):
        while True:
            vector = tuple(Fraction(int(x)) for x in self.rng.integers(-3, 4, self.n))
            if any(vector):
                return vector

    def independent(self):
        while True:
            rows = [self.vector() for _ in range(self.k)]
            if len(reduced(rows)[1]) == self.k:
                return rows

    def faint(self):
        """Return a small number of either sign, some too small for doubles to tell from zero."""
        return Fraction(int(self.rng.choice([-1, 1])), 2 ** int(self.rng.integers(5, 64)))

    def dyadic(self, reach=16):
        return Fraction(int(self.rng.integers(-reach, reach + 1)), 8)

    def positive_form(self):
        """Return ``B diag B^T`` for a unimodular ``B`` and a positive diagonal."""
        n, rng = self.n, self.rng
        lower = [[Fraction(int(rng.integers(-2, 3))) * (i > j) + (i == j) for j in range(n)]
                 for i in range(n)]  # fmt: skip
        diagonal = [Fraction(int(rng.integers(1, 9)), 4) for _ in range(n)]
        columns = list(zip(diagonal, zip(*lower, strict=True), strict=True))
        return tuple(
            tuple(sum(c * v[i] * v[j] for c, v in columns) for j in range(n)) for i in range(n)
        )

    def bend(self, curvature):
        """Give the form a chosen curvature in one direction along the face."""
        v = whole(null_space(self.rows or [[ZERO] * self.n], self.n)[0])
        size = sum(x * x for x in v)
        # |v|^2 I - v v^T is annihilated by v and positive across it.
        self.form = tuple(
            tuple(size * (i == j) + (curvature - 1) * v[i] * v[j] for j in range(self.n))
            for i in range(self.n)
        )
        self.more["minimum"] = curvature > 0

    def finished(self, kind):
        rng, n = self.rng, self.n
        normals = [*self.rows, *self.extra]
        held = list(zip(self.weights, normals, strict=False))
        slope = tuple(sum((w * row[i] for w, row in held), ZERO) for i in range(n))
        offsets = list(self.offsets)
        if "invariant" not in self.more and (rng.integers(2) or not normals):
            normals, offsets = [*normals, self.vector()], [*offsets, Fraction(-3)]
        return Programme(
            kind, self.form, slope, tuple(normals), tuple(offsets),
            tuple(self.dyadic(8) for _ in range(n)), self.bends(),
            scales=tuple(rng.choice([0.25, 1.0, 3.0], n).tolist()), **self.more,
        )  # fmt: skip

    def bends(self):
        straight, rng = (ZERO,) * self.n, self.rng
        if not rng.integers(3):
            return straight, straight, straight

        def drawn(low, high, part):
            return tuple(Fraction(int(rng.integers(low, high)), part) for _ in range(self.n))

        return drawn(0, 3, 4), drawn(0, 3, 2), drawn(-2, 3, 4)


def _minimum(rng):
    return Draft(rng)


def _saddle(rng):
    draft = Draft(rng, least_n=2, free=1)
    draft.bend(-Fraction(int(rng.integers(1, 5)), 2))
    return draft


def _pulling_contact(rng):
    draft = Draft(rng, least_k=1)
    draft.weights[int(rng.integers(draft.k))] *= -1
    draft.more["minimum"] = False
    return draft


def _weak_contact(rng):
    draft = Draft(rng, least_k=1)
    draft.weights[int(rng.integers(draft.k))] = ZERO
    draft.more["minimum"] = False
    return draft


def _faint_multiplier(rng):
    draft = Draft(rng, least_k=1)
    draft.weights[0] = draft.faint()
    draft.more["minimum"] = draft.weights[0] > 0
    return draft


def _faint_curvature(rng):
    draft = Draft(rng, least_n=2, free=1)
    draft.bend(draft.faint())
    return draft


def _nearly_dependent(rng):
    draft = Draft(rng, least_n=2, least_k=1, free=1)
    size, nudge = draft.faint(), draft.vector()
    draft.extra = [tuple(a + size * b for a, b in zip(draft.rows[0], nudge, strict=True))]
    draft.offsets.append(rng.choice([ZERO, draft.faint()]))
    if draft.k == 1 and rng.integers(2):
        draft.weights.append(Fraction(int(rng.choice([-1, 1]))))
    draft.more["minimum"] = False  # perhaps: the oracle knows
    return draft


def _dependent(rng):
    draft = Draft(rng, least_n=2, least_k=1, free=1)
    draft.extra = [tuple(int(rng.integers(1, 3)) * a for a in draft.rows[0])]
    draft.offsets.append(rng.choice([ZERO, draft.faint()]))
    draft.more["minimum"] = False
    return draft


def _gap_nearly_closed(rng):
    draft = Draft(rng)
    draft.extra = [draft.vector()]
    draft.offsets.append(draft.faint())
    draft.more["minimum"] = draft.offsets[-1] < 0
    return draft


def _flat(rng):
    draft = Draft(rng, least_n=2, free=1)
    draft.bend(ZERO)
    return draft


def _locus(rng):
    """Nothing changes along one rational direction."""
    draft = Draft(rng, least_n=2)
    v = draft.vector()
    across = [whole(w) for w in null_space([v], draft.n)]
    draft.form = tuple(
        tuple(sum(w[i] * w[j] for w in across) for j in range(draft.n)) for i in range(draft.n)
    )
    draft.rows, draft.offsets = [across[int(rng.integers(len(across)))]], [ZERO]
    draft.weights = [Fraction(int(rng.choice([1, 1, -1])))]
    draft.more = {"minimum": False, "invariant": v}
    return draft


def _union(rng):
    """Another branch for one contact: far, nearly closed, nearly open, open, or just met."""
    draft = Draft(rng)
    gaps = [Fraction(2), abs(draft.faint()), -abs(draft.faint()), Fraction(-2), ZERO]
    draft.extra, gap = [draft.vector()], gaps[rng.integers(5)]
    draft.offsets.append(gap)
    draft.more = {"minimum": gap > 0 if draft.k else gap < 0}
    draft.more["groups"] = ((0, draft.k),) if draft.k else ()
    return draft


def _beyond_second_order(rng):
    draft = Draft(rng, free=1)
    draft.bend(ZERO)
    draft.more[str(rng.choice(["third", "fourth"]))] = draft.dyadic()
    return draft


def _kink(rng):
    """The energy has a kink beside the minimum, or in it."""
    draft = Draft(rng)
    edge = [ZERO, draft.faint(), draft.dyadic()][rng.integers(3)]
    draft.more = {"kink": draft.dyadic(), "edge": edge, "minimum": edge > 0}
    return draft


KINDS = {
    "minimum": _minimum,
    "saddle": _saddle,
    "pulling contact": _pulling_contact,
    "weak contact": _weak_contact,
    "faint multiplier": _faint_multiplier,
    "faint curvature": _faint_curvature,
    "nearly dependent": _nearly_dependent,
    "dependent": _dependent,
    "gap nearly closed": _gap_nearly_closed,
    "flat": _flat,
    "locus": _locus,
    "union": _union,
    "beyond second order": _beyond_second_order,
    "kink": _kink,
}


def programme(kind, rng):
    """Return a random problem of one kind whose numbers floating point carries exactly."""
    while True:
        found = KINDS[kind](rng).finished(kind)
        rows = (*found.form, *found.normals, found.slope, found.offsets, found.centre)
        if all(Fraction(float(x)) == x for row in rows for x in row):
            return found


def departures(rng, n):
    """Return a displacement of the start: none, rounding, or small."""
    size = float(rng.choice([0.0, 0.0, 1e-13, 1e-13, 1e-10, 1e-7, 1e-4]))
    return size * rng.standard_normal(n)
