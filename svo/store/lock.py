"""One process at a time in a folder: a lock that the system takes back when its process dies, however it dies."""

from __future__ import annotations

import json
import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import IO

LOCK = ".svo-lock"
_AT = 1024  # Windows locks bytes, and what is locked cannot be read: one beyond the text


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Hold the lock of a folder, which exists.

    Raises
    ------
    ValueError
        If another process holds it; the message says which one, since when.
    """
    with (folder / LOCK).open("a+", encoding="utf-8") as file:
        try:
            _take(file)
        except OSError as error:
            raise ValueError(_who(folder, file)) from error
        file.truncate(0)
        since = datetime.now(UTC).isoformat(timespec="seconds")
        json.dump({"pid": os.getpid(), "host": socket.gethostname(), "since": since}, file)
        file.flush()
        try:
            yield
        finally:
            file.truncate(0)
            _give(file)


def check_free(folder: Path) -> None:
    """Raise as `locked` does if another process is at work in a folder."""
    if (folder / LOCK).exists():
        with locked(folder):
            pass


def _who(folder: Path, file: IO[str]) -> str:
    holder = "another process"
    with suppress(ValueError, KeyError, TypeError):
        file.seek(0)
        found = json.loads(file.read())
        holder = f"process {found['pid']} on {found['host']}, since {found['since']}"
    return f"{folder} is in use by {holder}; wait until it is done, or stop it first"


if os.name == "nt":
    import msvcrt

    def _take(file: IO[str]) -> None:
        file.seek(_AT)
        msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined]

    def _give(file: IO[str]) -> None:
        file.seek(_AT)
        msvcrt.locking(file.fileno(), msvcrt.LK_UNLCK, 1)  # type: ignore[attr-defined]

else:
    import fcntl

    def _take(file: IO[str]) -> None:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)

    def _give(file: IO[str]) -> None:
        fcntl.flock(file, fcntl.LOCK_UN)
