"""The window observer against HiGHS and against cvxpy with Clarabel, and its cost as the window grows.

Run with ``python -m benchmarks.window_observer``. One flight of the Eclipse (quiet noise, fixed seed), the nominal
observer, N = 10, box template. All methods solve the same windows: the arrival sets are those that the observer found.
They take turns of 20 samples on the same samples, so that the machine's noise hits all alike; ratios are medians over
the samples. Wall time counts what the scheduler takes away, CPU time (of the whole process) does not.

Two schedules:

as used       the observer slides by 2N//5 = 4 samples at once: every 4th sample 2n = 8 supports, at the others one
              program, which decides emptiness
every sample  the window slides by one sample: 8 supports at each; the first one also decides emptiness

A call includes everything from the new measurement to the verdict. HiGHS and cvxpy get the scaled numbers for nothing.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from time import perf_counter, perf_counter_ns, process_time_ns

import numpy as np
from numba.core import event
from rich.console import Console
from rich.table import Table

from aircraft.eclipse.plant import INITIAL_LOWER, INITIAL_UPPER, Eclipse
from benchmarks._window_references import CvxpyWindow, Floats, HighsWindow, Query, ScaledSamples
from polytopes import HPolytope
from svo.isolation.architectures import ArchitectureI
from svo.log import Log
from svo.model import UncertainModel
from svo.observers import window_kernel as kernel
from svo.observers.window import WindowObserver, WindowStep

NOISE, SEED, HORIZON = "quiet", 20_130_613, 10
HORIZONS = (1, 5, 10, 20, 50)
SCHEDULES = ("as used", "every sample")
SETTLE = 60  # samples before the first one that counts
TURN = 20  # samples that a method does at a time
HIGHS_SAMPLES, CVXPY_SAMPLES = 300, 60
GOALS = {"HiGHS, warm": "15", "cvxpy + Clarabel": "100"}


@dataclass
class Times:
    """Nanoseconds of calls, by the wall's clock and by the process' CPU clock, by sample."""

    wall: dict[int, int] = field(default_factory=dict)
    cpu: dict[int, int] = field(default_factory=dict)

    def measure(self, call: Callable[[int], object], k: int, at: int | None = None) -> object:
        """Call with sample k, and note the times as those of sample ``at`` (k itself by default)."""
        cpu, wall = process_time_ns(), perf_counter_ns()
        result = call(k)
        wall, cpu = perf_counter_ns() - wall, process_time_ns() - cpu
        at = k if at is None else at
        self.wall[at], self.cpu[at] = wall, cpu
        return result

    def microseconds(self, clock: str, keys: Iterable[int] | None = None) -> Floats:
        """Times of some samples, or of all."""
        values: dict[int, int] = getattr(self, clock)
        return np.array([values[k] for k in (values if keys is None else keys)]) * 1e-3


@dataclass(frozen=True)
class Recording:
    """What the observer did along a log: the windows that it solved, and its answers.

    ``queries[k]`` is the query of sample k; ``boxes[k]`` its arrival box (lower, upper); ``answers[k]`` the upper and
    lower bounds that it found, in turn, or None where it asked for emptiness only. All in absolute numbers.
    """

    log: Log
    steps: int
    queries: list[Query]
    boxes: list[tuple[Floats, Floats]]
    answers: list[Floats | None]
    slack: Floats


def observer_of(model: UncertainModel, horizon: int = HORIZON, schedule: str = "as used") -> WindowObserver:
    """A fresh observer of any flight between 25 and 55 m/s."""
    initial = HPolytope.box(INITIAL_LOWER, INITIAL_UPPER)
    observer = WindowObserver(model, initial, horizon=horizon)
    if schedule == "every sample":
        observer._block = 1
        observer.reset(initial)
    return observer


def drive(observer: WindowObserver | ArchitectureI, log: Log) -> Callable[[int], object]:
    """A function that gives an observer or a bank sample k of a log."""
    u, y, schedule = list(log.u), list(log.y), [log.schedule_at(k) for k in range(len(log))]

    def sample(k: int) -> object:
        if k == 0:
            return observer.update(y[0], schedule=schedule[0])
        return observer.step(u[k - 1], y[k], schedule=schedule[k])

    return sample


def record(model: UncertainModel, log: Log, schedule: str) -> Recording:
    """Run the observer once and keep what the other solvers need to solve the same windows."""
    observer = observer_of(model, schedule=schedule)
    sample, arrays, size = drive(observer, log), observer._arrays, observer._size
    queries, boxes, answers, slack = [], [], [], []
    for k in range(len(log)):
        step = sample(k)
        assert isinstance(step, WindowStep)
        assert step.verdict == "consistent"
        base, time = int(arrays["clock"][kernel.BASE]), int(arrays["clock"][kernel.TIME])
        full = time - base == size.N
        queries.append(Query(base, time, min(base + size.block, time), full))
        boxes.append((arrays["h_lower"].copy(), arrays["h_upper"].copy()))
        found = np.column_stack([arrays["new_upper"], arrays["new_lower"]]).ravel()
        answers.append(found.copy() if full else None)
        slack.append(arrays["slack"][time % (size.N + 1)].copy())
    return Recording(log, size.N, queries, boxes, answers, np.array(slack))


# -- against general solvers -------------------------------------------------------------------------------


@dataclass
class Contest:
    """Times of every method on the same windows, and how far their answers are from ours.

    ``differences`` are relative to the width of the arrival set in the same direction; ``failures`` counts answers
    that were not optimal.
    """

    times: dict[str, Times]
    differences: dict[str, float]
    failures: dict[str, int]


def compete(model: UncertainModel, log: Log, schedule: str) -> Contest:
    """All methods in turns on the same windows."""
    recording = record(model, log, schedule)
    centre = np.mean(recording.boxes[-1], axis=0)
    unit = 0.5 * (recording.boxes[-1][1] - recording.boxes[-1][0])
    samples = ScaledSamples.of(model, log, recording.slack, centre, unit)
    boxes = [((low - centre) / unit, (high - centre) / unit) for low, high in recording.boxes]
    methods = {
        "ours": (drive(observer_of(model, schedule=schedule), log), 1),
        "HiGHS, warm": (_highs(samples, recording, boxes, rebuild=False), 1),
        "HiGHS, rebuilt": (_highs(samples, recording, boxes, rebuild=True), 1),
        # one sample in 5, so that every place in a block of 4 is met equally often
        "cvxpy + Clarabel": (_cvxpy(samples, recording, boxes), HIGHS_SAMPLES // CVXPY_SAMPLES),
    }
    contest = Contest({m: Times() for m in methods}, dict.fromkeys(methods, 0.0), dict.fromkeys(methods, 0))
    for start in range(0, SETTLE + HIGHS_SAMPLES, TURN):
        for method, (call, every) in methods.items():
            for k in range(start, start + TURN):
                if start < SETTLE and every == 1:
                    call(k)
                elif start >= SETTLE and k % every == every // 2:  # not the first of a turn, which finds cold caches
                    result = contest.times[method].measure(call, k)
                    if method != "ours":
                        _compare(contest, method, result, recording.answers[k], centre, unit)
    return contest


def _highs(
    samples: ScaledSamples, recording: Recording, boxes: list[tuple[Floats, Floats]], rebuild: bool
) -> Callable[[int], object]:
    window = HighsWindow(samples, recording.steps, *boxes[0], rebuild=rebuild)

    def sample(k: int) -> Floats:
        query = recording.queries[k]
        if k and query.base != recording.queries[k - 1].base:
            window.slide(query.base, *boxes[k])
        if k:
            window.advance(k)
        return window.solve(query)

    return sample


def _cvxpy(samples: ScaledSamples, recording: Recording, boxes: list[tuple[Floats, Floats]]) -> Callable[[int], object]:
    """One problem for each size of window that occurs, compiled here."""
    problems: dict[tuple[int, int], CvxpyWindow] = {}

    def key(k: int) -> tuple[int, int]:
        query = recording.queries[k]
        return query.time - query.base, 2 * len(boxes[k][0]) if query.every else 1

    def sample(k: int) -> Floats:
        return problems[key(k)].solve(recording.queries[k], *boxes[k])

    for k in range(SETTLE, SETTLE + TURN):
        if key(k) not in problems:
            query = recording.queries[k]
            problems[key(k)] = CvxpyWindow(samples, *key(k), target=query.target - query.base)
            sample(k)
    return sample


def _compare(
    contest: Contest, method: str, result: object, answer: Floats | None, centre: Floats, unit: Floats
) -> None:
    assert isinstance(result, np.ndarray)
    contest.failures[method] += int(np.isnan(result).sum())
    if answer is not None:
        ours = (answer - np.repeat(centre, 2)) / np.repeat(unit, 2)
        width = np.repeat(ours[0::2] - ours[1::2], 2)
        worst = float(np.nanmax(np.abs(result - ours) / width, initial=0.0))
        contest.differences[method] = max(contest.differences[method], worst)


def tabulate_contest(contests: Mapping[str, Contest]) -> Table:
    """Ratios first."""
    table = Table(title=f"Window observer, Eclipse, N = {HORIZON}, box template: ratios on the same windows in one run")
    for column in ("schedule", "against"):
        table.add_column(column)
    for column in ("ratio, median", "aim", "ratio of sums", "ratio, wall", "samples", "ours, median us",
                   "theirs, median us", "largest difference", "not optimal"):  # fmt: skip
        table.add_column(column, justify="right")
    for schedule, contest in contests.items():
        for method, times in contest.times.items():
            if method == "ours":
                continue
            keys = list(times.cpu)
            ours, theirs = contest.times["ours"].microseconds("cpu", keys), times.microseconds("cpu", keys)
            wall = times.microseconds("wall", keys) / contest.times["ours"].microseconds("wall", keys)
            table.add_row(
                schedule, method, f"{np.median(theirs / ours):.1f}", GOALS.get(method, "-"),
                f"{theirs.sum() / ours.sum():.1f}", f"{np.median(wall):.1f}", str(len(keys)),
                f"{np.median(ours):.0f}", f"{np.median(theirs):.0f}",
                f"{contest.differences[method]:.0e}", str(contest.failures[method]),
            )  # fmt: skip
    return table


# -- our own cost ------------------------------------------------------------------------------------------


def alone(model: UncertainModel, logs: list[Log], schedule: str, between: Callable[[], object] | None) -> Times:
    """The observer by itself over several logs, with something done between its samples."""
    times = Times()
    for i, log in enumerate(logs):
        sample = drive(observer_of(model, schedule=schedule), log)
        for k in range(len(log)):
            if between is not None:
                between()
            if k < SETTLE:
                sample(k)
            else:
                times.measure(sample, k, at=i * len(log) + k)
    return times


def tabulate_alone(model: UncertainModel, logs: list[Log]) -> Table:
    """Absolute times, with what the processor's caches have to do with them."""
    title = f"One observer, N = {HORIZON}, {len(logs)} flights: microseconds a sample (aims: median 120, 99 % 300)"
    table = Table(title=title)
    table.add_column("schedule")
    table.add_column("between two samples")
    for column in ("median", "99 %", "median, CPU", "99 %, CPU", "mean, CPU"):
        table.add_column(column, justify="right")
    memory = np.zeros(1_000_000)
    cases = (
        ("as used", "nothing", None),
        ("as used", "8 MB of memory written", lambda: np.add(memory, 1.0, out=memory)),
        ("every sample", "nothing", None),
    )
    for schedule, name, between in cases:
        times = alone(model, logs, schedule, between)
        wall, cpu = times.microseconds("wall"), times.microseconds("cpu")
        numbers = (np.median(wall), np.quantile(wall, 0.99), np.median(cpu), np.quantile(cpu, 0.99), cpu.mean())
        table.add_row(schedule, name, *(f"{v:.0f}" for v in numbers))
    return table


def grow(plant: Eclipse, log: Log) -> dict[str, dict[int, Times]]:
    """Nominal observer, dynamics observer (one exact channel) and bank of four, over N, in turns."""
    runners: dict[tuple[str, int], Callable[[int], object]] = {}
    for N in HORIZONS:
        models = plant.models(NOISE)
        runners["nominal", N] = drive(observer_of(models["nominal"], N), log)
        runners["dynamics (a channel)", N] = drive(observer_of(models["dynamics"], N), log)
        runners["bank of four", N] = drive(replace(plant, horizon=N).bank(NOISE), log)
    result: dict[str, dict[int, Times]] = {}
    for start in range(0, len(log), TURN):
        for (name, N), sample in runners.items():
            times = result.setdefault(name, {}).setdefault(N, Times())
            for k in range(start, min(start + TURN, len(log))):
                if k < 2 * SETTLE:
                    sample(k)
                else:
                    times.measure(sample, k)
    return result


def exponent(times: Mapping[int, Times], first: int) -> float:
    """Slope of log mean CPU time over log N, from N = first on."""
    horizons = [N for N in times if first <= N]
    means = [times[N].microseconds("cpu").mean() for N in horizons]
    return float(np.polyfit(np.log(horizons), np.log(means), 1)[0])


def tabulate_growth(growth: Mapping[str, Mapping[int, Times]]) -> Table:
    """Mean and quantiles by N, and the fitted exponents."""
    title = "Growth with N: CPU microseconds a sample, median / mean / 99 % (aims: exponent 1.3, bank 600 at N = 10)"
    table = Table(title=title)
    table.add_column("observer")
    for N in HORIZONS:
        table.add_column(f"N = {N}", justify="right")
    table.add_column("exponent of the mean, 5 to 50 (10 to 50)", justify="right")
    for name, times in growth.items():
        cells = []
        for N in HORIZONS:
            cpu = times[N].microseconds("cpu")
            cells.append(f"{np.median(cpu):.0f} / {cpu.mean():.0f} / {np.quantile(cpu, 0.99):.0f}")
        table.add_row(name, *cells, f"{exponent(times, 5):.2f} ({exponent(times, 10):.2f})")
    return table


# -- the first step ----------------------------------------------------------------------------------------


def report_first_steps() -> None:
    """In a process of its own: times of the first calls after `warm_up`, as JSON on standard output."""
    plant = Eclipse()
    log, faulty = (plant.simulate(f, p, NOISE, SEED) for f, p in (("none", "none"), ("alpha", "step")))
    bank, second = plant.bank(NOISE), plant.bank(NOISE)
    begun = perf_counter()
    bank.warm_up()
    result = {"warm_up": perf_counter() - begun}
    with event.install_recorder("numba:compile") as compiled:
        healthy = bank.run(log).seconds[:, 0]
        alarms = second.run(faulty)
    alarm_at = alarms.died_at["nominal"]
    assert alarm_at is not None
    result |= {
        "first_update": healthy[0],
        "first_step": healthy[1],
        "largest_of_first_ten_steps": healthy[1:11].max(),
        "median_step": float(np.median(healthy[1:])),
        "first_alarm": alarms.seconds[alarm_at, 0],
        "compilations": len(compiled.buffer),
    }
    print(json.dumps(result))


def tabulate_first_steps() -> Table:
    """Start a process, and print what it measured."""
    code = "from benchmarks.window_observer import report_first_steps; report_first_steps()"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    result = json.loads(done.stdout)
    table = Table(title="A fresh process: the nominal observer after warm_up of the bank, wall time")
    table.add_column("what")
    table.add_column("microseconds", justify="right")
    table.add_column("of the median step", justify="right")
    for name, value in result.items():
        if name == "compilations":
            table.add_row("compilations after warm_up", str(value), "-")
        else:
            table.add_row(name.replace("_", " "), f"{1e6 * value:.0f}", f"{value / result['median_step']:.1f}")
    return table


def main(arguments: list[str] | None = None) -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.window_observer", description=__doc__.split("\n")[0])
    parser.add_argument("--flights", type=int, default=3, help="flights of 10 s for the absolute times")
    options = parser.parse_args([] if arguments is None else arguments)
    console, plant = Console(width=170), Eclipse()
    plant.bank(NOISE).warm_up()
    logs = [plant.simulate("none", "none", NOISE, SEED + i) for i in range(max(1, options.flights))]
    model = plant.models(NOISE)["nominal"]
    console.print(tabulate_contest({schedule: compete(model, logs[0], schedule) for schedule in SCHEDULES}))
    console.print("Largest difference: of the arrival bounds from ours, relative to the width of the arrival set.")
    console.print(tabulate_alone(model, logs))
    console.print(tabulate_growth(grow(plant, logs[0])))
    console.print(tabulate_first_steps())


if __name__ == "__main__":
    main(sys.argv[1:])
