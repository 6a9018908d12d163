"""The rules that a plant keeps, and the check that asks them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from svo.logs.drive import drive
from svo.logs.log import Log
from svo.plant import HEALTHY, MonitoredPlant, schedule_of
from svo.plant.protocol import expect_plant
from svo.testing.plant_runs import SEED, PlantRuns, Scenario, around, cut, is_random, misfit, nominal_model
from svo.testing.rules import Conformance, keep, rule, table

LOOKED_AT = 100  # samples of a run that a bank is driven over
AFTER_A_FAULT = 400  # samples that a fault's observer is driven over
PLAINLY_BETTER = 0.5  # times the misfit


def check_plant(plant: MonitoredPlant) -> Conformance:
    """Ask every rule of `PLANT_RULES` of a plant.

    Parameters
    ----------
    plant : Plant or MonitoredPlant
        Of one that has no simulator, such as one described in TOML, only what it offers is asked.

    Returns
    -------
    Conformance
        The rules that hold, and those that could not be asked, with the reason.

    Raises
    ------
    TypeError
        If it is none, but its name or its class.
    ConformanceError
        (an AssertionError) at the first broken rule; it names the rule, what was seen and what to do.

    Notes
    -----
    Seeds are fixed. Every fault and profile is simulated once, and its observer driven over the first 400 samples of
    the fault; healthy runs of every noise set are looked at whole, the bank's answers over 100 samples.
    """
    expect_plant(plant)
    return keep(PLANT_RULES.values(), PlantRuns(plant))


@rule(
    "names of faults, noise sets and columns are those of the bank and of its nominal model",
    advice="name the bank's fault observers as in `faults`, and `columns` one name a channel, in the model's order",
)
def names(runs: PlantRuns) -> Iterator[str]:
    plant, columns = runs.monitored, runs.monitored.columns
    if not plant.noise_sets:
        yield "noise_sets is empty"
    for noise in plant.noise_sets:
        bank = plant.bank(noise)
        model, faults = nominal_model(bank), tuple(getattr(plant, "faults", bank.names[1:]))
        if bank.names[0] != "nominal" or set(bank.names[1:]) != set(faults):
            yield f"bank({noise!r}) has observers {bank.names}, and `faults` has {faults}"
        for group, size in (("inputs", model.n_inputs), ("outputs", model.n_outputs)):
            if len(getattr(columns, group)) != size:
                yield f"columns.{group} has {len(getattr(columns, group))} names; the model has {size}"
        if not np.isclose(model.Ts, plant.Ts, rtol=1e-12):
            yield f"Ts is {plant.Ts}; that of the nominal model is {model.Ts}"
    every = [columns.time, *(c.name for c in columns.inputs + columns.outputs + columns.states)]
    for name in {name for name in every if every.count(name) > 1}:
        yield f"columns names {name!r} more than once"


@rule("every call of bank() builds new observers", advice="build the observers inside bank(), and keep none of them")
def fresh_banks(runs: PlantRuns) -> Iterator[str]:
    noise = runs.monitored.noise_sets[0]
    first, second = runs.monitored.bank(noise), runs.monitored.bank(noise)
    shared = {id(observer) for observer in first.observers.values()}
    for name, observer in second.observers.items():
        if id(observer) in shared:
            yield f"two banks share the observer {name!r}"


@rule(
    "a log has one sample each Ts for as long as duration() promises, and its fault begins inside",
    advice="return round(duration(fault, profile) / Ts) rows, at most one more, Ts apart, and state times in seconds",
)
def length(runs: PlantRuns) -> Iterator[str]:
    plant = runs.plant
    for fault, profiles in plant.faults.items():
        if not len(profiles):
            yield f"faults[{fault!r}] has no profile, so it cannot be simulated"
    for scenario in (*runs.healthy, *runs.faulty):
        log, promised = runs.log(scenario), plant.duration(scenario.fault, scenario.profile) / plant.Ts
        if len(log) not in (round(promised), round(promised) + 1):
            yield f"{scenario} has {len(log)} samples; duration() promises {promised:g}"
        if np.abs(np.diff(log.time) - plant.Ts).max(initial=0.0) > 1e-6 * plant.Ts:
            yield f"{scenario} has samples that are not Ts = {plant.Ts:g} s apart"
        if scenario.fault != HEALTHY and not 0 < runs.first_faulty(scenario) < len(log):
            yield f"{scenario}: its fault begins at sample {runs.first_faulty(scenario)} of {len(log)}"


@rule(
    "a log has the channels that `columns` names",
    advice="let u, y and x have one column for each of columns.inputs, outputs and states, in that order",
)
def channels(runs: PlantRuns) -> Iterator[str]:
    columns = runs.plant.columns
    for scenario in (*runs.healthy, *runs.faulty):
        log = runs.log(scenario)
        for name, group in (("u", columns.inputs), ("y", columns.outputs), ("x", columns.states)):
            value = getattr(log, name)
            if group and (value is None or value.shape[1] != len(group)):
                yield f"{scenario} has {name} of shape {np.shape(value)}; columns names {len(group)} channels"
    for scenario in runs.healthy:
        if np.isnan(runs.log(scenario).y).all():
            yield f"{scenario} has no reading of any sensor"


@rule(
    "one seed gives one log, and another seed another one",
    advice="draw every random number from numpy.random.default_rng(seed), and keep nothing from run to run",
)
def one_seed(runs: PlantRuns) -> Iterator[str]:
    for scenario in (*runs.healthy, *runs.faulty[:1]):
        first, other = runs.log(scenario), runs.simulate(scenario, SEED + 1)
        for seed in (SEED, np.random.SeedSequence(SEED)):
            if not _same(first, runs.simulate(scenario, seed)):
                yield f"{scenario} gave another log when it was asked again, with seed {seed!r}"
        if _same(first, other) and is_random(runs.model(scenario.noise)):
            yield f"{scenario} gives the same log with seed {SEED + 1}"


def _same(one: Log, other: Log) -> bool:
    parts = [(getattr(one, name), getattr(other, name)) for name in ("time", "u", "y", "x", "schedule")]
    return all((a is None) == (b is None) and (a is None or np.array_equal(a, b, equal_nan=True)) for a, b in parts)


@rule(
    "the schedule of a log is what a fresh scheduler() says sample by sample",
    advice="fill Log.schedule with scheduler(), called with each y (and u) in turn, and nothing that comes later",
)
def schedule(runs: PlantRuns) -> Iterator[str]:
    for scenario in (*runs.healthy, *runs.faulty[:1]):
        log, scheduler = runs.log(scenario), runs.plant.scheduler()
        for k in range(min(len(log), LOOKED_AT)):
            said, stored = schedule_of(scheduler, log.y[k], log.u[k]), log.schedule_at(k)
            if not _agree(said, stored):
                yield f"{scenario}: the schedule of sample {k} is {stored}, and scheduler() says {said}"


def _agree(said: Any, stored: Any) -> bool:
    if said is None or stored is None:
        return said is stored
    return bool(np.allclose(said, stored, rtol=1e-9, atol=0.0))


@rule(
    "u[k] drives the true state from sample k to k + 1",
    advice="store in row k the input that is held from sample k on; another row of u explains the true states better",
)
def input_of_its_sample(runs: PlantRuns) -> Iterator[str]:
    for scenario, model, log in runs.truths():
        inner = slice(1, -1)  # where u of the samples beside is known
        own = misfit(model, log)
        for shift in (-1, 1):
            other = misfit(model, log, shift)
            if (own.excess[inner] > 0).any() and not (other.excess[inner] > 0).any():
                yield f"{scenario}: only u[k{shift:+d}] explains the true states within the bounds of the nominal model"
            ours, theirs = (np.sqrt(np.mean(m.transition[inner] ** 2, axis=0)) for m in (own, other))
            if (theirs < PLAINLY_BETTER * ours).any():
                yield f"{scenario}: u[k{shift:+d}] leaves {theirs} of the transitions unexplained (rms), u[k] {ours}"


@rule(
    "every measurement of a healthy plant is within the stated noise of the true state",
    advice="clip the noise at the n of the nominal model, or widen n; check that x and y are of the same sample",
)
def stated_noise(runs: PlantRuns) -> Iterator[str]:
    for scenario, model, log in runs.truths():
        excess = misfit(model, log).excess[:, model.n_states :]
        if (excess > 0).any():
            k, i = np.unravel_index(np.argmax(excess), excess.shape)
            yield f"{scenario}: output {i} of sample {k} is {1 + excess[k, i]:.4g} times its bound from the truth"


@rule(
    "every transition of a healthy plant is one of the nominal model",
    advice="widen w (or the uncertainties) of the nominal model, or draw what disturbs the plant within them",
)
def stated_disturbances(runs: PlantRuns) -> Iterator[str]:
    for scenario, model, log in runs.truths():
        excess = misfit(model, log).excess[:, : model.n_states]
        if (excess > 0).any():
            k, i = np.unravel_index(np.argmax(excess), excess.shape)
            yield f"{scenario}: state {i} moves {1 + excess[k, i]:.4g} times what the bounds allow after sample {k}"


@rule(
    "no observer of the bank that runs is falsified by a healthy plant, and the nominal one bounds the true state",
    advice="start from a set that holds the first state, and let each fault's model contain the nominal plant",
)
def healthy_bank(runs: PlantRuns) -> Iterator[str]:
    for scenario in runs.healthy:
        bank, log = runs.plant.bank(scenario.noise), cut(runs.log(scenario), 0, LOOKED_AT)
        for k, verdict in enumerate(drive(bank, log)):
            dead = [name for name, step in verdict.steps.items() if step.verdict == "falsified"]
            if dead:
                yield f"{scenario}: {', '.join(dead)} falsified at sample {k}"
            lower, upper = verdict.steps["nominal"].box
            if log.x is not None and log.x.shape[1] == lower.size and not _between(lower, log.x[k], upper):
                yield f"{scenario}: the true state {log.x[k]} of sample {k} is outside the box {lower} to {upper}"


def _between(lower: np.ndarray, x: np.ndarray, upper: np.ndarray) -> bool:
    room = 1e-9 * np.maximum(np.abs(lower), np.abs(upper))
    return bool((lower - room <= x).all() and (x <= upper + room).all())


@rule(
    "a run with a fault is another one than the run of the same seed without",
    advice="let simulate() act on the fault and the profile that it is asked for",
)
def fault_acts(runs: PlantRuns) -> Iterator[str]:
    healthy = runs.log(runs.healthy[0])
    for scenario in runs.faulty:
        log = runs.log(scenario)
        samples = min(len(log), len(healthy))
        if samples > runs.first_faulty(scenario) and _same(cut(log, 0, samples), cut(healthy, 0, samples)):
            yield f"{scenario} gives the log of a run without a fault"


@rule(
    "a fault's own observer is not falsified by that fault, whatever its profile",
    advice="let the fault's model allow at least the size of every profile, on the channel that simulate() corrupts",
)
def own_fault(runs: PlantRuns) -> Iterator[str]:
    for scenario in runs.faulty:
        at = _falsified_at(runs, scenario)
        if at is not None:
            yield f"{scenario}: the observer {scenario.fault!r} is falsified at sample {at}"


def _falsified_at(runs: PlantRuns, scenario: Scenario) -> int | None:
    """Where the fault's observer is falsified: started about the true state, or by its bank if that is not known."""
    log, first = runs.log(scenario), runs.first_faulty(scenario)
    bank = runs.plant.bank(scenario.noise)
    observer = bank.observers[scenario.fault]
    if log.x is None or log.x.shape[1] != observer.model.n_states:
        return bank.run(log).died_at[scenario.fault]
    observer.reset(around(log, first))
    for k, step in enumerate(drive(observer, cut(log, first, first + AFTER_A_FAULT))):
        if step.verdict == "falsified":
            return first + k
    return None


PLANT_RULES = table(
    names,
    fresh_banks,
    length,
    channels,
    one_seed,
    schedule,
    input_of_its_sample,
    stated_noise,
    stated_disturbances,
    healthy_bank,
    fault_acts,
    own_fault,
)
