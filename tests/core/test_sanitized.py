"""The whole library under AddressSanitizer and UBSan, driven by the tests of what calls it."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.core.compiler import ROOT
from tests.core.fuzz import run
from tests.core.sanitized import python, sanitized

pytestmark = pytest.mark.slow

FILES = (
    "tests/svo/observers/window/test_room_for_bases.py",
    "tests/svo/observers/window/test_nonlinear_at_once.py",
    "tests/svo/observers/test_gaps.py",
    "tests/svo/observers/test_late_measurements.py",
    "tests/svo/observers/test_memory_layouts.py",
    "tests/svo/observers/zonotope/test_zonotope_observer.py",
    "tests/svo/functions/test_tape_operations.py",
    "tests/svo/functions/test_random_tapes.py",
    "tests/svo/models/test_enclosed_exponential.py",
    "tests/svo/models/test_core_transitions.py",
    "tests/polytopes/test_row_redundancy.py",
    "tests/polytopes/test_projection.py",
    "tests/polytopes/test_boxes.py",
    "tests/polytopes/test_native.py",
    "tests/svo/baselines/test_filters.py",
    "tests/svo/interval/test_predictor.py",
    "tests/svo/interval/test_noise.py",
    "tests/aircraft/eclipse/test_simulator.py",
    "tests/aircraft/elevator/test_servo.py",
    "tests/aircraft/missile/test_missile_simulator.py",
)
"""Tests that together call every part of the library; windows that grow and that slide among them."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("sanitized")


@pytest.fixture(scope="module")
def environment(folder: Path) -> dict[str, str]:
    return sanitized(folder)


@pytest.mark.parametrize("file", FILES)
def test_nothing_is_found(environment: dict[str, str], folder: Path, file: str) -> None:
    options = ("-q", "-x", "-n", "0", "-p", "no:cacheprovider", "-c", str(ROOT / "pyproject.toml"))
    done = python(environment, folder, "-m", "pytest", *options, str(ROOT / file))
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-6000:]


GROWTH = """
import numpy as np
from polytopes import HPolytope
from svo import UncertainModel, Uncertainty, WindowObserver
model = UncertainModel(
    [[1.0, 0.1], [0.0, 1.0]], [[0.0], [0.1]], [[1.0, 0.0]], E=[[0.0], [0.1]], w=[0.2], n=[0.05], Ts=0.1,
    uncertainties=[Uncertainty(A=[[0.0, 0.0], [0.1, 0.0]])],
)
log = model.simulate([0.0, 0.0], np.ones((40, 1)), np.random.default_rng(0))
observer = WindowObserver(model, HPolytope.box([-1.0, -1.0], [1.0, 1.0]), horizon=None)
assert set(observer.run(log).verdicts) == {"consistent"}
assert observer._window.memory.size.N == 64
"""


def test_a_window_that_keeps_all_data_grows(environment: dict[str, str], folder: Path) -> None:
    done = python(environment, folder, "-c", GROWTH)
    assert done.returncode == 0, done.stderr


def test_no_random_window_leaves_its_arrays(environment: dict[str, str], folder: Path) -> None:
    assert run(environment, folder, seed=0, first=0, end=300) == 0


OUTSIDE = """
import numpy as np
from polytopes import native
from svo.observers import window_kernel as kernel
assert native.PATH.parent.parent.name.startswith("sanitized")
size = kernel.Sizes(n=1, nu=0, nw=1, ny=1, nq=0, nh=0, nt=1, na=1, ni=1, N=2, block=1, K=5, late=0)
block = kernel.allocate(size)
"""
FAULTS = {
    "a result that is too short": ("native.function('fdi_box', native.Integer, native.Integer, *[native.Entries] * 3)"
                                   "(2, 1, np.ones((1, 2)), np.ones(1), np.empty(1))", "heap-buffer-overflow"),
    "a row beyond the last": ("kernel.initialise(block.address, np.ones((9, 1)), np.ones(9), np.ones(9))",
                              "use-after-poison"),
    "a sum that overflows": ("block.arrays['clock'][:2] = 2**63 - 1; block.arrays['clock'][3] = 1; "
                             "kernel.take(block.address, 0.0, 9)", "signed integer overflow"),
}  # fmt: skip


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_found(environment: dict[str, str], folder: Path, fault: str) -> None:
    code, said = FAULTS[fault]
    done = python(environment, folder, "-c", OUTSIDE + code)
    assert done.returncode != 0
    assert said in done.stderr
