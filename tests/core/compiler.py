"""The C compiler of the machine, and the flags with which tests build the core and its units."""

from __future__ import annotations

import importlib.util
import os
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
CORE = ROOT / "core"
STRICT = ("-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror", "-ffp-contract=off", f"-I{CORE}")
SANITIZED = (
    "-O1", "-g", "-fno-omit-frame-pointer", "-fsanitize=address,undefined,float-cast-overflow",
    "-fno-sanitize-recover=all",
)  # fmt: skip


def sources() -> list[Path]:
    """Every C file of the library."""
    return [*sorted(CORE.glob("*/*.c")), *sorted((ROOT / "aircraft").glob("*/*.c"))]


def compiler() -> list[str]:
    """CC, or the first of cc, gcc and clang; skips where there is none."""
    named = shlex.split(os.environ.get("CC", ""))
    found = named or [name for name in ("cc", "gcc", "clang") if shutil.which(name)][:1]
    if not found:
        pytest.skip("no C compiler here: neither CC nor cc, gcc or clang")
    return found


def clang() -> list[str]:
    """Clang, also that of the package ziglang; skips where there is none."""
    if shutil.which("clang"):
        return ["clang"]
    if importlib.util.find_spec("ziglang") is None:
        pytest.skip("no clang here, neither by its name nor in the package ziglang")
    return [sys.executable, "-m", "ziglang", "cc"]


def compiled(command: list[str], flags: Iterable[str], files: Iterable[Path], program: Path) -> Path:
    """A program of these files; an AssertionError with what the compiler says if there is none."""
    line = [*command, *flags, *map(str, files), "-o", str(program), "-lm"]
    done = subprocess.run(line, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return program


def needs_sanitizers(command: list[str], folder: Path) -> None:
    """Skips where the compiler has no AddressSanitizer or UBSan."""
    empty = folder / "empty.c"
    empty.write_text("int main(void) { return 0; }\n", encoding="utf-8")
    done = subprocess.run([*command, *SANITIZED, str(empty), "-o", str(folder / "empty")], capture_output=True)
    if done.returncode != 0:
        pytest.skip(f"{' '.join(command)} has no sanitizers")
