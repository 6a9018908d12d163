"""A log of a plant that the command line finds."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.svo.commands import svo


@pytest.fixture
def log(registered_tank: str, tmp_path: Path) -> Path:
    path = tmp_path / "log.csv"
    result = svo(
        "simulate", "tank", "--fault", "gauge", "--profile", "step", "--noise", "calm", "--seed", "4", "--out", path
    )
    assert result.exit_code == 0, result.output
    return path
