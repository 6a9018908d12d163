"""What machine code a library has."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

FUSED = re.compile(r"\s(vfn?m(add|sub)\w*|fn?m(add|sub)|fml[as])\s")  # of x86-64 and of aarch64


def fused_instructions(library: Path) -> list[str]:
    """Lines of its disassembly that multiply and add with one rounding; skips where nothing disassembles."""
    if shutil.which("objdump") is None:
        pytest.skip("no objdump here to look into the library with")
    text = subprocess.run(["objdump", "-d", str(library)], capture_output=True, text=True, check=True).stdout
    return [line for line in text.splitlines() if FUSED.search(line)]
