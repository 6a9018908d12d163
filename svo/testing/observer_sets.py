"""Rules about sets: what an observer says must hold every state that the model and the data allow."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction

import numpy as np

from svo.checks import Array
from svo.logs.drive import drive
from svo.testing.observer_kind import COARSE, Kind, left_out, missing, short_of
from svo.testing.rules import NotApplicable, rule
from svo.testing.systems import EXACT, FEEDTHROUGH, PLAIN, RICH, TWO_SENSORS, UNCERTAIN_GAIN, UNSEEN

SET = ("support", "set")
EVERYTHING = ("box", *SET)
SAMPLES = 7
UNITS = (1.0, 2.0**-30, 2.0**20)


def inputs(size: float, seed: int, samples: int = SAMPLES) -> Array:
    """Inputs that jump, in quarters of a size."""
    jumps: Array = np.random.default_rng(seed).integers(-4, 5, (samples, 1)).astype(np.float64)
    return jumps * size / 4.0


@rule(
    "a reading that is missing (NaN) says nothing, and the others are read",
    advice="leave out the rows of sensors whose reading is NaN; do not put zeros or the last reading in their place",
)
def missing_readings(kind: Kind) -> Iterator[str]:
    far = np.full((SAMPLES, 1), 64.0)
    for system in kind.taken([PLAIN, UNSEEN, TWO_SENSORS]):
        sensors = range(system.model.n_outputs)
        for gaps in ({0: sensors, 3: sensors, 4: sensors}, {2: sensors[:1], 5: sensors[-1:]}):
            yield from left_out(kind, system, missing(system.calm(far, 1), gaps), SET)


@rule(
    "step(u, y, u_next): u leads to the sample of y, and u_next is that sample's own",
    advice="move the set with u and read y with u_next (D u_next); in update, read y0 with its u",
)
def input_of_its_sample(kind: Kind) -> Iterator[str]:
    for system in kind.taken([PLAIN, UNSEEN, FEEDTHROUGH, UNCERTAIN_GAIN]):
        yield from left_out(kind, system, system.calm(inputs(64.0, 2), 2), SET)


@rule(
    "a measurement that comes late is one of its own sample",
    advice="put its rows at the sample that late_update names, and carry the set on from there to the newest sample",
)
def late_at_its_sample(kind: Kind) -> Iterator[str]:
    kind.that_can("takes_late")
    run = PLAIN.calm(64.0 * np.arange(SAMPLES)[:, None], 3)
    for age in (1, 2, 3):
        log, observer = missing(run, {k: [0] for k in range(2, SAMPLES)}), kind.observer()
        for k, _ in enumerate(drive(observer, log)):
            if k - age >= 2 and k - age >= observer.window[0]:
                step = observer.late_update(run.y[k - age], k - age)
                log.y[k - age] = run.y[k - age]
                states = PLAIN.states(log)[k]
                for breach in short_of(step, states, SET, COARSE):
                    yield f"sample {k}, with the measurement of sample {k - age}: {breach}"


@rule(
    "the box bounds the state in every coordinate",
    advice="bound each coordinate over the whole set (its supports along the axes), not over a part or an inner box",
)
def box(kind: Kind) -> Iterator[str]:
    for system in kind.taken(EXACT.values()):
        yield from left_out(kind, system, system.calm(np.ones((SAMPLES, 1)), 4), ["box"])


@rule(
    "box, set and support hold every state that is possible, to the last bit",
    advice="round outward (numpy.nextafter) wherever a bound is computed, and never take anything off a set",
)
def every_possible_state(kind: Kind) -> Iterator[str]:
    for system in kind.taken(EXACT.values()):
        for seed, unit in enumerate(UNITS):
            one = system.scaled(unit)
            yield from left_out(kind, one, one.edge(inputs(unit, seed), seed), EVERYTHING, Fraction(0))


@rule(
    "a plant that keeps to its model is never falsified, and its state stays inside",
    advice="find which part of the model is left out of the set: each Delta, F, the schedule, or the set's growth",
)
def healthy_plant(kind: Kind) -> Iterator[str]:
    systems = kind.taken(RICH)
    if not systems:
        raise NotApplicable("the observer refuses every model with more than constant matrices")
    for system in systems:
        log = system.edge(inputs(2.0, 7, 20), 7)
        assert log.x is not None
        for k, step in enumerate(drive(kind.observer(system), log)):
            if step.verdict == "falsified":
                yield f"{system.name}: falsified at sample {k}"
                return
            lower, upper = step.box
            room = 1e-9 * (1.0 + np.abs(log.x[k]))
            if not ((lower - room <= log.x[k]).all() and (log.x[k] <= upper + room).all()):
                yield f"{system.name}, sample {k}: the state {log.x[k]} is outside the box {lower} to {upper}"
