"""An input for a plant of the registry that isolates one of its stated faults within a number of samples."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

import numpy as np

from svo.analysis.distinguish import Distinguishability, distinguishability
from svo.analysis.input_design import InputDesign, design_input
from svo.analysis.isolability import FaultFreeFlight, horizon_text, stated_faults
from svo.checks import Array, finite_array
from svo.logs.csv import write_csv
from svo.plant import Plant


@runtime_checkable
class LimitsInputs(Protocol):
    """What a `Plant` offers besides if inputs can be designed for it.

    Attributes
    ----------
    input_limits : (lower, upper)
        Bounds of the inputs, each (nu,), in the units of `Columns.inputs`.
    """

    input_limits: tuple[Array, Array]


@dataclass(frozen=True)
class PlantInput:
    """A designed input beside the one of the fault-free flight that it deviates from.

    Attributes
    ----------
    plant, noise, fault : str
    description : str
        The fault and its size.
    seed : int
        Of the flight.
    Ts, fault_time : float
        Sampling time, and time of the first of the designed samples [s].
    inputs : tuple of str
        Column names of the inputs, as in a log.
    design : InputDesign
    before, after : mapping of observer to Distinguishability
        Without and with the designed input; ``after`` is empty if none was found.
    """

    plant: str
    noise: str
    fault: str
    description: str
    seed: int
    Ts: float
    fault_time: float
    inputs: tuple[str, ...]
    design: InputDesign
    before: Mapping[str, Distinguishability]
    after: Mapping[str, Distinguishability]

    def to_dict(self) -> dict[str, Any]:
        """For JSON; ``horizon`` counts samples, null = never within those of the design."""
        u = self.design.u
        return {
            "plant": self.plant,
            "noise": self.noise,
            "fault": self.fault,
            "description": self.description,
            "seed": self.seed,
            "samples": len(self.design.reference),
            "Ts": self.Ts,
            "energy": self.design.energy,
            "separation": self.design.separation,
            "horizon": self.design.horizon,
            "observers": {
                name: {
                    "horizon_without": answer.horizon,
                    "horizon_with": self.after[name].horizon if self.after else None,
                }
                for name, answer in self.before.items()
            },
            "inputs": None if u is None else {name: u[:, i].tolist() for i, name in enumerate(self.inputs)},
        }

    def to_text(self) -> str:
        """For people."""
        samples = len(self.design.reference)
        head = f"{self.fault} fault ({self.description}), {self.noise} noise, within {samples} samples"
        lines = [
            f"    observer {name}: {horizon_text(answer, self.Ts)} in the flight without it"
            + (f", {horizon_text(self.after[name], self.Ts)} with it" if self.after else "")
            for name, answer in self.before.items()
        ]
        if self.design.u is None:
            lines.insert(0, f"No input found for: {head}. Best separation {self.design.separation:.3g} noise widths.")
            return "\n".join(lines)
        deviation = self.design.u - self.design.reference
        for i, name in enumerate(self.inputs):
            low, high = (round(float(end), 6) for end in (deviation[:, i].min(), deviation[:, i].max()))
            if max(-low, high) > 1e-6 * np.abs(deviation).max():
                lines.append(f"    {name}: between {low:+.4g} and {high:+.4g} beside the flight's own")
        lines.insert(0, f"Input of energy {self.design.energy:.4g} (squares of shares of the range) for: {head}.")
        return "\n".join(lines)

    def write(self, path: Path) -> None:
        """The designed inputs as CSV: time [s] and the columns of the inputs; needs a design that was found."""
        assert self.design.u is not None
        time = [round(self.fault_time + k * self.Ts, 12) for k in range(len(self.design.u))]
        write_csv(path, {"time_s": np.array(time), **dict(zip(self.inputs, self.design.u.T, strict=True))})


def plant_input(
    plant: Plant,
    noise: str,
    fault: str,
    horizon: int,
    *,
    inputs: Sequence[str] = (),
    hold: int = 1,
    size: float = 1.0,
    seed: int = 0,
) -> PlantInput:
    """Design an input that falsifies every observer of a plant's bank but that of the true fault.

    As for `svo.analysis.isolability.isolability`, a flight without a fault gives reference, schedule and first states.

    Parameters
    ----------
    plant : Plant
        One that also has ``stated_faults`` and ``input_limits``.
    noise, fault : str
        Noise set, and the stated fault to isolate.
    horizon : int
        Samples within which all the others are falsified for certain.
    inputs : sequence of str
        Column names of the inputs that may deviate from the flight's own; all by default.
    hold : int
        The deviation is constant over so many samples.
    size : float
        Of the fault, as a fraction of the one that the plant states.
    seed : int
        Of the flight.

    Raises
    ------
    ValueError
        If the plant lacks what is needed, for unknown names, or if the flight is too short.
    """
    stated = stated_faults(plant, noise, size)
    if fault not in stated:
        raise ValueError(f"plant {plant.name!r} states no fault {fault!r}; it has {', '.join(stated)}")
    flight = FaultFreeFlight.of(plant, noise, seed, horizon)
    names = tuple(column.name for column in plant.columns.inputs)
    lower, upper = _limits(plant, names, inputs, flight.u[:horizon])
    case, observers = stated[fault], [name for name in flight.models if name != fault]
    start, schedule = flight.known["nominal"], flight.schedule  # the plant was healthy until now
    span = np.subtract(*reversed(_input_limits(plant)))
    design = design_input(
        case.model,
        [flight.models[name] for name in observers],
        horizon,
        initial=start,
        limits=(lower, upper),
        observer_initial=[flight.known[name] for name in observers],
        reference=flight.u,
        schedule=schedule,
        weight=1.0 / np.square(span),
        hold=hold,
    )
    before = {
        name: distinguishability(
            case.model,
            flight.models[name],
            horizon,
            initial=start,
            observer_initial=flight.known[name],
            u=flight.u,
            schedule=schedule,
        )
        for name in observers
    }
    after = dict(zip(observers, design.checks, strict=True)) if design.checks else {}
    return PlantInput(
        plant.name, noise, fault, case.description, seed, plant.Ts, plant.fault_time, names, design, before, after
    )


def _input_limits(plant: Plant) -> tuple[np.ndarray, np.ndarray]:
    if not isinstance(plant, LimitsInputs):
        raise ValueError(f"plant {plant.name!r} has no input_limits (lower, upper); they are needed to design inputs")
    lower, upper = plant.input_limits
    return finite_array("lower input limit", lower), finite_array("upper input limit", upper)


def _limits(
    plant: Plant, names: tuple[str, ...], chosen: Sequence[str], reference: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Bounds (N, nu): the plant's for the chosen inputs, the flight's own for the others."""
    for name in chosen:
        if name not in names:
            raise ValueError(f"plant {plant.name!r} has no input {name!r}; it has {', '.join(names)}")
    lower, upper = (np.tile(end, (len(reference), 1)) for end in _input_limits(plant))
    for i, name in enumerate(names):
        if chosen and name not in chosen:
            lower[:, i] = upper[:, i] = reference[:, i]
    return lower, upper
