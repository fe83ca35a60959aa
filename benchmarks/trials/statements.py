"""How a problem is written down: a function from symbols to formulas, with its data."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

Bound = float | None | Sequence[float | None]
# From the variables to the energy, the inequalities g >= 0 and the equations h = 0.
Formulas = Callable[..., tuple[Any, Sequence[Any], Sequence[Any]]]


@dataclass(frozen=True)
class Statement:
    """A problem's formulas and numbers; one bound for all variables, or one for each."""

    name: str
    formulas: Formulas
    start: Sequence[float]
    best: float
    lower: Bound
    upper: Bound


class Collection(list[Statement]):
    """Statements in the order in which they are written."""

    def add(
        self,
        start: Sequence[float],
        best: float,
        *,
        lower: Bound = None,
        upper: Bound = None,
    ) -> Callable[[Formulas], Formulas]:
        """Return a decorator that collects the formulas under their function's name."""

        def collect(formulas: Formulas) -> Formulas:
            name = formulas.__name__.upper()
            self.append(Statement(name, formulas, start, best, lower, upper))
            return formulas

        return collect
