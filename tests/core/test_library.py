"""The compiled core as a library: no fused instruction, a clear word where it is missing, a quick start."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from benchmarks.cold_start import SVO, turns, write_log
from polytopes.native import PATH
from tests.core.disassembly import fused_instructions


def test_no_product_is_fused_with_a_sum() -> None:
    assert fused_instructions(PATH) == []


def test_a_fused_instruction_would_be_found() -> None:
    from tests.core.disassembly import FUSED

    assert FUSED.search("  4005d0:\tc4 e2 f1 b8 c2 \tvfmadd231sd %xmm2,%xmm1,%xmm0")
    assert FUSED.search("  10:\t1f420820 \tfmadd d0, d1, d2, d2")
    assert not FUSED.search("  4005d0:\tc5 fb 59 c1 \tvmulsd %xmm1,%xmm0,%xmm0")


def test_a_missing_library_is_one_error_that_says_what_to_do() -> None:
    code = "import pathlib, sys, polytopes.native as n; n.PATH = pathlib.Path('nowhere/_core.so'); n._load()"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 1
    assert "ImportError: the compiled core nowhere/_core.so cannot be loaded" in done.stderr
    assert "pip install" in done.stderr


HEAVY = (
    "scipy.linalg", "scipy.optimize", "scipy.signal", "scipy.sparse", "scipy.spatial", "scipy.special", "scipy.stats",
    "cvxpy", "dask", "highspy", "jinja2", "llvmlite", "matplotlib", "numba", "numpy.ma", "pandas", "pyarrow", "rich",
)  # fmt: skip


def test_a_detection_loads_nothing_that_it_does_not_need(tmp_path: Path) -> None:
    log = tmp_path / "log.csv"
    write_log(log)
    code = (
        "import sys; from svo.cli import app; "
        f"app(['detect', 'eclipse', {str(log)!r}, '--out', {str(tmp_path / 'found')!r}], standalone_mode=False); "
        f"print([name for name in {HEAVY} if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    *answer, loaded = done.stdout.splitlines()
    assert "Fault isolated at 0.50 s: alpha." in answer
    assert loaded == "[]"


def test_a_detection_takes_at_most_three_times_the_import_of_what_it_stands_on(tmp_path: Path) -> None:
    log = tmp_path / "log.csv"
    write_log(log)
    command = (*SVO, "detect", "eclipse", str(log))
    turns(command, tmp_path / "bytecode", 1)
    assert min(ours / theirs for ours, theirs in turns(command, tmp_path / "bytecode", 2)) <= 3.0
