"""Alarms on disk: one JSON object a line, with the proof, its data and a digest of the whole.

Floats are written in hexadecimal, so that a stored proof is about exactly the numbers that the observer saw. A
record is rejected if its SHA-256 does not match, if the proof does not hold in exact arithmetic, or, given the
log, if its data are not those of the log. What one proof shows is conditional: a window's on its arrival set and on
the bounds of s of its channels (see `svo.observers.window.certificate`), a polytope observer's on the set before the
measurement.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import Any

from polytopes.shown import Shown
from svo.logs.log import Log
from svo.observers.certificate import Certificate
from svo.observers.polytope.certificate import PolytopeCertificate
from svo.observers.window.certificate import WindowCertificate
from svo.observers.window.sign_split import SplitCertificate
from svo.observers.zonotope.certificate import ZonotopeCertificate
from svo.store.values import check_keys, decode_float, decode_integer

FORMAT = "svo-alarm-2"
KINDS: dict[str, type[Certificate]] = {
    kind.kind: kind for kind in (WindowCertificate, SplitCertificate, ZonotopeCertificate, PolytopeCertificate)
}
"""The certificates that can be stored, by the name of their kind."""
_ENTRIES = {"format", "kind", "observer", "sample", "time", "source", "certificate", "sha256"}


@dataclass(frozen=True, eq=False)
class Alarm(Shown):
    """A model that was falsified, and why.

    Attributes
    ----------
    observer : str
        Whose model it is.
    sample : int
        Sample of the log at which it was falsified.
    time : float
        Time of that sample [s].
    certificate : Certificate
        To be stored it is of one of `KINDS`.
    source : mapping
        Where the data come from: plant, noise set, seed, file.
    model : str or None
        Digest of the model and of the observer's options (`svo.models.digest`); None in older records.
    """

    observer: str
    sample: int
    time: float
    certificate: Certificate
    source: Mapping[str, str | int | float]
    model: str | None = None


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
NOT_CHECKED = "that the matrices enclose the nonlinear plant was proven when they were made and is not checked again"

ModelDifference = Callable[[Alarm], str | None]


def write_alarms(path: str | Path, alarms: Iterable[Alarm]) -> None:
    """Write alarms as JSON Lines."""
    with open(path, "w", encoding="utf-8") as file:
        file.writelines(alarm_line(alarm) for alarm in alarms)


def read_alarms(path: str | Path) -> list[Alarm]:
    """Read alarms whose digests match.

    Raises
    ------
    ValueError
        Naming the first line that is no intact alarm record, or if the file is none of alarms.
    """
    alarms = []
    for number, text in _lines(path):
        try:
            alarms.append(_decode(text))
        except _BadRecord as error:
            raise ValueError(f"{path}, line {number}: {error}") from error
    return alarms


def verify_alarms(
    path: str | Path, log: Log | None = None, model_difference: ModelDifference | None = None
) -> list[AlarmCheck]:
    """Check every stored alarm: digest, proof in exact arithmetic and, given the log, the data.

    Parameters
    ----------
    path : path
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


def _lines(path: str | Path) -> list[tuple[int, str]]:
    """Numbers and text of the lines that are not blank."""
    # Bytes that are no text make a bad line, like any other damage.
    with open(path, encoding="utf-8", errors="replace") as file:
        lines = [(number, text) for number, text in enumerate(file, start=1) if text.strip()]
    if lines and not any(_is_object(text) for _, text in lines):
        raise ValueError(
            f"{path} is no file of alarms (line {lines[0][0]} is no JSON object, nor is any other); "
            "expected an alarms.jsonl that svo detect, svo watch or svo study wrote"
        )
    return lines


def _is_object(text: str) -> bool:
    try:
        return isinstance(json.loads(text), dict)
    except (ValueError, RecursionError):
        return False


class _BadRecord(ValueError):
    """A line that is no intact alarm record."""


def _check(number: int, text: str, log: Log | None, model_difference: ModelDifference | None) -> AlarmCheck:
    begun = perf_counter()
    try:
        alarm = _decode(text)
    except _BadRecord as error:
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
    if alarm.source.get("model") == NONLINEAR:
        compared += f"; {NOT_CHECKED}"
    reason = wrong or f"proven given {alarm.certificate.premise(alarm.sample)}{compared}"
    return AlarmCheck(0, alarm.observer, alarm.sample, wrong is None, reason, perf_counter() - begun)


def _difference(alarm: Alarm, log: Log) -> str | None:
    """Whether the alarm's sample is one of the log."""
    if not 0 <= alarm.sample < len(log):
        return f"samples up to {alarm.sample} do not belong to a log of {len(log)} samples"
    if log.time[alarm.sample] != alarm.time:
        return f"time {alarm.time} is not that of sample {alarm.sample} in the log, {log.time[alarm.sample]}"
    return None


# -- records -------------------------------------------------------------------------------------------------


def _digest(record: Mapping[str, Any]) -> str:
    content = {key: value for key, value in record.items() if key != "sha256"}
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def alarm_line(alarm: Alarm) -> str:
    """The record of an alarm, with its end."""
    record = _encode(alarm)
    record["sha256"] = _digest(record)
    return json.dumps(record, sort_keys=True) + "\n"


def _encode(alarm: Alarm) -> dict[str, Any]:
    certificate = alarm.certificate
    if KINDS.get(certificate.kind) is not type(certificate):
        own, known = type(certificate).__name__, ", ".join(kind.__name__ for kind in KINDS.values())
        raise TypeError(f"certificate is {own}, which no alarm can store; expected one of {known}")
    return ({} if alarm.model is None else {"model": alarm.model}) | {
        "format": FORMAT,
        "kind": certificate.kind,
        "observer": alarm.observer,
        "sample": int(alarm.sample),
        "time": float(alarm.time).hex(),
        "source": dict(alarm.source),
        "certificate": certificate.to_dict(),
    }


def _decode(text: str) -> Alarm:
    try:
        record = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise _BadRecord(f"not JSON ({error})") from error
    if not isinstance(record, dict) or record.get("format") != FORMAT:
        raise _BadRecord(f"not an alarm record of the format {FORMAT}")
    if record.get("sha256") != _digest(record):
        raise _BadRecord("the SHA-256 does not match: the record was changed after it was written")
    kind = KINDS.get(str(record.get("kind")))
    if kind is None:
        raise _BadRecord(f"no certificate of a known kind; known are {', '.join(KINDS)}")
    try:
        check_keys(record, _ENTRIES | ({"model"} & record.keys()))
        return Alarm(
            observer=_text(record["observer"]),
            sample=_number(record["sample"]),
            time=decode_float(record["time"]),
            certificate=kind.from_dict(record["certificate"]),
            source=_source(record["source"]),
            model=_text(record["model"]) if "model" in record else None,
        )
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        raise _BadRecord(f"incomplete alarm record ({type(error).__name__}: {error})") from error


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise TypeError("expected text")
    return value


def _number(value: Any) -> int:
    if decode_integer(value) < 0:
        raise ValueError("sample is negative")
    return int(value)


def _source(value: Any) -> dict[str, str | int | float]:
    if not isinstance(value, dict) or not all(isinstance(v, str | int | float) for v in value.values()):
        raise TypeError("source is no table of text and numbers")
    return dict(value)
