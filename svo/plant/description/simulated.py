"""A described nonlinear plant that is simulated too: what studies and comparisons ask of a plant."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from polytopes import HPolytope
from polytopes.shown import Shown, in_a_line
from svo.checks import Array, expect
from svo.faults import Ramp, SensorFault, Step, simulate_fault
from svo.faults.equations import rewritten, with_inputs
from svo.functions.expression import Recorder
from svo.functions.tape import Tape
from svo.functions.text import parsed
from svo.isolation import Bank
from svo.logs.log import Log
from svo.logs.names import Column, Columns
from svo.models import UncertainModel
from svo.models.draws import draw
from svo.models.nonlinear import NonlinearModel
from svo.plant.description.faults import FaultModel
from svo.plant.description.plant import TOP, DescribedPlant, read_description
from svo.plant.description.table import Table, read_table
from svo.plant.protocol import HEALTHY, Distribution, Reference, StatedFault

if TYPE_CHECKING:
    from svo.detectors.detector import Detector

_KEYS = ("duration", "fault_time", "soft", "inputs")
_SUBSTEPS = 10


@dataclass(frozen=True, eq=False)
class SimulatedPlant(Shown):
    """A described plant with a table [simulation]: a `svo.plant.Plant`.

    Attributes
    ----------
    described : DescribedPlant
    path : Path
        Of its file, by which every process finds it.
    length, fault_time, soft : float
        Seconds of a run, of its first faulty sample, and until a fault of the profile "soft" is whole.
    inputs : Tape
        Of the time [s], one row an input.
    distribution : "bounded" or "gaussian"
        Of the sensors' noise.
    """

    described: DescribedPlant
    path: Path
    length: float
    fault_time: float
    soft: float
    inputs: Tape
    distribution: Distribution = "bounded"

    def __repr__(self) -> str:
        return in_a_line(f"<SimulatedPlant {self.name!r}: {self.title!r}; faults: {', '.join(self.faults) or 'none'}>")

    @property
    def name(self) -> str:
        return str(self.path)

    @property
    def title(self) -> str:
        return self.described.title

    @property
    def Ts(self) -> float:
        return self.described.Ts

    @property
    def noise_sets(self) -> tuple[str, ...]:
        return self.described.noise_sets

    @property
    def columns(self) -> Columns:
        """Those of the description; with the true states, which a run has."""
        own = self.described.columns
        states = tuple(Column(f"true_{name}", "") for name in self.model.names["states"])
        return replace(own, states=states)

    @property
    def model(self) -> NonlinearModel:
        """The healthy plant."""
        model: Any = self.described.model
        return model

    @property
    def faults(self) -> Mapping[str, tuple[str, ...]]:
        return dict.fromkeys(self.described.faults, ("step", "soft"))

    @property
    def reference(self) -> Mapping[tuple[str, str], Reference]:
        return {}

    @property
    def reference_title(self) -> str:
        return ""

    def duration(self, fault: str, profile: str) -> float:
        """Length of a run [s], whatever the ``fault`` and its ``profile``."""
        return self.length

    def bank(self, noise: str) -> Bank:
        """As of `DescribedPlant`, for a ``noise`` set."""
        return self.described.bank(noise)

    def scheduler(self) -> Callable[[Array], Any]:
        """A described model has no schedule."""
        return self.described.scheduler()

    # -- runs ------------------------------------------------------------------------------------------

    def simulate(self, fault: str, profile: str, noise: str, seed: int | np.random.SeedSequence) -> Log:
        """One run from a first state in [initial], with the ``profile`` of a ``fault``, or "none".

        Raises
        ------
        ValueError
            If there is no such fault, profile or noise set.
        """
        expect(noise in self.noise_sets, "noise", noise, f"any of {', '.join(self.noise_sets)}")
        rng, u = np.random.default_rng(seed), self._commands()
        exact = self.model.replace(n=np.zeros(self.model.n_outputs)) if self.distribution == "gaussian" else self.model
        x0 = draw(*self.model.whole(self.described.initial).bounding_box(), rng, corners=False)
        if fault == HEALTHY:
            log = exact.simulate(x0, u, rng, substeps=_SUBSTEPS)
        else:
            expect(fault in self.faults, "fault", fault, f"any of {', '.join(self.faults) or '(there is none)'}")
            log = self._faulty(exact, self.described.faults[fault], profile, x0, u, rng)
        if self.distribution == "gaussian":
            log = replace(log, y=log.y + rng.normal(size=log.y.shape) * self.model.noise / np.sqrt(3.0))
        return log

    def _commands(self) -> Array:
        time: Array = np.arange(round(self.length / self.Ts), dtype=float) * self.Ts
        return self.inputs.values(time[:, None]).reshape(len(time), self.model.n_inputs)

    def _profile(self, profile: str) -> Step | Ramp:
        every = {"step": Step(self.fault_time), "soft": Ramp(self.fault_time, self.soft)}
        expect(profile in every, "profile", profile, "step or soft")
        return every[profile]  # type: ignore[return-value]

    def _faulty(
        self, plant: NonlinearModel, fault: FaultModel, profile: str, x0: Array, u: Array, rng: np.random.Generator
    ) -> Log:
        shape = self._profile(profile)
        if fault.acting is not None:
            return simulate_fault(plant, replace(fault.acting, profile=shape), x0, u, rng, substeps=_SUBSTEPS)
        return self._moved(plant, fault, shape.value(np.arange(len(u)) * self.Ts), x0, u, rng)

    def _moved(
        self, plant: NonlinearModel, fault: FaultModel, p: Array, x0: Array, u: Array, rng: np.random.Generator
    ) -> Log:
        """The healthy plant until the fault's share p (K,) is above zero, then the faulty one."""
        faulty: Any = fault.model
        begins = int(np.argmax(p > 0.0))
        before = plant.simulate(x0, u[: begins + 1], rng, substeps=_SUBSTEPS)
        assert before.x is not None
        known, values = dict(zip(plant.flow.states, before.x[begins], strict=True)), {}
        for name in fault.moved:
            low, high = np.broadcast_to(known.get(name, plant.parameters.get(name, 0.0)), 2)
            healthy, share = rng.uniform(low, high, len(u) - begins), p[begins:]
            moved = (1.0 - share) * healthy + share * full_size(faulty, plant, name)
            values[name] = np.clip(moved, *_ends(faulty, name))
        begun = [known[name] for name in faulty.flow.states]
        after = faulty.replace(n=plant.noise).simulate(begun, u[begins:], rng, substeps=_SUBSTEPS, parameters=values)
        own = values | dict(zip(faulty.flow.states, after.x.T, strict=True))
        x = np.vstack([before.x[:begins], np.column_stack([own[name] for name in plant.flow.states])])
        time: Array = np.arange(len(u), dtype=float) * self.Ts
        return Log(time, u, np.vstack([before.y[:begins], after.y]), x=x)

    # -- what else it offers ---------------------------------------------------------------------------------

    @property
    def input_limits(self) -> tuple[Array, Array]:
        """Of the commands of a run."""
        u = self._commands()
        return u.min(axis=0), u.max(axis=0)

    def stated_faults(self, noise: str) -> dict[str, StatedFault]:
        """The plant with each fault whole from the first sample on, where its size is a number; for a ``noise`` set."""
        stated = {name: _stated(fault, self.model) for name, fault in self.described.faults.items()}
        return {
            name: StatedFault(f"{name}, whole", model) for name, model in stated.items() if model is not None
        }  # fmt: skip

    @property
    def compared_faults(self) -> tuple[tuple[str, str], ...]:
        """Every fault, as a step."""
        return tuple((name, "step") for name in self.faults)

    def with_noise(self, distribution: Distribution) -> SimulatedPlant:
        """This plant with its sensors' noise of another ``distribution``; bounds stay."""
        return replace(self, distribution=distribution)

    def detectors(self, noise: str) -> Sequence[Detector]:
        """The bank of the plant's own equations, and a Kalman filter of what is linear at the first states.

        Whatever the ``noise`` set.
        """
        from svo.baselines.linear_gaussian import GaussianModel  # imported here: detection compares nothing
        from svo.detectors.standard import KalmanChiSquare
        from svo.detectors.window_bank import WindowBank

        faults = {name: fault.model for name, fault in self.described.faults.items() if fault.contains_nominal}
        models: dict[str, Any] = {"nominal": self.model, **faults}
        bank = WindowBank(models, self.described.initial, self.described.observer.horizon, stated=True)
        linear = linear_at(self.model, self.described.initial, self._commands()[0])
        return [bank, KalmanChiSquare(GaussianModel(linear, self.model.whole(self.described.initial)))]


def _ends(model: NonlinearModel, name: str) -> tuple[float, float]:
    low, high = np.broadcast_to(model.parameters[name], 2)
    return float(low), float(high)


def full_size(faulty: NonlinearModel, healthy: NonlinearModel, name: str) -> float:
    """The end of a faulty parameter that is farthest from its healthy bounds."""
    low, high = _ends(faulty, name)
    least, most = np.broadcast_to(healthy.parameters.get(name, 0.0), 2)
    return high if high - most >= least - low else low


def _stated(fault: FaultModel, healthy: NonlinearModel) -> NonlinearModel | None:
    """The plant with a fault of its full size; None where it is no number."""
    model: Any = fault.model
    if fault.acting is None:
        return model.replace(parameters=model.parameters | {n: full_size(model, healthy, n) for n in fault.moved})
    if isinstance(fault.acting, SensorFault) and fault.acting.kind in ("bias", "drift"):
        where, size = np.atleast_1d(fault.acting.where).tolist(), fault.acting.magnitude

        def law(own: Any, z: Any, v: Any, d: Any) -> list[Any]:
            return [row + size if i in where else row for i, row in enumerate(own(z))]

        return rewritten(healthy, outputs=law)
    further = [name for name in model.parameters if name not in healthy.parameters]
    if not further:
        return None
    return model.replace(parameters=model.parameters | {n: full_size(model, healthy, n) for n in further})


def linear_at(model: NonlinearModel, initial: HPolytope, u: Array) -> UncertainModel:
    """A constant linear model: that of the plant at the middle of a set of states and one input, without remainders."""
    whole, known = model.whole(initial), model.n_disturbances

    def shifted(held: list[Any], v: Any, d: Any) -> None:
        for i in range(len(held)):
            held[i] = held[i] + v[i]

    law = with_inputs(shifted)
    steps = {f"deviation of {name}": (-1e-3, 1e-3) for name in model.inputs}
    near = rewritten(model.replace(varying=()), dynamics=law, outputs=law, disturbances=steps)
    x = np.mean(whole.bounding_box(), axis=0)
    moved, read = near.transition(x, x, u), near.output(x, x, u)
    inputs = slice(known, known + len(u))
    B, D = moved.E[:, inputs], read.F[:, inputs]
    w = tuple(np.delete(end, inputs) for end in near.flow.w)
    return UncertainModel(
        moved.A, B, read.C, D=D, a=moved.a - B @ u, c=read.c - D @ u, E=np.delete(moved.E, inputs, axis=1), w=w,
        n=model.noise, Ts=model.Ts,
    )  # fmt: skip


def simulated_plant(path: str | Path) -> SimulatedPlant:
    """The plant of a TOML file with a table [simulation].

    Raises
    ------
    ValueError
        Naming file, table and key: no such table, a linear plant, or a mistake in it.
    OSError
        If the file cannot be opened.
    """
    described, top = read_description(path), read_table(Path(path), TOP)
    if not isinstance(described.model, NonlinearModel):
        raise top.error(
            None, "describes a linear model for logs, and this command needs a plant that it can simulate: equations "
            "([model.dynamics]) and [simulation], or a plant registered in Python (docs/studies.md)"
        )  # fmt: skip
    if "simulation" not in top:
        raise top.error(
            "simulation", "is missing; expected duration, fault_time and inputs, such as { pump = '60 + sin(t)' }, "
            "since this command needs a plant that it can simulate"
        )  # fmt: skip
    table = top.table("simulation", _KEYS)
    length, fault_time, soft = (_seconds(table, key) for key in ("duration", "fault_time", "soft"))
    if not described.Ts <= fault_time < length:
        raise table.error("fault_time", f"is {fault_time:g}; expected Ts or more, below duration = {length:g}")
    return SimulatedPlant(described, Path(path), length, fault_time, soft, _inputs(table, described.columns))


def _seconds(table: Table, key: str) -> float:
    value = table.number(key, 10.0) if key == "soft" else table.number(key)
    if not value > 0.0:
        raise table.error(key, f"is {value:g}; expected seconds above 0")
    return value


def _inputs(table: Table, columns: Columns) -> Tape:
    """One expression of t an input."""
    own = table.table("inputs", tuple(column.name for column in columns.inputs))
    recorder = Recorder()
    t = recorder.variable(0)
    rows = []
    for column in columns.inputs:
        with own.errors(column.name):
            rows.append(parsed(f"input {column.name}", own.text(column.name), recorder, {"t": t}))
    return Tape.of(recorder, rows, 1)
