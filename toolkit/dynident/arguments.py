"""Arguments of the public calls, held against what their signatures say, before anything is done.

`checked` stands above a public function or class; nothing else is to be kept in step. What is
welcome is wide: NumPy's scalars are numbers, anything iterable is a sequence, a path is a string
or a `Path`, and what takes a protocol takes any object with its methods. Arrays are checked where
they are used, which knows their shapes; so are words, which it can say more about.
"""

from __future__ import annotations

import builtins
import inspect
import os
import sys
import typing
from collections.abc import Callable, Iterable, Mapping
from functools import cached_property, wraps
from numbers import Integral, Real
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, TypeVar, Union, get_args, get_origin

from dynident.errors import ArgumentError
from dynident.tables import printable
from dynident.words import shortened

T = TypeVar("T", bound=Callable[..., Any])
_MOST_SHOWN = 60
"""Letters of a value that are shown."""
_PLAIN: dict[Any, tuple[type, str]] = {
    float: (Real, "a number"),
    int: (Integral, "a whole number"),
    str: (str, "a string"),
}


def checked(what: T) -> T:
    """Check the arguments of a function, or of a class when it is made, by their annotations.

    Parameters
    ----------
    what : the function, or the class, whose `__init__` is replaced.

    Returns
    -------
    What raises `ArgumentError`, which is a TypeError as well, where an argument is of another kind
    than its annotation, is missing, or is none of the function's.
    """
    if isinstance(what, type):
        what.__init__ = _checking_init(what)
        return what  # pyright: ignore[reportReturnType]
    call = _Call(what, what.__name__, (what,))

    @wraps(what)
    def run(*args: Any, **kwargs: Any) -> Any:
        call.check(args, kwargs)
        return what(*args, **kwargs)

    return run  # pyright: ignore[reportReturnType]


def _checking_init(kind: type) -> Callable[..., None]:
    init = kind.__init__
    call = _Call(init, kind.__name__, kind.__mro__[-2::-1])

    @wraps(init)
    def make(self: Any, *args: Any, **kwargs: Any) -> None:
        given = call.check((self, *args), kwargs)
        init(self, *args, **kwargs)
        call.check_words(given)  # of a wrong word the class itself may say more

    return make


class _Scope(dict):
    """Names that an annotation may use; those for type checkers alone stand for anything."""

    def __missing__(self, name: str) -> Any:
        return getattr(builtins, name, Any)


class _Call:
    """A function whose annotations are read when it is called first.

    Parameters
    ----------
    function : what is called.
    name : of it, or of its class, in messages.
    homes : where its annotations are written: itself, or its class after those it inherits from.
    """

    def __init__(self, function: Callable[..., Any], name: str, homes: tuple[Any, ...]) -> None:
        self._function = inspect.unwrap(function)
        self._name = name
        self._homes = homes

    @cached_property
    def _signature(self) -> inspect.Signature:
        return inspect.signature(self._function)

    @cached_property
    def _hints(self) -> dict[str, Any]:
        scope = _Scope()
        for home in self._homes:
            scope |= vars(sys.modules[home.__module__])
        return typing.get_type_hints(self._function, localns=scope)

    @cached_property
    def _admitted(self) -> dict[str, tuple[Any, ...]]:
        """Words that are admitted, by the name of the argument, of those that want words."""
        return {name: words for name, hint in self._hints.items() if (words := _words(hint))}

    def check(self, args: tuple[Any, ...], kwargs: dict[str, Any]) -> dict[str, Any]:
        """Refuse arguments of a wrong kind; return them by their names."""
        try:
            given = self._signature.bind(*args, **kwargs).arguments
        except TypeError as error:
            remedy = f"see help(dynident.{self._name})"
            raise ArgumentError(shortened(printable(str(error))), self._name, remedy) from None
        for name, value in given.items():
            hint = self._hints.get(name, Any)
            default = self._signature.parameters[name].default
            if value is not default and not _admits(hint, value):
                what = f"{name} {_shown(value)}"
                raise ArgumentError(what, self._name, f"give {_wanted(hint)}")
        return given

    def check_words(self, given: dict[str, Any]) -> None:
        """Refuse words that are not among those of their annotation."""
        for name, words in self._admitted.items():
            value = given.get(name)
            if isinstance(value, str) and value not in words:
                remedy = f"give {_wanted(self._hints[name])}"
                raise ArgumentError(f"{name} {_shown(value)}", self._name, remedy)


def _admits(hint: Any, value: Any) -> bool:
    origin, inner = get_origin(hint), get_args(hint)
    if origin in (Union, UnionType):
        return any(_admits(one, value) for one in inner)
    if origin is Annotated:
        return _admits(inner[0], value)
    if origin is Literal:
        # A wrong word among words is refused by who knows what each of them does.
        return isinstance(value, tuple({type(one) for one in inner}))
    if origin is type:
        return isinstance(value, type) and all(_is_class(value, one) for one in inner)
    if hint in (None, NoneType):
        return value is None
    if hint in _PLAIN:
        return _is_scalar(value, _PLAIN[hint][0])
    if hint is Path:
        return isinstance(value, str | os.PathLike)
    kind = origin or hint
    if kind is Callable:
        return callable(value)
    if not isinstance(kind, type) or kind in (Any, object) or kind.__module__ == "numpy":
        return True
    if issubclass(kind, Mapping):
        both = isinstance(value, Mapping) and len(inner) == 2
        return isinstance(value, Mapping) and (
            not both or all(_admits(inner[0], k) and _admits(inner[1], v) for k, v in value.items())
        )
    if issubclass(kind, Iterable) and inner:
        return _is_sequence(value, inner)
    if getattr(kind, "_is_protocol", False):
        methods = [k for k, v in vars(kind).items() if callable(v) and not k.startswith("_")]
        return not isinstance(value, type) and all(hasattr(value, one) for one in methods)
    return isinstance(value, kind)


def _words(hint: Any) -> tuple[Any, ...]:
    """All words that an annotation admits; none where it admits any."""
    inner = get_args(hint)
    if get_origin(hint) is Literal:
        return inner
    is_union = get_origin(hint) in (Union, UnionType) and not {str, Path, Any} & {*inner}
    return tuple(word for one in inner for word in _words(one)) if is_union else ()


def _is_class(value: type, bound: Any) -> bool:
    return not isinstance(bound, type) or issubclass(value, bound)


def _is_scalar(value: Any, kind: type) -> bool:
    """A number that is no truth value; of NumPy, also an array of no dimension."""
    if kind is not str and getattr(value, "shape", None) == () and hasattr(value, "item"):
        value = value.item()
    return isinstance(value, kind) and not isinstance(value, bool)


def _is_sequence(value: Any, inner: tuple[Any, ...]) -> bool:
    if isinstance(value, str | bytes | Mapping) or not isinstance(value, Iterable):
        return False
    if not isinstance(value, list | tuple):
        return True  # what can be gone through once only is left to who needs it
    kinds = [one for one in inner if one is not Ellipsis]
    # Of a fixed number of items, how many there are to be is for who needs them to say.
    each = kinds * len(value) if len(kinds) == 1 else kinds
    return all(_admits(hint, one) for hint, one in zip(each, value, strict=False))


def _shown(value: Any) -> str:
    """A short value as it is written, the kind of any other."""
    if value is None:
        return "is None"
    if isinstance(value, type):
        return f"is the class {value.__name__} itself"
    kind = type(value).__name__
    if isinstance(value, str | bytes):
        return f"= {printable(repr(value[:_MOST_SHOWN]))}"
    if isinstance(value, float) or (isinstance(value, int) and value.bit_length() < 200):
        return f"= {value!r}"
    if isinstance(value, list | tuple) and value:
        inner = sorted({type(one).__name__ for one in value[:100]})
        kind += f" of {', '.join(inner[:3])}"
    return f"is {_with_article(printable(kind))}"


def _with_article(name: str) -> str:
    return f"{'an' if name[:1] in 'AEIOaeio' else 'a'} {name}"


def _wanted(hint: Any) -> str:
    """What an annotation asks for, in words."""
    origin, inner = get_origin(hint), get_args(hint)
    if origin in (Union, UnionType):
        words = list(dict.fromkeys(_wanted(one) for one in inner))
        if "a path" in words and "a string" in words:
            words.remove("a string")
        return " or ".join(words)
    if origin is Annotated:
        return _wanted(inner[0])
    if origin is Literal:
        return " or ".join(repr(one) for one in inner)
    if origin is type:
        return f"a class of the kind {getattr(inner[0], '__name__', 'wanted')}"
    if hint in (None, NoneType):
        return "None"
    if hint in _PLAIN:
        return _PLAIN[hint][1]
    if hint is Path:
        return "a path"
    kind = origin or hint
    if kind is Callable:
        return "a function"
    name = getattr(kind, "__name__", "anything")
    if isinstance(kind, type) and issubclass(kind, Mapping):
        return (
            f"a dictionary with {_wanted(inner[-1])} under each name" if inner else "a dictionary"
        )
    if inner and isinstance(kind, type) and issubclass(kind, Iterable):
        return f"a list whose items are each {_wanted(inner[0])}"
    if getattr(kind, "_is_protocol", False):
        return f"an object with the methods of {name}"
    return _with_article(name)
