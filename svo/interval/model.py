"""The same first-order plant as a 1-D `UncertainModel`, for set-valued observers.

With g = gc + gr Delta and Delta in [-1, 1], x+ = gc x + (1 - gc) hc u + Delta gr (x - hc u) + d: one channel, and
a disturbance ``|d| <= (|1 - gc| + gr) hr |u|`` for the static gain. Its reachable interval is that of the predictor,
so an observer of this model, which also uses the measurements, stays inside the prediction made with the same gc and
gr.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from polytopes.shown import Shown
from svo.checks import Array
from svo.interval.predictor import IntervalPrediction, IntervalPredictor
from svo.logs.log import Log
from svo.models import UncertainModel, Uncertainty


@dataclass(frozen=True)
class _Entry:
    """An array of one number that is a formula of gc, gr, hc and spread; ``over`` many rows (K, 4) of them too."""

    formula: Callable[..., Any]
    shape: tuple[int, ...] = (1,)

    def __call__(self, schedule: Array) -> Array:
        return np.reshape(self.formula(*schedule), self.shape)

    def over(self, schedule: Array) -> Array:
        return np.reshape(self.formula(*schedule.T), (len(schedule), *self.shape))


def first_order_model(n: float, Ts: float) -> UncertainModel:
    """The uncertain model of x+ = g x + (1 - g) h u, y = x + noise, scheduled by the bounds of g and h.

    Parameters
    ----------
    n : float
        Half-width of the measurement noise. A set-valued observer needs one; the interval detector does not.
    Ts : float
        Sampling time [s].

    Returns
    -------
    UncertainModel
        Its schedule is a row (gc, gr, hc, spread) of `first_order_schedule`.
    """
    return UncertainModel(
        A=_Entry(lambda gc, gr, hc, spread: gc, (1, 1)),
        B=_Entry(lambda gc, gr, hc, spread: (1 - gc) * hc, (1, 1)),
        C=[[1.0]],
        E=[[1.0]],
        w=(_Entry(lambda gc, gr, hc, spread: -spread), _Entry(lambda gc, gr, hc, spread: spread)),
        n=n,
        Ts=Ts,
        uncertainties=[
            Uncertainty(
                A=_Entry(lambda gc, gr, hc, spread: gr, (1, 1)),
                B=_Entry(lambda gc, gr, hc, spread: -gr * hc, (1, 1)),
                name="g",
            )
        ],
        schedule=np.array([0.5, 0.1, 1.0, 0.0]),
    )


def first_order_schedule(prediction: IntervalPrediction) -> Log:
    """The log of a prediction with the schedule (K, 4) of `first_order_model`: gc, gr, hc and spread at each sample."""
    p = prediction
    spread = (np.abs(1 - p.gc) + p.gr) * p.hr * np.abs(p.u)
    schedule: Any = np.column_stack([p.gc, p.gr, p.hc, spread])
    return Log(time=p.time, u=p.u[:, None], y=p.y[:, None], schedule=schedule)


class FirstOrderScheduler(Shown):
    """The schedule of `first_order_model` sample by sample, by a predictor that runs along (a `svo.plant.Scheduler`).

    Parameters
    ----------
    predictor : function of the first command
        Gives the predictor, once the first sample is there.
    """

    def __init__(self, predictor: Callable[[float], IntervalPredictor]) -> None:
        self._make = predictor
        self._predictor: IntervalPredictor | None = None
        self._first = self._held = 0.0

    def with_input(self, y: Array, u: Array) -> Array:
        """gc, gr, hc and spread (4,) of the transition that starts at this sample, from its y (1,) and u (1,)."""
        command, measured = float(u[0]), float(y[0])
        if self._predictor is None:
            self._first = command
            self._predictor = self._make(command)
            self._held = self._predictor.interval.center
        if not np.isnan(measured):
            self._held = measured
        _, bounds = self._predictor.transition(command, self._held)
        gc, gr, hc, hr = (float(getattr(bounds, name)) for name in ("gc", "gr", "hc", "hr"))
        return np.array([gc, gr, hc, (abs(1 - gc) + gr) * hr * abs(command)])

    def state_dict(self) -> dict[str, Array]:
        """Everything that the next samples depend on (`svo.plant.SavesSchedule`)."""
        if self._predictor is None:
            return {}
        predictor = self._predictor
        return {
            "first": np.array(self._first),
            "held": np.array(self._held),
            "interval": np.array(predictor.interval),
            "sample": np.array(float(predictor.sample)),
        }

    def load_state_dict(self, state: Mapping[str, Array]) -> None:
        """Go on from ``state``, what `state_dict` gave."""
        if not state:
            return
        self._first, self._held = float(state["first"]), float(state["held"])
        self._predictor = self._make(self._first)
        center, radius = state["interval"]
        self._predictor.resume(float(center), float(radius), int(state["sample"]))
