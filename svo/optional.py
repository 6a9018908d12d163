"""Packages that only some uses need."""

from __future__ import annotations

from importlib import import_module
from typing import Any


def optional_import(module: str, extra: str, what: str) -> Any:
    """Import a module of a package that an extra of the distribution installs.

    Raises
    ------
    ImportError
        If it is not installed; the message says what needs it and how to get it.
    """
    try:
        return import_module(module)
    except ImportError as error:
        package = module.partition(".")[0]
        raise ImportError(
            f"{what} need {package}, which is not installed; install the extra: pip install 'svo-fdi[{extra}]'"
        ) from error
