"""A plant that a TOML file describes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from polytopes import HPolytope
from polytopes.shown import Shown, in_a_line
from svo.checks import Array, expect
from svo.interval.on_log import ThresholdDetection, detect_thresholds
from svo.isolation import ArchitectureI, ArchitectureII, Bank
from svo.logs.dialect.rules import Dialect
from svo.logs.log import Log
from svo.logs.names import Column, Columns
from svo.models import UncertainModel
from svo.models.intervals import has_own_intervals
from svo.models.nonlinear import NonlinearModel
from svo.observers.first_states import first_box
from svo.observers.window.observer import WindowObserver
from svo.plant import no_schedule
from svo.plant.description.faults import FaultModel, faults_of
from svo.plant.description.interval import IntervalSettings, interval_settings
from svo.plant.description.log import dialect_of
from svo.plant.description.model import box_of, model_file, model_of
from svo.plant.description.nonlinear import is_nonlinear, nonlinear_faults_of, nonlinear_model_of
from svo.plant.description.table import Table, read_table
from svo.plant.log_file import read_log

TOP = (
    "title", "Ts", "columns", "log", "model", "initial", "observer", "faults", "global", "bank", "interval_detector",
    "parameters", "simulation",
)  # fmt: skip
STATED = "stated"
Model: TypeAlias = UncertainModel | NonlinearModel


@dataclass(frozen=True)
class ObserverSettings(Shown):
    """How every observer of a described plant runs; arguments of `svo.WindowObserver`."""

    horizon: int | None = 10
    template: str | NDArray[np.float64] = "box"


@dataclass(frozen=True, eq=False)
class DescribedPlant(Shown):
    """A `svo.plant.MonitoredPlant` with one noise set, "stated": the bounds of the file.

    Attributes
    ----------
    name, title : str
        The file's name, and one line for people.
    columns : Columns
    model : UncertainModel or NonlinearModel
        The healthy plant.
    initial : HPolytope
        Bounded set that contains the state at the first sample.
    faults : mapping of str to FaultModel
        May be empty: then the bank detects only.
    observer : ObserverSettings
    global_set : HPolytope or None
        Bounded set that the state never leaves, healthy or faulty. With it the bank is Architecture II; without it
        Architecture I, where every fault model must contain the nominal plant.
    bank_options : mapping of str to int
        Any of debounce, recovery and timeout.
    files : tuple of path
        The files that describe the plant.
    interval : IntervalSettings or None
        An interval detector to run beside the bank.
    dialect : Dialect or None
        How logs are written, where they are not plain ones.
    """

    name: str
    title: str
    columns: Columns
    model: Model
    initial: HPolytope
    faults: Mapping[str, FaultModel]
    observer: ObserverSettings
    global_set: HPolytope | None
    bank_options: Mapping[str, int]
    files: tuple[Path, ...]
    interval: IntervalSettings | None = None
    dialect: Dialect | None = None
    noise_sets: tuple[str, ...] = (STATED,)

    def __repr__(self) -> str:
        return in_a_line(f"<DescribedPlant {self.name!r}: {self.title!r}; faults: {', '.join(self.faults) or 'none'}>")

    @property
    def Ts(self) -> float:
        """Sampling time [s]."""
        return self.model.Ts

    def bank(self, noise: str) -> Bank:
        """A fresh isolation bank.

        Raises
        ------
        ValueError
            If ``noise`` is not "stated".
        """
        expect(noise in self.noise_sets, "noise", noise, f"{STATED!r}, the bounds of {self.name}")
        nominal = self._observer(self.model)
        faults = {name: self._observer(fault.model) for name, fault in self.faults.items()}
        if self.global_set is None:
            return ArchitectureI(nominal, faults, **self.bank_options)
        class_one = tuple(name for name, fault in self.faults.items() if fault.contains_nominal)
        whole = self.model.whole(self.global_set) if isinstance(self.model, NonlinearModel) else self.global_set
        return ArchitectureII(nominal, faults, whole, class_one=class_one, **self.bank_options)

    def scheduler(self) -> Callable[[NDArray[np.float64]], Any]:
        """A described model has no schedule."""
        return no_schedule

    def widened(self, widening: Array) -> DescribedPlant:
        """The plant with bounds of its sensors' noise that are wider by ``widening`` (ny,), healthy and faulty."""
        faults = {name: replace(fault, model=_wider(fault.model, widening)) for name, fault in self.faults.items()}
        return replace(self, model=_wider(self.model, widening), faults=faults)

    @property
    def has_thresholds(self) -> bool:
        """Whether an interval detector runs beside the bank."""
        return self.interval is not None

    def detect_thresholds(self, log: Log) -> ThresholdDetection | None:
        """What the interval detector says about a log; None if there is none in the file."""
        if self.interval is None:
            return None
        return detect_thresholds(*self.interval.detector(log, lambda path: read_log(path, self)))

    def _observer(self, model: Model) -> WindowObserver:
        return WindowObserver(model, self.initial, horizon=self.observer.horizon, template=self.observer.template)


def read_description(path: str | Path) -> DescribedPlant:
    """Read a plant from a TOML file.

    Raises
    ------
    ValueError
        Naming file, table and key, what was found and what was expected.
    OSError
        If the file cannot be opened.
    """
    path = Path(path)
    top = read_table(path, TOP)
    columns = _columns(top)
    names = {group: [c.name for c in getattr(columns, group)] for group in ("inputs", "outputs", "states")}
    model: Model
    if is_nonlinear(top):
        model = nonlinear_model_of(top, names)
        faults = nonlinear_faults_of(top, model)
    else:
        if "simulation" in top:
            raise top.error("simulation", "has no meaning for a linear model; drop it")
        model = model_of(top, {group: found for group, found in names.items() if found})
        faults = faults_of(top, model, names)
    initial = _box(top, "initial", model)
    if isinstance(model, NonlinearModel):
        with top.table("initial").errors():
            model.check_first(*first_box(model.whole(initial), model))
    _check_architecture(top, model, faults)
    dialect = dialect_of(top, columns)
    if dialect is not None and dialect.events:
        _check_takes_events(top, model, faults)
    return DescribedPlant(
        name=path.name,
        title=top.text("title", path.stem),
        columns=columns,
        model=model,
        initial=initial,
        faults=faults,
        observer=_observer_settings(top, model, initial),
        global_set=_box(top, "global", model) if "global" in top else None,
        bank_options=_bank_options(top),
        files=_files(path, top.table("model")),
        interval=interval_settings(top, columns),
        dialect=dialect,
    )


def _check_takes_events(top: Table, model: Model, faults: Mapping[str, FaultModel]) -> None:
    """Refuse times of their own for what takes only those of the sampling time."""
    log = top.table("log")
    if "interval_detector" in top:
        raise log.error("times", 'is "events", and the gains of [interval_detector] are those of Ts; drop one of both')
    if not all(has_own_intervals(one) for one in (model, *(fault.model for fault in faults.values()))):
        raise log.error(
            "times", 'is "events", and a model is in discrete time, which has no other steps than Ts; state continuous '
            "= true in [model] with arrays of dx/dt"
        )  # fmt: skip


def _box(top: Table, key: str, model: Model) -> HPolytope:
    """A set of states; of a nonlinear plant those of its equations, without parameters that are constant."""
    return box_of(top.table(key), len(model.states) if isinstance(model, NonlinearModel) else model.n_states)


def _wider(model: Model, widening: Array) -> Model:
    return model.replace(n=np.asarray(model.n, dtype=float) + widening)


def _files(path: Path, model: Table) -> tuple[Path, ...]:
    return (path, path.parent / model_file(model)) if "file" in model else (path,)


def _columns(top: Table) -> Columns:
    table = top.table("columns", ("time", "inputs", "outputs", "states"))
    groups = {key: _group(table, key) for key in ("inputs", "outputs", "states")}
    if not groups["outputs"]:
        raise table.error("outputs", 'is missing; expected the measured columns, such as [{name = "y", unit = "m"}]')
    columns = Columns(**groups, time=table.text("time", "time_s"))
    every = [columns.time, *(c.name for c in columns.inputs + columns.outputs + columns.states)]
    twice = [name for name in every if every.count(name) > 1]
    if twice:
        raise table.error(None, f"names the column {twice[0]!r} more than once")
    return columns


def _group(table: Table, key: str) -> tuple[Column, ...]:
    return tuple(Column(entry.text("name"), entry.text("unit")) for entry in table.tables(key, ("name", "unit")))


def _observer_settings(top: Table, model: Model, initial: HPolytope) -> ObserverSettings:
    table = top.table("observer", ("horizon", "template"))
    horizon: int | None = None
    if table.content.get("horizon") != "full":
        horizon = table.count("horizon", ObserverSettings.horizon)
        if horizon < 1:
            raise table.error("horizon", f'is {horizon}; expected a number of samples >= 1, or "full" for all data')
    template: str | NDArray[np.float64] = "box"
    if "template" in table and table.content["template"] != "box":
        template = table.array("template")
    with table.errors():
        # An observer checks its own arguments; that of a nonlinear model the first set too.
        first = initial
        if isinstance(model, UncertainModel):
            model = model.replace(physical=None, largest=None)
            first = HPolytope.box(np.zeros(model.n_states), np.ones(model.n_states))
        WindowObserver(model, first, horizon=horizon, template=template)
    return ObserverSettings(horizon, template)


def _bank_options(top: Table) -> dict[str, int]:
    table = top.table("bank", ("debounce", "recovery", "timeout"))
    options = {key: table.count(key) for key in table.content}
    for key, value in options.items():
        if value < 1:
            raise table.error(key, f"is {value}; expected a number of samples >= 1")
    return options


def _check_architecture(top: Table, model: Model, faults: Mapping[str, FaultModel]) -> None:
    class_two = [name for name, fault in faults.items() if not fault.contains_nominal]
    if class_two and "global" not in top:
        raise top.error(
            None,
            f"the model of fault {class_two[0]!r} need not contain the nominal plant, so its observer needs a set to "
            "start from: add [global] with bounds that the state never leaves, or contains_nominal = true",
        )
    moved = [name for name, fault in faults.items() if fault.model.n_states != model.n_states]
    if "global" in top and moved:
        raise top.error(
            "global", f"starts fault {moved[0]!r}, which moves a constant parameter and has other states; free it"
        )
    if "global" in top and not faults:
        raise top.error("global", "has no meaning without faults; drop it, or add [faults.NAME]")
