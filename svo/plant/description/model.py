"""The tables [model] and [initial]: matrices, bounds, uncertainties and the set of first states."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from polytopes import HPolytope
from svo.checks import bounded_box
from svo.models import UncertainModel, Uncertainty
from svo.models.mat import read_arrays
from svo.plant.description.table import Table

ARRAYS = ("A", "B", "a", "E", "C", "D", "c", "F")
BOUNDS = ("n", "w")
RANGES = ("physical", "largest")
_MODEL = (*ARRAYS, *BOUNDS, *RANGES, "continuous", "remainder", "varying", "jitter", "file", "uncertainties")
_UNCERTAINTY = (*ARRAYS, "bounds", "name")


def model_of(top: Table, names: Mapping[str, Sequence[str]]) -> UncertainModel:
    """The model of [model], with the sampling time of the top."""
    table = top.table("model", _MODEL)
    arrays = _arrays_of_file(table) | arrays_of(table)
    for key in ("A", "C"):
        if key not in arrays:
            raise table.error(key, "is missing; expected a matrix such as [[0.9]]")
    uncertainties = [_uncertainty(entry) for entry in table.tables("uncertainties", _UNCERTAINTY)]
    rest: dict[str, Any] = {"Ts": top.number("Ts"), "uncertainties": uncertainties}
    continuous = table.truth("continuous", False)
    for key in ("remainder", "varying", "jitter"):
        if not continuous and key in table:
            raise table.error(key, "has no meaning for a discrete model; drop it, or say continuous = true")
    if "remainder" in table:
        rest["remainder"] = remainder_of(table)
    if "varying" in table:
        rest["varying"] = table.content["varying"]
    if "jitter" in table:
        rest["jitter"] = stamps_of(table)
    if "n" not in arrays:
        # Taken as zero, a bound that was forgotten falsifies the plant at its first noisy sample.
        raise table.error(
            "n",
            "is missing; expected the half-widths of the measurement noise, one an output, such as n = [0.01] "
            "(0 says that a sensor is exact)",
        )
    ranges = {key: range_of(table, key) for key in RANGES if key in table}
    with table.errors():
        make = UncertainModel.from_continuous if continuous else UncertainModel
        model = make(**{"B": None} | arrays, **rest, **ranges)
    sizes = {"inputs": model.n_inputs, "outputs": model.n_outputs, "states": model.n_states}
    for group, columns in names.items():
        if len(columns) != sizes[group]:
            raise top.table("columns").error(
                group, f"names {len(columns)} columns; expected {sizes[group]}, the number of {group} of [model]"
            )
    model = model.replace(names=names)
    return model if model.origin is None else model.origin.model()  # which names what discretisation left out


def stamps_of(table: Table) -> Any:
    """Bounds of the errors of time stamps: a number, or one an output."""
    return table.array("jitter") if isinstance(table.content["jitter"], list) else table.number("jitter")


def remainder_of(table: Table) -> Any:
    """Bounds of what the discretisation leaves out, or of the states and inputs that they are computed from."""
    if not isinstance(table.content["remainder"], dict):
        return table.array("remainder")
    reach = table.table("remainder", ("states", "inputs"))
    return {"states": reach.array("states")} | ({"inputs": reach.array("inputs")} if "inputs" in reach else {})


def arrays_of(table: Table) -> dict[str, Any]:
    """The model arrays and bounds that a table gives, by their names."""
    arrays: dict[str, Any] = {name: table.array(name) for name in (*ARRAYS, "n") if name in table}
    if "w" in table:
        arrays["w"] = _disturbance_bounds(table)
    return arrays


def box_of(table: Table, n_states: int) -> HPolytope:
    """A set of states: lower and upper bounds, or rows A x <= b."""
    table.check_keys(("lower", "upper", "A", "b"))
    with table.errors():
        if "A" in table or "b" in table:
            if "lower" in table or "upper" in table:
                raise ValueError("has rows (A, b) and bounds (lower, upper); expected one of both")
            found = HPolytope(table.array("A"), table.array("b"))
        else:
            found = HPolytope.box(table.array("lower"), table.array("upper"))
        bounded_box("the set", found, n_states)
    return found


def _disturbance_bounds(table: Table) -> Any:
    if not isinstance(table.content["w"], dict):
        return table.array("w")
    ends = table.table("w", ("lower", "upper"))
    return ends.array("lower"), ends.array("upper")


def range_of(table: Table, key: str) -> Any:
    """Bounds of every state, as { lower, upper } or [lower, upper]; a physical one that is left out is none."""
    if not isinstance(table.content[key], dict):
        return tuple(table.array(key))
    ends = table.table(key, ("lower", "upper"))
    if key == "largest" or ("lower" in ends and "upper" in ends):
        return ends.array("lower"), ends.array("upper")
    return (ends.array("lower"), np.inf) if "lower" in ends else (-np.inf, ends.array("upper"))


def _arrays_of_file(table: Table) -> dict[str, Any]:
    """Arrays of the MAT file that a table names, beside the TOML file."""
    if "file" not in table:
        return {}
    arrays = read_arrays(table.path.parent / model_file(table))
    twice = [name for name in arrays if name in table]
    if twice:
        raise table.error(twice[0], f"is given here and in {table.text('file')}; drop one of both")
    return arrays


def model_file(table: Table) -> Path:
    """The MAT file that [model] names, relative to the TOML file."""
    return table.file_beside("file", table.text("file"))


def _uncertainty(table: Table) -> Uncertainty:
    arrays = {name: table.array(name) for name in ARRAYS if name in table}
    if not arrays:
        raise table.error(None, f"has no direction; expected at least one of {', '.join(ARRAYS)}")
    bounds = table.array("bounds") if "bounds" in table else np.array([-1.0, 1.0])
    with table.errors():
        return Uncertainty(**arrays, bounds=tuple(bounds.tolist()), name=table.text("name", ""))
