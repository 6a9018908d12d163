"""Places inside a MAT file, written as in MATLAB: what they hold, whichever version the file is of."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from itertools import islice
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

_TOKEN = re.compile(
    r"\.?(?P<field>[A-Za-z]\w*)|\((?P<element>\d+)\)|\{(?P<cell>\d+)\}|\((?P<row>\d+|:),(?P<column>\d+|:)\)"
)
_MOST = 40  # places that a message lists
_DEPTH = 8  # of structures in structures that are listed


class NoPlaceError(LookupError):
    """What is at a place that holds no numbers."""


class Node(Protocol):
    """A variable, or what a part of it holds."""

    @property
    def kind(self) -> str:
        """ "numbers", "a struct", "a cell array", "a text", or in words what else it is."""
        ...

    @property
    def shape(self) -> tuple[int, ...]:
        """As MATLAB's size."""
        ...

    def names(self) -> list[str]:
        """Of the fields of a struct."""
        ...

    def inner(self, element: int, name: str | None = None) -> Node:
        """A field of an element of a struct array, or the content of a cell; elements are counted from 0."""
        ...

    def array(self) -> NDArray[Any]:
        """Numbers in MATLAB's shape."""
        ...

    def text(self) -> str:
        """A text."""
        ...


def numbers_at(node: Node, place: str) -> NDArray[Any]:
    """The numbers at a place behind the name of a variable, such as ``.signals(1).values`` or ``(:,2)``.

    Raises
    ------
    NoPlaceError
        Saying what is there instead.
    """
    at, element, chosen = 0, None, None
    while at < len(place):
        token = _TOKEN.match(place, at)
        if token is None or chosen is not None:
            raise NoPlaceError(f"{place[at:]!r} is no place; expected one such as .signals(1).values, {{2}} or (:,1)")
        at = token.end()
        if token["field"]:
            node, element = _field(node, token["field"], element), None
        elif token["element"]:
            element = _within(node, int(token["element"]))
        elif token["cell"]:
            if node.kind != "a cell array":
                raise NoPlaceError(f"{token[0]} is no part of {_described(node)}")
            node = node.inner(_within(node, int(token["cell"])))
        else:
            chosen = token["row"], token["column"]
    if node.kind != "numbers":
        raise NoPlaceError(f"it is {_described(node)}, not numbers")
    if chosen is None:
        return node.array()
    try:
        return node.array()[tuple(slice(None) if c == ":" else int(c) - 1 for c in chosen)]
    except IndexError:
        raise NoPlaceError(f"({','.join(chosen)}) is no part of {_described(node)}") from None


def listed_places(variables: Iterable[tuple[str, Node]]) -> str:
    """Where numbers are, with their sizes and labels, for messages: single ones only where there are no others."""
    every = list(islice((place for name, node in variables for place in _places(name, node, 0)), 10 * _MOST))
    several = [place for place in every if "(1 x 1" not in place] or every
    return ", ".join(several[:_MOST]) or "no place"


def _places(name: str, node: Node, depth: int) -> Iterator[str]:
    if node.kind == "numbers":
        yield f"{name} ({_size(node)})"
    elif node.kind == "a struct" and depth < _DEPTH:
        count = int(np.prod(node.shape))
        for element in range(min(count, _MOST)):
            own = f"{name}({element + 1})" if count > 1 else name
            label = _label(node, element)
            for field in node.names():
                for place in _places(f"{own}.{field}", node.inner(element, field), depth + 1):
                    yield f"{place[:-1]}, {label!r:.60})" if label and field == "values" else place
    elif node.kind not in ("a text", "a cell array"):
        yield f"{name} ({node.kind})"


def _label(node: Node, element: int) -> str:
    """What Simulink calls the signal of a struct."""
    found = node.inner(element, "label") if "label" in node.names() else None
    return found.text() if found is not None and found.kind == "a text" else ""


def _field(node: Node, name: str, element: int | None) -> Node:
    if node.kind != "a struct":
        raise NoPlaceError(f"there is no field {name!r} in {_described(node)}")
    if name not in node.names():
        raise NoPlaceError(f"there is no field {name!r}; expected one of {', '.join(node.names())}")
    if element is None and int(np.prod(node.shape)) != 1:
        raise NoPlaceError(f"{name!r} is a field of {_size(node)} structs; expected the number of one, (1).{name}")
    return node.inner(element or 0, name)


def _within(node: Node, index: int) -> int:
    if not 1 <= index <= int(np.prod(node.shape)):
        raise NoPlaceError(f"there is no element {index} of {_described(node)}")
    return index - 1


def _described(node: Node) -> str:
    return f"{node.kind} ({_size(node)})"


def _size(node: Node) -> str:
    return " x ".join(map(str, node.shape))
