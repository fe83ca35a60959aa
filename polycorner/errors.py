"""The two exceptions of the package, and how its sentences name a misspelt word.

Wrong use raises ``ValueError`` or ``TypeError`` at the door.  A numerical outcome is a
:class:`~polycorner.minimisation.certificate.Verdict`.  What is left is a back end that breaks.
"""

from collections.abc import Iterable


class PolycornerError(Exception):
    """Root of the package's own exceptions."""


class SolverError(PolycornerError):
    """A numerical back end stopped with an error of its own (chained as ``__cause__``)."""


def nearest(name: str, known: Iterable[str]) -> str:
    """Return a misspelt name and the right one it is nearest to, if any is near.

    Examples
    --------
    >>> nearest("lenght", ["length", "ball"]), nearest("colour", ["length", "ball"])
    ('lenght (did you mean length?)', 'colour')
    """
    from difflib import get_close_matches

    close = get_close_matches(name.lower(), list(known), n=1)
    return f"{name} (did you mean {close[0]}?)" if close else name
