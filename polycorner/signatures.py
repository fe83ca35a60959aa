"""Signatures that `help` and notebooks show in words one reads: ``ArrayLike``, not what it is."""

from collections.abc import Callable
from inspect import Parameter, Signature, signature
from types import UnionType
from typing import Any, ForwardRef, Literal, TypeVar, Union, get_args, get_origin

import numpy as np
from numpy.typing import ArrayLike

F = TypeVar("F", bound=Callable[..., Any])

# Annotations, also as they are written, that are shown by a name; docstrings say what it means.
NAMES: dict[Any, str] = {"Mapping[str, sympy.Expr]": "Expressions"}


class Legible(str):
    """A text that is shown without quotation marks."""

    __slots__ = ()

    def __repr__(self) -> str:
        """Return the text."""
        return str(self)


class Shown:
    """The signature of a class, made when it is asked for; instances have none."""

    def __get__(self, instance: object, owner: Any = None) -> Signature:
        if instance is not None:
            msg = "__signature__"
            raise AttributeError(msg)
        found = readable(signature(owner.__init__))
        parameters = [*found.parameters.values()][1:]
        return found.replace(parameters=parameters, return_annotation=Legible(owner.__name__))


def shown(function: F) -> F:
    """Give a function a signature that one reads."""
    function.__signature__ = readable(signature(function))  # type: ignore[attr-defined]
    return function


def readable(given: Signature) -> Signature:
    """Return a signature with short names of types, and of functions that are defaults.

    Examples
    --------
    >>> def size(points: ArrayLike | None, *, kind: Literal["a", "b"] = "a") -> "list[float]": ...
    >>> readable(signature(size))
    <Signature (points: ArrayLike | None, *, kind: Literal['a', 'b'] = 'a') -> list[float]>
    """
    parameters = [
        p.replace(
            annotation=_annotation(p.annotation),
            default=Legible(p.default.__name__) if _is_function(p.default) else p.default,
        )
        for p in given.parameters.values()
    ]
    returned = _annotation(given.return_annotation)
    return given.replace(parameters=parameters, return_annotation=returned)


def _is_function(value: object) -> bool:
    return callable(value) and not isinstance(value, type) and hasattr(value, "__name__")


def _annotation(given: Any) -> Any:
    return given if given is Parameter.empty else Legible(written(given))


def written(annotation: Any) -> str:
    """Return an annotation in short."""
    if annotation in NAMES:
        return NAMES[annotation]
    if isinstance(annotation, ForwardRef):
        return annotation.__forward_arg__
    if isinstance(annotation, str):
        return annotation
    if annotation in (None, type(None), ...):
        return "..." if annotation is ... else "None"
    parts, origin = get_args(annotation), get_origin(annotation)
    if origin in (Union, UnionType):
        some, first = [*parts], []
        if set(get_args(ArrayLike)) <= set(parts):
            some, first = [a for a in parts if a not in get_args(ArrayLike)], ["ArrayLike"]
        return " | ".join([*first, *map(written, some)])
    if origin is np.ndarray:
        return "Array" if "float64" in str(parts) else "ndarray"
    if origin is Literal:
        return f"Literal[{', '.join(map(repr, parts))}]"
    name = getattr(origin or annotation, "__name__", str(annotation).rsplit(".", 1)[-1])
    if not parts or name == "Callable":
        return name
    return f"{name}[{', '.join(map(written, parts))}]"
