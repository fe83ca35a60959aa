"""The signature by which long work reports progress."""

from typing import Protocol


class Progress(Protocol):
    """A callable that is told how far a piece of work has come."""

    def __call__(self, done: float, total: float | None, note: str, /) -> object:
        """Take a report.

        Parameters
        ----------
        done : float
            What is done, in the unit of the work (seconds simulated, points, edges).
        total : float or None
            What there is to do; None where it is not known.
        note : str
            A few words on what is under way; may be empty.
        """


def silent(done: float, total: float | None, note: str, /) -> None:
    """Take a report and do nothing: the default where nobody watches."""
