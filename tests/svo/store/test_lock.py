"""One process at a time in a folder, and none that is dead."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from svo.store import locked

HOLD = "import sys, time; from pathlib import Path; from svo.store import locked\nwith locked(Path(sys.argv[1])):\n"
HOLD += "    print('held', flush=True)\n    time.sleep(600)\n"


def test_a_second_one_is_told_who_holds_it(tmp_path: Path) -> None:
    with (
        locked(tmp_path),
        pytest.raises(ValueError, match=rf"in use by process {os.getpid()} on .+, since 20"),
        locked(tmp_path),
    ):
        pass
    with locked(tmp_path):
        pass


def test_a_process_that_is_killed_leaves_no_lock(tmp_path: Path) -> None:
    process = subprocess.Popen([sys.executable, "-c", HOLD, tmp_path], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline() == "held\n"
    with pytest.raises(ValueError, match=f"in use by process {process.pid} on "), locked(tmp_path):
        pass
    process.kill()
    process.wait()
    for _ in range(300):  # the system takes a lock back when it likes
        try:
            with locked(tmp_path):
                return
        except ValueError:
            time.sleep(0.1)
    pytest.fail("the lock of a dead process is still held after 30 s")
