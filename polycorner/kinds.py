"""The kinds of values that annotations name, for fields of values and arguments of functions.

A kind is checked as far as it can be seen from outside: classes, numbers, truth values, words,
arrays, and what collections contain.  Whatever an annotation leaves open (``Any``, ``ArrayLike``,
iterables) is checked by the function itself.  A name that is known to a type checker only, such as
``sympy.Expr``, stands for every class of that name.
"""

import builtins
import os
import re
import sys
import types
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cache, wraps
from inspect import Parameter, get_annotations, signature
from itertools import islice
from numbers import Integral, Real
from pathlib import Path
from typing import Any, ForwardRef, Literal, NoReturn, TypeVar, Union, get_args, get_origin

import numpy as np

from polycorner.checks import is_array, listed, refuse
from polycorner.signatures import shown

F = TypeVar("F", bound=Callable[..., Any])
Test = Callable[[Any], bool]
LOOKED_AT = 64  # members of a collection that are checked, so that long ones stay cheap
OPEN = "anything"
IMPORTED = re.compile(r"^[ \t]*from ([\w.]+) import (\([^)]*\)|.*)", re.MULTILINE)
UNIONS = ("Energy", "Quantity")  # unions for a type checker; what takes them checks them
WORDS: Mapping[Any, tuple[str, Test]] = {
    bool: ("True or False", lambda value: isinstance(value, bool | np.bool_)),
    int: ("a whole number", lambda value: _is_number(value, Integral)),
    float: ("a number", lambda value: _is_number(value, Real)),
    str: ("text", lambda value: isinstance(value, str)),
    type(None): ("None", lambda value: value is None),
    os.PathLike: ("a path", lambda value: isinstance(value, os.PathLike)),
}
DTYPES = {np.float64: "fiu", np.int64: "iu", np.bool_: "b"}


@dataclass(frozen=True)
class Kind:
    """What is expected, in words, and the test of it; None where everything passes."""

    words: str
    test: Test | None
    by_class: bool = False  # then an error names the class that came instead

    def refuse(self, argument: str, value: object) -> NoReturn:
        """Raise TypeError for a value."""
        if not self.by_class:
            refuse(argument, self.words, value, TypeError)
        msg = f"{argument}: expected {self.words}; got {type(value).__name__}"
        raise TypeError(msg)

    def check(self, argument: str, value: object) -> None:
        """Raise TypeError unless a value is of this kind."""
        if self.test is not None and not self.test(value):
            self.refuse(argument, value)


def check_fields(value: Any) -> None:
    """Raise TypeError for a field of a dataclass that is not what its annotation says."""
    known: Any = type(value)  # mypy does not know that classes are hashable
    given = vars(value)
    for name, test, kind in _fields(known):
        if not test(given[name]):
            kind.refuse(name, given[name])


def checked(function: F) -> F:
    """Return a function that raises TypeError for arguments that are not what they should be.

    Examples
    --------
    >>> @checked
    ... def half(count: int) -> float:
    ...     return count / 2
    >>> half("4")
    Traceback (most recent call last):
    TypeError: count: expected a whole number; got '4'
    """

    @wraps(function)
    def call(*given: Any, **named: Any) -> Any:
        kinds = _kinds(function)
        for (name, kind), value in zip(kinds.items(), given, strict=False):
            if kind.test is not None and not kind.test(value):
                kind.refuse(name, value)
        for name, value in named.items():
            if name in kinds:
                kinds[name].check(name, value)
        return function(*given, **named)

    return shown(call)  # type: ignore[return-value] # a wrapper of the same signature


@cache
def _kinds(function: Callable[..., Any]) -> dict[str, Kind]:
    """Return the kinds of a function's arguments, when it is first called."""
    return {
        name: _or_list(kind_of(p.annotation, function.__module__))
        for name, p in signature(function).parameters.items()
        if p.kind not in (Parameter.VAR_POSITIONAL, Parameter.VAR_KEYWORD)
    }


def kind_of(annotation: Any, module: str) -> Kind:
    """Return the kind that an annotation in a module stands for."""
    if isinstance(annotation, ForwardRef):
        annotation = annotation.__forward_arg__
    if isinstance(annotation, str):
        # Text of the package's own source, as `inspect` evaluates it, where all names are known.
        annotation = eval(annotation, {}, _Names(vars(sys.modules[module])))
        return kind_of(annotation, module)
    if annotation is Parameter.empty:
        return Kind(OPEN, None)
    if annotation is None:
        annotation = type(None)
    if annotation in WORDS:
        return Kind(*WORDS[annotation])
    parts = get_args(annotation)
    origin = get_origin(annotation) or annotation
    if origin in (Union, types.UnionType):
        return _either([kind_of(part, module) for part in parts])
    if origin is Literal:
        return Kind(listed(map(repr, parts)), lambda v: isinstance(v, str))  # which word: `choice`
    if origin is np.ndarray:
        return _array(get_args(parts[1])[0] if len(parts) > 1 and get_args(parts[1]) else None)
    name = getattr(annotation, "__name__", "")
    if name == "Expr":  # numbers are expressions, too
        return _either([Kind("an expression", _named(name)), Kind(*WORDS[float])])
    if isinstance(annotation, _Stranger):
        return Kind(_a(name), _named(name), True)
    return _of_class(origin, parts, module)


def _named(name: str) -> Test:
    return lambda value: any(c.__name__ == name for c in type(value).__mro__)


def _or_list(kind: Kind) -> Kind:
    """Return the kind of an argument: lists are arrays, whose numbers the function checks."""
    test = kind.test
    if test is None or not kind.words.startswith("an array"):
        return kind
    return Kind(kind.words, lambda value: isinstance(value, list | tuple) or test(value))


def _of_class(origin: Any, parts: Sequence[Any], module: str) -> Kind:
    if origin is os.PathLike:
        return Kind(*WORDS[os.PathLike])
    if origin is Callable:
        return Kind("a function", callable)
    if getattr(origin, "_is_protocol", False) and origin.__module__ != "collections.abc":
        return Kind("a function", callable) if "__call__" in vars(origin) else _like(origin)
    if not isinstance(origin, type) or origin in (Any, object):
        return Kind(OPEN, None)
    if issubclass(origin, tuple) and parts:
        return _tuple([kind_of(p, module) for p in parts if p is not ...], ... in parts)
    if issubclass(origin, Mapping) and len(parts) == 2:
        return _mapping(origin, *(kind_of(p, module) for p in parts))
    if issubclass(origin, Collection) and len(parts) == 1:
        return _collection(origin, kind_of(parts[0], module))
    return Kind(_a(origin.__name__), lambda value: isinstance(value, origin), by_class=True)


def _like(protocol: type) -> Kind:
    names = [n for n in (*get_annotations(protocol), *vars(protocol)) if not n.startswith("_")]

    def fits(value: Any) -> bool:  # without computing properties
        own = getattr(value, "__dict__", ())
        return all(name in own or hasattr(type(value), name) for name in names)

    words = " and ".join(filter(None, (", ".join(names[:-1]), *names[-1:])))
    return Kind(f"something with {words}", fits, by_class=True)


def _either(kinds: Sequence[Kind]) -> Kind:
    tests = [kind.test for kind in kinds if kind.test is not None]
    if len(tests) < len(kinds):
        return Kind(OPEN, None)
    words = dict.fromkeys(kind.words for kind in kinds if kind.words != "None")
    classes = all(kind.by_class or kind.words == "None" for kind in kinds)

    def fits(value: Any) -> bool:
        for test in tests:  # noqa: SIM110 - a generator would take most of the time
            if test(value):
                return True
        return False

    return Kind(listed(words), fits, classes)


def _array(scalar: Any) -> Kind:
    kinds = DTYPES.get(scalar)
    words = {"fiu": "an array of numbers", "iu": "an array of whole numbers"}.get(
        kinds or "", "an array of truth values" if kinds else "an array"
    )
    return Kind(words, lambda v: is_array(v) and (kinds is None or v.dtype.kind in kinds))


def _tuple(kinds: Sequence[Kind], several: bool) -> Kind:
    if several:
        return _collection(tuple, kinds[0])
    tests = [kind.test for kind in kinds]

    def fits(value: Any) -> bool:
        return (
            (isinstance(value, tuple | list) or (_is_plain(value) and value.ndim == 1))
            and len(value) == len(tests)
            and all(test is None or test(v) for test, v in zip(tests, value, strict=True))
        )

    return Kind(f"({', '.join(kind.words for kind in kinds)})", fits)


def _collection(origin: type, kind: Kind) -> Kind:
    test, words = kind.test, _a(origin.__name__.lower())
    like: dict[type, Test] = {Sequence: _is_plain, tuple: lambda value: isinstance(value, list)}
    is_like = like.get(origin, lambda _: False)

    def fits(value: Any) -> bool:
        if isinstance(value, np.ndarray):
            if not _is_plain(value):
                return False
            if not len(value):  # what it would contain
                value = np.zeros((1, *value.shape[1:]), value.dtype)
        return (
            (isinstance(value, origin) or is_like(value))
            and not isinstance(value, str | bytes | Mapping)
            and (test is None or all(map(test, islice(value, LOOKED_AT))))
        )

    return Kind(words if kind.words == OPEN else f"{words}, each {kind.words}", fits)


def _mapping(origin: Any, key: Kind, value: Kind) -> Kind:
    def fits(given: Any) -> bool:
        return isinstance(given, origin) and all(
            (key.test is None or key.test(k)) and (value.test is None or value.test(v))
            for k, v in islice(given.items(), LOOKED_AT)
        )

    return Kind(f"a mapping from {key.words} to {value.words}", fits)


def _is_plain(value: Any) -> bool:
    return is_array(value) and value.ndim > 0 and value.dtype.kind in "biuf"


def _is_number(value: Any, kind: type) -> bool:
    if type(value) is float and kind is Real:  # nearly always
        return True
    if is_array(value) and value.ndim == 0:
        value = value[()]
    if isinstance(value, bool) or not isinstance(value, kind):
        return False
    try:
        float(value)  # type: ignore[arg-type] # of the kind that was asked for
    except OverflowError:
        return False
    return True


def _a(name: str) -> str:
    return f"{'an' if name[:1] in 'AEIOUaeiou' else 'a'} {name}"


@cache
def _fields(kind: Any) -> tuple[tuple[str, Test, Kind], ...]:
    owners = {
        name: base
        for base in reversed(kind.__mro__)
        for name in vars(base).get("__annotations__", ())
    }
    found = ((f.name, kind_of(f.type, owners[f.name].__module__)) for f in fields(kind))
    return tuple((name, k.test, k) for name, k in found if k.test is not None)


class _Stranger(type):
    """The class of stand-ins for classes that are known to a type checker only."""

    def __getattr__(cls, name: str) -> "_Stranger":
        if name.startswith("_"):
            raise AttributeError(name)
        return _Stranger(name, (), {})

    def __getitem__(cls, _: object) -> "_Stranger":
        return cls


class _Names(dict[str, Any]):
    """Names of a module, those for a type checker included; any other stands for a class."""

    def __missing__(self, name: str) -> Any:
        if name in UNIONS:
            return Any
        source = _imports(self["__file__"]).get(name)
        if source is not None and source.partition(".")[0] == "polycorner":
            # Another name for a type, such as a pair of numbers, is not that of a class.
            found = getattr(sys.modules.get(source), name, Any)
            return _Stranger(name, (), {}) if isinstance(found, type) else found
        return getattr(builtins, name, None) or sys.modules.get(name) or _Stranger(name, (), {})


@cache
def _imports(file: str) -> dict[str, str]:
    """Return the names that a module imports from others, and those, also for a type checker.

    They are read off its lines: to parse a whole module takes twenty times as long.
    """
    found = {}
    for source, names in IMPORTED.findall(Path(file).read_text(encoding="utf-8")):
        for one in re.sub(r"#.*|[()\s]+", " ", names).split(","):
            name, _, alias = one.strip().partition(" as ")
            found[alias.strip() or name] = source
    return found
