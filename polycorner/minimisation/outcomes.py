"""Outcome of a multi-start search: minima, their frequencies and estimates of completeness."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import overload

from polycorner.minimisation.abundance import Richness, richness
from polycorner.minimisation.certificate import Certificate
from polycorner.minimisation.verdicts import Verdict
from polycorner.printing import Printed, Sheet, listed, names, number, titled
from polycorner.spaces.manifold import Array
from polycorner.values import Checked, cached_property


@dataclass(frozen=True, eq=False, repr=False)
class Minima(Checked, Printed, Sequence[Certificate]):
    """The minima that a search found, as a sequence of certificates, the lowest first.

    Attributes
    ----------
    certificates : tuple of Certificate
        One for each minimum, or for each locus of minima.
    counts : tuple of int
        How many starts ended in each.
    points : tuple of (k, n) arrays
        Where each was found: one point, or for a locus a net of points, up to the symmetry.
    elsewhere : mapping from Verdict to int
        How many starts ended in no minimum, by the verdict on where they ended.
    others : tuple of Certificate
        The points among those, each once; failed descents are not listed.
    descents, starts : int
        Number of descents done, and number of starts.
    interrupted : bool
        Whether the search was interrupted: starts may be left, and loci not yet merged.
    modulo : bool
        Whether minima are counted up to a symmetry that was given.
    """

    certificates: tuple[Certificate, ...]
    counts: tuple[int, ...]
    points: tuple[Array, ...]
    elsewhere: Mapping[Verdict, int]
    others: tuple[Certificate, ...]
    descents: int
    starts: int
    interrupted: bool = False
    modulo: bool = False

    @overload
    def __getitem__(self, index: int) -> Certificate: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[Certificate, ...]: ...
    def __getitem__(self, index: int | slice) -> Certificate | tuple[Certificate, ...]:
        """Return one certificate, or several."""
        return self.certificates[index]

    def __len__(self) -> int:
        """Return the number of minima found."""
        return len(self.certificates)

    @cached_property
    def richness(self) -> Richness:
        """Estimate of the number of all minima, from how often each was found."""
        return richness(self.counts)

    @property
    def completeness(self) -> str:
        """Estimates for minima that were not found, and the assumptions behind them."""
        return " ".join(_statement(self))

    def __repr__(self) -> str:
        """Return the number of minima and the lowest energies in one line."""
        energies = ", ".join(f"{c.energy:.6g}" for c in self[:5])
        dots = ", ..." if len(self) > 5 else ""
        return f"Minima({len(self)} from {self.descents} starts; energies {energies}{dots})"

    def _sheet(self) -> Sheet:
        """Return a table, the lowest minimum first, with points of up to three coordinates."""
        head = ["energy", "starts", "(p, q, r)", "verdict", "active"]
        shown = bool(self) and len(self[0].point) <= 3
        if shown:
            manifold = self[0].problem.polyhedron.manifold
            head += map(titled, manifold.names, manifold.periods)
        rows = (
            (
                number(c.energy),
                str(count),
                "({}, {}, {})".format(*c.signature),
                c.verdict.name,
                names(c.active) or "-",
                *(number(x, 6) for x in c.point.tolist() if shown),
            )
            for c, count in zip(self, self.counts, strict=True)
        )
        columns = (0, 1, *range(5, len(head)))
        return Sheet("Minima", (listed("", head, rows, len(self), columns), self.completeness))


def _statement(found: Minima) -> Iterator[str]:
    cut = f" (interrupted, {found.starts - found.descents} left)" if found.interrupted else ""
    lost = sum(found.elsewhere.values())
    where = f"; {lost} ended in no minimum" if lost else ""
    minima = "1 minimum" if len(found) == 1 else f"{len(found)} minima"
    modulo = ", up to the symmetry," if found.modulo else ""
    starts = "1 start" if found.descents == 1 else f"{found.descents} starts"
    yield f"{minima}{modulo} from {starts}{cut}{where}."
    if not found:
        return
    r = found.richness
    low, high = r.interval
    yield (
        f"Estimated coverage {r.coverage:.2%} (Good-Turing); estimated number of minima "
        f"{r.estimate:.3g}, at 95 % between {low:.3g} and {high:.3g} (Chao, a lower bound)."
    )
    yield (
        "This assumes that the starts are independent draws from one distribution; a minimum "
        f"whose basin has a share of less than {r.overlooked:.2g} is missed with a probability of "
        "more than 5 %, and the estimates do not cover it."
    )
