"""A job of a study that fails is an outcome too: an error in words, and the study goes on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

Job = TypeVar("Job")
Outcome = TypeVar("Outcome")
_LONGEST = 2000  # characters


@dataclass(frozen=True)
class Failed:
    """Why a job gave nothing."""

    error: str


def attempt(work: Callable[..., Outcome], *job: Any) -> Outcome | Failed:
    """What ``work`` makes of a job, or why it failed; an interruption from the keyboard is no failure."""
    try:
        return work(*job)
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # a plant is anyone's code, and may call sys.exit
        return Failed(f"{type(error).__name__}: {_words(error)}")


def _words(error: BaseException) -> str:
    """What an error says, as text that can be stored and is no book."""
    try:
        text = str(error)
    except Exception:
        return "(what it says cannot be read)"
    return text[:_LONGEST].encode("utf-8", "backslashreplace").decode()
