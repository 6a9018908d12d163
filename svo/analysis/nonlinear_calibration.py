"""Bounds of a nonlinear model that give way, and the linear models of a run up to the sample that falsifies it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from polytopes import HPolytope
from svo.analysis.tube import along_samples
from svo.logs.drive import drive
from svo.logs.log import Log
from svo.models import UncertainModel
from svo.models.nonlinear import Linearisation, NonlinearModel
from svo.observers.window.observer import WindowObserver

_KINDS = {"noise": "noise", "disturbances": "disturbance", "parameters": "parameter"}
_PROGRESS = 1.001  # times what a run needs, so that the next one gets further


@dataclass(frozen=True)
class WidenedPlant:
    """A nonlinear model with some of its bounds widened.

    Attributes
    ----------
    given : NonlinearModel
    chosen : tuple of str
        Names of the bounds that give way, such as "noise level" or "parameter pipe".
    amounts : mapping from names to float
        By what they do, at either end.
    """

    given: NonlinearModel
    chosen: tuple[str, ...]
    amounts: Mapping[str, float] = field(default_factory=dict)

    @classmethod
    def of(cls, model: NonlinearModel, wanted: Sequence[str]) -> WidenedPlant:
        """With none widened yet; ``wanted`` are kinds and names.

        Raises
        ------
        ValueError
            For an unknown name.
        """
        every = half_widths(model)
        for name in wanted:
            if name not in _KINDS and name not in every:
                raise ValueError(f"bounds contains {name!r}; expected any of {', '.join([*_KINDS, *every])}")
        kinds = {_KINDS.get(name) for name in wanted}
        chosen = tuple(name for name in every if name in wanted or name.partition(" ")[0] in kinds)
        if not chosen:
            known = ", ".join(every)
            raise ValueError(f"bounds is {list(wanted)}, of which the model has none; expected any of {known}")
        return cls(model, chosen)

    @cached_property
    def model(self) -> NonlinearModel:
        """The model with the bounds as wide as they are."""
        given, by = self.given, self.amounts
        noise = given.noise + [by.get(f"noise {name}", 0.0) for name in given.names["outputs"]]
        w = np.array([by.get(f"disturbance {name}", 0.0) for name in given.disturbances])
        low, high = (end[: len(w)] for end in given.flow.w)
        wider = {
            name: tuple(np.asarray(ends) + by[f"parameter {name}"] * np.array([-1.0, 1.0]))
            for name, ends in given.parameters.items()
            if f"parameter {name}" in by
        }
        return given.replace(n=noise, w=(low - w, high + w), parameters={**given.parameters, **wider})

    @property
    def linear_names(self) -> list[str]:
        """The chosen bounds as those of a linear model, of which parameters are disturbances."""
        return [name.replace("parameter ", "disturbance ", 1) for name in self.chosen]

    def told(self, why: str) -> str:
        """A message about linear models in the names of the plant's bounds."""
        for own, name in zip(self.linear_names, self.chosen, strict=True):
            why = why.replace(own, name)
        return why

    def wider(self, needed: Mapping[str, float]) -> WidenedPlant:
        """With what the linear models of a run need besides, by their names."""
        by_linear_name = dict(zip(self.linear_names, self.chosen, strict=True))
        more = {by_linear_name[name]: amount * _PROGRESS for name, amount in needed.items()}
        every = dict.fromkeys([*self.amounts, *more], 0.0)
        return WidenedPlant(
            self.given, self.chosen, {n: self.amounts.get(n, 0.0) + more.get(n, 0.0) for n in every}
        )

    def falsified_part(self, log: Log, initial: HPolytope) -> tuple[UncertainModel, Log] | None:
        """The linear models of a run up to the sample that falsifies it, as one, with the log up to there.

        None if nothing is falsified. What varies inside a sample has no column in a linear model, so that its bound
        could not give way: those of a run in which it is held are taken, whose plants are some of the model's.

        Raises
        ------
        ValueError
            At a sample at which the plant is not linearised.
        """
        part = _falsified_part(self.model, log, initial)
        if part is None or not self.model.flow.varying.any():
            return part
        return _falsified_part(self.model.replace(varying=()), log, initial) or part


def _falsified_part(model: NonlinearModel, log: Log, initial: HPolytope) -> tuple[UncertainModel, Log] | None:
    observer, samples = WindowObserver(model, initial), list[Linearisation]()
    for k, step in enumerate(drive(observer, log)):
        if step.verdict == "undecided":
            raise ValueError(f"sample {k} of the log is undecided ({step.reason}); leave such samples out")
        before, now = observer.linearised
        assert now is not None
        samples = [*samples[:-1], *([] if before is None else [before]), now]
        if step.verdict == "falsified":
            part = Log(log.time[: k + 1], log.u[: k + 1], log.y[: k + 1], schedule=np.arange(k + 1.0))
            return along_samples(model, samples), part
    return None


def half_widths(model: NonlinearModel) -> dict[str, float]:
    """Of all bounds that may be widened, by their names; numbers that are constants have none."""
    nw = model.n_disturbances
    half = 0.5 * (model.flow.w.upper - model.flow.w.lower)
    found = {f"noise {name}": float(n) for name, n in zip(model.names["outputs"], model.noise, strict=True)}
    found |= {f"disturbance {name}": float(h) for name, h in zip(model.disturbances, half[:nw], strict=True)}
    free = zip(model.free, half[nw:], strict=True)
    return found | {f"parameter {name}": float(h) for name, h in free if h > 0.0}
