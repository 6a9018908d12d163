from __future__ import annotations

import os
from pathlib import Path

import pytest

REGISTERED = Path(__file__).parent / "studies" / "isolation" / "registered"


@pytest.fixture
def registered_tank(monkeypatch: pytest.MonkeyPatch) -> str:
    """Make the test plant an installed distribution, here and in processes that are started from here."""
    monkeypatch.syspath_prepend(str(REGISTERED))
    monkeypatch.setenv("PYTHONPATH", str(REGISTERED), prepend=os.pathsep)
    return "tank"
