"""Compile the kernels once, in two processes, where each worker of the tests would: ``python -m tests.compiled``.

What is compiled already is loaded from the cache, in a second or two. Plants are made here and not looked up, for the
tests' own needs may still be installing.
"""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import Any

import numpy as np

import polytopes
from aircraft.eclipse.plant import eclipse
from aircraft.elevator.plant import elevator
from aircraft.missile.plant import missile
from polytopes import HPolytope
from svo import UncertainModel, Uncertainty, WindowObserver
from svo.baselines import GaussianModel, InnovationFilter, MultipleModelFilter, ParitySpace

MODEL = UncertainModel([[0.9]], [[1.0]], [[1.0]], n=[0.1], uncertainties=[Uncertainty(A=[[0.1]])])
START = HPolytope.box([-1.0], [1.0])


def samples_at_once() -> None:
    """The kernel that takes a sample with all its programs."""
    WindowObserver(MODEL, START).update([0.0])


def samples_in_parts() -> None:
    """A window that splits by signs takes its samples in parts."""
    in_parts = WindowObserver(MODEL, START, sign_split=2)
    in_parts.update([0.0])
    in_parts.step(u=[0.0], y=[0.0]).box  # noqa: B018
    in_parts.late_update([np.nan], 0)


def detectors() -> None:
    certain = MODEL.replace(uncertainties=[])
    log = certain.simulate([0.0], np.zeros((5, 1)), np.random.default_rng(0))
    model = GaussianModel(certain, START)
    for detector in (
        InnovationFilter(model),
        MultipleModelFilter({"a": model, "b": model}),
        ParitySpace(model, order=2),
    ):
        detector.run(log)


def simulators() -> None:
    plants: tuple[Any, ...] = (eclipse(), elevator(), missile())
    for plant in plants:
        plant.simulate("none", "none", plant.noise_sets[0], 0)


PARTS = (samples_at_once, polytopes.warm_up, samples_in_parts, detectors, simulators)


def main() -> None:
    with ProcessPoolExecutor(2, get_context("spawn")) as pool:
        for part in [pool.submit(part) for part in PARTS]:
            part.result()


if __name__ == "__main__":
    main()
