"""Runs of window observers of nonlinear plants: everything that is promised, checked at every sample.

The truth comes from `nonlinear_truth`, which uses nothing of a tape. Checked are the sets, the verdicts, and every
transition and output that an observer has linearised on its way, against what the plant did there.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, fields
from typing import Any, NamedTuple

import numpy as np

from polytopes import HPolytope
from svo import WindowObserver
from svo.checks import Array
from svo.models.nonlinear import Linearisation
from svo.observers.base import Step
from tests.svo.models.nonlinear_plants import Case
from tests.svo.models.nonlinear_truth import Runs, called, rounding

HORIZON = 10
SETTLED = 30  # samples after which widths count
PART = 1e-3  # of R: the integrator's error that is allowed for
ROUNDING = 1e-12  # of the sizes of the terms


@dataclass
class Findings:
    """What happened in runs.

    Attributes
    ----------
    count : Counter
        Samples, verdicts, and whatever must not happen, with run and sample.
    widths : list of (n,) arrays
        Of the sets of settled samples in normal operation.
    closest : float
        Largest share of R that a transition used.
    unresolved : float
        Largest error of the integrator, in R, beyond rounding.
    """

    count: Counter[str]
    widths: list[Array]
    closest: float = 0.0
    unresolved: float = 0.0

    def failed(self, what: str, where: str) -> None:
        """Count what must not happen."""
        self.count[what] += 1
        self.count[f"{what}: {where}"] += 1


def examine_run(case: Case, runs: Runs, j: int, rng: np.random.Generator, dt: bool, found: Findings) -> None:
    """Drive an observer over run j and note what is not as promised."""
    model = case.model
    one = Runs(**{field.name: getattr(runs, field.name)[..., j] for field in fields(Runs)})
    lower, upper = case.x0 - case.spread * rng.uniform(1.0, 2.0), case.x0 + case.spread * rng.uniform(1.0, 2.0)
    for limits in (model.physical_range, model.start_range, model.valid_range):
        if limits is not None:
            lower, upper, _ = limits.cut(lower, upper)
    observer = WindowObserver(model, HPolytope.box(lower, upper), horizon=HORIZON)
    h, ran_away = called(model.h, model), False
    for k, (x, y) in enumerate(zip(one.x, one.y, strict=True)):
        if k == 0:
            step = observer.update(y0=y, u=one.u[0])
        else:
            more = {"dt": float(one.dt[k - 1])} if dt else {}
            step = observer.step(u=one.u[k - 1], y=y, u_next=one.u[k], **more)
            if observer.largest_at != k:  # else there was no transition to it
                _check_move(observer, one, k - 1, rounding(case), found, f"run {j}, sample {k}")
        _check_output(observer, h, one, k, found, f"run {j}, sample {k}")
        ran_away = ran_away or not _is_normal(case, x)
        found.count["samples"] += 1
        found.count["runaway"] += ran_away
        found.count[step.verdict] += 1
        if step.verdict == "falsified":
            found.failed("falsified", f"run {j}, sample {k}")
            return
        if step.verdict == "undecided":
            kind = "undecided in a runaway" if ran_away else "undecided in normal operation"
            found.failed(kind, f"run {j}, {step.reason}")
        if not contains(step, x, rounding(case)):
            found.failed("excluded", f"run {j}, sample {k}")
        if k >= SETTLED and not ran_away:
            found.widths.append(step.box[1] - step.box[0])


def contains(step: Step, x: Array, rounding: Array) -> bool:
    """Whether a state is in the box, up to rounding."""
    lower, upper = step.box
    room = 1e-9 * (upper - lower) + 1e-13 * np.abs(x) + rounding
    return bool((x >= lower - room).all() and (x <= upper + room).all())


def _is_normal(case: Case, x: Array) -> bool:
    return case.normal is None or bool(((case.normal[0] <= x) & (x <= case.normal[1])).all())


class _Move(NamedTuple):
    """The parts of a transition, as an observer gets them: the remainders are the last columns of its E."""

    A: Array
    a: Array
    E: Array
    R: Array

    @classmethod
    def of(cls, found: Linearisation, n: int) -> _Move:
        """From the linearisation of a sample."""
        nw = found.E.shape[1] - n
        return cls(found.A, found.a, found.E[:, :nw], np.diagonal(found.E[:, nw:]))


def _check_move(observer: WindowObserver, one: Runs, k: int, lost: Array, found: Findings, where: str) -> None:
    """The true transition from sample k against that which the observer made of it, and what it carries along."""
    assert observer._sampler.plant is not None
    model, box = observer._sampler.plant.model, observer._sampler.plant.box
    before, _ = observer.linearised
    if k + 1 >= len(one.x) or before is None:
        return
    held = ~model.flow.varying | (not model.continuous)  # in discrete time nothing happens inside a sample
    x, after = one.x[k], one.x[k + 1]
    move = _Move.of(before, len(x))
    size = np.abs(move.A) @ np.abs(x) + np.abs(move.a) + np.abs(move.E) @ (np.abs(one.w[k]) * held)
    rest = np.abs(after - move.A @ x - move.a - move.E @ (one.w[k] * held))
    room = ROUNDING * (size + np.abs(after)) + lost
    used = (np.maximum(rest - room, 0.0) / move.R).max()
    found.closest = max(found.closest, float(used))
    found.unresolved = max(found.unresolved, float((np.maximum(one.error[k] - room, 0.0) / move.R).max()))
    found.count["transitions"] += 1
    if (rest > move.R * (1.0 + PART) + room).any():
        found.failed("transition outside R", f"{where}, {used:.6g} of R")
    away = room + one.error[: k + 1].sum(axis=0)  # a truth at corners runs along faces: errors add up
    if not ((after >= box.lower - away) & (after <= box.upper + away)).all():
        found.failed("state outside the box carried along", where)


def _check_output(observer: WindowObserver, h: Any, one: Runs, k: int, found: Findings, where: str) -> None:
    """The same of the output; one that is not enclosed says nothing."""
    _, now = observer.linearised
    if now is None or not (now.C.any() or now.c.any()):
        return
    value = h(one.x[k][:, None], one.w[k][:, None], one.u[k][:, None])[:, 0]
    rest = np.abs(value - now.C @ one.x[k] - now.c - now.F[:, : len(one.w[k])] @ one.w[k])
    size = np.abs(now.C) @ np.abs(one.x[k]) + np.abs(now.c) + np.abs(now.F[:, : len(one.w[k])]) @ np.abs(one.w[k])
    found.count["outputs"] += 1
    if (rest > now.n - observer.model.noise + 1e-13 * (size + np.abs(value) + now.n)).any():
        found.failed("output outside R", where)


MUST_NOT = (
    "excluded", "falsified", "transition outside R", "state outside the box carried along", "output outside R",
)  # fmt: skip
