"""The runs of a plant that its rules look at, and what its nominal model says about their true states."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from polytopes import HPolytope
from svo.checks import Array
from svo.isolation import Bank
from svo.logs.log import Log
from svo.models import UncertainModel
from svo.models.nonlinear import NonlinearModel, Undecided
from svo.plant import HEALTHY, MonitoredPlant, Plant, fault_start
from svo.testing.rules import NotApplicable

SEED = 20130401
Model = UncertainModel | NonlinearModel
ROUNDING = 1e-9  # of the terms of an equation: a plant may integrate where its model has matrices


@dataclass(frozen=True)
class Scenario:
    """What `Plant.simulate` is asked for."""

    fault: str
    profile: str
    noise: str

    def __str__(self) -> str:
        return f"simulate({self.fault!r}, {self.profile!r}, {self.noise!r}, {SEED})"


class PlantRuns:
    """The runs of a plant, each simulated once.

    Parameters
    ----------
    plant : Plant or MonitoredPlant
    """

    def __init__(self, plant: MonitoredPlant) -> None:
        self.monitored = plant
        self._logs: dict[Scenario, Log] = {}
        self._models: dict[str, Model] = {}

    @property
    def plant(self) -> Plant:
        """The plant, if it can be simulated."""
        if not isinstance(self.monitored, Plant):
            raise NotApplicable("the plant has no simulator")
        return self.monitored

    @property
    def healthy(self) -> list[Scenario]:
        """A run without a fault for each noise set."""
        return [Scenario(HEALTHY, HEALTHY, noise) for noise in self.plant.noise_sets]

    @property
    def faulty(self) -> list[Scenario]:
        """Every fault and profile, with the default noise set."""
        noise = self.plant.noise_sets[0]
        return [Scenario(fault, p, noise) for fault, profiles in self.plant.faults.items() for p in profiles]

    def log(self, scenario: Scenario) -> Log:
        """The run of a ``scenario`` with the seed of the rules."""
        if scenario not in self._logs:
            self._logs[scenario] = self.simulate(scenario, SEED)
        return self._logs[scenario]

    def simulate(self, scenario: Scenario, seed: int | np.random.SeedSequence) -> Log:
        """A fresh run of a ``scenario`` with a ``seed``."""
        return self.plant.simulate(scenario.fault, scenario.profile, scenario.noise, seed)

    def model(self, noise: str) -> Model:
        """Of the nominal observer of the bank for a ``noise`` set."""
        if noise not in self._models:
            self._models[noise] = nominal_model(self.monitored.bank(noise))
        return self._models[noise]

    def first_faulty(self, scenario: Scenario) -> int:
        """Number of the first faulty sample of a ``scenario``; that after the last one without a fault."""
        log = self.log(scenario)
        if scenario.fault == HEALTHY:
            return len(log)
        start = fault_start(self.plant, scenario.fault, scenario.profile)
        return round((start - float(log.time[0])) / self.plant.Ts)

    def truths(self) -> Iterator[tuple[Scenario, Model, Log]]:
        """The healthy part of every run whose true states are those of the nominal model."""
        for scenario in (*self.healthy, *self.faulty):
            model, log = self.model(scenario.noise), cut(self.log(scenario), 0, self.first_faulty(scenario))
            if log.x is None or log.x.shape[1] != model.n_states:
                raise NotApplicable("the log has no true states, or other ones than the model of the nominal observer")
            if len(log) > 2:
                yield scenario, model, log


def nominal_model(bank: Bank) -> Model:
    model: Model = bank.observers["nominal"].model
    return model


def is_random(model: Model) -> bool:
    """Whether a ``model`` leaves anything to chance."""
    if isinstance(model, NonlinearModel):
        lower, upper, noise = *model.flow.w, model.noise
    else:
        lower, upper, noise = model.bounds(model.schedule)
    return bool(noise.any() or (upper > lower).any())


def cut(log: Log, first: int, end: int) -> Log:
    """Samples ``first`` to ``end`` of a log, the end not included."""
    x, schedule = (None if value is None else value[first:end] for value in (log.x, log.schedule))
    return Log(log.time[first:end], log.u[first:end], log.y[first:end], x=x, schedule=schedule)


@dataclass(frozen=True)
class Misfit:
    """What the true states leave unexplained in each equation, and how much the bounds of a model allow.

    Attributes
    ----------
    transition, output : (K - 1, n), (K - 1, ny) arrays
        x(k+1) - (A x + B u + a) and y - (C x + D u + c), every unknown at the middle of its bounds; NaN where a sensor
        is missing.
    allowed : (K - 1, n + ny) array
        Largest absolute value of [transition, output] under the bounds.
    """

    transition: Array
    output: Array
    allowed: Array

    @property
    def excess(self) -> Array:
        """Share of what is allowed by which each equation is broken, (K - 1, n + ny); <= 0 where it holds."""
        both = np.nan_to_num(np.abs(np.hstack([self.transition, self.output])))
        return both / np.maximum(self.allowed, np.finfo(float).tiny) - 1.0


def misfit(model: Model, log: Log, shift: int = 0) -> Misfit:
    """That of a log with true states, if ``u[k + shift]`` drove sample k."""
    if isinstance(model, NonlinearModel):
        return _of_equations(model, log, shift)
    stack, (lower, upper, noise) = _along(model, log)
    n, known = model.n_states, _known(log, shift, (lower + upper) / 2)
    predicted, terms = _product(stack[:, 0], known), _product(np.abs(stack[:, 0]), np.abs(known))
    half = (upper - lower) / 2
    w, allowed = slice(known.shape[1] - half.shape[1], None), np.zeros_like(predicted)
    allowed += _product(np.abs(stack[:, 0, :, w]), half)
    for item, uncertainty in enumerate(model.uncertainties, start=1):
        low, high = uncertainty.bounds
        driven = _product(stack[:, item], known)
        predicted += (low + high) / 2 * driven
        allowed += (high - low) / 2 * np.abs(driven)
        allowed += max(abs(low), abs(high)) * _product(np.abs(stack[:, item, :, w]), half)
    assert log.x is not None
    following = np.vstack([log.x[1:], np.full((1, n), np.nan)])
    allowed[:, n:] += noise
    allowed += ROUNDING * (terms + np.abs(np.nan_to_num(np.hstack([following, log.y]))))
    return Misfit((following - predicted[:, :n])[:-1], (log.y - predicted[:, n:])[:-1], allowed[:-1])


def _of_equations(model: NonlinearModel, log: Log, shift: int) -> Misfit:
    """That of a nonlinear model, linearised at each true state; nothing is asked where it is not enclosed."""
    assert log.x is not None
    w, rows = model.flow.w, len(log) - 1
    middle, half = 0.5 * (w.lower + w.upper), 0.5 * (w.upper - w.lower)
    following = np.hstack([log.x[1:], log.y[:-1]])
    predicted, allowed = np.zeros_like(following), np.full_like(following, np.inf)
    for k in range(rows):
        x, u = log.x[k], log.u[min(max(k + shift, 0), rows)]
        try:
            move, read = model.transition(x, x, u), model.output(x, x, u)
        except Undecided:
            continue
        predicted[k] = np.hstack([move.A @ x + move.a + move.E @ middle, read.C @ x + read.c + read.F @ middle])
        allowed[k] = np.hstack([np.abs(move.E) @ half + move.R, np.abs(read.F) @ half + read.R + model.noise])
    left = following - predicted
    allowed += ROUNDING * (np.abs(predicted) + np.abs(np.nan_to_num(following)))
    return Misfit(left[:, : model.n_states], left[:, model.n_states :], allowed)


def _along(model: UncertainModel, log: Log) -> tuple[Array, tuple[Array, Array, Array]]:
    """Matrices and bounds at every sample."""
    values = np.zeros(len(log)) if log.schedule is None else log.schedule
    lower, upper, noise = model.bounds_over(values)
    rows: Any = [np.broadcast_to(v, (len(log), np.shape(v)[-1])) for v in (lower, upper, noise)]
    return model.stack_over(values), tuple(rows)


def _known(log: Log, shift: int, w: Array) -> Array:
    """(x, u, 1, w) of every sample, the input of another one at the edge for want of a better."""
    assert log.x is not None
    samples = np.clip(np.arange(len(log)) + shift, 0, len(log) - 1)
    return np.hstack([log.x, log.u[samples], np.ones((len(log), 1)), w])


def _product(matrices: Array, vectors: Array) -> Array:
    return np.einsum("kij,kj->ki", matrices, vectors)


def around(log: Log, k: int) -> HPolytope:
    """A box about the true state of a sample, a tenth of what the run covers to either side."""
    assert log.x is not None
    size = np.abs(log.x).max(axis=0)
    half = 0.1 * np.ptp(log.x, axis=0) + 1e-6 * np.where(size > 0, size, 1.0)
    return HPolytope.box(log.x[k] - half, log.x[k] + half)
