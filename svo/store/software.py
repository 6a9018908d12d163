"""Which software made results, for the record and to tell whether they may go on."""

from __future__ import annotations

import os
import platform
from functools import cache
from importlib.metadata import PackageNotFoundError, version

_PACKAGES = ("svo-fdi", "numpy", "scipy", "highspy", "python-flint", "pyarrow")


@cache
def versions() -> dict[str, str]:
    """Versions of the software and the kind of machine, for the record."""
    return {
        **{name: _version(name) for name in _PACKAGES},
        "python": platform.python_version(),
        "machine": f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores",
    }


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "not installed"
