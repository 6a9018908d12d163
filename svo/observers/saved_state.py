"""States of observers that belong to one model: a seal of two digests, checked before anything is believed.

``seal.model`` is the digest of the model and of the observer's options (`svo.models.digest`), with the matrices at the
model's typical schedule and at that of the last sample; ``seal.state`` is that of every array beside it. What a state
concludes is not believed either: observers prove a falsification again.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import fields
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from polytopes import HPolytope
from svo.checks import Array
from svo.models import ModelSample, UncertainModel, model_digest
from svo.models.digest import Options
from svo.models.nonlinear import NonlinearModel

Value = TypeVar("Value")
State = Mapping[str, NDArray[Any]]
MODEL, WHOLE, SCHEDULE = "seal.model", "seal.state", "seal.schedule"
_SET = ("A", "b", "C", "d")


def sealed(
    state: State, model: UncertainModel | NonlinearModel, options: Options, schedule: Any
) -> dict[str, NDArray[Any]]:
    """A copy of a state with the digests of its model and of itself.

    Parameters
    ----------
    state : mapping of str to array
    model : UncertainModel or NonlinearModel
    options : mapping
        Of the observer, as its ``options``.
    schedule : optional
        Scheduling value of the last sample; None before it, and for a model without.
    """
    copied = {name: np.array(value) for name, value in state.items()}
    if schedule is not None:
        copied[SCHEDULE] = _as_array(schedule)
    copied[MODEL] = np.array(_digest_of_model(copied, model, options))
    copied[WHOLE] = np.array(digest_of_arrays(copied))
    return copied


def check_unchanged(state: State) -> None:
    """Raise ValueError if a state has no seal, or an array that is not as it was when the state was made."""
    if MODEL not in state or WHOLE not in state:
        raise ValueError("it has no seal of its model, which state_dict() writes")
    if str(state[WHOLE]) != digest_of_arrays(state):
        raise ValueError("its arrays were changed, or some are missing, since state_dict() made it")


def check_model(state: State, model: UncertainModel | NonlinearModel, options: Options) -> None:
    """Raise ValueError if a state is that of another model, or of an observer with other options."""
    if str(state[MODEL]) != _digest_of_model(state, model, options):
        raise ValueError(
            "it is the state of another model or of other options; expected the very numbers that the observer was "
            "made with: matrices, bounds, sampling time, horizon"
        )


def arrays_of(name: str, value: Any) -> dict[str, NDArray[Any]]:
    """Copies of the arrays of a polytope, or of a dataclass of arrays, under its name."""
    parts = _SET if isinstance(value, HPolytope) else [f.name for f in fields(value)]
    return {f"{name}.{part}": getattr(value, part).copy() for part in parts}


def read_arrays(kind: type[Value], name: str, state: State) -> Value:
    """What `arrays_of` gave of a value of this type."""
    parts = _SET if kind is HPolytope else [f.name for f in fields(kind)]  # type: ignore[arg-type]
    return kind(*(np.array(state[f"{name}.{part}"]) for part in parts))


def numbers(state: State, name: str, *shape: int | str, missing: bool = False, infinite: bool = False) -> Array:
    """A copy of an array of floats: finite, or NaN where some may be missing; a name stands for any size.

    Raises
    ------
    KeyError, ValueError
        If there is none of this shape.
    """
    value = np.asarray(state[name])
    if value.dtype != np.float64 or value.ndim != len(shape):
        raise ValueError(f"{name} is {value.dtype} {value.shape}; expected float64 {shape}")
    if any(isinstance(wanted, int) and wanted != size for wanted, size in zip(shape, value.shape, strict=True)):
        raise ValueError(f"{name} has shape {value.shape}; expected {shape}")
    if not (np.isfinite(value) | (np.isnan(value) & missing) | (np.isinf(value) & infinite)).all():
        raise ValueError(f"{name} has an entry that is no number")
    return value.copy()


def sample_shapes(model: UncertainModel) -> dict[str, tuple[int, ...]]:
    """Shapes of the data of one sample, by their names in saved states."""
    n, nu, ny, nw = model.n_states, model.n_inputs, model.n_outputs, model.n_disturbances
    stack = (1 + len(model.uncertainties), n + ny, n + nu + 1 + nw)
    outputs = dict.fromkeys(("y", "noise", "slack"), (ny,))
    return {"stack": stack, "u": (nu,), **outputs, "w_lower": (nw,), "w_upper": (nw,), "w_box": (2, nw)}


def take_exactly(target: Mapping[str, NDArray[Any]], state: State) -> None:
    """Copy arrays of the same names; ValueError unless each has exactly the type and the shape of its target."""
    for name, array in target.items():
        value = np.asarray(state[name])
        if value.dtype != array.dtype or value.shape != array.shape:
            raise ValueError(f"{name} is {value.dtype} {value.shape}; expected {array.dtype} {array.shape}")
        array[...] = value


def last_schedule(state: State) -> Any:
    """The scheduling value that a state was made with, or None."""
    if SCHEDULE not in state:
        return None
    value = np.array(state[SCHEDULE])
    return value.item() if value.ndim == 0 else value


def _as_array(schedule: Any) -> NDArray[Any]:
    value = np.asarray(schedule)
    if value.dtype.kind not in "iuf":
        raise TypeError(f"schedule is {schedule!r}; a state can hold a number or an array of numbers only")
    return value


def _digest_of_model(state: State, model: UncertainModel | NonlinearModel, options: Options) -> str:
    linear: UncertainModel = model.carrier if isinstance(model, NonlinearModel) else model
    samples = [ModelSample.of(linear, linear.schedule)]
    if model.is_scheduled and SCHEDULE in state:
        samples.append(ModelSample.of(linear, last_schedule(state)))
    return model_digest(model, options, samples)


def digest_of_arrays(state: State) -> str:
    """SHA-256 of the names, types, shapes and bytes of all arrays but the seal itself."""
    whole = hashlib.sha256()
    for name in sorted(set(state) - {WHOLE}):
        value = np.ascontiguousarray(state[name])
        whole.update(f"{name} {value.dtype.str} {value.shape}\n".encode())
        whole.update(value.tobytes())
    return whole.hexdigest()
