"""Alarms of every kind of observer, and of logs with times of their own, proven and checked as files."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from proof_cases import Made, answer, proven, random_plant, steps_of
from scipy.linalg import expm

from svo import ConstrainedZonotopeObserver, Log, PolytopeObserver, UncertainModel, Uncertainty, WindowObserver

OSCILLATOR = np.array([[0.0, 1.0], [-1.0, -0.2]])
OTHERS = (ConstrainedZonotopeObserver, PolytopeObserver)


@pytest.mark.parametrize("kind", OTHERS)
@pytest.mark.parametrize("seed", [8, *(pytest.param(s, marks=pytest.mark.slow) for s in range(20) if s != 8)])
def test_alarms_of_other_observers_are_proven(kind: Any, seed: int, tmp_path: Path) -> None:
    plant, log = random_plant(seed)
    plant.kind = kind
    files = proven(plant, log, tmp_path)
    assert files is not None
    code, text = answer(*files)
    assert code == 0, text


def events(rng: np.random.Generator) -> tuple[Made, Log]:
    """An oscillator that is read at times of its own, and whose sensor jumps."""
    model = UncertainModel.from_continuous(
        OSCILLATOR, [[0.0], [1.0]], [[1.0, 0.0]], E=[[0.0], [1.0]], w=[0.1], n=[0.05], Ts=0.1,
        uncertainties=[Uncertainty(A=[[0.0, 0.0], [0.1, 0.0]])], remainder={"states": [4.0, 4.0], "inputs": [1.0]},
    )  # fmt: skip
    time = np.cumsum(rng.uniform(0.02, 0.3, 60))
    x, y, u = np.array([0.3, 0.0]), np.zeros((60, 1)), np.sin(time)[:, None]
    for k in range(60):
        y[k] = x[0] + rng.uniform(-0.05, 0.05) + (0.6 if k >= 40 else 0.0)
        if k + 1 < 60:
            steps = 50
            for _ in range(steps):  # Euler is near enough: the alarm is that of the jump
                x = x + (time[k + 1] - time[k]) / steps * np.array([x[1], u[k, 0] - x[0] - 0.2 * x[1]])
    return Made(model), Log(time, u, y)


@pytest.mark.parametrize("kind", [WindowObserver, *OTHERS])
def test_logs_with_times_of_their_own_are_proven(kind: Any, tmp_path: Path) -> None:
    plant, log = events(np.random.default_rng(3))
    plant.kind = kind
    files = proven(plant, log, tmp_path)
    assert files is not None
    code, text = answer(*files)
    assert code == 0, text
    assert "AXIOM" in text  # the matrices of each sample
    stacks = json.loads(files[1].read_text())["observers"]["nominal"]["matrices"]["stacks"]
    stated = np.array([float.fromhex(word) for word in stacks["hex"].split()]).reshape(stacks["shape"])
    for k, dt in enumerate(np.diff(log.time)):
        np.testing.assert_allclose(stated[k, 0, :2, :2], expm(OSCILLATOR * dt), rtol=1e-12)
    sample = next(step for step in steps_of(files[0]) if step.get("step") == "chain")["sample"]
    assert sample >= 40
    # at other times the matrices are others: a reading moved by a microsecond is refused
    lines = files[2].read_text().splitlines()
    cells = lines[sample - 1].split(",")
    lines[sample - 1] = ",".join([repr(float(cells[0]) + 1e-6), *cells[1:]])
    files[2].write_text("\n".join(lines) + "\n")
    code, text = answer(*files)
    assert code == 1
    assert "s apart, not" in text
