"""How much memory a file may unpack to: a few kilobytes can hold gigabytes of zeros."""

from __future__ import annotations

import os
from pathlib import Path

VARIABLE = "SVO_UNPACK_LIMIT_MB"
DEFAULT_MB = 256
ALWAYS = 4  # times the size on disk: such a file surprises nobody


def check_unpacked(path: str | Path, unpacked: int) -> None:
    """Raise an error if a file would unpack to more than the limit and to more than four times its size on disk.

    Parameters
    ----------
    path : path
    unpacked : int
        Bytes that reading would need, known before anything is unpacked.

    Raises
    ------
    ValueError
    """
    limit, size = _limit(), os.path.getsize(path)
    if unpacked > max(limit, ALWAYS * size):
        raise ValueError(
            f"{path} has {size / 1e6:.3g} MB and would unpack to {unpacked / 1e6:,.0f} MB; the limit is "
            f"{limit / 1e6:,.0f} MB. If that is right, raise it: set the environment variable {VARIABLE} "
            f"to {unpacked // 1_000_000 + 1}"
        )


def _limit() -> int:
    """In bytes."""
    text = os.environ.get(VARIABLE, str(DEFAULT_MB))
    if not (text.isascii() and text.isdigit() and len(text) <= 12):
        raise ValueError(f"the environment variable {VARIABLE} is {text!r:.40}; expected a whole number of megabytes")
    return int(text) * 1_000_000
