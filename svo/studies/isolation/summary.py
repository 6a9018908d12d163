"""Statistics of a run table: delays, alarms that should not be, and cost, per noise set, fault and profile."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from svo.plant import HEALTHY, BankChoice
from svo.store import write_csv
from svo.studies.isolation.run import RunRow
from svo.studies.statistics import Delays, Share, grouped


@dataclass(frozen=True)
class ConditionSummary:
    """What happened in the runs of one noise set, fault and profile.

    Attributes
    ----------
    detect, isolate : Delays
    false_alarms, wrong_isolations : Share
    survivors : mapping of str to int
        In the runs that were not isolated: the models alive at the end, and in how many runs.
    microseconds_median, microseconds_p99 : float
        Per observer and sample: medians over the runs of the runs' median and 99th percentile.
    undecided : int
        Answers of observers that were neither a proof nor a point, in all runs.
    stopped : int
        Programs of observers that ended at a limit, in all runs.
    architecture : str or None
        Of the bank; None for a plant that has one kind of bank only.
    models : str or None
        Kind of the observers' models, likewise.
    """

    noise: str
    fault: str
    profile: str
    runs: int
    detect: Delays
    isolate: Delays
    false_alarms: Share
    wrong_isolations: Share
    survivors: Mapping[str, int]
    microseconds_median: float
    microseconds_p99: float
    undecided: int
    stopped: int
    architecture: str | None = None
    models: str | None = None

    @property
    def bank(self) -> BankChoice:
        """Which of the plant's banks it was."""
        return BankChoice(self.architecture, self.models)


def summarise(rows: Iterable[RunRow]) -> list[ConditionSummary]:
    """One summary per noise set, fault, profile and bank, in the order of their first runs.

    Runs that failed are left out.
    """
    groups = grouped(rows, "noise", "fault", "profile", "bank")
    return [_summarise(key, group) for key, group in groups.items()]


def write_summary(path: Path, summaries: Iterable[ConditionSummary]) -> None:
    """Write summaries as CSV, one row a condition; what does not exist is left empty."""
    write_csv(path, [_flat(summary) for summary in summaries])


def to_json(summaries: Iterable[ConditionSummary]) -> list[dict[str, Any]]:
    """Summaries as plain dictionaries."""
    return [asdict(summary) for summary in summaries]


def _summarise(condition: tuple[str, str, str, BankChoice], rows: list[RunRow]) -> ConditionSummary:
    noise, fault, profile, bank = condition
    kept = Counter(row.alive_end or "none" for row in rows if fault != HEALTHY and row.isolation_delay_s is None)
    return ConditionSummary(
        noise=noise,
        fault=fault,
        profile=profile,
        runs=len(rows),
        detect=Delays.of([row.detection_delay_s for row in rows]),
        isolate=Delays.of([row.isolation_delay_s for row in rows]),
        false_alarms=Share.true([row.false_alarm for row in rows]),
        wrong_isolations=Share.true([row.wrong_isolation for row in rows]),
        survivors=dict(kept.most_common()),
        microseconds_median=float(np.median([row.microseconds_per_step or 0.0 for row in rows])),
        microseconds_p99=float(np.median([row.microseconds_p99 or 0.0 for row in rows])),
        undecided=sum(row.undecided or 0 for row in rows),
        stopped=sum(row.stopped or 0 for row in rows),
        **bank._asdict(),
    )


def _flat(summary: ConditionSummary) -> dict[str, Any]:
    row: dict[str, Any] = {name: getattr(summary, name) for name in ("noise", "fault", "profile", "runs")}
    for name, delays in (("detect", summary.detect), ("isolate", summary.isolate)):
        low, high = delays.mean_interval or (None, None)
        row |= {f"{name}_mean_s": delays.mean, f"{name}_mean_low_s": low, f"{name}_mean_high_s": high}
        row |= {f"{name}_median_s": delays.median, f"{name}_p05_s": delays.p05, f"{name}_p95_s": delays.p95}
        row |= _flat_share(f"{name}_reached", delays.reached)
    row |= _flat_share("false_alarm", summary.false_alarms) | _flat_share("wrong_isolation", summary.wrong_isolations)
    row["not_isolated_share"] = 1 - summary.isolate.reached.value
    row["survivors"] = "; ".join(f"{names}: {count}" for names, count in summary.survivors.items())
    for name in ("microseconds_median", "microseconds_p99", "undecided", "stopped", "architecture", "models"):
        row[name] = getattr(summary, name)
    return row


def _flat_share(name: str, share: Share) -> dict[str, Any]:
    low, high = share.interval
    return {f"{name}_runs": share.count, f"{name}_share": share.value, f"{name}_low": low, f"{name}_high": high}
