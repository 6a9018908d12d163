"""The compiled core as a library: no fused instruction, a clear word where it is missing, a quick start."""

from __future__ import annotations

import subprocess
import sys

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


def test_the_first_detection_loads_nothing_that_it_does_not_need() -> None:
    heavy = ("scipy.stats", "scipy.signal", "pandas", "matplotlib", "cvxpy", "dask", "numba", "llvmlite")
    code = (
        "import sys; from svo.plant.registry import load_plant; from svo.detection.detect import detect; "
        "plant = load_plant('eclipse'); plant.bank(plant.noise_sets[0]); plant.scheduler(); "
        f"print([name for name in {heavy} if name in sys.modules])"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout.strip() == "[]"
