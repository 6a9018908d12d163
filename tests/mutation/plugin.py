"""A plugin of pytest that gives one constant of a module another value: ``MUTATE=module:NAME=value``.

The module is imported before any test, so whatever imports the constant from it gets the new value too. Its compiled
functions are compiled anew and not kept: the machine code that is kept on disk has the old value in it.
"""

from __future__ import annotations

import os
from importlib import import_module

from numba.core.caching import NullCache
from numba.core.dispatcher import Dispatcher

VARIABLE = "MUTATE"


def pytest_configure() -> None:
    where, _, value = os.environ[VARIABLE].partition("=")
    module, _, name = where.partition(":")
    loaded = import_module(module)
    if not hasattr(loaded, name):
        raise AttributeError(f"{module} has no constant {name}")
    setattr(loaded, name, type(getattr(loaded, name))(float(value)))
    for compiled in vars(loaded).values():
        if isinstance(compiled, Dispatcher):
            compiled._cache = NullCache()
