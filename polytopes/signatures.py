"""Arguments that are given by name only, and calls that give them by position."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from inspect import Parameter, isclass, signature
from typing import Any, TypeVar

Item = TypeVar("Item", bound=Callable[..., Any])


def options_by_name(item: Item) -> Item:
    """Let a function, or a class, answer a call that gives its keyword-only arguments by position with their names.

    Raises
    ------
    TypeError
        When called so.
    """
    function: Callable[..., Any] = item.__init__ if isclass(item) else item
    every = [p for p in signature(function).parameters.values() if p.name != "self"]
    by_position = [p.name for p in every if p.kind is Parameter.POSITIONAL_OR_KEYWORD]
    options = ", ".join(f"{p.name}=..." for p in every if p.kind is Parameter.KEYWORD_ONLY)
    name = item.__name__ if isclass(item) else item.__qualname__
    bound = "self" in signature(function).parameters
    most = len(by_position) + bound

    @wraps(function)
    def checked(*args: Any, **kwargs: Any) -> Any:
        if len(args) > most:
            taken = ", ".join(given for given in by_position if given != "cls") or "nothing"
            called = f"{type(args[0]).__name__}.{item.__name__}" if bound and not isclass(item) else name
            raise TypeError(f"{called} takes {taken} by position; give the rest by name: {options}")
        return function(*args, **kwargs)

    if not isclass(item):
        return checked  # type: ignore[return-value]
    item.__init__ = checked  # type: ignore[method-assign]
    return item
