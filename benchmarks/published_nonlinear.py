"""Nonlinear examples whose results CORA prints, with the same bounds, inputs and readings: widths side by side.

Run with ``python -m benchmarks.published_nonlinear``; some seconds of CPU. One is an estimation from readings; in the
others nothing is read, which leaves the prediction alone. CORA prints no times. `docs/benchmarks.md` says what differs.
"""

from __future__ import annotations

from time import process_time

import numpy as np

from benchmarks._cora_examples import EXAMPLES, Box, Example
from benchmarks._observers import console, table
from svo import WindowObserver


def estimated(example: Example, horizon: int) -> tuple[Box, float]:
    """Our box of the last sample, and CPU seconds a sample."""
    begun = process_time()
    observer = WindowObserver(example.model, example.initial, horizon=horizon)
    step = observer.update(y0=example.readings[0])
    for u, y in zip(example.inputs[:-1], example.readings[1:], strict=True):
        step = observer.step(u=u, y=y)
        assert step.verdict == "consistent", step
    return step.box, (process_time() - begun) / len(example.readings)


def common(one: Box, other: Box) -> bool:
    """Whether two boxes have a point in common: both contain the true state."""
    return bool((np.maximum(one[0], other[0]) <= np.minimum(one[1], other[1])).all())


def main() -> None:
    """Run every example and print its widths."""
    for name, make in EXAMPLES.items():
        example = make()
        rows = [[f"CORA: {label}", *_widths(box), ""] for label, box in example.printed.items()]
        for horizon in example.horizons:
            box, seconds = estimated(example, horizon)
            assert all(common(box, other) for other in example.printed.values())
            rows.append([f"ours: N = {horizon}", *_widths(box), f"{1e3 * seconds:.1f}"])
        table(f"{name}: widths at the last sample", ["", *example.model.states, "CPU ms a sample"], rows)
        console.print(example.source, style="dim")


def _widths(box: Box) -> list[str]:
    return [f"{width:.4g}" for width in box[1] - box[0]]


if __name__ == "__main__":
    main()
