"""Limits of one case: seconds of computing, seconds by the clock, and memory."""

from __future__ import annotations

import os
from pathlib import Path
from time import monotonic

SECONDS = 30.0  # of computing: on a busy machine the clock says nothing
WAITING = 10 * SECONDS  # by the clock
BYTES = 2**30


def computed(pid: int) -> float:
    """CPU seconds of a process so far; 0 once it is gone."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return 0.0
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def most_memory(pid: int) -> int:
    """The most bytes of memory that a process has held so far; 0 once it is gone."""
    try:
        status = Path(f"/proc/{pid}/status").read_text()
    except OSError:
        return 0
    return next((int(line.split()[1]) * 1024 for line in status.split("\n") if line.startswith("VmHWM")), 0)


class Limit:
    """Time that a process may take from now on."""

    def __init__(self, pid: int, seconds: float = SECONDS) -> None:
        self._pid, self._seconds = pid, seconds
        self._computed, self._begun = computed(pid), monotonic()

    def passed(self) -> bool:
        """Whether it has computed, or waited, for longer."""
        return (
            computed(self._pid) - self._computed > self._seconds
            or monotonic() - self._begun > self._seconds / SECONDS * WAITING
        )

    def __str__(self) -> str:
        return f"more than {self._seconds:.0f} s"
