"""The tables [model] with dynamics, [parameters] and [faults.NAME] of a nonlinear plant: equations as text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from svo.models.nonlinear import NonlinearModel
from svo.plant.description.faults import KEYS, FaultModel, check_name, fault_of
from svo.plant.description.model import ARRAYS, range_of, stamps_of
from svo.plant.description.table import Table

_MODEL = (
    "dynamics", "outputs", "disturbances", "n", "physical", "valid", "largest", "varying", "constant", "continuous",
    "jitter",
)  # fmt: skip
_FAULTS = {"sensor": KEYS["sensor"], "actuator": KEYS["actuator"], "plant": (*ARRAYS, "magnitude")}
_ROWS = {"dynamics": "f", "outputs": "h"}
_RANGES = ("physical", "valid", "largest")


def is_nonlinear(top: Table) -> bool:
    """Whether [model] has equations instead of matrices, be it with a key that is mistyped."""
    model = top.table("model")
    return "dynamics" in model or ("A" not in model and ("parameters" in top or "outputs" in model))


def nonlinear_model_of(top: Table, names: Mapping[str, Sequence[str]]) -> NonlinearModel:
    """The model of [model] and [parameters]; inputs and outputs are the columns of these names."""
    table = top.table("model", _MODEL)
    dynamics, outputs = _texts(table, "dynamics"), _texts(table, "outputs")
    if "n" not in table:
        raise table.error("n", "is missing; expected the half-widths of the measurement noise, one an output")
    if set(outputs) != set(names["outputs"]):
        raise table.error("outputs", f"are {', '.join(outputs)}; expected one each of {', '.join(names['outputs'])}")
    if names["states"] and len(names["states"]) != len(dynamics):
        raise top.table("columns").error(
            "states", f"names {len(names['states'])} columns; expected {len(dynamics)}, one each of [model] dynamics"
        )
    bounds = _bounds(table.table("disturbances"))
    ranges = {key: range_of(table, key) for key in _RANGES if key in table}
    with table.errors():
        return NonlinearModel(
            dynamics, outputs, states=list(dynamics), inputs=names["inputs"], outputs=names["outputs"],
            disturbances=list(bounds), w=([low for low, _ in bounds.values()], [high for _, high in bounds.values()]),
            parameters=_numbers(top.table("parameters")), Ts=top.number("Ts"), n=table.array("n"),
            varying=table.content.get("varying", ()), constant=table.content.get("constant", False),
            continuous=table.truth("continuous", True),
            jitter=stamps_of(table) if "jitter" in table else None, **ranges,
        )  # fmt: skip


def nonlinear_faults_of(top: Table, nominal: NonlinearModel) -> dict[str, FaultModel]:
    """The models of all faults, by name: of type "sensor", "actuator" and "plant", and "parameter" (`_parameters`)."""
    every = top.table("faults")
    names = {"inputs": nominal.inputs, "outputs": nominal.outputs or ()}
    return {name: _fault(check_name(every, name), nominal, names) for name in every.content}


def _fault(table: Table, nominal: NonlinearModel, names: Mapping[str, Sequence[str]]) -> FaultModel:
    kind = table.text("type", choices=("parameter", *_FAULTS))
    if kind == "parameter":
        return _parameters(table, nominal)
    table.check_keys(("type", *_FAULTS[kind]))
    with table.errors():
        acting = fault_of(table, kind, names)
        return FaultModel(acting.model(nominal), contains_nominal=True, acting=acting)


def _parameters(table: Table, nominal: NonlinearModel) -> FaultModel:
    """Other bounds of some parameters; with equations of its own that may have further ones.

    Whether a model with other equations contains the healthy plant has to be said.
    """
    table.check_keys(("type", "parameters", *_ROWS, "contains_nominal"))
    rows = {name: _texts(table, key) for key, name in _ROWS.items() if key in table}
    changed = _numbers(table.table("parameters", None if rows else tuple(nominal.parameters)))
    if not changed and not rows:
        raise table.error("parameters", f"is missing; expected bounds of any of {', '.join(nominal.parameters)}")
    if "contains_nominal" in table and not rows:
        raise table.error("contains_nominal", "has no meaning where only bounds change, which are compared; drop it")
    own: dict[str, Any] = {"f": nominal.f, "h": nominal.h}
    equations: dict[str, Any] = {name: {**own[name], **changes} for name, changes in rows.items()}
    still = tuple(name for name in nominal.kept if name not in changed)  # a fault moves it
    with table.errors():
        model = nominal.replace(parameters={**nominal.parameters, **changed}, constant=still, **equations)
    if rows:
        return FaultModel(model, table.truth("contains_nominal", False), moved=tuple(changed))
    contains = all(_contains(model, nominal, name) for name in changed)
    return FaultModel(model, contains, moved=tuple(changed))


def _contains(wider: NonlinearModel, model: NonlinearModel, name: str) -> bool:
    """Whether bounds of a parameter hold those of another model."""
    (low, high), (least, most) = (np.broadcast_to(m.parameters[name], 2) for m in (wider, model))
    return bool(low <= least and high >= most)


def _texts(table: Table, key: str) -> dict[str, str]:
    if key not in table:
        raise table.error(key, 'is missing; expected a table of expressions, such as { h = "(Q - a * sqrt(h)) / S" }')
    inner = table.table(key)
    if not inner.content:
        raise table.error(key, 'is empty; expected at least one row, such as { h = "(Q - a * sqrt(h)) / S" }')
    return {name: inner.text(name) for name in inner.content}


def _bounds(table: Table) -> dict[str, tuple[float, float]]:
    """Of disturbances: a half-width, or [lower, upper]."""
    found = {}
    for name, value in _numbers(table).items():
        if not isinstance(value, tuple) and value < 0.0:
            raise table.error(name, f"is {value:g}; expected a half-width that is not negative, or [lower, upper]")
        found[name] = value if isinstance(value, tuple) else (-value, value)
    return found


def _numbers(table: Table) -> dict[str, Any]:
    """Each a number, or [lower, upper]."""
    found: dict[str, Any] = {}
    for name, value in table.content.items():
        ends = table.array(name) if isinstance(value, list) else np.array(table.number(name))
        if ends.shape not in ((), (2,)):
            raise table.error(name, f"has shape {ends.shape}; expected a number, or [lower, upper]")
        if not np.isfinite(ends).all():
            raise table.error(name, f"is {value}; expected finite numbers")
        found[name] = tuple(ends.tolist()) if ends.ndim else float(ends)
    return found
