"""No kernel is compiled in the middle of a run: every layout and every kind of model reaches it in one form."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from polytopes import HPolytope
from svo import UncertainModel, WindowObserver
from svo.observers import window_kernel as kernel

PARTS: dict[str, Any] = {"A": [[1.0, 0.1], [0.0, 1.0]], "B": [[0.0], [0.1]], "E": [[0.0], [0.1]], "w": [0.2], "Ts": 0.1}
START = HPolytope.box([-1.0, -1.0], [1.0, 1.0])


def forms(values: list[float]) -> dict[str, Any]:
    array = np.array(values)
    locked = array.copy()
    locked.setflags(write=False)
    return {
        "strided": np.repeat(array, 2)[::2],
        "backwards": np.array(values[::-1])[::-1],
        "a column": np.column_stack([array, array])[:, 0],
        "Fortran": np.asfortranarray(np.vstack([array, array]))[0],
        "read-only": locked,
        "single precision": array.astype(np.float32),
        "list": values,
    }


def signatures() -> tuple[int, int, int]:
    return len(kernel.take.signatures), len(kernel.enter.signatures), len(kernel.solve.signatures)


@pytest.mark.parametrize("form", forms([0.0]))
def test_no_memory_layout_compiles_after_warm_up(form: str) -> None:
    observer = WindowObserver(UncertainModel(**PARTS, C=np.eye(2), n=[0.05, 0.05]), START)
    observer.warm_up()
    observer.update(y0=[0.0, 0.0])
    before = signatures()
    step = observer.step(u=forms([0.5])[form], y=forms([0.0, 0.05])[form])
    assert step.verdict == "consistent"
    assert signatures() == before


@pytest.mark.parametrize(
    "other",
    [
        {"C": [[1.0, 0.0]], "F": [[0.1]]},  # an exact sensor reads the disturbance, which leaves the program
        {"C": [[1.0, 0.0]], "n": [0.0]},
        {"C": [[1.0, 0.0]], "n": lambda s: [s], "schedule": 0.05},
        {"C": lambda s: [[1.0, s]], "n": [0.05], "schedule": 0.05},
    ],
    ids=["an exact sensor of w", "an exact sensor", "noise of the schedule", "C of the schedule"],
)
def test_no_kind_of_model_has_kernels_of_its_own(other: dict[str, Any]) -> None:
    """`svo detect` took a minute for a model with exact sensors, on a machine that had compiled everything."""
    WindowObserver(UncertainModel(**PARTS, C=[[1.0, 0.0]], n=[0.05]), START).warm_up()
    before = signatures()
    model = UncertainModel(**PARTS | other)
    log = model.simulate([0.0, 0.0], np.ones((30, 1)), np.random.default_rng(0), schedule=np.full(30, 0.05))
    assert WindowObserver(model, START).run(log).verdicts[-1] == "consistent"
    assert signatures() == before
