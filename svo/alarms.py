"""Alarms on disk: one JSON object a line, with the proof, its data and a digest of the whole.

Floats are written in hexadecimal, so that a stored proof is about exactly the numbers that the observer saw. A
record is rejected if its SHA-256 does not match, if the proof does not hold in exact arithmetic, or, given the
log, if its data are not those of the log. What one window proves is conditional on its arrival set and on the
bounds of s of its channels (see `svo.observers.proof`).
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from svo.log import Log
from svo.observers.proof import ArrivalSet, WindowCertificate, WindowSample

Array = NDArray[np.float64]
FORMAT = "svo-alarm-1"


@dataclass(frozen=True, eq=False)
class Alarm:
    """A model that was falsified, and why.

    Attributes
    ----------
    observer : str
        Whose model it is.
    sample : int
        Sample of the log at which it was falsified.
    time : float
        Time of that sample [s].
    certificate : WindowCertificate
    source : mapping
        Where the data come from: plant, noise set, seed, file.
    """

    observer: str
    sample: int
    time: float
    certificate: WindowCertificate
    source: Mapping[str, str | int | float]


@dataclass(frozen=True)
class AlarmCheck:
    """Result of checking one stored alarm; ``reason`` says what was proven, or what is wrong."""

    line: int
    observer: str
    sample: int
    ok: bool
    reason: str
    seconds: float


def write_alarms(path: str | Path, alarms: Iterable[Alarm]) -> None:
    """Write alarms as JSON Lines."""
    with open(path, "w", encoding="utf-8") as file:
        file.writelines(_line(alarm) for alarm in alarms)


def append_alarm(path: str | Path, alarm: Alarm) -> None:
    """Add one alarm to a JSON Lines file, which is made if need be."""
    with open(path, "a", encoding="utf-8") as file:
        file.write(_line(alarm))


def read_alarms(path: str | Path) -> list[Alarm]:
    """Read alarms whose digests match.

    Raises
    ------
    ValueError
        Naming the first line that is no intact alarm record.
    """
    alarms = []
    for number, text in _lines(path):
        try:
            alarms.append(_decode(text))
        except _BadRecord as error:
            raise ValueError(f"{path}, line {number}: {error}") from error
    return alarms


def verify_alarms(path: str | Path, log: Log | None = None) -> list[AlarmCheck]:
    """Check every stored alarm: digest, proof in exact arithmetic and, given the log, the data."""
    return [_check(number, text, log) for number, text in _lines(path)]


def _lines(path: str | Path) -> list[tuple[int, str]]:
    # Bytes that are no text make a bad line, like any other damage.
    with open(path, encoding="utf-8", errors="replace") as file:
        return [(number, text) for number, text in enumerate(file, start=1) if text.strip()]


class _BadRecord(ValueError):
    """A line that is no intact alarm record."""


def _check(number: int, text: str, log: Log | None) -> AlarmCheck:
    begun = perf_counter()
    try:
        alarm = _decode(text)
    except _BadRecord as error:
        return AlarmCheck(number, "?", -1, False, str(error), perf_counter() - begun)
    reason = "proven given the arrival set"
    ok = alarm.certificate.verify()
    if not ok:
        reason = "the proof does not hold"
    elif log is not None:
        difference = _difference(alarm, log)
        ok, reason = difference is None, difference or reason + ", data as in the log"
    return AlarmCheck(number, alarm.observer, alarm.sample, ok, reason, perf_counter() - begun)


def _difference(alarm: Alarm, log: Log) -> str | None:
    """The first way in which an alarm's data are not those of the log."""
    c = alarm.certificate
    # an observer that was started again counts its own samples
    samples = range(alarm.sample - (c.last - c.first), alarm.sample + 1)
    if samples[0] < 0 or alarm.sample >= len(log):
        return f"samples {samples[0]} to {alarm.sample} do not belong to a log of {len(log)} samples"
    if log.time[alarm.sample] != alarm.time:
        return f"time {alarm.time} is not that of sample {alarm.sample} in the log, {log.time[alarm.sample]}"
    for k, sample in zip(samples, c.samples, strict=True):
        # a measurement that the observer did not use takes nothing from the proof
        used = ~np.isnan(sample.y)
        if used.shape != log.y[k].shape or not np.array_equal(sample.y[used], log.y[k][used]):
            return f"y of sample {k} differs from the log"
        driven = k < alarm.sample or bool(np.any(sample.stack[:, c.n :, c.n : c.n + sample.u.size]))
        if driven and not np.array_equal(sample.u, log.u[k]):
            return f"u of sample {k} differs from the log"
    return None


# -- records -------------------------------------------------------------------------------------------------


def _digest(record: Mapping[str, Any]) -> str:
    content = {key: value for key, value in record.items() if key != "sha256"}
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def _line(alarm: Alarm) -> str:
    record = _encode(alarm)
    record["sha256"] = _digest(record)
    return json.dumps(record, sort_keys=True) + "\n"


def _encode(alarm: Alarm) -> dict[str, Any]:
    return {
        "format": FORMAT,
        "observer": alarm.observer,
        "sample": int(alarm.sample),
        "time": float(alarm.time).hex(),
        "source": dict(alarm.source),
        "certificate": _encode_value(alarm.certificate),
    }


def _encode_value(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        if np.issubdtype(value.dtype, np.integer):
            return value.tolist()
        return {"shape": list(value.shape), "hex": " ".join(_hex(v) for v in value.ravel())}
    if isinstance(value, tuple):
        return [_encode_value(item) for item in value]
    if isinstance(value, WindowCertificate | WindowSample | ArrivalSet):
        return {f.name: _encode_value(getattr(value, f.name)) for f in fields(value)}
    return value


def _hex(value: float) -> str:
    text = float(value).hex()
    return "0" if text == "0x0.0p+0" else text


def _decode(text: str) -> Alarm:
    try:
        record = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise _BadRecord(f"not JSON ({error})") from error
    if not isinstance(record, dict) or record.get("format") != FORMAT:
        raise _BadRecord(f"not an alarm record of the format {FORMAT}")
    if record.get("sha256") != _digest(record):
        raise _BadRecord("the SHA-256 does not match: the record was changed after it was written")
    try:
        return Alarm(
            observer=str(record["observer"]),
            sample=int(record["sample"]),
            time=float.fromhex(record["time"]),
            certificate=_decode_certificate(record["certificate"]),
            source=dict(record["source"]),
        )
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        raise _BadRecord(f"incomplete alarm record ({type(error).__name__}: {error})") from error


def _decode_array(value: Any) -> Array:
    numbers = np.array([float.fromhex(v) for v in value["hex"].split()])
    return numbers.reshape(value["shape"])


def _decode_certificate(record: Mapping[str, Any]) -> WindowCertificate:
    arrays = {key: _decode_array(value) for key, value in record.items() if isinstance(value, dict) and "hex" in value}
    return WindowCertificate(
        first=int(record["first"]),
        last=int(record["last"]),
        n=int(record["n"]),
        late=bool(record["late"]),
        owner=np.array(record["owner"], dtype=np.int64),
        arrival=ArrivalSet(**{key: _decode_array(value) for key, value in record["arrival"].items()}),
        samples=tuple(
            WindowSample(**{key: _decode_array(value) for key, value in sample.items()}) for sample in record["samples"]
        ),
        **arrays,
    )
