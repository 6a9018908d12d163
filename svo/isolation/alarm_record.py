"""The record of an alarm: one JSON object, `svo-alarm-3`, with a digest of the whole; `svo-alarm-2` is read too.

`docs/alarm_format.md` is its definition.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from polytopes.shown import Shown
from svo.checks import Array
from svo.models.scheduled_stacks import ScheduledStacks
from svo.observers.certificate import Certificate
from svo.observers.proof_record import KINDS, WITHOUT_MATRICES, decode_proof, encode_proof, stacks_of
from svo.store.values import check_keys, decode_array, decode_float, decode_integer, encode_value, parse_once

FORMAT, BEFORE = "svo-alarm-3", "svo-alarm-2"
_ENTRIES = {"format", "kind", "observer", "sample", "time", "source", "certificate", "sha256"}
_OPTIONAL = {"model", "premises", "dt"}
_PROMISES = {"physical", "largest"}


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
    premises : mapping of str to (lower, upper)
        What is promised of the state besides: "physical" at all times, "largest" where a set starts again.
    scheduled : ScheduledStacks or None
        Of a scheduled model: how its matrices follow from the scheduling values. None = they are stored as they are.
    dt : (samples - 1,) array or None
        Time from each sample of the proof to the next [s], where that is not the sampling time.
    """

    observer: str
    sample: int
    time: float
    certificate: Certificate
    source: Mapping[str, str | int | float]
    model: str | None = None
    premises: Mapping[str, tuple[Array, Array]] = field(default_factory=dict)
    scheduled: ScheduledStacks | None = None
    dt: Array | None = None


class BadRecord(ValueError):
    """A line that is no intact alarm record."""


def alarm_line(alarm: Alarm) -> str:
    """The record of an alarm, with its end.

    Raises
    ------
    TypeError
        If its certificate cannot be stored.
    """
    record = _encode(alarm)
    record["sha256"] = digest_of_record(record)
    return json.dumps(record, sort_keys=True, allow_nan=False) + "\n"


def read_record(text: str) -> Alarm:
    """The alarm of a line.

    Raises
    ------
    BadRecord
    """
    try:
        record = parse_once(text)
    except (ValueError, RecursionError) as error:
        raise BadRecord(f"not JSON ({error!s:.80})") from error
    known = isinstance(record, dict) and record.get("format") in (FORMAT, BEFORE)
    if not known:
        raise BadRecord(f"not an alarm record of the format {FORMAT} or {BEFORE}")
    if record.get("sha256") != digest_of_record(record):
        raise BadRecord("the SHA-256 does not match: the record was changed after it was written")
    if not isinstance(record.get("kind"), str) or record["kind"] not in KINDS:
        raise BadRecord(f"no certificate of a known kind; known are {', '.join(KINDS)}")
    try:
        return _decode_before(record) if record["format"] == BEFORE else _decode(record)
    except (ArithmeticError, AttributeError, LookupError, MemoryError, TypeError, ValueError) as error:
        raise BadRecord(f"incomplete alarm record ({type(error).__name__}: {error})") from error


def digest_of_record(record: Mapping[str, Any]) -> str:
    """SHA-256 of a record in its canonical form, without the digest."""
    content = {key: value for key, value in record.items() if key != "sha256"}
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def _encode(alarm: Alarm) -> dict[str, Any]:
    proof = alarm.certificate
    record: dict[str, Any] = {
        "format": FORMAT,
        "kind": proof.kind,
        "observer": alarm.observer,
        "sample": int(alarm.sample),
        "time": float(alarm.time).hex(),
        "source": dict(alarm.source),
        "certificate": encode_proof(proof),
    }
    if proof.kind in WITHOUT_MATRICES:
        record["matrices"] = _encode_matrices(stacks_of(proof), alarm.scheduled)
    if alarm.model is not None:
        record["model"] = alarm.model
    if alarm.premises:
        record["premises"] = {name: encode_value(bounds) for name, bounds in alarm.premises.items()}
    if alarm.dt is not None:
        record["dt"] = encode_value(alarm.dt)
    return record


def _encode_matrices(stacks: Array, scheduled: ScheduledStacks | None) -> dict[str, Any]:
    """By the schedule where that gives the very same bits; else one for all samples, or one each."""
    same = len({stack.tobytes() for stack in stacks}) == 1
    if not same and scheduled is not None and scheduled.at_samples().tobytes() == stacks.tobytes():
        return dict(encode_value(scheduled))
    return {"stacks": encode_value(stacks[:1] if same else stacks)}


def _decode(record: dict[str, Any]) -> Alarm:
    kept_apart = {"matrices"} if record["kind"] in WITHOUT_MATRICES else set()
    check_keys(record, _ENTRIES | kept_apart | (_OPTIONAL & record.keys()))
    stacks, scheduled = _decode_matrices(record["matrices"]) if kept_apart else (np.zeros(0), None)
    proof = decode_proof(record["kind"], record["certificate"], stacks)
    if scheduled is not None and len(scheduled.schedule) != len(proof.samples):
        raise ValueError(f"schedule has {len(scheduled.schedule)} values; expected one for each of its samples")
    dt = decode_array(record["dt"]) if "dt" in record else None
    if dt is not None and not (dt.shape == (len(proof.samples) - 1,) and (dt > 0.0).all() and np.isfinite(dt).all()):
        raise ValueError(f"dt has shape {dt.shape}; expected positive seconds between its {len(proof.samples)} samples")
    return Alarm(
        **_common(record), certificate=proof, premises=_promises(record.get("premises", {})), scheduled=scheduled, dt=dt
    )


def _decode_matrices(record: Any) -> tuple[Array, ScheduledStacks | None]:
    if not isinstance(record, dict) or "schedule" not in record:
        check_keys(record, {"stacks"})
        return _finite(decode_array(record["stacks"])), None
    check_keys(record, {"points", "stacks", "schedule"})
    scheduled = ScheduledStacks(*(decode_array(record[name]) for name in ("points", "stacks", "schedule")))
    if scheduled.schedule.ndim != 1 or len(scheduled.schedule) * scheduled.stacks[:1].size > _MOST_ENTRIES:
        raise ValueError(f"schedule has shape {scheduled.schedule.shape}; expected one number a sample")
    return _finite(scheduled.at_samples()), scheduled


_MOST_ENTRIES = 2**24  # of the matrices of a record


def _finite(stacks: Array) -> Array:
    if stacks.ndim != 4 or not np.isfinite(stacks).all():
        raise ValueError(f"stacks have shape {stacks.shape}; expected finite matrices, items of each sample")
    return stacks


def _promises(record: Any) -> dict[str, tuple[Array, Array]]:
    check_keys(record, _PROMISES & record.keys())
    found = {}
    for name, ends in record.items():
        lower, upper = (decode_array(end) for end in ends)
        if lower.ndim != 1 or lower.shape != upper.shape or not (lower <= upper).all():
            raise ValueError(f"premise {name} has shapes {lower.shape} and {upper.shape}; expected bounds in order")
        found[name] = (lower, upper)
    return found


def _decode_before(record: dict[str, Any]) -> Alarm:
    check_keys(record, _ENTRIES | ({"model"} & record.keys()))
    return Alarm(**_common(record), certificate=KINDS[record["kind"]].from_dict(record["certificate"]))


def _common(record: dict[str, Any]) -> dict[str, Any]:
    return {
        "observer": _text(record["observer"]),
        "sample": _number(record["sample"]),
        "time": decode_float(record["time"]),
        "source": _source(record["source"]),
        "model": _text(record["model"]) if "model" in record else None,
    }


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
