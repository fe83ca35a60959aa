"""The two exceptions of the package.

Wrong use raises ``ValueError`` or ``TypeError`` at the door.  A numerical outcome is a
:class:`~polycorner.minima.certificate.Verdict`.  What is left is a back end that breaks.
"""


class PolycornerError(Exception):
    """Root of the package's own exceptions."""


class SolverError(PolycornerError):
    """A numerical back end stopped with an error of its own (chained as ``__cause__``)."""
