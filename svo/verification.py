"""Proofs of stored alarms from the first sample of their log on (``svo verify --full``)."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from svo.alarms import Alarm, AlarmCheck, read_alarms, verify_alarms
from svo.log import Log
from svo.observers.chain import chain_of
from svo.plant import Plant, schedule_of


def verify_chains(path: str | Path, log: Log, plant: Plant) -> list[AlarmCheck]:
    """Check every stored alarm and, if it holds, run its observer over the log again and prove every bound.

    The observers are those of the plant's bank for the noise set that the alarm names, so this also checks that
    the alarm's model is the plant's.

    Parameters
    ----------
    path : path
        JSON Lines, as `svo.alarms.write_alarms` writes them; all alarms of one run.
    log : Log
        Only time, u and y are used; the plant's own scheduler makes the schedule from y.
    plant : Plant
    """
    checks = verify_alarms(path, log)
    if not all(check.ok for check in checks):
        return checks
    scheduler = plant.scheduler()
    values = [schedule_of(scheduler, y, u) for y, u in zip(log.y, log.u, strict=True)]
    known = replace(log, schedule=None if values[0] is None else np.array(values, dtype=float))
    return [_with_chain(check, alarm, known, plant) for check, alarm in zip(checks, read_alarms(path), strict=True)]


def _with_chain(check: AlarmCheck, alarm: Alarm, log: Log, plant: Plant) -> AlarmCheck:
    chain = chain_of(plant.bank(str(alarm.source.get("noise"))), alarm.observer, log)
    seconds = check.seconds + chain.seconds
    if chain.falsified_at != alarm.sample:
        found = "not" if chain.falsified_at is None else f"at sample {chain.falsified_at}"
        reason = f"run again over the log, the plant's observer is falsified {found}"
        return replace(check, ok=False, reason=reason, seconds=seconds)
    if not chain.proven:
        reason = f"{len(chain.unproven)} of {chain.bounds} bounds are not proven, first: {chain.unproven[0]}"
        return replace(check, ok=False, reason=reason, seconds=seconds)
    return replace(check, reason=f"proven from the first sample, over {chain.bounds} bounds", seconds=seconds)
