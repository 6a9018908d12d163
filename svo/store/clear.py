"""Results that make room for others: only what a command wrote itself is ever removed."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from fnmatch import fnmatch
from pathlib import Path

from svo.store.lock import locked


def clear_results(folder: Path, identity: str, own: Sequence[str]) -> None:
    """Remove results from a folder; one without visible files, or that is not there, is left as it is.

    Parameters
    ----------
    folder : Path
    identity : str
        Name of the file that says whose results these are; it is removed last.
    own : sequence of str
        Patterns of the names of all other results.

    Raises
    ------
    ValueError
        If the folder has no such file or holds anything else, or another process is at work in it; nothing is removed.
    """
    if not folder.is_dir() or not _visible(folder):
        return
    with locked(folder):
        entries = _visible(folder)
        others = [e.name for e in entries if e.name != identity and not any(fnmatch(e.name, name) for name in own)]
        if others or not any(entry.name == identity and entry.is_file() for entry in entries):
            what = f"{', '.join(others[:3])}, which is none of its files" if others else f"no {identity}"
            raise ValueError(
                f"{folder} is not what this command wrote: it has {what}; --overwrite removes nothing else, so give "
                "another folder, or move that away first"
            )
        for entry in sorted(entries, key=lambda e: e.name == identity):
            shutil.rmtree(entry) if entry.is_dir() and not entry.is_symlink() else entry.unlink()


def _visible(folder: Path) -> list[Path]:
    return [entry for entry in sorted(folder.iterdir()) if not entry.name.startswith(".")]
