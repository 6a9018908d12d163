"""Alarms on disk, checked again: records of `svo.isolation.alarm_record`, one a line, plain or in gzip members.

A record is rejected if its SHA-256 does not match, if the proof does not hold in exact arithmetic, or, given the
log, if its data are not those of the log. What one proof shows is conditional: a window's on its arrival set and on
the bounds of s of its channels (see `svo.observers.window.certificate`), a polytope observer's on the set before the
measurement.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter

import numpy as np

from polytopes.shown import Shown
from svo.isolation.alarm_record import Alarm, BadRecord, alarm_line, read_record
from svo.logs.log import Log
from svo.observers.proof_record import KINDS
from svo.store.packed_lines import lines_of, packed

__all__ = [
    "KINDS",
    "NONLINEAR",
    "NOT_CHECKED",
    "PACKED",
    "Alarm",
    "AlarmCheck",
    "alarm_line",
    "check_alarm",
    "found_alarms",
    "read_alarms",
    "verify_alarms",
    "write_alarms",
]

PACKED = ".gz"
"""How the name of a packed file ends."""


@dataclass(frozen=True)
class AlarmCheck(Shown):
    """Result of checking one stored alarm; ``reason`` says what was proven, or what is wrong."""

    line: int
    observer: str
    sample: int
    ok: bool
    reason: str
    seconds: float


NONLINEAR = "nonlinear"
"""Of the source of an alarm: its matrices are those of linearisations."""
STAMPED = "jitter"
"""Of the source of an alarm: the noise of readings whose stamps are off was widened."""
NOT_CHECKED = {
    NONLINEAR: "that the matrices enclose the nonlinear plant was proven when they were made and is not checked again",
    STAMPED: "that the noise was widened enough for the stamps was proven when it was done and is not checked again",
}

ModelDifference = Callable[[Alarm], str | None]


def write_alarms(path: str | Path, alarms: Iterable[Alarm]) -> None:
    """Write alarms as JSON Lines; as one gzip member if the name ends with .gz."""
    path = Path(path)
    text = "".join(alarm_line(alarm) for alarm in alarms).encode()
    path.write_bytes(packed(text) if path.suffix == PACKED else text)


def read_alarms(path: str | Path) -> list[Alarm]:
    """Read alarms whose digests match.

    Raises
    ------
    ValueError
        Naming the first line that is no intact alarm record, or if the file is none of alarms.
    """
    return [alarm for _, alarm in numbered_alarms(path)]


def numbered_alarms(path: str | Path) -> list[tuple[int, Alarm]]:
    """The same, each with the number of its line."""
    alarms, wrong = [], ""
    for number, text in _lines(path):  # to the end, where it may turn out to be another kind of file
        try:
            alarms.append((number, read_record(text)))
        except BadRecord as error:
            wrong = wrong or f"{path}, line {number}: {error}"
    if wrong:
        raise ValueError(wrong)
    return alarms


def verify_alarms(
    path: str | Path, log: Log | None = None, model_difference: ModelDifference | None = None
) -> list[AlarmCheck]:
    """Check every stored alarm: digest, proof in exact arithmetic and, given the log, the data.

    Parameters
    ----------
    path : path
        Plain or packed; where a plain one is not there, the packed one beside it.
    log : Log, optional
    model_difference : callable, optional
        An alarm to the way in which its model is not the one that it names, or None, as
        `svo.detection.chains.PlantModels` gives it. Asked only where the log is given.

    Raises
    ------
    ValueError
        If no line is a JSON object, so that the file is none of alarms. An empty file has no checks.
    """
    return [_check(number, text, log, model_difference) for number, text in _lines(path)]


def found_alarms(path: str | Path) -> Path:
    """The file of alarms by a name: that of a study is packed, also where it is asked for without the end .gz."""
    path = Path(path)
    beside = path.with_name(path.name + PACKED)
    return beside if not path.exists() and beside.is_file() else path


def _lines(path: str | Path) -> Iterator[tuple[int, str]]:
    """Numbers and text of the lines that are not blank."""
    first, any_object = 0, False
    for number, content in enumerate(lines_of(found_alarms(path)), start=1):
        # Bytes that are no text make a bad line, like any other damage.
        text = content.decode("utf-8", errors="replace")
        if text.strip():
            first, any_object = first or number, any_object or _is_object(text)
            yield number, text
    if first and not any_object:
        raise ValueError(
            f"{path} is no file of alarms (line {first} is no JSON object, nor is any other); "
            "expected an alarms.jsonl that svo detect, svo watch or svo study wrote"
        )


def _is_object(text: str) -> bool:
    try:
        return isinstance(json.loads(text), dict)
    except (ValueError, RecursionError):
        return False


def _check(number: int, text: str, log: Log | None, model_difference: ModelDifference | None) -> AlarmCheck:
    begun = perf_counter()
    try:
        alarm = read_record(text)
    except BadRecord as error:
        return AlarmCheck(number, "?", -1, False, str(error), perf_counter() - begun)
    return replace(check_alarm(alarm, log, model_difference), line=number, seconds=perf_counter() - begun)


def check_alarm(alarm: Alarm, log: Log | None = None, model_difference: ModelDifference | None = None) -> AlarmCheck:
    """Check an alarm that is at hand, its line then 0; as `verify_alarms` does each that is stored."""
    begun = perf_counter()
    compared = ", data as in the log"
    if not alarm.certificate.verify():
        wrong: str | None = "the proof does not hold"
    elif log is None:
        wrong, compared = None, " and that its model is the plant's"
    else:
        wrong = _difference(alarm, log) or alarm.certificate.difference(alarm.sample, log)
        if model_difference is not None:
            wrong = wrong or model_difference(alarm)
            compared += ", model as the plant's" if alarm.model else ", model not compared beyond matrices and bounds"
    if (kind := alarm.source.get("model")) in NOT_CHECKED:
        compared += f"; {NOT_CHECKED[str(kind)]}"
    reason = wrong or f"proven given {alarm.certificate.premise(alarm.sample)}{compared}"
    return AlarmCheck(0, alarm.observer, alarm.sample, wrong is None, reason, perf_counter() - begun)


def _difference(alarm: Alarm, log: Log) -> str | None:
    """Whether the alarm's sample is one of the log."""
    if not 0 <= alarm.sample < len(log):
        return f"samples up to {alarm.sample} do not belong to a log of {len(log)} samples"
    if log.time[alarm.sample] != alarm.time:
        return f"time {alarm.time} is not that of sample {alarm.sample} in the log, {log.time[alarm.sample]}"
    first = alarm.sample + 1 - len(alarm.certificate.samples)
    if alarm.dt is not None and not np.array_equal(alarm.dt, np.diff(log.time[max(first, 0) : alarm.sample + 1])):
        return "the times between its samples are not those of the log"
    return None
