"""Importing the package is light, and the first compilation is announced once."""

import logging
import subprocess
import sys

import pytest

from polytopes import linear_program, warm_up


def test_heavy_libraries_are_not_imported() -> None:
    code = (
        "import sys, polytopes;"
        "print([m for m in ('cvxpy', 'highspy', 'scipy.spatial', 'matplotlib', 'cdd', 'pandas') if m in sys.modules])"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"


def test_a_slow_first_use_is_announced_once(monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture) -> None:
    monkeypatch.setattr(linear_program, "_ANNOUNCE_AFTER", 0.0)
    warm_up.cache_clear()
    with caplog.at_level(logging.WARNING, logger="polytopes"):
        monkeypatch.setattr(linear_program.kernel, "interior", lambda *_: __import__("time").sleep(0.2))
        warm_up()
        warm_up()
    assert [record.getMessage() for record in caplog.records].count(caplog.records[0].getMessage()) == 1
    assert "once on this machine" in caplog.records[0].getMessage()
