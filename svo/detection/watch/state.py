"""The state of a watch in a file, so that it goes on where it was: bank, position in the log, and what it counts.

The file is one line with a SHA-256 of the rest, then arrays as ``numpy.savez`` writes them, without pickle. It appears
whole or not at all, and a file that is damaged or of something else is refused.
"""

from __future__ import annotations

import hashlib
import io
import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from svo.detection.alarm_folder import differences
from svo.detection.watch.lines import Lines
from svo.detection.watch.session import Session
from svo.store import write_whole

_FORMAT = "svo-watch-state-1"


def save_state(path: Path, session: Session, lines: Lines, identity: Mapping[str, str]) -> None:
    """Write where a watch is, between two lines.

    Raises
    ------
    TypeError
        If an observer, or the plant's scheduler, cannot be saved.
    """
    arrays, rest = session.state()
    whole = {"identity": dict(identity), "session": rest, "lines": lines.state()}
    buffer = io.BytesIO()
    np.savez(buffer, **{"state.json": np.array(json.dumps(whole))}, **arrays)  # type: ignore[arg-type]
    content = buffer.getvalue()
    head = f"{_FORMAT} {hashlib.sha256(content).hexdigest()}\n".encode()
    write_whole(path, lambda file: file.write_bytes(head + content))


def resume_state(path: Path, session: Session, lines: Lines, identity: Mapping[str, str]) -> None:
    """Bring a new session and its lines to where the watch was.

    Raises
    ------
    ValueError
        If the file is damaged, no state of a watch, or that of another one.
    OSError
        If it cannot be read.
    """
    content = _checked(path, path.read_bytes())
    try:
        with np.load(io.BytesIO(content), allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        whole = json.loads(str(arrays.pop("state.json")))
        different = differences(whole["identity"], identity)
        if different:
            raise ValueError(f"it is that of another watch: {different}")
        session.resume(arrays, whole["session"])
        lines.resume(whole["lines"])
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise ValueError(
            f"{path} is not a state that this watch can go on from ({error}); "
            "remove it to begin anew, or give another file"
        ) from error


def check_replaced(path: Path) -> None:
    """ValueError unless a file is the state of a watch, whole or damaged: nothing else is overwritten."""
    with path.open("rb") as file:
        _check_head(path, file.read(len(_FORMAT) + 1))


def _check_head(path: Path, head: bytes) -> None:
    if not head.startswith(_FORMAT.encode() + b" "):
        raise ValueError(
            f"{path} is not the state of a watch (format {_FORMAT}); give another file, it is not overwritten"
        )


def _checked(path: Path, content: bytes) -> bytes:
    """What follows the digest, if that is right."""
    head, _, rest = content.partition(b"\n")
    _check_head(path, head)
    if head.split()[1:] != [hashlib.sha256(rest).hexdigest().encode()]:
        raise ValueError(f"{path} is damaged: its SHA-256 does not match; remove it to begin anew")
    return rest
