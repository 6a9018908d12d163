"""Where a command writes to: checked when the command line is read, so that no work is lost at its end."""

from __future__ import annotations

import os
from pathlib import Path

from svo.cli.frame import fail, one_line_errors


def writable_folder(path: Path | None) -> Path | None:
    """A folder that exists, or that can be made."""
    if path is None:
        return None
    nearest = next(folder for folder in (path, *path.absolute().parents) if os.path.lexists(folder))
    if not nearest.is_dir():
        what = "is a file" if nearest == path else f"cannot be made, since {nearest} is a file"
        fail(f"{path} {what}; expected a folder for the results, which is made if need be")
    _need_access(path, nearest)
    return path


def writable_log(path: Path | None) -> Path | None:
    """A log file in one of the known formats."""
    from svo.logs.file import check_suffix

    if path is not None:
        with one_line_errors():
            check_suffix(path)
    return writable_file(path)


def writable_csv(path: Path | None) -> Path | None:
    """A CSV file."""
    if path is not None and path.suffix.lower() != ".csv":
        fail(f"{path} has the suffix {path.suffix!r}; expected .csv, the format that is written")
    return writable_file(path)


def writable_parquet(path: Path | None) -> Path | None:
    """A Parquet file."""
    if path is not None and path.suffix.lower() != ".parquet":
        fail(f"{path} has the suffix {path.suffix!r}; expected .parquet, the format that keeps where a log comes from")
    return writable_file(path)


def writable_file(path: Path | None) -> Path | None:
    """A file that can be written in a folder that exists."""
    if path is None:
        return None
    if path.is_dir():
        fail(f"{path} is a folder; expected the name of a file to write")
    if not path.parent.is_dir():
        fail(f"{path} cannot be written, since there is no folder {path.parent}; make it first")
    _need_access(path, path if path.exists() else path.parent)
    return path


def check_new(path: Path | None, overwrite: bool) -> None:
    """Refuse to write over a file, unless that is asked for."""
    if path is not None and os.path.lexists(path) and not overwrite:
        raise ValueError(f"{path} is there already, and nothing is overwritten; give another name, or --overwrite")


def _need_access(path: Path, holder: Path) -> None:
    if not os.access(holder, os.W_OK | os.X_OK if holder.is_dir() else os.W_OK):
        fail(f"{path} cannot be written: no permission to write to {holder}; choose another place")
