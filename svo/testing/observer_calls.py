"""Rules about calls: what an observer answers, when it may say "falsified", what it keeps and what it forgets."""

from __future__ import annotations

import io
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from polytopes import HPolytope
from svo.checks import Array
from svo.logs.drive import drive
from svo.logs.log import Log
from svo.testing.observer_kind import Kind, answer, answers_of, missing
from svo.testing.observer_sets import inputs
from svo.testing.rules import rule
from svo.testing.systems import PLAIN, TWO_EXACT_SENSORS, UNSEEN, UNSTABLE

VERDICTS = ("consistent", "falsified", "undecided")
FAR = 1000.0  # from every state that is possible
FALSE_FROM = 4


def healthy(seed: int) -> Log:
    return PLAIN.calm(np.ones((8, 1)), seed)


def impossible() -> Log:
    """A run whose readings are far from every possible state from sample 4 on."""
    log = healthy(11)
    return replace(log, y=log.y + FAR * (np.arange(len(log)) >= FALSE_FROM)[:, None])


def falsified(observer: Any) -> list[Any]:
    """The answers over a run with impossible readings."""
    return list(drive(observer, impossible()))


@rule(
    "an answer has a verdict, a certificate, seconds, a box, a set and supports of the right shapes",
    advice="return a subclass of svo.observers.base.Step; `certificate` is None unless the verdict is 'falsified'",
)
def answers(kind: Kind) -> Iterator[str]:
    for system in kind.taken([PLAIN, UNSEEN]):
        n, log = system.model.n_states, system.calm(inputs(1.0, 10), 10)
        for k, step in enumerate(drive(kind.observer(system), log)):
            yield from (f"{system.name}, sample {k}: {breach}" for breach in _misshapen(step, n))


def _misshapen(step: Any, n: int) -> Iterator[str]:
    if step.verdict not in VERDICTS:
        yield f"verdict is {step.verdict!r}; expected one of {', '.join(VERDICTS)}"
    if step.verdict == "consistent" and step.certificate is not None:
        yield "consistent, with a certificate"
    if not step.seconds >= 0:
        yield f"seconds is {step.seconds!r}"
    shapes = [np.shape(end) for end in step.box]
    if shapes != [(n,), (n,)]:
        yield f"box has shapes {shapes}; expected two of ({n},)"
    if not isinstance(step.set, HPolytope) or step.set.dim != n:
        yield f"set is {step.set!r}; expected an HPolytope in dimension {n}"
    if np.shape(step.support(np.eye(n))) != (n,):
        yield f"support of {n} directions has shape {np.shape(step.support(np.eye(n)))}; expected ({n},)"


@rule(
    "a run leaves nothing behind: not in another observer, and not in the same one after reset",
    advice="keep all that an observer learns in the instance, and make it anew in reset; no class attribute, no cache",
)
def runs_apart(kind: Kind) -> Iterator[str]:
    first, second = healthy(11), healthy(12)
    alone, used = kind.answers(first), kind.observer()
    answers_of(used, second)
    if kind.answers(first) != alone:
        yield "a fresh observer answers otherwise after another one has had its run"
    used.reset(PLAIN.initial)
    if answers_of(used, first) != alone:
        yield "an observer that was reset answers otherwise than a fresh one"
    pair = zip(drive(kind.observer(), first), drive(kind.observer(), second), strict=True)
    if [answer(step) for step, _ in pair] != alone:
        yield "an observer answers otherwise while another one has its run beside it"


@rule(
    "arrays of the caller are copied, and arrays that are returned are the caller's",
    advice="copy u and y if they are kept, and return copies of the bounds that the observer goes on with",
)
def arrays_of_the_caller(kind: Kind) -> Iterator[str]:
    log, observer = PLAIN.calm(inputs(1.0, 11), 11), kind.observer()
    u, y, following = (np.zeros(1) for _ in range(3))
    found = []
    for k in range(len(log)):
        u[:], y[:], following[:] = log.u[max(k - 1, 0)], log.y[k], log.u[k]
        step = observer.update(y, u=following) if k == 0 else observer.step(u, y, u_next=following)
        found.append(answer(step))
        for end in step.box:
            end[:] = 0.0
    if found != kind.answers(log):
        yield "answers change when the arrays of one sample are used again for the next, or a box is written into"


@rule("run(log) is the answers to its samples", advice="let run call update, then step(u=u[k-1], y=y[k], u_next=u[k])")
def a_log_is_its_samples(kind: Kind) -> Iterator[str]:
    for log in (healthy(11), impossible()):
        record = kind.observer().run(log)
        steps = [(answer(step), step.certificate) for step in drive(kind.observer(), log)]
        found = [(v, low.tobytes(), up.tobytes()) for v, low, up in zip(record.verdicts, *_ends(record), strict=True)]
        if found != [said for said, _ in steps]:
            yield "verdicts or boxes of run(log) differ from those of the samples one by one"
        if (record.certificate is None) != (steps[-1][1] is None):
            yield f"run(log) has the certificate {record.certificate}; its last sample {steps[-1][1]}"


def _ends(record: Any) -> tuple[Array, Array]:
    return np.ascontiguousarray(record.lower), np.ascontiguousarray(record.upper)


@rule(
    "impossible readings falsify the model, and 'falsified' has a certificate that verifies",
    advice="prove emptiness in exact arithmetic, keep the proof as step.certificate; without a proof say 'undecided'",
)
def alarm_with_proof(kind: Kind) -> Iterator[str]:
    steps = falsified(kind.observer())
    for k, step in enumerate(steps):
        if step.verdict == "falsified" and step.certificate is None:
            yield f"falsified at sample {k} without a certificate"
        elif step.verdict == "falsified" and step.certificate.verify() is not True:
            yield f"falsified at sample {k} with a certificate that does not verify"
        elif step.verdict == "falsified" and k < FALSE_FROM:
            yield f"falsified at sample {k}, though the data are those of the model until {FALSE_FROM}"
    if steps[-1].verdict != "falsified":
        yield f"readings {FAR:g} away from every possible state are {steps[-1].verdict!r}"


@rule(
    "'falsified' is final until reset: box NaN, set empty, supports -inf",
    advice="answer every later sample as the first falsified one, whatever its readings",
)
def falsified_is_final(kind: Kind) -> Iterator[str]:
    log, observer = impossible(), kind.observer()
    falsified(observer)
    step = observer.step(log.u[-1], log.y[-1] - FAR, u_next=log.u[-1])
    if step.verdict != "falsified":
        yield f"a plausible reading after the falsification is {step.verdict!r}"
    if not np.isnan(np.array(step.box)).all():
        yield f"its box is {step.box}; expected NaN"
    if step.set.emptiness().status != "empty" or (np.asarray(step.support(np.eye(1))) != -np.inf).any():
        yield "its set is not empty, or a support not -inf"


@rule("reset takes a falsification back", advice="let reset forget verdict and certificate with the data")
def reset_after_falsification(kind: Kind) -> Iterator[str]:
    observer, log = kind.observer(), healthy(11)
    falsified(observer)
    observer.reset(PLAIN.initial)
    for k, step in enumerate(drive(observer, log)):
        if step.verdict == "falsified" or step.certificate is not None:
            yield f"still falsified at sample {k} after reset, though the data are those of the model"


@rule(
    "data that are hard to decide are answered, not raised",
    advice="catch what a solver or an overflow raises and answer 'undecided', with a set that still holds the state",
)
def undecided_is_an_answer(kind: Kind) -> Iterator[str]:
    for system, log in _hard():
        if not kind.taken([system]):
            continue
        for k, step in enumerate(drive(kind.observer(system), log)):
            lower, upper = step.box
            if step.verdict not in VERDICTS:
                yield f"{system.name}, sample {k}: verdict {step.verdict!r}"
            if log.x is not None and not (step.verdict != "falsified" and lower[0] <= log.x[k, 0] <= upper[0]):
                yield f"{system.name}, sample {k}: {step.verdict}, box {lower} to {upper}, and the state is {log.x[k]}"


def _hard() -> Iterator[tuple[Any, Log]]:
    """A set that outgrows every float, readings near the largest float, sensors that differ in the last bit."""
    samples = 120
    rest = np.zeros((samples, 1))
    yield UNSTABLE, missing(Log(np.arange(float(samples)), rest, rest, x=rest), {k: [0] for k in range(1, samples - 4)})
    log = healthy(11)
    for huge in (1e150, -1e300, 1.7e308):
        yield PLAIN, Log(log.time, log.u, np.where(np.arange(8)[:, None] == 5, huge, log.y))
    y = np.repeat(log.y, 2, axis=1) / 8.0
    for k in (2, 5):
        y[k, 1] = np.nextafter(y[k, 1], np.inf)
    yield TWO_EXACT_SENSORS, Log(log.time, log.u, y)


@rule(
    "a deadline makes sets wider, never wrong",
    advice="at the deadline return bounds that hold already (those before the reading), and 'undecided' if need be",
)
def deadline(kind: Kind) -> Iterator[str]:
    kind.that_can("takes_deadline")
    log = healthy(11)
    assert log.x is not None
    for k, step in enumerate(drive(kind.observer(), log, deadline=0.0)):
        lower, upper = step.box
        if step.verdict == "falsified" or not (lower <= log.x[k]).all() or not (log.x[k] <= upper).all():
            yield f"sample {k}, with no time: {step.verdict}, box {lower} to {upper}, and the state is {log.x[k]}"


@rule(
    "a saved state goes on as if nothing had happened",
    advice="let state_dict hold all that the next steps depend on, the number of the sample too, as arrays",
)
def saved_state(kind: Kind) -> Iterator[str]:
    kind.that_can("saves_state")
    for log in (healthy(11), impossible()):
        for cut in (1, 3, 6):
            observer = kind.observer()
            for _, _step in zip(range(cut), drive(observer, log), strict=False):
                pass
            again = type(observer).from_state_dict(PLAIN.model, through_a_file(observer.state_dict()))
            yield from (f"saved after {cut} samples, {breach}" for breach in _parted(observer, again, log, cut))


def through_a_file(state: Any) -> dict[str, Array]:
    """A state as ``numpy.savez`` and ``numpy.load`` give it back."""
    file = io.BytesIO()
    np.savez(file, allow_pickle=False, **state)
    file.seek(0)
    with np.load(file, allow_pickle=False) as stored:
        return dict(stored)


def _parted(observer: Any, again: Any, log: Log, cut: int) -> Iterator[str]:
    """Where two observers that have seen ``cut`` samples answer otherwise."""
    try:
        again.update(log.y[0], u=log.u[0])
        yield "it takes update() again, as if there had been no sample"
    except ValueError:
        pass
    pairs = zip(*(drive(o, log, start=cut) for o in (observer, again)), strict=True)
    for k, (one, other) in enumerate(pairs, start=cut):
        if answer(one) != answer(other):
            yield f"it answers {other.verdict} {other.box} at sample {k}; the observer itself {one.verdict} {one.box}"
        if one.sample != other.sample:
            yield f"it calls sample {one.sample} number {other.sample}"
        if (one.certificate is None) != (other.certificate is None):
            yield f"its certificate at sample {k} is {other.certificate}; that of the observer itself {one.certificate}"


@rule(
    "wrong data are refused with a ValueError, and nothing is lost by them",
    advice="check shapes and numbers before anything changes (svo.observers.base.Observer does)",
)
def wrong_data(kind: Kind) -> Iterator[str]:
    log, observer = healthy(11), kind.observer()
    observer.update(log.y[0], u=log.u[0])
    wrong: dict[str, Any] = {
        "y of two sensors where there is one": lambda: observer.step(log.u[0], np.zeros(2), u_next=log.u[1]),
        "an infinite y": lambda: observer.step(log.u[0], np.array([np.inf]), u_next=log.u[1]),
        "no u": lambda: observer.step(None, log.y[1], u_next=log.u[1]),
        "u that is NaN": lambda: observer.step(np.array([np.nan]), log.y[1], u_next=log.u[1]),
        "a second update": lambda: observer.update(log.y[1], u=log.u[1]),
    }
    for what, call in wrong.items():
        try:
            call()
            yield f"{what} is taken"
        except ValueError:
            continue
    if answer(observer.step(log.u[0], log.y[1], u_next=log.u[1])) != kind.answers(log)[1]:
        yield "a sample that was refused has changed the next answer"
