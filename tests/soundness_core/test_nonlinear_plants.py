"""Window observers of nonlinear plants: the true state stays inside and nothing is falsified."""

from __future__ import annotations

import numpy as np
import pytest

from polytopes import HPolytope
from svo import WindowObserver
from svo.logs.drive import drive
from tests.svo.models.nonlinear_plants import CASES


@pytest.mark.parametrize("name", CASES)
def test_the_true_state_is_never_lost(name: str) -> None:
    case, rng = CASES[name](), np.random.default_rng(11)
    log = case.model.simulate(case.x0, case.inputs(25), rng, corners=True, substeps=10 if case.smooth else 40)
    observer = WindowObserver(case.model, HPolytope.box(case.x0 - case.spread, case.x0 + case.spread), horizon=6)
    for k, step in enumerate(drive(observer, log)):
        assert step.verdict != "falsified", k
        low, high = step.box
        room = 1e-6 * (high - low)  # the integrator's error
        assert ((low - room <= log.x[k]) & (log.x[k] <= high + room)).all(), k
