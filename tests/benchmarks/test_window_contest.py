"""The benchmark of the window observer: other solvers are asked the observer's own programs, and answer as it does."""

from __future__ import annotations

import numpy as np

from aircraft.eclipse.plant import Eclipse
from benchmarks._window_contest import highs, record
from benchmarks._window_references import PRIMAL
from benchmarks._window_runs import NOISE, SEED, observer_of


def test_highs_finds_the_bounds_of_the_observer_on_the_recorded_windows() -> None:
    plant, compared = Eclipse(model_kind="lpv"), 0
    log, model = plant.simulate("none", "none", NOISE, SEED), plant.models(NOISE)["nominal"]
    recording = record(observer_of(model), log)
    samples, boxes, centre, unit = recording.scaled(model)
    sample = highs(samples, recording, boxes, PRIMAL, rebuild=False)
    for k in range(60):
        theirs, ours = sample(k), recording.answers[k]
        if ours is None:
            continue
        axis = np.array(recording.queries[k].programs) // 2
        lower, upper = recording.boxes[k]
        assert np.abs(centre[axis] + unit[axis] * theirs - ours).max() <= 1e-5 * (upper - lower)[axis].min()
        compared += len(ours)
    assert compared > 50
