"""HiGHS without a word on standard output, where programs print figures for other programs to read."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


def new_highs() -> Any:
    """A `highspy.Highs` that logs nothing.

    Its first instance in a process writes a banner to the process' standard output (highspy 1.16) before any option
    could forbid it.
    """
    import highspy  # imported here: slow to load

    with _standard_output_closed():
        highs = highspy.Highs()
    highs.setOptionValue("output_flag", False)
    return highs


@contextmanager
def _standard_output_closed() -> Iterator[None]:
    if sys.stdout is not None:
        sys.stdout.flush()
    try:
        kept = os.dup(1)
    except OSError:  # there is none
        yield
        return
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 1)
        yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)
        os.close(nowhere)
