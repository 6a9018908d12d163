"""The window observer against general solvers: the same programs on the same windows, in turns.

The arrival sets are those that the observer found; every solver answers exactly the programs that the observer
solves at a sample.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from rich.table import Table

from benchmarks._window_references import (
    DEFAULT,
    DUAL,
    PRIMAL,
    CvxpyWindow,
    Floats,
    HighsWindow,
    Options,
    Query,
    ScaledSamples,
)
from benchmarks._window_runs import HORIZON, SETTLE, TURN, Sample, Times, observer_of, sampler
from svo.logs.log import Log
from svo.models.model import UncertainModel
from svo.observers import window_kernel as kernel
from svo.observers.window.observer import WindowObserver
from svo.observers.window.step import WindowStep

HIGHS_SAMPLES, CVXPY_SAMPLES = 300, 60
GOALS = {"HiGHS, warm": "15", "cvxpy + Clarabel": "100"}


@dataclass(frozen=True)
class Recording:
    """What the observer did along a log: the windows that it solved, and its answers.

    ``queries[k]`` is the query of sample k; ``boxes[k]`` the arrival box of its window (lower, upper); ``answers[k]``
    the bounds that it found, or None where it asked for emptiness only. All in absolute numbers.
    """

    log: Log
    steps: int
    queries: list[Query]
    boxes: list[tuple[Floats, Floats]]
    answers: list[Floats | None]
    slack: Floats

    def scaled(self, model: UncertainModel) -> tuple[ScaledSamples, list[tuple[Floats, Floats]], Floats, Floats]:
        """Samples and arrival boxes about the centre of the last box, in units of its half-widths; both besides."""
        centre = np.mean(self.boxes[-1], axis=0)
        unit = 0.5 * (self.boxes[-1][1] - self.boxes[-1][0])
        samples = ScaledSamples.of(model, self.log, self.slack, centre, unit)
        return samples, [((low - centre) / unit, (high - centre) / unit) for low, high in self.boxes], centre, unit


def record(observer: WindowObserver, log: Log) -> Recording:
    """Run a fresh observer once and keep what the other solvers need to solve the same windows."""
    sample, memory, form = sampler(observer, log), observer._window.memory, observer._form
    arrays, size = memory.arrays, memory.size
    queries, boxes, answers, slack = [], [], [], []
    new = arrays["new_upper"], arrays["new_lower"]
    for k in range(len(log)):
        step = sample(k)
        assert isinstance(step, WindowStep)
        assert step.verdict == "consistent"
        base, time = int(arrays["clock"][kernel.BASE]), int(arrays["clock"][kernel.TIME])
        programs = kernel.arrival_programs(memory.address)
        queries.append(Query(base, time, min(base + size.block, time), programs))
        boxes.append((arrays["h_lower"] * form.x, arrays["h_upper"] * form.x))
        bounds = time - base > size.N - size.block
        answers.append(np.array([new[p % 2][p // 2] * form.x[p // 2] for p in programs]) if bounds else None)
        slack.append(arrays["slack"][time % (size.N + 1)] * form.y)
    return Recording(log, size.N, queries, boxes, answers, np.array(slack))


@dataclass
class Contest:
    """Times of every method on the same windows, and how far their answers are from ours.

    ``differences`` are relative to the width of the window's arrival box in the same direction; ``compared`` counts
    the bounds, ``failures`` the answers that were not optimal.
    """

    times: dict[str, Times]
    differences: dict[str, float]
    compared: dict[str, int]
    failures: dict[str, int]


def compete(model: UncertainModel, log: Log, schedule: str) -> Contest:
    """All methods in turns on the same windows."""
    recording = record(observer_of(model, schedule=schedule), log)
    samples, boxes, centre, unit = recording.scaled(model)
    methods = {
        "ours": (sampler(observer_of(model, schedule=schedule), log), 1),
        "HiGHS, warm": (highs(samples, recording, boxes, PRIMAL, rebuild=False), 1),
        "HiGHS, warm, default options": (highs(samples, recording, boxes, DEFAULT, rebuild=False), 1),
        "HiGHS, rebuilt": (highs(samples, recording, boxes, DUAL, rebuild=True), 1),
        # one sample in 5, so that every place in a block of 4 is met equally often
        "cvxpy + Clarabel": (_cvxpy(samples, recording, boxes), HIGHS_SAMPLES // CVXPY_SAMPLES),
    }
    zero = dict.fromkeys(methods, 0)
    contest = Contest({m: Times() for m in methods}, dict.fromkeys(methods, 0.0), zero, zero.copy())
    for start in range(0, SETTLE + HIGHS_SAMPLES, TURN):
        for method, (call, every) in methods.items():
            for k in range(start, start + TURN):
                if start < SETTLE and every == 1:
                    call(k)
                elif start >= SETTLE and k % every == every // 2:  # not the first of a turn, which finds cold caches
                    result = contest.times[method].measure(call, k)
                    if method != "ours":
                        _compare(contest, method, result, recording, k, centre, unit)
    return contest


def highs(
    samples: ScaledSamples,
    recording: Recording,
    boxes: list[tuple[Floats, Floats]],
    options: Options,
    rebuild: bool,
) -> Sample:
    """A function that solves the recorded programs of sample k by HiGHS; to be called in order."""
    window = HighsWindow(samples, recording.steps, *boxes[0], options, rebuild)

    def sample(k: int) -> Floats:
        query = recording.queries[k]
        if k and query.base != recording.queries[k - 1].base:
            window.slide(query.base, *boxes[k])
        if k:
            window.advance(k)
        return window.solve(query)

    return sample


def _cvxpy(samples: ScaledSamples, recording: Recording, boxes: list[tuple[Floats, Floats]]) -> Sample:
    """One problem for each size of window and its programs, compiled here."""
    problems: dict[tuple[int, range], CvxpyWindow] = {}

    def sample(k: int) -> Floats:
        query = recording.queries[k]
        return problems[query.time - query.base, query.programs].solve(query, *boxes[k])

    for k in range(SETTLE, SETTLE + TURN):
        query = recording.queries[k]
        key = query.time - query.base, query.programs
        if key not in problems:
            problems[key] = CvxpyWindow(samples, *key, target=query.target - query.base)
            sample(k)
    return sample


def _compare(
    contest: Contest, method: str, result: object, recording: Recording, k: int, centre: Floats, unit: Floats
) -> None:
    assert isinstance(result, np.ndarray)
    contest.failures[method] += int(np.isnan(result).sum())
    answer, (lower, upper) = recording.answers[k], recording.boxes[k]
    if answer is not None:
        axis = np.array(recording.queries[k].programs) // 2
        theirs = centre[axis] + unit[axis] * result
        worst = float(np.nanmax(np.abs(theirs - answer) / (upper - lower)[axis], initial=0.0))
        contest.differences[method] = max(contest.differences[method], worst)
        contest.compared[method] += answer.size


def tabulate_contest(contests: Mapping[str, Contest]) -> Table:
    """Ratios first."""
    table = Table(title=f"Window observer, Eclipse, N = {HORIZON}, box template: ratios on the same windows in one run")
    for column in ("schedule", "against"):
        table.add_column(column)
    for column in ("ratio, median", "aim", "ratio of sums", "ratio, wall", "samples", "ours, median us",
                   "theirs, median us", "bounds", "largest difference", "not optimal"):  # fmt: skip
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
                str(contest.compared[method]), f"{contest.differences[method]:.0e}", str(contest.failures[method]),
            )  # fmt: skip
    return table
