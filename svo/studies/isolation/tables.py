"""The tables of a study as rows of text, for the terminal and for the report alike."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Protocol

import numpy as np

from svo.pages.tables import TextTable
from svo.plant import HEALTHY, BankChoice, Plant
from svo.plant.choice import what_differs
from svo.studies.isolation.summary import ConditionSummary
from svo.studies.statistics import Delays, Share

NO_MEAN, NOT_WITHIN_RUN = "–", "∞"


def delay_table(plant: Plant, summaries: Sequence[ConditionSummary]) -> TextTable:
    """Delays of one noise set beside the paper's, in seconds.

    Each delay is given as mean over the runs that reached it, median and 5-95 % range over all runs (an infinity
    sign where the quantile falls among those that did not), and the number of runs that reached it.
    """
    titles = bank_titles(summaries)
    several = len(titles) > 1
    header = ["fault", "profile", *["bank"] * several]
    for event in ("detect", "isolate"):
        header += [f"{event} [s]\nmean", "\nmedian", "\n5–95 %", "\nruns"] + ["\npaper"] * bool(plant.reference)
    header += ["false\nalarms", "wrong\nisol."]
    rows = [_delay_row(plant, summary, [titles[summary.bank]] * several) for summary in summaries]
    return TextTable(f"{summaries[0].noise} noise: {plant.title}", tuple(header), tuple(rows), labels=2 + several)


class OfBank(Protocol):
    """A row or a summary of runs of one bank."""

    @property
    def bank(self) -> BankChoice: ...


def bank_titles(of_banks: Iterable[OfBank]) -> dict[BankChoice, str]:
    """The banks, in order, each with what tells it from the others in a few letters; a single one needs none."""
    banks = list(dict.fromkeys(s.bank for s in of_banks))
    return dict(zip(banks, (", ".join(filter(None, own)) for own in what_differs(banks)), strict=True))


def not_isolated(summaries: Sequence[ConditionSummary]) -> list[str]:
    """One line for each fault and profile with runs that were not isolated: how many, and who survived."""
    lines = []
    for s in summaries:
        if s.survivors:
            who = "; ".join(f"{names} ({count})" for names, count in s.survivors.items())
            runs = f"{sum(s.survivors.values())} of {s.runs} runs"
            where = ", ".join(filter(None, (f"{s.noise} noise", s.bank.title)))
            lines.append(f"not isolated, {where}: {s.fault} {s.profile} in {runs}; alive at the end: {who}")
    return lines


def counts(summaries: Sequence[ConditionSummary]) -> list[str]:
    """The lines on alarms that should not be, with 95 % intervals of their rates."""
    faulty = [s for s in summaries if s.fault != HEALTHY]
    healthy = [s for s in summaries if s.fault == HEALTHY]
    lines = []
    if healthy:
        lines.append(f"fault-free runs with an alarm: {_with_bound(total(s.false_alarms for s in healthy))}")
    if faulty:
        detected, isolated = (total(getattr(s, name).reached for s in faulty) for name in ("detect", "isolate"))
        lines.append(
            f"faulty runs detected: {detected.count} of {detected.of}; isolated: {isolated.count} of {isolated.of}"
        )
        lines.append(
            f"faulty runs with an alarm before the fault: {_with_bound(total(s.false_alarms for s in faulty))}"
        )
    lines.append(f"runs with a wrong isolation: {_with_bound(total(s.wrong_isolations for s in summaries))}")
    return lines


def cost(summaries: Sequence[ConditionSummary]) -> str:
    """The line on computing time."""
    median = np.median([s.microseconds_median for s in summaries]) / 1e3
    p99 = np.median([s.microseconds_p99 for s in summaries]) / 1e3
    undecided, stopped = sum(s.undecided for s in summaries), sum(s.stopped for s in summaries)
    return (
        f"computing time per observer and sample: median {median:.3f} ms, 99th percentile {p99:.3f} ms; "
        f"undecided answers: {undecided}; programs that ended at a limit: {stopped}"
    )


def total(shares: Iterable[Share]) -> Share:
    """Several shares taken together."""
    every = list(shares)
    return Share(sum(s.count for s in every), sum(s.of for s in every))


def _delay_row(plant: Plant, summary: ConditionSummary, bank: Sequence[str]) -> tuple[str, ...]:
    reference = plant.reference.get((summary.fault, summary.profile))
    row = [
        "no fault" if summary.fault == HEALTHY else summary.fault,
        "" if summary.fault == HEALTHY else summary.profile,
    ]
    row += bank
    for event, delays in (("detect", summary.detect), ("isolate", summary.isolate)):
        row += [""] * 4 if summary.fault == HEALTHY else _delay_cells(delays, plant.Ts)
        if plant.reference:
            row.append(getattr(reference, event) if reference else "")
    row += [f"{share.count}/{share.of}" for share in (summary.false_alarms, summary.wrong_isolations)]
    return tuple(row)


def _delay_cells(delays: Delays, Ts: float) -> list[str]:
    digits = max(0, math.ceil(-math.log10(Ts))) + 1  # one more than a sample needs: means fall between samples
    low, high, median = (
        NOT_WITHIN_RUN if q is None else f"{q:.{digits}f}" for q in (delays.p05, delays.p95, delays.median)
    )
    mean = NO_MEAN if delays.mean is None else f"{delays.mean:.{digits}f}"
    return [mean, median, low if low == high else f"{low}–{high}", f"{delays.reached.count}/{delays.reached.of}"]


def _with_bound(share: Share) -> str:
    return (
        f"{share.count} of {share.of} (95 % interval of the rate: {share.interval[0]:.1%} to {share.interval[1]:.1%})"
    )
