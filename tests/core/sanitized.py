"""The core built for AddressSanitizer and UBSan, in a copy of the package that loads it; Python runs with it.

The arrays of a window lie in one block, so the sanitizer sees no step from one into the next: `guarded/memory.c` puts
guards into the gaps between them.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from polytopes.native import PATH
from tests.core.compiler import CORE, ROOT, SANITIZED, STRICT, compiled, compiler, needs_sanitizers, sources

GUARDED = Path(__file__).with_name("guarded") / "memory.c"
BESIDE = """import sys
# a tree that is installed to be edited may lead imports to itself, whatever the path says
sys.meta_path[:] = [finder for finder in sys.meta_path if not type(finder).__module__.startswith("_editable_")]
"""


def sanitized(folder: Path) -> dict[str, str]:
    """Builds into an empty folder; the environment in which Python loads that library. Skips where it cannot be."""
    command = compiler()
    needs_sanitizers(command, folder)
    runtimes = [runtime(command, name) for name in ("libasan.so", "libstdc++.so")]
    package = shutil.copytree(ROOT / "polytopes", folder / "polytopes", ignore=shutil.ignore_patterns("_core*"))
    files = [file for file in sources() if file != CORE / "window" / "memory.c"]
    flags = (*STRICT, *SANITIZED, "-shared", "-fPIC", "-fvisibility=hidden")
    compiled(command, flags, [*files, GUARDED], package / PATH.name)
    (folder / "sitecustomize.py").write_text(BESIDE, "utf-8")
    return os.environ | {
        "LD_PRELOAD": " ".join(runtimes),
        "PYTHONPATH": os.pathsep.join([str(folder), str(ROOT)]),
        # numpy copies whole blocks, guards included
        "ASAN_OPTIONS": "detect_leaks=0:replace_intrin=0:allocator_may_return_null=1",
        "UBSAN_OPTIONS": "print_stacktrace=1",
    }


def runtime(command: list[str], name: str) -> str:
    """Where a library of the compiler lies; skips where it has none of its own."""
    done = subprocess.run([*command, f"-print-file-name={name}"], capture_output=True, text=True)
    if not os.path.isabs(path := done.stdout.strip()):
        pytest.skip(f"{' '.join(command)} has no {name} that another program could load")
    return path


def python(environment: dict[str, str], folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Python with the library in the folder, from there."""
    return subprocess.run([sys.executable, *arguments], env=environment, cwd=folder, capture_output=True, text=True)
