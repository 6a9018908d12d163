"""The scenarios of Table II over many seeds: delays of the residuals, false alarms, isolation by order in time.

``svo study missile`` includes it. Delays are counted from the first faulty sample, which itself counts as one sampling
time, to the RECEPTION of the measurement that gives the alarm: the two samples of the IMU's delay are in them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from aircraft.missile.adaptive import ModelError
from aircraft.missile.airframe import INPUTS
from aircraft.missile.isolability import isolability_table
from aircraft.missile.redundancy import TABLE_1, moving_mean, residuals, signature_matrix
from aircraft.missile.scenarios import DM, DN, SCENARIOS, TS, Flights, Run, Scenario, locked, noise_set, thrust_loss
from aircraft.missile.sequence import isolate_in_order
from svo.checks import Array, expect
from svo.indices import first_true, judge_alarm
from svo.plant import AddedStudy
from svo.store import write_csv, write_text

Flags = NDArray[np.bool_]

MEAN_SAMPLES = 10
SIGMAS = 5.0
LEARNT_FROM, LEARNT_TO = 5.0, 19.0  # s, before any fault
NEAR_INTERCEPT = 63.0  # s, from which on the geometry changes fast
RULES = ("fixed", "adaptive")
HEALTHY = "healthy"
NOT_AFTER = "-"  # the delay of what was isolated before it began
MAGNITUDES: dict[str, Scenario] = {
    **{
        f"eta -{100 * part:g} %": Scenario((thrust_loss(part, 30.0),), ("r14",))
        for part in (0.05, 0.1, 0.25, 0.5, 0.75)
    },
    "dm locked at 30 s": Scenario((locked(DM, 30.0),), ("r32",)),
    "dm locked at 50 s": Scenario((locked(DM, 50.0),), ("r32",)),
    "dn locked at 30 s": Scenario((locked(DN, 30.0),), ("r23",)),
    "dn locked at 50 s": Scenario((locked(DN, 50.0),), ("r23",)),
}


@dataclass(frozen=True)
class ResidualRow:
    """One residual of one flight under one decision rule.

    Attributes
    ----------
    scenario, noise, residual, rule : str
    seed : int
        Place of the flight among those of the study.
    event_s : float or None
        Time of the first fault that the residual depends on; None if it depends on none.
    delay_s : float or None
        To the first alarm; None if there is none, or if it came before the event: then it is no detection.
    false_alarms, late_false_alarms : int
        Samples in alarm before that event, before `NEAR_INTERCEPT` and after it.
    """

    scenario: str
    noise: str
    seed: int
    residual: str
    rule: str
    event_s: float | None
    delay_s: float | None
    false_alarms: int
    late_false_alarms: int


@dataclass(frozen=True)
class OrderRow:
    """Isolation by order in time in one flight: inputs and delays in their order, separated by spaces.

    A fault that is named before it began is wrong, and has a dash for its delay.
    """

    scenario: str
    noise: str
    seed: int
    true_order: str
    found_order: str
    wrong: bool
    isolation_delays_s: str
    sizes_contain_truth: bool


@dataclass(frozen=True)
class FlownCases:
    """A job of the study, and its row: one flight of every case with one noise set; rows as plain data.

    ``seed`` is the place of the flight among those of the study.
    """

    noise: str
    seed: int
    residuals: tuple[dict[str, Any], ...] = ()
    orders: tuple[dict[str, Any], ...] = ()
    error: str | None = None


@dataclass(frozen=True)
class ScenarioStudy:
    """All rows of a study."""

    residuals: tuple[ResidualRow, ...]
    orders: tuple[OrderRow, ...]

    @classmethod
    def of(cls, flown: Sequence[FlownCases]) -> ScenarioStudy:
        return cls(
            tuple(ResidualRow(**row) for cases in flown for row in cases.residuals),
            tuple(OrderRow(**row) for cases in flown for row in cases.orders),
        )

    def to_text(self) -> str:
        """Tables for people."""
        return "\n\n".join([_delay_text(self.residuals), _order_text(self.orders), signature_text(Flights())])

    def write(self, folder: Path) -> None:
        """scenario_residuals.csv, scenario_orders.csv and scenarios.txt."""
        for name, rows in (("residuals", self.residuals), ("orders", self.orders)):
            write_csv(folder / f"scenario_{name}.csv", [asdict(row) for row in rows])
        write_text(folder / "scenarios.txt", self.to_text() + "\n")


def scenario_study(runs: int, seed: int, noises: Sequence[str], flights: Flights | None = None) -> AddedStudy:
    """The study of every scenario, every magnitude, and without a fault: ``runs`` flights of each with each noise set.

    Raises
    ------
    ValueError
        If ``runs`` is below one, or a noise set is not known.
    """
    expect(runs >= 1, "runs", runs, "at least 1")
    for noise in noises:
        noise_set(noise)
    simulator = Flights() if flights is None else flights
    configuration = {"runs": runs, "seed": seed, "noises": list(noises), "model_error": simulator.model_error}
    jobs = [FlownCases(noise, i) for noise in noises for i in range(runs)]
    return AddedStudy(
        "scenarios",
        configuration,
        jobs,
        work=partial(_fly, simulator, seed),
        row=FlownCases,
        failed=lambda job, error: replace(job, error=error),
        write=lambda folder, rows: ScenarioStudy.of(rows).write(folder),
    )


def run_study(runs: int, seed: int, noises: Sequence[str], flights: Flights | None = None) -> ScenarioStudy:
    """Fly that study here and now; errors as of `scenario_study`."""
    study = scenario_study(runs, seed, noises, flights)
    return ScenarioStudy.of([study.work(job) for job in study.jobs])


def fixed_alarms(time: Array, values: Array) -> Flags:
    """Mean of ten samples further than 5 sigma from its mean, both learnt from 5 to 19 s; (K, R) like ``values``."""
    means = moving_mean(values, MEAN_SAMPLES)
    learnt = means[(time >= LEARNT_FROM) & (time < LEARNT_TO)]
    return np.abs(means - learnt.mean(axis=0)) > SIGMAS * learnt.std(axis=0)


def adaptive_alarms(simulator: Flights, run: Run, values: Array, names: Sequence[str]) -> Flags:
    """Residuals beyond what measurement and model errors can do (section III-C), sample by sample."""
    error = ModelError(run.errors, simulator.model_error)
    return np.abs(values) > error.residual_bounds(run.flight.y, simulator.airframe, names)


def signature_text(simulator: Flights) -> str:
    """Signature matrix and isolability table, computed from the residuals."""
    signature = signature_matrix(simulator.airframe)
    lines = ["signatures" + " " * 8 + "  ".join(f"{name:>3}" for name in INPUTS)]
    lines += [
        f"{name:<16}" + "  ".join(f"{int(on):>3}" for on in row) for name, row in zip(TABLE_1, signature, strict=True)
    ]
    return "\n".join(lines) + "\n\n" + isolability_table(signature, TABLE_1).to_text()


def _fly(simulator: Flights, study_seed: int, job: FlownCases) -> FlownCases:
    """One flight of every case, all with the same errors."""
    child = np.random.SeedSequence(study_seed, spawn_key=(job.seed,))
    cases = {HEALTHY: Scenario((), TABLE_1)} | {f"scenario {i}": s for i, s in SCENARIOS.items()} | MAGNITUDES
    rows: list[ResidualRow] = []
    orders: list[OrderRow] = []
    for name, scenario in cases.items():
        run = simulator.run(scenario.faults, noise_set(job.noise), child)
        rows += _residual_rows(simulator, run, scenario, name, job.noise, job.seed)
        orders.append(_order_row(simulator, run, scenario, name, job.noise, job.seed))
    return replace(job, residuals=tuple(map(asdict, rows)), orders=tuple(map(asdict, orders)))


def _residual_rows(
    simulator: Flights, run: Run, scenario: Scenario, name: str, noise: str, seed: int
) -> Iterator[ResidualRow]:
    log = residuals(run.flight.y, run.aligned_inputs, simulator.airframe, scenario.shown)
    supports = signature_matrix(simulator.airframe, scenario.shown)
    alarms = {
        "fixed": fixed_alarms(run.time, log.values),
        "adaptive": adaptive_alarms(simulator, run, log.values, scenario.shown),
    }
    for r, residual in enumerate(scenario.shown):
        relevant = [time for time, fault in scenario.events if supports[r, INPUTS.index(fault)]]
        event = min(relevant, default=None)
        first = len(run.time) if event is None else round(event / TS)
        for rule in RULES:
            flags = alarms[rule][:, r]
            late = run.time[:first] >= NEAR_INTERCEPT
            yield ResidualRow(
                name,
                noise,
                seed,
                residual,
                rule,
                event,
                judge_alarm(first_true(flags), first, TS).delay,
                int(flags[:first][~late].sum()),
                int(flags[:first][late].sum()),
            )


def _order_row(simulator: Flights, run: Run, scenario: Scenario, name: str, noise: str, seed: int) -> OrderRow:
    error = ModelError(run.errors, simulator.model_error)
    found = isolate_in_order(run.flight.y, run.aligned_inputs, simulator.airframe, error)
    times = {fault: time for time, fault in scenario.events}
    delays: list[float | None] = []
    contained = True
    for fault in found.faults:
        if fault.input not in times:
            continue
        delays.append(judge_alarm(fault.isolated, round(times[fault.input] / TS), TS).delay)
        j = INPUTS.index(fault.input)
        computed, achieved = (a[fault.isolated, j] for a in (run.flight.computed, run.flight.achieved))
        size = achieved if fault.kind == "locking" else achieved / computed
        contained = contained and fault.lower <= size <= fault.upper
    true_order = tuple(fault for _, fault in scenario.events)
    wrong = found.order != true_order[: len(found.order)] or None in delays
    shown = " ".join(NOT_AFTER if delay is None else f"{delay:.2f}" for delay in delays)
    return OrderRow(name, noise, seed, " ".join(true_order), " ".join(found.order), wrong, shown, contained)


def _delay_text(rows: Sequence[ResidualRow]) -> str:
    lines = [
        "delay [s]: median (min to max) over the flights detected; false: an alarm before the fault, so not detected",
        f"{'case':<19}{'noise':<10}{'residual':<10}{'rule':<10}{'reached':<10}{'delay':<22}{'false':<8}"
        f"false after {NEAR_INTERCEPT:g} s",
    ]
    groups: dict[tuple[str, str, str, str], list[ResidualRow]] = {}
    for row in rows:
        groups.setdefault((row.noise, row.scenario, row.residual, row.rule), []).append(row)
    for (noise, scenario, residual, rule), group in groups.items():
        delays = [row.delay_s for row in group if row.delay_s is not None]
        quiet = group[0].event_s is None
        shown = "quiet" if quiet else "-"
        if delays:
            shown = f"{np.median(delays):.2f} ({min(delays):.2f} to {max(delays):.2f})"
        reached = "" if quiet else f"{len(delays)}/{len(group)}"
        false, late = (
            sum(v > 0 for v in column)
            for column in zip(*((row.false_alarms, row.late_false_alarms) for row in group), strict=True)
        )
        lines.append(
            f"{scenario:<19}{noise:<10}{residual:<10}{rule:<10}{reached:<10}{shown:<22}"
            f"{f'{false}/{len(group)}':<8}{f'{late}/{len(group)}'}"
        )
    return "\n".join(lines)


def _order_text(rows: Sequence[OrderRow]) -> str:
    lines = ["isolation by order in time", f"{'case':<19}{'noise':<10}{'found':<16}{'flights':<10}median delays [s]"]
    groups: dict[tuple[str, str, str], list[OrderRow]] = {}
    for row in rows:
        groups.setdefault((row.noise, row.scenario, row.found_order or "nothing"), []).append(row)
    totals = {key: sum(r.noise == key[0] and r.scenario == key[1] for r in rows) for key in groups}
    for key, group in groups.items():
        columns = zip(*(row.isolation_delays_s.split() for row in group), strict=True)
        delays = [[float(v) for v in column if v != NOT_AFTER] for column in columns]
        shown = " ".join(f"{np.median(v):.2f}" if v else NOT_AFTER for v in delays)
        lines.append(f"{key[1]:<19}{key[0]:<10}{key[2]:<16}{f'{len(group)}/{totals[key]}':<10}{shown}")
    wrong = sum(row.wrong for row in rows)
    missed = sum(not row.sizes_contain_truth for row in rows)
    lines.append(f"wrong orders: {wrong}/{len(rows)}; bounds of a size that miss the truth: {missed}/{len(rows)}")
    return "\n".join(lines)
