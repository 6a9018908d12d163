"""Who may write alarms into a folder: nothing overwrites, joins or deletes an alarm file that it did not write itself.

- ``svo detect`` writes into a folder without results; asked to overwrite, over those of its own.
- ``svo watch`` does too, and leaves ``watch.json`` there, which says whose alarms these are: started again for the same
  log, plant and noise set it adds to them.
- ``svo study`` joins what its own runs wrote, known by its SHA-256 (`svo.store.joined`).
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path

from svo.isolation import Alarm
from svo.isolation.alarms import alarm_line
from svo.store import locked, write_text

ALARMS = "alarms.jsonl"
VERDICT = "verdict.json"
REPORT, PICTURES = "report.html", "pictures"
_WATCH = "watch.json"
_CUT = "alarms.cut"
_RESULTS = (ALARMS, f"{ALARMS}.gz", VERDICT, _WATCH, "study.json", "comparison.csv")
_FORMAT = "svo-watch-1"


def check_no_results(folder: Path, overwrite: bool = False) -> None:
    """Raise a ValueError if a folder holds what a command wrote, or a link in the place of that.

    To ``overwrite`` says that those of ``svo detect`` may be there.
    """
    found = [name for name in _RESULTS if os.path.lexists(folder / name)]
    if overwrite and VERDICT in found and {*found} <= {ALARMS, VERDICT} and all(_is_file(folder / n) for n in found):
        return
    if found:
        raise ValueError(
            f"{folder} holds results already ({', '.join(found)}), and these are never overwritten"
            + (
                ", since they are not those of svo detect; "
                if overwrite
                else "; --overwrite replaces what the same command wrote before, else "
            )
            + "give another folder, or move them away first"
        )


def remove_report(folder: Path) -> None:
    """Remove the report of results that are overwritten; pictures of other names stay."""
    (folder / REPORT).unlink(missing_ok=True)
    for name in ("verdicts.*", "bounds_*.*", "readings_*.*"):
        for picture in (folder / PICTURES).glob(name):
            picture.unlink()
    with suppress(OSError):  # there is none, or it holds something else
        (folder / PICTURES).rmdir()


def _is_file(path: Path) -> bool:
    return path.is_file() and not path.is_symlink()


class WatchFolder:
    """The alarms of one watch: those of before are kept when it is started again; `watch_folder` opens one.

    A record that stands there already, because its sample was read again, is not added a second time.
    """

    def __init__(self, folder: Path) -> None:
        self.alarms = folder / ALARMS
        self.before = 0
        self.notes: list[str] = []
        self._known: set[str] = set()
        if self.alarms.exists():
            self._set_cut_end_aside()
            self._known = set(self.alarms.read_text(encoding="utf-8", errors="replace").splitlines())
            self.before = len(self._known)
        else:
            self.alarms.touch()

    def add(self, alarm: Alarm) -> None:
        """Store an alarm; it is on the disk when this returns, and a failure leaves the file as it was."""
        record = alarm_line(alarm)
        if record.rstrip("\n") in self._known:
            return
        _append(self.alarms, record.encode())
        self._known.add(record.rstrip("\n"))

    def _set_cut_end_aside(self) -> None:
        """A record without its end, as a loss of power leaves it, would make the next one unreadable."""
        content = self.alarms.read_bytes()
        end = content.rfind(b"\n") + 1
        if end < len(content):
            cut = self.alarms.with_name(_CUT)
            _append(cut, content[end:] + b"\n")
            os.truncate(self.alarms, end)
            self.notes.append(f"the last record of {self.alarms} was cut when it was written; it is now in {cut}")


def _append(path: Path, content: bytes) -> None:
    """All of it, on the disk, or nothing."""
    with path.open("ab") as file:
        size = os.fstat(file.fileno()).st_size
        try:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        except OSError:
            with suppress(OSError):  # a full disk may have taken half of it
                os.truncate(path, size)
            raise


@contextmanager
def watch_folder(folder: Path, identity: Mapping[str, str], overwrite: bool = False) -> Iterator[WatchFolder]:
    """Open the folder of a watch, for one process at a time.

    Parameters
    ----------
    folder : Path
        Made if need be.
    identity : mapping
        Plant, noise set and log: what the watch that wrote the folder must have been about.
    overwrite : bool
        Begin anew, without the alarms of a watch before, whatever it was about.

    Raises
    ------
    ValueError
        If the folder holds results of another command, or of a watch of something else; or another process is
        writing into it.
    """
    about = {"format": _FORMAT, **identity}
    _check_own(folder, about, overwrite)
    folder.mkdir(parents=True, exist_ok=True)
    with locked(folder):
        _check_own(folder, about, overwrite)
        for name in (ALARMS, _CUT, _WATCH) if overwrite else ():
            (folder / name).unlink(missing_ok=True)
        if not (folder / _WATCH).exists():
            write_text(folder / _WATCH, json.dumps(about, indent=2) + "\n")
        yield WatchFolder(folder)


def _check_own(folder: Path, about: Mapping[str, str], overwrite: bool) -> None:
    """Raise a ValueError unless a folder has no results, or those of a watch of the same."""
    path = folder / _WATCH
    if not os.path.lexists(path):
        check_no_results(folder)
        return
    for name in (_WATCH, ALARMS):
        if (folder / name).is_symlink():
            raise ValueError(f"{folder / name} is a symbolic link; expected a file of the watch itself, so remove it")
    try:
        stored = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        stored = None
    if not isinstance(stored, dict) or stored.get("format") != _FORMAT:
        raise ValueError(f"{path} is not that of a watch (format {_FORMAT}); give another folder")
    different = differences(stored, about)
    if different and not overwrite:
        raise ValueError(
            f"{folder} holds the alarms of another watch ({different}); give another folder, or --overwrite"
        )


def differences(stored: Mapping[str, str], now: Mapping[str, str]) -> str:
    """What differs between what is stored and what is now; empty if nothing does."""
    return "; ".join(
        f"{key} was {stored.get(key)!r}, now {now.get(key)!r}"
        for key in dict.fromkeys((*stored, *now))
        if stored.get(key) != now.get(key)
    )
