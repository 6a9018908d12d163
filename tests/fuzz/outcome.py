"""What a case of a fuzzer may end in, and whether an error is one that the project promises."""

from __future__ import annotations

import traceback
from pathlib import Path

ROOT = Path(__file__).parents[2]
OURS = tuple(str(ROOT / package) for package in ("polytopes", "svo", "aircraft"))


class WrongError(AssertionError):
    """The answer was wrong: worse than any error."""


def verdict_of(error: BaseException) -> str | None:
    """Why an error must not reach a user, or None if it is a documented one.

    Documented are TypeError and ValueError (with their subclasses here) and OverflowError, raised by a check of our
    own rather than by a library that was handed nonsense, and what the system says of a file.
    """
    from polytopes import UndecidedError

    if isinstance(error, WrongError):
        return f"WRONG: {error}"
    if isinstance(error, OSError):
        return None
    frames = traceback.extract_tb(error.__traceback__)
    where = f"{Path(frames[-1].filename).name}:{frames[-1].lineno}" if frames else "?"
    if not isinstance(error, TypeError | ValueError | OverflowError | UndecidedError):
        return f"{type(error).__name__} at {where}: {str(error)[:200]}"
    if not frames[-1].filename.startswith(OURS):
        return f"{type(error).__name__} raised outside, at {where}: {str(error)[:200]}"
    if not str(error):
        return f"{type(error).__name__} without a word, at {where}"
    return None
