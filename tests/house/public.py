"""What the faces of the packages offer: functions, classes and their public methods, by dotted name."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator
from importlib import import_module
from typing import Any

FACES = (
    "polytopes", "svo", "svo.plant", "svo.interval", "svo.faults", "svo.indices", "svo.residual_tests", "svo.baselines",
    "svo.functions", "svo.testing",
)  # fmt: skip


def exports() -> Iterator[tuple[str, Any]]:
    """Functions and classes of our own that a face lists."""
    for face in FACES:
        module = import_module(face)
        for name in module.__all__:
            found = getattr(module, name)
            if inspect.isclass(found) or inspect.isroutine(found):
                yield f"{face}.{name}", found


def callables() -> dict[str, tuple[Callable[..., Any], str]]:
    """Everything public that is called, with the docstrings that may name its arguments."""
    found = {}
    for name, item in exports():
        own = item.__doc__ or ""
        if not inspect.isclass(item):
            found[name] = item, own
            continue
        if not issubclass(item, BaseException) and not getattr(item, "_is_protocol", False):
            found[name] = item, own + (item.__init__.__doc__ or "")
        for method, value in inspect.getmembers(item, inspect.isroutine):
            if method.startswith("_") or not callable(value):
                continue
            if str(getattr(value, "__module__", "")).split(".")[0] in ("svo", "polytopes"):
                found[f"{name}.{method}"] = value, inspect.getdoc(value) or ""
    return found


def arguments(item: Callable[..., Any]) -> list[str]:
    """Names of what a call takes."""
    return [name for name in inspect.signature(item).parameters if name not in ("self", "cls")]
