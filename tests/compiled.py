"""Compile the kernels once, in two processes, where each worker of the tests would: ``python -m tests.compiled``.

What is compiled already is loaded from the cache, in a second or two.
"""

from __future__ import annotations

import multiprocessing
from typing import Any

import numpy as np

import polytopes
from polytopes import HPolytope
from svo import UncertainModel, Uncertainty, WindowObserver
from svo.plant import load_plant


def observer(**options: Any) -> WindowObserver:
    model = UncertainModel([[0.9]], [[1.0]], [[1.0]], n=[0.1], uncertainties=[Uncertainty(A=[[0.1]])])
    return WindowObserver(model, HPolytope.box([-1.0], [1.0]), **options)


def whole_samples() -> None:
    """The kernel that takes a sample with all its programs, and the simulators."""
    observer().update([0.0])
    for name in ("eclipse", "elevator", "missile"):
        plant = load_plant(name)
        plant.simulate("none", "none", plant.noise_sets[0], 0)


def sets_and_parts_of_samples() -> None:
    """A window that splits by signs takes its samples in parts."""
    polytopes.warm_up()
    in_parts = observer(sign_split=2)
    in_parts.update([0.0])
    in_parts.step(u=[0.0], y=[0.0]).box  # noqa: B018
    in_parts.late_update([np.nan], 0)


def main() -> None:
    context = multiprocessing.get_context("spawn")
    workers = [context.Process(target=part) for part in (whole_samples, sets_and_parts_of_samples)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    if any(worker.exitcode for worker in workers):
        raise SystemExit(1)


if __name__ == "__main__":
    main()
