"""Which model a saved state or an alarm belongs to, as a SHA-256.

The digest is that of JSON with sorted keys in UTF-8: sizes, sampling time, bounds of Delta, rows of the disturbance
set where it is a polytope, the promised ranges of the state where there are any, the observer's options, and the
matrices and bounds of some samples; floats as `float.hex` writes them. No name of a class, module or file is in it, so
the same model has the same digest wherever it is built.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from polytopes.shown import Shown
from svo.checks import Array
from svo.models.intervals import transition_rows
from svo.models.model import UncertainModel
from svo.models.nonlinear import NonlinearModel
from svo.store.values import encode_value

Options = Mapping[str, Any]


@dataclass(frozen=True, eq=False)
class ModelSample(Shown):
    """Matrices and bounds of a model at one sample.

    Attributes
    ----------
    stack : (1 + n_uncertainties, n + ny, n + nu + 1 + nw) array
        As `UncertainModel.stack` gives it.
    noise : (ny,) array
    w : (lower, upper) of (nw,) arrays, or None
        None where the disturbance of the sample is not in question.
    """

    stack: Array
    noise: Array
    w: tuple[Array, Array] | None

    @classmethod
    def of(cls, model: UncertainModel, schedule: Any, dt: float | None = None) -> ModelSample:
        """Those of a model at a scheduling value, with a transition that takes ``dt`` seconds; None = its ``Ts``."""
        (lower, upper, noise), stack = model.bounds(schedule), model.stack(schedule)
        if dt is not None:
            rows = transition_rows(model, dt)
            stack = np.concatenate([rows, stack[:, rows.shape[1] :]], axis=1)
        return cls(stack, noise, (lower, upper))

    def difference(self, right: ModelSample) -> str | None:
        """What differs from the right matrices and bounds in any bit, or None; w only where this sample has it."""
        pairs = [("matrices", self.stack, right.stack), ("noise bound", self.noise, right.noise)]
        if self.w is not None and right.w is not None:
            pairs += [("disturbance bound", mine, its) for mine, its in zip(self.w, right.w, strict=True)]
        return next((what for what, mine, its in pairs if not np.array_equal(mine, its)), None)


def model_digest(model: UncertainModel | NonlinearModel, options: Options, samples: Iterable[ModelSample]) -> str:
    """SHA-256 of a model, of an observer's options, and of the model's numbers at some samples.

    Parameters
    ----------
    model : UncertainModel or NonlinearModel
    options : mapping
        Of text, numbers and arrays: whatever else decides what an observer of the model answers.
    samples : iterable of ModelSample
        A constant model is told apart by one sample, a scheduled one by those of a record.
    """
    content: dict[str, Any] = {
        "sizes": [model.n_states, model.n_inputs, model.n_outputs, model.n_disturbances],
        "Ts": model.Ts,
        "delta": [u.bounds for u in model.uncertainties] if isinstance(model, UncertainModel) else [],
        "w": model.disturbance_polytope if isinstance(model, UncertainModel) else None,
        "options": dict(options),
        "samples": [{"stack": s.stack, "noise": s.noise, "w": s.w} for s in samples],
    }
    if model.jitter is not None:
        content["jitter"] = model.jitter
    for name, promise in (("physical", model.physical_range), ("largest", model.start_range)):
        if promise is not None:
            content[name] = [promise.lower, promise.upper]
    if isinstance(model, NonlinearModel):
        content |= _equations(model)
    text = json.dumps(canonical(content), sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def _equations(model: NonlinearModel) -> dict[str, Any]:
    """What a nonlinear model is besides: its tapes, and the bounds of what they are of."""
    tapes = {
        name: [t.op, t.operands, t.constants, t.outputs] for name, t in (("f", model.flow.tape), ("h", model.reading))
    }
    valid = model.valid_range
    rest = {"continuous": model.continuous, "bounds": list(model.flow.w), "noise": model.noise}
    moving = {"varying": model.flow.varying.tolist(), "valid": None if valid is None else [valid.lower, valid.upper]}
    return tapes | rest | moving


def canonical(value: Any) -> Any:
    """A value as JSON can hold it, with every float in hexadecimal."""
    if isinstance(value, bool) or value is None or isinstance(value, str | int):
        return value
    if isinstance(value, float | np.floating):
        return float(value).hex()
    if isinstance(value, np.integer):
        return int(value)
    if isinstance(value, Mapping):
        return {key: canonical(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [canonical(item) for item in value]
    return encode_value(value)
