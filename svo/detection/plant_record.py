"""A plant as a stranger's checker reads it (``svo describe``): the models of its observers, and what is promised.

`docs/proof_format.md` is its definition.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from svo.checks import Array
from svo.functions.operations import Op
from svo.functions.tape import Tape
from svo.isolation import Bank
from svo.logs.log import Log
from svo.models import UncertainModel
from svo.models.intervals import has_own_intervals
from svo.models.nonlinear import NonlinearModel
from svo.observers.window.evidence import ArrivalSet
from svo.observers.window.log_model import ModelOnLog
from svo.observers.window.proof_steps import encode_set
from svo.observers.window.setup import rows_on_w
from svo.plant import MonitoredPlant
from svo.plant.dialects import on_log
from svo.plant.scheduling import scheduled
from svo.store.values import encode_value

FORMAT = "svo-plant-1"


def plant_record(plant: MonitoredPlant, noise: str, log: Log | None = None) -> dict[str, Any]:
    """What a proof is checked against: every model of a plant's bank, as JSON can hold it.

    Parameters
    ----------
    plant : MonitoredPlant
    noise : str
        The noise set whose bounds are assumed.
    log : Log, optional
        Needed where a model is scheduled: its scheduling value at every sample is part of the record, an axiom.

    Raises
    ------
    ValueError
        If a model is scheduled and there is no log, or its transitions take other times than the sampling time; or
        no observer's model can be written.
    """
    columns = plant.columns
    names = {group: [c.name for c in getattr(columns, group)] for group in ("inputs", "outputs")}
    bank = (plant if log is None else on_log(plant, log)).bank(noise)
    if log is not None:
        log = scheduled(plant.scheduler(), log)
    observers = _observers(bank, log)
    if not observers:
        why = f"plant {plant.name!r} has no observer of a model with exact stamps, and no other is written yet"
        raise ValueError(why)
    return {
        "format": FORMAT,
        "plant": plant.name,
        "noise": noise,
        "Ts": float(plant.Ts).hex(),
        "columns": {"time": columns.time, **names},
        "samples": None if log is None else len(log),
        "observers": observers,
        **({} if log is None or not log.keeps_its_times else {"intervals": encode_value(np.diff(log.time))}),
    }


def check_replaced(path: Path) -> None:
    """ValueError if a file exists that is no such record: a log or a description is not overwritten."""
    if not path.exists():
        return
    start = f'{{"format": "{FORMAT}"'.encode()
    with path.open("rb") as file:
        if file.read(len(start)) != start:
            raise ValueError(
                f"{path} is none of `svo describe` (format {FORMAT}); give another name, it is not overwritten"
            )


def _observers(bank: Bank, log: Log | None) -> dict[str, Any]:
    return {
        name: observer_record(name, observer.first_set, observer.model, log)
        for name, observer in bank.observers.items()
        if observer.first_set is not None and observer.jitter is None
    }


def observer_record(
    name: str, first: ArrivalSet, model: UncertainModel | NonlinearModel, log: Log | None
) -> dict[str, Any]:
    """The entry of an observer, at the scheduling values of a log where its model is scheduled."""
    return _equations(first, model) if isinstance(model, NonlinearModel) else _described(name, first, model, log)


def _equations(first: ArrivalSet, model: NonlinearModel) -> dict[str, Any]:
    """Of a nonlinear model: bounds as those of its linearisations, whose last disturbances are what these leave out."""
    carrier = model.carrier
    found = _entries(first, carrier, *_bounds(carrier, None))
    valid, varying = model.valid_range, np.flatnonzero(model.flow.varying).tolist()
    return found | {
        "noise": encode_value(model.noise[None]),
        "equations": {
            "continuous": model.continuous,
            "varying": varying,
            "valid": None if valid is None else [encode_value(valid.lower), encode_value(valid.upper)],
            "f": tape_record(model.flow.tape),
            "h": tape_record(model.reading),
        },
    }


def tape_record(tape: Tape) -> dict[str, Any]:
    """A tape as JSON can hold it."""
    op = tape.op.tolist()
    return {
        "op": op,
        "operands": [of[: max(1, Op(o).operands)] for o, of in zip(op, tape.operands.tolist(), strict=True)],
        "constants": encode_value(tape.constants),
        "rows": tape.outputs.tolist(),
    }


def _described(name: str, first: ArrivalSet, model: UncertainModel, log: Log | None) -> dict[str, Any]:
    if model.is_scheduled and (log is None or log.schedule is None):
        raise ValueError(f"the model {name!r} is scheduled; give the log, whose scheduling values it is about")
    return {"matrices": _matrices(model, first, log), **_entries(first, model, *_bounds(model, log))}


def _entries(first: ArrivalSet, model: UncertainModel, lower: Array, upper: Array, noise: Array) -> dict[str, Any]:
    """Sizes, bounds, rows on w, and sets."""
    delta = np.array([u.bounds for u in model.uncertainties]).reshape(-1, 2)
    w_rows = dict(zip(("rows", "lower", "upper"), rows_on_w(model), strict=True))
    ranges = {"physical": model.physical_range, "largest": model.start_range}
    return {
        "n": model.n_states,
        "inputs": model.n_inputs,
        "outputs": model.n_outputs,
        "disturbances": model.n_disturbances,
        "delta": encode_value(delta),
        "noise": encode_value(noise),
        "w_lower": encode_value(lower),
        "w_upper": encode_value(upper),
        "w_rows": {key: encode_value(value) for key, value in w_rows.items()},
        "first": encode_set(first),
        **{key: None if r is None else [encode_value(r.lower), encode_value(r.upper)] for key, r in ranges.items()},
    }


def _bounds(model: UncertainModel, log: Log | None) -> tuple[Array, ...]:
    """Of w and noise, one row for all samples or one each."""
    if log is not None and log.schedule is not None and model.is_scheduled:
        each = [np.asarray(bound) for bound in model.bounds_over(log.schedule)]
        return tuple(bound[:1] if (bound == bound[:1]).all() else bound for bound in each)
    return tuple(bound[None] for bound in model.bounds(model.schedule))


def _matrices(model: UncertainModel, first: ArrivalSet, log: Log | None) -> Mapping[str, Any]:
    """The stack; a table with the scheduling values of a log; or the stack of each of its samples."""
    own_times = log is not None and log.keeps_its_times and has_own_intervals(model)
    if log is None or not (model.is_scheduled or own_times):
        return {"stacks": encode_value(model.stack()[None])}
    table = model.stack_table
    if table is not None and not own_times and log.schedule is not None and log.schedule.ndim == 1:
        parts = {"points": table.points, "stacks": table.values, "schedule": log.schedule}
        return {key: encode_value(value) for key, value in parts.items()}
    of = ModelOnLog(model, first, log)
    return {"stacks": encode_value(np.array([of.at(k).stack for k in range(len(log))]))}
