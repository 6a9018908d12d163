"""A plugin of pytest that gives one constant of a module another value: ``MUTATE=module:NAME=value``.

The module is imported before any test, so whatever imports the constant from it gets the new value too.
"""

from __future__ import annotations

import os
from importlib import import_module

VARIABLE = "MUTATE"


def pytest_configure() -> None:
    where, _, value = os.environ[VARIABLE].partition("=")
    module, _, name = where.partition(":")
    loaded = import_module(module)
    if not hasattr(loaded, name):
        raise AttributeError(f"{module} has no constant {name}")
    setattr(loaded, name, type(getattr(loaded, name))(float(value)))
