"""A nonlinear model as a linear one: along a run, or in the tube of all its states under one sequence of inputs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from polytopes import HPolytope
from svo.checks import Array, bounded_box
from svo.faults.equations import rewritten, with_inputs
from svo.models import ScheduleTable, UncertainModel
from svo.models.nonlinear import Linearisation, NonlinearModel, Undecided
from svo.observers.first_states import first_box


def along_samples(model: NonlinearModel, samples: Sequence[Linearisation]) -> UncertainModel:
    """The linear models of samples as one, whose schedule is the number of the sample."""
    points = np.arange(max(2.0, len(samples)))

    def table(name: str) -> Any:
        values = [getattr(sample, name) for sample in samples]
        return ScheduleTable(points, np.array(values * 2 if len(values) == 1 else values))

    unknown = [*model.disturbances, *model.free, *(f"remainder of {name}" for name in model.names["states"])]
    found: UncertainModel = model.carrier.replace(
        A=table("A"), C=table("C"), a=table("a"), E=table("E"), c=table("c"), n=table("n"),
        F=None if model.carrier.F is None else table("F"), schedule=0.0,
        names={**model.names, "disturbances": unknown},
    )  # fmt: skip
    return found


@dataclass(frozen=True)
class Tube:
    """All that a nonlinear model can do from a set of first states under some inputs, as a linear model.

    Attributes
    ----------
    model : UncertainModel
        Each trajectory of the plant is one of its own; its schedule is the number of the sample.
    samples : int
        As far as the plant is enclosed.
    ends : str or None
        Why it is not enclosed further.
    """

    model: UncertainModel
    samples: int
    ends: str | None

    @classmethod
    def of(cls, name: str, model: NonlinearModel, initial: HPolytope, u: Array) -> Tube:
        """Of a set of states at the first sample, and inputs (K, nu).

        Raises
        ------
        ValueError
            Naming the set, if the equations do not hold or have no value over it; or if the stamps of readings may be
            off by a sampling time or more, so that they have the inputs of several.
        """
        if model.jitter is not None and not model.jitter.max() < model.Ts:
            raise ValueError(f"jitter is {model.jitter}; expected stamps that are off by less than Ts = {model.Ts:g} s")
        initial = model.whole(initial)
        bounded_box(name, initial, model.n_states)
        lower, upper = first_box(initial, model)
        model.check_first(lower, upper)
        samples: list[Linearisation] = []
        nu = model.n_inputs
        for k, held in enumerate(u):
            try:
                beside = u[max(0, k - 1) : k + 1]
                around = beside.min(axis=0), beside.max(axis=0)
                now = Linearisation.before(model.output_near(lower, upper, held, around), model.noise, nu)
            except Undecided as error:
                return cls._of(model, samples, f"at sample {k}, {error}")
            samples.append(now)
            if k + 1 == len(u):
                break
            try:
                found = model.transition(lower, upper, held)
            except Undecided as error:
                return cls._of(model, samples, f"after sample {k}, {error}")
            E = np.hstack([found.E, np.diag(found.R)])
            samples[-1] = Linearisation.of(found.A, found.a, E, now.C, now.c, now.F, now.n, nu)
            lower, upper = found.box
        return cls._of(model, samples, None)

    @classmethod
    def _of(cls, model: NonlinearModel, samples: Sequence[Linearisation], ends: str | None) -> Tube:
        if not samples:
            raise ValueError(f"initial: the output is not enclosed {ends}; expected a smaller set, or one elsewhere")
        return cls(along_samples(model, samples), len(samples), ends)


def with_free_inputs(name: str, model: NonlinearModel, initial: HPolytope, u: Array, reach: Array) -> Tube:
    """A tube whose linear model has the inputs as such, near a sequence (K, nu) of them: for candidates, not proofs.

    Their slopes are secants over ``reach`` (nu,) at either side.
    """
    known = len(model.disturbances)

    def shifted(held: list[Any], v: Any, d: Any) -> None:
        for i in range(len(held)):
            held[i] = held[i] + v[i]

    law = with_inputs(shifted)
    deviations = {f"deviation of {own}": (-float(r), float(r)) for own, r in zip(model.inputs, reach, strict=True)}
    tube = Tube.of(name, rewritten(model, dynamics=law, outputs=law, disturbances=deviations), initial, u)
    linear, moved = tube.model, slice(known, known + model.n_inputs)
    points, stacks = np.arange(max(2.0, tube.samples)), linear.stack_over(np.arange(max(2.0, tube.samples)))[:, 0]
    inputs = np.concatenate([u[: tube.samples]] * 2)[: len(points)]
    n, columns = linear.n_states, linear.n_states + linear.n_inputs + 1
    gains = stacks[:, :, columns:][:, :, moved]
    others = np.delete(stacks[:, :, columns:], moved, axis=2)
    rest = stacks[:, :, columns - 1] - (gains @ inputs[:, :, None])[:, :, 0]
    lower, upper, _ = linear.bounds(0.0)

    def table(values: Array) -> ScheduleTable:
        return ScheduleTable(points, values)

    w = tuple(np.delete(end, moved) for end in (lower, upper))
    free = linear.replace(
        B=table(gains[:, :n]), D=table(gains[:, n:]), a=table(rest[:, :n]), c=table(rest[:, n:]),
        E=table(others[:, :n]), F=table(others[:, n:]), w=w, names=None,
    )  # fmt: skip
    return Tube(free, tube.samples, tube.ends)
