"""The files of measured mismatch bounds that ship with the plants: one table a noise set and observer."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from importlib.resources import files
from typing import TypeVar

Bounds = TypeVar("Bounds")
NAME = "bounds.toml"


def read(package: str, kind: type[Bounds]) -> dict[str, dict[str, Bounds]]:
    """The bounds of a package: noise set -> observer ("nominal" or a fault) -> bounds of a kind."""
    text = files(package).joinpath(NAME).read_text(encoding="utf-8")
    return {
        noise: {observer: kind(**values) for observer, values in observers.items()}
        for noise, observers in tomllib.loads(text).items()
    }


def to_text(head: str, bounds: Mapping[str, Mapping[str, Bounds]]) -> str:
    """The text of such a file, below a comment on what was measured and how."""
    lines = [head]
    for noise, observers in bounds.items():
        for observer, b in observers.items():
            lines += ["", f"[{noise}.{observer}]"]
            lines += [f"{name} = [{', '.join(f'{v:.3e}' for v in value)}]" for name, value in vars(b).items()]
    return "\n".join(lines) + "\n"
