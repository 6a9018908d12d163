"""Sensor faults (Marzat et al. 2012, equation (17) and Table 2; Rosa and Silvestre 2013, Table 2)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from polytopes.shown import Shown
from svo.checks import Array, expect_one_of, is_finite_number
from svo.faults.blocks import channels, mapped, only_columns, only_rows, product_of, with_noise
from svo.faults.equations import Model, rewritten, scaled_readings
from svo.faults.profiles import Profile, at_times, check_profile
from svo.models import Schedulable, UncertainModel, Uncertainty
from svo.models.nonlinear import NonlinearModel

SensorKind = Literal["bias", "drift", "scaling", "hard"]


@dataclass(frozen=True)
class SensorLaw(Shown):
    """The reading of a faulty sensor at given times: ``gain`` times the healthy reading plus ``offset``."""

    gain: Array
    offset: Array


@dataclass(frozen=True)
class SensorFault(Shown):
    """A fault of one sensor, or of several that fail together.

    With y0 the healthy reading (noise included) and p = profile.value(t) the faulty one is

    =========  =============================  =======================================================
    kind       reading                        what ``model`` contains
    =========  =============================  =======================================================
    bias       y0 + magnitude p               any additive error up to the size of ``magnitude``, either sign,
                                              free to change at each sample (wider noise)
    drift      y0 + magnitude p               the same; ``magnitude`` is the error finally reached
    scaling    (1 + magnitude p) y0           (1 + Delta) y0, any Delta between 0 and ``magnitude``
    hard       (1 - p) y0 + magnitude p       (1 - Delta) y0 + Delta magnitude, any Delta in [0, 1]
    =========  =============================  =======================================================

    A dead sensor is a hard fault of magnitude zero. Every model contains the healthy sensor. Scaling and hard
    faults add one Uncertainty (after the nominal ones) whose Delta at a time is ``delta(t)``; if the nominal output
    is itself uncertain, each product Delta_i Delta becomes one more free Delta, which contains it.

    Parameters
    ----------
    where : int or tuple of int
        Output channels; several share one Delta.
    kind : {"bias", "drift", "scaling", "hard"}
    magnitude : float
        Size of the full fault, in the unit of the output (for scaling: the relative gain error).
    profile : Profile
        Shape in time.

    Raises
    ------
    ValueError
        For a bad ``where``, an unknown kind, a magnitude that is not finite, or zero where that is no fault.
    TypeError
        If the profile is none.
    """

    where: int | tuple[int, ...]
    kind: SensorKind
    magnitude: float
    profile: Profile

    def __post_init__(self) -> None:
        channels(self.where)
        expect_one_of("kind", self.kind, get_args(SensorKind))
        check_profile(self.profile)
        if not is_finite_number(self.magnitude) or (self.magnitude == 0 and self.kind != "hard"):
            raise ValueError(f"magnitude of the {self.kind} is {self.magnitude}; expected a finite number, not zero")

    def delta(self, t: ArrayLike) -> Array:
        """Delta that the fault has at time t [s] in its own model; for bias and drift the additive error."""
        p = self.profile.value(t)
        return p if self.kind == "hard" else self.magnitude * p

    def law(self, t: ArrayLike) -> SensorLaw:
        """Gain and offset at times t [s], each of the shape of t; for simulators that precompute them."""
        delta = self.delta(t)
        if self.kind == "scaling":
            return SensorLaw(gain=1.0 + delta, offset=np.zeros_like(delta))
        if self.kind == "hard":
            return SensorLaw(gain=1.0 - delta, offset=self.magnitude * delta)
        return SensorLaw(gain=np.ones_like(delta), offset=delta)

    def corrupt(self, t: ArrayLike, y: ArrayLike) -> Array:
        """Faulty readings from healthy ones.

        Parameters
        ----------
        t : float or (K,) array
            Time [s].
        y : (ny,) or (K, ny) array
            Healthy readings; NaN (a missing sensor) stays NaN.

        Returns
        -------
        array of the shape of y
        """
        readings = at_times("y", t, y)
        where = channels(self.where, readings.shape[-1], "channels in y")
        law = self.law(t)
        for channel in where:
            readings[..., channel] = law.gain * readings[..., channel] + law.offset
        return readings

    def model(self, nominal: Model) -> Model:
        """The observer's model of this fault; it contains ``nominal`` and every intermediate size.

        Delta is a parameter of a nonlinear model, free at each sample.
        """
        if isinstance(nominal, NonlinearModel):
            return self._equations(nominal)
        return nominal.in_given_time(self._model)

    def _equations(self, nominal: NonlinearModel) -> NonlinearModel:
        where = channels(self.where, nominal.n_outputs, "outputs in the model")
        gain = max(1.0, abs(1.0 + self.magnitude)) if self.kind == "scaling" else 1.0
        noise = nominal.noise.copy()
        if self.kind in ("bias", "drift"):
            noise[list(where)] += abs(self.magnitude)
            return nominal.replace(n=noise)
        noise[list(where)] *= gain
        name = f"{self.kind} of {', '.join(nominal.names['outputs'][i] for i in where)}"
        law = scaled_readings(where, self.magnitude if self.kind == "hard" else None)
        return rewritten(nominal, outputs=law, parameters={name: self._bounds}, noise=noise)

    def _model(self, nominal: UncertainModel) -> UncertainModel:
        channels(self.where, nominal.n_outputs, "outputs in the model")
        if self.kind in ("bias", "drift"):
            return nominal.replace(n=self._wider_noise(nominal, gain=1.0, offset=abs(self.magnitude)))
        uncertainties = [*nominal.uncertainties, self._scaling(nominal), *self._products(nominal)]
        gain = max(1.0, abs(1.0 + self.magnitude)) if self.kind == "scaling" else 1.0
        return nominal.replace(uncertainties=uncertainties, n=self._wider_noise(nominal, gain=gain, offset=0.0))

    @property
    def _bounds(self) -> tuple[float, float]:
        return (0.0, 1.0) if self.kind == "hard" else (min(0.0, self.magnitude), max(0.0, self.magnitude))

    @property
    def _factor(self) -> float:
        return -1.0 if self.kind == "hard" else 1.0

    def _rows(self, owner: UncertainModel | Uncertainty) -> dict[str, Schedulable]:
        """What the faulty sensors read, scaled, and nothing of the others."""
        where = channels(self.where)
        matrices = {name: only_rows(getattr(owner, name), where, self._factor) for name in "CDF"}
        return matrices | {"c": only_columns(owner.c, where, self._factor)}

    def _scaling(self, nominal: UncertainModel) -> Uncertainty:
        rows = self._rows(nominal)
        if self.kind == "hard":
            target = np.zeros(nominal.n_outputs)
            target[list(channels(self.where))] = self.magnitude
            rows["c"] = target if rows["c"] is None else mapped(np.add, rows["c"], target)
        return Uncertainty(**rows, bounds=self._bounds, name=f"{self.kind} of sensor {self.where}")

    def _products(self, nominal: UncertainModel) -> list[Uncertainty]:
        products = []
        for uncertainty in nominal.uncertainties:
            products.append(product_of(uncertainty, self._bounds, self.kind, **self._rows(uncertainty)))
        return [p for p in products if p is not None]

    def _wider_noise(self, nominal: UncertainModel, gain: float, offset: float) -> Schedulable:
        scale, extra = np.ones(nominal.n_outputs), np.zeros(nominal.n_outputs)
        scale[list(channels(self.where))], extra[list(channels(self.where))] = gain, offset
        return with_noise(nominal, lambda n: n * scale + extra)
