"""HiGHS without a word on standard output, where programs print figures for other programs to read."""

from __future__ import annotations

from typing import Any


def new_highs() -> Any:
    """A `highspy.Highs` that logs nothing (highspy 1.16 prints a banner all the same, so it is excluded)."""
    import highspy  # imported here: slow to load

    highs = highspy.Highs()
    highs.setOptionValue("output_flag", False)
    return highs
