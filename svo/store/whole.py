"""Files that appear whole or not at all, and stay after a loss of power."""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

_UNFINISHED = re.compile(r"\.unfinished-\d+-.+")


def write_whole(path: Path, write: Callable[[Path], Any]) -> None:
    """Write a file under another name, bring it to the disk, then rename it.

    What stood at ``path`` is replaced; a symbolic link is replaced itself, and what it points at is left alone.

    Parameters
    ----------
    path : Path
    write : function of a path
        Writes the file; the path has the same suffix.
    """
    temporary = path.with_name(f".unfinished-{os.getpid()}-{path.name}")
    temporary.unlink(missing_ok=True)
    try:
        write(temporary)
        _sync(temporary)
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)
    sync_folder(path.parent)


def write_text(path: Path, text: str) -> None:
    """Write a text file as `write_whole` does."""
    write_whole(path, lambda file: file.write_text(text, encoding="utf-8"))


def make_folder(folder: Path) -> None:
    """Make the folder of a study's own files if need be, without what an interruption left unfinished in it.

    Raises
    ------
    ValueError
        If it is a symbolic link, so that the files would be written elsewhere.
    """
    if folder.is_symlink():
        raise ValueError(f"{folder} is a symbolic link; expected a folder of the study itself, so remove it")
    folder.mkdir(exist_ok=True)
    remove_unfinished(folder)


def remove_unfinished(folder: Path) -> None:
    """Remove what processes that were killed left of `write_whole`; only where no other one is writing."""
    for path in folder.glob(".unfinished-*"):
        if _UNFINISHED.fullmatch(path.name):
            path.unlink(missing_ok=True)


def sync_folder(folder: Path) -> None:
    """Bring the names in a folder to the disk, where the system can."""
    if os.name != "nt":  # a folder cannot be opened there
        _sync(folder)


def digest_of(path: Path) -> str:
    """SHA-256 of a file."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def file_name(name: str) -> str:
    """A name as part of a file's name: others stay apart, and none leaves the folder.

    Letters, digits, "-", "_" and inner dots stay as they are; a name with anything else has it replaced and gets
    eight digits of its SHA-256.
    """
    plain = re.sub(r"[^\w.-]", "_", name, flags=re.ASCII).strip(".")[:100]
    return plain if plain == name else f"{plain}-{hashlib.sha256(name.encode()).hexdigest()[:8]}"


def _sync(path: Path) -> None:
    descriptor = os.open(path, os.O_RDWR if os.name == "nt" else os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
