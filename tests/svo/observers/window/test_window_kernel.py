"""The face of the core's window: its numbers are those of the header, its block has every array where it says."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from svo.models import normal_form
from svo.observers import window_kernel as kernel

HEADER = re.sub(
    r"/\*.*?\*/", "", (Path(__file__).parents[4] / "core/window/window.h").read_text("utf-8"), flags=re.DOTALL
)
SIZE = kernel.Sizes(n=3, nu=1, nw=2, ny=2, nq=1, nh=0, nt=4, na=1, ni=2, N=6, block=2, K=9, late=1)


def test_the_constants_are_those_of_the_header() -> None:
    names = [re.findall(r"\w+", body) for body in re.findall(r"^enum \{(.*?)\}", HEADER, re.MULTILINE | re.DOTALL)]
    shared = {name: value for body in names for value, name in enumerate(body) if hasattr(kernel, name)}
    assert {"CONSISTENT", "ARRIVAL", "FINE", "OUTGROWN", "BASE", "REFACTORED"} <= set(shared)
    assert {name: getattr(kernel, name) for name in shared} == shared
    defined = dict(re.findall(r"#define (\w+) (0x1p\d+)", HEADER))
    assert float.fromhex(defined["LARGEST"]) == kernel.LARGEST
    assert float.fromhex(defined["ENORMOUS"]) == normal_form.ENORMOUS


def test_the_arrays_of_a_block_lie_apart_and_aligned() -> None:
    block = kernel.allocate(SIZE)
    for number, array in enumerate(block.arrays.values()):
        assert array.__array_interface__["data"][0] % 64 == 0
        array.reshape(-1).view(np.uint8)[:] = number
    parts = [array.reshape(-1).view(np.uint8) for array in block.arrays.values()]
    assert all((part == number).all() for number, part in enumerate(parts))
    assert block.arrays["G"].shape == (1 + 7 * 4, 3 + 7 * 3)
    assert block.arrays["owner"].dtype == block.arrays["clock"].dtype == np.int64
    assert "inverse" in block.kept
    assert "z" not in block.kept
