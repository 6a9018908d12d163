from __future__ import annotations

import pytest

from svo.cli import progress as module


def test_a_file_gets_a_line_now_and_then_with_the_time_left(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    now = 0.0
    monkeypatch.setattr(module, "monotonic", lambda: now)
    with module.progress("Runs") as update:
        for done in range(20, 41):  # resumed: 20 were done before; 4 seconds each
            update(done, 40)
            now += 4.0
    lines = capsys.readouterr().err.splitlines()
    assert lines[0] == "Runs: 23 of 40, about 68 s left"
    assert lines[-1] == "Runs: 40 of 40, about 0 s left"
    assert len(lines) == 7


def test_work_that_is_done_already_says_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    with module.progress("Runs") as update:
        update(40, 40)
    assert capsys.readouterr().err == ""
