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


# What people type who know another library, or another English.
USUAL = {
    "minimize": "minimise",
    "optimize": "minimise",
    "optimise": "minimise",
    "solve": "minimise",
    "disk": "bodies.disc",
    "Disk": "bodies.disc",
}


CLOSE = 0.7  # share of equal letters up to which a name is suggested


def not_here(name: str, known: Iterable[str]) -> str:
    """Return what to say of a name that the package does not have; empty for parts of it.

    The public names of a room are those in its stub, which is read, not imported.

    Examples
    --------
    >>> not_here("minimize", ["minimise"])
    "module 'polycorner' has no 'minimize': did you mean minimise?"
    >>> not_here("stationary_points", [])
    "module 'polycorner' has no 'stationary_points': it is in polycorner.proofs"
    """
    import ast
    from difflib import get_close_matches
    from pathlib import Path

    here = Path(__file__).parent
    if name.startswith("_") or (here / name).exists() or (here / f"{name}.py").exists():
        return ""
    homes: dict[str, str] = {}
    for stub in sorted(here.glob("*/__init__.pyi")):
        listed = ast.parse(stub.read_text(encoding="utf-8")).body[-1]
        public = ast.literal_eval(listed.value) if isinstance(listed, ast.Assign) else []
        homes |= {word: stub.parent.name for word in public if word not in homes}
    first = f"module 'polycorner' has no {name!r}"
    if name in homes:
        return f"{first}: it is in polycorner.{homes[name]}"
    words = {word.lower(): word for word in [*homes, *known]}
    close = [USUAL[name]] if name in USUAL else get_close_matches(name.lower(), [*words], 1, CLOSE)
    if not close:
        return first
    near = words.get(close[0], close[0])
    where = "" if near in known or near in USUAL.values() else f"polycorner.{homes[near]}."
    return f"{first}: did you mean {where}{near}?"
