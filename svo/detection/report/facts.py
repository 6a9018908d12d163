"""The words and tables of a report: what was found and proven, in which log, under which bounds."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from svo.detection.found import Detection
from svo.isolation import NOMINAL, Alarm, Bank
from svo.models import UncertainModel
from svo.models.nonlinear import NonlinearModel
from svo.observers.base import Observer
from svo.pages.tables import TextTable
from svo.pictures.style import in_seconds
from svo.plant.dialects import on_log
from svo.store import digest_of


class AlarmText(NamedTuple):
    """What one alarm says, sentence by sentence."""

    title: str
    sentences: tuple[str, ...]
    facts: Mapping[str, str]
    holds: bool


def alarm_text(alarm: Alarm, found: Detection) -> AlarmText:
    """An alarm in words, its proof checked again in exact arithmetic."""
    Ts, time = found.plant.Ts, found.time
    certificate, name = alarm.certificate, alarm.observer
    first = alarm.sample + 1 - len(certificate.samples)
    at, begin = in_seconds(alarm.time, Ts), in_seconds(float(time[first]), Ts)
    span = f"sample {first}" if first == alarm.sample else f"samples {first} to {alarm.sample}"
    when = at if first == alarm.sample else f"{begin} to {at}"
    holds = certificate.verify()
    checked = (
        "The proof was checked again for this page in exact rational arithmetic: it holds"
        if holds
        else "THE PROOF DOES NOT HOLD in exact rational arithmetic: do not rely on this alarm"
    )
    return AlarmText(
        title=f"{name}: falsified at {at}",
        sentences=(
            f"No trajectory of the model {name!r}, with all its disturbances, noises and uncertainties within their "
            f"bounds, explains the readings of {span} ({when})",
            _meaning(name),
            checked,
            f"It rests on {certificate.premise(alarm.sample)}",
        ),
        facts={
            "model": name,
            "time": at,
            "sample": str(alarm.sample),
            "readings used": f"{span} ({len(certificate.samples)})",
            "kind of proof": certificate.kind,
            "exact check": "holds" if holds else "does not hold",
            "digest of the model": alarm.model or "none",
        },
        holds=holds,
    )


def _meaning(name: str) -> str:
    if name == NOMINAL:
        return "The plant was not the healthy one of the model, or a bound of it is too narrow: a fault is detected"
    return f"If something is wrong, it is not {name!r} alone as its model states it: that fault is excluded"


def log_facts(found: Detection, path: Path | None) -> dict[str, str]:
    """The data of the log."""
    log, Ts = found.log, found.plant.Ts
    missing = np.isnan(log.y).sum(axis=0)
    every = {c.name: f"{n} of {len(log)}" for c, n in zip(found.plant.columns.outputs, missing, strict=True) if n}
    facts = {"file": str(log.source or "none, data in memory")}
    if path is not None and path.is_file():
        facts["SHA-256"] = digest_of(path)
    names = [column.label for column in found.plant.columns.outputs]
    wider = [] if log.widening is None else [f"{n}: {w:.6g}" for n, w in zip(names, log.widening, strict=True) if w]
    return (
        facts
        | {
            "samples": f"{len(log)}, one each {Ts:g} s",
            "span": f"{in_seconds(float(log.time[0]), Ts)} to {in_seconds(float(log.time[-1]), Ts)}",
            "missing readings": ", ".join(f"{name}: {count}" for name, count in every.items()) or "none",
        }
        | ({"widening of the noise by reading": ", ".join(wider)} if wider else {})
    )


def bank_of(found: Detection) -> Bank:
    """A fresh bank as the one that was asked."""
    return on_log(found.plant, found.log).bank(found.noise)


def bounds_table(found: Detection, bank: Bank) -> TextTable:
    """What each model takes for bounded, and by what."""
    every = {name: _bounds(observer, found) for name, observer in bank.observers.items()}
    rows = list(dict.fromkeys(row for bounds in every.values() for row in bounds))
    cells = tuple((row, *(bounds.get(row, "-") for bounds in every.values())) for row in rows)
    scheduled = any(observer.model.is_scheduled for observer in bank.observers.values())
    title = "Bounds that the models assume" + (", at the typical schedule" if scheduled else "")
    return TextTable(title, ("bound", *every), cells, labels=1)


def models_table(bank: Bank) -> TextTable:
    """What kind of observer each model has."""
    rows = []
    for name, observer in bank.observers.items():
        model, options = observer.model, observer.options
        horizon = options.get("horizon", "-")
        kind, sizes = str(options["kind"]), (model.n_states, model.n_inputs, model.n_outputs, model.n_disturbances)
        rows.append((name, kind, "all data" if horizon is None else str(horizon), *map(str, sizes)))
    header = ("model", "observer", "horizon\n[samples]", "states", "inputs", "outputs", "disturbances")
    return TextTable("Models of the bank", header, tuple(rows), labels=2)


def _bounds(observer: Observer, found: Detection) -> dict[str, str]:
    model: UncertainModel | NonlinearModel = observer.model
    outputs = [column.label for column in found.plant.columns.outputs]
    if isinstance(model, NonlinearModel):
        noise, (lower, upper) = model.noise, model.flow.w
        names = [f"disturbance {name}" for name in model.disturbances]
        names += [f"parameter {name}" for name in model.parameters]
        further = {}
    else:
        lower, upper, noise = model.bounds(model.schedule) if model.is_scheduled else model.bounds()
        known = dict(model.names or {}).get("disturbances", [f"w[{i}]" for i in range(len(lower))])
        names = [f"disturbance {name}" for name in known]
        further = {f"uncertainty {u.name or i}": _range(*u.bounds) for i, u in enumerate(model.uncertainties)}
    told = {f"noise of {output}": f"± {n:.6g}" for output, n in zip(outputs, noise, strict=False)}
    return told | {name: _range(a, b) for name, a, b in zip(names, lower, upper, strict=False)} | further


def _range(lower: Any, upper: Any) -> str:
    if lower == upper:
        return f"{upper:.6g}"
    if lower == -upper:
        return f"± {upper:.6g}"
    return f"{lower:.6g} to {upper:.6g}"
