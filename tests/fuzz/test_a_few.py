"""A few cases of every fuzzer, in this process; ``python -m tests.fuzz`` runs as many as one likes."""

from __future__ import annotations

import subprocess
import sys
from time import sleep

import numpy as np
import pytest

from tests.fuzz import limits
from tests.fuzz.kinds import KINDS
from tests.fuzz.limits import Limit, computed
from tests.fuzz.programs import watched
from tests.fuzz.workers import try_case

SLOW = ("commands", "study folders", "options")


@pytest.mark.parametrize("kind", KINDS)
def test_a_few_cases(kind: str) -> None:
    count = 2 if kind in SLOW else 25
    assert [(seed, failure) for seed in range(count) if (failure := try_case(kind, seed)) is not None] == []


def test_time_and_memory_of_a_command_are_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    """Not those of commands before it, nor of the process that starts it."""
    mine, program = np.ones(2**24), "import time; x = bytearray(MB * 2**20); time.sleep(0.3)"
    most = []
    for megabytes in (200, 1):
        command = [sys.executable, "-c", program.replace("MB", str(megabytes))]
        most.append(watched(subprocess.Popen(command, stderr=subprocess.PIPE), "a command")[1])
    assert most[1] < mine.nbytes < 200 * 2**20 < most[0]
    monkeypatch.setattr(limits, "WAITING", 1e4)  # nothing is certain by the clock of a busy machine
    with subprocess.Popen([sys.executable, "-c", "while True: pass"]) as busy:
        try:
            limit = Limit(busy.pid, 0.2)
            while not limit.passed():
                sleep(0.01)
            assert computed(busy.pid) >= 0.2
        finally:
            busy.kill()
