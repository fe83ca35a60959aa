"""Guards for arguments: one line a check, one sentence an error.

Every error names the argument, says what was expected and shows what came.  A value of the wrong
kind raises ``TypeError``, one of the right kind that is out of range ``ValueError``.
"""

import math
import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from numbers import Integral, Real
from typing import Any, NoReturn, TypeVar

import numpy as np
from numpy.typing import NDArray

from polycorner.errors import nearest

T = TypeVar("T")
MOST = 2**63 - 1  # the largest whole number of compiled code
LONGEST_VALUE, LONGEST_REASON = 500, 300  # characters of a value, and of what is wrong, in errors


def refuse(
    argument: str, expected: str, got: object, kind: type[Exception] = ValueError
) -> NoReturn:
    """Raise an error that names the argument, what was expected and what came."""
    try:
        shown = " ".join(line.strip() for line in repr(got).splitlines())  # arrays have several
    except ValueError:  # of integers of thousands of digits, which Python does not write out
        shown = "a number that is too long to be shown"
    msg = f"{argument}: expected {expected}; got {shortened(shown)}"
    raise kind(msg)


def shortened(text: str, most: int = LONGEST_VALUE) -> str:
    """Return a text, or its beginning where it is too long."""
    return text if len(text) <= most else f"{text[: most - 3]}..."


@contextmanager
def about(argument: str) -> Iterator[None]:
    """Name an argument in the errors of its parts, which know their own names only.

    Examples
    --------
    >>> with about("parts"):
    ...     instance("f1", 3, str)
    Traceback (most recent call last):
    TypeError: parts: f1: expected a str; got int
    """
    try:
        yield
    except (TypeError, ValueError) as error:
        if str(error).startswith(f"{argument}:"):
            raise
        kind = TypeError if isinstance(error, TypeError) else ValueError
        msg = f"{argument}: {error}"
        raise kind(msg) from error


def instance(argument: str, value: object, kind: type[T], hint: str = "") -> T:
    """Return a value of a class, or raise TypeError.

    Parameters
    ----------
    argument : str
        Name of the argument.
    value : object
    kind : type
    hint : str, optional
        How such a value is made, added to the error.

    Examples
    --------
    >>> instance("name", 3, str)
    Traceback (most recent call last):
    TypeError: name: expected a str; got int
    """
    if not isinstance(value, kind):
        article = "an" if kind.__name__[0] in "AEIOUaeiou" else "a"
        made = f", as {hint} makes" if hint else ""
        msg = f"{argument}: expected {article} {kind.__name__}{made}; got {type(value).__name__}"
        raise TypeError(msg)
    return value


def whole(
    argument: str, value: object, *, least: int | None = None, most: int | None = None
) -> int:
    """Return a whole number in a range, or raise.

    Examples
    --------
    >>> whole("count", 0, least=1)
    Traceback (most recent call last):
    ValueError: count: expected a whole number >= 1; got 0
    """
    kind: type[Exception] = ValueError
    if isinstance(value, bool) or not isinstance(value, int | Integral):  # the first is faster
        kind = TypeError
    else:
        number = int(value)
        if (least is None or number >= least) and (most is None or number <= most):
            return number
    bounds = _bounds((">=", least), ("<=", None if most == MOST else most))
    refuse(argument, f"a whole number{bounds}", value, kind)


def real(
    argument: str,
    value: object,
    *,
    above: float | None = None,
    least: float | None = None,
    below: float | None = None,
    most: float | None = None,
    infinite: bool = False,
    unit: str = "",
) -> float:
    """Return a real number in a range as a float, or raise.

    Parameters
    ----------
    argument : str
        Name of the argument.
    value : object
        NaN is always refused.
    above, below : float, optional
        Open ends of the range.
    least, most : float, optional
        Closed ends.
    infinite : bool, optional
        Whether an infinity may pass.
    unit : str, optional
        Unit named in the error.

    Examples
    --------
    >>> real("restitution", 0.5, least=0, most=1)
    0.5
    >>> real("dt", -1.0, above=0, unit="s")
    Traceback (most recent call last):
    ValueError: dt: expected a number > 0 in s; got -1.0
    """
    number, known = _as_double(value)
    inside = (
        (above is None or number > above)
        and (least is None or number >= least)
        and (below is None or number < below)
        and (most is None or number <= most)
        and (infinite or math.isfinite(number))
    )
    if inside and not math.isnan(number):
        return number
    bounds = _bounds((">", above), (">=", least), ("<", below), ("<=", most))  # for the error alone
    expected = f"a {'' if infinite or bounds else 'finite '}number{bounds}{unit and f' in {unit}'}"
    if isinstance(value, bool) or not isinstance(value, Real):
        refuse(argument, expected, value, TypeError)
    if not known:
        refuse(argument, f"{expected} in the range of doubles", value)
    if math.isinf(number) and most is None and below is None:
        refuse(argument, expected.replace("a number", "a finite number"), value)
    refuse(argument, expected, value)


def _as_double(value: object) -> tuple[float, bool]:
    """Return a real number as a double, NaN for what is none, and whether it is in its range."""
    if type(value) is float:  # nearly always
        return value, True
    try:
        number = isinstance(value, Real) and not isinstance(value, bool)
        return (float(value) if number else math.nan), True  # type: ignore[arg-type] # a Real
    except OverflowError:
        return math.nan, False


def flag(argument: str, value: object) -> bool:
    """Return a truth value, or raise TypeError: words and numbers are none.

    Examples
    --------
    >>> flag("resume", "False")
    Traceback (most recent call last):
    TypeError: resume: expected True or False; got 'False'
    """
    if not isinstance(value, bool | np.bool_):
        refuse(argument, "True or False", value, TypeError)
    return bool(value)


def is_array(value: object) -> bool:
    """Whether a value is an array, none of whose entries are masked."""
    return isinstance(value, np.ndarray) and not isinstance(value, np.ma.MaskedArray)


def reals(argument: str, value: Any) -> NDArray[np.float64]:
    """Return an array of real numbers, or raise; one of float64 is returned as it is.

    Complex numbers, text, dates, records and truth values are no real numbers, and a mask would
    be lost.

    Examples
    --------
    >>> reals("q", [1.0, 2.0 + 1.0j])
    Traceback (most recent call last):
    TypeError: q: expected real numbers; got dtype complex128
    """
    if type(value) is np.ndarray and value.dtype == np.float64:
        return value
    parts = value if isinstance(value, list | tuple) else (value,)
    if any(isinstance(part, np.ma.MaskedArray) for part in parts):
        msg = f"{argument}: expected real numbers; got a masked array"
        raise TypeError(msg)
    try:
        array = np.asarray(value)
    except ValueError as error:
        msg = f"{argument}: expected a rectangular array of real numbers; got ragged nesting"
        raise ValueError(msg) from error
    exact = array.dtype.kind == "O" and all(
        isinstance(x, Real) and not isinstance(x, bool) for x in array.flat
    )
    if array.dtype.kind not in "iuf" and not exact:
        msg = f"{argument}: expected real numbers; got dtype {array.dtype}"
        raise TypeError(msg)
    try:
        return array.astype(np.float64)
    except OverflowError:
        refuse(argument, "real numbers that a float can hold", value)


def numbers(argument: str, value: object, expected: str) -> NDArray[np.float64]:
    """Return a new array of numbers, or raise.

    Examples
    --------
    >>> numbers("radii", "ab", "at least two positive numbers")
    Traceback (most recent call last):
    TypeError: radii: expected at least two positive numbers; got 'ab'
    """
    try:
        return np.array(reals(argument, value))
    except (TypeError, ValueError):
        refuse(argument, expected, value, TypeError)


def increasing(
    argument: str,
    values: object,
    *,
    above: float | None = None,
    least: float | None = None,
    below: float | None = None,
) -> "NDArray[np.float64]":
    """Return increasing numbers of a range as an array ``(k,)``, ``k >= 1``, or raise.

    Examples
    --------
    >>> increasing("rods", [0.5, 0.2], above=0, below=1)
    Traceback (most recent call last):
    ValueError: rods: expected increasing numbers > 0 and < 1; got [0.5, 0.2]
    """
    bounds = _bounds((">", above), (">=", least), ("<", below))
    array = np.atleast_1d(numbers(argument, values, f"increasing numbers{bounds}"))
    inside = (
        array.ndim == 1
        and array.size > 0
        and np.isfinite(array).all()
        and (np.diff(array) > 0).all()
        and (above is None or array[0] > above)
        and (least is None or array[0] >= least)
        and (below is None or array[-1] < below)
    )
    if not inside:
        refuse(argument, f"increasing numbers{bounds}", values)
    return array


def choice(argument: str, value: object, known: Iterable[str]) -> str:
    """Return one of the known words, or raise with the nearest one.

    Examples
    --------
    >>> choice("method", "slqsp", ["descent", "scp", "slsqp"])
    Traceback (most recent call last):
    ValueError: method: expected 'descent', 'scp' or 'slsqp'; got 'slqsp' (did you mean slsqp?)
    """
    words = list(known)
    expected = listed(map(repr, words))
    if not isinstance(value, str):
        refuse(argument, expected, value, TypeError)
    if value not in words:
        near = nearest(value, words).removeprefix(value)
        msg = f"{argument}: expected {expected}; got {value!r}{near}"
        raise ValueError(msg)
    return value


def names(argument: str, given: Iterable[str], known: Iterable[str]) -> None:
    """Raise for the first given name that is not known, or for anything but a few names."""
    words = list(known)
    if isinstance(given, str | bytes) or not isinstance(given, Iterable):
        refuse(argument, f"names among {', '.join(words) or 'none'}", given, TypeError)
    for name in given:
        if not isinstance(name, str) or name not in words:
            shown = nearest(name, words) if isinstance(name, str) else repr(name)
            msg = f"{argument}: expected names among {', '.join(words) or 'none'}; got {shown}"
            raise ValueError(msg)


def mapping(argument: str, value: object) -> Mapping[Any, Any]:
    """Return a mapping, or raise TypeError."""
    if not isinstance(value, Mapping):
        refuse(argument, "a mapping", value, TypeError)
    return value


def fits(argument: str, size: float, what: str) -> None:
    """Raise ValueError if so many bytes do not fit into the memory of this machine."""
    if "SC_PHYS_PAGES" in getattr(os, "sysconf_names", ()):  # not on every system
        memory = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
        if size > memory:
            expected = f"what fits into the memory of this machine, {memory / 1e9:.3g} GB"
            msg = f"{argument}: expected {expected}; {what} would take {size / 1e9:.3g} GB"
            raise ValueError(msg)


def generator(argument: str, value: object) -> "np.random.Generator":
    """Return a random generator: a given one, or a new one for None or a seed.

    Examples
    --------
    >>> generator("rng", "dice")
    Traceback (most recent call last):
    TypeError: rng: expected a numpy.random.Generator, a seed or None; got 'dice'
    """
    if isinstance(value, np.random.Generator):
        return value
    if value is None:
        return np.random.default_rng(0)
    if isinstance(value, bool) or not isinstance(value, Integral):
        refuse(argument, "a numpy.random.Generator, a seed or None", value, TypeError)
    return np.random.default_rng(whole(argument, value, least=0))


def missing_extra(package: str, extra: str) -> ImportError:
    """Return the error that names the extra which installs a package.

    The command works for an installed package; in a checkout ``.`` takes the package's place.
    """
    return ImportError(
        f"{package} is not installed; expected the extra {extra!r}, as installed by "
        f"pip install 'polycorner[{extra}]' (in a checkout: pip install '.[{extra}]')"
    )


def listed(words: Iterable[str]) -> str:
    """Return words as a list in a sentence.

    Examples
    --------
    >>> listed(["a", "b", "c"])
    'a, b or c'
    """
    *first, last = list(words) or ["nothing"]
    return f"{', '.join(first)} or {last}" if first else last


def _bounds(*limits: tuple[str, float | None]) -> str:
    shown = [
        f"{sign} {value:g}" for sign, value in limits if value is not None and math.isfinite(value)
    ]
    return f" {' and '.join(shown)}" if shown else ""
