"""Faults of the dynamics: an uncertain direction of the model with a size (Rosa and Silvestre 2013, section 4.3.1)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from polytopes.shown import Shown
from svo.checks import Array, expect, expect_kind, finite_array, is_finite_number
from svo.faults.equations import Model, rewritten, with_terms
from svo.faults.profiles import Profile, check_profile
from svo.models import UncertainModel, Uncertainty
from svo.models.nonlinear import NonlinearModel


@dataclass(frozen=True)
class PlantFault(Shown):
    """A change of the plant along given directions.

    At time t the plant gains delta(t) (A_i x + B_i u + a_i + E_i w) in its state equation and
    delta(t) (C_i x + D_i u + c_i + F_i w) in its output, with delta(t) = magnitude profile.value(t).
    The observer's model lets that Delta be anything between 0 and ``magnitude``, free to change at each
    sample; so it contains the nominal plant and every intermediate size. It is the last Uncertainty.

    All this is in the time in which the model was given: for a model of `UncertainModel.from_continuous` the direction
    is one of dx/dt, and discretised with it. The fault then begins at a sample, unless its Delta is said to vary.

    Parameters
    ----------
    direction : Uncertainty
        Where the fault acts, and how strongly at size one. Its own ``bounds`` are replaced.
    magnitude : float
        Delta of the full fault, not zero.
    profile : Profile
        Shape in time.
    """

    direction: Uncertainty
    magnitude: float
    profile: Profile

    def __post_init__(self) -> None:
        expect_kind("direction", self.direction, Uncertainty, "an Uncertainty")
        check_profile(self.profile)
        is_usable = is_finite_number(self.magnitude) and self.magnitude != 0
        expect(is_usable, "magnitude", self.magnitude, "a finite number, not zero")

    def delta(self, t: ArrayLike) -> Array:
        """Delta of the fault at times t [s], of the shape of t."""
        return self.magnitude * self.profile.value(t)

    def model(self, nominal: Model) -> Model:
        """The observer's model of this fault; it contains ``nominal`` and every intermediate size.

        Delta is a parameter of a nonlinear model, free at each sample.
        """
        if isinstance(nominal, NonlinearModel):
            dynamics, outputs = with_terms(nominal, self.direction)
            return rewritten(nominal, dynamics=dynamics, outputs=outputs, parameters={self._name: self._bounds})
        return nominal.in_given_time(self._model)

    def _model(self, nominal: UncertainModel) -> UncertainModel:
        named = replace(self.direction, bounds=self._bounds, name=self._name)
        return nominal.replace(uncertainties=[*nominal.uncertainties, named])

    @property
    def _bounds(self) -> tuple[float, float]:
        return min(0.0, self.magnitude), max(0.0, self.magnitude)

    @property
    def _name(self) -> str:
        return self.direction.name or "plant fault"

    def perturbation(
        self, nominal: UncertainModel, t: float, x: ArrayLike, u: ArrayLike, w: ArrayLike, schedule: Any = None
    ) -> tuple[Array, Array]:
        """What the fault adds to x(k+1) (n,) and to y(k) (ny,) at time t [s] of sample k.

        For a model of `UncertainModel.from_continuous` to first order: the rest is within the remainder of `model`.

        Parameters
        ----------
        nominal : UncertainModel
            The plant that is faulty.
        x, u, w : (n,), (nu,), (nw,) arrays
            State, input and disturbance of sample k; zero-length where the model has none.
        schedule : optional
            Scheduling value of sample k.
        """
        direction = self.direction if nominal.origin is None else nominal.origin.direction(self.direction)
        total = np.zeros(nominal.layout.shape)
        for name in "ABaECDcF":
            value = getattr(direction, name)
            if value is not None:
                rows, columns = nominal.layout.block(name)
                block = finite_array(f"{name} of the direction", value(schedule) if callable(value) else value)
                block = block[:, None] if block.ndim == 1 else block
                total[rows, columns][:, : block.shape[1]] = block  # a remainder has columns after those of w
        state = finite_array("x", x, (nominal.n_states,))
        command = finite_array("u", u, (nominal.n_inputs,))
        disturbance = finite_array("w", w, (nominal.n_disturbances,))
        change = float(self.delta(t)) * (total @ np.concatenate([state, command, [1.0], disturbance]))
        return change[: nominal.n_states], change[nominal.n_states :]
