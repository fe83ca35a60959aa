"""The exceptions of the package, and suggestions for misspelt words.

Wrong use raises ``ValueError`` or ``TypeError`` at once; a numerical outcome is a
:class:`~polycorner.minimisation.verdicts.Verdict`.  The exceptions here are for the rest: a
numerical back end that fails.  A formula that the library can only partly judge is announced by a
warning when it is given.
"""

from collections.abc import Iterable
from typing import Any


class PolycornerError(Exception):
    """Root of the package's own exceptions."""


class SolverError(PolycornerError):
    """A numerical computation cannot go on; an error of a back end is chained as ``__cause__``.

    Attributes
    ----------
    state : State or None
        Of a simulation the state before the step that cannot be computed.
    """

    state: Any = None


class WorkersError(PolycornerError):
    """Workers that cannot be started, do not answer, or die again and again."""


class NonsmoothWarning(UserWarning):
    """A formula was given whose derivatives may jump: across a kink nothing is certified."""


def nearest(name: str, known: Iterable[str]) -> str:
    """Return a misspelt name with the known name closest to it, if any is close.

    Examples
    --------
    >>> nearest("lenght", ["length", "ball"]), nearest("colour", ["length", "ball"])
    ('lenght (did you mean length?)', 'colour')
    """
    from difflib import get_close_matches

    words = {word.lower(): word for word in known}
    close = get_close_matches(name.lower(), list(words), n=1)
    return f"{name} (did you mean {words[close[0]]}?)" if close else name
