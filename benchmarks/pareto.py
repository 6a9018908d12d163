"""The Eclipse: time to detect a slow fault of alpha and width of the sets, against the cost of a sample.

Run with ``python -m benchmarks.pareto``. The nominal observer for several N and two templates (box; rows C A^-j as
well), and the zonotope observer, which has no horizon; with all four sensors and with alpha and theta only. CPU time
of the steps, boxes not read.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from time import process_time_ns
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from rich.progress import track

from aircraft.eclipse.plant import INITIAL_LOWER, INITIAL_UPPER, Eclipse
from benchmarks._observers import arguments, console, output_directions, save, table
from polytopes import HPolytope
from svo import ConstrainedZonotopeObserver, WindowObserver
from svo.logs.drive import drive
from svo.logs.log import Log
from svo.plant import first_faulty_sample

NOISE, SEED, HORIZONS, SETTLE = "quiet", 20_261_127, (1, 2, 5, 10, 20), 30
WIDTH_EVERY = 10
ZONOTOPE = "zonotope"
MARKERS = {"box": "o", "rows C A^-j": "s", ZONOTOPE: "^"}


def fly(observer: Any, log: Log, y: np.ndarray, widths: bool) -> tuple[int | None, float, np.ndarray]:
    """First alarm, median microseconds and mean width of each state over a log."""
    times, boxes, answers = [], [], drive(observer, replace(log, y=y))
    for k in range(len(log)):
        begun = process_time_ns()
        step = next(answers)
        times.append(1e-3 * (process_time_ns() - begun))
        if step.verdict == "falsified":
            return k, float(np.median(times[SETTLE:])), np.array(boxes)
        if widths and k >= SETTLE and k % WIDTH_EVERY == 0:
            lower, upper = step.box
            boxes.append(upper - lower)
    return None, float(np.median(times[SETTLE:])), np.mean(boxes, axis=0) if boxes else np.zeros(0)


def main(given: list[str] | None = None) -> None:
    """Fly, print and draw."""
    parser = arguments("pareto", __doc__)
    parser.add_argument("--flights", type=int, default=3)
    options = parser.parse_args([] if given is None else given)
    plant = Eclipse(model_kind="lpv")
    model = plant.models(NOISE)["nominal"]
    initial = HPolytope.box(INITIAL_LOWER, INITIAL_UPPER)
    templates: dict[str, Any] = {"box": "box", "rows C A^-j": output_directions(model, 2)}
    outputs = list(model.names["outputs"]) if model.names else []
    hidden = [i for i, name in enumerate(outputs) if not name.startswith(("alpha", "theta"))]
    healthy = [plant.simulate("none", "none", NOISE, SEED + i) for i in range(options.flights)]
    faulty = [plant.simulate("alpha", "soft", NOISE, SEED + i) for i in range(options.flights)]
    WindowObserver(model, initial).warm_up()
    rows, points = [], []
    sets = [(t, N) for t in templates for N in HORIZONS] + [(ZONOTOPE, 0)]
    cases = [(s, t, N) for s in ("all sensors", "alpha and theta") for t, N in sets]
    for sensors, template, N in track(cases, "observers", console=console, transient=True):
        delays, times, widths = [], [], []
        for log, bad in zip(healthy, faulty, strict=True):
            for data, is_healthy in ((log, True), (bad, False)):
                y = data.y.copy()
                if sensors == "alpha and theta":
                    y[:, hidden] = np.nan
                observer = (
                    ConstrainedZonotopeObserver(model, initial)
                    if template == ZONOTOPE
                    else WindowObserver(model, initial, horizon=N, template=templates[template])
                )
                found, cost, width = fly(observer, data, y, is_healthy)
                if is_healthy:
                    assert found is None
                    times.append(cost)
                    widths.append(width)
                else:
                    begin = first_faulty_sample(plant, "alpha", "soft", data.time)
                    delays.append(np.inf if found is None else (found - begin + 1) * model.Ts)
        points.append((sensors, template, N, np.median(times), np.mean(widths, axis=0), np.mean(delays)))
    reference = {s: np.min([p[4] for p in points if p[0] == s], axis=0) for s, *_ in points}
    drawn = [(s, t, N, cost, float(np.mean(w / reference[s])), delay) for s, t, N, cost, w, delay in points]
    for s, t, N, cost, width, delay in drawn:
        rows.append([f"{s}, {t}", N or "-", f"{cost:.0f}", f"{width:.3f}", f"{delay:.2f}"])
    table(
        f"Eclipse, {NOISE} noise, soft fault of alpha, {options.flights} flights from seed {SEED}",
        ("sensors, template", "N", "CPU us a sample", "width, to the least", "mean delay, s"), rows,
    )  # fmt: skip
    figure, axes = plt.subplots(1, 2, figsize=(11, 4.5))
    for s in reference:
        for t in (*templates, ZONOTOPE):
            mine = [p for p in drawn if p[:2] == (s, t)]
            for ax, column in zip(axes, (5, 4), strict=True):
                line = "-" if s == "all sensors" else "--"
                costs, values = [p[3] for p in mine], [p[column] for p in mine]
                ax.plot(costs, values, label=f"{s}, {t}", marker=MARKERS[t], linestyle=line)
                for p in mine:
                    at = p[3], p[column]
                    ax.annotate(str(p[2] or ""), at, textcoords="offset points", xytext=(4, 4), fontsize=8)
    axes[0].set_ylabel("mean time to detect a soft fault of alpha [s]")
    axes[1].set_ylabel("mean width of the box, relative to the least")
    for ax in axes:
        ax.set_xlabel("CPU time a sample [us]; numbers are N")
        ax.set_xscale("log")
        ax.set_yscale("log")
    axes[0].legend(fontsize=8)
    save(figure, options.out, "pareto.png")


if __name__ == "__main__":
    main(sys.argv[1:])
