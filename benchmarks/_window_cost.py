"""What the window observer costs by itself: absolute times, growth with the window, first calls in a new process."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from time import perf_counter

import numpy as np
from rich.table import Table

from aircraft.eclipse.plant import Eclipse
from benchmarks._window_runs import HORIZON, NOISE, SCHEDULES, SEED, SETTLE, TURN, Sample, Times, observer_of, sampler
from svo.isolation.bank import Bank
from svo.logs.log import Log
from svo.observers.window.observer import WindowObserver

HORIZONS = (1, 5, 10, 20, 50)


def alone(start: Callable[[], WindowObserver | Bank], logs: list[Log], between: Callable[[], object]) -> Times:
    """An observer or a bank by itself over several logs, with something done between its samples."""
    times = Times()
    for i, log in enumerate(logs):
        sample = sampler(start(), log)
        for k in range(len(log)):
            between()
            if k < SETTLE:
                sample(k)
            else:
                times.measure(sample, k, at=i * len(log) + k)
    return times


def tabulate_alone(plant: Eclipse, logs: list[Log]) -> Table:
    """Absolute times, with what the processor's caches have to do with them."""
    title = f"N = {HORIZON}, {len(logs)} flights: microseconds a sample (aims: median 120, 99 % 300; bank 600)"
    table = Table(title=title)
    for column in ("observer", "schedule", "between two samples"):
        table.add_column(column)
    for column in ("median", "99 %", "median, CPU", "99 %, CPU", "mean, CPU"):
        table.add_column(column, justify="right")
    memory, models = np.zeros(1_000_000), plant.models(NOISE)
    betweens: dict[str, Callable[[], object]] = {
        "nothing": lambda: None,
        "8 MB of memory written": lambda: np.add(memory, 1.0, out=memory),
    }
    starts: dict[tuple[str, str], Callable[[], WindowObserver | Bank]] = {
        (name, SCHEDULES[0]): partial(observer_of, model) for name, model in models.items()
    }
    starts["bank of four", SCHEDULES[0]] = partial(plant.bank, NOISE)
    starts["nominal", SCHEDULES[1]] = partial(observer_of, models["nominal"], schedule=SCHEDULES[1])
    for (name, schedule), start in starts.items():
        for label, between in betweens.items():
            times = alone(start, logs, between)
            wall, cpu = times.microseconds("wall"), times.microseconds("cpu")
            numbers = (np.median(wall), np.quantile(wall, 0.99), np.median(cpu), np.quantile(cpu, 0.99), cpu.mean())
            table.add_row(name, schedule, label, *(f"{v:.0f}" for v in numbers))
    return table


def grow(plant: Eclipse, log: Log) -> dict[str, dict[int, Times]]:
    """Nominal observer, dynamics observer (one exact channel) and bank of four, over N, in turns."""
    runners: dict[tuple[str, int], Sample] = {}
    for N in HORIZONS:
        models = plant.models(NOISE)
        runners["nominal", N] = sampler(observer_of(models["nominal"], N), log)
        runners["dynamics (a channel)", N] = sampler(observer_of(models["dynamics"], N), log)
        runners["bank of four", N] = sampler(replace(plant, horizon=N).bank(NOISE), log)
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


def report_first_steps() -> None:
    """In a process of its own: times of the first calls after `warm_up`, as JSON on standard output."""
    plant = Eclipse(model_kind="lpv")
    log, faulty = (plant.simulate(f, p, NOISE, SEED) for f, p in (("none", "none"), ("alpha", "step")))
    bank, second = plant.bank(NOISE), plant.bank(NOISE)
    begun = perf_counter()
    bank.warm_up()
    result = {"warm_up": perf_counter() - begun}
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
    }
    print(json.dumps(result))


def tabulate_first_steps() -> Table:
    """Start a process, and print what it measured."""
    code = "from benchmarks._window_cost import report_first_steps; report_first_steps()"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    result = json.loads(done.stdout)
    table = Table(title="A fresh process: the nominal observer after warm_up of the bank, wall time")
    table.add_column("what")
    table.add_column("microseconds", justify="right")
    table.add_column("of the median step", justify="right")
    for name, value in result.items():
        table.add_row(name.replace("_", " "), f"{1e6 * value:.0f}", f"{value / result['median_step']:.1f}")
    return table
