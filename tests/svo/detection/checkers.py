"""The checkers as modules, where a process for each question would take too long."""

from __future__ import annotations

import importlib
import importlib.util
import sys
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).parents[3] / "checker"


def load(name: str) -> Any:
    """A file of the checker's, once; the second one finds the first by its name."""
    if name not in sys.modules:
        spec = importlib.util.spec_from_file_location(name, FOLDER / f"{name}.py")
        assert spec is not None
        assert spec.loader is not None
        sys.modules[name] = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(sys.modules[name])
    return sys.modules[name]


CHECK = load("svo_check")
NONLINEAR = load("svo_check_nonlinear")
