"""Units of the C code: a small program a piece (`units/`), which includes the piece's headers and checks its answers.

Slow: the same programs under AddressSanitizer and UBSan, and the whole library without a warning of gcc and of clang.
"""

from __future__ import annotations

import os
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.core.compiler import CORE, SANITIZED, STRICT, clang, compiled, compiler, needs_sanitizers, sources

UNITS = Path(__file__).with_name("units")
PIECES = {
    "vectors": (),
    "memory": ("window/memory.c",),
    "rounding": ("window/rounding.c",),
    "basis": ("window/basis.c", "window/memory.c"),
    "ratio_test": ("window/ratio_test.c", "window/memory.c"),
    "dual_simplex": tuple(f"window/{name}.c" for name in ("maximise", "dual_simplex", "ratio_test", "basis", "memory")),
    "samples": ("window/*.c",),
    "programs": tuple(f"polytopes/{name}.c" for name in ("programs", "simplex", "basis", "duality")),
    "scaling": ("polytopes/scaling.c",),
    "elimination": ("polytopes/*.c",),
    "boxes": ("polytopes/box.c",),
    "filters": ("filters/*.c",),
    "intervals": ("interval/*.c",),
    "elementary": tuple(f"tape/{name}.c" for name in ("exponential", "logarithm", "waves", "quarter_turns", "angle")),
}
"""What of the core each program is linked with."""


def run(unit: str, flags: tuple[str, ...], folder: Path) -> None:
    files = [UNITS / f"{unit}.c", *(file for pattern in PIECES[unit] for file in sorted(CORE.glob(pattern)))]
    program = compiled(compiler(), (*STRICT, f"-I{UNITS}", *flags), files, folder / unit)
    done = subprocess.run([str(program)], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("unit", PIECES)
def test_units(unit: str, tmp_path: Path) -> None:
    run(unit, ("-O0",), tmp_path)


def test_every_program_is_run() -> None:
    assert {path.stem for path in UNITS.glob("*.c")} == set(PIECES)


def test_a_failed_check_fails(tmp_path: Path) -> None:
    wrong = tmp_path / "wrong.c"
    wrong.write_text('#include "check.h"\nint main(void) { CHECK(1 > 2); return failures > 0; }\n', encoding="utf-8")
    program = compiled(compiler(), (*STRICT, f"-I{UNITS}"), [wrong], tmp_path / "wrong")
    done = subprocess.run([str(program)], capture_output=True, text=True)
    assert (done.returncode, done.stderr.rpartition("/")[2]) == (1, "wrong.c:2: 1 > 2\n")


@pytest.mark.slow
@pytest.mark.parametrize("unit", PIECES)
def test_units_under_sanitizers(unit: str, tmp_path: Path) -> None:
    needs_sanitizers(compiler(), tmp_path)
    run(unit, SANITIZED, tmp_path)


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="the flags are those of compilers for POSIX systems")
@pytest.mark.parametrize("found", [compiler, clang])
def test_the_library_has_no_warning(found: Callable[[], list[str]], tmp_path: Path) -> None:
    compiled(found(), (*STRICT, "-O3", "-shared", "-fPIC"), sources(), tmp_path / "core.so")
