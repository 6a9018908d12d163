"""Jobs wherever they run: what fails costs itself alone, and nothing outlives the process that asked."""

from __future__ import annotations

import ctypes
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from svo.studies.attempt import Failed, attempt
from svo.studies.engine import Place, complete

HERE = Path(__file__).parent


def work(job: Any) -> Any:
    """One of the things that anyone's plant can do."""
    match job:
        case "raise":
            raise ValueError("no")
        case "exit":
            sys.exit(0)
        case "vanish":
            os._exit(3)
        case "segfault":
            ctypes.string_at(0)
        case "hang":
            if "HUNG" in os.environ:
                Path(os.environ["HUNG"], str(os.getpid())).touch()
            ctypes.PyDLL(None).sleep(600)  # with the interpreter's lock, as compiled code does
        case "a function":
            return lambda: None
    return os.getpid()


FAILURES = {
    "raise": "ValueError: no",
    "exit": "SystemExit: 0",
    "vanish": "its process ended with exit code 3",
    "segfault": "its process was ended by SIGSEGV",
    "hang": "it took longer than the limit of 3 s and was stopped",
    "a function": "its outcome cannot be sent: ",
}


def test_what_fails_in_a_process_costs_itself_alone() -> None:
    jobs = [0, "hang", "segfault", 1, "vanish", "raise", 2, "exit", "a function", 3]
    kept: dict[int, Any] = {}
    calls: list[tuple[int, int]] = []
    complete(work, jobs, {3}, kept.__setitem__, Place(2, limit=3.0), lambda *done: calls.append(done))
    assert sorted(kept) == [0, 1, 2, 4, 5, 6, 7, 8, 9]
    for number, outcome in kept.items():
        if jobs[number] in FAILURES:
            assert isinstance(outcome, Failed)
            assert outcome.error.startswith(FAILURES[jobs[number]])
        else:
            assert outcome not in (os.getpid(), None)
    assert calls == [(done, 10) for done in range(1, 11)]


def test_what_fails_in_this_process_is_an_outcome_too() -> None:
    assert dict(Place().outcomes(work, ["raise", 0])) == {"raise": Failed("ValueError: no"), 0: os.getpid()}
    assert dict(Place(8).outcomes(work, [])) == {}


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (GeneratorExit("gone"), "GeneratorExit: gone"),
        (OSError("/data/\udcff"), "OSError: /data/\\udcff"),
        (ValueError("x" * 10**6), "ValueError: " + "x" * 2000),
    ],
)
def test_whatever_an_error_says_can_be_stored(error: BaseException, words: str) -> None:
    def fail() -> None:
        raise error

    assert attempt(fail) == Failed(words)


def test_an_error_that_cannot_be_read_is_one() -> None:
    class Mute(Exception):
        def __str__(self) -> str:
            raise RuntimeError

    def fail() -> None:
        raise Mute

    assert attempt(fail) == Failed("Mute: (what it says cannot be read)")


def test_an_interruption_is_no_failure_and_leaves_no_process() -> None:
    def interrupt(number: int, outcome: Any) -> None:
        raise KeyboardInterrupt

    before = children(os.getpid())
    with pytest.raises(KeyboardInterrupt):
        complete(work, [0, "hang", "hang"], (), interrupt, Place(2))
    assert children(os.getpid()) <= before


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"workers": 0}, "workers is 0"),
        ({"limit": 0.0}, "limit is 0"),
        ({"limit": float("nan")}, "limit is nan"),
        ({"limit": 1.0, "scheduler": "tcp://127.0.0.1:8786"}, "a cluster cannot stop a run"),
    ],
)
def test_a_place_that_is_none_is_refused(wrong: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Place(**wrong)


def script(body: str) -> list[str]:
    return [sys.executable, "-c", f"import sys; sys.path.insert(0, {str(HERE)!r})\n{body}"]


def test_a_script_without_a_main_guard_is_one_clear_error(tmp_path: Path) -> None:
    file = tmp_path / "script.py"
    file.write_text(script("from test_engine import *; list(Place(2).outcomes(work, [0, 1]))")[2])
    done = subprocess.run([sys.executable, file], capture_output=True, text=True)
    assert done.returncode == 1
    assert "a worker process cannot start" in done.stderr.splitlines()[-1]
    assert "if __name__ == '__main__':" in done.stderr.splitlines()[-1]


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="reads the processes from /proc")
def test_nothing_outlives_a_killed_parent(tmp_path: Path) -> None:
    """Workers that hold the interpreter's lock included: nothing in them can look after their parent."""
    command = script("from test_engine import *; print([o for o in Place(2).outcomes(work, [0, 1, 'hang', 'hang'])])")
    process = subprocess.Popen(command, env={**os.environ, "HUNG": str(tmp_path)})
    end = time.monotonic() + 60.0
    while len(list(tmp_path.iterdir())) < 2 and time.monotonic() < end:
        assert process.poll() is None
        time.sleep(0.1)
    workers = children(process.pid)
    process.kill()
    process.wait()
    end = time.monotonic() + 30.0
    while any(map(is_alive, workers)) and time.monotonic() < end:
        time.sleep(0.1)
    left = [pid for pid in workers if is_alive(pid)]
    for pid in left:
        os.kill(pid, signal.SIGKILL)
    assert len(workers) >= 2
    assert left == []


def children(parent: int) -> set[int]:
    """Processes that a process has started and that work; the tracker of the standard library is none."""
    found = Path(f"/proc/{parent}/task/{parent}/children").read_text().split()
    return {int(pid) for pid in found if b"spawn_main" in Path(f"/proc/{pid}/cmdline").read_bytes()}


def is_alive(pid: int) -> bool:
    try:
        return ") Z " not in Path(f"/proc/{pid}/stat").read_text()
    except FileNotFoundError:
        return False
