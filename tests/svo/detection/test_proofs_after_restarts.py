"""Whole proofs of alarms of observers that a bank started again, of a state that readings alone never bound."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from proof_cases import Made, answer, proven, steps_of

from polytopes import HPolytope
from svo import (
    ArchitectureI,
    ArchitectureII,
    ConstrainedZonotopeObserver,
    Log,
    PolytopeObserver,
    UncertainModel,
    Uncertainty,
    WindowObserver,
)

START = HPolytope.box([-1.0, -1.0], [1.0, 1.0])
ANYWHERE = HPolytope.box([-100.0, -100.0], [100.0, 100.0])
MODEL = UncertainModel(
    [[0.9, 0.0], [0.0, 1.0]], None, [[1.0, 0.0]], E=[[0.05], [0.0]], w=[0.2], n=[0.05], Ts=0.1,
    uncertainties=[Uncertainty(A=[[0.02, 0.0], [0.0, 0.0]])],
)  # fmt: skip
FAST = MODEL.replace(A=[[0.5, 0.0], [0.0, 1.0]])  # does not contain the other one
DRIFTING = MODEL.replace(A=np.eye(2), E=[[1.0], [0.0]], w=([0.2], [0.3]))  # its state is another at each sample
KINDS = (WindowObserver, ConstrainedZonotopeObserver, PolytopeObserver)


class Banked(Made):
    """A plant with a bank of its own."""

    def __init__(self, bank: Callable[[], Any]) -> None:
        super().__init__(MODEL)
        self._bank = bank

    def bank(self, noise: str) -> Any:
        return self._bank()


def jumps(*samples: int, model: UncertainModel = MODEL) -> Log:
    """A healthy run but for readings that are wrong by 2."""
    log = model.simulate([0.3, 0.0], np.zeros((samples[-1] + 8, 0)), np.random.default_rng(0))
    log.y[list(samples)] += 2.0
    return log


@pytest.mark.parametrize(
    ("kind", "options", "log", "since"),
    [
        (
            WindowObserver,
            {"debounce": 2, "recovery": 8},
            jumps(5, 20, 22, model=DRIFTING),
            19,
        ),  # the one at 5 is forgotten
        (WindowObserver, {"recovery": 4}, jumps(6, 7, 8, model=DRIFTING), 0),
        *((kind, {"debounce": 2}, jumps(6, 8, model=DRIFTING), 5) for kind in KINDS),
    ],
)
def test_an_observer_that_began_again_from_what_the_survivors_left(
    kind: Any, options: dict[str, int], log: Log, since: int, tmp_path: Path
) -> None:
    files = proven(Banked(lambda: ArchitectureI(kind(DRIFTING, START), {}, **options)), log, tmp_path)
    assert files is not None
    code, text = answer(*files)
    assert code == 0, text
    assert (f"ASSUMED at sample {since} " in text) is (since > 0)
    if since:
        stated = next(step for step in steps_of(files[0]) if step.get("step") == "start")["set"]
        lower, upper = (float.fromhex(stated[end]["hex"].split()[0]) for end in ("box_lower", "box_upper"))
        assert lower - 0.05 <= log.y[since, 0] <= upper + 0.05
        assert upper - lower < 0.25


def test_an_observer_that_falls_where_it_begins(tmp_path: Path) -> None:
    """No state of the global set explains the reading of the detection."""
    log = jumps(4, 5, 6)
    log.y[4:7] += 200.0
    bank = lambda: ArchitectureII(WindowObserver(MODEL, START), {"fast": WindowObserver(FAST, START)}, ANYWHERE)  # noqa: E731
    files = proven(Banked(bank), log, tmp_path)
    assert files is not None
    code, text = answer(*files)
    assert code == 0, text
    assert "PROVEN: 'fast' is falsified at sample 4" in text
    assert "ASSUMED at sample 4 (left by others' models): -100 to 100, -100 to 100" in text


@pytest.mark.parametrize(
    ("kind", "options"),
    [
        (WindowObserver, {}),
        (WindowObserver, {"debounce": 2, "recovery": 4}),
        *((kind, {"recovery": 4}) for kind in KINDS),
    ],
)
def test_an_observer_that_began_at_the_detection(kind: Any, options: dict[str, int], tmp_path: Path) -> None:
    def bank() -> ArchitectureII:
        return ArchitectureII(kind(MODEL, START), {"fast": kind(FAST, START)}, ANYWHERE, **options)

    files = proven(Banked(bank), jumps(*range(4, 10)), tmp_path)
    assert files is not None
    code, text = answer(*files)
    assert code == 0, text
    assert "PROVEN: 'fast'" in text
    assert "-100 to 100, -100 to 100" in text


def test_without_a_set_nothing_is_assumed() -> None:
    observer = WindowObserver(MODEL, START)
    assert observer.first_set is not None
    observer.lose_set()
    assert observer.first_set is None
    observer.reset(START)
    assert observer.first_set is not None
    largest = WindowObserver(MODEL.replace(largest=([-5.0, -5.0], [5.0, 5.0])), START)
    largest.lose_set()
    assert largest.first_set is not None
    assert largest.first_set.box_upper.tolist() == [5.0, 5.0]
