"""Programs of bad condition end at their optimum: no multipliers of HiGHS prove a lower bound than the core's."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from polytopes.highs import HighsProgram
from svo import WindowObserver
from svo.checks import Array
from svo.logs.drive import drive
from tests.oracle.cases import _log, _start
from tests.svo.observers.random_plants import random_plant

FLAT = (361, 459, 484, 537, 605)  # of the recorded windows: bounds were 1e-7 to 3e-4 of the width above the maximum


def proven(cost: Array, G: Array, lower: Array, upper: Array, multipliers: Array) -> float:
    """The bound of cost'z over lower <= G z <= upper, |z| <= 1 that multipliers of either sign prove."""
    rest = np.abs(cost - multipliers @ G).sum()
    return float(np.maximum(multipliers * lower, multipliers * upper).sum() + rest)


def excess(observer: WindowObserver) -> Iterator[float]:
    """How far each bound of the newest state is above what HiGHS proves, rounding apart, as a share of the width."""
    memory = observer._window.memory
    w, s = memory.arrays, memory.slot
    G, lower, upper = w["G"], w["lower"], w["upper"]
    program = HighsProgram(G, upper, row_lower=lower, lower=-1.0, upper=1.0)
    for i, direction in enumerate(w["T"]):
        width = w["now_upper"][i] - w["now_lower"][i]
        for sign, bound in ((1.0, w["now_upper"][i]), (-1.0, -w["now_lower"][i])):
            cost = sign * direction @ w["psi"]
            y = program.maximise(cost).multipliers
            best = min(proven(cost, G, lower, upper, y), proven(cost, G, lower, upper, -y))
            terms = np.abs(cost).sum() + np.abs(direction) @ w["mag"][s] + np.abs(y) @ w["magnitude"]
            rounding = np.abs(direction) @ w["err"][s] + 2.0**-48 * (len(cost) + len(y)) * terms
            yield (bound - sign * direction @ w["phi"][s] - best - rounding) / width


@pytest.mark.parametrize("seed", FLAT)
def test_no_other_solver_proves_a_lower_bound(seed: int) -> None:
    rng = np.random.default_rng([1, seed])
    model = random_plant(rng, 6)
    observer = WindowObserver(model, _start(model), horizon=10)
    worst = -np.inf
    for step in drive(observer, _log(model, rng, 12)):
        if step.verdict == "falsified":
            break
        assert step.box[0].shape == (model.n_states,)
        worst = max(worst, *excess(observer))
    assert -1e-9 <= worst <= 1e-9
    assert observer.stopped == 0
