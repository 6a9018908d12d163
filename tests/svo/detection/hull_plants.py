"""Plants whose alarms by polytope observers no window proves: uncertainties of full rank, of states that turn."""

from __future__ import annotations

import numpy as np
from proof_cases import Made

from svo import Log, PolytopeObserver, UncertainModel, Uncertainty


def turning(seed: int) -> tuple[Made, Log]:
    """Of two states, one or two uncertainties of state and output, and a sensor that drifts from sample 12 on."""
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(2, 2))
    A *= 0.95 / np.abs(np.linalg.eigvals(A)).max()
    items = [Uncertainty(A=0.1 * rng.normal(size=(2, 2)), bounds=(-0.5, 0.5))]
    if seed % 2:
        items.append(Uncertainty(A=0.1 * rng.normal(size=(2, 2)), C=0.05 * rng.normal(size=(1, 2)), bounds=(0.0, 1.0)))
    model = UncertainModel(
        A, rng.normal(size=(2, 1)), rng.normal(size=(1, 2)), E=rng.normal(size=(2, 1)), w=[0.1], n=[0.1], Ts=1.0,
        uncertainties=items,
    )  # fmt: skip
    log = model.simulate(rng.uniform(-1.0, 1.0, 2), rng.normal(size=(24, 1)), rng)
    log.y[12:, 0] += rng.uniform(0.05, 0.3) * np.arange(12)
    plant = Made(model)
    plant.kind = PolytopeObserver
    return plant, log


def of_both_signs(seed: int) -> tuple[Made, Log]:
    """Of two states of either sign, of which one is read now and then, and a wide uncertainty of rank one."""
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(2, 2))
    A *= 0.9 / np.abs(np.linalg.eigvals(A)).max()
    item = Uncertainty(A=np.outer(rng.normal(size=2), rng.normal(size=2)))
    model = UncertainModel(A, rng.normal(size=(2, 1)), np.eye(2), n=[0.05, 0.05], Ts=1.0, uncertainties=[item])
    log = model.simulate(rng.uniform(-0.5, 0.5, 2), 0.3 * rng.normal(size=(8, 1)), rng)
    y = np.where(rng.random(log.y.shape) < 0.4, np.nan, log.y)
    y[4:, 0] += rng.uniform(0.1, 1.0)
    return Made(model, horizon=7, sign_split=200), Log(log.time, log.u, y)
